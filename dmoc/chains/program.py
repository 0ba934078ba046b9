"""The NLP of a mission: the transcripts of its legs beside each other, joined by a few rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from operator import attrgetter
from typing import Any

import casadi as ca
import numpy as np

from dmoc.assembly.blocks import Assembly, Block, Scaling
from dmoc.assembly.symbolic import assemble
from dmoc.basics.records import dataclass
from dmoc.chains.again import assembled_again, kernel_again
from dmoc.chains.joining import Given, JointWriter, end_parameters, own_unknowns
from dmoc.chains.path import MissionPath, joint_cost
from dmoc.chains.whole import WHOLE, put_spans, row_to_drop, whole_rows, with_rows
from dmoc.chains.within import Placed, leg_program, open_leg, polynomial_block, polynomial_rows
from dmoc.ipopt.options import NEAR, rounding, settings_for
from dmoc.ipopt.run import Answer, Watch, make_solver, run
from dmoc.nlp.layout import LEG_START, Layout
from dmoc.nlp.transcription import MOST_HELD_NODES
from dmoc.nlp.units import Units, units_of
from dmoc.scene.mission import Mission
from dmoc.scene.problem import TransferProblem

# The barrier parameter and the distances from limits begin with this where a path is nearly an answer [-].
CLOSE = 1e-6


@dataclass(frozen=True)
class MissionProgram:
    """A mission on one set of meshes as Ipopt sees it.

    Unknowns and rows of the legs come first, leg by leg; then the unknowns of the joints and their rows.
    """

    mission: Mission
    legs: tuple[Placed, ...]
    own: dict[str, tuple[Layout, int]]
    rows: Layout
    first_row: int
    row_bounds: tuple[np.ndarray, np.ndarray]
    blocks: tuple[Block, ...]
    cost: float
    leg_blocks: int
    idle: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        mission: Mission,
        problems: Sequence[TransferProblem],
        path: MissionPath,
        rounding: float | None = None,
        cost: float = 0.0,
    ) -> MissionProgram:
        """The program of a mission whose legs are these problems, on the meshes of a path.

        The size of an impulse is rounded at zero over the part `rounding` of the unit of speed [-]. The unit of
        the objective is `cost`, or what the path costs if that is not given.
        """
        sizes = [units_of(problem, leg) for problem, leg in zip(problems, path.legs, strict=True)]
        cost = cost or unit_of_cost(mission, path, sizes)
        legs, blocks, at = [], [], np.zeros(3, int)
        for problem, leg, unit in zip(problems, path.legs, sizes, strict=True):
            program, mine, parameters = leg_program(problem, leg, replace(unit, cost=cost))
            legs.append(Placed(program, *map(int, at)))
            blocks += [block.moved(*map(int, at)) for block in mine]
            at += (program.columns.size, program.rows.size, parameters)
        columns, first_row, leg_blocks = int(at[0]), int(at[1]), len(blocks)
        own, rows, writers, given = {}, Layout(), [], Given(mission, legs, int(at[2]))
        bounds: list[tuple[np.ndarray, np.ndarray]] = []
        for joint in mission.joints:
            beside = legs[joint.right if joint.left is None else joint.left].program  # type: ignore[index]
            layout = own_unknowns(joint, beside, mission.mass)
            own[joint.name] = (layout, columns)
            writer = JointWriter(mission, joint, legs, own[joint.name], given, rounding)
            writer.write()
            columns += layout.size
            rows = with_rows(rows, joint.name, writer.rows, beside.units, bounds)
            writers.append(writer)
        whole, places, expressions = whole_rows(mission, legs, row_to_drop(mission, legs, path), given)
        rows = with_rows(
            rows, WHOLE, whole, max((leg.program.units for leg in legs), key=attrgetter("time")), bounds
        )
        blocks += [
            writer.written(rows, first_row)
            for writer in writers
            if writer.rows or not ca.SX(writer.cost).is_zero()
        ]
        if whole:
            symbols = expressions, ca.SX(0, 1), given.parameters
            made = kernel_again("mission", *symbols, ca.vertcat(*[r.expression for r in whole]), ca.SX(0))
            blocks.append(Block(made, places[:, None], first_row + rows[WHOLE].indices, np.empty((0, 1))))
        for placed, plan, name in zip(legs, mission.plan, mission.leg_names, strict=True):
            smooth, controls, weights = polynomial_rows(placed, plan)
            rows = with_rows(rows, group := f"controls of {name}", smooth, placed.program.units, bounds)
            if smooth:
                blocks.append(polynomial_block(controls, weights, first_row + rows[group].indices.T))
        lower, upper = (np.concatenate([np.empty(0), *side]) for side in zip(*bounds, strict=True))
        return cls(
            mission,
            tuple(legs),
            own,
            rows,
            first_row,
            (lower, upper),
            tuple(blocks),
            cost,
            leg_blocks,
            path.idle,
        )

    @property
    def sizes(self) -> tuple[int, int, int]:
        """Numbers of unknowns, rows and parameters."""
        last = self.legs[-1]
        columns = last.columns + last.program.columns.size + sum(layout.size for layout, _ in self.own.values())
        return columns, self.first_row + self.rows.size, len(self.parameters())

    @property
    def joint_rows(self) -> int:
        """Number of rows that belong to joints and to the mission as a whole."""
        return self.rows.size

    @property
    def numerics(self) -> tuple[int, int]:
        """The largest order among the legs, and the steps of all."""
        orders = max(leg.program.scheme.order for leg in self.legs)
        return orders, sum(len(leg.program.mesh) - 1 for leg in self.legs)

    def column_scales(self) -> np.ndarray:
        """Scale of every unknown."""
        parts = [leg.program.columns.scales() for leg in self.legs]
        return np.concatenate([*parts, *[layout.scales() for layout, _ in self.own.values()]])

    def row_scales(self) -> np.ndarray:
        """Scale of every row."""
        return np.concatenate([*[leg.program.rows.scales() for leg in self.legs], self.rows.scales()])

    def assembly(self, compiled: bool = False) -> Assembly:
        """The functions of the NLP with their sparse derivatives; with `compiled` as machine code."""
        return assemble(self.blocks, self.scaling, self.sizes[2], compiled)

    @cached_property
    def scaling(self) -> Scaling:
        """The numbers of units and meshes."""
        return Scaling.of(self.blocks, self.column_scales(), self.row_scales(), 1 / self.cost)

    def _held(self, compiled: bool) -> Assembly:
        """As `assembly`, with units and meshes as parameters, which serves programs of the same structure."""
        if sum(leg.program.columns["position"].count for leg in self.legs) > MOST_HELD_NODES:
            return self.assembly(compiled)
        return assembled_again(self.blocks, self.scaling, self.sizes[2], compiled)

    def parameters(self) -> np.ndarray:
        """The parameters of all legs, then of both ends [SI]."""
        each = [leg.program.parameters(leg.program.problem) for leg in self.legs]
        return np.concatenate([*each, end_parameters(self.mission)])

    def bounds(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Scaled lower and upper bounds of the unknowns, then of the rows."""
        parts = [list(leg.program.bounds(leg.program.problem)) for leg in self.legs]
        for i, sides in enumerate(parts):
            open_leg(self.mission, self.legs, i, sides)
        free = np.full(sum(layout.size for layout, _ in self.own.values()), np.inf)
        first = self.sizes[0] - len(free)
        for place in self.idle_places():
            free[place - first] = 0.0
        lower, upper, low, high = (list(side) for side in zip(*parts, strict=True))
        joined = [side.copy() for side in self.row_bounds]
        put_spans(self.mission, len(self.legs), self.rows, joined)
        return (
            np.concatenate([*lower, -free]),
            np.concatenate([*upper, free]),
            np.concatenate([*low, joined[0]]),
            np.concatenate([*high, joined[1]]),
        )

    def idle_places(self) -> list[int]:
        """The unknowns of impulses that are none and stay none."""
        found = []
        for name in self.idle:
            layout, begin = self.own[name]
            groups = [group for group in layout.groups if group.name.startswith("event")]
            found += [begin + place for group in groups for place in range(group.start, group.stop)]
        return found

    def pack(self, path: MissionPath) -> np.ndarray:
        """Scaled unknowns of a path on these meshes."""
        parts = [
            placed.program.pack(leg, begin)
            for placed, leg, begin in zip(self.legs, path.legs, path.begins, strict=True)
        ]
        for name, (layout, _) in self.own.items():
            values = path.own.get(name, np.zeros(0))
            parts.append((values if len(values) == layout.size else np.zeros(layout.size)) / layout.scales())
        return np.concatenate(parts)

    def multipliers(self, path: MissionPath) -> tuple[np.ndarray, np.ndarray]:
        """Scaled multipliers of unknowns and rows; 0 where a path has none."""
        pairs = [placed.program.multipliers(leg) for placed, leg in zip(self.legs, path.legs, strict=True)]
        rows = [np.zeros(0)]
        for group in self.rows.groups:
            known = path.forces.get(group.name, np.zeros(0))
            count = group.stop - group.start
            size = known if len(known) == count else np.zeros(count)
            rows.append(size / (group.scales.ravel() * self.cost))
        own = np.zeros(self.sizes[0] - sum(len(pair[0]) for pair in pairs))
        return np.concatenate([*[p[0] for p in pairs], own]), np.concatenate([*[p[1] for p in pairs], *rows])

    def path(self, answer: Answer) -> MissionPath:
        """The paths, with multipliers, of an answer [SI]."""
        legs, begins = [], []
        for placed in self.legs:
            program = placed.program
            columns = slice(placed.columns, placed.columns + program.columns.size)
            rows = slice(placed.rows, placed.rows + program.rows.size)
            x = answer.x[columns]
            mine = replace(answer, x=x, lam_x=answer.lam_x[columns], lam_g=answer.lam_g[rows], g=answer.g[rows])
            legs.append(program.path(program.problem, mine))
            begins.append(float(x[program.columns[LEG_START].start] * program.units.time))
        values = answer.x * self.column_scales()
        own = {name: values[at : at + layout.size] for name, (layout, at) in self.own.items() if layout.size}
        forces = {
            group.name: answer.lam_g[self.first_row + group.start : self.first_row + group.stop]
            * group.scales.ravel()
            * self.cost
            for group in self.rows.groups
        }
        return MissionPath(tuple(legs), tuple(begins), own, forces, idle=self.idle)

    def solve(
        self,
        path: MissionPath,
        settings: dict[str, Any],
        options: dict[str, Any],
        watch: Watch | None = None,
        carried: bool = False,
        compiled: bool = False,
    ) -> Answer:
        """One run of Ipopt from a path on these meshes, with these settings and the user's options."""
        lbx, ubx, lbg, ubg = self.bounds()
        lam_x, lam_g = self.multipliers(path)
        assembly = self._held(compiled)
        settings = self.settings(path.warm, carried, path.near) | settings
        solver = make_solver(assembly, settings, options, watch)
        given = {"x0": np.clip(self.pack(path), lbx, ubx), "lam_x0": lam_x, "lam_g0": lam_g}
        parameters = np.concatenate([self.parameters(), assembly.numbers(self.scaling)])
        bounds = {"lbx": lbx, "ubx": ubx, "lbg": lbg, "ubg": ubg, "p": parameters}
        return run(solver, self._rounding, **given, **bounds)

    @property
    def _rounding(self) -> float:
        return max(rounding(leg.program.mesh, leg.program.scheme.degree) for leg in self.legs)

    def settings(self, warm: bool, carried: bool, near: bool = False) -> dict[str, Any]:
        """Options of Ipopt: those of the legs, the loosest tolerance among them."""
        each = [
            settings_for(leg.program.problem, leg.program.mesh, leg.program.scheme.degree, warm, carried)
            for leg in self.legs
        ]
        merged: dict[str, Any] = {name: value for settings in each for name, value in settings.items()}
        if near and not warm:
            # A barrier of the usual size would lead away from a path that is nearly an answer.
            merged |= dict.fromkeys(NEAR, CLOSE)
        return merged | {"ipopt.tol": max(settings["ipopt.tol"] for settings in each)}

    def name_of(self, place: int, column: bool) -> str:
        """The name of an unknown or a row, with that of its leg or joint."""
        for placed, name in zip(self.legs, self.mission.leg_names, strict=True):
            layout = placed.program.columns if column else placed.program.rows
            first = placed.columns if column else placed.rows
            if first <= place < first + layout.size:
                return f"{name}: {layout.name_of(place - first)}"
        if column:
            found = next((n, a, i) for n, (a, i) in self.own.items() if i <= place < i + a.size)
            return f"{found[0]}: {found[1].name_of(place - found[2])}"
        return self.rows.name_of(place - self.first_row)

    def worst(self, x: np.ndarray, g: np.ndarray, count: int = 10) -> list[tuple[float, int, bool]]:
        """The most violated rows and bounds, worst first: scaled size, place, and whether it is an unknown."""
        lbx, ubx, lbg, ubg = self.bounds()
        found = []
        for values, low, high, column in ((x, lbx, ubx, True), (g, lbg, ubg, False)):
            excess = np.nan_to_num(np.maximum(low - values, values - high), nan=np.inf)
            found += [(float(excess[i]), int(i), column) for i in np.argsort(-excess)[:count] if excess[i] > 0]
        return sorted(found, reverse=True)[:count]


def unit_of_cost(mission: Mission, path: MissionPath, sizes: Sequence[Units]) -> float:
    """About what a path costs, by the units of its legs and what its joints cost."""
    return max(joint_cost(mission, path), *[unit.cost for unit in sizes if unit.cost != 1.0], 0.0) or 1.0
