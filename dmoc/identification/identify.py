"""Numbers of a body from a flight, by the discrete equations run backwards."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from dmoc.effects.base import Effect
from dmoc.flights.flight import Flight
from dmoc.identification.equations import Equations, add_motion
from dmoc.identification.estimate import Estimate
from dmoc.identification.fit import Fit, fitted
from dmoc.identification.measured import (
    add_attitudes,
    add_beliefs,
    add_forces,
    add_mass,
    add_positions,
    add_speeds,
    delayed,
)
from dmoc.identification.setting import Setting
from dmoc.identification.stated import Ties, force_noise_of, scene_of, settled, sigmas_of, ties_of, wanted_of
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.momenta import end_momenta
from dmoc.motion.path import DiscretePath
from dmoc.parts.actuator import Actuator

# Where noise is to be found from the flight, it is first taken to be this part of the extent of the path [-].
FIRST_NOISE = 1e-3
# The noise is found when it changes by less than this [-], after at most so many fits.
SAME_NOISE, MOST_FITS = 1e-3, 8
# The rows of an answer hold to this [-].
HELD = 1e-9


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
    tilt: Any = None,
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
        At the start of the flight [kg]. Without a known force it cannot be told. While an `Engine` or another
        actuator with an exhaust velocity burns, the mass falls with the commanded thrust; the exhaust velocity
        of the actuator may be `Unknown`, too.
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
    tilt : 2 floats or Unknown, or a pair for each thruster, optional
        What is added to the direction of each of the `Thrusters` along the two body axes that it points along
        least [-], the tangents of small angles; directions stay unit vectors.
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
    sigmas = sigmas_of(flight, noise, velocity_noise, attitude_noise, rate_noise)
    problem = scene_of(flight, mass, effects, actuator, inertia)
    ties = ties_of(flight, problem, offset, center, strength, turn, delay, tilt)
    spread = force_noise_of(force_noise, problem.controls)
    problem, wanted = wanted_of(problem, mass, inertia, ties)
    if not wanted:
        raise ValueError("nothing is unknown; give a number as Unknown(value), for example mass=Unknown(10)")
    setting = Setting.of(flight, problem, order, wanted)
    fit, noise_used = _found(setting, sigmas, spread, ties)
    return _answer(setting, fit, noise_used, sigmas, ties, time.perf_counter() - began)


def _found(setting: Setting, sigmas: dict[str, float], spread: np.ndarray, ties: Ties) -> tuple[Fit, float]:
    """The fit, and the noise of positions: as given, or such that residuals are of its size."""
    if not setting.flight.axes:
        if "attitudes" not in sigmas:
            raise ValueError("an attitude alone needs attitude_noise [rad]")
        return _fit(setting, sigmas, spread, ties), sigmas["attitudes"]
    if setting.path.coordinates.turns and "attitudes" not in sigmas:
        raise ValueError("a body that turns needs attitude_noise, the standard deviation of attitudes [rad]")
    if "positions" in sigmas:
        return _fit(setting, sigmas, spread, ties), sigmas["positions"]
    if spread.any() or len(sigmas):
        raise ValueError(
            "give noise, the standard deviation of positions [m]: beside other errors it cannot be found"
        )
    noise = FIRST_NOISE * setting.units.length
    for _ in range(MOST_FITS):
        fit = _fit(setting, sigmas | {"positions": noise}, spread, ties)
        factor = float(np.sqrt(fit.residuals @ fit.residuals / max(fit.degrees, 1)))
        noise = max(noise * factor, 1e-15 * setting.units.length)
        if abs(factor - 1) < SAME_NOISE or not any(one.sigma for one in setting.wanted):
            break
    return fit, noise


def _fit(setting: Setting, sigmas: dict[str, float], spread: np.ndarray, ties: Ties) -> Fit:
    """The fit, again where the delay that it finds puts samples into other steps."""
    now, asked = float(ties.delay), [one.kind == "delay" for one in setting.wanted]
    fit = _fit_at(setting, sigmas, spread, ties, now)
    for _ in range(MOST_FITS if any(asked) else 0):
        found = float(fit.x[setting.numbers][asked][0])
        before, after = (delayed(setting.flight, one, True) for one in (now, found))
        if len(before[1]) == len(after[1]) and np.array_equal(before[1], after[1]):
            break
        now = float(np.clip(found, 0.0, np.diff(setting.flight.times).max()))
        fit = _fit_at(setting, sigmas, spread, ties, now)
    return fit


def _fit_at(setting: Setting, sigmas: dict[str, float], spread: np.ndarray, ties: Ties, delay: float) -> Fit:
    equations = Equations(setting)
    add_motion(equations)
    if setting.flight.axes:
        add_positions(equations, sigmas["positions"], ties.offset, ties.delay, delay)
    fixed = np.zeros(setting.size, bool)
    if "attitudes" in sigmas and setting.path.coordinates.turns:
        add_attitudes(equations, sigmas["attitudes"])
    speeds = {name: sigma for name, sigma in sigmas.items() if name in ("velocities", "rates")}
    if speeds:
        add_speeds(equations, speeds)
    strength = (
        ties.strength
        if len(ties.strength) == setting.problem.controls
        else ties.strength * setting.problem.controls
    )
    add_mass(equations, fixed)
    if not add_forces(equations, spread, strength, ties.turn):
        fixed[setting.columns["force"].indices] = True
    add_beliefs(equations)
    size = sigmas["positions"] / setting.units.length if "positions" in sigmas else sigmas["attitudes"]
    return fitted(equations, fixed, size)


def _answer(
    setting: Setting, fit: Fit, noise: float, sigmas: dict[str, float], ties: Ties, seconds: float
) -> Estimate:
    """The estimate, with the path in SI units."""
    values = [
        1 / x if one.inverse else x for one, x in zip(setting.wanted, fit.x[setting.numbers], strict=True)
    ]
    problem = settled(setting.problem, setting.wanted, values)
    get = {group.name: group.of(fit.x[: setting.size]) for group in setting.columns.groups}
    path = DiscretePath(
        setting.path.mesh,
        setting.order,
        True,
        setting.path.duration,
        get["position"] + setting.units.origin,
        get["force"],
        get["mass"][:, 0] if "mass" in get else np.full(len(get["position"]), problem.mass),
        get["start.velocity"][0],
        get["goal.velocity"][0],
        made_of=setting.path.made_of,
        reaction=get.get("reaction"),
    )
    left = np.abs(fit.system.c).max(initial=0.0)
    success = bool(fit.converged and np.isfinite(fit.x).all() and left < HELD)
    message = "" if success else _why(fit, left)
    ends = slice(None, None, setting.degree)
    velocity = (
        end_momenta(Dynamics.of(problem), path, problem.start_time)[1]
        if success
        else np.full_like(path.position[ends], np.nan)
    )
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
        path.mass[ends],
        sigmas,
        success,
        message,
        seconds,
    )


def _why(fit: Fit, left: float) -> str:
    return (
        f"the least-squares problem did not converge in {fit.steps} steps (last step {fit.last_step:.1e}, "
        f"equations off by {left:.1e}): begin with values nearer to the truth, "
        "ask for fewer numbers, or state a sigma for each"
    )
