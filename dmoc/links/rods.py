"""Rods, rails and surfaces that hold a body to the room."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, checked, number, short, vector
from dmoc.links.holonomic import Holonomic


@dataclass(frozen=True)
class Rod(Holonomic):
    """A rod without mass from a fixed point to the body: their distance stays its length.

    Parameters
    ----------
    anchor : sequence of float
        The fixed point [m].
    length : float
        Length of the rod [m].
    """

    anchor: Vector
    length: float

    def __post_init__(self) -> None:
        checked(self, anchor=vector("Rod: anchor", self.anchor, "m"))
        checked(self, length=number("Rod: length", self.length, "m", positive=True))

    def check_dimension(self, dimension: int) -> None:
        _fits("Rod: anchor", self.anchor, dimension)
        if dimension == 1:
            raise ValueError(
                "Rod: a body on a line cannot turn about its anchor; give positions of 2 or 3 entries"
            )

    def g(self, q: Any) -> Any:
        # Half the square over the length: near zero it is the distance less the length, and a polynomial.
        arm = q - ca.vertcat(*self.anchor)
        return 0.5 * (ca.dot(arm, arm) / self.length - self.length)

    def words(self) -> str:
        return f"a rod of {self.length:g} m to {_listed(self.anchor)} m"


@dataclass(frozen=True)
class Slider(Holonomic):
    """A straight rail: the body stays on the line through a point along a direction.

    Parameters
    ----------
    point : sequence of float
        A point of the line [m].
    direction : sequence of float
        The way of the line [-]; made a unit vector.
    """

    point: Vector
    direction: Vector

    def __post_init__(self) -> None:
        checked(self, point=vector("Slider: point", self.point, "m"))
        way = np.array(vector("Slider: direction", self.direction, "-"))
        if not np.linalg.norm(way):
            raise ValueError(f"Slider: direction must be a direction [-]; got {short(self.direction)}")
        checked(self, direction=tuple((way / np.linalg.norm(way)).tolist()))

    def check_dimension(self, dimension: int) -> None:
        _fits("Slider: point", self.point, dimension)
        _fits("Slider: direction", self.direction, dimension)
        if dimension == 1:
            raise ValueError("Slider: a body on a line needs no rail; leave it out")

    def g(self, q: Any) -> Any:
        way = np.array(self.direction)
        # The rows of V' after the first span what is across the line.
        across = np.linalg.svd(way[None])[2][1:]
        return ca.DM(across) @ (q - ca.vertcat(*self.point))

    def words(self) -> str:
        return f"a rail through {_listed(self.point)} m along {_listed(self.direction)}"


@dataclass(frozen=True)
class Surface(Holonomic):
    """A surface on which the body slides without friction, or in two dimensions a wire.

    Parameters
    ----------
    function : function of the position
        Takes a CasADi position [m] and gives a number that is zero on the surface [m], without a slope of zero
        there.
    """

    function: Callable

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise ValueError(f"Surface: it takes a function of the position [m]; got {short(self.function)}")

    def g(self, q: Any) -> Any:
        return self.function(q)

    def words(self) -> str:
        return "a surface"


def _fits(name: str, given: Any, dimension: int) -> None:
    if len(given) != dimension:
        raise ValueError(f"{name} must have {dimension} entries, one an axis; got {short(given)}")


def _listed(values: Any) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in values) + ")"
