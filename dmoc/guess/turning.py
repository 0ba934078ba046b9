"""The path to start from of a body that turns: a slerp between its attitudes, beside the path of its centre."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import short
from dmoc.basics.quaternions import (
    angle_between,
    conjugate,
    in_one_sign,
    normalised,
    rotation_vectors,
    slerp,
    times,
    turned_by,
)
from dmoc.configurations.of_problem import configuration_of
from dmoc.links.along import guess_along
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_fractions
from dmoc.motion.path import DiscretePath
from dmoc.parts.forces import BallForce, FreeForce
from dmoc.parts.objectives import Effort
from dmoc.scene.problem import TransferProblem

# The attitude of a body of which neither end says how it is turned.
UNTURNED = np.array([1.0, 0.0, 0.0, 0.0])
# The guess is bent off the axis of the turn by this angle [rad]. A turn about a principal axis is stationary,
# though it need not be cheapest: in least time it is up to a tenth slower than the fastest (K. D. Bilimoria,
# B. Wie, J. Guid. Control Dyn. 16, 1993), by the least effort a body tilts to an axis of less inertia.
BENT = 0.1
# A turn at its limit of torque is guessed to take this many times the least time that it could take [-].
LEISURE = 1.2


def turning_states(problem: TransferProblem, duration: float) -> tuple[np.ndarray, ...]:
    """Attitude and rate of start and of goal, with likely values for what is free."""
    ends = (problem.start, problem.goal)
    times_there = (problem.start_time, problem.start_time + duration)
    found = []
    for end, at in zip(ends, times_there, strict=True):
        position, velocity = end.estimate(at)
        found.append((position[-4:], velocity[-3:]))
    (q0, w0), (q1, w1) = found
    if np.isnan(q0).any():
        q0 = UNTURNED if np.isnan(q1).any() else q1
    if np.isnan(q1).any():
        q1 = q0
    # A goal that is fixed has its sign from the problem; one that moves takes the shorter way.
    if np.isnan(problem.goal.fixed()[0][-4:]).any() and q0 @ q1 < 0:
        q1 = -q1
    mean = 2 * np.arctan2(np.linalg.norm(q1 - q0), np.linalg.norm(q1 + q0)) * 2 / duration
    axis = rotation_vectors(times(conjugate(q0), q1))
    size = float(np.linalg.norm(axis))
    rate = mean * axis / size * (1 if q0 @ q1 >= 0 else -1) if size else np.zeros(3)
    return q0, np.where(np.isnan(w0), rate, w0), q1, np.where(np.isnan(w1), rate, w1)


def attitudes_along(problem: TransferProblem, duration: float, fractions: np.ndarray) -> np.ndarray:
    """The attitude by a turn of about constant rate, shape (nodes, 4), without a change of sign."""
    q0, _, q1, _ = turning_states(problem, duration)
    path = slerp(q0, q1, fractions)
    if not problem.actuator.turns_every_way:
        return path
    axis = rotation_vectors(times(conjugate(q0), q1))
    aside = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    aside = aside / (np.linalg.norm(aside) or 1.0)
    # Neither along a body axis nor symmetric in two of them, so that no symmetry is left.
    aside = 0.8 * aside + 0.6 * np.cross(axis / (np.linalg.norm(axis) or 1.0), aside)
    bend = min(BENT, 0.5 * float(np.linalg.norm(axis))) * np.sin(np.pi * fractions)
    return times(path, turned_by(bend[:, None] * aside))


def turning_duration(problem: TransferProblem) -> float:
    """A likely duration of a turn at the limit of torque [s]; the middle of the bounds without a limit."""
    shortest, longest = problem.duration_bounds
    middle = float(np.sqrt(shortest * longest))
    limit = problem.actuator.turning_limit()
    if limit is None or not problem.free_duration:
        return middle
    q0, w0, q1, w1 = turning_states(problem, middle)
    acceleration = limit / problem.moment
    angle = float(angle_between(q0, q1))
    needed = 2 * np.sqrt(angle / acceleration) + float(np.linalg.norm(w1 - w0)) / acceleration
    return float(np.clip(LEISURE * needed, shortest, longest)) if needed > 0 else middle


def as_point(problem: TransferProblem) -> TransferProblem:
    """The same transfer for a point mass: what moves the centre of the body, without its attitude."""
    limit = problem.actuator.force_limit()
    return TransferProblem(
        problem.mass,
        problem.start.point,
        problem.goal.point,
        problem.duration,
        effects=[effect for effect in problem.effects if not effect.turns_body],
        actuator=FreeForce() if limit is None else BallForce(limit),
        objective=Effort(),
        constraints=[one for one in problem.constraints if not one.turns_body and one.point is None],
        start_time=problem.start_time,
    )


def checked_turning(
    problem: TransferProblem, given: Any, fractions: np.ndarray, times_at: np.ndarray
) -> np.ndarray:
    """Coordinates along a user's own guess, attitudes made unit quaternions of one sign.

    Raises
    ------
    ValueError
        If it has another number of coordinates, or cannot be evaluated.
    """
    body = configuration_of(problem)
    names = ", ".join(body.names)
    try:
        if callable(given):
            position = np.array([np.atleast_1d(np.asarray(given(time), float)) for time in times_at])
        else:
            known, values = (np.asarray(part, float) for part in given[:2])
            position = np.stack([np.interp(times_at, known, column) for column in values.T], axis=1)
    except Exception as error:  # whatever a user's function raises
        raise ValueError(
            f"guess must be a function of time [s] that gives {names}, arrays (times, coordinates) or a former "
            f"solution; {short(given)} fails: {' '.join(str(error).split())[:120]}"
        ) from error
    if position.shape != (len(fractions), body.size) or not np.isfinite(position).all():
        raise ValueError(f"guess must give {body.size} finite coordinates, {names}; got {position.shape[-1]}")
    for at in body.coordinates.quaternions:
        position[:, at] = in_one_sign(normalised(position[:, at]))
        goal = problem.goal.fixed()[0][at]
        if float(position[-1, at] @ goal) < 0:
            position[:, at] *= -1
    return position


def linked_guess(
    problem: TransferProblem, given: Any, duration: float, fractions: np.ndarray
) -> tuple[np.ndarray, tuple[np.ndarray, ...], Any]:
    """Coordinates of bodies that links hold, their velocities at both ends, and what they are made of."""
    made_of = configuration_of(problem).coordinates
    if given is None:
        return *guess_along(problem, fractions), made_of
    position = checked_turning(problem, given, fractions, problem.start_time + duration * fractions)
    ends = tuple(np.nan_to_num(end.fixed()[1]) for end in (problem.start, problem.goal))
    return position, ends, made_of


def resting_load(problem: Any, path: DiscretePath) -> np.ndarray:
    """Forces of the constraint g(q) = 0 per unit mass that hold the bodies at rest along a path.

    At each node the load of the effects is shared, by least squares, between these and the actuator. Without
    them the first steps of Ipopt let bodies that hang on rods fall, and lead to swings among other optima.

    Returns
    -------
    array, shape (nodes, conditions)
    """
    dynamics = Dynamics.of(problem)
    body, nodes = dynamics.configuration, len(path.position)
    t, q, still = ca.SX.sym("t"), ca.SX.sym("q", body.size), ca.DM.zeros(body.size)
    reaction, u = ca.SX.sym("reaction", body.conditions), ca.SX.sym("u", problem.controls)
    slope, _, push = dynamics.point(t, q, still, problem.mass)
    held = ca.jacobian(body.pull(q, reaction), reaction)
    driven = ca.jacobian(body.driven(problem.actuator, q, u, problem.mass), u)
    # Where the actuator is not linear in its controls it carries what it does near none.
    carried = ca.substitute(ca.horzcat(held, -driven), u, ca.DM.zeros(u.shape))
    load = ca.Function("load", [t, q], [ca.densify(carried), ca.densify(ca.SX(slope + push))])
    times = problem.start_time + path.duration * path.fractions
    bars, loads = (np.array(part) for part in load.map(nodes)(times[None], path.position.T))
    bars = bars.reshape(body.size, nodes, -1).transpose(1, 0, 2)
    shares = np.einsum("kij,jk->ki", np.linalg.pinv(np.nan_to_num(bars)), np.nan_to_num(loads))
    return shares[:, : body.conditions]


def turning_guess(
    problem: TransferProblem, on: tuple, given: Any, duration: float | None, for_point: tuple
) -> DiscretePath:
    """The guess of a body that turns.

    `on` are mesh, order and hold; `for_point` the functions that give a path and a duration of a point mass.
    """
    (mesh, order, hold), (path_of_point, duration_of_point) = on, for_point
    body = configuration_of(problem)
    if isinstance(given, DiscretePath):
        if given.coordinates != body.coordinates:
            raise ValueError(
                f"guess has {given.position.shape[1]} coordinates but the problem has {body.size}: "
                f"{', '.join(body.names)}"
            )
        return given.onto(mesh, order, hold)
    fractions, moves = node_fractions(mesh, scheme(order)), problem.start.has_position
    point = as_point(problem) if moves else None
    likely = turning_duration(problem)
    if point is not None and problem.free_duration and problem.actuator.limited:
        likely = max(likely if problem.actuator.turning_limit() else 0.0, duration_of_point(point))
    duration = duration or likely
    control = np.zeros((len(mesh) - 1 if hold else len(fractions), problem.controls))
    _, start, _, goal = turning_states(problem, duration)
    place = None if point is None else path_of_point(point, mesh, order, hold, None, duration)
    wheels = int(body.coordinates.spins.sum())
    moving = (np.empty(0),) * 2 if place is None else (place.start_velocity, place.goal_velocity)
    start, goal = (
        np.concatenate([speed, np.zeros(wheels), rate])
        for speed, rate in zip(moving, (start, goal), strict=True)
    )
    if given is not None:
        position = checked_turning(problem, given, fractions, problem.start_time + duration * fractions)
    else:
        position = attitudes_along(problem, duration, fractions)
        before = np.empty((len(fractions), 0)) if place is None else place.position
        position = np.hstack([before, np.zeros((len(fractions), wheels)), position])
    ends = ((0, problem.start.fixed(), start), (-1, problem.goal.fixed(), goal))
    for at, (fixed, _), _ in ends:
        position[at] = np.where(np.isnan(fixed), position[at], fixed)
    velocities = [np.where(np.isnan(fixed), guessed, fixed) for _, (_, fixed), guessed in ends]
    mass = np.full(len(position), problem.mass)
    on_mesh = mesh, order, hold, duration, position, control, mass
    path = DiscretePath(*on_mesh, velocities[0], velocities[1], made_of=body.coordinates)
    for zone in problem.constraints:
        if zone.point is not None and given is None:
            seen = path.place_of(zone)
            path = path.moved(zone.off_centre(seen, fractions) - seen)
    return path
