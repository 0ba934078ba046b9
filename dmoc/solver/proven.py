"""Whether what a failed solve names as enough is enough: the problem is solved with it before it is named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from dmoc.checks.verification import verify
from dmoc.diagnosis.giving import Remedy
from dmoc.results.solution import Solution
from dmoc.scene.problem import TransferProblem
from dmoc.solver.ladder import MOST_TRYING, Ladder

# A ladder tells of these attempts by this question.
QUESTION = "whether a remedy is enough"
# From a path that keeps all limits an attempt ends after this many iterations.
MOST_NEAR = 60


def holds(ladder: Ladder, remedy: Remedy, solved: Callable[[Ladder], Solution]) -> bool:
    """Whether a changed problem is solved in the way that the one of a ladder was, and every check holds.

    Where a path is known that keeps all of its limits, it is solved from there on the mesh of that path: a
    solve from the usual guess that leads nowhere finds the same path when it looks for the cause. If a check of
    that answer fails, which a finer mesh may mend, it is solved as a user would.

    An attempt of a trial ends after few iterations, as the first one of any solve does. A trial ends with the
    first mesh that fails, which is mostly the one on which the remedy was found; but where |F| is rounded, more
    of it on the first meshes, a later one may do.
    """
    if ladder.interrupt.seen:
        return False
    problem, path = remedy.problem, remedy.path
    try:
        # A body that turns or has links may be led elsewhere by the usual guess.
        bare = not (problem.turns or problem.links) and problem.inertia is None
        if path is not None and bare and problem.actuator.smoothing is None:
            near = _trial(ladder, problem)
            solution = _told(ladder, near.solution(near.try_on(path, most=MOST_NEAR)))
            if not solution.success or verify(solution).ok:
                return solution.success
        solution = _told(ladder, solved(_trial(ladder, problem)))
    except ValueError:
        # Such as one that lasts so much longer that the steps asked for are too long.
        return False
    return solution.success and verify(solution).ok


def _trial(ladder: Ladder, problem: TransferProblem) -> Ladder:
    trial = Ladder(problem, {"ipopt.max_iter": MOST_TRYING} | (ladder.options or {}), compiled=ladder.compiled)
    trial.interrupt, trial.patient = ladder.interrupt, problem.actuator.smoothing is not None
    return trial


def _told(ladder: Ladder, solution: Solution) -> Solution:
    """A solution whose attempts stand in the ladder."""
    for level in solution.ladder:
        ladder.tell(replace(level, question=QUESTION))
    return solution
