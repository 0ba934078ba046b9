"""Surfaces of constraints that a path touches at one instant, or follows for a while."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from dmoc.basics.memory import remembered
from dmoc.basics.numerics import columns, cubic_spline
from dmoc.effects.base import Body
from dmoc.legs.events import Event, Instant, Passed
from dmoc.motion.path import POSITION_BOUNDS, DiscretePath, Key
from dmoc.parts.constraint import Constraint
from dmoc.parts.rows import Row, title
from dmoc.scene.problem import TransferProblem

# A node is at a limit if it is within this part of all the room that the path has [-].
NEAR = 1e-3
# Each gap between two nodes is looked at in so many places.
BETWEEN = 8
# A limit is broken between nodes by more than this part of its scale [-].
PIERCED = 1e-7


class Surface(NamedTuple):
    """One limit of a constraint: a row of it or, where `row` is -1, a wall across an axis."""

    constraint: int
    row: int
    axis: int = -1
    upper: bool = False


def touched(problem: TransferProblem, path: DiscretePath, least: float) -> dict[Surface, np.ndarray]:
    """The limits on positions that act along a path, each with a mask of the nodes where it does.

    A limit acts at a node if loosening it by its own size would change the objective by more than `least`.
    """
    found: dict[Surface, np.ndarray] = {}

    def note(surface: Surface, density: np.ndarray, size: float) -> None:
        share = density / len(density) * size
        share[[0, -1]] = 0.0
        acts = (share > least) & (share > 1e-2 * share.max())
        if acts.any():
            found[surface] = acts | _held(problem, path, surface, acts)

    for i, constraint in enumerate(problem.constraints):
        density = path.multipliers.get(Key("node", "row", title(constraint, i)))
        for row in range(0 if density is None else density.shape[1]):
            column = density[:, row]  # type: ignore[index]
            surface = Surface(i, row, upper=bool(column[np.argmax(np.abs(column))] > 0))
            if np.isfinite(room(problem, path, surface, path.fractions[:1], path.position[:1])).all():
                note(surface, np.abs(column), 1.0)
    walls = path.multipliers.get(POSITION_BOUNDS)
    boxes = [constraint.bounds(problem.dimension) for constraint in problem.constraints]
    for axis in range(0 if walls is None else walls.shape[1]):
        for upper, sign in ((False, -1.0), (True, 1.0)):
            sides = np.array([sign * box[int(upper)][axis] for box in boxes])
            if len(sides) and np.isfinite(sides.min()):
                pushed = np.maximum(0.0, sign * walls[:, axis])  # type: ignore[index]
                note(Surface(int(sides.argmin()), -1, axis, upper), pushed, path.diagonal)
    return found


def pulled(leg: Constraint, entry: int, surface: Surface, path: DiscretePath) -> float:
    """By how much a limit that a leg follows pulls the path at its nodes [-]: it only may push it away.

    The largest multiplier inside the leg with the sign of a pull, over the largest one.
    """
    rows = path.multipliers.get(Key("node", "row", title(leg, entry)))
    if surface.row < 0 or rows is None or len(rows) < 3:
        return 0.0
    push = rows[1:-1, surface.row] * (1.0 if surface.upper else -1.0)
    return float(np.maximum(-push, 0.0).max() / max(np.abs(push).max(), np.finfo(float).tiny))


def _held(problem: TransferProblem, path: DiscretePath, surface: Surface, acts: np.ndarray) -> np.ndarray:
    """Nodes at a limit between two nodes where it acts: where no force is needed to stay, none acts between."""
    free = np.abs(room(problem, path, surface, path.fractions, path.position))
    near, nodes = free < NEAR * np.ptp(free), np.flatnonzero(acts)
    held = np.zeros(len(acts), bool)
    for one, two in pairwise(nodes):
        if near[one : two + 1].all():
            held[one : two + 1] = True
    return held


def room(
    problem: TransferProblem,
    path: DiscretePath,
    surface: Surface,
    at: np.ndarray,
    places: np.ndarray,
    begin: float | None = None,
) -> np.ndarray:
    """By how much places keep a limit, in its own unit; negative where they break it.

    The path begins at the time `begin` [s], or that of the problem.
    """
    constraint, size = problem.constraints[surface.constraint], places.shape[1]
    gap, limit = remembered(lambda: _gap(constraint, surface, size), "gap", constraint, surface, size)
    begin = problem.start_time if begin is None else begin
    times, masses = begin + path.duration * at, np.interp(at, path.fractions, path.mass)
    values = columns(gap, times, places.T, masses)[0].ravel()
    return (limit - values) * (1 if surface.upper else -1)


def _gap(constraint: Constraint, surface: Surface, size: int) -> tuple[ca.Function, float]:
    """(time, place, mass) -> what a limit limits, and the value that it has on the surface."""
    t, q, m = ca.SX.sym("t"), ca.SX.sym("q", size), ca.SX.sym("m")
    gap, limit = limit_of(constraint, surface, t, q, m)
    return ca.Function("gap", [t, q, m], [gap]), limit


def pierced(
    problem: TransferProblem,
    path: DiscretePath,
    begin: float,
    known: tuple[Container | None, Container | None] = (None, None),
) -> list[tuple[float, Surface]]:
    """Where a leg breaks limits between its nodes: fractions of its duration, each with the limit.

    `known` are the limits that the joints at its begin and at its end touch; None is all of them.
    """
    at = (
        path.fractions[:-1, None] + np.diff(path.fractions)[:, None] * np.linspace(0, 1, BETWEEN + 1)[:-1]
    ).ravel()
    slopes = path.start_velocity * path.duration, path.goal_velocity * path.duration
    places = cubic_spline(path.fractions, path.position, slopes)(at)
    found = []
    for surface in _surfaces(problem):
        broken = -room(problem, path, surface, at, places, begin)
        scale = float(np.ptp(broken))
        edges = np.flatnonzero(np.diff(np.concatenate([[0], broken > PIERCED * scale, [0]])))
        for first, last in edges.reshape(-1, 2):
            # What begins or ends at a joint that touches the limit is that joint's.
            theirs = first <= 1, last >= len(at) - 1
            if not any(ends and (of is None or surface in of) for ends, of in zip(theirs, known, strict=True)):
                found.append((float(at[first + int(np.argmax(broken[first:last]))]), surface))
    return found


def _surfaces(problem: TransferProblem) -> list[Surface]:
    """All limits on positions."""
    return remembered(lambda: _all_surfaces(problem), "surfaces", problem.constraints, problem.dimension)


def _all_surfaces(problem: TransferProblem) -> list[Surface]:
    found, axes = [], problem.dimension
    q = ca.SX.sym("q", axes)
    for i, constraint in enumerate(problem.constraints):
        sides = constraint.bounds(axes)
        walls = [
            Surface(i, -1, axis, bool(up))
            for axis in range(axes)
            for up in (0, 1)
            if np.isfinite(sides[up][axis])
        ]
        rows = [] if walls else constraint.rows(ca.SX.sym("t"), q, None, ca.SX.sym("m"))
        for k, row in enumerate(rows):
            found += [
                Surface(i, k, upper=up)
                for up, value in ((False, row.lower), (True, row.upper))
                if np.isfinite(value)
            ]
        found += walls
    return found


def limit_of(constraint: Constraint, surface: Surface, t: Any, q: Any, m: Any) -> tuple[Any, float]:
    """The expression of a limit and the value that it has on the surface."""
    if surface.row < 0:
        side = constraint.bounds(q.numel())[int(surface.upper)]
        return q[surface.axis], float(side[surface.axis])
    row = constraint.rows(t, q, None, m)[surface.row]
    return row.expression, row.upper if surface.upper else row.lower


@dataclass(frozen=True)
class Tangent(Event):
    """The velocity is along the surface of a limit: a touch of it, or the begin or end of a way along it.

    Without this condition the free time of a touch slides away, and the path runs through the surface.
    """

    constraint: Constraint
    surface: Surface
    keeps_energy = True

    def passed(self, here: Instant, own: Any, speeds: np.ndarray, tiny: float) -> Passed:
        sizes = here.q.numel(), here.v.numel()
        across = remembered(lambda: self._across(*sizes), "across", self.constraint, self.surface, *sizes)
        speed = across(here.t, here.q, here.v, here.m)
        return Passed(here, [Row("speed", speed, 0.0, 0.0, "m/s")])

    def _across(self, places: int, speeds: int) -> ca.Function:
        """(time, place, velocity, mass) -> the part of the velocity across the surface [m/s]."""
        t, m = ca.SX.sym("t"), ca.SX.sym("m")
        q, v = ca.SX.sym("q", places), ca.SX.sym("v", speeds)
        gap = ca.SX(limit_of(self.constraint, self.surface, t, q, m)[0])
        slope = ca.gradient(gap, q)
        across = (ca.dot(slope, v) + ca.jacobian(gap, t)) / ca.sqrt(ca.dot(slope, slope))
        return ca.Function("across", [t, q, v, m], [across])

    def words(self) -> str:
        return f"along the limit: the body {self.constraint.words()}"


@dataclass(frozen=True)
class Followed(Constraint):
    """A constraint one of whose limits the path keeps to exactly.

    Neighbouring legs need not state that limit for the joint between them.
    """

    base: Constraint
    surface: Surface
    follows = True

    @property
    def unit(self) -> str:  # type: ignore[override]
        return self.base.unit

    @property
    def structure(self) -> tuple:
        return type(self), self.base, self.surface

    def check_dimension(self, dimension: int) -> None:
        self.base.check_dimension(dimension)

    def rows_of(self, t: Any, body: Body, u: Any, m: Any) -> list[Row]:
        rows = list(self.base.rows_of(t, body, u, m))
        return rows if self.limits_speed else self._kept(rows)

    def speed_rows_of(self, body: Body) -> list[Row]:
        rows = list(self.base.speed_rows_of(body))
        return self._kept(rows) if self.limits_speed else rows

    def _kept(self, rows: list[Row]) -> list[Row]:
        """Rows of which that of the limit is an equation."""
        place = self.surface.row
        if place >= 0:
            value = rows[place].upper if self.surface.upper else rows[place].lower
            rows[place] = rows[place]._replace(lower=value, upper=value)
        return rows

    def largest_speed(self) -> float | None:
        return self.base.largest_speed()

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        lower, upper = (np.array(side, float) for side in self.base.bounds(dimension))
        if self.surface.row < 0:
            axis = self.surface.axis
            lower[axis] = upper[axis] = (upper if self.surface.upper else lower)[axis]
        return lower, upper

    def excess(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return self.base.excess(q, v)

    def excess_at(self, t: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return self.base.excess_at(t, q, v)

    def eased(self, slack: float) -> Constraint | None:
        base = self.base.eased(slack)
        return None if base is None else replace(self, base=base)

    def outline(self) -> tuple:
        return self.base.outline()

    def feature(self) -> float:
        return self.base.feature()

    def words(self) -> str:
        return f"keeps to the limit by which it {self.base.words()}"
