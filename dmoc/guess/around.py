"""The default path near attractors: coast arcs from both ends, or an orbit that changes evenly."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from dmoc.basics.digits import lasting
from dmoc.guess.coast import (
    LEAST_SAMPLES,
    MANY_TURNS,
    coast,
)
from dmoc.guess.open_ends import spiral_between, velocity_change_between, windings_between
from dmoc.motion.dynamics import Dynamics
from dmoc.scene.problem import TransferProblem

# A coast is followed at this many places at most; at 20 places a revolution they are enough for 5,000.
MOST_SAMPLES = 100_000
# Paths are compared at this many places a revolution, where they are differentiated twice.
PLACES_A_TURN = 100
# A guess has at most this many revolutions: more would need more memory than there is, and as a rule a unit is
# wrong.
MOST_TURNS = 10_000
# A duration is long enough if a guess needs less than this many times the limit of the force in it: a guess is
# not the best path, which needs less.
GENEROUS = 4.0
# This many durations between the shortest and the longest are tried, each longer by the same factor.
DURATIONS = 16

# A path is a function of fractions of the duration, shape (count,), that gives positions [m], (count, axes).
Path = Callable[[np.ndarray], np.ndarray]


def shortest_flyable(problem: TransferProblem, states: Callable[[float], Any], acceleration: float) -> float:
    """About the least duration in which a force limit takes a body between two states near an attractor [s].

    Durations within the bounds are tried from the shortest on. The first one is taken in which the default
    path needs less than four times the limit, in the mean square. Once there are three revolutions, it is
    instead the time in which the limit gives the velocity change of a spiral, and a fifth more. `states`
    gives the states of both ends for a duration.
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
    """Revolutions a second on a circle through that of the two places where they are slower [1/s]."""
    rates = problem.attraction.rates(np.stack([position for position, _ in states]))
    return float(rates.min() / (2 * np.pi))


def path_around(problem: TransferProblem, duration: float, states: Any, fractions: np.ndarray) -> tuple:
    """Positions at fractions of the duration, and whether the forces along them are worth starting from.

    If one end leaves its place open, the path is a spiral that ends there. Else it is the candidate that
    needs the least force: coasts from both ends, blended, or an orbit that changes evenly. That orbit has
    the number of revolutions that fits the duration best; where none fits well, one revolution more and
    one less are candidates too.

    Raises
    ------
    ValueError
        If there are more than 10,000 revolutions.
    """
    if (turns := duration * _turn_rate(problem, states)) > MOST_TURNS:
        raise ValueError(
            f"on the orbits of start and goal {lasting(duration, 6)} are about {turns:,.0f} revolutions; "
            "check the units of mu [m^3/s^2], positions [m] and duration [s], or give a guess"
        )
    spiral = spiral_between(problem, duration, states)
    if spiral is not None:
        return (spiral.states(fractions)[0] + spiral.center)[:, : problem.dimension], True
    windings = windings_between(problem, duration, states)
    many = bool(windings) and windings[0][1] >= MANY_TURNS
    if problem.free_duration and not many:
        # A free duration will follow from the phase, so no revolutions have to fit the one assumed here.
        windings = []
    # Each candidate is a path, and whether the forces along it are worth starting from.
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
    """Mean square of the acceleration that a path needs in addition to that of the effects [m^2/s^4]."""
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

    The number of revolutions is the mean of those of the two arcs in the whole duration: it comes
    from the periods of the two ends and the duration, never from positions alone.
    """
    frame = _orbit_frame(states)
    arcs = [np.pad(arc, ((0, 0), (0, 3 - arc.shape[1]))) @ frame for arc in (first, second)]
    angles = [np.unwrap(np.arctan2(arc[:, 1], arc[:, 0])) for arc in arcs]
    # The second arc is turned by whole revolutions until the way between the ends is nearest to the mean sweep.
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
    # Two opposite senses of rotation cancel: then there is no mean plane, and the xy plane stands in.
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
        # A node in the centre itself has no direction away from it and is pushed to the side of the way.
        sideways = np.roll(q1 - q0, 1) if len(q0) > 1 else np.ones(1)
        offset = np.where(distance > 1e-9 * least, offset, sideways / (np.linalg.norm(sideways) or 1.0))
        length = np.linalg.norm(offset, axis=1, keepdims=True)
        path = center + offset * np.maximum(distance, least) / np.where(length > 0, length, 1.0)
    return path


def _smooth(x: np.ndarray) -> np.ndarray:
    """From 0 at 0 to 1 at 1, level at both."""
    return x * x * (3 - 2 * x)
