"""Where a transfer starts and ends, in words: what moves is told at the time when the body is there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from dmoc.basics.digits import lasting

if TYPE_CHECKING:
    import numpy as np

    from dmoc.results.solution import Solution
    from dmoc.scene.ends import Boundary
    from dmoc.scene.problem import TransferProblem


def start_words(problem: TransferProblem) -> str:
    """The start; one that moves with its place at the start time."""
    return problem.start.words() + _places(problem.start, [problem.start_time])


def goal_words(problem: TransferProblem) -> str:
    """The goal; one that moves with its place at the end, or at the earliest and the latest one."""
    times = [problem.start_time + duration for duration in dict.fromkeys(problem.duration_bounds)]
    return problem.goal.words() + _places(problem.goal, times)


def met_words(solution: Solution) -> str:
    """Where a goal that moves is met, such as `goal met at (1.5, 0) m`; empty for one that does not."""
    moves = _moves(solution.require_problem().goal)
    return f"goal met at {_point(solution.position[-1])} m" if moves else ""


def _moves(end: Boundary) -> bool:
    """Whether the place of an end is known, but only at a given time."""
    return end.anchored and any(map(math.isnan, end.fixed()[0]))


def _places(end: Boundary, times: Sequence[float]) -> str:
    if not _moves(end):
        return ""
    places = [f"at {_point(end.estimate(time)[0])} m at {lasting(time)}" for time in times]
    return ", " + " and ".join(places)


def _point(position: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:.5g}" for value in position) + ")"
