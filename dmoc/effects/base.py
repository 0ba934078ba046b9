"""What every effect is: a frozen dataclass with one method, `lagrangian` or `force`.

`t` is the time [s], `q` the position [m], `v` the velocity [m/s] (CasADi columns of the problem's
dimension) and `m` the mass [kg]. Constants of an effect are baked into the graph.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import fields, is_dataclass
from typing import Any, NamedTuple

import numpy as np

from dmoc.basics.docstrings import documented, first_line


class Part:
    """Something that can say in one line what it is."""

    def words(self) -> str:
        """One line for a person: what the docstring says it is, and its numbers with units."""
        name, docstring = type(self).__name__, type(self).__doc__
        summary = first_line(docstring)
        # a dataclass without a docstring has its signature there
        summary = "" if summary.startswith(f"{name}(") else summary.split(":")[0].rstrip(".")
        numbers = ", ".join([name, *self._numbers()])
        return f"{summary} ({numbers})" if summary else numbers

    def _numbers(self) -> list[str]:
        entries = documented(type(self).__doc__)
        members: tuple = fields(self) if is_dataclass(self) else ()
        return [
            f"{member.name} {_in_words(value, entries[member.name].unit if member.name in entries else '')}"
            for member in members
            if (value := getattr(self, member.name)) is not None
        ]


class Attractor(NamedTuple):
    """A point mass: gravitational parameter [m^3/s^2] and place [m], None for the origin."""

    mu: float
    center: tuple[float, ...] | None

    def place(self, dimension: int) -> np.ndarray:
        """Its place with so many axes [m]."""
        return np.zeros(dimension) if self.center is None else np.array(self.center)


class Effect(Part, ABC):
    """Something that acts on the body. Derive from `Conservative` or `Force`, never from this."""

    def check_dimension(self, dimension: int) -> None:
        """Raise ValueError if the effect has no meaning in this many dimensions."""

    def attractor(self) -> Attractor | None:
        """The point mass that it is, around which there are orbits; None for anything else."""
        return None

    def turns_frame(self) -> bool:
        """Whether it makes the frame turn, in which orbits do not close."""
        return False

    def body_radius(self) -> float:
        """Radius of the body at the origin where it tells one [m], else 0."""
        return 0.0


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


def need_dimension(effect: Any, argument: str, needed: int, dimension: int) -> None:
    """ValueError unless the argument's length fits the problem's dimension."""
    if needed != dimension:
        name = type(effect).__name__
        raise ValueError(
            f"{name}: {argument} has {needed} entries but the problem has {dimension} dimensions; "
            f"give {dimension} entries"
        )


def _in_words(value: Any, unit: str) -> str:
    if isinstance(value, Part):
        return f"{type(value).__name__}({', '.join(value._numbers())})"
    if isinstance(value, (tuple, list)):
        entries = ", ".join(_in_words(entry, "") for entry in value[:6])
        text = f"({entries})" if len(value) <= 6 else f"({len(value)} values)"
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        text = f"{value:.10g}"
    else:
        text = getattr(value, "__name__", None) or str(value)
    return f"{text} {unit}" if unit and unit not in ("-", "1") else text
