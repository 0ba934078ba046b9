"""A limit on the speed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, checked, number
from dmoc.basics.digits import up
from dmoc.basics.records import dataclass
from dmoc.parts.constraint import Constraint, checked_on, checked_point
from dmoc.parts.rows import Row


@dataclass(frozen=True)
class SpeedLimit(Constraint):
    """Stay below a speed.

    Parameters
    ----------
    limit : float
        Largest speed [m/s].
    point : sequence of float, optional
        Of a body that turns: the point that is meant, in body axes from the centre of mass [m]; the centre if
        not given.
    on : str
        The name of the body, where there are several.
    """

    limit: float
    point: Vector | None = None
    on: str = ""
    unit: ClassVar[str] = "m/s"

    def __post_init__(self) -> None:
        limit = number("limit", self.limit, "m/s", positive=True)
        checked(self, limit=limit, point=checked_point(self, self.point), on=checked_on(self))

    @property
    def adjustable(self) -> tuple[str, ...]:  # type: ignore[override]
        return ("limit",) if self.point is None else ("limit", "point")

    def speed_rows(self, v: Any) -> list[Row]:
        return [Row("speed", ca.dot(v, v) / self.limit**2, -np.inf, 1.0)]

    def excess(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.maximum(0.0, np.linalg.norm(v, axis=1) - self.limit)

    def words(self) -> str:
        return f"is never faster than {self.limit:g} m/s{self.of_point}"

    def violation(self, value: float, unit: str) -> tuple[float, str]:
        return self.limit * (np.sqrt(1 + value) - 1), "m/s"

    def largest_speed(self) -> float:
        return self.limit

    def times(self, factor: float) -> SpeedLimit:
        return replace(self, limit=factor * self.limit)

    def eased(self, slack: float) -> SpeedLimit:
        # The row is |v|^2 / limit^2 <= 1 + slack, so the limit on |v| grows by the root.
        return self.times(float(np.sqrt(1 + slack)))

    def needs(self, eased: Constraint, index: int, amount: str) -> str:
        enough = up(eased.largest_speed() or 0.0)
        return f"a speed limit{self.of_body} of {enough} m/s (you gave {self.limit:g} m/s)"
