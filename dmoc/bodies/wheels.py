"""Reaction wheels, and the limit on what they can store."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import (
    FreeVector,
    Vector,
    checked,
    entries,
    limits,
    number,
    short,
    times_each,
    vector,
)
from dmoc.basics.quaternions import AXES
from dmoc.basics.records import dataclass
from dmoc.bodies.torques import OnBody
from dmoc.effects.base import Body
from dmoc.parts.actuator import Actuator, limit_told
from dmoc.parts.constraint import Constraint
from dmoc.parts.rows import Row


@dataclass(frozen=True)
class Wheels(OnBody):
    """Reaction wheels that turn the body by being spun up themselves; nothing acts from outside.

    The inertia of the body is that of the whole, the wheels included, but without the moment of inertia of each
    wheel about its own axis.

    Parameters
    ----------
    axes : sequence of sequences of float
        The axis of each wheel in body axes [-]; made unit vectors.
    max_torque : float or sequence of float
        Largest torque of the motors [N m], one number or one for each wheel.
    max_momentum : float or sequence of float, optional
        Largest angular momentum that a wheel stores about its axis [N m s], the same; no limit if not given.
    start_momentum : sequence of float, optional
        Angular momentum of each wheel at the start [N m s]; 0 if not given.
    goal_momentum : sequence of float or None, optional
        Angular momentum of each wheel at the goal [N m s]; entries that are None are free, as all are if it is
        not given.
    """

    axes: Sequence[Vector]
    max_torque: float | Vector
    max_momentum: float | Vector | None = None
    start_momentum: Vector | None = None
    goal_momentum: FreeVector | None = None
    adjustable: ClassVar[tuple[str, ...]] = ()
    effort_unit: ClassVar[str] = "N^2 m^2 s"

    def __post_init__(self) -> None:
        axes = tuple(_unit(i, axis) for i, axis in enumerate(entries(self.axes) or ()))
        if not axes:
            raise ValueError(f"Wheels: axes must list directions in body axes [-]; got {short(self.axes)}")
        checked(self, axes=axes, max_torque=self._each("max_torque", self.max_torque, "N m"))
        if self.max_momentum is not None:
            checked(self, max_momentum=self._each("max_momentum", self.max_momentum, "N m s"))
        checked(self, start_momentum=self._held("start_momentum", 0.0))
        checked(self, goal_momentum=self._held("goal_momentum", None))

    @property
    def count(self) -> int:
        """Number of wheels."""
        return len(self.axes)

    def _each(self, name: str, value: Any, unit: str) -> float | tuple:
        found = limits(f"Wheels: {name}", value, unit)
        if isinstance(found, tuple) and len(found) != self.count:
            raise ValueError(
                f"Wheels: {name} must be one number or one for each of {self.count} wheels [{unit}]; "
                f"got {short(value)}"
            )
        return found

    def _held(self, name: str, otherwise: float | None) -> tuple[float | None, ...]:
        """The momenta at an end [N m s], one a wheel and none above the limit; `otherwise` by default."""
        value = getattr(self, name)
        given = (otherwise,) * self.count if value is None else entries(value)
        if given is None or len(given) != self.count:
            raise ValueError(
                f"Wheels: {name} must have an entry for each of {self.count} wheels [N m s]; got {short(value)}"
            )
        most = np.broadcast_to(np.inf if self.max_momentum is None else self.max_momentum, self.count)
        found: list[float | None] = []
        for i, (entry, limit) in enumerate(zip(given, most, strict=True)):
            if entry is None and otherwise is None:
                found.append(None)
                continue
            found.append(number(f"Wheels: {name}[{i}]", entry, "N m s"))
            if abs(found[-1] or 0.0) > limit:
                raise ValueError(
                    f"Wheels: {name}[{i}] is {entry:g} N m s, more than the max_momentum of {limit:g} N m s"
                )
        return tuple(found)

    @property
    def structure(self) -> tuple:
        return type(self), self.axes

    @property
    def wheel_axes(self) -> tuple[tuple[float, ...], ...]:
        return tuple(tuple(axis) for axis in self.axes)

    @property
    def own_limits(self) -> tuple[Constraint, ...]:
        if self.max_momentum is None:
            return ()
        return (MomentumLimit(tuple(np.broadcast_to(self.max_momentum, self.count).tolist()), own=True),)

    def size(self, dimension: int) -> int:
        return self.count

    def labels(self, dimension: int) -> tuple[str, ...]:
        return tuple(f"wheel{i + 1}" for i in range(self.count))

    def units(self, dimension: int) -> tuple[str, ...]:
        return ("N m",) * self.count

    def force(self, u: Any) -> Any:
        return ca.SX.zeros(AXES)

    def wrench(self, rotation: Any, u: Any) -> tuple[Any, Any]:
        return None, None

    def spun(self, u: Any) -> Any:
        return u

    def metered(self, dimension: int) -> Actuator:
        raise ValueError("wheels use no propellant; minimise Effort() or Time()")

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        limit = np.broadcast_to(np.asarray(self.max_torque), (self.count,)).astype(float)
        return -limit, limit

    def torque_limit(self) -> float:
        return float(np.max(self.max_torque))

    def turning_limit(self) -> float:
        # All wheels together, about the body axis on which they do least.
        about = np.abs(np.array(self.axes)).T @ np.broadcast_to(np.asarray(self.max_torque), self.count)
        return float(about.min()) or self.torque_limit()

    @property
    def turns_every_way(self) -> bool:
        return bool(np.linalg.matrix_rank(np.array(self.axes)) == AXES)

    def times(self, factor: float) -> Wheels:
        return replace(self, max_torque=times_each(self.max_torque, factor))

    @property
    def limit_words(self) -> str:
        return "motor torque"

    @property
    def limit_unit(self) -> str:
        return "N m"

    def needs(self, eased: Actuator) -> str:
        factor = (eased.torque_limit() or 0.0) / self.torque_limit()
        return limit_told("motor torque", self.max_torque, factor, "N m")

    def share(self, u: np.ndarray) -> float:
        return float((np.abs(u) / np.asarray(self.max_torque)).max(initial=0.0))

    def violation(self, value: float, unit: str) -> tuple[float, str]:
        return value * self.torque_limit(), "N m"

    def words(self) -> str:
        wheels = f"{self.count} reaction wheel{'s' * (self.count > 1)}"
        motors = f"{wheels} with motors of at most {_listed(self.max_torque)} N m"
        if self.max_momentum is None:
            return motors
        return f"{motors}, each storing at most {_listed(self.max_momentum)} N m s"


@dataclass(frozen=True)
class MomentumLimit(Constraint):
    """Wheels that store no more angular momentum than they can: |h_i| <= limit_i.

    Parameters
    ----------
    limit : sequence of float
        Largest angular momentum of each wheel about its axis [N m s].
    own : bool
        Whether it is the `max_momentum` of the wheels, which `Wheels` states itself and anew.

    Raises
    ------
    ValueError
        If a limit is not positive, or the scene has no wheels or another number of them.
    """

    limit: Vector
    own: bool = field(default=False, repr=False)
    unit: ClassVar[str] = "N m s"
    adjustable: ClassVar[tuple[str, ...]] = ("limit",)
    turns_body: ClassVar[bool] = True
    moves_body: ClassVar[bool] = False

    def __post_init__(self) -> None:
        given = entries(self.limit)
        if not given:
            raise ValueError(
                f"MomentumLimit: limit must list one number for each wheel [N m s]; got {short(self.limit)}"
            )
        names = (f"MomentumLimit: limit[{i}]" for i in range(len(given)))
        found = (number(name, one, "N m s", positive=True) for name, one in zip(names, given, strict=True))
        checked(self, limit=tuple(found))

    def is_beside(self, wheels: int) -> bool:
        """Whether the scene states it beside its wheels; refused with another number of them."""
        if not self.own and wheels != len(self.limit):
            there = f"{wheels} wheels" if wheels else "no wheels: give it the actuator Wheels"
            raise ValueError(f"MomentumLimit limits {len(self.limit)} wheels, but the scene has {there}")
        return not self.own

    @property
    def limits_speed(self) -> bool:
        return True

    @property
    def structure(self) -> tuple:
        return type(self), len(self.limit)

    def seen(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return q, v[:, -AXES - len(self.limit) : -AXES]

    def speed_rows_of(self, body: Body) -> list[Row]:
        most = ca.vertsplit(self.limit) if isinstance(self.limit, ca.SX) else self.limit
        shares = [held / limit for held, limit in zip(ca.vertsplit(body.wheels), most, strict=True)]
        # One row for each way round: a row with two limits has no side to which it could give way.
        return [
            Row(f"wheel{i + 1}{way}", sign * share, -np.inf, 1.0)
            for i, share in enumerate(shares)
            for way, sign in (("+", 1), ("-", -1))
        ]

    def excess(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.maximum(0.0, np.abs(v) - np.asarray(self.limit)).max(axis=1)

    def words(self) -> str:
        return f"never stores more than {_listed(tuple(self.limit))} N m s in a wheel"

    def violation(self, value: float, unit: str) -> tuple[float, str]:
        return float(np.max(self.limit)) * value, "N m s"

    def largest_speed(self) -> float:
        return float(np.max(self.limit))

    def times(self, factor: float) -> MomentumLimit:
        return replace(self, limit=tuple(factor * x for x in self.limit))

    def eased(self, slack: float) -> MomentumLimit:
        return self.times(1 + slack)

    def within(self, problem: Any, entry: int) -> Any:
        if not self.own:
            return super().within(problem, entry)
        return replace(problem, actuator=replace(problem.actuator, max_momentum=self.limit))

    def needs(self, eased: Constraint, index: int, amount: str) -> str:
        factor = (eased.largest_speed() or 0.0) / self.largest_speed()
        return limit_told("max_momentum" if self.own else "momentum limit", self.limit, factor, "N m s")


def _unit(index: int, value: Any) -> tuple[float, ...]:
    found = np.array(vector(f"Wheels: axes[{index}]", value, "-"))
    length = float(np.linalg.norm(found))
    if len(found) != AXES or length == 0:
        raise ValueError(
            f"Wheels: axes[{index}] must be a direction of three numbers in body axes [-]; got {short(value)}"
        )
    return tuple(float(x) for x in found / length)


def _listed(value: Any) -> str:
    if not isinstance(value, tuple):
        return f"{value:g}"
    return f"{value[0]:g}" if len(set(value)) == 1 else f"({', '.join(f'{x:g}' for x in value)})"
