"""What is forbidden on the way."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.checks import number, same_length, vector
from dmoc.rows import Row


class Constraint(ABC):
    """A limit on positions (`rows`, `bounds`) or on the speed (`speed_rows`) all along the path."""

    unit: ClassVar[str] = "m"
    adjustable: ClassVar[tuple[str, ...]] = ()

    def check_dimension(self, dimension: int) -> None:
        """Raise ValueError if the constraint has no meaning in this many dimensions."""

    def rows(self, t: Any, q: Any, u: Any, m: Any) -> list[Row]:
        """Rows that hold at every node."""
        return []

    def speed_rows(self, v: Any) -> list[Row]:
        """Rows that hold at the Gauss points of every step and at both ends."""
        return []

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        """Plain bounds of the position [m]."""
        limit = np.full(dimension, np.inf)
        return -limit, limit

    @abstractmethod
    def excess(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """By how much states of shape (count, dimension) break the limit, in `unit`; 0 where it holds."""

    @abstractmethod
    def words(self) -> str:
        """One line for a person."""


@dataclass(frozen=True)
class KeepOut(Constraint):
    """Stay outside a sphere (a disc in the plane).

    Parameters
    ----------
    center : sequence of float
        Centre [m].
    radius : float
        Radius [m].
    """

    center: tuple
    radius: float
    adjustable: ClassVar[tuple[str, ...]] = ("center", "radius")

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", vector("center", self.center, "m"))
        object.__setattr__(self, "radius", number("radius", self.radius, "m", positive=True))

    def check_dimension(self, dimension: int) -> None:
        _need(self, "center", len(self.center), dimension)

    def rows(self, t: Any, q: Any, u: Any, m: Any) -> list[Row]:
        offset = (q - self.center) / self.radius
        return [Row("clearance", ca.dot(offset, offset), 1.0, np.inf)]

    def excess(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.maximum(0.0, self.radius - np.linalg.norm(q - np.asarray(self.center), axis=1))

    def words(self) -> str:
        return f"stays {self.radius:g} m away from {_point(self.center)}"


@dataclass(frozen=True)
class KeepIn(Constraint):
    """Stay inside a box.

    Parameters
    ----------
    lower, upper : sequence of float
        Opposite corners [m]; entries may be -inf and inf.
    """

    lower: tuple
    upper: tuple

    def __post_init__(self) -> None:
        for name in ("lower", "upper"):
            given = np.atleast_1d(np.asarray(getattr(self, name), dtype=object))
            finite = [0.0 if value in (np.inf, -np.inf) else value for value in given]
            vector(name, finite, "m")
            object.__setattr__(self, name, tuple(float(value) for value in given))
        same_length("KeepIn", lower=self.lower, upper=self.upper)
        for low, high in zip(self.lower, self.upper, strict=True):
            if low >= high:
                raise ValueError(
                    f"KeepIn: lower must be less than upper on every axis; got {low:g} and {high:g} m"
                )

    def check_dimension(self, dimension: int) -> None:
        _need(self, "lower", len(self.lower), dimension)

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.lower), np.array(self.upper)

    def excess(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.maximum(0.0, np.maximum(self.lower - q, q - self.upper)).max(axis=1)

    def words(self) -> str:
        return f"stays between {_point(self.lower)} and {_point(self.upper)}"


@dataclass(frozen=True)
class SpeedLimit(Constraint):
    """Stay below a speed.

    Parameters
    ----------
    limit : float
        Largest speed [m/s].
    """

    limit: float
    unit: ClassVar[str] = "m/s"
    adjustable: ClassVar[tuple[str, ...]] = ("limit",)

    def __post_init__(self) -> None:
        object.__setattr__(self, "limit", number("limit", self.limit, "m/s", positive=True))

    def speed_rows(self, v: Any) -> list[Row]:
        return [Row("speed", ca.dot(v, v) / self.limit**2, -np.inf, 1.0)]

    def excess(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.maximum(0.0, np.linalg.norm(v, axis=1) - self.limit)

    def words(self) -> str:
        return f"is never faster than {self.limit:g} m/s"


def _need(part: Any, argument: str, given: int, dimension: int) -> None:
    if given != dimension:
        raise ValueError(
            f"{type(part).__name__}: {argument} has {given} entries but the problem has {dimension} "
            f"dimensions; give {dimension}"
        )


def _point(values: tuple) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ") m"
