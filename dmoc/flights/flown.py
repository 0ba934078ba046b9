"""Flights for tests and for planning: a body flies commands, and sensors see it with errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import entries, number, short, whole
from dmoc.basics.numerics import columns
from dmoc.basics.quaternions import QUATERNION, rotated, rotation_of, times, turned_by
from dmoc.configurations.coordinates import ATTITUDE
from dmoc.configurations.of_problem import configuration_of
from dmoc.effects.base import Effect
from dmoc.ends.base import Boundary
from dmoc.flights.flight import Flight
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.march import node_masses, rollout
from dmoc.motion.mesh import node_fractions
from dmoc.motion.path import DiscretePath
from dmoc.parts.actuator import Actuator
from dmoc.parts.forces import FreeForce
from dmoc.scene.problem import TransferProblem

# The order of the scheme that flies: with steps as short as those between samples its error is rounding.
ORDER = 8
# Times that differ by less than this part of the flight are one [-].
ONE_TIME = 1e-12


def fly(
    times: Any,
    forces: Any,
    start: Boundary,
    mass: float = 1.0,
    effects: Sequence[Effect] = (),
    actuator: Actuator | None = None,
    inertia: Any = None,
    attitudes: Any = None,
    offset: Any = None,
    strength: float = 1.0,
    turn: Any = None,
    delay: float = 0.0,
    noise: float = 0.0,
    force_noise: float = 0.0,
    velocity_noise: float | None = None,
    attitude_noise: float = 0.0,
    rate_noise: float | None = None,
    dropped: float = 0.0,
    seed: int = 0,
    name: str = "flight",
) -> Flight:
    """A flight of commands that are held from sample to sample, as sensors with errors see it.

    Parameters
    ----------
    times : array, shape (samples,)
        Of samples and of commands [s].
    forces : array, shape (samples, controls), or function of the time
        Commands [N], as the actuator takes them.
    start : State, Pose or Attitude
        Without free entries.
    mass, effects, actuator, inertia, offset, strength, turn, delay
        The truth, as `identify` asks for it.
    attitudes : array, shape (samples,) or (samples, 4), or function of the time
        Of a body whose attitude is known and does not matter to its motion: angles [rad] or quaternions.
    noise, velocity_noise, attitude_noise, rate_noise : float
        Standard deviations of positions [m], velocities [m/s], attitudes about each axis [rad] and rates
        [rad/s]; velocities and rates are seen only where one is given.
    force_noise : float
        That of each control [N], drawn anew each step.
    dropped : float
        Part of the samples that are lost, 0 to less than 1 [-]; commands are not.
    seed : int
        The same seed gives the same errors, each kind from numbers of its own.

    Raises
    ------
    ValueError
        If a number has no meaning or shapes do not fit.
    """
    clock, late = _clock(times), number("delay", delay, "s", nonnegative=True)
    if (lost := number("dropped", dropped, "-", nonnegative=True)) >= 1:
        raise ValueError(f"dropped must be less than 1 [-]; got {lost:g}")
    whole("seed", seed, least=0)
    lasts, begins = float(clock[-1] - clock[0]), float(clock[0])
    actuator = FreeForce() if actuator is None else actuator
    problem = TransferProblem(mass, start, start, lasts, effects, actuator, start_time=begins, inertia=inertia)
    given = _at_times("forces", forces, clock, len(force_labels(problem)))
    commands = with_throttle(given, problem)
    kinds = ("positions", "force", "velocities", "attitudes", "rates", "lost")
    random = {kind: np.random.default_rng([seed, i]) for i, kind in enumerate(kinds)}
    force = _turned(problem, number("strength", strength, "-") * commands, turn)
    force = force + _errors("force_noise", force_noise, "N", random["force"], commands.shape)
    position, speed, attitude, rate = _flown(problem, clock, force, late)
    found: dict[str, Any] = {}
    if attitude is None and attitudes is not None:
        attitude = _at_times("attitudes", attitudes, clock, None)
    if attitude is not None:
        found["attitudes"] = _seen_attitudes(attitude, attitude_noise, random["attitudes"])
    if position.shape[1]:
        errors = _errors("noise", noise, "m", random["positions"], position.shape)
        found["positions"] = position + _arm(attitude, offset, position) + errors
    for kind, name_of_it, sigma, values, unit in (
        ("velocities", "velocity_noise", velocity_noise, speed, "m/s"),
        ("rates", "rate_noise", rate_noise, rate, "rad/s"),
    ):
        if sigma is not None and values is not None:
            found[kind] = values + _errors(name_of_it, sigma, unit, random[kind], values.shape)
    gone = (random["lost"].random(len(clock)) < lost) | (clock < clock[0] + late)
    for kind in found.keys() - {"attitudes"}:
        found[kind][gone] = np.nan
    return Flight(clock, forces=given, name=name, **found)


def force_labels(problem: TransferProblem) -> tuple[str, ...]:
    """The controls that a flight has: all of the actuator but a throttle, which is the size of the force."""
    labels = tuple(problem.actuator.labels(problem.dimension))
    return labels[:-1] if labels and labels[-1] == "throttle" else labels


def with_throttle(forces: np.ndarray, problem: TransferProblem) -> np.ndarray:
    """Commands with the throttle that goes with each force, where the actuator has one and they have not."""
    if forces.shape[1] == problem.controls:
        return forces
    return np.hstack([forces, np.linalg.norm(forces, axis=1)[:, None]])


def _clock(times: Any) -> np.ndarray:
    clock = np.array([number("times", one, "s") for one in entries(times) or ()])
    if len(clock) < 3 or not (np.diff(clock) > 0).all():
        raise ValueError(f"times must be at least 3 increasing numbers [s]; got {short(times)}")
    return clock


def _errors(name: str, sigma: Any, unit: str, random: Any, shape: tuple) -> np.ndarray:
    return number(name, sigma, unit, nonnegative=True) * random.standard_normal(shape)


def _turned(problem: TransferProblem, commands: np.ndarray, turn: Any) -> np.ndarray:
    """Commands turned by an angle, or by a rotation vector in space."""
    if turn is None:
        return commands
    angles = [number("turn", one, "rad") for one in (entries(turn) or (turn,))]
    wanted = {1: 0, 2: 1, 3: 3}[problem.dimension]
    if len(angles) != wanted:
        raise ValueError(
            f"turn must have {wanted} entries in {problem.dimension} axes [rad]; got {short(turn)}"
        )
    u = ca.SX.sym("u", problem.controls)
    return ca.Function("turn", [u], [turned(angles, u, problem.dimension)])(commands.T).full().T


def _at_times(name: str, given: Any, times: np.ndarray, size: int | None) -> np.ndarray:
    """Values at all times, from a table or a function of the time."""
    try:
        found = np.array([given(t) for t in times], float) if callable(given) else np.array(given, float)
    except Exception:  # whatever a user's object raises
        raise ValueError(
            f"{name} must be numbers, one row a time, or a function of the time; got {short(given)}"
        ) from None
    if found.ndim == 1 and size == 1:
        found = found[:, None]
    if found.shape[:1] != times.shape or (size is not None and found.shape != (len(times), size)):
        raise ValueError(f"{name} must have shape ({len(times)}, {size}); got {found.shape}")
    if not np.isfinite(found).all():
        raise ValueError(f"{name} must be finite")
    return found


def _flown(problem: TransferProblem, times: np.ndarray, force: np.ndarray, delay: float) -> tuple:
    """Positions, velocities, attitudes and rates a delay before every time; at the start before that."""
    span = times[-1] - times[0]
    seen = np.maximum(times - delay, times[0])
    ends = np.unique(np.concatenate([times, seen]))
    ends = ends[np.append(True, np.diff(ends) > ONE_TIME * span)]
    mesh = (ends - times[0]) / span
    mesh[-1] = 1.0
    held = force[
        np.clip(np.searchsorted(times, ends[:-1] + ONE_TIME * span, side="right") - 1, 0, len(times) - 1)
    ]
    configuration, dynamics = configuration_of(problem), Dynamics.of(problem)
    position, speed = problem.start.fixed()
    if np.isnan(position).any() or np.isnan(speed).any():
        raise ValueError(f"fly needs a start without free entries; got {problem.start.words()}")
    nodes = len(node_fractions(mesh, scheme(ORDER)))
    several = configuration.coordinates if configuration.surplus else None
    mass = np.full(nodes, problem.mass)
    path = DiscretePath(
        mesh, ORDER, True, span, np.tile(position, (nodes, 1)), held, mass, speed, speed, made_of=several
    )
    path = replace(path, mass=node_masses(dynamics, path, problem.mass))
    if path.mass.min() <= problem.actuator.dry_mass:
        raise ValueError(f"all propellant burns before the end: the mass falls to {path.mass.min():.3g} kg")
    momentum = dynamics.momentum(times[0], position, speed, problem.mass).full().ravel()
    q, p = rollout(dynamics, path, problem.start_time, position, momentum)
    v = columns(dynamics.velocity, ends, q.T, p.T, path.mass[:: scheme(ORDER).degree])[0].T
    at = np.argmin(np.abs(ends[:, None] - seen), axis=0)
    made = configuration.coordinates
    q, v = q[at], v[at]
    turning = [block for block in made.blocks if block.kind == ATTITUDE]
    attitude = q[:, made.quaternions[0]] if turning else None
    return q[:, made.places], v[:, made.speeds], attitude, v[:, made.rates] if turning else None


def _seen_attitudes(attitude: np.ndarray, sigma: float, random: Any) -> np.ndarray:
    """Attitudes with errors: a small turn about each axis of the body, or of the angle in the plane."""
    size = number("attitude_noise", sigma, "rad", nonnegative=True)
    if attitude.ndim == 1:
        return attitude + size * random.standard_normal(attitude.shape)
    if not size:
        return attitude
    return times(attitude, turned_by(size * random.standard_normal((len(attitude), 3))))


def _arm(attitude: np.ndarray | None, offset: Any, position: np.ndarray) -> np.ndarray:
    """The marker from the centre of mass, in space axes."""
    if offset is None:
        return np.zeros_like(position)
    arm = np.array([number("offset", one, "m") for one in (entries(offset) or (offset,))])
    if len(arm) != position.shape[1]:
        raise ValueError(f"offset must have {position.shape[1]} entries [m]; got {short(offset)}")
    if attitude is None:
        return np.broadcast_to(arm, position.shape)
    if attitude.ndim == 2:
        return rotated(attitude, np.broadcast_to(arm, position.shape))
    turns = known_rotations(Flight(np.arange(len(attitude)), position, attitudes=attitude))
    return turns @ arm  # type: ignore[operator]


def known_rotations(flight: Any) -> np.ndarray | None:
    """The rotation from body to space at every sample, shape (samples, axes, axes); None if it is not known."""
    given = flight.attitudes
    if given is None:
        return None
    if given.ndim == 1:
        cos, sin = np.cos(given), np.sin(given)
        return np.moveaxis(np.array([[cos, -sin], [sin, cos]]), 2, 0)
    q = ca.SX.sym("q", QUATERNION)
    turn = ca.Function("turn", [q], [ca.densify(ca.vec(rotation_of(q)))])
    return turn(given.T).full().T.reshape(-1, 3, 3).transpose(0, 2, 1)


def turned(angles: Sequence[Any], force: Any, axes: int) -> Any:
    """A force turned by an angle in the plane, or by a small rotation vector in space (Cayley)."""
    if not len(angles) or all(isinstance(one, float) and one == 0.0 for one in angles):
        return force
    if axes == 2:
        cos, sin = ca.cos(angles[0]), ca.sin(angles[0])
        return ca.vertcat(cos * force[0] - sin * force[1], sin * force[0] + cos * force[1], force[2:])
    vector = ca.vertcat(*angles)
    cross = ca.skew(ca.SX(vector))
    rotation = ca.SX.eye(3) + (cross + cross @ cross / 2) / (1 + ca.dot(vector, vector) / 4)
    return ca.vertcat(rotation @ force[:3], rotation @ force[3:] if force.numel() == 6 else force[3:])
