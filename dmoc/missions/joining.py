"""The rows, unknowns and cost of a joint, and the rows of a mission as a whole.

At a joint the discrete equations of both legs hold with their own boundary velocities: the last momentum of the
leg before equals dl/dv at v-, the first of the leg behind it minus dl/dv at v+. Together with v+ = v- + dv they
are the momentum balance of a node at which an impulse acts. What is continuous is the velocity, not the
momentum, so that the legs may have other Lagrangians or count in other frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from dmoc.configurations.base import Configuration
from dmoc.legs.events import Instant, condition_rows
from dmoc.legs.legs import Joint, both_ends
from dmoc.missions.path import MissionPath
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.path import DiscretePath
from dmoc.nlp.assembly import Block, kernel
from dmoc.nlp.layout import LEG_MASS, LEG_START, Layout
from dmoc.nlp.placement import Placement
from dmoc.nlp.program import Program
from dmoc.nlp.stencils import stencils_of
from dmoc.nlp.units import Units
from dmoc.parts.rows import Row, snake
from dmoc.scene.mission import Mission
from dmoc.scene.problem import TransferProblem

# The size of an impulse is rounded at zero over this part of the unit of speed [-].
ROUNDED = 1e-8


@dataclass(frozen=True)
class Placed:
    """A leg's program, and where its unknowns and rows begin in those of the mission."""

    program: Program
    columns: int
    rows: int
    parameters: int

    def at(self, group: str, place: int) -> np.ndarray:
        """Unknowns of the mission that are one entry of a group of this leg."""
        return self.columns + self.program.columns[group].indices[:, place]


def leg_program(
    problem: TransferProblem, path: DiscretePath, units: Units, joined: bool = True
) -> tuple[Program, list, int]:
    """A leg without its sparse derivatives, its blocks, and how many parameters they have.

    Unless it is `joined` to others before it, its time and mass at the start are known.
    """
    rule = scheme(path.order)
    stencils = stencils_of(problem, path.order, path.hold, joined=joined)
    placed = Placement(problem, stencils, rule, path.hold, path.mesh, units, joined=joined)
    none: Any = None
    program = Program(
        problem,
        Dynamics.of(problem),
        rule,
        path.hold,
        path.mesh,
        units,
        placed.columns,
        placed.rows,
        placed.row_bounds,
        none,
    )
    return program, placed.blocks, stencils.parameter_count


class JointWriter:
    """The formulas of one joint while they are being written down; see `written`."""

    def __init__(
        self,
        mission: Mission,
        joint: Joint,
        legs: Sequence[Placed],
        own: tuple[Layout, int],
        rounding: float | None = None,
    ):
        self.mission, self.joint, self.legs = mission, joint, legs
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
        return leg.program.problem.duration_bounds[0]

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
        return Instant(behind.t, behind.q, speeds, ca.SX(float(self.mission.mass)))

    def write(self) -> None:
        """All rows and the cost of the joint."""
        joint, speeds = self.joint, self.beside.program.dynamics.configuration.coordinates.speeds
        self._behind = None if joint.right is None else self.state(joint.right, last=False)
        here = self.before()
        if joint.left is None and joint.boundary is not None:
            self.rows += _named("start", condition_rows(joint.boundary, here))
        units = self.beside.program.units
        tiny = self.rounding * units.length / units.time
        for i, event in enumerate(joint.events):
            own = self.take_own(f"event {i}") if event.unknowns(1) else ca.SX(0, 1)
            passed = event.passed(here, own, speeds, tiny)
            self.rows += _named(f"{snake(type(event).__name__)}_{i + 1}", passed.rows)
            if passed.kick is not None:
                self._pay(self.mission.objective.kick(*passed.kick))
            here = passed.after
        if joint.right is None:
            if joint.boundary is not None:
                self.rows += _named("goal", condition_rows(joint.boundary, here))
            body = self.beside.program.dynamics.configuration
            seen = body.body(here.q, body.velocity(here.q, here.v))
            self._pay(self.mission.objective.terminal(here.t, seen.position, seen.velocity, here.m))
        if self._behind is not None and here is not self._behind:
            self._join(here, self._behind)

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
        made = kernel("joint", symbols, ca.SX(0, 1), ca.SX(0, 1), ca.vertcat(*expressions), ca.SX(self.cost))
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


def row_to_drop(path: MissionPath) -> int:
    """Which velocity is not asked for again at the end of a closed path: the largest at its start."""
    return int(np.argmax(np.abs(path.legs[0].start_velocity)))


def whole_rows(mission: Mission, legs: Sequence[Placed], drop: int) -> tuple[list[Row], np.ndarray, ca.SX]:
    """Rows of the mission as a whole: its duration, and that its path closes."""
    pool: dict[tuple[int, ...], ca.SX] = {}

    def take(places: np.ndarray) -> ca.SX:
        return pool.setdefault(tuple(places), ca.SX.sym("x", len(places)))

    first, last = legs[0], legs[-1]
    rows: list[Row] = []
    spans = list(mission.sums)
    if mission.duration is not None:
        spans.append((0, len(legs) - 1, mission.duration))
    for begin, end, span in spans:
        total = ca.SX(0)
        if begin < end:
            total = take(legs[end].at(LEG_START, 0)) - take(legs[begin].at(LEG_START, 0))
        free = "duration" in legs[end].program.columns
        lasts = take(legs[end].at("duration", 0)) if free else legs[end].program.problem.duration_bounds[0]
        rows.append(Row("duration", total + lasts, *both_ends(span), "s"))
    if mission.closes:
        begin = take(first.at("position", 0)) + first.program.units.origin
        end = take(last.at("position", -1)) + last.program.units.origin
        gap = take(last.at("goal.velocity", 0)) - take(first.at("start.velocity", 0))
        body = first.program.dynamics.configuration
        away = body.along(begin, end - begin)
        rows += [
            Row(f"closed.position.{name}", away[i], 0.0, 0.0, "m") for i, name in enumerate(body.velocity_names)
        ]
        rows += [
            Row(f"closed.velocity.{name}", gap[i], 0.0, 0.0, "m/s")
            for i, name in enumerate(body.velocity_names)
            if i != drop
        ]
    if not rows:
        return [], np.zeros(0, int), ca.SX(0, 1)
    return rows, np.concatenate([*map(np.array, pool)]), ca.vertcat(*pool.values())
