"""A nonlinear programme at its answer, with exact derivatives by unknowns and parameters, block by block."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np
from scipy import sparse

from dmoc.assembly.blocks import Block
from dmoc.assembly.kernel import Kernel
from dmoc.basics.memory import Shelf
from dmoc.basics.records import dataclass
from dmoc.nlp.transcription import unassembled
from dmoc.nlp.units import units_of
from dmoc.planners.numbers import Numbers, numbers_of_team
from dmoc.sensitivity.constants import with_open_effects

# The derivatives by parameters of so many kernels are held in this process.
_BY_PARAMETERS = Shelf(50)


@dataclass(frozen=True)
class Optimum:
    """Scaled unknowns x, parameters p, rows' multipliers and bounds of a programme at its answer.

    Multipliers have CasADi's sign: f + lam_g . g + lam_x . x is stationary, and they are positive at upper
    bounds. `unit` is what one of the scaled objective stands for, with the sign of the problem's own.
    `program` and `path` are those of the transfer or the mission.
    """

    program: Any
    path: Any
    blocks: tuple[Block, ...]
    numbers: Numbers
    x: np.ndarray
    p: np.ndarray
    lam_x: np.ndarray
    lam_g: np.ndarray
    bounds: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
    column_scales: np.ndarray
    row_scales: np.ndarray
    cost: float
    sense: float

    @classmethod
    def of(cls, solution: Any, problem: Any, opened: bool = True) -> Optimum:
        """That of a solution, of a transfer, a mission or a team, with its problem.

        Opened, the constants of effects are parameters of it.
        """
        problem = with_open_effects(problem) if opened else problem
        if hasattr(problem, "plan") or hasattr(problem, "members"):
            return cls._of_mission(solution, problem)
        path = solution.path
        nlp, blocks = unassembled(problem, path, units_of(problem, path))
        return cls(
            nlp,
            path,
            tuple(blocks),
            Numbers.of(nlp),
            nlp.pack(path),
            nlp.parameters(problem),
            *nlp.multipliers(path),
            nlp.bounds(problem),
            nlp.columns.scales(),
            nlp.rows.scales(),
            nlp.units.cost,
            problem.objective.sense,
        )

    @classmethod
    def _of_mission(cls, solution: Any, mission: Any) -> Optimum:
        from dmoc.chains.program import MissionProgram
        from dmoc.planners.mission import MissionPlanner, identifiers

        path = solution.path
        program: MissionProgram
        if getattr(mission, "phased", False):
            from dmoc.phases.program import PhasedProgram
            from dmoc.phases.timetable import Timetable
            from dmoc.planners.phased import numbers_of_phases

            plan = Timetable(mission, path.joints)
            program = PhasedProgram.of(plan, plan.stretches, path)
            numbers = numbers_of_phases(program)
        elif hasattr(mission, "members"):
            from dmoc.teams.program import TeamProgram

            program = TeamProgram.of(mission, mission.stretches, path)
            numbers = Numbers(
                mission, numbers_of_team(mission, identifiers(mission.leg_names)), partial(_of_team, program)
            )
        else:
            program = MissionProgram.of(mission, mission.stretches, path)
            numbers = MissionPlanner(program, path, (), identifiers(mission.leg_names)).numbers
        return cls(
            program,
            path,
            program.blocks,
            numbers,
            program.pack(path),
            program.parameters(),
            *program.multipliers(path),
            program.bounds(),
            program.column_scales(),
            program.row_scales(),
            program.cost,
            mission.objective.sense,
        )

    @cached_property
    def matrices(self) -> list[sparse.csr_matrix]:
        """Derivatives by all numbers of lower and upper bounds of unknowns, of rows, and of parameters."""
        numbers = self.numbers
        data = numbers.matrix
        whole = sparse.csc_matrix((data.nonzeros(), data.row(), data.colind()), shape=data.shape).tocsr()
        ends = np.cumsum([0, *numbers.sizes])
        parts = [whole[first:stop] for first, stop in pairwise(ends)]
        if len(parts) == 3:
            # The bounds of a transfer's rows are the same for all its numbers.
            fixed = sparse.csr_matrix((len(self.lam_g), whole.shape[1]))
            parts = [*parts[:2], fixed, fixed, parts[2]]
        return parts

    @cached_property
    def slope(self) -> np.ndarray:
        """Derivative of the scaled objective by all numbers, along optima.

        By the envelope theorem that of the Lagrangian: grad_p (f + lam_g . g) through parameters, and through a
        bound minus its multiplier (Fiacco, Introduction to Sensitivity and Stability Analysis in Nonlinear
        Programming, 1983, chapter 3).
        """
        by_p = np.zeros(len(self.p))
        for block, given in self.given():
            first = by_parameters(block.kernel)(*given)[0].full()
            np.add.at(by_p, block.first + np.array(block.kernel.used[1], int), _per(first, block).sum(axis=1))
        lower, upper, low, high, through = self.matrices
        found = through.T @ (by_p / self.cost)
        for lam, below, above in ((self.lam_x, lower, upper), (self.lam_g, low, high)):
            found -= below.T @ np.minimum(lam, 0) + above.T @ np.maximum(lam, 0)
        return found

    @cached_property
    def gradient(self) -> np.ndarray:
        """Scaled gradient of f + lam_g . g by the unknowns."""
        found = np.zeros(len(self.x))
        for block, given in self.given():
            np.add.at(found, block.columns, block.kernel.slope(*given)[0].full())
        return found * self.column_scales / self.cost

    @cached_property
    def rows(self) -> np.ndarray:
        """Scaled rows."""
        found = np.zeros(len(self.lam_g))
        for block, given in self.given():
            np.add.at(found, block.targets, block.kernel.slope(*given)[1].full())
        return found * self.row_scales

    @cached_property
    def mixed(self) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
        """Scaled derivatives by parameters: of the Lagrangian's gradient by the unknowns, and of the rows."""
        parts: list[list[tuple]] = [[], []]
        for block, given in self.given():
            inside = block.first + np.array(block.kernel.used[1], int)
            if not len(inside):
                continue
            found = by_parameters(block.kernel)(*given)[1].full()
            sizes = len(block.columns), len(block.targets)
            # One evaluation beside the other: (unknowns and rows, evaluation, parameters).
            table = found.reshape(sum(sizes), block.count, len(inside))
            for part, places, side in zip(
                parts, (block.columns, block.targets), np.split(table, sizes[:1]), strict=True
            ):
                at = np.broadcast_to(places[:, :, None], side.shape), np.broadcast_to(inside, side.shape)
                part.append((side.ravel(), at[0].ravel(), at[1].ravel()))
        scales = self.column_scales / self.cost, self.row_scales
        of_x, of_g = (
            sparse.diags(scale) @ _sum(part, (len(scale), len(self.p)))
            for part, scale in zip(parts, scales, strict=True)
        )
        return of_x, of_g

    @cached_property
    def hessian(self) -> sparse.csr_matrix:
        """Scaled second derivatives of the Lagrangian by the unknowns."""
        parts = []
        for block, given in self.given():
            row, column = map(np.array, block.kernel.hessian.get_triplet())
            if not len(row):
                continue
            values = block.kernel.functions["hessian"](*given).full()
            first, second, off = block.columns[row], block.columns[column], row != column
            parts.append((values.ravel(), first.ravel(), second.ravel()))
            parts.append((values[off].ravel(), second[off].ravel(), first[off].ravel()))
        size = len(self.x)
        scale = sparse.diags(self.column_scales)
        return scale @ _sum(parts, (size, size)) @ scale / self.cost

    @cached_property
    def jacobian(self) -> sparse.csr_matrix:
        """Scaled derivatives of the rows by the unknowns."""
        parts = []
        for block, given in self.given():
            row, column = map(np.array, block.kernel.jacobian.get_triplet())
            if len(row):
                values = block.kernel.functions["jacobian"](*given[:3]).full()
                parts.append((values.ravel(), block.targets[row].ravel(), block.columns[column].ravel()))
        shape = len(self.lam_g), len(self.x)
        return sparse.diags(self.row_scales) @ _sum(parts, shape) @ sparse.diags(self.column_scales)

    def given(self) -> Iterator[tuple[Block, tuple]]:
        """Each block, and what its kernel takes there: one column an evaluation."""
        unknowns = self.x * self.column_scales
        multipliers = self.lam_g * self.row_scales * self.cost
        for block in self.blocks:
            known, constant = block.kernel.used
            p = self.p[block.first + np.array(constant, int)]
            columns = np.tile(p[:, None], block.count)
            yield (
                block,
                (
                    unknowns[block.columns],
                    block.values[known],
                    columns,
                    multipliers[block.targets],
                    np.ones((1, block.count)),
                ),
            )


def _of_team(program: Any, twin: Any) -> list[np.ndarray]:
    """Bounds and parameters of a team that differs in numbers, unchecked."""
    legs = [
        replace(placed, program=replace(placed.program, problem=member))
        for placed, member in zip(program.legs, twin.members, strict=True)
    ]
    changed = replace(program, mission=twin, legs=tuple(legs))
    return [*changed.bounds(), changed.parameters()]


def by_parameters(kernel: Kernel) -> ca.Function:
    """(z, d, p, multipliers, weight) -> what the Lagrangian's part of a kernel changes by with p.

    First its derivative, then that of its gradient by z and of the rows beneath each other.
    """

    def make() -> tuple[Kernel, ca.Function]:
        given = [ca.SX.sym(f"i{i}", kernel.slope.numel_in(i)) for i in range(5)]
        slope, rows, cost = kernel.slope(*given)
        p = given[2]
        total = given[4] * cost + ca.dot(given[3], rows)
        both = ca.jacobian(ca.vertcat(slope, rows), p)
        outputs = [ca.densify(ca.gradient(total, p)), ca.densify(both)]
        # The kernel is held with it: once it were gone, another one might get its identity.
        return kernel, ca.Function(f"{kernel.name}_by_parameters", given, outputs)

    return _BY_PARAMETERS.get(id(kernel), make)[1]


def _per(values: np.ndarray, block: Block) -> np.ndarray:
    """A result that has one column an evaluation, also where all evaluations share one."""
    return values if values.shape[1] == block.count else np.tile(values, block.count)


def _sum(parts: list[tuple], shape: tuple[int, int]) -> sparse.csr_matrix:
    """The matrix of entries (value, row, column); entries of one place are added up."""
    if not parts:
        return sparse.csr_matrix(shape)
    values, rows, columns = (np.concatenate(side) for side in zip(*parts, strict=True))
    return sparse.coo_matrix((values, (rows, columns)), shape=shape).tocsr()
