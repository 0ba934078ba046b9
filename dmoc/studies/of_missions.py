"""What accuracy costs in time for missions of legs: solves at several orders with several steps a leg."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from statistics import median
from typing import Any

import numpy as np

from dmoc.basics.arguments import number
from dmoc.basics.memory import forget
from dmoc.missions.climb import solve_mission
from dmoc.missions.solution import MissionSolution
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.reference import goal_miss
from dmoc.motion.scales import path_scales
from dmoc.nlp.transcription import check_mesh
from dmoc.scene.mission import Mission
from dmoc.studies.accuracy import GIVEN_ERROR, LEAST_ERROR, Trial
from dmoc.studies.other_methods import counted

# By order, the numbers of steps of each leg that are solved unless others are asked for.
STEPS = {2: (20, 40, 80, 160, 320), 4: (6, 12, 24, 48), 6: (4, 8, 16, 32), 8: (4, 8, 16)}
# The optimum that errors are measured from is solved at order 8 with this many steps a leg, and twice as many.
REFERENCE_STEPS = 24


def mission_precision(
    mission: Mission,
    orders: Sequence[int] = (2, 4, 6, 8),
    steps: Sequence[int] | None = None,
    repeats: int = 3,
    reference: float | None = None,
    compiled: bool = False,
    progress: Callable[[str], None] | None = None,
) -> list[Trial]:
    """Solve a mission at several orders on several meshes; arguments and result as of `work_precision`.

    `steps` are those of each leg. All solves begin with the path of the answer for the reference, so that each
    finds the same optimum.

    Raises
    ------
    ValueError
        If an argument has no meaning, or the mission cannot be solved for a reference.
    """
    half = solve_mission(mission, 8, REFERENCE_STEPS)
    full = solve_mission(mission, 8, 2 * REFERENCE_STEPS, guess=half if half.success else None)
    if not full.success:
        raise ValueError(f"no reference: order 8 on a fine mesh ended with {full.status!r}; give reference=...")
    doubt = max(abs(half.objective - full.objective) / (abs(full.objective) or 1.0), LEAST_ERROR)
    known = (full.objective, doubt) if reference is None else (number("reference", reference, ""), GIVEN_ERROR)
    found = []
    for order in orders:
        for count in STEPS[order] if steps is None else steps:
            check_mesh(count)
            if progress is not None:
                progress(f"order {order}, {count} steps a leg")
            runs = [_run(mission, full, order, count, compiled) for _ in range(repeats)]
            found.append(_trial(runs, order, count, known))
    return found


def _run(mission: Mission, known: MissionSolution, order: int, steps: int, compiled: bool) -> tuple:
    """The answer, the seconds and the evaluations of one solve."""
    forget()
    begun = time.perf_counter()

    def solved(options: dict[str, Any]) -> MissionSolution:
        return solve_mission(
            mission, order, steps, guess=known.path.as_arrays(), options=options, compiled=compiled
        )

    answer, calls = counted(solved)
    return answer, time.perf_counter() - begun, calls


def _trial(runs: Sequence[tuple], order: int, steps: int, known: tuple[float, float]) -> Trial:
    (answer, _, calls), (value, doubt) = runs[-1], known
    solve_s = median(one.solve_s for one, _, _ in runs)
    return Trial(
        f"order {order}",
        order,
        steps,
        sum(len(leg.path.fractions) for leg in answer.legs),
        answer.objective,
        max(abs(answer.objective - value) / (abs(value) or 1.0), doubt),
        _miss(answer),
        answer.iterations,
        calls,
        median(seconds for _, seconds, _ in runs) - solve_s,
        solve_s,
        True,
        answer.status,
    )


def _miss(answer: MissionSolution) -> float:
    """By how much the independent integrator misses the end of a leg at worst [-]."""
    mission, path = answer.require_problem(), answer.path
    missed = [
        path_scales(leg).share(*goal_miss(Dynamics.of(problem), leg, begin))
        for problem, leg, begin in zip(mission.stretches, path.legs, path.begins, strict=True)
    ]
    return float(np.max(missed))
