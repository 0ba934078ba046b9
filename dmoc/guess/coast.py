"""Coasts: where a body gets without thrust."""

from __future__ import annotations

import math
from functools import partial

import casadi as ca
import numpy as np

from dmoc.basics.memory import remembered
from dmoc.basics.numerics import adams
from dmoc.effects.base import Conservative
from dmoc.motion.dynamics import Dynamics
from dmoc.scene.problem import TransferProblem

# A coast is followed at this many places at least; between them it is interpolated linearly.
LEAST_SAMPLES = 2000
# From this many revolutions on a guess between two states is an orbit that changes evenly: two coasts that are
# blended would be off by revolutions. The solver treats such a transfer as one of many revolutions, too.
MANY_TURNS = 3
# From this many revolutions on a guess to an open place on an orbit is the path of least effort: with fewer, an
# orbit that changes evenly leads to the same answer sooner. Coarse meshes and the solver's tolerance follow the
# revolutions, too, whose rounding adds up.
VERY_MANY_TURNS = 8


def coast(
    problem: TransferProblem, begin: float, finish: float, state: tuple, samples: int = LEAST_SAMPLES
) -> np.ndarray | None:
    """Positions and velocities without thrust at evenly spaced times, from a state at the first of them on.

    Times are counted from the start [s]; `finish` may lie before `begin`. Shape (samples, 2 axes);
    None where the body falls into an attractor.
    """
    # Only conservative effects act: backward in time a drag would feed the motion without bound.
    conservative = tuple(effect for effect in problem.effects if isinstance(effect, Conservative))
    dynamics = Dynamics.of(problem, conservative)
    centers = tuple(tuple(attractor.place(problem.dimension)) for attractor in problem.attraction.sources)
    least = [0.02 * math.dist(state[0], center) for center in centers]
    march = remembered(partial(_march, dynamics, centers, samples), "coast", dynamics, samples)
    sizes = [float(np.abs(part).max()) or 1.0 for part in state]
    given = problem.start_time + begin, finish - begin, problem.mass, *sizes, *least
    scales = np.repeat(sizes, problem.dimension)
    try:
        states = march(x0=np.concatenate(state) / scales, p=given)["xf"].full().T * scales
    except RuntimeError:
        return None
    # A body that has fallen in stays where it is, so the last state tells.
    last = states[-1, : problem.dimension]
    fell_in = any(math.dist(last, center) <= near for center, near in zip(centers, least, strict=True))
    return None if fell_in or not np.isfinite(states).all() else states


def _march(dynamics: Dynamics, centers: tuple, samples: int) -> ca.Function:
    """Scaled state, (time, span, mass, scales, nearest distances) -> states of a coast.

    A body that comes nearer to an attractor than its nearest distance stays where it is: nothing is ever
    evaluated at a singularity, and no step becomes endlessly small.
    """
    n, fraction = dynamics.positions, ca.SX.sym("fraction")
    state, given = ca.SX.sym("state", 2 * n), ca.SX.sym("given", 5 + len(centers))
    time, span, mass, length, speed, *least = ca.vertsplit(given)
    q, v = state[:n] * length, state[n:] * speed
    pull = dynamics.acceleration(time + fraction * span, q, v, mass, ca.DM.zeros(n))
    rate = span * ca.vertcat(v / length, pull / speed)
    for center, near in zip(centers, least, strict=True):
        rate = ca.if_else(ca.sumsqr(q - ca.DM(center)) <= near**2, 0, rate)
    # A coast that takes more than 1000 steps between two neighbouring places has more revolutions than a guess
    # can have.
    motion = {"t": fraction, "x": state, "p": given, "ode": rate}
    return adams(motion, np.linspace(0.0, 1.0, samples), tol=1e-10, most_steps=1000)
