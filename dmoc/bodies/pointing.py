"""Limits on how a body is turned: cones that an axis of it must avoid or stay in, and a limit on its rate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, checked, number, short, vector
from dmoc.basics.digits import down, up
from dmoc.basics.quaternions import rotated
from dmoc.basics.records import dataclass
from dmoc.effects.base import Body
from dmoc.effects.user_functions import as_column, tried
from dmoc.parts.constraint import Constraint, checked_on
from dmoc.parts.rows import Row


class _OfAttitude(Constraint):
    """What limits on the attitude share."""

    turns_body: ClassVar[bool] = True
    moves_body: ClassVar[bool] = False

    def seen(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return q[:, -4:], v[:, -3:]


@dataclass(frozen=True)
class _Cone(_OfAttitude):
    """What limits on where an axis of the body points share; their docstrings say what the fields are."""

    axis: Vector
    direction: Vector | Callable
    angle: float
    on: str = ""
    unit: ClassVar[str] = "degrees"
    keeps_out: ClassVar[bool] = True

    def __post_init__(self) -> None:
        checked(
            self,
            axis=_unit("axis", self.axis),
            angle=number("angle", self.angle, "degrees", positive=True),
            on=checked_on(self),
        )
        if self.angle >= 180:
            raise ValueError(f"{type(self).__name__}: angle must be less than 180 degrees; got {self.angle:g}")
        if not callable(self.direction):
            checked(self, direction=_unit("direction", self.direction))
            return
        name = f"{type(self).__name__}: direction"
        remedy = "it must take a CasADi time [s] and give 3 numbers: write it with casadi's functions"
        if (count := tried(name, self.direction, [ca.SX.sym("t")], remedy)) != 3:
            raise ValueError(f"{name} must give 3 numbers; it gives {count}")

    @property
    def adjustable(self) -> tuple[str, ...]:  # type: ignore[override]
        return ("axis", "angle") if callable(self.direction) else ("axis", "direction", "angle")

    @property
    def structure(self) -> tuple:
        return type(self), self.direction if callable(self.direction) else None

    def _cosine(self, t: Any, body: Body) -> Any:
        """Cosine of the angle between the axis and the direction."""
        return ca.dot(body.rotation @ ca.vertcat(*_entries(self.axis)), self._toward(t))

    def _toward(self, t: Any) -> Any:
        if not callable(self.direction):
            return ca.vertcat(*_entries(self.direction))
        direction = as_column(self.direction(t))
        return direction / ca.sqrt(ca.dot(direction, direction))

    def angles(self, t: np.ndarray, attitude: np.ndarray) -> np.ndarray:
        """The angle between axis and direction at each time and attitude [degrees]."""
        axis = rotated(attitude, np.broadcast_to(np.asarray(self.axis, float), (len(attitude), 3)))
        toward = self._directions(t)
        return np.degrees(
            np.arctan2(np.linalg.norm(np.cross(axis, toward), axis=1), np.sum(axis * toward, axis=1))
        )

    def _directions(self, t: np.ndarray) -> np.ndarray:
        """The direction at each time, shape (count, 3)."""
        if not callable(self.direction):
            return np.broadcast_to(np.asarray(self.direction, float), (len(t), 3))
        time = ca.SX.sym("t")
        return ca.Function("toward", [time], [ca.densify(self._toward(time))])(t[None]).full().T

    def on_sphere(self, times: np.ndarray, points: int) -> tuple[bool, list[np.ndarray]]:
        turn, angle = np.linspace(0, 2 * np.pi, points)[:, None], np.radians(self.angle)
        rings = []
        for toward in self._directions(times if callable(self.direction) else times[:1]):
            aside = np.cross(toward, np.eye(3)[np.argmin(np.abs(toward))])
            aside /= np.linalg.norm(aside)
            across = np.cross(toward, aside)
            rings.append(
                np.cos(angle) * toward + np.sin(angle) * (np.cos(turn) * aside + np.sin(turn) * across)
            )
        return self.keeps_out, rings

    def excess(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return self.excess_at(np.zeros(len(q)), q, v)

    def feature_angle(self) -> float:
        return self.angle

    def violation(self, value: float, unit: str) -> tuple[float, str]:
        # A cosine that is off by this much, as an angle from the surface of the cone.
        return float(np.degrees(value / max(np.sin(np.radians(self.angle)), 1e-3))), "degrees"

    def _where(self) -> tuple[str, str]:
        toward = "a direction that moves" if callable(self.direction) else _listed(self.direction)
        return f"its axis {_listed(self.axis)}", toward


@dataclass(frozen=True)
class PointingKeepOut(_Cone):
    """Keep an axis of the body out of a cone about a direction, such as a camera away from the Sun.

    Parameters
    ----------
    axis : sequence of float
        Direction in body axes [-]; made a unit vector.
    direction : sequence of float, or function of the time
        Direction in space axes [-]; made a unit vector. A function takes a CasADi time [s].
    angle : float
        Half angle of the cone [degrees], more than 0 and less than 180.
    on : str
        The name of the body, where there are several.
    """

    def rows_of(self, t: Any, body: Body, u: Any, m: Any) -> list[Row]:
        return [Row("cosine", self._cosine(t, body) - ca.cos(self.angle * np.pi / 180), -np.inf, 0.0)]

    def excess_at(self, t: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.maximum(0.0, self.angle - self.angles(t, q))

    def eased(self, slack: float) -> PointingKeepOut | None:
        cosine = np.cos(np.radians(self.angle)) + slack
        return replace(self, angle=float(np.degrees(np.arccos(cosine)))) if cosine < 1 else None

    def needs(self, eased: Any, index: int, amount: str) -> str:
        enough = down(eased.angle)
        return f"pointing keep-out {index}{self.of_body} of at most {enough} degrees (you gave {self.angle:g})"

    def words(self) -> str:
        axis, toward = self._where()
        return f"keeps {axis} {self.angle:g} degrees away from {toward}"


@dataclass(frozen=True)
class PointingKeepIn(_Cone):
    """Keep an axis of the body inside a cone about a direction, such as an antenna on the Earth.

    Parameters
    ----------
    axis : sequence of float
        Direction in body axes [-]; made a unit vector.
    direction : sequence of float, or function of the time
        Direction in space axes [-]; made a unit vector. A function takes a CasADi time [s].
    angle : float
        Half angle of the cone [degrees], more than 0 and less than 180.
    on : str
        The name of the body, where there are several.
    """

    keeps_out: ClassVar[bool] = False

    def rows_of(self, t: Any, body: Body, u: Any, m: Any) -> list[Row]:
        return [Row("cosine", self._cosine(t, body) - ca.cos(self.angle * np.pi / 180), 0.0, np.inf)]

    def excess_at(self, t: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.maximum(0.0, self.angles(t, q) - self.angle)

    def eased(self, slack: float) -> PointingKeepIn | None:
        cosine = np.cos(np.radians(self.angle)) - slack
        return replace(self, angle=float(np.degrees(np.arccos(cosine)))) if cosine > -1 else None

    def needs(self, eased: Any, index: int, amount: str) -> str:
        enough = up(eased.angle)
        return f"pointing keep-in {index}{self.of_body} of at least {enough} degrees (you gave {self.angle:g})"

    def words(self) -> str:
        axis, toward = self._where()
        return f"keeps {axis} within {self.angle:g} degrees of {toward}"


@dataclass(frozen=True)
class RateLimit(_OfAttitude):
    """Turn no faster than a rate.

    Parameters
    ----------
    limit : float
        Largest angular rate [rad/s].
    on : str
        The name of the body, where there are several.
    """

    limit: float
    on: str = ""
    unit: ClassVar[str] = "rad/s"
    adjustable: ClassVar[tuple[str, ...]] = ("limit",)

    def __post_init__(self) -> None:
        limit = number("limit", self.limit, "rad/s", positive=True)
        checked(self, limit=limit, on=checked_on(self))

    @property
    def limits_speed(self) -> bool:
        return True

    def speed_rows_of(self, body: Body) -> list[Row]:
        # Between the nodes the interpolated quaternion is shorter than 1, and the rate with it.
        rate = body.rate / ca.dot(body.attitude, body.attitude)
        return [Row("rate", ca.dot(rate, rate) / self.limit**2, -np.inf, 1.0)]

    def excess(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.maximum(0.0, np.linalg.norm(v, axis=1) - self.limit)

    def words(self) -> str:
        return f"never turns faster than {self.limit:g} rad/s"

    def violation(self, value: float, unit: str) -> tuple[float, str]:
        return self.limit * (np.sqrt(1 + value) - 1), "rad/s"

    def largest_speed(self) -> float:
        return self.limit

    def times(self, factor: float) -> RateLimit:
        return replace(self, limit=factor * self.limit)

    def eased(self, slack: float) -> RateLimit:
        return self.times(float(np.sqrt(1 + slack)))

    def needs(self, eased: Constraint, index: int, amount: str) -> str:
        enough = up(eased.largest_speed() or 0.0)
        return f"a rate limit{self.of_body} of {enough} rad/s (you gave {self.limit:g} rad/s)"


def _unit(name: str, value: Any) -> tuple[float, ...]:
    found = np.array(vector(name, value, "-"))
    length = float(np.linalg.norm(found))
    if len(found) != 3 or length == 0:
        raise ValueError(f"{name} must be a direction of three numbers [-]; got {short(value)}")
    return tuple(float(x) for x in found / length)


def _entries(value: Any) -> list:
    """The entries of a vector that may be a symbol."""
    return ca.vertsplit(value) if isinstance(value, ca.SX) else list(value)


def _listed(values: Any) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in values) + ")"
