"""The point masses that attract in a scene, and the rates of circular orbits around them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dmoc.basics.records import dataclass
from dmoc.effects.base import Attractor, Effect


@dataclass(frozen=True)
class Attraction:
    """The point masses of a scene with `dimension` axes, and whether the frame of its coordinates rotates."""

    dimension: int
    sources: tuple[Attractor, ...]
    turning: bool

    @classmethod
    def of(cls, effects: Sequence[Effect], dimension: int) -> Attraction:
        """The attraction of a scene, collected from `attractor` and `turns_frame` of its effects."""
        found = tuple(source for effect in effects if (source := effect.attractor()) is not None)
        return cls(dimension, found, any(effect.turns_frame() for effect in effects))

    @property
    def first(self) -> Attractor | None:
        """The first point mass, if there is one."""
        return self.sources[0] if self.sources else None

    @property
    def lone(self) -> Attractor | None:
        """The only attractor of a scene with 2 or 3 axes and a frame that does not rotate: it has orbits."""
        alone = len(self.sources) == 1 and not self.turning and self.dimension > 1
        return self.sources[0] if alone else None

    @property
    def center(self) -> np.ndarray:
        """Place of the first point mass [m], or the origin."""
        return np.zeros(self.dimension) if self.first is None else self.first.place(self.dimension)

    def rates(self, position: np.ndarray) -> np.ndarray:
        """Rate of a circular orbit at each place, sqrt(sum mu / r^3) [1/s]; 0 where nothing attracts."""
        squares = np.zeros(len(position))
        for source in self.sources:
            distance = np.linalg.norm(position - source.place(self.dimension), axis=1)
            # A node in the attractor itself has no finite rate [1/s] and is skipped: the check of the effects
            # refuses such a guess later and names the node.
            outside = distance > 1e-6 * distance.max()
            squares[outside] += source.mu / distance[outside] ** 3
        return np.sqrt(squares)
