"""The path of least effort from a state to an open place on an orbit, over many revolutions, by shooting."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.memory import remembered
from dmoc.basics.numerics import adams
from dmoc.basics.records import dataclass
from dmoc.effects.base import Attractor
from dmoc.motion.dynamics import Dynamics
from dmoc.scene.problem import TransferProblem

# The costates are 1 where the thrust, over the whole duration, changes the velocity by this part of itself [-]:
# errors of the integrator are relative to 1, and a thrust of many revolutions is far below gravity.
TYPICAL_CHANGE = 0.05
# Shots follow the motion to this relative error [-]: ten times as much leaves the last shots in noise, a
# tenth of it takes a third longer.
SHOT_TOLERANCE = 1e-9
# The path that is handed on is followed to this relative error, which is well below that of any mesh.
PATH_TOLERANCE = 1e-11
# Between two places the integrator makes at most this many steps; a revolution takes about 100.
MOST_STEPS = 1_000_000
# A search ends after this many shots: those that arrive take 5 to 15.
MOST_SHOTS = 25
# The goal is met if its scaled rows are below this [-], ten metres: the solver mends what is left at once.
MET = 1e-6
# The place on the goal is the best one if along the goal the effort changes by less than this part of its
# change across it [-].
STATIONARY = 1e-5
# Without the limit of the thrust the goal needs to be met only so well [-] before the limit is switched on.
ROUGHLY_MET = 1e-2
# From this distance on [-] the curvature of the goal counts: farther off its multipliers mean nothing.
CLOSE = 1e-3
# Close to the goal the arrival moves by at most this per shot, over the distance from the attractor [-]: oblate
# bodies make several optima a revolution, and a longer step would jump from one to another.
LONGEST_STEP = 0.5
# Far from the goal a shot aims at a place at most so much nearer, over the distance from the attractor [-].
LONGEST_LEAP = 0.15
# A curvature of the effort below this [-] counts as this much: where it is none, no step is the best.
LEAST_CURVATURE = 1e-12


@dataclass(frozen=True)
class Extremal:
    """The motion under the thrust that minimises half the integral of its squared acceleration.

    With costates w of the velocity and y of the position, y' = -dH/dq, w' = -dH/dv for the Hamiltonian
    H = y . v + w . (g(t, q, v) + u), g the acceleration by all effects, and u = -w, shortened to what the
    thrust can do (L. S. Pontryagin et al., 1962). The mass only shortens the thrust and has no costate.
    """

    problem: TransferProblem
    duration: float
    state: tuple[np.ndarray, np.ndarray]

    @cached_property
    def length(self) -> float:
        """The unit of length, the distance from the attractor at the start [m]."""
        return float(np.linalg.norm(self.state[0] - self._attractor.place(self.problem.dimension)))

    @cached_property
    def speed(self) -> float:
        """The unit of speed, that of a circular orbit there [m/s]."""
        return float(np.sqrt(self._attractor.mu / self.length))

    @cached_property
    def _attractor(self) -> Attractor:
        """The attractor around which motion is fastest at the start: the only one, or the next one."""
        place, n = self.state[0], self.problem.dimension
        return max(
            self.problem.attraction.sources,
            key=lambda one: one.mu / (np.linalg.norm(place - one.place(n)) ** 3 or np.inf),
        )

    @property
    def thrust(self) -> float:
        """The unit of thrust per unit mass [m/s^2]."""
        return TYPICAL_CHANGE * self.speed / self.duration

    @cached_property
    def scales(self) -> np.ndarray:
        """Units of position and velocity, shape (2 axes,)."""
        return np.repeat([self.length, self.speed], self.problem.dimension)

    def numbers(self, limited: bool) -> np.ndarray:
        """Parameters of the motion: times [s], units, largest thrust and loss of mass, both in these units."""
        actuator, problem = self.problem.actuator, self.problem
        largest, burnt = np.inf, 0.0
        if limited and (limit := actuator.force_limit()) is not None:
            largest = limit / problem.mass / self.thrust
            probe = np.eye(problem.controls)[-1]
            burnt = TYPICAL_CHANGE * self.speed * float(actuator.flow(probe)) if actuator.burns else 0.0
        return np.array(
            [problem.start_time, self.duration, self.length, self.speed, problem.mass, min(largest, 1e9), burnt]
        )

    def first(self, costate: np.ndarray) -> np.ndarray:
        """Scaled state, costate and mass at the start."""
        return np.concatenate([np.concatenate(self.state) / self.scales, costate, [1.0]])

    def shot(self, costate: np.ndarray, limited: bool) -> Shot:
        """Where the motion with this first costate ends, and how that depends on it."""
        size = len(self.scales)
        dynamics = Dynamics.of(self.problem)
        march = remembered(partial(_sensitive, dynamics), "extremal", dynamics)
        slopes = np.zeros((size, 2 * size + 1))
        slopes[:, size : 2 * size] = np.eye(size)
        begin = np.concatenate([self.first(costate), slopes.ravel()])
        end = march(x0=begin, p=self.numbers(limited))["xf"].full()[:, -1]
        slopes = end[2 * size + 1 :].reshape(size, -1).T
        return Shot(end[:size], end[size : 2 * size], slopes[:size], slopes[size : 2 * size])

    def along(self, costate: np.ndarray, fractions: np.ndarray) -> tuple[np.ndarray, ...]:
        """Positions [m], velocities [m/s], forces [N] and masses [kg] at fractions of the duration."""
        axes, size = self.problem.dimension, len(self.scales)
        motion, thrust = _motion(Dynamics.of(self.problem))
        march = adams(motion, fractions, PATH_TOLERANCE, MOST_STEPS)
        found = march(x0=self.first(costate), p=self.numbers(True))["xf"].full()
        states = found[:size].T * self.scales
        mass = self.problem.mass * found[-1]
        push = thrust(found, self.numbers(True)).full().T * self.thrust * mass[:, None]
        return states[:, :axes], states[:, axes:], push, mass


@dataclass(frozen=True)
class Shot:
    """The end of a motion, scaled: state, costate, and their slopes over the first costate."""

    state: np.ndarray
    costate: np.ndarray
    state_slopes: np.ndarray
    costate_slopes: np.ndarray

    def correction(self, goal: ca.Function) -> tuple[np.ndarray, float, float]:
        """The change of the first costate, the miss of the goal, and the relative slope of the effort along it.

        The least effort to a state has the slope -costate and the Hessian -d(costate)/d(state). Of a step
        the part across the goal brings its rows to zero, the part along it goes down that parabola; with
        the curvature of the goal, once that is near.
        """
        flow = np.linalg.solve(self.state_slopes.T, self.costate_slopes.T).T
        hessian = -0.5 * (flow + flow.T)
        miss, normals, _ = (part.full() for part in goal(self.state, np.zeros(goal.size1_in(1))))
        multipliers = np.linalg.lstsq(normals.T, self.costate, rcond=None)[0]
        across = -np.linalg.lstsq(normals, miss.ravel(), rcond=None)[0]
        across *= min(1.0, LONGEST_LEAP / (np.abs(across).max() or 1.0))
        tangents = np.linalg.svd(normals)[2][len(miss) :].T
        error = float(np.abs(miss).max())
        if error < CLOSE:
            hessian = hessian + goal(self.state, multipliers)[2].full()
        curvature, modes = np.linalg.eigh(tangents.T @ hessian @ tangents)
        uphill = modes.T @ tangents.T @ (hessian @ across - self.costate)
        along = -modes @ (uphill / np.maximum(np.abs(curvature), LEAST_CURVATURE))
        if error < CLOSE:
            along *= min(1.0, LONGEST_STEP / (np.linalg.norm(along) or 1.0))
        slope = np.linalg.norm(tangents.T @ self.costate) / (np.linalg.norm(self.costate) or 1.0)
        return np.linalg.solve(self.state_slopes, across + tangents @ along), error, float(slope)


def least_effort(problem: TransferProblem, duration: float, state: tuple) -> Callable | None:
    """The path of least effort from a state to the goal, many revolutions away; None if none is found.

    It gives positions [m], velocities [m/s], forces [N] and masses [kg], a row for each of the fractions of the
    duration that it is asked for.
    """
    extremal = Extremal(problem, duration, state)
    parts = problem.start, problem.goal, problem.effects, problem.actuator, problem.mass, problem.start_time
    # The guess is asked for on several meshes, and the search takes longer than all of them.
    costate = remembered(partial(_found, extremal), "costate", *parts, duration, *state)[0]
    return None if costate is None else partial(extremal.along, costate)


def _found(extremal: Extremal) -> tuple[np.ndarray | None]:
    return (first_costate(extremal),)


def first_costate(extremal: Extremal) -> np.ndarray | None:
    """The costate at the start with which the motion ends at the best place of the goal; None if none is found.

    The search begins with a coast around the bare attractor: with oblateness and other bodies there are paths
    on which the effort is stationary that take twice as much, and a coast leads to them. The limit of the
    thrust is switched on when the goal is nearly met.
    """
    problem, coast = extremal.problem, np.zeros(len(extremal.scales))
    known = _around_bare_attractor(extremal)
    stages = (False, True) if problem.actuator.force_limit() is not None else (False,)
    # Where what disturbs the orbit is so strong that this leads nowhere, the coast itself has to do.
    for begin in (coast,) if known is None else (known, coast):
        costate: np.ndarray | None = begin
        for limited in stages:
            if costate is not None:
                costate = searched(extremal, costate, limited, MET if limited == stages[-1] else ROUGHLY_MET)
        if costate is not None:
            return costate
    return None


def _around_bare_attractor(extremal: Extremal) -> np.ndarray | None:
    """The costate around the attractor alone; None where nothing else acts, or where none is found."""
    problem = extremal.problem
    bare = tuple(effect for effect in problem.effects if effect.attractor() is not None)
    if problem.attraction.lone is None or len(bare) == len(problem.effects):
        return None
    return searched(
        replace(extremal, problem=replace(problem, effects=bare)), np.zeros(len(extremal.scales)), False, MET
    )


def searched(extremal: Extremal, costate: np.ndarray, limited: bool, enough: float) -> np.ndarray | None:
    """The costate at the start from which the goal is met so well, shot after shot; None if there is none."""
    goal = goal_rows(extremal)
    for _ in range(MOST_SHOTS):
        try:
            change, miss, slope = extremal.shot(costate, limited).correction(goal)
        except (RuntimeError, np.linalg.LinAlgError):
            # The body falls into the attractor, or a thrust at its limit all along cannot be changed.
            return None
        if miss < enough and (slope < STATIONARY or enough > MET):
            return costate
        costate = costate + change
    # The goal is met, but the best place on it is many revolutions away: the solver goes on from here.
    return costate if miss < CLOSE else None


def goal_rows(extremal: Extremal) -> ca.Function:
    """(scaled state, multipliers) -> equations of the goal, their Jacobian, Hessian of their weighted sum."""
    problem, axes = extremal.problem, extremal.problem.dimension
    state = ca.SX.sym("state", 2 * axes)
    q, v = ca.vertsplit(state * extremal.scales, axes)
    rows = problem.goal.rows(problem.start_time + extremal.duration, q, v, problem.mass)
    miss = ca.vertcat(*(row.expression - row.upper for row in rows if row.lower == row.upper))
    multipliers = ca.SX.sym("multipliers", miss.numel())
    hessian = ca.hessian(ca.dot(multipliers, miss), state)[0]
    return ca.Function("goal", [state, multipliers], [miss, ca.densify(ca.jacobian(miss, state)), hessian])


def _motion(dynamics: Dynamics) -> tuple[dict[str, Any], ca.Function]:
    """The scaled motion of state, costate and mass, and (these, numbers) -> thrust per unit mass."""
    n, fraction, given = dynamics.positions, ca.SX.sym("fraction"), ca.SX.sym("given", 7)
    time, duration, length, speed, mass, largest, burnt = ca.vertsplit(given)
    both = ca.SX.sym("both", 4 * n + 1)
    q, v, at_position, at_velocity, left = ca.vertsplit(both, [0, n, 2 * n, 3 * n, 4 * n, 4 * n + 1])
    # A root of the square and a little keeps the direction of no thrust defined.
    wanted = ca.sqrt(ca.sumsqr(at_velocity) + 1e-12)
    share = ca.fmin(1, largest / left / wanted)
    none = ca.DM.zeros(n)
    pull = dynamics.acceleration(time + fraction * duration, q * length, v * speed, left * mass, none)
    turn = duration * speed / length
    change = ca.dot(at_position, turn * v) + ca.dot(at_velocity, pull * duration / speed)
    push = -share * at_velocity
    rates = [
        turn * v,
        pull * duration / speed + TYPICAL_CHANGE * push,
        -ca.gradient(change, q),
        -ca.gradient(change, v),
        -left * burnt * share * wanted,
    ]
    motion = {"t": fraction, "x": both, "p": given, "ode": ca.vertcat(*rates)}
    return motion, ca.Function("thrust", [both, given], [push])


def _sensitive(dynamics: Dynamics) -> ca.Function:
    """The motion from 0 to 1 together with its slopes over the first costate."""
    motion, _ = _motion(dynamics)
    size = 2 * dynamics.positions
    slopes = ca.SX.sym("slopes", 2 * size + 1, size)
    rates = ca.jacobian(motion["ode"], motion["x"]) @ slopes
    both = ca.vertcat(motion["x"], ca.vec(slopes)), ca.vertcat(motion["ode"], ca.vec(rates))
    more = motion | {"x": both[0], "ode": both[1]}
    return adams(more, np.array([0.0, 1.0]), SHOT_TOLERANCE, MOST_STEPS)
