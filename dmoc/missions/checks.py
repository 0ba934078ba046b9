"""The checks of a mission: of every leg, of every joint, of the whole, and the primer vector's verdict."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.basics.memory import unchanged
from dmoc.chains.path import MissionPath
from dmoc.chains.program import MissionProgram
from dmoc.checks.evidence import Evidence
from dmoc.checks.optimality import idle, left_over
from dmoc.checks.primer import primer_check
from dmoc.checks.verification import CHECKS, Check, Report, not_finite, own_checks, refuse_twins
from dmoc.checks.worst import fastest, worst_of
from dmoc.diagnosis.wrong_way import WORTH, share_of, told
from dmoc.missions.solution import MissionSolution
from dmoc.results.facts import optimality_limit

# States at joints may be off by this part of the units of a leg [-]: Ipopt meets rows to a tolerance.
JOINED = 1e-8
# A leg is judged by its own extent and speed, but at least by this part of the mission's [-].
LEAST = 1e-2


@unchanged()
def verify_mission(solution: MissionSolution, problem: Any = None, more: Sequence = ()) -> Report:
    """Check a mission, without a look at the optimiser's own verdict on it.

    Every leg is checked as a transfer between its two states, and the worst one is told; `joints` compares the
    states, times and masses beside each joint and what must hold there; `optimality` are the first-order
    conditions of the whole mission; `primer` says whether another impulse would help. Each of `more`, which
    takes the `Evidence` of a leg, is told of the worst leg, too.
    """
    own = own_checks(more)
    solution = solution if problem is None else solution.attach(problem)
    begun, mission = time.perf_counter(), solution.require_problem()
    with np.errstate(all="ignore"):
        least = LEAST * solution.path.diagonal, LEAST * max(fastest(leg) for leg in solution.legs)
        legs = [Evidence(replace(leg, tolerance=solution.tolerance), least) for leg in solution.legs]
        undefined = next((found for leg in legs if (found := leg.undefined())), "")
        if undefined:
            return Report((not_finite("legs", undefined),), 0.0)
        held = any(leg.path.attitudes or leg.problem.links for leg in legs)
        checks = [
            worst_of(mission.leg_names, legs, check)
            for name, check in CHECKS.items()
            if name != "optimality" and (held or name != "constraint")
        ]
        path = solution.path
        whole = Whole(solution, MissionProgram.of(mission, mission.stretches, path), path)
        checks += [whole.joints(), whole.optimality()]
        if solution.impulses:
            checks.append(primer_check(solution))
        checks += [worst_of(mission.leg_names, legs, check) for _, check in own]
    refuse_twins(checks)
    return Report(tuple(checks), time.perf_counter() - begun)


class Whole:
    """The program of a mission on its own meshes, evaluated block by block at its path and multipliers."""

    def __init__(self, solution: Any, program: MissionProgram, path: MissionPath):
        self.solution = solution
        self.program = program
        self.x = program.pack(path)
        lam_x, lam_g = program.multipliers(path)
        scales, row_scales = program.column_scales(), program.row_scales()
        values, parameters = self.x * scales, program.parameters()
        dual = lam_g * row_scales * program.cost
        slope, self.rows, self.cost = np.zeros(len(values)), np.zeros(len(lam_g)), 0.0
        for block in program.blocks:
            known, used = block.kernel.used
            given = values[block.columns], block.values[known], parameters[[block.first + p for p in used]]
            found = block.kernel.slope(*given, dual[block.targets], 1.0)
            np.add.at(slope, block.columns, found[0].full())
            np.add.at(self.rows, block.targets, found[1].full())
            self.cost += float(found[2].full().sum())
        self.slope = slope * scales / program.cost + lam_x
        self.rows = self.rows * row_scales
        self.lam_x, self.lam_g = lam_x, lam_g
        self.bounds = program.bounds()

    def joints(self) -> Check:
        """States, times and masses beside each joint, and the conditions of start, goal and events."""
        lbx, ubx, low, high = self.bounds
        first, last = self.program.first_row, self.program.first_row + self.program.joint_rows
        excess = np.maximum(low - self.rows, self.rows - high)[first:last]
        outside = np.maximum(lbx - self.x, self.x - ubx)
        if not len(excess):
            return Check("joints", None, None, "-", True, "there is none")
        # Times at the start and masses are bounds of the legs.
        worst, place = float(excess.max()), int(np.argmax(excess))
        name = self.program.rows.name_of(place)
        if outside.max() > worst:
            worst, name = float(outside.max()), self.program.name_of(int(np.argmax(outside)), column=True)
        return Check.of("joints", worst, JOINED, "of its unit", f"worst: {name}" if worst > 0 else "all hold")

    def optimality(self) -> Check:
        """First-order conditions of the mission, and whether the objective is the cost of the path."""
        share = share_of(self.solution.parts, self.solution.objective)
        if share > WORTH:
            return Check.of("optimality", share, WORTH, "of the objective", told(share))
        program, (lbx, ubx, lbg, ubg) = self.program, self.bounds
        found = []
        for placed in program.legs:
            one = placed.program
            mine = slice(placed.columns, placed.columns + one.columns.size)
            rows = slice(placed.rows, placed.rows + one.rows.size)
            sides = (
                (one.columns, *(part[mine] for part in (self.lam_x, self.x, lbx, ubx))),
                (one.rows, *(part[rows] for part in (self.lam_g, self.rows, lbg, ubg))),
            )
            found.append(left_over(one, self.slope[mine], sides))
        force, path, limits = (max(side) for side in zip(*found, strict=True))
        # Of an impulse that is none the primer vector says whether it may be one.
        none = set(program.idle_places())
        own = [i for i in range(mine.stop, len(self.slope)) if i not in none]
        path = max(path, float(np.abs(self.slope[own]).max(initial=0.0)))
        if program.rows.size:
            joints = (part[program.first_row :] for part in (self.lam_g, self.rows, lbg, ubg))
            limits = max(limits, idle(program.rows, *joints, weights={}))
        sense = self.solution.require_problem().objective.sense
        stated = abs(self.cost - sense * self.solution.objective) / program.cost
        note = f"control {force:.0e}, costate {path:.0e}, limits {limits:.0e}, objective {stated:.0e}"
        return Check.of("optimality", max(force, path, limits, stated), optimality_limit(None), "-", note)
