"""Numbers of a body from a flight, by the discrete equations run backwards."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dmoc.basics.arguments import checked, entries, number, short
from dmoc.basics.quaternions import AXES as SPACE
from dmoc.basics.unknown import Unknown, has_unknown, is_unknown, with_field
from dmoc.bodies.torques import Torque, Wrench
from dmoc.configurations.rigid import checked_inertia
from dmoc.effects.base import Effect
from dmoc.ends.base import State
from dmoc.ends.poses import Attitude, Pose
from dmoc.identification.equations import (
    Equations,
    add_attitudes,
    add_beliefs,
    add_forces,
    add_motion,
    add_positions,
    add_speeds,
)
from dmoc.identification.estimate import Estimate
from dmoc.identification.fit import Fit, fitted
from dmoc.identification.flight import Flight
from dmoc.identification.setting import Setting
from dmoc.identification.wanted import (
    AXES,
    Wanted,
    center_changed,
    of_effects,
    of_inertia,
    of_vector,
)
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.momenta import end_momenta
from dmoc.motion.path import DiscretePath
from dmoc.parts.actuator import Actuator
from dmoc.parts.forces import FreeForce
from dmoc.scene.problem import TransferProblem

# Where noise is to be found from the flight, it is first taken to be this part of the extent of the path [-].
FIRST_NOISE = 1e-3
# The noise is found when it changes by less than this [-], after at most so many fits.
SAME_NOISE, MOST_FITS = 1e-3, 8
# The rows of an answer hold to this [-].
HELD = 1e-9


@dataclass(frozen=True)
class Ties:
    """What ties the motion to the measurements and to the commands."""

    offset: tuple
    center: tuple
    strength: tuple
    turn: tuple
    delay: float


def identify(
    flight: Flight | str | os.PathLike,
    mass: float = 1.0,
    effects: Sequence[Effect] = (),
    actuator: Actuator | None = None,
    inertia: Any = None,
    offset: Any = None,
    center: Any = None,
    strength: Any = 1.0,
    turn: Any = None,
    delay: Any = 0.0,
    noise: float | None = None,
    force_noise: Any = 0.0,
    velocity_noise: float | None = None,
    attitude_noise: float | None = None,
    rate_noise: float | None = None,
    order: int = 4,
) -> Estimate:
    """Find numbers of a body from a flight: each `Unknown` among the arguments.

    The discrete Euler-Lagrange equations between the samples hold exactly, with the commanded forces held over
    each step; positions, and forces where they are uncertain, differ from what was measured and commanded by
    independent normal errors. The most likely path, forces and numbers are those of least squares; the
    covariance of the numbers is the inverse of the information, to first order, with the whole path and all
    forces unknown beside them. No derivative is taken of the measurements.

    Parameters
    ----------
    flight : Flight or path
        A flight, or its CSV table.
    mass : float or Unknown
        [kg]. Without a known force it cannot be told.
    effects : sequence of Effect
        Any number in them may be `Unknown`, such as `LinearDrag(Unknown(1.0))`.
    actuator : Actuator, optional
        What makes forces of the controls of the flight: `FreeForce()` if not given; of a body that turns a
        `Wrench` of force in space axes and torque in body axes, of an attitude alone a `Torque`. `Thrusters`
        have one control each.
    inertia : 3 floats or Unknown, or 3x3 floats, optional
        In body axes about the centre of mass [kg m^2]: with it the body turns, and the flight has attitudes.
    offset : sequence of float or Unknown, optional
        The marker from the centre of mass, in body axes [m]; it needs attitudes in the flight.
    center : sequence of float or Unknown, optional
        The centre of mass, from where `Thrusters` and the offset are measured, in body axes [m].
    strength : float, Unknown, or one a control
        The force that flies over the one that was commanded [-].
    turn : float, Unknown, or three
        The angle by which forces are turned against the command [rad]; in space a small rotation vector, of
        the force and the torque of a `Wrench`.
    delay : float or Unknown
        How much older measurements are than their times say [s]; that is less than the time between samples.
    noise : float, optional
        Standard deviation of each axis of positions [m]; found from the flight if not given.
    force_noise : float or sequence of float
        That of each control [N], drawn anew each step; 0 if commands are exact.
    velocity_noise, attitude_noise, rate_noise : float, optional
        Those of measured velocities [m/s], attitudes about each axis [rad] and rates [rad/s]; velocities and
        rates without one are not used.
    order : int
        2, 4, 6 or 8, of the scheme.

    Returns
    -------
    Estimate

    Raises
    ------
    ValueError
        If nothing is unknown, a number has no meaning, or the flight does not have what is needed.

    Notes
    -----
    D. Schultz, K. Flasskamp, T. Murphey, Variational integrators for structure-preserving filtering, J. Comput.
    Nonlinear Dyn. 12 (2017), use the same equations in a filter. In the scene 1/m is the unknown, in which
    equation (16) of M. Ekal's note is linear.
    """
    began = time.perf_counter()
    flight = flight if isinstance(flight, Flight) else Flight.read(flight)
    sigmas = _sigmas(flight, noise, velocity_noise, attitude_noise, rate_noise)
    problem = _scene(flight, mass, tuple(effects), actuator, inertia)
    ties = _ties(flight, problem, offset, center, strength, turn, delay)
    spread = _force_noise(force_noise, problem.controls)
    problem, wanted = _wanted(problem, mass, inertia, ties)
    if not wanted:
        raise ValueError("nothing is unknown; give a number as Unknown(value), for example mass=Unknown(10)")
    setting = Setting.of(flight, problem, order, wanted)
    fit, noise_used = _found(setting, sigmas, spread, ties)
    return _answer(setting, fit, noise_used, sigmas, ties, time.perf_counter() - began)


def _sigmas(flight: Flight, noise: Any, velocity: Any, attitude: Any, rate: Any) -> dict[str, float]:
    """The standard deviations of what is used; that of positions is missing where it is to be found."""
    found = {}
    for name, kind, value, unit in (
        ("noise", "positions", noise, "m"),
        ("velocity_noise", "velocities", velocity, "m/s"),
        ("attitude_noise", "attitudes", attitude, "rad"),
        ("rate_noise", "rates", rate, "rad/s"),
    ):
        if value is not None:
            found[kind] = number(name, value, unit, positive=True)
            if getattr(flight, kind) is None:
                raise ValueError(f"{name} is given but the flight has no {kind}")
    return found


def _scene(flight: Flight, mass: Any, effects: tuple, actuator: Any, inertia: Any) -> TransferProblem:
    """The scene, with values in place of unknowns that it does not hold as symbols."""
    mass = number("mass", mass, "kg", positive=True)
    last = flight.axes or SPACE
    far = flight.duration
    if inertia is None:
        if not flight.axes:
            raise ValueError("the flight has no positions; an attitude alone needs an inertia")
        ends: tuple = (State((0.0,) * last, (0.0,) * last),) * 2
    else:
        if flight.attitudes is None or flight.attitudes.ndim != 2:
            raise ValueError("a body with an inertia turns: the flight needs attitudes as quaternions, qs, qx, qy, qz")
        first = tuple(next(row for row in flight.attitudes if np.isfinite(row).all()))
        if flight.axes not in (0, SPACE):
            raise ValueError(f"a body with an inertia moves in 3 axes; the flight has {flight.axes}")
        end: Any = Attitude(first) if not flight.axes else Pose((0.0,) * 3, (0.0,) * 3, first, (0.0,) * 3)
        ends = end, end
        actuator = actuator or (Wrench(frame="space") if flight.axes else Torque())
    problem = TransferProblem(
        mass,
        *ends,
        far,
        effects=effects,
        actuator=FreeForce() if actuator is None else actuator,
        start_time=float(flight.times[0]),
        inertia=None if inertia is None else _moments(inertia),
    )
    if problem.actuator.burns:
        raise ValueError("identify takes flights of constant mass; this actuator burns propellant")
    count = 0 if flight.forces is None else flight.forces.shape[1]
    if count not in (0, problem.controls):
        kind = type(problem.actuator).__name__
        raise ValueError(f"the flight has {count} controls but {kind} takes {problem.controls}")
    return problem


def _moments(inertia: Any) -> Any:
    given = entries(inertia)
    if given is not None and any(entries(row) is not None and has_unknown(tuple(row)) for row in given):
        raise ValueError("inertia: principal moments may be Unknown, a matrix may not; give three numbers [kg m^2]")
    return inertia


def _ties(
    flight: Flight, problem: TransferProblem, offset: Any, center: Any, strength: Any, turn: Any, delay: Any
) -> Ties:
    axes, count = flight.axes, problem.controls
    offset = _vector("offset", offset, "m", axes)
    if offset and any(map(is_unknown, offset)) and flight.attitudes is None:
        raise ValueError(
            "offset is not observable: without attitudes in the flight it cannot be told from the place of the start"
        )
    if center is not None and not hasattr(problem.actuator, "positions"):
        raise ValueError("center needs Thrusters as the actuator: it says where the centre of mass is against them")
    if axes and not hasattr(problem.actuator, "positions") and not hasattr(problem.actuator, "frame"):
        angles = {1: 0, 2: 1, 3: 3}[axes]
    else:
        angles = 3 if hasattr(problem.actuator, "frame") else 0
    if turn is not None and not angles:
        raise ValueError(f"turn has no meaning for {type(problem.actuator).__name__} in {axes} axes; leave it out")
    number("delay", delay, "s")
    if abs(delay) >= np.diff(flight.times).max():
        raise ValueError(
            f"delay must be less than the time between samples, {np.diff(flight.times).max():.3g} s; "
            f"got {float(delay):g} s: shift the times of the forces by whole samples first"
        )
    one = not isinstance(strength, (tuple, list, np.ndarray))
    return Ties(
        offset,
        _vector("center", center, "m", SPACE),
        (strength,) if one else _vector("strength", strength, "-", count),
        _vector("turn", turn, "rad", angles),
        delay,
    )


def _vector(name: str, value: Any, unit: str, size: int) -> tuple:
    """A tuple of numbers, some unknown; zeros where it is not given."""
    if value is None:
        return (0.0,) * size
    given = entries(value)
    given = (value,) if given is None else given
    if len(given) != size:
        raise ValueError(f"{name} must have {size} entries here [{unit}]; got {short(value)}")
    return tuple(number(f"{name}[{i}]", one, unit) for i, one in enumerate(given))


def _force_noise(value: Any, count: int) -> np.ndarray:
    given = entries(value)
    each = (value,) * count if given is None else given
    if len(each) != count:
        raise ValueError(f"force_noise must be one number or {count}; got {short(value)}")
    found = np.array([number("force_noise", one, "N", nonnegative=True) for one in each])
    if found.any() and not found.all():
        raise ValueError("force_noise must be 0 for all controls or for none")
    return found


def _wanted(
    problem: TransferProblem, mass: Any, inertia: Any, ties: Ties
) -> tuple[TransferProblem, tuple[Wanted, ...]]:
    """The unknown numbers, and the scene with symbols in their places."""
    found = [Wanted("mass", "kg", float(mass), mass.sigma, "mass")] if is_unknown(mass) else []
    found += of_effects(problem)
    if has_unknown(inertia if isinstance(inertia, tuple) else ()):
        found += of_inertia(problem, inertia)
        rows = tuple(tuple(Unknown(x) for x in row) for row in checked_inertia(tuple(map(float, inertia))))
        problem = with_field(problem, "inertia", rows)
    found += of_vector("offset", ties.offset, "m", AXES, len(ties.offset)) if ties.offset else []
    if any(ties.center) or has_unknown(ties.center):
        shift = np.array(ties.center, float)
        places = tuple(tuple(Unknown(x) for x in np.array(row)) for row in problem.actuator.positions)
        problem = with_field(problem, "actuator", with_field(problem.actuator, "positions", places))
        for i in range(SPACE):
            problem = center_changed(i, problem, float(shift[i]))
        found += [
            replace(one, changed=_moved(one)) for one in of_vector("center", ties.center, "m", AXES, SPACE)
        ]
    labels = tuple(problem.actuator.labels(problem.dimension))
    found += of_vector("strength", ties.strength if len(ties.strength) > 1 else ties.strength[0], "-", labels, len(ties.strength))
    found += of_vector("turn", ties.turn, "rad", AXES, len(ties.turn)) if ties.turn else []
    found += [Wanted("delay", "s", float(ties.delay), ties.delay.sigma, "delay")] if is_unknown(ties.delay) else []
    return problem, tuple(found)


def _moved(one: Wanted) -> Any:
    """The scene with the centre of mass elsewhere, from where it is thought to be."""
    return lambda problem, value: center_changed(one.index, problem, value - one.value)


def _found(setting: Setting, sigmas: dict[str, float], spread: np.ndarray, ties: Ties) -> tuple[Fit, float]:
    """The fit, and the noise of positions: as given, or such that residuals are of its size."""
    if not setting.flight.axes:
        if "attitudes" not in sigmas:
            raise ValueError("an attitude alone needs attitude_noise [rad]")
        return _fit(setting, sigmas, spread, ties), sigmas["attitudes"]
    if setting.writer.dynamics.configuration.surplus and "attitudes" not in sigmas:
        raise ValueError("a body that turns needs attitude_noise, the standard deviation of attitudes [rad]")
    if "positions" in sigmas:
        return _fit(setting, sigmas, spread, ties), sigmas["positions"]
    if spread.any() or len(sigmas):
        raise ValueError("give noise, the standard deviation of positions [m]: beside other errors it cannot be found")
    noise = FIRST_NOISE * setting.units.length
    for _ in range(MOST_FITS):
        fit = _fit(setting, sigmas | {"positions": noise}, spread, ties)
        factor = float(np.sqrt(fit.residuals @ fit.residuals / max(fit.degrees, 1)))
        noise = max(noise * factor, 1e-15 * setting.units.length)
        if abs(factor - 1) < SAME_NOISE or not any(one.sigma for one in setting.wanted):
            break
    return fit, noise


def _fit(setting: Setting, sigmas: dict[str, float], spread: np.ndarray, ties: Ties) -> Fit:
    equations = Equations(setting)
    add_motion(equations)
    if setting.flight.axes:
        add_positions(equations, sigmas["positions"], ties.offset, ties.delay)
    fixed = np.zeros(setting.size, bool)
    if "attitudes" in sigmas and setting.writer.dynamics.configuration.surplus:
        add_attitudes(equations, sigmas["attitudes"])
    speeds = {name: sigma for name, sigma in sigmas.items() if name in ("velocities", "rates")}
    if speeds:
        add_speeds(equations, speeds)
    strength = ties.strength if len(ties.strength) == setting.problem.controls else ties.strength * setting.problem.controls
    if not add_forces(equations, spread, strength, ties.turn):
        fixed[setting.columns["force"].indices] = True
    add_beliefs(equations)
    size = sigmas["positions"] / setting.units.length if "positions" in sigmas else sigmas["attitudes"]
    return fitted(equations, fixed, size)


def _answer(
    setting: Setting, fit: Fit, noise: float, sigmas: dict[str, float], ties: Ties, seconds: float
) -> Estimate:
    """The estimate, with the path in SI units."""
    values = [1 / x if one.inverse else x for one, x in zip(setting.wanted, fit.x[setting.numbers], strict=True)]
    problem = settled(setting.problem, setting.wanted, values)
    get = {group.name: group.of(fit.x[: setting.size]) for group in setting.columns.groups}
    path = DiscretePath(
        setting.path.mesh,
        setting.order,
        True,
        setting.path.duration,
        get["position"] + setting.units.origin,
        get["force"],
        np.full(len(get["position"]), problem.mass),
        get["start.velocity"][0],
        get["goal.velocity"][0],
        made_of=setting.path.made_of,
        reaction=get.get("reaction"),
    )
    left = np.abs(fit.system.c).max(initial=0.0)
    success = fit.converged and bool(np.isfinite(fit.x).all()) and left < HELD
    message = "" if success else _why(fit, left)
    ends = slice(None, None, setting.degree)
    velocity = end_momenta(Dynamics.of(problem), path, problem.start_time)[1] if success else np.full_like(path.position[ends], np.nan)
    return Estimate(
        setting.flight,
        problem,
        setting.wanted,
        fit,
        noise,
        "positions" not in sigmas and setting.flight.axes > 0,
        path.position[ends],
        velocity,
        get["force"],
        sigmas,
        success,
        message,
        seconds,
    )


def _why(fit: Fit, left: float) -> str:
    return (
        f"the least-squares problem did not converge in {fit.steps} steps (last step {fit.last_step:.1e}, equations off "
        f"by {left:.1e}): begin with values nearer to the truth, ask for fewer numbers, or state a sigma for each"
    )


def settled(problem: TransferProblem, wanted: Sequence[Wanted], values: Sequence[float]) -> TransferProblem:
    """The scene with numbers in place of its unknowns."""
    for one, value in zip(wanted, values, strict=True):
        if one.kind == "mass":
            problem = with_field(problem, "mass", float(value))
        elif one.changed is not None:
            problem = one.changed(problem, float(value))
    effects = tuple(_plain(effect) for effect in problem.effects)
    found = with_field(with_field(problem, "effects", effects), "inertia", _floats(problem.inertia))
    if hasattr(found.actuator, "positions"):
        places = with_field(found.actuator, "positions", _floats(found.actuator.positions))
        found = with_field(found, "actuator", places)
    checked(found)
    return found


def _plain(effect: Any) -> Any:
    for name in effect.adjustable:
        value: Any = effect
        for part in name.split("."):
            value = getattr(value, part)
        effect = with_field(effect, name, _floats(value))
    return effect


def _floats(value: Any) -> Any:
    """Numbers in tuples without their being unknown."""
    if isinstance(value, tuple):
        return tuple(_floats(one) for one in value)
    return float(value) if is_unknown(value) else value
