"""Where a body gets without thrust, and from that the states of ends that leave them open."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.adams import adams
from dmoc.basics.memory import kept
from dmoc.effects.base import Conservative
from dmoc.effects.frames import RotatingFrame
from dmoc.effects.gravity import PointGravity
from dmoc.guess.spiral import MOST_BENT, Spiral, Winding
from dmoc.motion.dynamics import Dynamics
from dmoc.scene.ends import Boundary
from dmoc.scene.problem import TransferProblem

# A coast is followed at this many places at least.
LEAST_SAMPLES = 2000
# How often the place where a spiral arrives is put onto the open orbit, from which the next spiral starts.
PASSES = 3
# From so many revolutions on a path between two states winds evenly around the attractor.
MANY_TURNS = 3
# Orbits beyond this eccentricity, or this cosine of the angle between their planes, have no even change.
MOST_ECCENTRIC, NEARLY_ROUND, OPPOSITE = 0.9, 0.3, -0.9


def attractors_of(problem: TransferProblem) -> list[PointGravity]:
    return [effect for effect in problem.effects if isinstance(effect, PointGravity)]


def lone_attractor(problem: TransferProblem) -> PointGravity | None:
    """The one attractor of a frame that does not turn, around which there are orbits."""
    attractors = attractors_of(problem)
    turning = any(isinstance(effect, RotatingFrame) for effect in problem.effects)
    return attractors[0] if len(attractors) == 1 and not turning and problem.dimension > 1 else None


def center_of(attractor: PointGravity, dimension: int) -> np.ndarray:
    return np.zeros(dimension) if attractor.center is None else np.array(attractor.center)


def orbital_rates(problem: TransferProblem, position: np.ndarray) -> np.ndarray:
    """Rate of a circular orbit around all attractors, sqrt(sum mu / r^3) [1/s]; 0 without any."""
    squares = np.zeros(len(position))
    for attractor in attractors_of(problem):
        distance = np.linalg.norm(position - center_of(attractor, problem.dimension), axis=1)
        # a node in the attractor itself asks for no steps: it is refused by name
        outside = distance > 1e-6 * distance.max()
        squares[outside] += attractor.mu / distance[outside] ** 3
    return np.sqrt(squares)


def coast(
    problem: TransferProblem, begin: float, finish: float, state: tuple, samples: int = LEAST_SAMPLES
) -> np.ndarray | None:
    """Positions and velocities without thrust at evenly spaced times, from a state at the first of them on.

    Times are counted from the start [s]; `finish` may lie before `begin`. Shape (samples, 2 axes);
    None where the body falls into an attractor.
    """
    # without what resists: backward in time drag feeds the motion without bound
    conservative = tuple(effect for effect in problem.effects if isinstance(effect, Conservative))
    dynamics = Dynamics.of(problem, conservative)
    centers = tuple(tuple(center_of(attractor, problem.dimension)) for attractor in attractors_of(problem))
    least = [0.02 * math.dist(state[0], center) for center in centers]
    march = kept(partial(_march, dynamics, centers, samples), "coast", dynamics, samples)
    sizes = [float(np.abs(part).max()) or 1.0 for part in state]
    given = problem.start_time + begin, finish - begin, problem.mass, *sizes, *least
    scales = np.repeat(sizes, problem.dimension)
    try:
        states = march(x0=np.concatenate(state) / scales, p=given)["xf"].full().T * scales
    except RuntimeError:
        return None
    # what has fallen in stays there
    last = states[-1, : problem.dimension]
    fell_in = any(math.dist(last, center) <= near for center, near in zip(centers, least, strict=True))
    return None if fell_in or not np.isfinite(states).all() else states


def _march(dynamics: Dynamics, centers: tuple, samples: int) -> ca.Function:
    """Scaled state, (time, span, mass, scales, nearest distances) -> states of a coast.

    A body that comes nearer to an attractor than that stays where it is: nothing is ever evaluated at
    a singularity, and no step becomes endlessly small.
    """
    n, fraction = dynamics.dimension, ca.SX.sym("fraction")
    state, given = ca.SX.sym("state", 2 * n), ca.SX.sym("given", 5 + len(centers))
    time, span, mass, length, speed, *least = ca.vertsplit(given)
    q, v = state[:n] * length, state[n:] * speed
    pull = dynamics.acceleration(time + fraction * span, q, v, mass, ca.DM.zeros(n))
    rate = span * ca.vertcat(v / length, pull / speed)
    for center, near in zip(centers, least, strict=True):
        rate = ca.if_else(ca.sumsqr(q - ca.DM(center)) <= near**2, 0, rate)
    # more steps from one of so many places to the next are for more revolutions than a guess can have
    motion = {"t": fraction, "x": state, "p": given, "ode": rate}
    return adams(motion, np.linspace(0.0, 1.0, samples), tol=1e-10, most_steps=1000)


def end_estimates(problem: TransferProblem, duration: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Position and velocity of start and goal, NaN where nothing is known.

    Near an attractor an end that leaves something open is where the other end coasts.
    """
    ends, times = (problem.start, problem.goal), (0.0, duration)
    states = [end.estimate(problem.start_time + at) for end, at in zip(ends, times, strict=True)]
    whole = [not np.isnan(state).any() for state in states]
    settled = [end.anchored and known for end, known in zip(ends, whole, strict=True)]
    if attractors_of(problem) and any(whole) and not all(settled):
        known = (settled if any(settled) else whole).index(True)
        open_end = 1 - known
        states[open_end] = _carried(problem, states[known], times[known], ends[open_end], times[open_end])
    return states


def velocity_change_between(problem: TransferProblem, states: Any) -> float:
    """About what many revolutions from one orbit to another take [m/s]; see `Spiral.velocity_change`."""
    attractor = lone_attractor(problem)
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


def windings_between(problem: TransferProblem, duration: float, states: Any, more: int | None = None) -> list:
    """Paths of an orbit that changes evenly between two states around a lone attractor, each with two facts.

    They are its revolutions, and whether it is sure to be near the best: a nearly round orbit that need
    not go beyond those of the ends for its phase. First the path whose number of revolutions fits the
    duration best, and where none fits well one with one more and one less; or only that with so many
    `more`. None where an end is open or the orbits are too different. A path is a function of the
    fractions of the duration.
    """
    attractor = lone_attractor(problem)
    if attractor is None or not (problem.start.anchored and problem.goal.anchored):
        return []
    start, goal = _from_center(problem, attractor, states)
    spins = np.cross(*start), np.cross(*goal)
    if not spins[0] @ spins[1] > OPPOSITE * np.linalg.norm(spins[0]) * np.linalg.norm(spins[1]):
        return []
    center = center_of(attractor, problem.dimension)

    def positions(winding: Winding, fractions: np.ndarray) -> np.ndarray:
        return winding.positions(fractions)[:, : problem.dimension] + center

    windings = [Winding(attractor.mu, duration, start, goal, more or 0)]
    if windings[0].eccentricity > MOST_ECCENTRIC or not windings[0].lasts:
        return []
    if more is None and abs(windings[0].bend) > MOST_BENT:
        others = (Winding(attractor.mu, duration, start, goal, step) for step in (-1, 1))
        windings += [other for other in others if other.turns != windings[0].turns and other.lasts]
    found = [(partial(positions, winding), winding.turns) for winding in windings]
    sure = abs(windings[0].bend) <= MOST_BENT and windings[0].eccentricity < NEARLY_ROUND
    return [(*winding, sure) for winding in found]


def _from_center(problem: TransferProblem, attractor: PointGravity, states: Any) -> list[tuple]:
    """Start and goal with three axes, from the attractor."""
    center, fill = center_of(attractor, problem.dimension), np.zeros(3 - problem.dimension)
    return [(np.append(q - center, fill), np.append(v, fill)) for q, v in states]


def _spiral(problem: TransferProblem, duration: float, states: Any, from_goal: bool) -> Spiral | None:
    attractor = lone_attractor(problem)
    if attractor is None:
        return None
    start, goal = _from_center(problem, attractor, states)
    if not (np.any(start[0]) and np.any(goal[0])):
        # in the attractor itself: refused, in words, when the effects are looked at
        return None
    center = np.pad(center_of(attractor, problem.dimension), (0, 3 - problem.dimension))
    spiral = Spiral(attractor.mu, center, duration, start, goal, from_goal)
    return spiral if spiral.eccentricity < MOST_ECCENTRIC else None


def _end_of(spiral: Spiral, dimension: int) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity at the end that the motion decides."""
    q, v = spiral.states(np.array([0.0 if spiral.from_goal else 1.0]))
    return (q[0] + spiral.center)[:dimension], v[0, :dimension]


def _carried(problem: TransferProblem, known: tuple, begin: float, end: Boundary, finish: float) -> tuple:
    """A state at an open end, reached by coasting there from the known end.

    Onto an orbit: half the time on the one and half on the other, then as a spiral leads there.
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
    center = center_of(attractors_of(problem)[0], len(q))
    q, to, v = (np.pad(x, (0, 3 - len(x))) for x in (q - center, to - center, v))
    up, across = (unit @ v for unit in (_unit(q), _unit(np.cross(np.cross(q, v), q))))
    turned = up * _unit(to) + across * _unit(np.cross(np.cross(q, v), to))
    return np.sqrt(np.linalg.norm(q) / np.linalg.norm(to)) * turned[: len(center)]


def _unit(x: np.ndarray) -> np.ndarray:
    return x / (np.linalg.norm(x) or 1.0)


def _distance(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.linalg.norm(a - b))
