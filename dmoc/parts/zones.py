"""Constraints on the position: a box and a cone to stay in."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import (
    Vector,
    checked,
    endless_vector,
    matching_length,
    number,
    same_length,
    short,
    vector,
)
from dmoc.basics.digits import up
from dmoc.basics.records import dataclass
from dmoc.effects.user_functions import as_column, tried
from dmoc.parts.constraint import Constraint, checked_on, checked_point
from dmoc.parts.outline import Box, Cone, Shape
from dmoc.parts.rows import Row


@dataclass(frozen=True)
class KeepIn(Constraint):
    """Stay inside a box.

    Parameters
    ----------
    lower, upper : sequence of float
        Opposite corners [m]; entries may be -inf and inf.
    point : sequence of float, optional
        Of a body that turns, in body axes from the centre of mass [m]; that centre if not given.
    on : str
        The name of the body, where there are several.
    """

    lower: Vector
    upper: Vector
    point: Vector | None = None
    on: str = ""

    def __post_init__(self) -> None:
        checked(self, **{name: endless_vector(name, getattr(self, name), "m") for name in ("lower", "upper")})
        same_length("KeepIn", lower=self.lower, upper=self.upper)
        checked(self, point=checked_point(self, self.point), on=checked_on(self))
        for low, high in zip(self.lower, self.upper, strict=True):
            if low >= high:
                raise ValueError(
                    f"KeepIn: lower must be less than upper on every axis; got {low:g} and {high:g} m"
                )

    def check_dimension(self, dimension: int) -> None:
        matching_length(self, "lower", len(self.lower), dimension)

    @property
    def structure(self) -> tuple:
        # The walls for the centre are bounds, which may change; those for a point are built into its rows.
        return (type(self), *([] if self.point is None else [self.lower, self.upper]))

    @property
    def adjustable(self) -> tuple[str, ...]:  # type: ignore[override]
        return () if self.point is None else ("point",)

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        if self.point is not None:
            return super().bounds(dimension)
        return np.array(self.lower), np.array(self.upper)

    def rows(self, t: Any, q: Any, u: Any, m: Any) -> list[Row]:
        if self.point is None:
            return []
        walls = zip("xyz", ca.vertsplit(q), self.lower, self.upper, strict=True)
        return [
            Row(f"{side}_{axis}", place, low, high, "m")
            for axis, place, lower, upper in walls
            for side, low, high in (("lower", lower, np.inf), ("upper", -np.inf, upper))
            if np.isfinite([low, high]).any()
        ]

    def excess(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.maximum(0.0, np.maximum(self.lower - q, q - self.upper)).max(axis=1)

    def clearance(self, t: np.ndarray, q: np.ndarray) -> np.ndarray:
        return np.minimum(q - self.lower, np.asarray(self.upper) - q).min(axis=1)

    def eased(self, slack: float) -> KeepIn:
        return replace(self, lower=np.subtract(self.lower, slack), upper=np.add(self.upper, slack))

    def words(self) -> str:
        return f"stays between {_place(self.lower)} and {_place(self.upper)}{self.of_point}"

    def outline(self) -> tuple[Shape, ...]:
        return (Box(np.array(self.lower), np.array(self.upper)),)


@dataclass(frozen=True)
class ApproachCone(Constraint):
    """Stay inside a cone: axis . d >= cos(half_angle) |d| with d the position from the apex.

    In the plane these are two straight lines. In space |d| is rounded over `rounding` at the apex,
    where it has no derivative; the apex itself is allowed. That makes it wider by rounding / tan(half_angle).

    Parameters
    ----------
    apex : sequence of float, or function of the time
        Tip of the cone [m]. A function takes a CasADi time [s], as of a target that moves.
    axis : sequence of float, or function of the time
        Direction from the tip into the cone [-]; made a unit vector.
    half_angle : float
        Between the axis and the surface [rad], less than pi/2.
    rounding : float
        [m].
    point : sequence of float, optional
        Of a body that turns, in body axes from the centre of mass [m]; that centre if not given.
    on : str
        The name of the body, where there are several.
    """

    # A vector, or a function of the time.
    apex: Any
    axis: Any
    half_angle: float
    rounding: float = 1e-6
    point: Vector | None = None
    on: str = ""

    def __post_init__(self) -> None:
        for name in ("apex", "axis"):
            if callable(part := getattr(self, name)):
                tried(f"ApproachCone: {name}", part, [ca.SX.sym("t")], "it must take a CasADi time [s]")
            elif self.moves:
                vector(name, part, "m" if name == "apex" else "-")
        apex, axis = self._at(ca.SX.sym("t")) if self.moves else (self.apex, self.axis)
        if not self.moves:
            apex, axis = vector("apex", self.apex, "m"), vector("axis", self.axis, "-")
            same_length("ApproachCone", apex=apex, axis=axis)
            length = float(np.linalg.norm(axis))
            if len(axis) == 1 or length == 0:
                raise ValueError(
                    f"ApproachCone: axis must be a direction in 2 or 3 dimensions; got {short(self.axis)}"
                )
            checked(self, apex=apex, axis=tuple(x / length for x in axis))
        elif not 2 <= apex.numel() == axis.numel() <= 3:
            raise ValueError(
                "ApproachCone: apex and axis must have the same 2 or 3 entries; "
                f"got {apex.numel()} and {axis.numel()}"
            )
        half_angle = number("half_angle", self.half_angle, "rad", positive=True)
        if half_angle >= np.pi / 2:
            raise ValueError(f"ApproachCone: half_angle must be less than pi/2 rad; got {half_angle:g}")
        checked(
            self,
            half_angle=half_angle,
            rounding=number("rounding", self.rounding, "m", positive=True),
            point=checked_point(self, self.point),
            on=checked_on(self),
        )

    @property
    def moves(self) -> bool:
        """Whether its apex or its axis is a function of the time."""
        return callable(self.apex) or callable(self.axis)

    @property
    def adjustable(self) -> tuple[str, ...]:  # type: ignore[override]
        fixed = () if self.moves else ("apex", "axis")
        return (*fixed, "half_angle", "rounding", *(() if self.point is None else ("point",)))

    @property
    def structure(self) -> tuple:
        return (*super().structure, *((self.apex, self.axis) if self.moves else ()))

    def _at(self, t: Any) -> tuple[Any, Any]:
        """Apex and unit axis at a time, for CasADi."""
        apex, axis = (
            ca.SX(as_column(part(t))) if callable(part) else ca.SX(ca.DM(part))
            for part in (self.apex, self.axis)
        )
        return apex, axis / ca.sqrt(ca.dot(axis, axis))

    @property
    def _dimension(self) -> int:
        return self._at(ca.SX.sym("t"))[0].numel() if self.moves else len(self.apex)

    def check_dimension(self, dimension: int) -> None:
        matching_length(self, "apex", self._dimension, dimension)

    def rows(self, t: Any, q: Any, u: Any, m: Any) -> list[Row]:
        apex, axis = self._at(t) if self.moves else (self.apex, self.axis)
        offset = q - apex
        depth = ca.dot(offset, axis)
        cos, sin = ca.cos(self.half_angle), ca.sin(self.half_angle)
        if q.shape[0] == 2:
            side = cos * ca.det(ca.horzcat(ca.vertcat(axis[0], axis[1]), offset))
            lines = {"left": sin * depth - side, "right": sin * depth + side}
            return [Row(name, inward, 0.0, np.inf, "m") for name, inward in lines.items()]
        # The rounding is taken off again, so that the tip itself, with a distance of 0 m, is allowed.
        distance = ca.sqrt(ca.dot(offset, offset) + self.rounding**2) - self.rounding
        return [Row("cone", depth - cos * distance, 0.0, np.inf, "m")]

    def excess(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return self.excess_at(np.zeros(len(q)), q, v)

    def excess_at(self, t: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        # Rounded, the cone is wider by so much, which is no fault of the path.
        wider = self.rounding / np.tan(self.half_angle) if q.shape[1] == 3 else 0.0
        return np.maximum(0.0, -self.clearance(t, q) - wider)

    def clearance(self, t: np.ndarray, q: np.ndarray) -> np.ndarray:
        offset, axis = self._offset_at(t, q)
        depth = np.sum(offset * axis, axis=1)
        aside = np.linalg.norm(offset - depth[:, None] * axis, axis=1)
        # The distance from the surface is |d| sin(angle from it); where no foot of it is nearer, |d| itself.
        beyond = np.arctan2(aside, depth) - self.half_angle
        return -np.linalg.norm(offset, axis=1) * np.sin(np.clip(beyond, -np.pi / 2, np.pi / 2))

    def _offset_at(self, t: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places from the tip, and the unit axis, at times."""
        apex, axis = np.asarray(self.apex), np.asarray(self.axis)
        if self.moves:
            time = ca.SX.sym("t")
            moved = ca.Function("cone", [time], list(map(ca.densify, self._at(time))))(t[None])
            apex, axis = (part.full().T for part in moved)
        return q - apex, axis

    def weights(self, t: np.ndarray, q: np.ndarray) -> np.ndarray:
        # In proportion to the distance from the tip, the rows give way by an angle.
        return np.linalg.norm(self._offset_at(t, q)[0], axis=1)

    def eased(self, slack: float) -> ApproachCone | None:
        # With d the distance and a the angle off the axis: d sin(half_angle - a) >= -slack d in the plane,
        # d cos(a) >= (cos(half_angle) - slack) d in space.
        half, plane = self.half_angle, self._dimension == 2
        half = half + np.arcsin(min(slack, 1.0)) if plane else np.arccos(max(np.cos(half) - slack, -1.0))
        return replace(self, half_angle=float(half)) if half < np.pi / 2 else None

    def needs(self, eased: Any, index: int, amount: str) -> str:
        half = up(eased.half_angle)
        enough = f"at least {half} rad half angle, {np.degrees(float(half)):.4g} degrees"
        return f"approach cone {index}{self.of_body} of {enough} (you gave {self.half_angle:.4g} rad)"

    def words(self) -> str:
        angle = np.degrees(self.half_angle)
        if self.moves:
            return f"stays in a cone of half angle {angle:g} degrees that moves{self.of_point}"
        where = f"from {_place(self.apex)} along {_numbers(self.axis)}"
        return f"stays in the cone of half angle {angle:g} degrees {where}{self.of_point}"

    def outline(self) -> tuple[Shape, ...]:
        # One that moves has no one place in a picture of the whole way.
        return () if self.moves else (Cone(np.array(self.apex), np.array(self.axis), self.half_angle),)


def _place(values: Vector) -> str:
    return f"{_numbers(values)} m"


def _numbers(values: Vector) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"
