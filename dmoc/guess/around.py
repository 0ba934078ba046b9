"""The default path near attractors: coast arcs from both ends, or an orbit that changes evenly."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from dmoc.guess.coast import (
    LEAST_SAMPLES,
    MANY_TURNS,
    coast,
)
from dmoc.guess.open_ends import spiral_between, velocity_change_between, windings_between
from dmoc.motion.dynamics import Dynamics
from dmoc.scene.problem import TransferProblem

# Coasts are followed at this many places at most, paths compared at this many a revolution.
MOST_SAMPLES, PLACES_A_TURN = 100_000, 100
# More revolutions would need more memory than there is; as a rule a unit is wrong.
MOST_TURNS = 10_000

Path = Callable[[np.ndarray], np.ndarray]


# A guess is not the best path: the shortest duration is near where it needs so much more than the limit.
GENEROUS, DURATIONS = 4.0, 16


def shortest_flyable(problem: TransferProblem, states: Callable[[float], Any], acceleration: float) -> float:
    """About the least duration in which a force limit takes a body between two states near an attractor [s].

    Of some durations within the bounds the first in which the default path needs no more than four times
    the limit, in the mean square, or from three revolutions on as long as a spiral takes; `states` gives
    the states of both ends for a duration.
    """
    longest, sample = problem.duration_bounds[1], np.linspace(0.0, 1.0, PLACES_A_TURN * (2 + MANY_TURNS))
    for duration in np.geomspace(*problem.duration_bounds, DURATIONS):
        ends = states(duration)
        if _turn_rate(problem, ends) * duration > MANY_TURNS:
            duration = max(duration, 1.2 * velocity_change_between(problem, ends) / acceleration)
            break
        path, _ = path_around(problem, duration, ends, sample)
        if np.sqrt(_needed(problem, path, duration * sample, ends)) < GENEROUS * acceleration:
            break
    return float(min(duration, longest))


def _turn_rate(problem: TransferProblem, states: Any) -> float:
    """Revolutions a second on a circle through the outer one of two places."""
    rates = problem.attraction.rates(np.stack([position for position, _ in states]))
    return float(rates.min() / (2 * np.pi))


def path_around(problem: TransferProblem, duration: float, states: Any, fractions: np.ndarray) -> tuple:
    """Positions at fractions of the duration, and whether it is worth to begin with the forces along them.

    Where the place at one end is open it is a spiral that ends there. Else it is what needs the least
    force: coasts from both ends, blended, or an orbit that changes evenly, with the number of
    revolutions that fits the duration best or, where none fits well, one more or less.

    Raises
    ------
    ValueError
        If there are more than 10,000 revolutions.
    """
    if (turns := duration * _turn_rate(problem, states)) > MOST_TURNS:
        raise ValueError(
            f"on the orbits of start and goal {duration:g} s are about {turns:,.0f} revolutions; "
            "check the units of mu [m^3/s^2], positions [m] and duration [s], or give a guess"
        )
    spiral = spiral_between(problem, duration, states)
    if spiral is not None:
        return (spiral.states(fractions)[0] + spiral.center)[:, : problem.dimension], True
    windings = windings_between(problem, duration, states)
    many = bool(windings) and windings[0][1] >= MANY_TURNS
    if problem.free_duration and not many:
        # the duration will follow from the phase, not the other way round
        windings = []
    # a path, and whether it is worth its forces
    paths: list[tuple[Path, bool]] = [(winding, True) for winding, _, _ in windings]
    if not (many or (windings and windings[0][2])):
        paths.append((_coasts(problem, duration, states), False))
    best = paths[0]
    if len(paths) > 1:
        sample = np.linspace(
            0.0, 1.0, PLACES_A_TURN * (2 + max((turns for _, turns, _ in windings), default=0))
        )
        best = min(paths, key=lambda path: _needed(problem, path[0](sample), duration * sample, states))
    return best[0](fractions), best[1]


def _needed(problem: TransferProblem, path: np.ndarray, times: np.ndarray, states: Any) -> float:
    """Mean square of the acceleration that a path takes beside what acts [m^2/s^4]."""
    velocity = np.gradient(path, times, axis=0)
    velocity[0], velocity[-1] = (v for _, v in states)
    given = problem.start_time + times[None], path.T, velocity.T, problem.mass, np.zeros(problem.dimension)
    acts = Dynamics.of(problem).acceleration(*given).full().T
    change = np.gradient(velocity, times, axis=0) - acts
    return float(np.trapezoid((change**2).sum(axis=1), times) / times[-1])


def _coasts(problem: TransferProblem, duration: float, states: Any) -> Path:
    """Coast arcs from both ends, blended; a straight line where one of them falls into an attractor."""
    (q0, v0), (q1, v1) = states
    attractors = problem.attraction.sources
    turns = duration * problem.attraction.rates(np.stack([q0, q1])).max()
    sample = np.linspace(0.0, 1.0, int(np.clip(20 * turns, LEAST_SAMPLES, MOST_SAMPLES)))
    forward = coast(problem, 0.0, duration, (q0, v0), len(sample))
    backward = coast(problem, duration, 0.0, (q1, v1), len(sample))
    if forward is None or backward is None:
        return lambda at: _keep_clear(q0 + at[:, None] * (q1 - q0), attractors, q0, q1)
    arcs = [forward[:, : problem.dimension], backward[::-1, : problem.dimension]]
    lone = problem.attraction.lone
    if lone is not None:
        center = lone.place(problem.dimension)
        from_center = ((q0 - center, v0), (q1 - center, v1))
        path = center + _blend_around(sample, arcs[0] - center, arcs[1] - center, from_center)
    else:
        blend = _smooth(sample)[:, None]
        path = (1 - blend) * arcs[0] + blend * arcs[1]

    def positions(at: np.ndarray) -> np.ndarray:
        found = np.stack([np.interp(at, sample, column) for column in path.T], axis=1)
        return _keep_clear(found, attractors, q0, q1)

    return positions


def _blend_around(sample: np.ndarray, first: np.ndarray, second: np.ndarray, states) -> np.ndarray:
    """Blend two arcs around an attractor at the origin in radius, angle and height.

    The number of revolutions is the mean of what the two arcs sweep in the whole duration: it comes
    from the periods of the two ends and the duration, never from positions alone.
    """
    frame = _orbit_frame(states)
    arcs = [np.pad(arc, ((0, 0), (0, 3 - arc.shape[1]))) @ frame for arc in (first, second)]
    angles = [np.unwrap(np.arctan2(arc[:, 1], arc[:, 0])) for arc in arcs]
    sweeps = [angle[-1] - angle[0] for angle in angles]
    gap = angles[1][-1] - angles[0][0] - 0.5 * (sweeps[0] + sweeps[1])
    angles[1] = angles[1] - 2 * np.pi * np.round(gap / (2 * np.pi))
    blend = _smooth(sample)

    def mix(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return (1 - blend) * a + blend * b

    radius = mix(*(np.hypot(arc[:, 0], arc[:, 1]) for arc in arcs))
    angle, height = mix(*angles), mix(arcs[0][:, 2], arcs[1][:, 2])
    path = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1) @ frame.T
    return path[:, : first.shape[1]]


def _orbit_frame(states) -> np.ndarray:
    """Columns: two axes in the mean orbital plane and its normal."""
    normal = np.zeros(3)
    for q, v in states:
        momentum = np.cross(np.pad(q, (0, 3 - len(q))), np.pad(v, (0, 3 - len(v))))
        normal += momentum / (np.linalg.norm(momentum) or 1.0)
    if len(states[0][0]) == 2 or np.linalg.norm(normal) < 1e-6:
        normal = np.array([0.0, 0.0, 1.0])
    normal /= np.linalg.norm(normal)
    first = np.cross(normal, [0.0, 1.0, 0.0] if abs(normal[0]) > abs(normal[2]) else [0.0, -1.0, 0.0])
    if np.linalg.norm(first) < 1e-6:
        first = np.cross(normal, [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first), normal], axis=1)


def _keep_clear(path: np.ndarray, attractors, q0: np.ndarray, q1: np.ndarray) -> np.ndarray:
    """Push nodes out of the neighbourhood of attractors, where no scheme can start."""
    for attractor in attractors:
        center = attractor.place(len(q0))
        offset = path - center
        distance = np.linalg.norm(offset, axis=1, keepdims=True)
        least = 0.2 * min(np.linalg.norm(q0 - center), np.linalg.norm(q1 - center))
        sideways = np.roll(q1 - q0, 1) if len(q0) > 1 else np.ones(1)
        offset = np.where(distance > 1e-9 * least, offset, sideways / (np.linalg.norm(sideways) or 1.0))
        length = np.linalg.norm(offset, axis=1, keepdims=True)
        path = center + offset * np.maximum(distance, least) / np.where(length > 0, length, 1.0)
    return path


def _smooth(x: np.ndarray) -> np.ndarray:
    return x * x * (3 - 2 * x)
