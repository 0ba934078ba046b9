"""The path of least time from a state to an open place on an orbit, over many revolutions, by shooting."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.memory import remembered
from dmoc.basics.numerics import adams
from dmoc.motion.dynamics import Dynamics
from dmoc.scene.problem import TransferProblem
from dmoc.shots.extremal import (
    CLOSE,
    MET,
    MOST_SHOTS,
    MOST_STEPS,
    PATH_TOLERANCE,
    SHOT_TOLERANCE,
    STATIONARY,
    Extremal,
    Shot,
    goal_rows,
    roughly_least_effort,
    searched,
)

# From one shot to the next the thrust turns by at most this at either end of the path [rad], and the duration
# changes by at most this part [-]: over many revolutions slopes tell little of larger changes.
MOST_TURNED, MOST_LONGER = 0.5, 0.02
# A search ends where the goal is missed by this [-]: the thrust has then turned round on the way.
FAR_OFF = 1e-2
# The mean thrust is that of so many places.
PLACES = 2001


@dataclass(frozen=True)
class Soonest:
    """The motion under full thrust in the direction that leads to a place in the least time.

    Costates are those of `Extremal`, and so are their equations: the thrust points along -w. For least time it
    is full throughout (L. S. Pontryagin et al., 1962), so that the mass is known, and of first costates only
    the direction counts. The duration is unknown instead.
    """

    extremal: Extremal

    @cached_property
    def numbers(self) -> np.ndarray:
        """Parameters: start time, units, mass, full thrust over mass, the part of the mass burnt a second."""
        problem, actuator = self.extremal.problem, self.extremal.problem.actuator
        thrust = (actuator.force_limit() or 0.0) / problem.mass
        burnt = float(actuator.flow(full_controls(problem))) / problem.mass if actuator.burns else 0.0
        return np.array(
            [problem.start_time, self.extremal.length, self.extremal.speed, problem.mass, thrust, burnt]
        )

    def first(self, costate: np.ndarray, duration: float) -> np.ndarray:
        """Scaled state and costate at the start, and the duration."""
        state = np.concatenate(self.extremal.state) / self.extremal.scales
        return np.concatenate([state, costate, [duration]])

    def shot(self, costate: np.ndarray, duration: float) -> tuple[Shot, np.ndarray, np.ndarray]:
        """Where a motion ends, what may be changed at its start, and by how much that turns the thrust.

        The least time to a state has the slope -costate / H, with the Hamiltonian H = -costate . d(state)/dt
        without the time itself; an effect that depends on the time changes it a little. Changes are those
        of the costate across itself, and of the duration by a part of it.
        """
        size, axes = len(costate), len(costate) // 2
        dynamics = Dynamics.of(self.extremal.problem)
        march, rates = remembered(partial(_sensitive, dynamics), "soonest", dynamics)
        begin = self.first(costate, duration)
        slopes = np.zeros((2 * size + 1, size + 1))
        slopes[size:] = np.eye(size + 1)
        end = march(x0=np.concatenate([begin, slopes.ravel("F")]), p=self.numbers)["xf"].full()[:, -1]
        state, last = end[:size], end[size : 2 * size]
        slopes = end[2 * size + 1 :].reshape(size + 1, -1).T
        slopes[:, size] *= duration
        changes = np.zeros((size + 1, size))
        changes[:size, : size - 1], changes[size, -1] = np.linalg.svd(costate[None])[2][1:].T, 1.0
        rate = np.append(rates(0.0, begin, self.numbers).full().ravel()[:size], 0.0)
        hamiltonian = -costate @ rate[:size]
        flow = slopes[size : 2 * size] / hamiltonian + np.outer(last, rate) / hamiltonian**2
        ends = (costate[axes:], np.eye(size + 1)[axes:size]), (last[axes:], slopes[size + axes : 2 * size])
        turned = np.stack([_across(thrust, slope @ changes) for thrust, slope in ends])
        return Shot(state, last / hamiltonian, slopes[:size] @ changes, flow @ changes), changes, turned

    def along(self, costate: np.ndarray, duration: float, fractions: np.ndarray) -> tuple[np.ndarray, ...]:
        """Positions [m], velocities [m/s], forces [N] and masses [kg] at fractions of the duration."""
        problem, axes, size = self.extremal.problem, self.extremal.problem.dimension, len(costate)
        march = adams(_motion(Dynamics.of(problem)), fractions, PATH_TOLERANCE, MOST_STEPS)
        found = march(x0=self.first(costate, duration), p=self.numbers)["xf"].full()
        states = found[:size].T * self.extremal.scales
        thrust = -found[size + axes : 2 * size].T
        force = (problem.actuator.force_limit() or 0.0) * thrust / np.linalg.norm(thrust, axis=1, keepdims=True)
        mass = problem.mass * (1 - self.numbers[-1] * duration * fractions)
        return states[:, :axes], states[:, axes:], force, mass


def full_controls(problem: TransferProblem) -> np.ndarray:
    """Controls of full thrust along the first axis [N]."""
    controls = np.zeros(problem.controls)
    controls[[0, *range(problem.dimension, problem.controls)]] = problem.actuator.force_limit() or 0.0
    return controls


def least_time(problem: TransferProblem, duration: float, state: tuple) -> tuple[float, Callable] | None:
    """The least time from a state to the goal, many revolutions away [s], and the path; None if none is found.

    `duration` is about what it takes. The path gives positions [m], velocities [m/s], forces [N] and masses
    [kg], a row for each of the fractions of the duration that it is asked for.
    """
    soonest = Soonest(Extremal(problem, duration, state))
    parts = problem.start, problem.goal, problem.effects, problem.actuator, problem.mass, problem.start_time
    found = remembered(partial(_found, soonest), "soonest costate", *parts, duration, *state)[0]
    return None if found is None else (found[1], partial(soonest.along, *found))


def _found(soonest: Soonest) -> tuple[tuple[np.ndarray, float] | None]:
    """The first costate and the duration with which a motion ends at the best place of the goal, if any.

    The search begins with the thrust of the least effort within its limit, in the time that takes its impulse,
    and goes along the goal once that is near.
    """
    extremal = soonest.extremal
    costate = roughly_least_effort(extremal)
    costate = None if costate is None else searched(extremal, costate, True, CLOSE)
    if costate is None or not costate.any():
        return (None,)
    *_, force, _ = extremal.along(costate, np.linspace(0.0, 1.0, PLACES))
    mean = np.linalg.norm(force, axis=1).mean() / (extremal.problem.actuator.force_limit() or 1.0)
    duration = float(mean * extremal.duration)
    for _ in range(MOST_SHOTS):
        costate = costate / np.linalg.norm(costate)
        try:
            shot, changes, turned = soonest.shot(costate, duration)
            goal = goal_rows(replace(extremal, duration=duration))
            change, miss, slope = shot.correction(goal, first_across=True)
        except (RuntimeError, np.linalg.LinAlgError):
            return (None,)
        if miss < MET and slope < STATIONARY:
            return ((costate, duration),)
        if not miss < FAR_OFF:
            return (None,)
        step, turn = changes @ change, np.linalg.norm(turned @ change, axis=1).max()
        share = min(1.0, MOST_TURNED / (turn or 1.0), MOST_LONGER / (abs(step[-1]) or 1.0))
        costate, duration = costate + share * step[:-1], duration * (1 + share * float(step[-1]))
    return (None,)


def _across(vector: np.ndarray, changes: np.ndarray) -> np.ndarray:
    """Changes of a vector, one a column, across it and in parts of its size."""
    size = np.linalg.norm(vector)
    unit = vector / size
    return (changes - np.outer(unit, unit @ changes)) / size


def _motion(dynamics: Dynamics) -> dict[str, Any]:
    """The scaled motion of state, costate and duration under full thrust."""
    n, fraction, given = dynamics.positions, ca.SX.sym("fraction"), ca.SX.sym("given", 6)
    begin, length, speed, mass, thrust, burnt = ca.vertsplit(given)
    both = ca.SX.sym("both", 4 * n + 1)
    q, v, at_position, at_velocity, duration = ca.vertsplit(both, [0, n, 2 * n, 3 * n, 4 * n, 4 * n + 1])
    passed = fraction * duration
    left = 1 - burnt * passed
    pull = dynamics.acceleration(begin + passed, q * length, v * speed, left * mass, ca.DM.zeros(n))
    turn = duration * speed / length
    change = ca.dot(at_position, turn * v) + ca.dot(at_velocity, pull * duration / speed)
    push = -thrust / left * duration / speed * at_velocity / ca.norm_2(at_velocity)
    rates = [turn * v, pull * duration / speed + push, -ca.gradient(change, q), -ca.gradient(change, v), 0]
    return {"t": fraction, "x": both, "p": given, "ode": ca.vertcat(*rates)}


def _sensitive(dynamics: Dynamics) -> tuple[ca.Function, ca.Function]:
    """The motion from 0 to 1 with its slopes over first costate and duration, and its rates."""
    motion, size = _motion(dynamics), 2 * dynamics.positions
    slopes = ca.SX.sym("slopes", 2 * size + 1, size + 1)
    rates = ca.jacobian(motion["ode"], motion["x"]) @ slopes
    both = ca.vertcat(motion["x"], ca.vec(slopes)), ca.vertcat(motion["ode"], ca.vec(rates))
    more = motion | {"x": both[0], "ode": both[1]}
    march = adams(more, np.array([0.0, 1.0]), SHOT_TOLERANCE, MOST_STEPS)
    return march, ca.Function("rates", [motion["t"], motion["x"], motion["p"]], [motion["ode"]])
