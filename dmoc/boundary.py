"""Where a transfer starts and ends."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from dmoc.checks import same_length, vector
from dmoc.rows import Row


class Boundary(ABC):
    """A condition on time, position, velocity and mass at one end of the transfer."""

    adjustable: ClassVar[tuple[str, ...]] = ()

    @property
    @abstractmethod
    def dimension(self) -> int:
        """Number of axes."""

    def fixed(self) -> tuple[np.ndarray, np.ndarray]:
        """Position [m] and velocity [m/s] entries that are fixed numbers; NaN where they are not."""
        free = np.full(self.dimension, np.nan)
        return free, free.copy()

    def rows(self, t: Any, q: Any, v: Any, m: Any) -> list[Row]:
        """Further conditions, dimensionless."""
        return []

    def estimate(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """A typical position and velocity for the starting guess; NaN where nothing is known."""
        return self.fixed()

    @abstractmethod
    def words(self) -> str:
        """One line for a person."""


@dataclass(frozen=True)
class State(Boundary):
    """A position and a velocity; what is None is free.

    Parameters
    ----------
    position : sequence of float or None
        [m], one entry an axis. An entry that is None is free; None alone frees all of them.
    velocity : sequence of float or None
        [m/s], the same.
    """

    position: tuple
    velocity: tuple

    def __post_init__(self) -> None:
        position, velocity = self.position, self.velocity
        if position is None and velocity is None:
            raise ValueError("State: position and velocity are both None; fix at least one of them [m], [m/s]")
        if position is None:
            position = (None,) * np.size(velocity)
        if velocity is None:
            velocity = (None,) * np.size(position)
        object.__setattr__(self, "position", vector("position", position, "m", free=True))
        object.__setattr__(self, "velocity", vector("velocity", velocity, "m/s", free=True))
        same_length("State", position=self.position, velocity=self.velocity)

    @property
    def dimension(self) -> int:
        return len(self.position)

    def fixed(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.position, float), np.array(self.velocity, float)

    def words(self) -> str:
        return f"position {_entries(self.position)} m, velocity {_entries(self.velocity)} m/s"


def _entries(values: Any) -> str:
    return "(" + ", ".join("free" if value is None else f"{value:g}" for value in values) + ")"
