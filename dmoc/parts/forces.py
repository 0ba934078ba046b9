"""Forces without propellant: free, limited along each axis, limited in magnitude."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, checked, entries, flag, limits, short, times_each
from dmoc.basics.records import dataclass
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
    held : sequence of int, optional
        One for each axis along which the force is always as large as it may be: 1 forward, -1 back; 0 for
        others.
    """

    limit: float | Vector
    held: Sequence[int] = ()

    def __post_init__(self) -> None:
        sides = entries(self.held)
        if sides is None or not all(side in (-1, 0, 1) for side in sides):
            raise ValueError(f"BoxForce: held must be -1, 0 or 1 for each axis; got {short(self.held)}")
        checked(self, limit=limits("limit", self.limit, "N"), held=tuple(map(int, sides)))

    def check_dimension(self, dimension: int) -> None:
        if isinstance(self.limit, tuple) and len(self.limit) != dimension:
            raise ValueError(
                f"BoxForce: limit has {len(self.limit)} entries but the problem has {dimension} dimensions; "
                f"give one number or {dimension}"
            )
        if len(self.held) not in (0, dimension):
            raise ValueError(
                f"BoxForce: held has {len(self.held)} entries but the problem has {dimension} dimensions; "
                f"give {dimension}"
            )

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        limit = np.broadcast_to(np.asarray(self.limit, float), (dimension,))
        side = np.array(self.held or (0,) * dimension)
        return np.where(side > 0, limit, -limit), np.where(side < 0, -limit, limit)

    def limit_names(self, dimension: int) -> tuple[tuple[str, str], ...]:
        return tuple((f"-{axis}", f"+{axis}") for axis in "xyz"[:dimension])

    def kept(self, sides: Sequence[int]) -> Actuator:
        return replace(self, held=tuple(sides))

    def metered(self, dimension: int) -> Actuator:
        # No force in the box is larger than its diagonal, so the limit on the magnitude never acts by itself.
        limits = np.broadcast_to(np.asarray(self.limit, float), (dimension,))
        return MeteredBox(float(np.linalg.norm(limits)), box=self.limit)

    def force_limit(self) -> float:
        return float(np.max(self.limit))

    def times(self, factor: float) -> BoxForce:
        return replace(self, limit=times_each(self.limit, factor))

    def needs(self, eased: Actuator) -> str:
        factor = (eased.force_limit() or 0.0) / self.force_limit()
        return limit_told(self.limit_words, self.limit, factor, "N")

    def unlimited(self) -> Actuator:
        return FreeForce()

    def share(self, u: np.ndarray) -> float:
        return float((np.abs(u) / np.asarray(self.limit)).max())

    def words(self) -> str:
        sides = zip(self.held, self.limit_names(len(self.held)), strict=True)
        full = [names[side > 0] for side, names in sides if side]
        always = f", always at its limit along {', '.join(full)}" if full else ""
        return f"a force with each component within {self.limit} N{always}"


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
    full : bool
        Whether the force is always that large.
    """

    limit: float
    full: bool = False
    adjustable: ClassVar[tuple[str, ...]] = ("limit",)

    def __post_init__(self) -> None:
        value = limits("limit", self.limit, "N")
        if isinstance(value, tuple):
            raise ValueError(
                f"BallForce: limit must be one number [N], the radius of the ball; got {self.limit!r}"
            )
        flag("BallForce: full", self.full)
        checked(self, limit=value)

    @property
    def structure(self) -> tuple:
        return type(self), self.full

    def rows(self, u: Any) -> list[Row]:
        return [Row("magnitude", ca.dot(u, u) / self.limit**2, 1.0 if self.full else -np.inf, 1.0)]

    def metered(self, dimension: int) -> Actuator:
        return Engine(self.limit, min_thrust=self.limit if self.full else 0.0)

    def limit_names(self, dimension: int) -> tuple[tuple[str, str], ...]:
        return (("", "full force"),)

    def kept(self, sides: Sequence[int]) -> BallForce:
        return replace(self, full=bool(sides[0]))

    def force_limit(self) -> float:
        return self.limit

    @property
    def throughout(self) -> BallForce:
        return self.kept((1,))

    def times(self, factor: float) -> BallForce:
        return replace(self, limit=factor * self.limit)

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
        over = np.linalg.norm(u, axis=1) - self.limit
        return np.maximum(-over if self.full else 0.0, over)

    def beyond(self, u: np.ndarray) -> np.ndarray:
        # Between nodes at which it is full a force that turns is a little less.
        return np.maximum(0.0, np.linalg.norm(u, axis=1) - self.limit)

    def nearest(self, u: np.ndarray) -> np.ndarray:
        return u * (self.limit / np.maximum(np.linalg.norm(u, axis=1), self.limit))[:, None]

    def words(self) -> str:
        if self.full:
            return f"a force in any direction of {self.limit:g} N throughout"
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
