"""Where a body that turns starts and ends: its attitude and rate, with or without a position and velocity."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.basics.arguments import FreeVector, Vector, checked, flag, number, short, vector
from dmoc.basics.quaternions import AXES, QUATERNION, rotation_vectors, unit_quaternion
from dmoc.basics.records import dataclass
from dmoc.ends.base import Boundary, State


def rotation(axis: Vector, degrees: float) -> tuple[float, float, float, float]:
    """The unit quaternion, scalar first, of a turn about an axis.

    Parameters
    ----------
    axis : sequence of float
        Direction of three entries [-]; made a unit vector.
    degrees : float
        Angle of the turn [degrees], right-handed about the axis.

    Raises
    ------
    ValueError
        If the axis is no direction in space.
    """
    direction = np.array(vector("axis", axis, "-"))
    length = float(np.linalg.norm(direction))
    if len(direction) != AXES or length == 0:
        raise ValueError(f"axis must be a direction of three numbers [-]; got {short(axis)}")
    half = np.radians(number("degrees", degrees, "degrees")) / 2
    x, y, z = np.sin(half) * direction / length
    return float(np.cos(half)), float(x), float(y), float(z)


class Turning(Boundary):
    """A boundary with an attitude: the fields and methods that `Attitude` and `Pose` share.

    `quaternion` is None where the attitude is free, and `other_way` says that the goal is reached by the turn
    that goes the other way round.
    """

    other_way: bool = False

    @property
    def dimension(self) -> int:
        return AXES

    @property
    def turns_body(self) -> bool:
        return True

    @property
    @abstractmethod
    def _attitude(self) -> np.ndarray:
        """Unit quaternion; NaN where it is free."""

    def oriented(self, start: Boundary) -> Turning:
        """The same goal with the sign of its quaternion that the turn from a start leads to.

        q and -q are one attitude; the shorter way from the start ends at the one with q_start . q >= 0.
        """
        known = getattr(start, "_attitude", np.full(QUATERNION, np.nan))
        along = float(known @ self._attitude)
        if np.isnan(along) or (along < 0) == self.other_way:
            return self
        return self._opposite()

    @abstractmethod
    def _opposite(self) -> Turning:
        """The same with the other sign of its quaternion."""

    def the_other_way(self) -> Turning:
        """The same goal, reached the other way round."""
        return replace(self._opposite(), other_way=not self.other_way)  # type: ignore[type-var]


@dataclass(frozen=True)
class Attitude(Turning):
    """An attitude and an angular rate alone: the position of the body is left out of the problem.

    Where the other end has a position, this one leaves position and velocity free.

    Parameters
    ----------
    quaternion : sequence of 4 floats or None
        Unit quaternion from body axes to space axes, scalar first [-]; None frees it. See `rotation`.
    rate : sequence of float or None
        Angular rate in body axes [rad/s]. An entry that is None is free; None alone frees all three.
    other_way : bool
        Of a goal: reach it by the longer turn from the start, the other way round.
    """

    quaternion: Vector | None
    rate: FreeVector = (0.0, 0.0, 0.0)
    other_way: bool = False

    def __post_init__(self) -> None:
        checked(self, quaternion=_quaternion(self.quaternion), rate=_rate(self.rate))
        checked(self, other_way=flag("other_way", self.other_way))
        if self.quaternion is None and all(entry is None for entry in self.rate or ()):
            raise ValueError("Attitude: quaternion and rate are both None; fix at least one of them")

    @property
    def has_position(self) -> bool:
        return False

    @property
    def _attitude(self) -> np.ndarray:
        return _known(self.quaternion)

    def _opposite(self) -> Attitude:
        return replace(self, quaternion=tuple(-x for x in self.quaternion or ()) or None)

    def fixed(self) -> tuple[np.ndarray, np.ndarray]:
        return self._attitude, np.array(self.rate, float)

    def words(self) -> str:
        return f"{_attitude_words(self._attitude)}, rate {_listed(self.rate)} rad/s"


@dataclass(frozen=True)
class Pose(Turning):
    """A position, a velocity, an attitude and an angular rate; entries that are None are free.

    The other end may also be a `State` or an orbit, where attitude and rate are free, or an `Attitude`, where
    position and velocity are.

    Parameters
    ----------
    position : sequence of float or None
        Of the centre of mass, in space axes [m]; None frees all three entries.
    velocity : sequence of float or None
        Of the centre of mass, in space axes [m/s]; None frees all three entries.
    attitude : sequence of 4 floats or None
        Unit quaternion from body axes to space axes, scalar first [-]; None frees it. See `rotation`.
    rate : sequence of float or None
        Angular rate in body axes [rad/s].
    other_way : bool
        Of a goal: reach its attitude by the longer turn from the start, the other way round.
    """

    position: FreeVector
    velocity: FreeVector = (0.0, 0.0, 0.0)
    attitude: Vector | None = (1.0, 0.0, 0.0, 0.0)
    rate: FreeVector = (0.0, 0.0, 0.0)
    other_way: bool = False

    def __post_init__(self) -> None:
        free = (None,) * AXES
        position, velocity = (free if part is None else part for part in (self.position, self.velocity))
        state = State(position, velocity)
        if state.dimension != AXES:
            raise ValueError(
                f"Pose: position must have three entries [m], one an axis of space; got {short(self.position)}"
            )
        checked(
            self,
            position=state.position,
            velocity=state.velocity,
            attitude=_quaternion(self.attitude),
            rate=_rate(self.rate),
            other_way=flag("other_way", self.other_way),
        )

    @property
    def _attitude(self) -> np.ndarray:
        return _known(self.attitude)

    def _opposite(self) -> Pose:
        return replace(self, attitude=tuple(-x for x in self.attitude or ()) or None)

    @property
    def point(self) -> State:
        return State(self.position, self.velocity)

    @property
    def anchored(self) -> bool:
        return self.point.anchored

    def fixed(self) -> tuple[np.ndarray, np.ndarray]:
        position = np.concatenate([np.array(self.position, float), self._attitude])
        return position, np.concatenate([np.array(self.velocity, float), np.array(self.rate, float)])

    def words(self) -> str:
        return f"{self.point.words()}, {_attitude_words(self._attitude)}, rate {_listed(self.rate)} rad/s"


def _quaternion(value: Any) -> tuple[float, ...] | None:
    """A unit quaternion, or None for a free one."""
    if value is None:
        return None
    return unit_quaternion(value)


def _rate(value: Any) -> tuple[float | None, ...]:
    rate = vector("rate", (None,) * AXES if value is None else value, "rad/s", free=True)
    if len(rate) != AXES:
        raise ValueError(f"rate must have three entries in body axes [rad/s]; got {short(value)}")
    return rate


def _known(quaternion: Any) -> np.ndarray:
    return np.full(QUATERNION, np.nan) if quaternion is None else np.array(quaternion, float)


def _attitude_words(attitude: np.ndarray) -> str:
    if np.isnan(attitude).any():
        return "any attitude"
    vector = rotation_vectors(attitude)
    angle = float(np.linalg.norm(vector))
    if angle == 0:
        return "attitude as the space axes"
    return f"turned by {np.degrees(angle):.6g} degrees about {_listed(np.round(vector / angle, 6))}"


def _listed(values: Any) -> str:
    return "(" + ", ".join("free" if value is None else f"{value:g}" for value in values) + ")"
