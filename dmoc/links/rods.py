"""Rods, rails and surfaces that hold a body to the room."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, checked, number, short, vector
from dmoc.basics.records import dataclass
from dmoc.effects.base import Body
from dmoc.links.holonomic import Holonomic


@dataclass(frozen=True)
class Rod(Holonomic):
    """A rod without mass from a fixed point, or from another body: the distance from there stays its length.

    Parameters
    ----------
    anchor : sequence of float or str
        The fixed point [m], or the name of the other body.
    length : float
        Length of the rod [m].
    on : str
        The name of the body at its end, where there are several.
    """

    anchor: Vector | str
    length: float
    on: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.anchor, str):
            checked(self, anchor=vector("Rod: anchor", self.anchor, "m"))
        elif self.anchor == self.on:
            raise ValueError(
                f"Rod: it joins {short(self.on)} to itself; give another body or a point as its anchor"
            )
        checked(self, length=number("Rod: length", self.length, "m", positive=True))

    def check_dimension(self, dimension: int) -> None:
        if not isinstance(self.anchor, str):
            _fits("Rod: anchor", self.anchor, dimension)
        if dimension == 1:
            raise ValueError(
                "Rod: a body on a line cannot turn about its anchor; give positions of 2 or 3 entries"
            )

    def g(self, q: Any) -> Any:
        return self._stretched(q - ca.vertcat(*self.anchor))

    def g_of(self, at: Mapping[str, Body]) -> Any:
        return self._stretched(self.arm(at))

    @property
    def holds(self) -> tuple[str, ...]:
        return (self.anchor, self.on) if isinstance(self.anchor, str) else (self.on,)

    def arm(self, at: Mapping[str, Body]) -> Any:
        """The vector from the anchor to the body at its end [m]."""
        foot = at[self.anchor].position if isinstance(self.anchor, str) else ca.vertcat(*self.anchor)
        return at[self.on].position - foot

    # In the plane the angle of the rod from the x axis says where it is.
    coordinates: ClassVar[int] = 1
    motors: ClassVar[int] = 1
    coordinate_units: ClassVar[tuple[str, str]] = ("rad", "rad/s")

    @property
    def name(self) -> str:
        """What its angle and its motor are called: by the body at its end."""
        return self.on

    def from_rest(self, at: Mapping[str, Body], rest: Any) -> Any:
        """The angle from a direction in the plane [rad], less than 180 degrees to either side."""
        arm, x, y = self.arm(at), ca.cos(rest), ca.sin(rest)
        return ca.atan2(arm[1] * x - arm[0] * y, arm[0] * x + arm[1] * y)

    def off(self, at: Mapping[str, Body], value: Any) -> Any:
        """By how much its angle is off a value: twice the sine of half of it, which has no jumps."""
        return 2 * ca.sin(0.5 * self.from_rest(at, value))

    def rate(self, at: Mapping[str, Body]) -> Any:
        """The rate of its angle [rad/s]."""
        arm, base = self.arm(at), self.anchor
        moves = at[self.on].velocity - (at[base].velocity if isinstance(base, str) else 0)
        return (arm[0] * moves[1] - arm[1] * moves[0]) / self.length**2

    def posed(self, base: Body, value: np.ndarray, rate: np.ndarray) -> Body:
        """The body at its end, from that at its anchor and from its angle and the rate of that."""
        foot, pace = base.position, base.velocity
        if not isinstance(self.anchor, str):
            foot, pace = np.array([self.anchor]), np.zeros(2)
        if foot.shape[1] != 2:
            raise ValueError("Rod: an angle says where it is in the plane alone; give the state of its body")
        way = np.hstack([np.cos(value), np.sin(value)])
        across = np.hstack([-way[:, 1:], way[:, :1]])
        return Body(foot + self.length * way, pace + self.length * rate * across)

    def driven(self, configuration: Any, q: Any, at: Mapping[str, Body], u: Any) -> Any:
        """The column of the size of q by which a motor at its anchor acts, whose reaction is elsewhere."""
        # The torque works on the angle of the rod: its force on q is that angle's slope.
        place = ca.SX.sym("q", configuration.size)
        arm = self.arm(configuration.at(place, 0 * place, 1.0))
        across = ca.vertcat(-arm[1], arm[0]) / ca.dot(arm, arm)
        slope = ca.jacobian(arm, place).T @ across
        return ca.Function("slope", [place], [slope])(q) * u

    def _foot(self, at: Mapping[str, Body]) -> np.ndarray:
        """The places of its anchor, one row a time [m]."""
        shape = np.shape(at[self.on].position)
        return at[self.anchor].position if isinstance(self.anchor, str) else np.broadcast_to(self.anchor, shape)

    @property
    def goes_round(self) -> bool:
        return True

    def led(
        self, at: dict[str, Body], fractions: np.ndarray, other_way: bool = False
    ) -> dict[str, Body] | None:
        body, foot = at[self.on], self._foot(at)
        first, last = (body.position[i] - foot[i] for i in (0, -1))
        return {self.on: body._replace(position=foot + turned_evenly(first, last, fractions, other_way))}

    def lines(self, at: dict[str, Body]) -> list[np.ndarray]:
        return [np.stack([self._foot(at), at[self.on].position], axis=1)]

    def _stretched(self, arm: Any) -> Any:
        # Half the square over the length: near zero it is the distance less the length, and a polynomial.
        return 0.5 * (ca.dot(arm, arm) / self.length - self.length)

    def words(self) -> str:
        foot = self.anchor if isinstance(self.anchor, str) else f"{_listed(self.anchor)} m"
        return f"{self.on or 'the body'} on a rod of {self.length:g} m from {foot}"


@dataclass(frozen=True)
class Slider(Holonomic):
    """A straight rail: the body stays on the line through a point along a direction.

    Parameters
    ----------
    point : sequence of float
        A point of the line [m].
    direction : sequence of float
        The way of the line [-]; made a unit vector.
    on : str
        The name of the body, where there are several.
    """

    point: Vector
    direction: Vector
    on: str = ""

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

    def lines(self, at: dict[str, Body]) -> list[np.ndarray]:
        way, point = np.array(self.direction), np.array(self.point)
        along = (at[self.on].position - point) @ way
        return [(point + np.array([[along.min()], [along.max()]]) * way)[None]]

    def words(self) -> str:
        return (
            f"{self.on or 'the body'} on a rail through {_listed(self.point)} m along {_listed(self.direction)}"
        )


@dataclass(frozen=True)
class Surface(Holonomic):
    """A surface on which the body slides without friction, or in two dimensions a wire.

    Parameters
    ----------
    function : function of the position
        Takes a CasADi position [m] and gives a number that is zero on the surface [m], without a slope of zero
        there.
    on : str
        The name of the body, where there are several.
    """

    function: Callable
    on: str = ""

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise ValueError(f"Surface: it takes a function of the position [m]; got {short(self.function)}")

    def g(self, q: Any) -> Any:
        return self.function(q)

    def words(self) -> str:
        return f"{self.on or 'the body'} on a surface"


def turned_evenly(
    first: np.ndarray, last: np.ndarray, fractions: np.ndarray, other_way: bool = False
) -> np.ndarray:
    """An arm that turns evenly from one direction to another by the shorter way, shape (count, dimension)."""
    length = float(np.linalg.norm(first))
    one = first / length
    along = float(np.clip(one @ last / np.linalg.norm(last), -1.0, 1.0))
    across = last - (one @ last) * one
    if np.linalg.norm(across) < 1e-9 * length:
        # Straight on or straight back: in the plane against the clock, in space about some axis.
        aside = np.eye(len(one))[np.argmin(np.abs(one))]
        across = np.array([-one[1], one[0]]) if len(one) == 2 else aside - (one @ aside) * one
    across = across / np.linalg.norm(across)
    angle = (np.arccos(along) - 2 * np.pi * other_way) * fractions[:, None]
    return length * (np.cos(angle) * one + np.sin(angle) * across)


def _fits(name: str, given: Any, dimension: int) -> None:
    if len(given) != dimension:
        raise ValueError(f"{name} must have {dimension} entries, one an axis; got {short(given)}")


def _listed(values: Any) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in values) + ")"
