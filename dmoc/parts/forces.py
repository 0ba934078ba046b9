"""Forces without propellant: free, limited along each axis, limited in magnitude."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, checked, limits, times_each
from dmoc.parts.actuator import Actuator, limit_told
from dmoc.parts.engines import Engine
from dmoc.parts.rows import Row


@dataclass(frozen=True)
class FreeForce(Actuator):
    """Any force, without a limit [N]."""


@dataclass(frozen=True)
class BoxForce(Actuator):
    """A force limited along each axis: |F_i| <= limit_i.

    Parameters
    ----------
    limit : float or sequence of float
        Largest force [N], one number or one for each axis.
    """

    limit: float | Vector

    def __post_init__(self) -> None:
        checked(self, limit=limits("limit", self.limit, "N"))

    def check_dimension(self, dimension: int) -> None:
        if isinstance(self.limit, tuple) and len(self.limit) != dimension:
            raise ValueError(
                f"BoxForce: limit has {len(self.limit)} entries but the problem has {dimension} dimensions; "
                f"give one number or {dimension}"
            )

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        limit = np.broadcast_to(np.asarray(self.limit, float), (dimension,)).copy()
        return -limit, limit

    def metered(self, dimension: int) -> Actuator:
        # No force in the box is larger than its diagonal, so the limit on the magnitude never acts by itself.
        limits = np.broadcast_to(np.asarray(self.limit, float), (dimension,))
        return MeteredBox(float(np.linalg.norm(limits)), box=self.limit)

    def force_limit(self) -> float:
        return float(np.max(self.limit))

    def times(self, factor: float) -> BoxForce:
        return BoxForce(times_each(self.limit, factor))

    def needs(self, eased: Actuator) -> str:
        factor = (eased.force_limit() or 0.0) / self.force_limit()
        return limit_told(self.limit_words, self.limit, factor, "N")

    def unlimited(self) -> Actuator:
        return FreeForce()

    def share(self, u: np.ndarray) -> float:
        return float((np.abs(u) / np.asarray(self.limit)).max())

    def words(self) -> str:
        return f"a force with each component within {self.limit} N"


@dataclass(frozen=True)
class MeteredBox(Engine):
    """A `BoxForce` with the magnitude of its force among the controls."""

    def needs(self, eased: Actuator) -> str:
        factor = (eased.force_limit() or 0.0) / self.max_thrust
        return limit_told("force limit", self.box or 0.0, factor, "N")


@dataclass(frozen=True)
class BallForce(Actuator):
    """A force of limited magnitude in any direction: |F| <= limit.

    Parameters
    ----------
    limit : float
        Largest force [N].
    """

    limit: float
    adjustable: ClassVar[tuple[str, ...]] = ("limit",)

    def __post_init__(self) -> None:
        value = limits("limit", self.limit, "N")
        if isinstance(value, tuple):
            raise ValueError(
                f"BallForce: limit must be one number [N], the radius of the ball; got {self.limit!r}"
            )
        checked(self, limit=value)

    def rows(self, u: Any) -> list[Row]:
        return [Row("magnitude", ca.dot(u, u) / self.limit**2, -np.inf, 1.0)]

    def metered(self, dimension: int) -> Actuator:
        return Engine(self.limit)

    def force_limit(self) -> float:
        return self.limit

    def times(self, factor: float) -> BallForce:
        return BallForce(factor * self.limit)

    def eased(self, slack: float) -> BallForce:
        # The row is |F|^2 / limit^2 <= 1 + slack, so the limit on |F| grows by the root.
        return self.times(float(np.sqrt(1 + slack)))

    def unlimited(self) -> Actuator:
        return FreeForce()

    def share(self, u: np.ndarray) -> float:
        return float(np.linalg.norm(u, axis=1).max()) / self.limit

    def violation(self, value: float, unit: str) -> tuple[float, str]:
        return self.limit * (np.sqrt(1 + value) - 1), "N"

    def excess(self, u: np.ndarray) -> np.ndarray:
        return np.maximum(0.0, np.linalg.norm(u, axis=1) - self.limit)

    def words(self) -> str:
        return f"a force in any direction of at most {self.limit:g} N"


@dataclass(frozen=True)
class Unpowered(Actuator):
    """No force at all, as in a coast: there is no control, and none is an unknown of the optimisation."""

    moves_body: ClassVar[bool] = False

    def size(self, dimension: int) -> int:
        return 0

    def labels(self, dimension: int) -> tuple[str, ...]:
        return ()

    def wrench(self, rotation: Any, u: Any) -> tuple[Any, Any]:
        return None, None

    def acts(self, configuration: Any, q: Any, u: Any) -> Any:
        return ca.SX.zeros(configuration.size)

    def force(self, u: Any) -> Any:
        return ca.SX(0)

    def throttle(self, u: Any) -> Any:
        return ca.SX(0)

    def metered(self, dimension: int) -> Actuator:
        return self

    def words(self) -> str:
        return "nothing: the body coasts"
