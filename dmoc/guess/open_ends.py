"""Likely states of ends that leave something free."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from dmoc.basics.numerics import cross
from dmoc.effects.base import Attractor
from dmoc.ends.base import Boundary
from dmoc.guess.coast import coast, controls_for, two_impulses, with_mass
from dmoc.guess.spiral import MOST_BENT, Spiral
from dmoc.guess.winding import Winding
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_weights
from dmoc.motion.path import DiscretePath
from dmoc.scene.problem import TransferProblem

# A spiral to an open orbit is made this many times: the place where it arrives is put onto that orbit and is
# the aim of the next one.
PASSES = 3
# Less than this part of a velocity change once the orbit has drifted [-]: the rest is not needed.
DRIFTED = 0.9
# An orbit above this eccentricity [-] is not changed evenly into another: its body is fast and slow by turns.
MOST_ECCENTRIC = 0.9
# An orbit below this eccentricity [-] that changes evenly is sure to be near the best path, so that blended
# coasts need not be compared with it.
NEARLY_ROUND = 0.3
# An orbit is not changed evenly into another if the cosine of the angle between their angular momenta is below
# this [-]: their bodies turn in nearly opposite senses.
OPPOSITE = -0.9
# A burn is short if it takes less than this part of the time between the two [-]: a longer one is far from an
# impulse.
SHORT_BURN = 0.7
# A path of two burns is a good start if it takes no more than this many times the velocity change of an even
# change of the orbit [-]: one that turns the plane, or that is not round, takes more.
NO_DEARER = 1.1
# A goal that moves is looked at at this many times.
SAMPLES = 200
# So many revolutions more are tried where another number of them may be better.
OTHER_TURNS = (1, -1, 2, -2)


def end_estimates(problem: TransferProblem, duration: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Position and velocity of the centre of mass at start and goal, NaN where nothing is known.

    Near an attractor an end that leaves something open gets the state to which the other end coasts.
    """
    if problem.inertia is not None and problem.start.has_position:
        # What turns bodies is loaded for problems with such bodies alone.
        from dmoc.guess.turning import as_point

        problem = as_point(problem)
    ends, times = (problem.start, problem.goal), (0.0, duration)
    states = [end.estimate(problem.start_time + at) for end, at in zip(ends, times, strict=True)]
    whole = [not np.isnan(state).any() for state in states]
    settled = [end.anchored and known for end, known in zip(ends, whole, strict=True)]
    if problem.attraction.sources and any(whole) and not all(settled):
        known = (settled if any(settled) else whole).index(True)
        open_end = 1 - known
        states[open_end] = _carried(problem, states[known], times[known], ends[open_end], times[open_end])
    return states


def velocity_change_between(problem: TransferProblem, states: Any) -> float:
    """The velocity change of many revolutions from one orbit to another [m/s]; see `Spiral.velocity_change`."""
    attractor = problem.attraction.lone
    assert attractor is not None
    start, goal = _from_center(problem, attractor, states)
    return Spiral(attractor.mu, np.zeros(3), 1.0, start, goal).velocity_change


def spiral_between(problem: TransferProblem, duration: float, states: Any) -> Spiral | None:
    """The spiral from start to goal, if one of them leaves its place open and the spiral ends there."""
    ends = (problem.start, problem.goal)
    from_goal = ends[1].anchored and not ends[0].anchored
    spiral = _spiral(problem, duration, states, from_goal)
    if spiral is None or all(end.anchored for end in ends):
        return None
    place = states[0 if from_goal else 1][0]
    gap = _distance(_end_of(spiral, problem.dimension)[0], place)
    return spiral if gap < 0.05 * _distance(place, spiral.center[: problem.dimension]) else None


def spiral_change(problem: TransferProblem, duration: float, spiral: Spiral) -> float:
    """The velocity change of a spiral to an open place [m/s].

    What turns the plane of a coast, as the oblateness of a planet does, needs no thrust where the goal lets it:
    it counts from the orbit to which the start has drifted.
    """
    begin, whole = problem.start_time, spiral.velocity_change
    drifted = _drift(problem, 0.0, duration, end_estimates(problem, duration)[0])
    change = velocity_change_between(problem, (drifted, problem.goal.estimate(begin + duration, drifted)))
    # Elsewhere both are the same but for rounding.
    return whole if problem.goal.anchored or not change < DRIFTED * whole else change


def windings_between(problem: TransferProblem, duration: float, states: Any, more: int | None = None) -> list:
    """Paths of an orbit that changes evenly between two states around a lone attractor: (path, turns, sure).

    A path is a function of the fractions of the duration, and `turns` are its whole revolutions. `sure` says
    that it is near the best path: the orbit is nearly round and meets its phase without going beyond the
    orbits of the ends. The first path has the number of revolutions that fits the duration best; where none
    fits well, one with one revolution less and one with one more follow. With `more` there is only the path
    of that many revolutions more. There is none where an end is open or the orbits are too different.
    """
    first = _winding(problem, duration, states, more or 0)
    attractor = problem.attraction.lone
    if first is None or attractor is None:
        return []
    center = attractor.place(problem.dimension)

    def positions(winding: Winding, fractions: np.ndarray) -> np.ndarray:
        return winding.positions(fractions)[:, : problem.dimension] + center

    windings = [first]
    if more is None and abs(first.bend) > MOST_BENT:
        others = (replace(first, more=step) for step in (-1, 1))
        windings += [other for other in others if other.turns != first.turns and other.lasts]
    found = [(partial(positions, winding), winding.turns) for winding in windings]
    sure = abs(first.bend) <= MOST_BENT and first.eccentricity < NEARLY_ROUND
    return [(*winding, sure) for winding in found]


def _winding(problem: TransferProblem, duration: float, states: Any, more: int = 0) -> Winding | None:
    """An even change between two states around a lone attractor; None where `windings_between` has no path."""
    attractor = problem.attraction.lone
    if attractor is None or not (problem.start.anchored and problem.goal.anchored):
        return None
    start, goal = _from_center(problem, attractor, states)
    spins = cross(*start), cross(*goal)
    if not spins[0] @ spins[1] > OPPOSITE * np.linalg.norm(spins[0]) * np.linalg.norm(spins[1]):
        return None
    winding = Winding(attractor.mu, duration, start, goal, more)
    return winding if winding.eccentricity <= MOST_ECCENTRIC and winding.lasts else None


def with_more_turns(problem: TransferProblem, base: DiscretePath, turns: int) -> DiscretePath:
    """A path around a lone attractor with so many revolutions more: evenly changed orbits, or itself turned."""
    lone = problem.attraction.lone
    assert lone is not None
    center = lone.place(problem.dimension)
    ends = [(base.position[i], v) for i, v in ((0, base.start_velocity), (-1, base.goal_velocity))]
    windings = windings_between(problem, base.duration, ends, turns)
    turned = center + turned_around(base.position - center, turns * base.fractions)
    return replace(base, position=windings[0][0](base.fractions) if windings else turned)


def two_burns(problem: TransferProblem, first: DiscretePath) -> DiscretePath | None:
    """A path of two burns of full thrust on the mesh of another one; None where they would be long or dear."""
    limit, duration = problem.actuator.force_limit() or 0.0, first.duration
    if problem.size > problem.dimension or np.isnan(problem.start.fixed()).any() or problem.goal.anchored:
        return None
    found = two_impulses(problem, duration)
    if found is None:
        return None
    sizes = np.linalg.norm(found.changes, axis=1)
    lengths, between = problem.mass * sizes / limit, np.diff(found.times)[0]
    even = velocity_change_between(problem, end_estimates(problem, duration))
    if not 0 < lengths.min() < lengths.max() < SHORT_BURN * between or sizes.sum() > NO_DEARER * even:
        return None
    begins, ends = found.times - 0.5 * lengths, found.times + 0.5 * lengths
    if begins[0] < 0:
        return None
    weights = np.diff(first.mesh) if first.hold else node_weights(first.mesh, scheme(first.order))
    edges = duration * np.append(0.0, np.cumsum(weights))
    # Each control has the part of its share of the time in which there is thrust.
    covered = np.minimum(edges[1:, None], ends) - np.maximum(edges[:-1, None], begins)
    force = (np.maximum(covered, 0.0) / np.diff(edges)[:, None] * limit / sizes) @ found.changes
    states = found.states(duration * first.fractions)
    control = controls_for(problem, force)
    if control is None:
        return None
    position, velocity = np.hsplit(states, 2)
    path = replace(first, start_velocity=velocity[0], goal_velocity=velocity[-1])
    return with_mass(problem, replace(path, position=position, control=control))


def change_without_phase(problem: TransferProblem, states: Any) -> float | None:
    """The velocity change of an even change of one orbit into another, whatever the phase [m/s].

    None where `windings_between` has no such path.
    """
    winding = _winding(problem, problem.duration_bounds[0], states)
    return None if winding is None else winding.velocity_change


def swings(problem: TransferProblem) -> float:
    """Swings a second of the motion, or of a goal that moves [1/s]; 0 where nothing does.

    In a frame that turns, on a spring or to a goal that goes to and fro each swing may hold an optimum: one
    that was found at once cost 48 times as much as the best.
    """
    ends, begin = (problem.start, problem.goal), problem.start_time
    point = problem.inertia is None and not problem.links and problem.system is None
    if not point or problem.attraction.sources or not all(end.anchored for end in ends):
        return 0.0
    shortest, longest = problem.duration_bounds
    q, v = (np.nan_to_num(part) for part in problem.start.estimate(begin))
    matrix = np.array(Dynamics.of(problem).linearised[0](begin, q, v, problem.mass))
    modes = np.linalg.eigvals(matrix) if np.isfinite(matrix).all() else np.zeros(1)
    rate = float(np.abs(modes.imag).max()) / (2 * np.pi)
    if problem.goal.moves:
        at = np.linspace(begin + shortest, begin + longest, SAMPLES)
        ways = np.diff([problem.goal.estimate(time)[0] for time in at], axis=0)
        turned = (ways[1:] * ways[:-1] < 0).sum(axis=0).max()
        rate = max(rate, 0.5 * turned / (longest - shortest))
    return rate


def _from_center(problem: TransferProblem, attractor: Attractor, states: Any) -> list[tuple]:
    """Start and goal with three axes, from the attractor."""
    center, fill = attractor.place(problem.dimension), np.zeros(3 - problem.dimension)
    return [(np.append(q - center, fill), np.append(v, fill)) for q, v in states]


def _spiral(problem: TransferProblem, duration: float, states: Any, from_goal: bool) -> Spiral | None:
    attractor = problem.attraction.lone
    if attractor is None:
        return None
    start, goal = _from_center(problem, attractor, states)
    if not (np.any(start[0]) and np.any(goal[0])):
        # An end in the attractor itself is refused later, when the effects are evaluated there.
        return None
    center = np.pad(attractor.place(problem.dimension), (0, 3 - problem.dimension))
    spiral = Spiral(attractor.mu, center, duration, start, goal, from_goal)
    return spiral if spiral.eccentricity < MOST_ECCENTRIC else None


def _end_of(spiral: Spiral, dimension: int) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity of a spiral at its open end, which the motion decides."""
    q, v = spiral.states(np.array([0.0 if spiral.from_goal else 1.0]))
    return (q[0] + spiral.center)[:dimension], v[0, :dimension]


def _carried(problem: TransferProblem, known: tuple, begin: float, end: Boundary, finish: float) -> tuple:
    """A state at an open end, reached by coasting there from the known end.

    To an end on an orbit the body coasts for half of the time on the known orbit and for half on that one.
    Then spirals between the two improve the place.
    """
    middle = 0.5 * (begin + finish)
    state = _drift(problem, begin, middle, known)
    likely = end.estimate(problem.start_time + middle, state)
    orbit = not (end.anchored or np.isnan(likely).any())
    state = _drift(problem, middle, finish, likely if orbit else state)
    position, velocity = end.estimate(problem.start_time + finish, state)
    if end.anchored:
        state = (position, _turned(problem, state, position))
    state = tuple(
        np.where(np.isnan(at), here, at) for at, here in zip((position, velocity), state, strict=True)
    )
    for _ in range(PASSES if orbit else 0):
        backward = begin > finish
        spiral = _spiral(problem, abs(finish - begin), (state, known) if backward else (known, state), backward)
        if spiral is not None:
            state = end.estimate(problem.start_time + finish, _end_of(spiral, problem.dimension))
    return state


def _drift(problem: TransferProblem, begin: float, finish: float, state: tuple) -> tuple:
    """A state some time later, or earlier, without thrust."""
    states = coast(problem, begin, finish, state)
    return state if states is None else tuple(np.split(states[-1], 2))


def _turned(problem: TransferProblem, state: tuple, to: np.ndarray) -> np.ndarray:
    """The velocity of a state as it would be at another place around the first attractor."""
    q, v = state
    center = problem.attraction.center
    q, to, v = (np.pad(x, (0, 3 - len(x))) for x in (q - center, to - center, v))
    # The velocity keeps its parts along and across the direction to the attractor, and its size falls with the
    # root of the distance, as on circles.
    up, across = (unit @ v for unit in (_direction(q), _direction(np.cross(np.cross(q, v), q))))
    turned = up * _direction(to) + across * _direction(np.cross(np.cross(q, v), to))
    return np.sqrt(np.linalg.norm(q) / np.linalg.norm(to)) * turned[: len(center)]


def _direction(x: np.ndarray) -> np.ndarray:
    return x / (np.linalg.norm(x) or 1.0)


def _distance(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.linalg.norm(a - b))


def turned_around(offset: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Positions around the origin, each turned by its number of `turns` in the plane of the motion."""
    padded = np.pad(offset, ((0, 0), (0, 3 - offset.shape[1])))
    normal = np.cross(padded[:-1], padded[1:]).sum(axis=0)
    normal = normal / (np.linalg.norm(normal) or 1.0)
    angle = 2 * np.pi * turns[:, None]
    # Rodrigues' formula
    along = normal * (padded @ normal)[:, None]
    turned = np.cos(angle) * padded + np.sin(angle) * np.cross(normal, padded) + (1 - np.cos(angle)) * along
    return turned[:, : offset.shape[1]]
