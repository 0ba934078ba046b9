"""What joints between rigid bodies share."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, checked, of_kind, short, vector
from dmoc.basics.quaternions import AXES, conjugate, matrix_of, rotated, times, unit_quaternion
from dmoc.effects.base import Body
from dmoc.links.holonomic import Holonomic

IDENTITY = (1.0, 0.0, 0.0, 0.0)
# The room as a body: it stands at the origin, as the axes of space.
ROOM = Body(np.zeros(AXES), np.zeros(AXES), np.array(IDENTITY), np.eye(AXES), np.zeros(AXES))


@dataclass(frozen=True, kw_only=True)
class Joint(Holonomic):
    """A joint between two bodies, or between a body and the room.

    Parameters
    ----------
    anchor : sequence of float
        Where it sits on `to`, in body axes from the centre of mass of that, or in the room [m].
    at : sequence of float
        Where it sits on `on`, the same [m].
    on : str
        The name of the body that it carries, where there are several.
    to : str
        The name of the body that it sits on; the room if not given.
    attitude : sequence of 4 floats
        Unit quaternion of `on` seen from `to` where the joint is at zero.
    """

    anchor: Vector = (0.0, 0.0, 0.0)
    at: Vector = (0.0, 0.0, 0.0)
    on: str = ""
    to: str = ""
    attitude: Vector = IDENTITY
    joins_attitudes: ClassVar[bool] = True
    # How many numbers say where it is: an angle [rad] or a way [m]; 4 for a quaternion, 0 if it does not move.
    coordinates: ClassVar[int] = 0
    # How many controls a motor in it has.
    motors: ClassVar[int] = 0
    # The units of its coordinate, and of the rate of that.
    coordinate_units: ClassVar[tuple[str, str]] = ("rad", "rad/s")

    def __post_init__(self) -> None:
        name = type(self).__name__
        of_kind(f"{name}: on", self.on, str)
        of_kind(f"{name}: to", self.to, str)
        if self.to and self.on == self.to:
            raise ValueError(f"{name}: it joins {short(self.on)} to itself; `to` must name another body")
        for field in ("anchor", "at"):
            checked(self, **{field: three(f"{name}: {field}", getattr(self, field), "m")})
        checked(self, attitude=unit_quaternion(self.attitude))

    def check_dimension(self, dimension: int) -> None:
        if dimension != AXES:
            raise ValueError(
                f"{type(self).__name__} joins bodies in space; positions have {dimension} entries, not {AXES}"
            )

    def g(self, q: Any) -> Any:
        raise TypeError("a joint looks at two bodies: `g_of`")

    @property
    def holds(self) -> tuple[str, ...]:
        return (self.to, self.on) if self.to else (self.on,)

    @property
    def shown(self) -> bool:  # type: ignore[override]
        return self.coordinates == 1

    @property
    def name(self) -> str:
        """What its coordinate and its motor are called: by the body that it carries."""
        return self.on or "joint"

    # What it is for bodies of CasADi expressions.

    def ends(self, at: Mapping[str, Body]) -> tuple[Body, Body]:
        """The body that it sits on and the one that it carries."""
        return (at[self.to] if self.to else ROOM), at[self.on]

    def stretch(self, at: Mapping[str, Body]) -> Any:
        """The vector in space from the joint on the one body to that on the other [m]."""
        base, body = self.ends(at)
        return _point(body, self.at) - _point(base, self.anchor)

    def zero(self, at: Mapping[str, Body]) -> Any:
        """The attitude that the body which it carries has at zero."""
        return matrix_of(ca.SX(self.ends(at)[0].attitude)) @ ca.DM(self.attitude)

    def turn(self, at: Mapping[str, Body]) -> Any:
        """The quaternion of the body that it carries, seen from where it is at zero."""
        return matrix_of(self.zero(at)).T @ self.ends(at)[1].attitude

    def spin(self, at: Mapping[str, Body]) -> Any:
        """The rate of the body that it carries less that of the other, in the axes of the first [rad/s]."""
        base, body = self.ends(at)
        return body.rate - body.rotation.T @ (ca.SX(base.rotation) @ base.rate)

    def coordinate(self, at: Mapping[str, Body]) -> Any:
        """Its angle [rad] or its way [m]."""
        raise ValueError(f"{type(self).__name__} has neither an angle nor a way; use a Revolute or Prismatic")

    def rate(self, at: Mapping[str, Body]) -> Any:
        """The rate of its coordinate, or the turning of what it carries [rad/s], [m/s]."""
        raise ValueError(f"{type(self).__name__} does not move")

    def from_rest(self, at: Mapping[str, Body], rest: float) -> Any:
        """How far it is from where a spring in it is at rest [rad], [m]."""
        return self.coordinate(at) - rest

    def off(self, at: Mapping[str, Body], value: Any) -> Any:
        """By how much its coordinate is off a value: entries that are zero there and have slopes."""
        return self.coordinate(at) - value

    def driven(self, configuration: Any, q: Any, at: Mapping[str, Body], u: Any) -> Any:
        """The column of the size of q by which a motor in it acts, equal and opposite on both bodies."""
        raise ValueError(f"{type(self).__name__} cannot be driven")

    def _twisted(self, configuration: Any, q: Any, at: Mapping[str, Body], torque: Any) -> Any:
        """The column of a torque in the axes of the body that it carries, and its reaction [N m]."""
        base, body = self.ends(at)
        acts = configuration.on(self.on, q, None, torque)
        if self.to:
            acts = acts - configuration.on(self.to, q, None, base.rotation.T @ (body.rotation @ torque))
        return acts

    # What it is for states of bodies, arrays of one row a time.

    @abstractmethod
    def measured(self, base: Body, body: Body) -> np.ndarray:
        """Its coordinate, shape (count, coordinates)."""

    @abstractmethod
    def posed(self, base: Body, value: np.ndarray, rate: np.ndarray) -> Body:
        """The body that it carries, from the other body and from its own coordinate and rate."""

    def turned(self, base: Body, body: Body) -> np.ndarray:
        """`turn` of states."""
        return times(conjugate(times(base.attitude, self._zero_of(base))), body.attitude)

    def _zero_of(self, base: Body) -> np.ndarray:
        return np.broadcast_to(self.attitude, base.attitude.shape)

    def between(self, first: np.ndarray, last: np.ndarray, fractions: np.ndarray) -> np.ndarray:
        """Its coordinate on the way from one value to another."""
        return first + fractions[:, None] * (last - first)

    @property
    def goes_round(self) -> bool:
        return self.coordinates == 1 and self.coordinate_units[0] == "rad"

    def led(
        self, at: dict[str, Body], fractions: np.ndarray, other_way: bool = False
    ) -> dict[str, Body] | None:
        body = at[self.on]
        base = at[self.to] if self.to else room(len(fractions))
        values = self.measured(base, body)
        last = values[-1] - other_way * 2 * np.pi * np.sign(values[-1] - values[0])
        way = self.between(values[0], last, fractions)
        return {self.on: self.posed(base, way, np.zeros((len(way), self.motors)))}

    def lines(self, at: dict[str, Body]) -> list[np.ndarray]:
        body = at[self.on]
        pivot = body.position + rotated(body.attitude, np.broadcast_to(self.at, body.position.shape))
        bodies = [at[self.to], body] if self.to else [body]
        return [np.stack([one.position, pivot], axis=1) for one in bodies]

    def carried(
        self, base: Body, turn: np.ndarray, spin: np.ndarray, way: np.ndarray, pace: np.ndarray
    ) -> Body:
        """The body that it carries: turned from zero at a rate in its own axes, moved along a way in space."""
        turn = times(self._zero_of(base), turn)
        attitude = times(base.attitude, turn)
        rate = rotated(conjugate(turn), base.rate) + spin
        anchor, at = (np.broadcast_to(point, rate.shape) for point in (self.anchor, self.at))
        arm = rotated(base.attitude, anchor) + way
        swept = np.cross(rotated(base.attitude, base.rate), arm)
        place = base.position + arm - rotated(attitude, at)
        velocity = base.velocity + swept + pace - rotated(attitude, np.cross(rate, at))
        return Body(place, velocity, attitude, None, rate)

    def words(self) -> str:
        kind = type(self).__name__.lower()
        return f"{self.on or 'the body'} on a {kind} joint of {self.to or 'the room'}"


def room(count: int) -> Body:
    """The room at so many times."""
    none = np.zeros((count, AXES))
    return Body(none, none, np.tile(IDENTITY, (count, 1)), None, none)


def three(name: str, value: Any, unit: str) -> tuple[float, ...]:
    """A vector in space."""
    found = vector(name, value, unit)
    if len(found) != AXES:
        raise ValueError(f"{name} must have {AXES} entries [{unit}]; got {short(value)}")
    return found


def _point(body: Body, at: Any) -> Any:
    """A point of a body in space [m], for CasADi; of a point mass that itself."""
    if body.rotation is None:
        return body.position
    return body.position + (body.rotation @ ca.DM(at) if any(at) else 0)
