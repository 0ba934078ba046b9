"""A transfer problem and a mesh become one sparse NLP: units, names, bounds, and the way back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import entries, flag, number, of_kind, short, whole
from dmoc.basics.memory import remembered
from dmoc.guess.starting import starting_guess
from dmoc.motion.dynamics import Dynamics, state_symbols
from dmoc.motion.lobatto import Scheme, scheme
from dmoc.motion.mesh import uniform_mesh
from dmoc.motion.path import DiscretePath
from dmoc.nlp.assembly import Assembly, assemble
from dmoc.nlp.blocks import Transcript
from dmoc.nlp.layout import Layout
from dmoc.scene.problem import TransferProblem
from dmoc.scene.rows import values_of


@dataclass(frozen=True)
class Units:
    """Canonical units [m, s, N, kg, unit of the objective] and the origin [m]; Ipopt sees numbers near 1."""

    length: float
    time: float
    force: float
    mass: float
    cost: float
    origin: np.ndarray


@dataclass(frozen=True)
class NLP:
    """One transfer problem on one mesh, as Ipopt sees it.

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

    def accepts(self, problem: TransferProblem) -> None:
        """Raise ValueError, by name, if the problem differs in more than states, mass, limits, times."""
        old = self.problem

        def each(alike: Callable, new: Sequence, known: Sequence) -> bool:
            return len(new) == len(known) and all(map(alike, new, known))

        same = {
            "dimension": problem.dimension == old.dimension,
            "effects": each(_equal, problem.effects, old.effects),
            "actuator": _built_alike(problem.actuator, old.actuator),
            "objective": _equal(problem.objective, old.objective),
            "constraints": each(_built_alike, problem.constraints, old.constraints),
            "free duration": problem.free_duration == old.free_duration,
            "start": _built_alike(problem.start, old.start),
            "goal": _built_alike(problem.goal, old.goal),
        }
        changed = [name for name, equal in same.items() if not equal]
        if changed:
            raise ValueError(f"this NLP was built for another {', '.join(changed)}; transcribe the new problem")

    def parameters(self, problem: TransferProblem) -> np.ndarray:
        """The NLP's parameter vector for a problem [SI]."""
        fixed = [] if problem.free_duration else [problem.duration_bounds[0]]
        head = [*self.units.origin, problem.start_time, problem.mass, *fixed]
        return np.concatenate([head, *[values_of(part) for part in problem.adjustable_parts]])

    def bounds(self, problem: TransferProblem) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Scaled lower and upper bounds of the unknowns, then of the rows."""
        lower, upper = np.full(self.columns.size, -np.inf), np.full(self.columns.size, np.inf)

        def put(name: str, low, high) -> None:
            group = self.columns[name]
            lower[group.start : group.stop] = np.broadcast_to(low, (group.count, len(group.labels))).ravel()
            upper[group.start : group.stop] = np.broadcast_to(high, (group.count, len(group.labels))).ravel()

        n, origin = problem.dimension, self.units.origin
        boxes = [constraint.bounds(n) for constraint in problem.constraints]
        put("position", *(np.array(side) - origin for side in _intersection(boxes, n)))
        put("force", *problem.actuator.bounds(n))
        if problem.free_duration:
            put("duration", *problem.duration_bounds)
        if problem.actuator.burns:
            put("mass", problem.actuator.dry_mass, np.inf)
            lower[self.columns["mass"].start] = upper[self.columns["mass"].start] = problem.mass
        for end, name, place in ((problem.start, "start", 0), (problem.goal, "goal", -1)):
            position, velocity = end.fixed()
            places = self.columns["position"].indices[:, place]
            _fix(lower, upper, places, position - origin)
            _fix(lower, upper, self.columns[f"{name}.velocity"].indices[:, 0], velocity)
        scale = self.columns.scales()
        low, high = (side.copy() for side in self.row_bounds)
        self._release(problem, low, high)
        return lower / scale, upper / scale, low, high

    def _release(self, problem: TransferProblem, low: np.ndarray, high: np.ndarray) -> None:
        """Free the limits on a boundary state that is fixed as a whole: nothing is left there to move.

        Whether such a state keeps the limits is checked when the problem is made.
        """
        for end, place in (("start", 0), ("goal", -1)):
            position, velocity = getattr(problem, end).fixed()
            for group in self.rows.groups:
                if group.kind == "node" and not np.isnan(position).any():
                    low[group.indices[:, place]], high[group.indices[:, place]] = -np.inf, np.inf
                if group.name == f"{end}.speed" and not np.isnan(velocity).any():
                    low[group.indices], high[group.indices] = -np.inf, np.inf

    def objective(self, scaled: float) -> float:
        """The objective in its own unit and sign."""
        return self.problem.objective.sense * scaled * self.units.cost

    def pack(self, guess: DiscretePath) -> np.ndarray:
        """Scaled unknowns of a guess that stands on this mesh."""
        parts = {
            "position": guess.position - self.units.origin,
            "force": guess.control,
            "mass": guess.mass,
            "start.velocity": guess.start_velocity,
            "goal.velocity": guess.goal_velocity,
            "duration": guess.duration,
        }
        return (
            np.concatenate([np.ravel(parts[group.name]) for group in self.columns.groups])
            / self.columns.scales()
        )

    def unpack(self, x: np.ndarray, problem: TransferProblem) -> DiscretePath:
        """SI path of scaled unknowns."""
        values = np.asarray(x).ravel() * self.columns.scales()
        get = {group.name: group.of(values) for group in self.columns.groups}
        nodes = self.columns["position"].count
        return DiscretePath(
            self.mesh,
            self.scheme.order,
            self.hold,
            float(get["duration"].item()) if "duration" in get else problem.duration_bounds[0],
            get["position"] + self.units.origin,
            get["force"],
            get["mass"][:, 0] if "mass" in get else np.full(nodes, problem.mass),
            get["start.velocity"][0],
            get["goal.velocity"][0],
        )


def transcribe(
    problem: TransferProblem,
    steps: int | None = None,
    order: int = 2,
    hold: bool = False,
    mesh: np.ndarray | None = None,
    guess: Any = None,
) -> NLP:
    """The NLP of a problem on a mesh.

    Parameters
    ----------
    steps : int
        Number of equal steps, at least 2; or give `mesh`.
    order : int
        2, 4, 6 or 8.
    hold : bool
        Forces constant over each step instead of one at each node.
    mesh : sequence of float
        Step ends as increasing fractions 0..1 of the duration.
    guess
        Path that fixes the units, see `TransferProblem`; the problem's own if not given.

    Raises
    ------
    ValueError
        If the mesh has fewer than 2 steps or does not increase from 0 to 1.
    """
    of_kind("problem", problem, TransferProblem)
    start = starting_guess(problem, check_mesh(steps, mesh), order, flag("hold", hold), guess)
    return transcribe_onto(problem, start, units_of(problem, start))


def transcribe_onto(problem: TransferProblem, guess: DiscretePath, units: Units, compiled: bool = False) -> NLP:
    """The NLP on the mesh, order and kind of control of a guess."""
    rule = scheme(guess.order)
    script = Transcript(problem, rule, guess.hold, guess.mesh, units)
    columns, rows = script.columns, script.rows
    scales = columns.scales(), rows.scales(), 1 / units.cost
    assembly = assemble(script.blocks, *scales, script.parameter_count, compiled)
    return NLP(
        problem,
        Dynamics.of(problem),
        rule,
        guess.hold,
        guess.mesh,
        units,
        columns,
        rows,
        script.row_bounds,
        assembly,
    )


def check_mesh(steps: int | None, mesh: Any = None) -> np.ndarray:
    """Step ends as fractions, from a number of steps or as given."""
    if mesh is None:
        return uniform_mesh(whole("steps", steps, least=2))
    ends = np.array([number("mesh", end, "-") for end in entries(mesh) or ()])
    if ends.ndim != 1 or len(ends) < 3 or ends[0] != 0 or ends[-1] != 1 or not (np.diff(ends) > 0).all():
        raise ValueError(f"mesh must be at least 3 increasing fractions from 0 to 1; got {short(mesh)}")
    return ends


def units_of(problem: TransferProblem, guess: DiscretePath) -> Units:
    """Canonical units of a problem near a path.

    Length: extent of the path, origin at its centre. Time: the duration. Force: the largest used
    where a solution is known, else the limit, else what moves the mass that far in that time, or without
    effects what turns it round.
    Cost: what the objective is on the path, or would be with the unit of force all the way.
    """
    low, high = guess.position.min(axis=0), guess.position.max(axis=0)
    time = guess.duration
    speed = max(np.abs(guess.start_velocity).max(), np.abs(guess.goal_velocity).max())
    length = float(np.linalg.norm(high - low)) or float(speed * time) or 1.0
    change = length / time
    if not problem.effects:
        # nothing else turns the body round
        mean = (guess.position[-1] - guess.position[0]) / time
        turns = np.array([guess.start_velocity, guess.goal_velocity]) - mean
        change = max(change, float(np.linalg.norm(turns, axis=1).max()))
    typical = problem.mass * change / time
    limit = problem.actuator.force_limit()
    force = float(np.abs(guess.control).max(initial=0.0)) if guess.multipliers else 0.0
    if limit is not None:
        force = min(max(force, 1e-3 * limit), limit) if force else limit
    force = force or typical
    cost = max(abs(_cost(problem, guess, 0.0)), abs(_cost(problem, guess, force))) or 1.0
    return Units(length, time, force, problem.mass, cost, 0.5 * (low + high))


def _cost(problem: TransferProblem, guess: DiscretePath, force: float) -> float:
    """About the objective along a guess, with `force` [N] in place of its controls if that is not zero."""
    parts = problem.dimension, problem.objective, problem.actuator
    rate, terminal = remembered(partial(_cost_functions, problem), "cost", *parts)
    # a few hundred nodes tell the size
    some = np.linspace(0, len(guess.position) - 1, min(len(guess.position), 400)).astype(int)
    times = problem.start_time + guess.duration * guess.fractions[some]
    velocity = np.gradient(guess.position[some], times, axis=0)
    nodes = np.searchsorted(guess.mesh, guess.fractions[some], side="right") - 1
    control = guess.control[np.minimum(nodes, len(guess.mesh) - 2)] if guess.hold else guess.control[some]
    control = np.full_like(control, force) if force else control
    rates = rate(times[None], guess.position[some].T, velocity.T, control.T, guess.mass[some][None])
    end = terminal(times[-1], guess.position[-1], guess.goal_velocity, guess.mass[-1])
    return float(np.trapezoid(np.array(rates).ravel(), times)) + float(end)


def _cost_functions(problem: TransferProblem) -> tuple[ca.Function, ca.Function]:
    """(t, q, v, u, m) -> running cost, (t, q, v, m) -> cost of the end."""
    t, q, v, m = state_symbols(problem.dimension)
    u = ca.SX.sym("u", problem.actuator.size(problem.dimension))
    rate = problem.objective.rate(problem.actuator, t, q, v, u, m)
    terminal = ca.Function("terminal", [t, q, v, m], [problem.objective.terminal(t, q, v, m)])
    return ca.Function("rate", [t, q, v, u, m], [rate]), terminal


def _built_alike(new: Any, old: Any) -> bool:
    """Whether two parts make the same rows; a user's own may build in what it does not call adjustable."""
    structure = [(type(part), getattr(part, "structure", None)) for part in (new, old)]
    open_to_change = type(new).__module__.startswith("dmoc.") or new.adjustable
    return structure[0] == structure[1] and (open_to_change or _equal(new, old))


def _equal(new: Any, old: Any) -> bool:
    """Equal in fields and in what a user's own class has beside those that it inherits."""
    return type(new) is type(old) and vars(new) == vars(old)


def _fix(lower: np.ndarray, upper: np.ndarray, places: np.ndarray, values: np.ndarray) -> None:
    known = ~np.isnan(values)
    lower[places[known]] = upper[places[known]] = values[known]


def _intersection(boxes: list, dimension: int) -> tuple[np.ndarray, np.ndarray]:
    lower = np.max([low for low, _ in boxes] or [np.full(dimension, -np.inf)], axis=0)
    upper = np.min([high for _, high in boxes] or [np.full(dimension, np.inf)], axis=0)
    return lower, upper
