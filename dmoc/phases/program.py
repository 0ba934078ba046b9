"""The NLP of a team of missions: those of its bodies beside each other, joined by the rows between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from dmoc.assembly.blocks import Block
from dmoc.basics.records import dataclass
from dmoc.chains.path import MissionPath
from dmoc.chains.program import MissionProgram, unit_of_cost
from dmoc.ipopt.run import Answer
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_weights
from dmoc.nlp.layout import Layout
from dmoc.nlp.units import units_of
from dmoc.phases.between import BetweenMissions
from dmoc.phases.order import called
from dmoc.phases.path import PhasedPath
from dmoc.phases.timetable import Timetable
from dmoc.scene.problem import TransferProblem
from dmoc.teams.program import felt


class Body(NamedTuple):
    """The program of one body, where its unknowns and rows are among all, and where its parameters begin."""

    program: MissionProgram
    columns: np.ndarray
    rows: np.ndarray
    parameters: int

    def moved(self, blocks: Sequence[Block]) -> list[Block]:
        """Blocks of the body among those of all."""
        return [
            Block(
                one.kernel,
                self.columns[one.columns],
                self.rows[one.targets],
                one.values,
                one.first + self.parameters,
            )
            for one in blocks
        ]


@dataclass(frozen=True)
class PhasedProgram(MissionProgram):
    """A team of missions on one mesh a phase as Ipopt sees it.

    Unknowns and rows of all legs come first, body by body; then the unknowns of joints, body by body; rows of
    joints, and behind them those between bodies. `mission` is the timetable of the team.
    """

    bodies: tuple[Body, ...] = ()

    @classmethod
    def of(  # type: ignore[override]
        cls,
        plan: Timetable,
        problems: Sequence[TransferProblem],
        path: PhasedPath,
        rounding: float | None = None,
    ) -> PhasedProgram:
        """The program of a team whose legs are these problems, on the meshes of a path."""
        parts = [path.of(i) for i in range(len(plan.cut))]
        each = [problems[i * plan.count : (i + 1) * plan.count] for i in range(len(parts))]
        cost = max(map(_cost, plan.cut, each, parts))
        programs = [
            MissionProgram.of(mission, mine, part, rounding, cost)
            for mission, mine, part in zip(plan.cut, each, parts, strict=True)
        ]
        bodies = _side_by_side(programs)
        legs = [
            replace(
                leg,
                columns=int(body.columns[leg.columns]),
                rows=int(body.rows[leg.rows]),
                parameters=body.parameters + leg.parameters,
            )
            for body in bodies
            for leg in body.program.legs
        ]
        first = legs[-1].rows + legs[-1].program.rows.size
        own, rows = {}, Layout()
        for name, body in zip(plan.names, bodies, strict=True):
            for joint, (layout, at) in body.program.own.items():
                place = int(body.columns[at]) if layout.size else 0
                own[called(name, joint)] = layout, place
            for group in body.program.rows.groups:
                told = called(name, group.name), group.kind, group.labels, group.count
                rows = rows.add(*told, group.scales, None, group.units)
        own = _in_order(own, int(legs[-1].columns + legs[-1].program.columns.size))
        writer = BetweenMissions(plan, legs, first + rows.size, _fixed(plan, bodies, legs), _kicks(plan, own))
        writer.write()
        for group in writer.rows.groups:
            rows = rows.add(group.name, group.kind, group.labels, group.count, group.scales, None, group.units)
        of_legs = [one for body in bodies for one in body.moved(body.program.blocks[: body.program.leg_blocks])]
        others = [one for body in bodies for one in body.moved(body.program.blocks[body.program.leg_blocks :])]
        return cls(
            mission=plan,  # type: ignore[arg-type]
            legs=tuple(legs),
            own=own,
            rows=rows,
            first_row=first,
            row_bounds=writer.bounds(),
            blocks=(*of_legs, *others, *writer.blocks),
            cost=cost,
            leg_blocks=len(of_legs),
            idle=path.idle,
            bodies=tuple(bodies),
        )

    @property
    def numerics(self) -> tuple[int, int]:
        """The largest order, and the steps of all phases, which all bodies share."""
        order, steps = super().numerics
        return order, steps // len(self.bodies)

    @property
    def joint_rows(self) -> int:
        """Number of rows that belong to joints; those between bodies are behind them."""
        return self.rows.size - len(self.row_bounds[0])

    def parameters(self) -> np.ndarray:
        """The parameters of all bodies [SI]."""
        return np.concatenate([body.program.parameters() for body in self.bodies])

    def bounds(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Scaled lower and upper bounds of the unknowns, then of the rows."""
        columns, rows, _ = self.sizes
        found = [np.zeros(size) for size in (columns, columns, rows, rows)]
        for i, body in enumerate(self.bodies):
            for side, mine, at in zip(
                found, body.program.bounds(), (body.columns, body.columns, body.rows, body.rows), strict=True
            ):
                side[at] = mine
            for leg in self.legs[i * self.mission.count : (i + 1) * self.mission.count] if i else ():  # type: ignore[attr-defined]
                if "duration" in leg.program.columns:
                    # The durations of the first body have the bounds of all; a second time they would depend on
                    # each other, so that here they are so wide that none is ever met.
                    place = leg.at("duration", 0)
                    found[0][place] *= 0.5
                    found[1][place] *= 2.0
        between = self.first_row + self.joint_rows
        found[2][between:], found[3][between:] = self.row_bounds
        return found[0], found[1], found[2], found[3]

    def multipliers(self, path: Any) -> tuple[np.ndarray, np.ndarray]:
        """Scaled multipliers of unknowns and rows; 0 where a path has none."""
        at_nodes = {
            name: (values * _weights(phase)[:, None]).ravel()
            for phase in map(path.phase, range(path.count))
            for name, values in phase.densities.items()
            if len(values) == len(phase.fractions)
        }
        return super().multipliers(replace(path, forces=path.forces | at_nodes))

    def path(self, answer: Answer) -> PhasedPath:
        """The paths, with multipliers, of an answer [SI]."""
        pushes = felt(self.rows.groups, answer.lam_g[self.first_row :])
        lam_g = np.concatenate([answer.lam_g[: self.first_row], pushes])
        found, plan = super().path(replace(answer, lam_g=lam_g)), self.mission
        forces, densities = dict(found.forces), {}
        weights = [_weights(leg) for leg in found.legs[: plan.count]]  # type: ignore[attr-defined]
        for group in self.rows.groups:
            if group.kind == "node":
                phase = int(group.name.rsplit(" ", 1)[1]) - 1
                densities[group.name] = (
                    forces.pop(group.name).reshape(group.count, -1) / weights[phase][:, None]
                )
        known = found.legs, found.begins, found.own, forces
        return PhasedPath(*known, idle=found.idle, densities=densities, names=plan.names, joints=plan.order)  # type: ignore[attr-defined]

    def costs(self, x: np.ndarray) -> np.ndarray:
        """What each body costs, as it is minimised [unit of the objective]."""
        values = x * self.column_scales()
        found = []
        for body in self.bodies:
            mine, parameters, total = values[body.columns], body.program.parameters(), 0.0
            for block in body.program.blocks:
                known, used = block.kernel.used
                given = mine[block.columns], block.values[known], parameters[[block.first + at for at in used]]
                total += float(ca.sum2(block.kernel.functions["cost"](*given)))
            found.append(total)
        return np.array(found)


def _cost(mission: Any, problems: Sequence[TransferProblem], path: MissionPath) -> float:
    """The unit of what a body costs."""
    sizes = [units_of(problem, leg) for problem, leg in zip(problems, path.legs, strict=True)]
    return unit_of_cost(mission, path, sizes)


def _side_by_side(programs: Sequence[MissionProgram]) -> list[Body]:
    """Where unknowns and rows of all bodies are: those of legs first, then those of joints."""
    legs = [(one.legs[-1].columns + one.legs[-1].program.columns.size, one.first_row) for one in programs]
    sizes = [one.sizes for one in programs]
    columns, rows = (int(sum(leg[side] for leg in legs)) for side in (0, 1))
    found, at = [], np.zeros(3, int)
    for one, (wide, high), (width, height, parameters) in zip(programs, legs, sizes, strict=True):
        found.append(
            Body(
                one,
                np.append(at[0] + np.arange(wide), columns + np.arange(width - wide)),
                np.append(at[1] + np.arange(high), rows + np.arange(height - high)),
                int(at[2]),
            )
        )
        at += (wide, high, parameters)
        columns, rows = columns + width - wide, rows + height - high
    return found


def _in_order(own: dict[str, tuple[Layout, int]], first: int) -> dict[str, tuple[Layout, int]]:
    """The unknowns of joints with the places where they begin, also of joints that have none."""
    found = {}
    for name, (layout, _) in own.items():
        found[name] = layout, first
        first += layout.size
    return found


def _fixed(plan: Timetable, bodies: Sequence[Body], legs: Sequence[Any]) -> np.ndarray:
    """The unknowns that bounds or the ends of missions fix."""
    found = np.zeros(sum(len(body.columns) for body in bodies), bool)
    for i, body in enumerate(bodies):
        low, high, *_ = body.program.bounds()
        found[body.columns] = low == high
        mission = plan.cut[i]
        ends = ((mission.start, legs[i * plan.count], 0), (mission.goal, legs[(i + 1) * plan.count - 1], -1))
        for end, leg, place in ends:
            at = leg.at("position", place)
            given = ~np.isnan(end.fixed()[0])
            found[at[: len(given)][given]] = True
        if not mission.joints[-1].events:
            at, given = (
                legs[(i + 1) * plan.count - 1].at("goal.velocity", 0),
                ~np.isnan(mission.goal.fixed()[1]),
            )
            found[at[: len(given)][given]] = True
    return found


def _kicks(plan: Timetable, own: dict[str, tuple[Layout, int]]) -> list[np.ndarray]:
    """The unknowns of the velocity changes at the goal of each body."""
    found = []
    for name, mission in zip(plan.names, plan.cut, strict=True):
        joint = mission.joints[-1]
        layout, first = own[called(name, joint.name)]
        places = [
            first + layout[f"event {i}"].indices[:, 0] for i, event in enumerate(joint.events) if event.pushes
        ]
        found.append(np.concatenate([np.empty(0, int), *places]))
    return found


def _weights(path: Any) -> np.ndarray:
    """The share of the duration of a phase that belongs to each node [-]."""
    return node_weights(path.mesh, scheme(path.order))
