"""What every effect is: a frozen dataclass with one method, `lagrangian` or `force`.

`t` is the time [s], `q` the position [m], `v` the velocity [m/s] (CasADi columns of the problem's
dimension) and `m` the mass [kg]. Constants of an effect are baked into the graph.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any


class Effect(ABC):
    """Something that acts on the body. Derive from `Conservative` or `Force`, never from this."""

    def check_dimension(self, dimension: int) -> None:
        """Raise ValueError if the effect has no meaning in this many dimensions."""


class Conservative(Effect):
    """An effect that enters the Lagrangian and so keeps the flow symplectic."""

    @abstractmethod
    def lagrangian(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        """Contribution to the Lagrangian per unit mass [J/kg]; 1/2 |v|^2 is already there."""


class Force(Effect):
    """An effect that does work: drag, radiation pressure and the like."""

    @abstractmethod
    def force(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        """Force on the body [N]."""


def need_dimension(effect: Effect, argument: str, needed: int, dimension: int) -> None:
    """ValueError unless the argument's length fits the problem's dimension."""
    if needed != dimension:
        name = type(effect).__name__
        raise ValueError(
            f"{name}: {argument} has {needed} entries but the problem has {dimension} dimensions; "
            f"give {dimension} entries"
        )
