"""Joints between rigid bodies: ball joints, hinges, slides and welds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, checked, short
from dmoc.basics.quaternions import AXES, columns_of, rotated, rotation_of, slerp, turned_by
from dmoc.basics.records import dataclass
from dmoc.effects.base import Body
from dmoc.links.joint import IDENTITY, Joint, three


@dataclass(frozen=True)
class Spherical(Joint):
    """A ball joint: a point of one body stays on a point of another, or of the room.

    Its parameters are those of every `Joint`: `anchor`, `at` [m], `on`, `to` and `attitude`, all by name.
    """

    coordinates: ClassVar[int] = 4
    motors: ClassVar[int] = 3

    @property
    def row_units(self) -> tuple[str, ...]:
        return ("m",) * AXES

    def g_of(self, at: Mapping[str, Body]) -> Any:
        return self.stretch(at)

    def rate(self, at: Mapping[str, Body]) -> Any:
        return self.spin(at)

    def off(self, at: Mapping[str, Body], value: Any) -> Any:
        return 2 * columns_of(ca.vertcat(value) if isinstance(value, ca.SX) else ca.DM(value)).T @ self.turn(at)

    def driven(self, configuration: Any, q: Any, at: Mapping[str, Body], u: Any) -> Any:
        return self._twisted(configuration, q, at, u)

    def measured(self, base: Body, body: Body) -> np.ndarray:
        return self.turned(base, body)

    def posed(self, base: Body, value: np.ndarray, rate: np.ndarray) -> Body:
        return self.carried(base, value, rate, np.zeros_like(rate), np.zeros_like(rate))

    def between(self, first: np.ndarray, last: np.ndarray, fractions: np.ndarray) -> np.ndarray:
        return slerp(first, last, fractions)


@dataclass(frozen=True)
class Fixed(Joint):
    """A weld: one body does not move against another, or against the room.

    Its parameters are those of every `Joint`: `anchor`, `at` [m], `on`, `to` and `attitude`, all by name.
    """

    @property
    def row_units(self) -> tuple[str, ...]:
        return ("m",) * AXES + ("rad",) * AXES

    def g_of(self, at: Mapping[str, Body]) -> Any:
        return ca.vertcat(self.stretch(at), 2 * self.turn(at)[1:])

    def measured(self, base: Body, body: Body) -> np.ndarray:
        return np.sign(self.turned(base, body)[:, :1])

    def posed(self, base: Body, value: np.ndarray, rate: np.ndarray) -> Body:
        still = np.zeros_like(base.position)
        turn = np.hstack([np.where(value < 0, -1.0, 1.0) * np.ones((len(still), 1)), still])
        return self.carried(base, turn, still, still, still)


@dataclass(frozen=True)
class _Axial(Joint):
    """What hinges and slides share: an axis, in the axes of the body that they sit on."""

    axis: Vector
    motors: ClassVar[int] = 1
    coordinates: ClassVar[int] = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        name = f"{type(self).__name__}: axis"
        axis = np.array(three(name, self.axis, "-"))
        if not np.linalg.norm(axis):
            raise ValueError(f"{name} must be a direction [-]; got {short(self.axis)}")
        checked(self, axis=tuple((axis / np.linalg.norm(axis)).tolist()))

    @property
    def _own(self) -> np.ndarray:
        """The axis in the axes of the body that it carries."""
        turned = np.array(ca.DM(rotation_of(ca.DM(self.attitude))))
        return turned.T @ np.array(self.axis)


@dataclass(frozen=True)
class Revolute(_Axial):
    """A hinge: one body turns against another, or against the room, about an axis through the joint.

    Its angle counts from -360 to 360 degrees, right-handed about the axis.

    Parameters
    ----------
    axis : sequence of float
        Direction in the body axes of `to`, or of space in the room [-]; made a unit vector. All others are
        those of every `Joint`, by name: `anchor`, `at` [m], `on`, `to` and `attitude`.
    """

    @property
    def row_units(self) -> tuple[str, ...]:
        return ("m",) * AXES + ("rad",) * 2

    def g_of(self, at: Mapping[str, Body]) -> Any:
        # What is left of the turn across the axis; its slope has full rank at every angle.
        return ca.vertcat(self.stretch(at), 2 * ca.DM(_across(self._own)) @ self.turn(at)[1:])

    def coordinate(self, at: Mapping[str, Body]) -> Any:
        turn = self.turn(at)
        return 2 * ca.atan2(ca.DM(self._own).T @ turn[1:], turn[0])

    def rate(self, at: Mapping[str, Body]) -> Any:
        return ca.DM(self._own).T @ self.spin(at)

    def off(self, at: Mapping[str, Body], value: Any) -> Any:
        # Twice the sine of half of what is left, which has no jumps.
        turn, half = self.turn(at), 0.5 * value
        return 2 * (ca.cos(half) * (ca.DM(self._own).T @ turn[1:]) - ca.sin(half) * turn[0])

    def driven(self, configuration: Any, q: Any, at: Mapping[str, Body], u: Any) -> Any:
        acts = configuration.on(self.on, q, None, ca.DM(self._own) * u)
        return acts - configuration.on(self.to, q, None, ca.DM(self.axis) * u) if self.to else acts

    def measured(self, base: Body, body: Body) -> np.ndarray:
        turn = self.turned(base, body)
        return 2 * np.arctan2(turn[:, 1:] @ self._own, turn[:, 0])[:, None]

    def posed(self, base: Body, value: np.ndarray, rate: np.ndarray) -> Body:
        still = np.zeros_like(base.position)
        # A turn by more than 180 degrees keeps the sign that leads there.
        turn = turned_by(value * self._own)
        return self.carried(base, turn, rate * self._own, still, still)


@dataclass(frozen=True)
class Prismatic(_Axial):
    """A slide: one body moves along an axis of another, or of the room, without a turn.

    Parameters
    ----------
    axis : sequence of float
        Direction in the body axes of `to`, or of space in the room [-]; made a unit vector. All others are
        those of every `Joint`, by name: `anchor`, `at` [m], `on`, `to` and `attitude`.
    """

    coordinate_units: ClassVar[tuple[str, str]] = ("m", "m/s")

    @property
    def row_units(self) -> tuple[str, ...]:
        return ("m",) * 2 + ("rad",) * AXES

    def _on_base(self, at: Mapping[str, Body]) -> Any:
        """How far it has slid, in the axes of the body that it sits on [m]."""
        return ca.SX(self.ends(at)[0].rotation).T @ self.stretch(at)

    def g_of(self, at: Mapping[str, Body]) -> Any:
        return ca.vertcat(ca.DM(_across(np.array(self.axis))) @ self._on_base(at), 2 * self.turn(at)[1:])

    def coordinate(self, at: Mapping[str, Body]) -> Any:
        return ca.DM(self.axis).T @ self._on_base(at)

    def rate(self, at: Mapping[str, Body]) -> Any:
        base, body = self.ends(at)
        axes = ca.SX(base.rotation).T
        moves = axes @ (body.velocity + body.rotation @ ca.cross(body.rate, ca.DM(self.at)) - base.velocity)
        # The way along the axis adds nothing to what the turn of the other body takes along the axis.
        return ca.DM(self.axis).T @ (moves - ca.cross(ca.SX(base.rate), ca.DM(self.anchor)))

    def driven(self, configuration: Any, q: Any, at: Mapping[str, Body], u: Any) -> Any:
        base, body = self.ends(at)
        push = ca.SX(base.rotation) @ ca.DM(self.axis) * u
        acts = configuration.on(self.on, q, push, ca.cross(ca.DM(self.at), body.rotation.T @ push))
        if not self.to:
            return acts
        # The reaction acts along the line through the anchor.
        return acts - configuration.on(self.to, q, push, ca.cross(ca.DM(self.anchor), ca.DM(self.axis) * u))

    def measured(self, base: Body, body: Body) -> np.ndarray:
        at, anchor = (np.broadcast_to(point, body.position.shape) for point in (self.at, self.anchor))
        slid = body.position + rotated(body.attitude, at) - base.position - rotated(base.attitude, anchor)
        return np.sum(slid * rotated(base.attitude, np.broadcast_to(self.axis, slid.shape)), axis=1)[:, None]

    def posed(self, base: Body, value: np.ndarray, rate: np.ndarray) -> Body:
        axis = rotated(base.attitude, np.broadcast_to(self.axis, base.position.shape))
        unturned = np.tile(IDENTITY, (len(axis), 1))
        return self.carried(base, unturned, 0 * axis, value * axis, rate * axis)


def _across(axis: np.ndarray) -> np.ndarray:
    """Two directions across an axis, shape (2, 3)."""
    return np.linalg.svd(axis[None])[2][1:]
