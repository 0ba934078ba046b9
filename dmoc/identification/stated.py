"""What a user says of a flight, checked: the scene, what is unknown in it, how it was measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.basics.arguments import entries, number, short
from dmoc.basics.quaternions import AXES as SPACE
from dmoc.basics.records import dataclass
from dmoc.basics.unknown import Unknown, at, has_unknown, is_unknown, numeric_fields, with_field
from dmoc.bodies.torques import Torque, Wrench
from dmoc.configurations.rigid import checked_inertia
from dmoc.ends.base import State
from dmoc.ends.poses import Attitude, Pose
from dmoc.flights.flight import Flight
from dmoc.flights.flown import force_labels
from dmoc.identification.wanted import (
    AXES,
    Wanted,
    center_changed,
    exhaust_changed,
    of_effects,
    of_inertia,
    of_tilt,
    of_vector,
)
from dmoc.parts.forces import FreeForce
from dmoc.parts.rows import title
from dmoc.scene.problem import TransferProblem


@dataclass(frozen=True)
class Ties:
    """What ties the motion to the measurements and to the commands."""

    offset: tuple
    center: tuple
    strength: tuple
    turn: tuple
    delay: Any
    tilt: tuple


def sigmas_of(flight: Flight, noise: Any, velocity: Any, attitude: Any, rate: Any) -> dict[str, float]:
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


def scene_of(flight: Flight, mass: Any, effects: Any, actuator: Any, inertia: Any) -> TransferProblem:
    """The scene, with values in place of unknowns that it does not hold as symbols."""
    mass = number("mass", mass, "kg", positive=True)
    last = flight.axes or SPACE
    if inertia is None:
        if not flight.axes:
            raise ValueError("the flight has no positions; an attitude alone needs an inertia")
        end: Any = State((0.0,) * last, (0.0,) * last)
    else:
        if flight.attitudes is None or flight.attitudes.ndim != 2:
            raise ValueError(
                "a body with an inertia turns: the flight needs attitudes as quaternions, qs, qx, qy, qz"
            )
        first = tuple(next(row for row in flight.attitudes if np.isfinite(row).all()))
        if flight.axes not in (0, SPACE):
            raise ValueError(f"a body with an inertia moves in 3 axes; the flight has {flight.axes}")
        end = Attitude(first) if not flight.axes else Pose((0.0,) * 3, (0.0,) * 3, first, (0.0,) * 3)
        actuator = actuator or (Wrench(frame="space") if flight.axes else Torque())
    problem = TransferProblem(
        mass,
        end,
        end,
        flight.duration,
        effects=effects,
        actuator=FreeForce() if actuator is None else actuator,
        start_time=float(flight.times[0]),
        inertia=None if inertia is None else _moments(inertia),
    )
    if is_unknown(mass) and problem.actuator.burns and problem.turns:
        raise ValueError("of a body that turns while propellant burns, the mass at the start must be known")
    count = 0 if flight.forces is None else flight.forces.shape[1]
    if count not in (0, problem.controls, len(force_labels(problem))):
        kind = type(problem.actuator).__name__
        raise ValueError(f"the flight has {count} controls but {kind} takes {problem.controls}")
    return problem


def _moments(inertia: Any) -> Any:
    given = entries(inertia)
    if given is not None and any(entries(row) is not None and has_unknown(tuple(row)) for row in given):
        raise ValueError(
            "inertia: principal moments may be Unknown, a matrix may not; give three numbers [kg m^2]"
        )
    return inertia


def ties_of(
    flight: Flight,
    problem: TransferProblem,
    offset: Any,
    center: Any,
    strength: Any,
    turn: Any,
    delay: Any,
    tilt: Any = None,
) -> Ties:
    axes, count = flight.axes, problem.controls
    offset = _vector("offset", offset, "m", axes)
    if offset and any(map(is_unknown, offset)) and flight.attitudes is None:
        raise ValueError(
            "offset is not observable: without attitudes in the flight it cannot be told from the start's place"
        )
    if center is not None and not hasattr(problem.actuator, "positions"):
        raise ValueError(
            "center needs Thrusters as the actuator: it says where the centre of mass is against them"
        )
    if tuple(problem.actuator.labels(axes))[:axes] == AXES[:axes] and not hasattr(problem.actuator, "frame"):
        angles = {0: 0, 1: 0, 2: 1, 3: 3}[axes]
    else:
        angles = 3 if hasattr(problem.actuator, "frame") else 0
    if turn is not None and not angles:
        raise ValueError(
            f"turn has no meaning for {type(problem.actuator).__name__} in {axes} axes; leave it out"
        )
    delay = number("delay", delay, "s")
    if abs(float(delay)) >= np.diff(flight.times).max():
        raise ValueError(
            f"delay must be less than the time between samples, {np.diff(flight.times).max():.3g} s; "
            f"got {float(delay):g} s: shift the times of the forces by whole samples first"
        )
    one = not isinstance(strength, (tuple, list, np.ndarray))
    return Ties(
        offset,
        _vector("center", center, "m", SPACE),
        (number("strength", strength, "-"),) if one else _vector("strength", strength, "-", count),
        _vector("turn", turn, "rad", angles),
        delay,
        _tilts(tilt, problem),
    )


def _tilts(given: Any, problem: TransferProblem) -> tuple:
    """Two numbers a thruster, one thruster after the other."""
    if given is None:
        return ()
    if not hasattr(problem.actuator, "positions"):
        raise ValueError("tilt needs Thrusters as the actuator: it says how each is turned from its direction")
    rows = entries(given) or ()
    rows = rows if rows and entries(rows[0]) is not None else (given,) * problem.controls
    if len(rows) != problem.controls:
        raise ValueError(f"tilt must be two numbers, or two for each of {problem.controls} thrusters")
    return tuple(one for i, row in enumerate(rows) for one in _vector(f"tilt[{i}]", row, "-", 2))


def _vector(name: str, value: Any, unit: str, size: int) -> tuple:
    """A tuple of numbers, some unknown; zeros where it is not given."""
    if value is None:
        return (0.0,) * size
    given = entries(value)
    given = (value,) if given is None else given
    if len(given) != size:
        raise ValueError(f"{name} must have {size} entries here [{unit}]; got {short(value)}")
    return tuple(number(f"{name}[{i}]", one, unit) for i, one in enumerate(given))


def force_noise_of(value: Any, count: int) -> np.ndarray:
    given = entries(value)
    each = (value,) * count if given is None else given
    if len(each) != count:
        raise ValueError(f"force_noise must be one number or {count}; got {short(value)}")
    found = np.array([number("force_noise", one, "N", nonnegative=True) for one in each])
    if found.any() and not found.all():
        raise ValueError("force_noise must be 0 for all controls or for none")
    return found


def wanted_of(
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
    problem, tilts = of_tilt(problem, ties.tilt, labels)
    found += tilts
    speed: Any = getattr(problem.actuator, "exhaust_velocity", None)
    if is_unknown(speed):
        name = "exhaust_velocity"
        found.append(Wanted(name, "m/s", float(speed), speed.sigma, "exhaust", 0, exhaust_changed))
    found += of_vector(
        "strength",
        ties.strength if len(ties.strength) > 1 else ties.strength[0],
        "-",
        labels,
        len(ties.strength),
    )
    found += of_vector("turn", ties.turn, "rad", AXES, len(ties.turn)) if ties.turn else []
    found += (
        [Wanted("delay", "s", float(ties.delay), ties.delay.sigma, "delay")] if is_unknown(ties.delay) else []
    )
    return problem, tuple(found)


def _moved(one: Wanted) -> Any:
    """The scene with the centre of mass elsewhere, from where it is thought to be."""
    return lambda problem, value: center_changed(one.index, problem, value - one.value)


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
        made = with_field(found.actuator, "positions", _floats(found.actuator.positions))
        ways = np.array(found.actuator.directions, float)
        ways = ways / np.linalg.norm(ways, axis=1)[:, None]
        found = with_field(found, "actuator", with_field(made, "directions", tuple(map(tuple, ways.tolist()))))
    speed: Any = getattr(found.actuator, "exhaust_velocity", None)
    if is_unknown(speed):
        found = with_field(found, "actuator", with_field(found.actuator, "exhaust_velocity", float(speed)))
    return found


def _plain(effect: Any) -> Any:
    for name in effect.adjustable:
        effect = with_field(effect, name, _floats(at(effect, name)))
    return effect


def _floats(value: Any) -> Any:
    """Numbers in tuples without their being unknown."""
    if isinstance(value, tuple):
        return tuple(_floats(one) for one in value)
    return float(value) if is_unknown(value) else value


def with_unknown(effects: Sequence[Any], name: str, value: float | None, sigma: float | None) -> list[Any]:
    """Effects in which the number of this name is unknown, and thought to be what it is if no value is given.

    Raises
    ------
    ValueError
        If no effect has such a number.
    """
    found, known = list(effects), []
    for place, effect in enumerate(effects):
        for one in numeric_fields(effect):
            known.append(called := f"{title(effect, place)}_{one.replace('.', '_')}")
            if called == name:
                before = at(effect, one)
                begin = before if value is None else value
                several = type(before) is tuple and value is not None
                found[place] = with_field(
                    effect, one, Unknown((value,) * len(before) if several else begin, sigma)
                )
                return found
    listed = ", ".join(["mass", "offset", "strength", "turn", "delay", *known])
    raise ValueError(f"no number is called {short(name)}; there are {listed}")
