"""The places, names and scales of all unknowns and rows of an NLP."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from dmoc.parts.rows import Row

# The group of rows g(q) = 0 has this name.
CONSTRAINT = "constraint"


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
        return part[self.entry] if self.field == "constraints" else part


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
        return np.concatenate([*(group.scales.ravel() for group in self.groups), np.empty(0)])
