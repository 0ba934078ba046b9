"""Ends of missions and of their legs that leave the whole state free, or repeat the start."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from dmoc.basics.arguments import whole
from dmoc.basics.quaternions import AXES, QUATERNION
from dmoc.basics.records import dataclass
from dmoc.ends.base import Boundary


@dataclass(frozen=True)
class Free(Boundary):
    """Any state: nothing is fixed at this end.

    Parameters
    ----------
    axes : int
        Number of axes, 1 to 3; those of the other end if it is 0.
    """

    axes: int = 0
    # Whether the state is that of the start once more.
    closes: ClassVar[bool] = False
    # The number of axes shapes a solve, and is no number that one may change.
    counts: ClassVar[tuple[str, ...]] = ("axes",)

    def __post_init__(self) -> None:
        whole("Free: axes", self.axes, least=0)
        if self.axes > AXES:
            raise ValueError(f"Free: axes must be 1 to 3, or 0 for those of the other end; got {self.axes}")

    @property
    def dimension(self) -> int:
        return self.axes

    def with_dimension(self, dimension: int) -> Any:
        return self if self.axes else replace(self, axes=dimension)

    def words(self) -> str:
        return "any state"


@dataclass(frozen=True)
class Periodic(Free):
    """The state of the start once more: the mission may be repeated.

    Where the motion keeps an energy, in coasts on which nothing does work, one velocity follows from the
    others, and is not asked for again.
    """

    closes: ClassVar[bool] = True

    def words(self) -> str:
        return "the state of the start, so that the path closes"


@dataclass(frozen=True)
class Loose(Boundary):
    """The end of a leg: whatever the joint beside it makes of it.

    `places` are the axes of its position, 0 for an attitude alone, and `turns` says whether it has an attitude.
    """

    places: int
    turns: bool = False

    @classmethod
    def like(cls, end: Boundary) -> Loose:
        """An end with the entries of another, and nothing fixed."""
        return cls(end.dimension if end.has_position else 0, end.turns_body)

    @property
    def dimension(self) -> int:
        return self.places or AXES

    @property
    def has_position(self) -> bool:
        return self.places > 0

    @property
    def turns_body(self) -> bool:
        return self.turns

    @property
    def point(self) -> Boundary:
        return Loose(self.places)

    def fixed(self) -> tuple[np.ndarray, np.ndarray]:
        sizes = self.places + QUATERNION * self.turns, self.places + AXES * self.turns
        return np.full(sizes[0], np.nan), np.full(sizes[1], np.nan)

    def words(self) -> str:
        return "a joint of the mission"
