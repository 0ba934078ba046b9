"""The places, names and scales of all unknowns and rows of an NLP, and curved unknowns in their places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from dmoc.assembly.kernel import Kernel
from dmoc.basics.records import dataclass
from dmoc.guess.chart import Chart
from dmoc.ipopt.run import Answer
from dmoc.parts.rows import Row

# The group of rows g(q) = 0 has this name.
CONSTRAINT = "constraint"
# In a leg of a mission the time at its start and, unless it burns away, the mass are single unknowns.
LEG_START, LEG_MASS = "start_time", "leg_mass"
# In a chart these groups of unknowns are vectors in the frames of these nodes.
VECTORS: dict[str, Any] = {"force": slice(None), "start.velocity": [0], "goal.velocity": [-1]}


class Owner(NamedTuple):
    """The part of a problem that states rows: a field of `TransferProblem` and which of its entries.

    `end` is "start" or "goal" where the rows look at the boundary state there alone.
    """

    field: str
    entry: int = 0
    end: str = ""

    def of(self, problem: Any) -> Any:
        """The part itself."""
        part = getattr(problem, self.field)
        return part[self.entry] if self.field in ("constraints", "links") else part


class Limit(NamedTuple):
    """A group of rows of its own: name, what its index counts, the rows, the part that states them."""

    name: str
    kind: str
    rows: tuple[Row, ...]
    owner: Owner | None


@dataclass(frozen=True)
class Group:
    """Neighbouring unknowns or rows of one kind: `count` times the components in `labels`.

    `kind` says what the index counts and how multipliers travel between meshes: "smooth" (nodes,
    rows of the discrete Euler-Lagrange equations), "node", "control", "step", "between" (the mass flow of
    neighbouring steps) or "end" (counts nothing). `owner` is the part that states the rows, `units` the unit
    in which it states each.
    """

    name: str
    kind: str
    labels: tuple[str, ...]
    count: int
    start: int
    scale: float | np.ndarray = 1.0
    owner: Owner | None = None
    units: tuple[str, ...] = ()

    @property
    def indices(self) -> np.ndarray:
        """Places in the NLP, shape (components, count)."""
        size = len(self.labels)
        return self.start + np.arange(size)[:, None] + size * np.arange(self.count)

    @property
    def stop(self) -> int:
        return self.start + len(self.labels) * self.count

    @property
    def scales(self) -> np.ndarray:
        """Scale of every place, shape (count, components), from a number, one an index, or a table."""
        scale = np.asarray(self.scale, float)
        return np.broadcast_to(scale[:, None] if scale.ndim == 1 else scale, (self.count, len(self.labels)))

    def of(self, vector: np.ndarray) -> np.ndarray:
        """This group's part of a vector, shape (count, components)."""
        return np.asarray(vector)[self.start : self.stop].reshape(self.count, len(self.labels))

    def name_of(self, place: int) -> str:
        """Such as `dynamics[17].y` or `goal.velocity.z`."""
        index, component = divmod(place - self.start, len(self.labels))
        label = self.labels[component]
        # A user knows the ends of the path as start and goal, not by the number of a node.
        if self.name == "position" and index in (0, self.count - 1):
            return f"{'start' if index == 0 else 'goal'}.position.{label}"
        return ".".join(filter(None, [self.name + ("" if self.kind == "end" else f"[{index}]"), label]))


@dataclass(frozen=True)
class Layout:
    """The groups of unknowns or of rows, in order."""

    groups: tuple[Group, ...] = ()

    def add(
        self,
        name: str,
        kind: str,
        labels: Sequence[str],
        count: int,
        scale: float | np.ndarray = 1.0,
        owner: Owner | None = None,
        units: Sequence[str] = (),
    ) -> Layout:
        """The layout with one more group behind the others."""
        new = Group(name, kind, tuple(labels), count, self.size, scale, owner, tuple(units))
        return Layout((*self.groups, new))

    def group_at(self, place: int) -> Group:
        """The group that an unknown or a row belongs to."""
        return next(group for group in self.groups if place < group.stop)

    @property
    def size(self) -> int:
        return self.groups[-1].stop if self.groups else 0

    def __contains__(self, name: str) -> bool:
        return any(group.name == name for group in self.groups)

    def __getitem__(self, name: str) -> Group:
        return next(group for group in self.groups if group.name == name)

    def name_of(self, place: int) -> str:
        return self.group_at(place).name_of(place)

    def scales(self) -> np.ndarray:
        """Scale of every place."""
        return self._scales

    @cached_property
    def _scales(self) -> np.ndarray:
        return np.concatenate([*(group.scales.ravel() for group in self.groups), np.empty(0)])


@dataclass(frozen=True)
class Curved:
    """The way between the scaled unknowns of a path and those of a chart, and between their multipliers."""

    chart: Chart
    columns: Layout
    rows: Layout

    def unknowns(self, x: np.ndarray) -> np.ndarray:
        """The chart's unknowns of a path's."""
        chart, place = self.chart, self._of(x, "position") - self.chart.foot
        east, north = ((place * side).sum(axis=1) for side in (chart.out, chart.along))
        angle = np.arctan2(north, east)
        parts = [np.hypot(east, north) - chart.reach, angle * chart.reach, place @ chart.axis]
        position = np.stack(parts, axis=1)[:, : chart.axes]
        return self._turned(x, position, _transposed(chart.frames(angle)))

    def path(self, y: np.ndarray) -> np.ndarray:
        """The path's unknowns of a chart's."""
        chart, place, frames = self.chart, self._of(y, "position"), self._frames(y)
        position = chart.foot + (chart.reach + place[:, 0])[:, None] * frames[:, :, 0]
        if chart.axes == 3:
            position = position + place[:, 2:] * chart.axis
        return self._turned(y, position, frames)

    def multipliers(self, x: np.ndarray, lam_x: np.ndarray, lam_g: np.ndarray) -> tuple:
        """The multipliers in the chart's unknowns of those in a path's.

        Those of unknowns are a gradient, which the chain rule carries: along the angle turn position, force and
        the velocities of the ends.
        """
        frames, stretch = self._frames(y := self.unknowns(x)), self._stretch(y)
        place = np.einsum("kji,kj->ki", frames, self._of(lam_x, "position", -1))
        place[:, 1] = place[:, 1] * stretch + self._turning(x, lam_x)
        return self._turned(lam_x, place, _transposed(frames), -1), self.rotated(lam_g, _transposed(frames))

    def answer(self, found: Answer) -> Answer:
        """An answer in the unknowns of a path."""
        frames, x = self._frames(found.x), self.path(found.x)
        place = self._of(found.lam_x, "position", -1)
        lam_x = self._turned(found.lam_x, place, frames, -1)
        place[:, 1] = (place[:, 1] - self._turning(x, lam_x)) / self._stretch(found.x)
        lam_x = self._turned(found.lam_x, np.einsum("kij,kj->ki", frames, place), frames, -1)
        lam_g, g = (self.rotated(part, frames) for part in (found.lam_g, found.g))
        return replace(found, x=x, g=g, lam_x=lam_x, lam_g=lam_g)

    def rotated(self, g: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Rows, or their multipliers, with those of motion multiplied by a matrix a node."""
        group, turned = self.rows["dynamics"], np.array(g)
        turned[group.start : group.stop] = np.einsum("kij,kj->ki", frames, group.of(g)).ravel()
        return turned

    def _frames(self, y: np.ndarray) -> np.ndarray:
        return self.chart.frames(self._of(y, "position")[:, 1] / self.chart.reach)

    def _stretch(self, y: np.ndarray) -> np.ndarray:
        """How far the body moves for one metre of the unknown along [-]."""
        return 1 + self._of(y, "position")[:, 0] / self.chart.reach

    def _turning(self, x: np.ndarray, lam: np.ndarray) -> np.ndarray:
        """For every node, what multipliers of its vectors say of one metre along, by which these turn."""
        chart, total = self.chart, np.zeros(len(self.chart.reach))
        for name, nodes in VECTORS.items():
            vectors, gradient = (part[:, : chart.axes] for part in (self._of(x, name), self._of(lam, name, -1)))
            total[nodes] += (chart.turning(vectors) * gradient).sum(axis=1) / chart.reach[nodes]
        return total

    def _of(self, x: np.ndarray, name: str, power: int = 1) -> np.ndarray:
        """A group in SI units; with -1 a group of derivatives by it."""
        group = self.columns[name]
        return group.of(x) * group.scales**power

    def _turned(self, x: np.ndarray, position: np.ndarray, frames: np.ndarray, power: int = 1) -> np.ndarray:
        """Unknowns with other positions [m], and other vectors multiplied by the matrix of their node."""
        new, group = np.array(x), self.columns["position"]
        new[group.start : group.stop] = (position / group.scales**power).ravel()
        for name, nodes in VECTORS.items():
            group = self.columns[name]
            table = group.of(x).copy()
            vectors = table[:, : self.chart.axes]
            table[:, : self.chart.axes] = np.einsum("kij,kj->ki", frames[nodes], vectors)
            new[group.start : group.stop] = table.ravel()
        return new


def _transposed(frames: np.ndarray) -> np.ndarray:
    return frames.transpose(0, 2, 1)


@dataclass(frozen=True)
class Stencil:
    """A kernel, and where its unknowns and rows stand on any mesh: (group, which of its entries).

    It is evaluated at `every` "node", "step" or at both "ends" once; `limits` are the groups of
    rows that nothing else adds to.
    """

    kernel: Kernel
    every: str
    unknowns: tuple[tuple[str, slice], ...]
    numbers: tuple[tuple[str, slice], ...]
    targets: tuple[tuple[str, slice], ...]
    limits: tuple[Limit, ...]


@dataclass(frozen=True)
class Stencils:
    """The stencils of one structure of problem at one order, and how many parameters they have."""

    stencils: tuple[Stencil, ...]
    parameter_count: int
