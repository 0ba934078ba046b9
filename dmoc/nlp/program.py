"""One transfer problem on one mesh as Ipopt sees it: bounds, parameters, names, and the way there and back."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from dmoc.assembly.blocks import Assembly
from dmoc.basics.records import dataclass
from dmoc.configurations.coordinates import PLACE, Coordinates
from dmoc.configurations.of_problem import configuration_of
from dmoc.guess.chart import Chart
from dmoc.ipopt.run import Answer
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import Scheme
from dmoc.motion.mesh import node_weights
from dmoc.motion.path import DiscretePath, Key
from dmoc.nlp.layout import CONSTRAINT, LEG_MASS, LEG_START, Group, Layout
from dmoc.nlp.lesson import SENSITIVITY, SPREAD, at_start
from dmoc.nlp.placement import sensitivities
from dmoc.nlp.units import Units
from dmoc.parts.rows import alike, built_in, values_of
from dmoc.scene.problem import TransferProblem


@dataclass(frozen=True)
class Program:
    """Unknowns, rows, bounds and parameters of one transfer problem on one mesh, scaled.

    Start, goal, mass, limits and times are bounds and parameters: `bounds(problem)` and
    `parameters(problem)` give them for any problem that `accepts` lets through, without a rebuild.
    """

    problem: TransferProblem
    dynamics: Dynamics
    scheme: Scheme
    hold: bool
    mesh: np.ndarray
    units: Units
    columns: Layout
    rows: Layout
    row_bounds: tuple[np.ndarray, np.ndarray]
    assembly: Assembly
    numbers: np.ndarray
    chart: Chart | None = None

    def accepts(self, problem: TransferProblem) -> None:
        """Raise ValueError, by name, if the problem differs in more than states, mass, limits, times."""
        old = self.problem

        def each(same: Callable, new: Sequence, known: Sequence) -> bool:
            return len(new) == len(known) and all(map(same, new, known))

        same = {
            "dimension": problem.dimension == old.dimension,
            "inertia or links": configuration_of(problem) == self.dynamics.configuration,
            "effects": each(alike, problem.effects, old.effects),
            "actuator": _built_alike(problem.actuator, old.actuator),
            "objective": _equal(problem.objective, old.objective),
            "constraints": each(_built_alike, problem.constraints, old.constraints),
            "free duration": problem.free_duration == old.free_duration,
            "start": _built_alike(problem.start, old.start),
            "goal": _built_alike(problem.goal, old.goal),
        }
        if changed := [name for name, equal in same.items() if not equal]:
            raise ValueError(f"this NLP was built for another {', '.join(changed)}; transcribe the new problem")

    def parameters(self, problem: TransferProblem) -> np.ndarray:
        """The NLP's parameter vector for a problem [SI], with the numbers of its units and mesh behind."""
        fixed = [] if problem.free_duration else [problem.duration_bounds[0]]
        head = [*self.units.origin, problem.start_time, problem.mass, *fixed]
        return np.concatenate([head, *[values_of(part) for part in problem.adjustable_parts], self.numbers])

    def bounds(self, problem: TransferProblem) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Scaled lower and upper bounds of the unknowns, then of the rows."""
        low, high = (side.copy() for side in self.row_bounds)
        self._release(problem, low, high)
        return *self.column_bounds(problem), low, high

    def column_bounds(self, problem: TransferProblem) -> tuple[np.ndarray, np.ndarray]:
        """Scaled lower and upper bounds of the unknowns."""
        lower, upper = np.full(self.columns.size, -np.inf), np.full(self.columns.size, np.inf)

        def put(name: str, low, high) -> None:
            group = self.columns[name]
            lower[group.start : group.stop] = np.broadcast_to(low, (group.count, len(group.labels))).ravel()
            upper[group.start : group.stop] = np.broadcast_to(high, (group.count, len(group.labels))).ravel()

        n, origin = problem.dimension, self.units.origin
        put("position", *(side - origin for side in self._walls(problem)))
        put("force", *problem.actuator.bounds(n))
        if problem.free_duration:
            put("duration", *problem.duration_bounds)
        if problem.actuator.burns:
            put("mass", problem.actuator.dry_mass, np.inf)
            lower[self.columns["mass"].start] = upper[self.columns["mass"].start] = problem.mass
        for end, name, place in ((problem.start, "start", 0), (problem.goal, "goal", -1)):
            position, velocity = end.fixed()
            _fix(lower, upper, self.columns["position"].indices[:, place], position - origin)
            _fix(lower, upper, self.columns[f"{name}.velocity"].indices[:, 0], velocity)
        if SENSITIVITY in self.columns:
            _fix(lower, upper, self.columns[SENSITIVITY].indices[:, 0], at_start(problem))
            put(SPREAD, 0.0, np.inf)
        scale = self.columns.scales()
        return lower / scale, upper / scale

    def _walls(self, problem: TransferProblem) -> list[np.ndarray]:
        """Lower and upper bounds of the coordinates, by the boxes that places keep to."""
        sides: list[list[np.ndarray]] = [[], []]
        for block in self.dynamics.configuration.coordinates.blocks:
            mine = [one for one in problem.constraints if one.on == block.body and block.kind == PLACE]
            boxes = [one.bounds(block.size) for one in mine]
            for side, found in zip(sides, _intersection(boxes, block.size), strict=True):
                side.append(found)
        # A box that changes along the path has a row a node.
        heads = [np.broadcast_shapes(*(part.shape[:-1] for part in side)) for side in sides]
        return [
            np.concatenate([np.broadcast_to(part, (*head, part.shape[-1])) for part in side], axis=-1)
            for head, side in zip(heads, sides, strict=True)
        ]

    def _release(self, problem: TransferProblem, low: np.ndarray, high: np.ndarray) -> None:
        """Free the limits on a boundary state that is fixed as a whole: no unknown is left there to meet them.

        Whether such a state keeps the limits is checked when the problem is made.
        """
        for end, place in (("start", 0), ("goal", -1)):
            position, velocity = getattr(problem, end).fixed()
            for group in self.rows.groups:
                if group.name == CONSTRAINT:
                    met = group.indices[~_open(self.dynamics, position), place]
                    low[met], high[met] = -np.inf, np.inf
                elif group.owner and group.owner.field == "links" and group.kind == "node":
                    if not _looks_at(group.owner.of(problem), self.dynamics, np.isnan(position)):
                        low[group.indices[:, place]], high[group.indices[:, place]] = -np.inf, np.inf
                elif group.kind == "node" and not np.isnan(position[self._of_owner(problem, group, 0)]).any():
                    low[group.indices[:, place]], high[group.indices[:, place]] = -np.inf, np.inf
                if (
                    group.owner
                    and group.owner.end == end
                    and not np.isnan(velocity[self._of_owner(problem, group, 1)]).any()
                ):
                    low[group.indices], high[group.indices] = -np.inf, np.inf

    def _of_owner(self, problem: TransferProblem, group: Group, kind: int) -> np.ndarray:
        """Which coordinates (0) or velocities (1) belong to the bodies that the owner of some rows limits."""
        made = self.dynamics.configuration.coordinates
        names = {block.body for block in made.blocks}
        if group.owner and group.owner.field == "constraints":
            names = set(group.owner.of(problem).bodies)
        return np.any([made.of_body(name)[kind] for name in names], axis=0)

    def objective(self, scaled: float) -> float:
        """The objective in its own unit and sign."""
        return self.problem.objective.sense * scaled * self.units.cost

    def scaled(self, values: Mapping[str, Any], flat: Callable, join: Callable) -> Any:
        """Scaled unknowns from the SI values of each group, of any kind that `flat` and `join` put in a row.

        `values` may be arrays of shape (count, components) with NumPy's functions, or CasADi matrices of
        shape (components, count) with CasADi's: in memory both have the components of one index together.
        """
        return join([flat(values[group.name]) for group in self.columns.groups]) / join([self.columns.scales()])

    def pack(self, path: DiscretePath, begin: float = 0.0) -> np.ndarray:
        """Scaled unknowns of a path that stands on this mesh; `begin` is its time [s] where that is unknown."""
        values = {
            LEG_START: np.array([begin]),
            LEG_MASS: path.mass[:1],
            "position": path.position - self.units.origin,
            "force": path.control,
            "mass": path.mass,
            "start.velocity": path.start_velocity,
            "goal.velocity": path.goal_velocity,
            "duration": path.duration,
            "reaction": np.zeros(self.columns["reaction"].scales.shape if "reaction" in self.columns else 0)
            if path.reaction is None
            else path.reaction,
        }
        if SENSITIVITY in self.columns:
            values |= sensitivities(self, values, self.parameters(self.problem))
        return self.scaled(values, np.ravel, np.concatenate)

    def unpack(self, x: np.ndarray, problem: TransferProblem) -> DiscretePath:
        """SI path of scaled unknowns."""
        values = np.asarray(x).ravel() * self.columns.scales()
        get = {group.name: group.of(values) for group in self.columns.groups}
        nodes = self.columns["position"].count
        constant = get[LEG_MASS].item() if LEG_MASS in get else problem.mass
        return DiscretePath(
            self.mesh,
            self.scheme.order,
            self.hold,
            float(get["duration"].item()) if "duration" in get else problem.duration_bounds[0],
            get["position"] + self.units.origin,
            get["force"],
            get["mass"][:, 0] if "mass" in get else np.full(nodes, constant),
            get["start.velocity"][0],
            get["goal.velocity"][0],
            made_of=self.made_of,
            reaction=get.get("reaction"),
        )

    @property
    def made_of(self) -> Coordinates | None:
        """Of what parts q is made, where there is more than one place."""
        body = self.dynamics.configuration
        return body.coordinates if len(body.coordinates.blocks) > 1 or body.surplus else None

    @cached_property
    def densities(self) -> list[tuple[Key, Group, np.ndarray]]:
        """Key, group and the SI value of a scaled multiplier of 1, of every group.

        A multiplier of which there is one a node or a step is divided by the share of the duration that belongs
        to it: such a density does not change with the mesh.
        """
        shares = {"node": node_weights(self.mesh, self.scheme), "step": np.diff(self.mesh)}
        shares["control"] = shares["step" if self.hold else "node"]
        found = []
        for layout, side in ((self.columns, "column"), (self.rows, "row")):
            for group in layout.groups:
                share = shares.get(group.kind, np.ones(group.count))[:, None]
                scale = 1 / group.scales if side == "column" else group.scales
                found.append((Key(group.kind, side, group.name), group, self.units.cost * scale / share))
        return found

    def path(self, problem: TransferProblem, answer: Answer) -> DiscretePath:
        """SI path and multipliers of an answer."""
        sides = {"column": answer.lam_x, "row": answer.lam_g}
        multipliers = {key: group.of(sides[key.side]) * unit for key, group, unit in self.densities}
        return replace(self.unpack(answer.x, problem), multipliers=multipliers)

    def multipliers(self, path: DiscretePath) -> tuple[np.ndarray, np.ndarray]:
        """Scaled multipliers of unknowns and rows; 0 where a path has none."""
        sides = {"column": np.zeros(self.columns.size), "row": np.zeros(self.rows.size)}
        for key, group, unit in self.densities:
            if key in path.multipliers:
                sides[key.side][group.start : group.stop] = (path.multipliers[key] / unit).ravel()
        return sides["column"], sides["row"]

    def violations(
        self, problem: TransferProblem, x: Any, g: Any, count: int = 10
    ) -> list[tuple[Group, int, float]]:
        """The most violated rows and bounds, worst first: group, place in its layout, scaled violation."""
        lbx, ubx, lbg, ubg = self.bounds(problem)
        excess = [
            np.nan_to_num(np.maximum(low - value, value - high), nan=np.inf)
            for value, low, high in ((np.ravel(g), lbg, ubg), (np.ravel(x), lbx, ubx))
        ]
        both, rows = np.concatenate(excess), self.rows.size
        worst = [int(place) for place in np.argsort(-both)[:count] if both[place] > 0]
        places = [(self.rows, i) if i < rows else (self.columns, i - rows) for i in worst]
        return [
            (layout.group_at(at), at, float(both[i])) for i, (layout, at) in zip(worst, places, strict=True)
        ]


def _built_alike(new: Any, old: Any) -> bool:
    """Whether two parts make the same rows.

    A user's own part that names nothing adjustable may build any of its numbers into its rows: it must be
    equal in all of them.
    """
    structure = [(type(part), getattr(part, "structure", None)) for part in (new, old)]
    known = type(new).__module__.startswith("dmoc.")
    return structure[0] == structure[1] and (known or built_in(new) == built_in(old))


def _equal(new: Any, old: Any) -> bool:
    """Whether two parts have equal attributes, those included that are no fields of a dataclass."""
    return type(new) is type(old) and vars(new) == vars(old)


def _open(dynamics: Dynamics, position: np.ndarray) -> np.ndarray:
    """Which entries of the constraint g look at an entry of a boundary position that is free (NaN)."""
    return np.array([np.isnan(position[at]).any() for at in dynamics.configuration.coordinates.quaternions])


def _looks_at(link: Any, dynamics: Dynamics, free: np.ndarray) -> bool:
    """Whether a link looks at a coordinate of a boundary position that is free."""
    q = ca.SX.sym("q", len(free))
    g = ca.SX(link.g_of(dynamics.configuration.at(q, ca.SX.zeros(len(free)), 1.0)))
    return any(ca.which_depends(g, q[i], 1, True)[0] for i in np.flatnonzero(free))


def _fix(lower: np.ndarray, upper: np.ndarray, places: np.ndarray, values: np.ndarray) -> None:
    """Set both bounds of some unknowns to values, except where a value is NaN: free."""
    known = ~np.isnan(values)
    lower[places[known]] = upper[places[known]] = values[known]


def _intersection(boxes: list, dimension: int) -> tuple[np.ndarray, np.ndarray]:
    lower = np.max([low for low, _ in boxes] or [np.full(dimension, -np.inf)], axis=0)
    upper = np.min([high for _, high in boxes] or [np.full(dimension, np.inf)], axis=0)
    return lower, upper
