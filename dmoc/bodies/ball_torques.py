"""Torques of limited magnitude, and the same with the magnitude among the controls."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import checked, number
from dmoc.basics.records import dataclass
from dmoc.bodies.torques import PureTorque, Torque
from dmoc.parts.actuator import Actuator
from dmoc.parts.rows import Row


@dataclass(frozen=True)
class BallTorque(PureTorque):
    """A torque of limited magnitude about any axis, about the centre of mass: |tau| <= limit.

    `Torque` limits it about each body axis instead. With `Fuel` the integral of |tau| is least [N m s].

    Parameters
    ----------
    limit : float
        Largest torque [N m].
    """

    limit: float
    adjustable: ClassVar[tuple[str, ...]] = ("limit",)

    def __post_init__(self) -> None:
        checked(self, limit=number("BallTorque: limit", self.limit, "N m", positive=True))

    def rows(self, u: Any) -> list[Row]:
        return [Row("magnitude", ca.dot(u, u) / self.limit**2, -np.inf, 1.0)]

    def metered(self, dimension: int) -> Actuator:
        return MeteredTorque(self.limit)

    def torque_limit(self) -> float:
        return self.limit

    def times(self, factor: float) -> BallTorque:
        return BallTorque(factor * self.limit)

    def eased(self, slack: float) -> BallTorque:
        # The row is |tau|^2 / limit^2 <= 1 + slack, so the limit on |tau| grows by the root.
        return self.times(float(np.sqrt(1 + slack)))

    def unlimited(self) -> Actuator:
        return Torque()

    def share(self, u: np.ndarray) -> float:
        return float(np.linalg.norm(u, axis=1).max(initial=0.0)) / self.limit

    def violation(self, value: float, unit: str) -> tuple[float, str]:
        return self.limit * (np.sqrt(1 + value) - 1), "N m"

    def excess(self, u: np.ndarray) -> np.ndarray:
        return np.maximum(0.0, np.linalg.norm(u, axis=1) - self.limit)

    def words(self) -> str:
        return f"a torque in body axes, about any axis of at most {self.limit:g} N m"


@dataclass(frozen=True)
class MeteredTorque(PureTorque):
    """A torque of limited magnitude whose magnitude is a control, too: what `BallTorque` is with `Fuel`.

    As for `Engine`, sqrt(|tau|^2 + eps^2) is that control, with eps = smoothing * limit.

    Parameters
    ----------
    limit : float
        Largest torque [N m].
    smoothing : float
        Width of the rounding of |tau| at zero, relative to the limit [-].
    """

    limit: float
    smoothing: float = 1e-5
    coasts: ClassVar[bool] = True
    adjustable: ClassVar[tuple[str, ...]] = ("limit", "smoothing")

    def __post_init__(self) -> None:
        checked(
            self,
            limit=number("MeteredTorque: limit", self.limit, "N m", positive=True),
            smoothing=number("smoothing", self.smoothing, "-", positive=True),
        )

    def size(self, dimension: int) -> int:
        return super().size(dimension) + 1

    def labels(self, dimension: int) -> tuple[str, ...]:
        return (*super().labels(dimension), "magnitude")

    def force(self, u: Any) -> Any:
        return u[:-1]

    def effort(self, u: Any) -> Any:
        torque = self.force(u)
        return ca.dot(torque, torque)

    def throttle(self, u: Any) -> Any:
        return u[-1]

    def metered(self, dimension: int) -> Actuator:
        return self

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        side = np.full(self.size(dimension), np.inf)
        return np.append(-side[:-1], 0.0), np.append(side[:-1], self.limit)

    def rows(self, u: Any) -> list[Row]:
        torque = self.force(u) / self.limit
        norm = ca.sqrt(ca.dot(torque, torque) + self.smoothing**2)
        return [Row("norm", norm - self.throttle(u) / self.limit, 0.0, 0.0)]

    def torque_limit(self) -> float:
        return self.limit

    def times(self, factor: float) -> MeteredTorque:
        return replace(self, limit=factor * self.limit)

    def excess(self, u: np.ndarray) -> np.ndarray:
        torque = np.linalg.norm(u[:, :-1], axis=1)
        # The cost counts the magnitude, so it must be that of the torque, rounded at zero as in `rows`.
        uncounted = np.abs(np.hypot(torque, self.smoothing * self.limit) - u[:, -1])
        return np.maximum(0.0, np.maximum(torque - self.limit, uncounted))

    def beyond(self, u: np.ndarray) -> np.ndarray:
        torque = np.linalg.norm(u[:, :-1], axis=1)
        # What is flown must have been counted.
        return np.maximum(0.0, np.maximum(torque - self.limit, torque - u[:, -1]))

    def words(self) -> str:
        return f"a torque in body axes, about any axis of at most {self.limit:g} N m"
