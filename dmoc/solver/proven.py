"""Whether what a failed solve names as enough is enough: the problem is solved with it before it is named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from dmoc.checks.verification import verify
from dmoc.results.solution import Solution
from dmoc.scene.problem import TransferProblem
from dmoc.solver.ladder import MOST_TRYING, Ladder

# A ladder tells of these attempts by this question.
QUESTION = "whether a remedy is enough"


def holds(ladder: Ladder, problem: TransferProblem, solved: Callable[[Ladder], Solution]) -> bool:
    """Whether a changed problem is solved in the way that the one of a ladder was, and every check holds.

    An attempt of a trial ends after few iterations, as the first one of any solve does. A trial ends with the
    first mesh that fails, which is mostly the one on which the remedy was found; but where |F| is rounded, more
    of it on the first meshes, a later one may do.
    """
    if ladder.interrupt.seen:
        return False
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
    return solution.success and verify(solution).ok
