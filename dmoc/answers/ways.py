"""The ways of ends that move: orbits of planets, and of whatever else is met or left."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from dmoc.answers.orbits import NONE

# A way has so many points.
POINTS = 241
# A velocity is the difference of two places so far apart in time [-], as a part of the flight.
APART = 1e-6


class Way(NamedTuple):
    """The way of an end that moves: its name, and points [m], shape (points, axes)."""

    name: str
    points: np.ndarray


def ways_of(problem: Any, span: tuple[float, float]) -> list[Way]:
    """The ways of the ends of a problem between two times [s]; whole orbits around a lone attractor.

    `problem` has `ends`, names with boundaries and their times [s], or a start and a goal.
    """
    ends = getattr(problem, "ends", None)
    if ends is None:
        ends = (("start", problem.start, span[0]), ("goal", problem.goal, span[1]))
    lone, found = problem.attraction.lone, []
    for name, boundary, time in ends:
        motion = None if boundary is None else boundary.motion
        if motion is None:
            continue
        axes, apart = boundary.dimension, APART * (span[1] - span[0])
        times = np.array([time - apart, time + apart, *np.linspace(*span, POINTS)])
        places = np.array([np.array(motion(t)).ravel() for t in times])
        velocity = (places[1] - places[0]) / (2 * apart)
        points, kind = places[2:], "way"
        if lone is not None:
            center = lone.place(axes)
            orbit = orbit_of(lone.mu, places[:2].mean(axis=0) - center, velocity)
            points, kind = (points, kind) if orbit is None else (center + orbit, "orbit")
        if np.ptp(points, axis=0).any():
            found.append(Way(f"{kind} of the {name}", points))
    return found


def ends_of(solution: Any) -> list[tuple[str, Any, float]]:
    """Names, boundaries and times [s] of the joints of a mission, or of the starts and goals of a team."""
    first, last = solution.time[0], solution.time[-1]
    joints = getattr(solution.problem, "joints", None)
    if joints is None:
        ends = zip(solution.problem.names, solution.problem.members, strict=True)
        return [
            (f"{side} of {name}", getattr(one, side), time)
            for name, one in ends
            for side, time in (("start", first), ("goal", last))
        ]
    times = [*(leg.provenance.start_time for leg in solution.legs), last]
    return [(joint.name, joint.boundary, time) for joint, time in zip(joints, times, strict=True)]


def orbit_of(mu: float, position: np.ndarray, velocity: np.ndarray) -> np.ndarray | None:
    """Points of the orbit of a state around a point mass at the origin [m]; None where it is not closed."""
    distance = float(np.linalg.norm(position))
    energy = 0.5 * float(velocity @ velocity) - mu / distance
    if energy >= 0:
        return None
    a = -0.5 * mu / energy
    eccentric = (velocity @ velocity / mu - 1 / distance) * position - (position @ velocity) / mu * velocity
    e = float(np.linalg.norm(eccentric))
    along = position / distance if e < NONE else eccentric / e
    # At a right angle to it, in the plane of position and velocity; which way round does not matter.
    other = position - (position @ along) * along
    if np.linalg.norm(other) < 1e-6 * distance:
        other = velocity - (velocity @ along) * along
    across = other / (np.linalg.norm(other) or 1.0)
    angle = np.linspace(0, 2 * np.pi, POINTS)[:, None]
    return a * ((np.cos(angle) - e) * along + np.sqrt(max(1 - e * e, 0.0)) * np.sin(angle) * across)
