"""Torques, and wrenches of a force and a torque."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, checked, limits, number, short, times_each
from dmoc.basics.quaternions import AXES
from dmoc.parts.actuator import Actuator, limit_told


class OnBody(Actuator):
    """What actuators of rigid bodies share: their controls, squared and added up, are their effort."""

    turns_body: ClassVar[bool] = True
    moves_body: ClassVar[bool] = False

    def effort(self, u: Any) -> Any:
        return ca.dot(u, u)


class PureTorque(OnBody):
    """What actuators share whose controls are a torque in body axes."""

    effort_unit: ClassVar[str] = "N^2 m^2 s"
    meter_unit: ClassVar[str] = "N m s"
    limit: float | Vector | None

    def size(self, dimension: int) -> int:
        return AXES

    def labels(self, dimension: int) -> tuple[str, ...]:
        return ("tx", "ty", "tz")

    def units(self, dimension: int) -> tuple[str, ...]:
        return ("N m",) * self.size(dimension)

    def force(self, u: Any) -> Any:
        return u

    def wrench(self, rotation: Any, u: Any) -> tuple[Any, Any]:
        return None, self.force(u)

    @property
    def limit_words(self) -> str:
        return "torque limit"

    @property
    def limit_unit(self) -> str:
        return "N m"

    def needs(self, eased: Actuator) -> str:
        given = 0.0 if self.limit is None else self.limit
        factor = (eased.torque_limit() or 0.0) / (self.torque_limit() or 1.0)
        return limit_told("torque limit", given, factor, "N m")

    def violation(self, value: float, unit: str) -> tuple[float, str]:
        return value * (self.torque_limit() or 1.0), "N m"


@dataclass(frozen=True)
class Torque(PureTorque):
    """A torque in body axes, about the centre of mass: |tau_i| <= limit_i, or without a limit.

    Parameters
    ----------
    limit : float or sequence of float, optional
        Largest torque [N m], one number or one for each body axis; none if not given.
    """

    limit: float | Vector | None = None

    def __post_init__(self) -> None:
        if self.limit is not None:
            checked(self, limit=_three("Torque: limit", self.limit, "N m"))

    @property
    def structure(self) -> tuple:
        return type(self), self.limit is None

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        limit = np.broadcast_to(np.inf if self.limit is None else np.asarray(self.limit), (AXES,)).astype(float)
        return -limit, limit

    def torque_limit(self) -> float | None:
        return None if self.limit is None else float(np.max(self.limit))

    def times(self, factor: float) -> Torque:
        return self if self.limit is None else replace(self, limit=times_each(self.limit, factor))

    def metered(self, dimension: int) -> Actuator:
        raise ValueError(
            "least fuel with Torque counts no magnitude; use BallTorque(limit), of which the integral of the "
            "magnitude is then least"
        )

    def unlimited(self) -> Actuator:
        return Torque()

    def share(self, u: np.ndarray) -> float:
        return 0.0 if self.limit is None else float((np.abs(u) / np.asarray(self.limit)).max(initial=0.0))

    def words(self) -> str:
        limit = "without a limit" if self.limit is None else f"of at most {_listed(self.limit)} N m about each"
        return f"a torque in body axes, {limit}"


@dataclass(frozen=True, init=False)
class Wrench(OnBody):
    """A force through the centre of mass and a torque, both in body axes.

    Parameters
    ----------
    force_limit : float or sequence of float, optional
        Largest force [N], one number or one for each axis; none if not given.
    torque_limit : float or sequence of float, optional
        Largest torque [N m], the same.
    frame : "body" or "space"
        The axes of the force; the torque is in body axes.
    lever : float
        The effort counts a torque as the force at this distance [m]: it integrates |F|^2 + |tau|^2 / lever^2.
    """

    most_force: float | Vector | None = None
    most_torque: float | Vector | None = None
    frame: str = "body"
    lever: float = 1.0
    moves_body: ClassVar[bool] = True
    effort_unit: ClassVar[str] = "N^2 s"

    def __init__(
        self,
        force_limit: float | Vector | None = None,
        torque_limit: float | Vector | None = None,
        frame: str = "body",
        lever: float = 1.0,
    ):
        checked(self, most_force=force_limit, most_torque=torque_limit, frame=frame)
        checked(self, lever=number("lever", lever, "m", positive=True))
        if self.most_force is not None:
            checked(self, most_force=_three("Wrench: force limit", self.most_force, "N"))
        if self.most_torque is not None:
            checked(self, most_torque=_three("Wrench: torque limit", self.most_torque, "N m"))
        if self.frame not in ("body", "space"):
            raise ValueError(f"Wrench: frame must be 'body' or 'space'; got {short(self.frame)}")

    @property
    def structure(self) -> tuple:
        return type(self), self.frame, self.lever

    def size(self, dimension: int) -> int:
        return 2 * AXES

    def labels(self, dimension: int) -> tuple[str, ...]:
        return ("fx", "fy", "fz", "tx", "ty", "tz")

    def units(self, dimension: int) -> tuple[str, ...]:
        return ("N",) * AXES + ("N m",) * AXES

    def force(self, u: Any) -> Any:
        return u[:AXES]

    def wrench(self, rotation: Any, u: Any) -> tuple[Any, Any]:
        return (u[:AXES] if self.frame == "space" else rotation @ u[:AXES]), u[AXES:]

    def effort(self, u: Any) -> Any:
        return ca.dot(u[:AXES], u[:AXES]) + ca.dot(u[AXES:], u[AXES:]) / self.lever**2

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        sides = [
            np.broadcast_to(np.inf if side is None else np.asarray(side), (AXES,)).astype(float)
            for side in (self.most_force, self.most_torque)
        ]
        limit = np.concatenate(sides)
        return -limit, limit

    def force_limit(self) -> float | None:
        return None if self.most_force is None else float(np.max(self.most_force))

    def torque_limit(self) -> float | None:
        return None if self.most_torque is None else float(np.max(self.most_torque))

    def times(self, factor: float) -> Wrench:
        force, torque = (
            None if bound is None else times_each(bound, factor)
            for bound in (self.most_force, self.most_torque)
        )
        return Wrench(force, torque, self.frame, self.lever)

    @property
    def limit_words(self) -> str:
        return "force and torque limit"

    def needs(self, eased: Actuator) -> str:
        factor = (eased.main_limit() or 0.0) / (self.main_limit() or 1.0)
        pairs = ((self.most_force, "force limit", "N"), (self.most_torque, "torque limit", "N m"))
        told = (limit_told(name, given, factor, unit) for given, name, unit in pairs if given is not None)
        return " and ".join(told)

    def unlimited(self) -> Actuator:
        return Wrench(frame=self.frame, lever=self.lever)

    def excess(self, u: np.ndarray) -> np.ndarray:
        _, upper = self.bounds(AXES)
        # Torques count in the unit of the force, each over its own limit.
        over = np.maximum(0.0, np.abs(u) / upper - 1) * (self.main_limit() or 0.0)
        return np.nan_to_num(over).max(axis=1, initial=0.0)

    def share(self, u: np.ndarray) -> float:
        _, upper = self.bounds(AXES)
        return float((np.abs(u) / upper).max(initial=0.0))

    def words(self) -> str:
        parts = [
            f"{name} {'without a limit' if bound is None else f'of at most {_listed(bound)} {unit}'}"
            for name, bound, unit in (("a force", self.most_force, "N"), ("a torque", self.most_torque, "N m"))
        ]
        return f"{' and '.join(parts)}, the force in {self.frame} axes"


def _three(name: str, value: Any, unit: str) -> float | tuple:
    found = limits(name, value, unit)
    if isinstance(found, tuple) and len(found) != AXES:
        raise ValueError(f"{name} must be one number or three, one a body axis [{unit}]; got {short(value)}")
    return found


def _listed(value: Any) -> str:
    return f"({', '.join(f'{x:g}' for x in value)})" if isinstance(value, tuple) else f"{value:g}"
