"""The path to start from: coast arcs where a point mass attracts, a straight line elsewhere."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from dmoc.basics.arguments import LARGEST, short
from dmoc.guess.around import path_around, shortest_flyable
from dmoc.guess.coast import controls_for
from dmoc.guess.open_ends import end_estimates, spiral_between, spiral_change
from dmoc.guess.past_zones import off_centres, off_saddles
from dmoc.guess.shot import LIKELY, shot_guess
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_fractions, node_weights, step_nodes
from dmoc.motion.momenta import legendre_momenta
from dmoc.motion.path import DiscretePath
from dmoc.scene.problem import TransferProblem


def starting_guess(
    problem: TransferProblem,
    mesh: np.ndarray,
    order: int,
    hold: bool,
    given: Any = None,
    duration: float | None = None,
) -> DiscretePath:
    """A guess on the mesh: from `given`, else from the problem's own guess, else from its physics.

    It lasts `duration` [s] or, without one, as long as the problem says or the transfer is likely to need.

    Raises
    ------
    ValueError
        If the guess has another dimension than the problem or holds a number that is not finite, or too large.
    """
    given = problem.guess if given is None else given
    force = getattr(given, "force", None)
    given = getattr(given, "path", given)
    if hasattr(given, "as_one"):
        given = given.as_one(problem.controls)
    if problem.inertia is not None and not problem.links:
        # What turns bodies is loaded for problems with such bodies alone.
        from dmoc.guess.turning import turning_guess

        point = starting_guess, guess_duration
        return turning_guess(problem, (mesh, order, hold), given, duration, point)
    if isinstance(given, DiscretePath):
        if given.position.shape[1] != problem.size:
            raise ValueError(f"guess has {given.position.shape[1]} axes but the problem has {problem.size}")
        given.refuse_unusable("guess")
        if given.control.shape[1] != problem.controls:
            given = _of_other_controls(problem, given, force)
        return given.onto(mesh, order, hold)
    fractions, asked = node_fractions(mesh, scheme(order)), duration
    duration = duration or guess_duration(problem)
    linked = problem.links or problem.system is not None
    if given is None and not linked:
        best = shot_guess(problem, mesh, order, hold, duration, asked is None)
        if best is not None:
            return best
    places = len(mesh) - 1 if hold else len(fractions)
    control, spiral, ends = np.zeros((places, problem.controls)), False, ()  # type: tuple[Any, bool, Any]
    made_of = None
    if linked and (given is None or problem.turns):
        from dmoc.guess.turning import linked_guess

        position, ends, made_of = linked_guess(problem, given, duration, fractions)
    elif given is None:
        position, ends, spiral = _default_path(problem, duration, fractions)
    else:
        position = _given_path(problem, given, duration, fractions)
        ends = _end_states(problem, duration)[1::2]
        if not callable(given) and len(given) == 3:
            at = 0.5 * (mesh[1:] + mesh[:-1]) if hold else fractions
            control = _given_controls(problem, given, problem.start_time + duration * at)
    if (wrong := ~(np.abs(position) <= LARGEST).all(axis=1)).any():
        node = int(np.argmax(wrong))
        kind = "larger than any motion" if np.isfinite(position[node]).all() else "not finite"
        raise ValueError(f"guess is {kind} at node {node}: position {position[node]} m")
    for end, place in ((problem.start, 0), (problem.goal, -1)):
        known = ~np.isnan(end.fixed()[0])
        position[place, known] = end.fixed()[0][known]
    mass = np.full(len(fractions), problem.mass)
    guess = replace(DiscretePath(mesh, order, hold, duration, position, control, mass, *ends), made_of=made_of)
    guess = off_centres(problem, guess)
    return replace(guess, control=_force_along(problem, guess)) if spiral else guess


def angle_around(problem: TransferProblem, guess: DiscretePath) -> float:
    """About the angle that a path turns through around all attractors [rad]."""
    rates = problem.attraction.rates(guess.place)
    return float(np.trapezoid(rates, guess.duration * guess.fractions))


def _force_along(problem: TransferProblem, guess: DiscretePath) -> np.ndarray:
    """The controls that take the body along a guess, by the discrete equations; within the limits.

    From a path that meets its equations Ipopt finds multipliers near the right ones, by least squares.
    """
    n, rule = problem.dimension, scheme(guess.order)
    if controls_for(problem, np.zeros((1, n))) is None:
        return guess.control
    dynamics, begin = Dynamics.of(problem), problem.start_time
    at, rows = step_nodes(len(guess.mesh) - 1, rule), np.zeros_like(guess.position)
    np.add.at(rows, at, legendre_momenta(dynamics, guess, begin))
    ends = ((0, begin, guess.start_velocity, 1), (-1, begin + guess.duration, guess.goal_velocity, -1))
    for place, t, v, sign in ends:
        rows[place] += sign * dynamics.point(t, guess.position[place], v, problem.mass)[1].full().ravel()
    force = -problem.mass * rows / (guess.duration * node_weights(guess.mesh, rule))[:, None]
    if guess.hold:
        force = np.einsum("j,jkn->kn", rule.weights, force[at])
    thrust, limit = np.linalg.norm(force, axis=1, keepdims=True), problem.actuator.force_limit()
    # All forces are scaled down together until the largest keeps the limit: the path in between stays smooth.
    control = controls_for(problem, force)
    assert control is not None
    return control if limit is None else control * min(1.0, limit / (thrust.max() or limit))


def guess_duration(problem: TransferProblem) -> float:
    """The duration, or a likely one within its bounds [s].

    With a force limit: from rest to rest over the distance and the change of velocity at full
    force, and a fifth more; between two places near an attractor as long as the default path needs;
    where the place on an orbit is open, the time for the change of the distance from the attractor or that
    for the change of the orbit, whichever is longer, and a fifth more. Otherwise the geometric mean of the
    bounds.
    """
    shortest, longest = problem.duration_bounds
    if not problem.free_duration:
        return shortest
    limit = problem.actuator.force_limit()
    middle = float(np.sqrt(shortest * longest))
    if limit is None:
        return middle
    q0, v0, q1, v1 = _end_states(problem, middle)
    acceleration = limit / problem.mass
    if problem.attraction.lone is not None and problem.start.anchored and problem.goal.anchored:
        return shortest_flyable(problem, partial(_ends_in_pairs, problem), acceleration)
    spiral = spiral_between(problem, middle, ((q0, v0), (q1, v1)))
    if spiral is not None:
        change = spiral_change(problem, middle, spiral)
        needed = max(2 * np.sqrt(spiral.climb / acceleration), change / acceleration)
    else:
        needed = 2 * np.sqrt(np.linalg.norm(q1 - q0) / acceleration) + np.linalg.norm(v1 - v0) / acceleration
    return float(np.clip(LIKELY * needed, shortest, longest)) if needed > 0 else middle


def _of_other_controls(problem: TransferProblem, given: DiscretePath, force: np.ndarray | None) -> DiscretePath:
    """A path of another actuator, with all the mass: its force [N], if known, as the controls of this one."""
    control = None if force is None else controls_for(problem, force)
    if control is None:
        control = np.zeros((len(given.control), problem.controls))
    return replace(given, control=control, mass=np.full(len(given.mass), problem.mass), multipliers={})


def _given_path(problem: TransferProblem, given: Any, duration: float, fractions: np.ndarray) -> np.ndarray:
    times = problem.start_time + duration * fractions
    try:
        if callable(given):
            position = np.array([np.atleast_1d(np.asarray(given(time), float)) for time in times])
        else:
            known, values = (np.asarray(part, float) for part in given[:2])
            values = values.reshape(len(known), -1)
            if not (np.isfinite(known).all() and (np.diff(known) > 0).all()):
                raise ValueError("its times do not increase")
            position = np.stack([np.interp(times, known, column) for column in values.T], axis=1)
    except Exception as error:  # whatever a user's function raises
        raise ValueError(
            "guess must be a function of time [s] that gives positions [m], arrays (times, positions) or "
            f"(times, positions, controls), or a former solution; {short(given)} fails: "
            f"{' '.join(str(error).split())[:120]}"
        ) from error
    if position.shape != (len(fractions), problem.size):
        found = position.shape[-1] if position.ndim == 2 else f"{position.ndim - 1} times nested"
        raise ValueError(f"guess has {found} axes but the problem has {problem.size}")
    return position


def _given_controls(problem: TransferProblem, given: Any, times: np.ndarray) -> np.ndarray:
    """The controls of a guess (times, positions, controls) at other times."""
    known, values = np.asarray(given[0], float), np.asarray(given[2], float)
    if values.shape != (len(known), problem.controls) or not (np.abs(values) <= LARGEST).all():
        raise ValueError(
            f"guess has controls of shape {values.shape} but needs finite numbers of shape "
            f"{(len(known), problem.controls)}: one row a time, "
            f"with {', '.join(problem.actuator.labels(problem.dimension))}"
        )
    return np.stack([np.interp(times, known, column) for column in values.T], axis=1)


def _end_states(problem: TransferProblem, duration: float) -> tuple[np.ndarray, ...]:
    """Start position and velocity, goal position and velocity, with likely values for what is free."""
    (q0, v0), (q1, v1) = end_estimates(problem, duration)
    # An open place is where the mean of the known velocities leads: a body that gets there fast has not stood
    # still, and an engine that burns throughout would turn round to do so.
    drift = duration * 0.5 * (np.nan_to_num(v0) + np.nan_to_num(v1))
    q0 = np.where(np.isnan(q0), np.where(np.isnan(q1), 0.0, q1 - drift), q0)
    q1 = np.where(np.isnan(q1), q0 + drift, q1)
    mean = (q1 - q0) / duration
    return q0, np.where(np.isnan(v0), mean, v0), q1, np.where(np.isnan(v1), mean, v1)


def _ends_in_pairs(problem: TransferProblem, duration: float) -> tuple:
    q0, v0, q1, v1 = _end_states(problem, duration)
    return (q0, v0), (q1, v1)


def _default_path(problem: TransferProblem, duration: float, fractions: np.ndarray) -> tuple:
    """Positions, the velocities of both ends, and whether the forces along the path are worth starting from."""
    q0, v0, q1, v1 = _end_states(problem, duration)
    if not problem.attraction.sources:
        q1 = off_saddles(problem, duration, q1, v1)
        return q0 + fractions[:, None] * (q1 - q0), (v0, v1), False
    path, worth = path_around(problem, duration, ((q0, v0), (q1, v1)), fractions)
    return path, (v0, v1), worth
