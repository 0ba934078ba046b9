"""What the arguments of exported functions are called, and what they mean."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import field
from typing import Any, NamedTuple

import casadi as ca

from dmoc.basics.docstrings import documented
from dmoc.basics.records import dataclass
from dmoc.basics.unknown import at
from dmoc.configurations import coordinates
from dmoc.parts.rows import title, with_symbols


@dataclass(frozen=True)
class Term:
    """Unit and meaning of an argument."""

    unit: str
    words: str


@dataclass(frozen=True)
class Exported:
    """A function that leaves the package, and what its arguments mean beyond `TERMS`."""

    function: ca.Function
    words: str
    terms: dict[str, Term] = field(default_factory=dict)

    def term(self, name: str) -> Term:
        return self.terms.get(name) or TERMS[name]


class Part(NamedTuple):
    """What the coordinates of a part of a body are called, at one node and along a path, and its velocities.

    `residual` is its part of the residual, `rows` that of the rows of motion, of which there are multipliers.
    """

    place: str
    places: str
    speed: str
    speeds: str
    residual: str
    rows: str


PLACE = Part("position", "positions", "velocity", "velocities", "residual", "dynamics")
ATTITUDE = Part("attitude", "attitudes", "rate", "rates", "residual_torque", "dynamics_attitude")
WHEELS = Part(
    "wheel_integral",
    "wheel_integrals",
    "wheel_momentum",
    "wheel_momenta",
    "residual_wheels",
    "dynamics_wheels",
)
# The part of each kind of block of coordinates.
PARTS = {coordinates.PLACE: PLACE, coordinates.ATTITUDE: ATTITUDE, coordinates.WHEELS: WHEELS}

# Unit and meaning of every argument that has one name in all functions.
TERMS = {
    "position": Term("m", "position"),
    "velocity": Term("m/s", "velocity"),
    "mass": Term("kg", "mass at the start"),
    "next_position": Term("m", "position at the end of the step"),
    "next_velocity": Term("m/s", "velocity at the end of the step"),
    "next_mass": Term("kg", "mass at the end of the step"),
    "time": Term("s", "time at the start of the step"),
    "time_step": Term("s", "length of the step"),
    "start_time": Term("s", "time at the start"),
    "duration": Term("s", "duration of all steps"),
    "positions": Term("m", "positions at the nodes, one column a node"),
    "velocities": Term("m/s", "velocities at the step ends, one column an end"),
    "start_velocity": Term("m/s", "velocity at the start"),
    "goal_velocity": Term("m/s", "velocity at the goal"),
    "forces": Term("N", "controls of the actuator, one column a node, or a step where they are held"),
    "masses": Term("kg", "masses at the nodes, one column a node"),
    "residual": Term("N", "force minus what the discrete motion needs, one column a node"),
    "attitude": Term("-", "unit quaternion from body axes to space axes, scalar first"),
    "rate": Term("rad/s", "angular rate in body axes"),
    "next_attitude": Term("-", "unit quaternion at the end of the step, scalar first"),
    "next_rate": Term("rad/s", "angular rate in body axes at the end of the step"),
    "attitudes": Term("-", "unit quaternions at the nodes, scalar first, one column a node"),
    "rates": Term("rad/s", "angular rates in body axes at the step ends, one column an end"),
    "start_rate": Term("rad/s", "angular rate in body axes at the start"),
    "goal_rate": Term("rad/s", "angular rate in body axes at the goal"),
    "residual_torque": Term(
        "N m", "torque minus what the discrete motion needs, in body axes, one column a node"
    ),
    "wheel_integral": Term("N m s^2", "time integrals of the angular momenta of wheels"),
    "wheel_momentum": Term("N m s", "angular momenta of wheels about their axes"),
    "next_wheel_integral": Term("N m s^2", "time integrals at the end of the step"),
    "next_wheel_momentum": Term("N m s", "angular momenta of wheels at the end of the step"),
    "wheel_integrals": Term("N m s^2", "time integrals of the momenta of wheels at the nodes"),
    "wheel_momenta": Term("N m s", "angular momenta of wheels at the step ends, one column an end"),
    "start_wheel_momentum": Term("N m s", "angular momenta of wheels at the start"),
    "goal_wheel_momentum": Term("N m s", "angular momenta of wheels at the goal"),
    "residual_wheels": Term("N m", "motor torque minus what the discrete motion needs, one column a node"),
    "residual_links": Term("m", "gaps of the links at every node"),
    "residual_norm": Term("-", "q.q - 1 of the quaternion at every node"),
    "reactions": Term("m^2/s^2", "forces per unit mass that keep the quaternions unit ones, one column a node"),
}


def number_terms(names: Iterable[str]) -> dict[str, Term]:
    """Further arguments that are numbers of the actuator."""
    units = {"actuator_exhaust_velocity": "m/s"}
    return {name: Term(units.get(name, ""), "of the actuator, as in the problem") for name in names}


def opened_effects(effects: Sequence[Any]) -> tuple[tuple, dict[str, int], dict[str, Term]]:
    """Effects with symbols for their unknown constants, and sizes and meanings of these by their names."""
    found, sizes, terms = [], {}, {}
    for i, effect in enumerate(effects):
        twin, symbols = with_symbols(effect, "effect")
        found.append(twin if symbols else effect)
        for one, symbol in zip(effect.adjustable, symbols, strict=True):
            name, (inside, _, last) = f"{title(effect, i)}_{one.replace('.', '_')}", one.rpartition(".")
            known = documented(type(at(effect, inside) if inside else effect).__doc__)
            sizes[name] = symbol.numel()
            terms[name] = Term(known[last].unit if last in known else "", f"{last} of {type(effect).__name__}")
    return tuple(found), sizes, terms


def named(name: str, given: dict[str, ca.MX], outputs: dict[str, ca.MX]) -> ca.Function:
    """A function whose arguments are called as they are here; outputs of the values are dense."""
    return ca.Function(name, list(given.values()), list(outputs.values()), list(given), list(outputs))
