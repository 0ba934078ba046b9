"""Whether what a failed solve names as enough is enough: the problem is solved with it before it is named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from dmoc.motion.momenta import rates_along
from dmoc.motion.reference import MISSED
from dmoc.results.between import turn_cuts
from dmoc.results.solution import Solution
from dmoc.scene.problem import TransferProblem
from dmoc.solver.ladder import MOST_TRYING, Ladder
from dmoc.solver.mended import all_cuts, goal_missed, velocity_and_scales

# A ladder tells of these attempts by this question.
QUESTION = "whether a remedy is enough"


def holds(ladder: Ladder, problem: TransferProblem, solved: Callable[[Ladder], Solution]) -> bool:
    """Whether a changed problem is solved in the way that the one of a ladder was, and its answer is sound.

    An attempt of a trial ends after few iterations, as the first one of any solve does. A trial ends with the
    first mesh that fails, which is mostly the one on which the remedy was found; but where |F| is rounded, more
    of it on the first meshes, a later one may do.
    """
    options = {"ipopt.max_iter": MOST_TRYING} | (ladder.options or {})
    trial = Ladder(problem, options, compiled=ladder.compiled)
    trial.interrupt, trial.patient = ladder.interrupt, problem.actuator.smoothing is not None
    try:
        solution = solved(trial)
    except ValueError:
        # Such as one that lasts so much longer that the steps asked for are too long.
        return False
    for level in solution.ladder:
        ladder.tell(replace(level, question=QUESTION))
    return solution.success and _is_sound(trial, solution)


def _is_sound(ladder: Ladder, solution: Solution) -> bool:
    """Whether an answer keeps its limits between the nodes, too, and an independent integrator confirms it."""
    path, problem = solution.path, ladder.problem
    if not all(cut.ok for cut in all_cuts(ladder, path)) or goal_missed(ladder, path) > MISSED:
        return False
    if not path.attitudes:
        return True
    velocity, _, _ = velocity_and_scales(ladder, path)
    rates = rates_along(ladder.dynamics, path.position, velocity)
    return all(cut.ok for cut in turn_cuts(problem.constraints, path, problem.start_time, rates))
