"""Where a transfer starts and ends, in words: what moves is told at the time when the body is there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from dmoc.basics.digits import lasting

if TYPE_CHECKING:
    import numpy as np

    from dmoc.ends.base import Boundary
    from dmoc.motion.march import Trajectory
    from dmoc.results.solution import Solution
    from dmoc.scene.problem import TransferProblem


def body_words(problem: TransferProblem) -> str:
    """Mass and axes of the body, and its principal moments if it turns."""
    axes = f"axes {', '.join('xyz'[: problem.dimension])}"
    if problem.inertia is None:
        return f"{problem.mass:g} kg, {axes}"
    import numpy as np

    moments = ", ".join(f"{moment:.4g}" for moment in np.linalg.eigvalsh(np.array(problem.inertia)))
    moved = f"{axes} and attitude" if problem.start.has_position else "attitude alone"
    shrinks = problem.actuator.burns and problem.actuator.inertia_law == "scaled"
    law = ", which shrink with the mass" if shrinks else ""
    return f"{problem.mass:g} kg, {moved}, principal moments {moments} kg m^2{law}"


def start_words(problem: TransferProblem) -> str:
    """The start; one that moves with its place at the start time."""
    return problem.start.words() + _places(problem.start, [problem.start_time])


def goal_words(problem: TransferProblem) -> str:
    """The goal; one that moves with its place at the end, or at the earliest and the latest one."""
    times = [problem.start_time + duration for duration in dict.fromkeys(problem.duration_bounds)]
    return problem.goal.words() + _places(problem.goal, times)


def met_words(solution: Solution) -> str:
    """Where a goal that moves is met, such as `goal met at (1.5, 0) m`; empty for one that does not."""
    goal = getattr(solution.require_problem(), "goal", None)
    # A team has a goal for each of its bodies.
    if goal is None or not goal.moves:
        return ""
    # Of a mission the last leg ends there.
    solution = getattr(solution, "legs", (solution,))[-1]
    if solution.attitude is not None and not (goal.has_position and goal.point.anchored):
        return f"goal met at the attitude {_point(solution.attitude[-1])}"
    return f"goal met at {_point(solution.position[-1])} m"


def _places(end: Boundary, times: Sequence[float]) -> str:
    if not end.moves:
        return ""
    places = [f"at {_known_place(end, time)} at {lasting(time)}" for time in times]
    return ", " + " and ".join(places)


def _known_place(end: Boundary, time: float) -> str:
    """Where the body is at a time, and how it is turned; what is free is left out."""
    position, attitude = end.estimate(time)[0], None
    if end.turns_body:
        position, attitude = position[: 3 if end.has_position else 0], position[-4:]
    words = []
    # NaN is unlike itself: what is free.
    if len(position) and (position == position).all():
        words.append(f"{_point(position)} m")
    if attitude is not None and (attitude == attitude).all():
        words.append(f"the attitude {_point(attitude)}")
    return " and ".join(words)


def _point(position: np.ndarray, digits: int = 5) -> str:
    return "(" + ", ".join(f"{value:.{digits}g}" for value in position) + ")"


def final_rows(trajectory: Trajectory) -> list[tuple[str, str]]:
    """Where a simulation ends."""
    found = [
        ("final position", trajectory.position, "m"),
        ("final velocity", trajectory.velocity, "m/s"),
        ("final attitude", trajectory.attitude, "(scalar first, body to space)"),
        ("final rate", trajectory.rate, "rad/s in body axes"),
    ]
    known = [(name, rows[-1], unit) for name, rows, unit in found if rows is not None and rows.shape[1]]
    return [(name, f"{_point(last, 10)} {unit}") for name, last, unit in known]
