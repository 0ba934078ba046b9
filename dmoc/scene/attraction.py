"""What attracts in a scene: the point masses, and the rates of orbits around them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dmoc.effects.base import Attractor, Effect


@dataclass(frozen=True)
class Attraction:
    """The point masses of a scene with so many axes, and whether its frame turns."""

    dimension: int
    sources: tuple[Attractor, ...]
    turning: bool

    @classmethod
    def of(cls, effects: Sequence[Effect], dimension: int) -> Attraction:
        """What the effects of a scene say of themselves."""
        found = tuple(source for effect in effects if (source := effect.attractor()) is not None)
        return cls(dimension, found, any(effect.turns_frame() for effect in effects))

    @property
    def first(self) -> Attractor | None:
        """The first point mass, if there is one."""
        return self.sources[0] if self.sources else None

    @property
    def lone(self) -> Attractor | None:
        """The one attractor of a frame that does not turn, around which there are orbits."""
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
            # A node in the attractor has no rate: such a guess is refused by name later.
            outside = distance > 1e-6 * distance.max()
            squares[outside] += source.mu / distance[outside] ** 3
        return np.sqrt(squares)
