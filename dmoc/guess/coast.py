"""Where a body gets without thrust, and from that the states of ends that leave them open."""

from __future__ import annotations

import math
from functools import partial

import casadi as ca
import numpy as np

from dmoc.basics.memory import remembered
from dmoc.basics.numerics import adams
from dmoc.effects.base import Conservative
from dmoc.effects.frames import RotatingFrame
from dmoc.effects.gravity import PointGravity
from dmoc.motion.dynamics import Dynamics
from dmoc.scene.problem import TransferProblem

# A coast is followed at this many places at least.
LEAST_SAMPLES = 2000
# From so many revolutions on a path between two states winds evenly around the attractor.
MANY_TURNS = 3


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
    march = remembered(partial(_march, dynamics, centers, samples), "coast", dynamics, samples)
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
