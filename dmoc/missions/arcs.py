"""Coasts between two impulses around a lone attractor, to start a mission from: the cheapest of a grid.

The grid has times of the start, durations and, where an end is an orbit, places on it; each of its points is
one of Lambert's problems, with whole revolutions too.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from dmoc.basics.arguments import both_ends
from dmoc.basics.memory import remembered
from dmoc.guess.coast import LEAST_SAMPLES, coast
from dmoc.legs.lambert import lambert
from dmoc.scene.mission import Mission

# A free time of the start, and a free duration, are tried at this many values.
TIMES, DURATIONS = 16, 16
# An orbit is entered and left at this many places.
PLACES = 12
# At most so many whole revolutions are tried.
MOST_TURNS = 3
# Coasts cost about the same within this part of the cheapest [-].
ALIKE = 0.1


class Arc(NamedTuple):
    """A coast to start from: its cost [m/s], begin [s], duration [s], and positions over time."""

    cost: float
    begin: float
    duration: float
    places: Callable[[np.ndarray], np.ndarray]


def cheapest_arc(mission: Mission) -> Arc | None:
    """The cheapest coast of the grid, or None where the mission is no coast between impulses."""
    problem = mission.stretches[0]
    attractor = problem.attraction.lone
    joints = mission.joints
    conditions = any(event.condition is not None for joint in joints[1:-1] for event in joint.events)
    powered = any(leg.controls for leg in mission.stretches)
    kicked = any(event.pushes for joint in joints for event in joint.events)
    if attractor is None or conditions or powered or not kicked or mission.dimension < 2 or mission.closes:
        return None
    center = attractor.place(mission.dimension)
    begins = _grid(mission.start_bounds, TIMES, np.linspace)
    durations = _grid(_whole_span(mission), DURATIONS, np.geomspace)
    ends = [joint.boundary for joint in (joints[0], joints[-1])]
    points = []
    for begin in begins:
        starts = _states(ends[0], begin, center)
        for duration in durations:
            goals = _states(ends[1], begin + duration, center)
            points += [(begin, duration, start, goal) for start in starts for goal in goals]
    best = _cheapest(attractor.mu, points) if points else None
    if best is None:
        return None
    cost, begin, duration, position, velocity = best
    axes = mission.dimension
    place = position[:axes] + center, velocity[:axes]
    offset = begin - problem.start_time
    found = coast(problem, offset, offset + duration, place, LEAST_SAMPLES)
    if found is None:
        return None
    times = np.linspace(begin, begin + duration, len(found))

    def places(at: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(at, times, column) for column in found[:, :axes].T], axis=1)

    return Arc(cost, begin, duration, places)


def _grid(span: tuple[float, float], count: int, spaced: Any) -> np.ndarray:
    return np.array([span[0]]) if span[0] == span[1] else spaced(*span, count)


def _whole_span(mission: Mission) -> tuple[float, float]:
    """Shortest and longest duration of all legs together [s], as the mission lets them."""
    shortest, longest = (
        sum(side) for side in zip(*(leg.duration_bounds for leg in mission.stretches), strict=True)
    )
    if mission.duration is None:
        return shortest, longest
    low, high = both_ends(mission.duration)
    return max(low, shortest), min(high, longest)


def _states(end: Any, time: float, center: np.ndarray) -> np.ndarray:
    """States of an end in question from the attractor, shape (count, 2, 3); none where it says too little."""
    axes = len(center)
    known = [end.estimate(time)]
    if not end.anchored and not np.isnan(known[0]).any():
        angles = np.linspace(0, 2 * np.pi, PLACES, endpoint=False)
        known = remembered(partial(_on_orbit, end, known[0], center, angles), "places", end, tuple(center))
    states = [[np.pad(q - center, (0, 3 - axes)), np.pad(v, (0, 3 - axes))] for q, v in known]
    return np.array([state for state in states if np.isfinite(state).all()]).reshape(-1, 2, 3)


def _on_orbit(end: Any, state: tuple, center: np.ndarray, angles: np.ndarray) -> list:
    """States of an end, each next to one that is turned by an angle; they do not depend on the time."""
    return [end.estimate(0.0, turned) for turned in _around(state, center, angles)]


def _around(state: tuple, center: np.ndarray, angles: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """A state turned by angles in its own plane around a center."""
    axes = len(center)
    q, v = np.pad(state[0] - center, (0, 3 - axes)), np.pad(state[1], (0, 3 - axes))
    normal = np.cross(q, v)
    normal = normal / (np.linalg.norm(normal) or 1.0)
    found = []
    for angle in angles:
        turned = [x * np.cos(angle) + np.cross(normal, x) * np.sin(angle) for x in (q, v)]
        found.append((turned[0][:axes] + center, turned[1][:axes]))
    return found


def _cheapest(mu: float, points: list) -> tuple | None:
    """Cost [m/s], begin and duration [s] and the state behind the first impulse of the cheapest point."""
    begins, durations = (np.array([point[i] for point in points]) for i in (0, 1))
    (q0, v0), (q1, v1) = (np.moveaxis(np.array([point[i] for point in points]), 1, 0) for i in (2, 3))
    normal = np.cross(q0, v0) + np.cross(q1, v1)
    period = 2 * np.pi * np.sqrt((0.5 * np.minimum(*(np.linalg.norm(q, axis=1) for q in (q0, q1)))) ** 3 / mu)
    found = []
    for turns in range(MOST_TURNS + 1):
        may = np.flatnonzero(durations > turns * period)
        for slow in (True, False) if turns and len(may) else (True,) * bool(len(may)):
            leaves, arrives = lambert(mu, q0[may], q1[may], durations[may], normal[may], turns, slow)
            cost = np.linalg.norm(leaves - v0[may], axis=1) + np.linalg.norm(v1[may] - arrives, axis=1)
            found += [(cost[i], at, leaves[i]) for i, at in enumerate(may) if np.isfinite(cost[i])]
    if not found:
        return None
    least = min(cost for cost, _, _ in found)
    # Of many that cost about the same the shortest one wanders least among the others.
    near = [one for one in found if one[0] <= (1 + ALIKE) * least]
    cost, at, velocity = min(near, key=lambda one: (durations[one[1]], one[0]))
    return float(cost), float(begins[at]), float(durations[at]), q0[at], velocity
