"""Air: forces that resist the motion."""

from __future__ import annotations

from dataclasses import dataclass

from dmoc.checks import number
from dmoc.effects.base import Force


@dataclass(frozen=True)
class LinearDrag(Force):
    """Resistance in proportion to the speed: F = -coefficient v.

    Parameters
    ----------
    coefficient : float
        Force per speed [N s/m].
    """

    coefficient: float

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "coefficient", number("coefficient", self.coefficient, "N s/m", nonnegative=True)
        )

    def force(self, t, q, v, m):
        return -self.coefficient * v
