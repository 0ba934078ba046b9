"""The rows, unknowns and cost of a joint.

At a joint the discrete equations of both legs hold with their own boundary velocities: the last momentum of the
leg before equals dl/dv at v-, the first of the leg behind it minus dl/dv at v+. Together with v+ = v- + dv they
are the momentum balance of a node at which an impulse acts. What is continuous is the velocity, not the
momentum, so that the legs may have other Lagrangians or count in other frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from dmoc.assembly.blocks import Block
from dmoc.chains.again import kernel_again
from dmoc.chains.within import Placed
from dmoc.configurations.base import Configuration
from dmoc.ends.base import Boundary
from dmoc.legs.events import Instant, fixed_rows
from dmoc.legs.legs import Joint
from dmoc.nlp.layout import LEG_MASS, LEG_START, Layout
from dmoc.nlp.program import Program
from dmoc.parts.rows import Row, snake, values_of, with_symbols
from dmoc.scene.mission import Mission

# The size of an impulse is rounded at zero over this part of the unit of speed [-].
ROUNDED = 1e-8


class Given:
    """Symbols for the numbers that change without a rebuild: parameters of legs, then of both ends."""

    def __init__(self, mission: Mission, legs: Sequence[Placed], count: int):
        self.legs, self.of_legs, self._symbols = legs, ca.SX.sym("p", count), []
        self.ends: dict[str, tuple[Any, ca.SX]] = {}
        for name, end in (("start", mission.start), ("goal", mission.goal)):
            fixed = ca.SX.sym(f"{name}.fixed", len(np.concatenate(end.fixed())))
            twin, symbols = with_symbols(end, name)
            self.ends[name] = twin, fixed
            self._symbols += [fixed, *symbols]

    @property
    def parameters(self) -> ca.SX:
        """All of them, as `end_parameters` goes on behind the parameters of the legs."""
        return ca.vertcat(self.of_legs, *self._symbols)

    @property
    def mass(self) -> ca.SX:
        """Mass at the start [kg]."""
        return self._number(0, 1)

    def duration(self, index: int) -> ca.SX:
        """Duration of a leg in which that is fixed [s]."""
        return self._number(index, 2)

    def _number(self, index: int, place: int) -> ca.SX:
        """The parameter of a leg in this place behind its origin."""
        leg = self.legs[index]
        return self.of_legs[leg.parameters + len(leg.program.units.origin) + place]

    def conditions(self, name: str, end: Boundary, here: Instant) -> list[Row]:
        """The conditions of the start or the goal on a state."""
        twin, fixed = self.ends[name]
        return _named(name, [*fixed_rows(end, here, fixed), *twin.rows(*here)])


def end_parameters(mission: Mission) -> np.ndarray:
    """The numbers of both ends: fixed entries, 0 where they are free, then those of their conditions."""
    parts = [
        (np.nan_to_num(np.concatenate(end.fixed())), values_of(end)) for end in (mission.start, mission.goal)
    ]
    return np.concatenate([part for pair in parts for part in pair])


class JointWriter:
    """The formulas of one joint while they are being written down; see `written`."""

    def __init__(
        self,
        mission: Mission,
        joint: Joint,
        legs: Sequence[Placed],
        own: tuple[Layout, int],
        given: Given,
        rounding: float | None = None,
    ):
        self.mission, self.joint, self.legs, self.given = mission, joint, legs, given
        self.own, self.first = own
        self.rounding = ROUNDED if rounding is None else rounding
        self._symbols: list[ca.SX] = []
        self._places: list[np.ndarray] = []
        self.rows: list[Row] = []
        self.cost: Any = ca.SX(0)

    @property
    def beside(self) -> Placed:
        """A leg at this joint: the one before it or, at the start, the first."""
        return self.legs[self.joint.right if self.joint.left is None else self.joint.left]  # type: ignore[index]

    def take(self, places: np.ndarray, name: str = "x") -> ca.SX:
        """Symbols for some unknowns of the mission."""
        self._symbols.append(ca.SX.sym(name, len(places)))
        self._places.append(places)
        return self._symbols[-1]

    def take_own(self, group: str) -> ca.SX:
        """Symbols for a group of unknowns of the joint itself."""
        return self.take(self.first + self.own[group].indices[:, 0], group)

    def state(self, index: int, last: bool) -> Instant:
        """The state at the end of a leg, or at its begin."""
        leg = self.legs[index]
        program, place = leg.program, -1 if last else 0
        q = self.take(leg.at("position", place), "q") + program.units.origin
        w = self.take(leg.at("goal.velocity" if last else "start.velocity", 0), "v")
        burns = "mass" in program.columns
        m = self.take(leg.at("mass", place) if burns else leg.at(LEG_MASS, 0), "m")
        t = self.take(leg.at(LEG_START, 0), "t")
        return Instant(t + self.duration(index) if last else t, q, w, m)

    def duration(self, index: int) -> Any:
        """The duration of a leg: an unknown or a number."""
        leg = self.legs[index]
        if "duration" in leg.program.columns:
            return self.take(leg.at("duration", 0), "T")
        return self.given.duration(index)

    def before(self) -> Instant:
        """The state before the events."""
        joint, body = self.joint, self.beside.program.dynamics.configuration
        if joint.left is not None:
            return self.state(joint.left, last=True)
        behind = self._behind
        assert behind is not None
        if not joint.events:
            return behind
        speeds = self.take_own("velocity")
        assert speeds.numel() == body.freedom
        return Instant(behind.t, behind.q, speeds, self.given.mass)

    def write(self) -> None:
        """All rows and the cost of the joint."""
        joint, speeds = self.joint, self.beside.program.dynamics.configuration.coordinates.speeds
        self._behind = None if joint.right is None else self.state(joint.right, last=False)
        here = self.before()
        if joint.left is None and joint.boundary is not None:
            self.rows += self.given.conditions("start", joint.boundary, here)
        units = self.beside.program.units
        tiny = self.rounding * units.length / units.time
        for i, event in enumerate(joint.events):
            own = self.take_own(f"event {i}") if event.unknowns(1) else ca.SX(0, 1)
            passed = event.passed(here, own, speeds, tiny)
            self.rows += _named(f"{snake(type(event).__name__)}_{i + 1}", passed.rows)
            if passed.kick is not None:
                self._pay(self.mission.objective.kick(*passed.kick))
            if event.continued:
                self._continue(i, event.continued)
            here = passed.after
        if joint.right is None:
            if joint.boundary is not None:
                self.rows += self.given.conditions("goal", joint.boundary, here)
            body = self.beside.program.dynamics.configuration
            seen = body.body(here.q, body.velocity(here.q, here.v))
            self._pay(self.mission.objective.terminal(here.t, seen.position, seen.velocity, here.m))
        if self._behind is not None and here is not self._behind:
            self._join(here, self._behind)

    def _continue(self, index: int, which: Sequence[int]) -> None:
        """Rows by which controls of the leg behind begin with those at the end of the leg before."""
        one, other = (self.legs[leg] for leg in (self.joint.left, self.joint.right))  # type: ignore[index]
        places = list(which)
        jump = self.take(other.at("force", 0)[places], "u") - self.take(one.at("force", -1)[places], "u")
        labels = one.program.columns["force"].labels
        self.rows += [
            Row(f"goes_on_{index + 1}.{labels[at]}", jump[i], 0.0, 0.0, "N") for i, at in enumerate(places)
        ]

    def _pay(self, cost: Any) -> None:
        self.cost = self.cost + self.mission.objective.sense * cost

    def _join(self, here: Instant, behind: Instant) -> None:
        """Rows by which the leg behind begins where the events lead."""
        body = self.beside.program.dynamics.configuration
        if self.joint.left is not None:
            self.rows += _equal("position", body, body.along(here.q, behind.q - here.q), ("m", "rad", "N m s"))
            self.rows.append(Row("time", behind.t - here.t, 0.0, 0.0, "s"))
        self.rows += _equal("velocity", body, behind.v - here.v, ("m/s", "rad/s", "N m s"))
        self.rows.append(Row("mass", behind.m - here.m, 0.0, 0.0, "kg"))

    def written(self, rows: Layout, first_row: int) -> Block:
        """The block of the joint, whose rows are the group of its name in the layout of joints."""
        targets = first_row + rows[self.joint.name].indices if self.rows else np.empty((0, 1), int)
        places, symbols = _merged(self._places, self._symbols)
        expressions = [row.expression for row in self.rows]
        given = ca.SX(0, 1), self.given.parameters
        made = kernel_again("joint", symbols, *given, ca.vertcat(*expressions), ca.SX(self.cost))
        return Block(made, places[:, None], targets, np.empty((0, 1)))


def _named(name: str, rows: Sequence[Row]) -> list[Row]:
    return [row._replace(name=f"{name}.{row.name}") for row in rows]


def _equal(name: str, body: Configuration, gap: Any, units: tuple[str, str, str]) -> list[Row]:
    """Rows by which each way to move has no gap; `units` are those of places, attitudes and wheels."""
    which = body.coordinates.paced(0, 1, 2)
    return [
        Row(f"{name}.{axis}", gap[i], 0.0, 0.0, units[which[i]]) for i, axis in enumerate(body.velocity_names)
    ]


def _merged(places: list[np.ndarray], symbols: list[ca.SX]) -> tuple[np.ndarray, ca.SX]:
    return np.concatenate(places), ca.vertcat(*symbols)


def own_unknowns(joint: Joint, program: Program, mass: float) -> Layout:
    """The unknowns of a joint itself: of its events, and at a start with events the velocity before them."""
    units, body = program.units, program.dynamics.configuration
    layout = Layout()
    if joint.left is None and joint.events:
        scale = body.coordinates.paced(units.length / units.time, 1 / units.time, units.torque * units.time)
        layout = layout.add("velocity", "end", body.velocity_names, 1, scale[None])
    for i, event in enumerate(joint.events):
        known = event.unknowns(int(body.coordinates.speeds.sum()))
        if known:
            scale = np.array([[units.of(unit) for _, unit in known]])
            layout = layout.add(f"event {i}", "end", [name for name, _ in known], 1, scale)
    return layout
