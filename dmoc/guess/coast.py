"""Coasts: where a body gets without thrust, and between two impulses; what holds it and what turns it."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.memory import remembered
from dmoc.basics.numerics import adams
from dmoc.basics.records import dataclass
from dmoc.configurations.acting import point_function
from dmoc.configurations.of_problem import configuration_of
from dmoc.effects.base import Conservative
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_weights
from dmoc.motion.path import DiscretePath
from dmoc.motion.scales import path_scales
from dmoc.parts.actuator import told_of
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
# What holds a body up is estimated in this many places of a path.
HELD_UP_AT = 20
# The half of an ellipse between two orbits is laid so many times through where the coast before it ends.
PASSES = 3


@dataclass(frozen=True)
class Impulses:
    """A path of coasts with a change of the velocity between one and the next.

    Attributes
    ----------
    times : array, shape (count,)
        Of the impulses, counted from the start [s].
    changes : array, shape (count, axes)
        Of the velocity [m/s].
    arcs : list
        Of each coast the times of its ends [s], and its positions and velocities at evenly spaced times.
    """

    times: np.ndarray
    changes: np.ndarray
    arcs: list[tuple[float, float, np.ndarray]]

    def states(self, at: np.ndarray) -> np.ndarray:
        """Positions [m] and velocities [m/s] at times from the start on [s], shape (count, 2 axes)."""
        found = np.zeros((len(at), self.arcs[0][2].shape[1]))
        for begin, finish, states in self.arcs:
            inside = (at >= begin) & (at <= finish)
            places = np.linspace(begin, finish, len(states))
            found[inside] = np.stack([np.interp(at[inside], places, column) for column in states.T], axis=1)
        return found


def two_impulses(problem: TransferProblem, duration: float) -> Impulses | None:
    """From a known state to an orbit around a lone attractor by half an ellipse (W. Hohmann, 1925).

    Between orbits that are nearly round that takes the least change of velocity. The coasts before and after
    take as long as each other. None where the ellipse takes longer than there is.
    """
    attractor, n = problem.attraction.lone, problem.dimension
    assert attractor is not None
    center, start, goal = attractor.place(n), problem.start.fixed(), problem.start_time + duration
    leave, radius = 0.5 * duration, 0.0
    before: Any = None
    for _ in range(PASSES):
        if leave <= 0 or (before := coast(problem, 0.0, leave, start)) is None:
            return None
        q, v = before[-1, :n] - center, before[-1, n:]
        distance = float(np.linalg.norm(q))
        # A velocity across the position, along the motion, and its opposite half a revolution later.
        along = v - q * (v @ q) / distance**2
        along /= np.linalg.norm(along) or 1.0
        aside = center - q * ((radius or distance) / distance)
        place, wanted = problem.goal.estimate(goal, (aside, -along * np.linalg.norm(v)))
        radius = float(np.linalg.norm(place - center))
        half = 0.5 * (distance + radius)
        there, arriving = (np.sqrt(attractor.mu * (2 / r - 1 / half)) for r in (distance, radius))
        taken = np.pi * np.sqrt(half**3 / attractor.mu)
        leave = 0.5 * (duration - taken)
    on_the_way = coast(problem, leave, leave + taken, (q + center, there * along))
    after = coast(problem, leave + taken, duration, (place, wanted))
    if leave <= 0 or on_the_way is None or after is None:
        return None
    changes = np.stack([there * along - v, wanted + arriving * along])
    arcs = [(0.0, leave, before), (leave, leave + taken, on_the_way), (leave + taken, duration, after)]
    return Impulses(np.array([leave, leave + taken]), changes, arcs)


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


def controls_for(problem: TransferProblem, force: np.ndarray) -> np.ndarray | None:
    """The controls with which the actuator gives a force of shape (count, axes) [N].

    None unless the controls are the force, or the force and its magnitude.
    """
    n = problem.dimension
    more = problem.actuator.labels(n)[n:]
    if problem.controls < n or more not in ((), ("throttle",)):
        return None
    return np.hstack([force, np.linalg.norm(force, axis=1, keepdims=True)]) if more else force


def with_mass(problem: TransferProblem, path: DiscretePath) -> DiscretePath:
    """The path with the mass that its controls leave, at least half of it."""
    if not problem.actuator.burns:
        return path
    flow = told_of(problem.actuator, "flow", path.control)
    weights = node_weights(path.mesh, scheme(path.order))
    if path.hold:
        flow = np.interp(path.fractions, 0.5 * (path.mesh[1:] + path.mesh[:-1]), flow)
    burnt = path.duration * np.cumsum(weights * flow)
    return replace(path, mass=np.maximum(problem.mass - burnt, 0.5 * problem.mass))


def held_up(problem: TransferProblem, path: DiscretePath) -> tuple[float, float]:
    """About the largest force [N] and torque [N m] that undo what the effects of a scene do along a path."""
    if not problem.effects:
        return 0.0, 0.0
    some = np.linspace(0, len(path.position) - 1, min(len(path.position), HELD_UP_AT)).astype(int)
    times = problem.start_time + path.duration * path.fractions[some]
    position, mass = path.position[some], path.mass[some]
    velocity = np.gradient(position, times, axis=0)
    acting = point_function(problem.effects, configuration_of(problem), kinetic=False)
    pull, _, push = (
        np.array(ca.densify(part)) for part in acting(times[None], position.T, velocity.T, mass[None])
    )
    load = np.nan_to_num(np.abs(pull + push) * mass, posinf=0.0).max(axis=1)
    places = path.coordinates.places
    return float(load[places].max(initial=0.0)), float(load[~places].max(initial=0.0))


def turning_torque(problem: TransferProblem, path: DiscretePath) -> float:
    """The torque that turns the body as far as a path does, or as fast as it turns at an end [N m]."""
    scales = path_scales(path)
    return float(problem.moment * max(scales.turn / path.duration, scales.rate) / path.duration)
