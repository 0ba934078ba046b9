"""Actuators that burn propellant: thrust with a magnitude of its own, and a mass that shrinks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, checked, entries, limits, number, short, times_each, vector
from dmoc.basics.records import dataclass
from dmoc.parts.actuator import Actuator, limit_told
from dmoc.parts.rows import Row

# Standard gravity [m/s^2] turns a specific impulse [s] into an exhaust velocity [m/s]; exact by definition.
STANDARD_GRAVITY = 9.80665


class Burner(Actuator):
    """The fields and methods that engines, nozzles and thrusters share: exhaust, dry mass, mass flow."""

    exhaust_velocity: float | None
    dry_mass: float
    coasts = True

    @property
    def limit_words(self) -> str:
        return "largest thrust"

    @property
    def structure(self) -> tuple:
        return type(self), self.burns

    @property
    def burns(self) -> bool:
        return self.exhaust_velocity is not None

    def flow(self, u: Any) -> Any:
        return self.throttle(u) / self.exhaust_velocity if self.burns else None

    def metered(self, dimension: int) -> Actuator:
        return self

    def _check_exhaust(self, specific_impulse: Any) -> None:
        name = type(self).__name__
        if specific_impulse is not None and self.exhaust_velocity is not None:
            raise ValueError(f"{name}: give specific_impulse [s] or exhaust_velocity [m/s], not both")
        if specific_impulse is not None:
            seconds = number("specific_impulse", specific_impulse, "s", positive=True)
            checked(self, exhaust_velocity=seconds * STANDARD_GRAVITY, specific_impulse=None)
        elif self.exhaust_velocity is not None:
            speed = number("exhaust_velocity", self.exhaust_velocity, "m/s", positive=True)
            checked(self, exhaust_velocity=speed)
        checked(self, dry_mass=number("dry_mass", self.dry_mass, "kg", nonnegative=True))

    def _burning_words(self) -> str:
        if not self.burns:
            return ", without burning mass"
        return f", exhaust velocity {self.exhaust_velocity:g} m/s, dry mass {self.dry_mass:g} kg"


@dataclass(frozen=True)
class Engine(Burner):
    """A thrust vector of limited magnitude, |F| <= max_thrust, that burns |F| / exhaust_velocity [kg/s].

    The controls of a node are the force and its magnitude, the throttle, tied together by
    sqrt(|F|^2 + eps^2) = throttle with eps = smoothing * max_thrust: at zero thrust |F| alone has no
    derivative. A coasting engine so burns eps / exhaust_velocity, which the default keeps at 1e-5 of
    full flow. The set of forces is a ball, convex, as long as min_thrust is 0. With a throttle floor
    it is a shell, not convex: another starting guess may then lead to another optimum.

    Parameters
    ----------
    max_thrust : float
        Largest thrust [N].
    specific_impulse : float, optional
        [s], with standard gravity 9.80665 m/s^2; or give exhaust_velocity. With neither, mass is constant.
    exhaust_velocity : float, optional
        [m/s].
    dry_mass : float
        Mass below which it cannot burn [kg].
    min_thrust : float
        Throttle floor [N]; equal to max_thrust where the engine burns fully throughout.
    box : float or sequence of float, optional
        Further limit on each component of the thrust [N].
    smoothing : float
        Width of the rounding of |F| at zero, relative to max_thrust [-].
    """

    max_thrust: float
    specific_impulse: float | None = None
    exhaust_velocity: float | None = None
    dry_mass: float = 0.0
    min_thrust: float = 0.0
    box: float | Vector | None = None
    smoothing: float = 1e-5

    def __post_init__(self) -> None:
        checked(
            self,
            max_thrust=number("max_thrust", self.max_thrust, "N", positive=True),
            min_thrust=number("min_thrust", self.min_thrust, "N", nonnegative=True),
        )
        if self.min_thrust > self.max_thrust:
            raise ValueError(
                "Engine: min_thrust must not be more than max_thrust; "
                f"got {self.min_thrust:g} and {self.max_thrust:g} N"
            )
        checked(self, smoothing=number("smoothing", self.smoothing, "-", positive=True))
        if self.box is not None:
            checked(self, box=limits("box", self.box, "N"))
        self._check_exhaust(self.specific_impulse)

    @property
    def adjustable(self) -> tuple[str, ...]:  # type: ignore[override]
        return ("max_thrust", "smoothing", *(["exhaust_velocity"] if self.burns else []))

    def size(self, dimension: int) -> int:
        return dimension + 1

    def labels(self, dimension: int) -> tuple[str, ...]:
        return (*"xyz"[:dimension], "throttle")

    def force(self, u: Any) -> Any:
        return u[:-1]

    def throttle(self, u: Any) -> Any:
        return u[-1]

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        side = np.broadcast_to(np.inf if self.box is None else np.asarray(self.box, float), (dimension,))
        return np.append(-side, self.min_thrust), np.append(side, self.max_thrust)

    def rows(self, u: Any) -> list[Row]:
        force = self.force(u) / self.max_thrust
        norm = ca.sqrt(ca.dot(force, force) + self.smoothing**2)
        return [Row("norm", norm - self.throttle(u) / self.max_thrust, 0.0, 0.0)]

    def force_limit(self) -> float:
        return self.max_thrust

    @property
    def throughout(self) -> Engine | None:
        return None if self.box is not None else replace(self, min_thrust=self.max_thrust)

    def times(self, factor: float) -> Engine:
        box = None if self.box is None else times_each(self.box, factor)
        return replace(self, max_thrust=factor * self.max_thrust, box=box)

    def needs(self, eased: Actuator) -> str:
        factor = (eased.force_limit() or 0.0) / self.max_thrust
        thrust = limit_told(self.limit_words, self.max_thrust, factor, "N")
        if self.box is None:
            return thrust
        box = limit_told("force limit", self.box, factor, "N")
        return f"{thrust} and {box} along each axis"

    def excess(self, u: np.ndarray) -> np.ndarray:
        thrust = np.linalg.norm(u[:, :-1], axis=1)
        over = np.maximum(thrust - self.max_thrust, self.min_thrust - u[:, -1])
        # Propellant is burnt by the throttle, so the throttle must equal the force, rounded at zero as in
        # `rows`.
        unpaid = np.abs(np.hypot(thrust, self.smoothing * self.max_thrust) - u[:, -1])
        return np.maximum(0.0, np.maximum(over, unpaid))

    def beyond(self, u: np.ndarray) -> np.ndarray:
        thrust, throttle = np.linalg.norm(u[:, :-1], axis=1), u[:, -1]
        over = np.maximum(thrust - self.max_thrust, self.min_thrust - throttle)
        if self.box is not None:
            over = np.maximum(over, (np.abs(u[:, :-1]) - np.asarray(self.box)).max(axis=1))
        # What is flown must have been paid for.
        return np.maximum(0.0, np.maximum(over, thrust - throttle))

    def nearest(self, u: np.ndarray) -> np.ndarray | None:
        if self.box is not None:
            return None
        throttle = np.clip(u[:, -1:], self.min_thrust, self.max_thrust)
        thrust = np.linalg.norm(u[:, :-1], axis=1, keepdims=True)
        # Nothing is divided by a force of zero.
        share = np.minimum(1.0, throttle / np.maximum(thrust, np.finfo(float).tiny))
        return np.hstack([share * u[:, :-1], throttle])

    def words(self) -> str:
        if self.min_thrust == self.max_thrust:
            return f"an engine that burns at {self.max_thrust:g} N throughout{self._burning_words()}"
        floor = f" and at least {self.min_thrust:g} N" if self.min_thrust else ""
        return f"an engine of at most {self.max_thrust:g} N{floor}{self._burning_words()}"


@dataclass(frozen=True)
class Nozzles(Burner):
    """Fixed nozzles, each with a thrust between 0 and its largest: F = sum_i u_i direction_i.

    Parameters
    ----------
    directions : sequence of sequences
        Direction of the force each nozzle makes, one row a nozzle; made unit vectors.
    max_thrust : float or sequence of float
        Largest thrust [N], one number or one a nozzle.
    min_thrust : float or sequence of float
        Least thrust [N], one number or one a nozzle; equal to max_thrust where a nozzle burns fully throughout.
    specific_impulse, exhaust_velocity, dry_mass
        As for `Engine`.
    """

    directions: Sequence[Vector] | np.ndarray
    max_thrust: float | Vector
    specific_impulse: float | None = None
    exhaust_velocity: float | None = None
    dry_mass: float = 0.0
    min_thrust: float | Vector = 0.0
    limit_label = "limit of\na nozzle"

    def __post_init__(self) -> None:
        rows = [vector(f"directions[{i}]", row, "-") for i, row in enumerate(entries(self.directions) or ())]
        if not rows or len({len(row) for row in rows}) != 1 or not all(np.any(row) for row in rows):
            raise ValueError(
                f"Nozzles: directions must be nonzero rows of one length; got {short(self.directions)}"
            )
        unit = tuple(tuple(float(x) for x in np.array(row) / np.linalg.norm(row)) for row in rows)
        checked(self, directions=unit)
        most, least = self._each("max_thrust", positive=True), self._each("min_thrust", nonnegative=True)
        for low, high in zip(least, most, strict=True):
            if low > high:
                raise ValueError(
                    f"Nozzles: min_thrust must not be more than max_thrust; got {low:g} and {high:g} N"
                )
        checked(self, max_thrust=most, min_thrust=least)
        self._check_exhaust(self.specific_impulse)

    def _each(self, name: str, **sign: bool) -> tuple[float, ...]:
        """A thrust for each nozzle [N]."""
        value, count = getattr(self, name), len(self.directions)
        given = entries(value)
        thrusts = (value,) * count if given is None else given
        if len(thrusts) != count:
            raise ValueError(
                f"Nozzles: {name} has {len(thrusts)} entries but there are {count} directions; "
                f"give one number [N] or {count}"
            )
        return tuple(number(f"{name}[{i}]", x, "N", **sign) for i, x in enumerate(thrusts))

    @property
    def adjustable(self) -> tuple[str, ...]:  # type: ignore[override]
        return ("exhaust_velocity",) if self.burns else ()

    @property
    def structure(self) -> tuple:
        return type(self), self.burns, self.directions

    def check_dimension(self, dimension: int) -> None:
        if len(self.directions[0]) != dimension:
            raise ValueError(
                f"Nozzles: directions have {len(self.directions[0])} entries but the problem has {dimension} "
                f"dimensions; give {dimension} entries each"
            )

    def size(self, dimension: int) -> int:
        return len(self.directions)

    def labels(self, dimension: int) -> tuple[str, ...]:
        return tuple(f"nozzle_{i + 1}" for i in range(len(self.directions)))

    def force(self, u: Any) -> Any:
        return ca.DM(np.array(self.directions).T) @ u

    def throttle(self, u: Any) -> Any:
        return ca.sum1(u)

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.min_thrust), np.array(self.max_thrust)

    def force_limit(self) -> float:
        return float(np.max(self.max_thrust))

    def times(self, factor: float) -> Nozzles:
        return replace(self, max_thrust=times_each(self.max_thrust, factor))

    def needs(self, eased: Actuator) -> str:
        factor = (eased.force_limit() or 0.0) / self.force_limit()
        return limit_told(self.limit_words, self.max_thrust, factor, "N")

    def words(self) -> str:
        return (
            f"{len(self.directions)} fixed nozzles of at most {self.force_limit():g} N{self._burning_words()}"
        )
