"""What pushes one body of several, or turns one rod against another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import checked, entries, number, of_kind, short
from dmoc.basics.digits import up
from dmoc.links.rods import Rod
from dmoc.parts.actuator import Actuator
from dmoc.parts.rows import Row


@dataclass(frozen=True)
class JointTorque(Actuator):
    """A motor that turns a rod in the plane, against the room or against another rod.

    Parameters
    ----------
    rod : Rod
        The rod that it turns, one of the links.
    limit : float, optional
        Largest torque [N m]; none if not given.
    against : Rod, optional
        The rod on which the motor sits; it stands in the room if not given.
    """

    rod: Rod
    limit: float | None = None
    against: Rod | None = None
    adjustable: ClassVar[tuple[str, ...]] = ()
    effort_unit: ClassVar[str] = "N^2 m^2 s"

    def __post_init__(self) -> None:
        of_kind("JointTorque: rod", self.rod, Rod)
        if self.against is not None:
            of_kind("JointTorque: against", self.against, Rod)
        if self.limit is not None:
            checked(self, limit=number("JointTorque: limit", self.limit, "N m", positive=True))

    @property
    def structure(self) -> tuple:
        return type(self), self.rod, self.against, self.limit is None

    @property
    def bodies(self) -> tuple[str, ...]:
        rods = [self.rod] if self.against is None else [self.rod, self.against]
        return tuple(name for rod in rods for name in rod.holds)

    def check_dimension(self, dimension: int) -> None:
        if dimension != 2:
            raise ValueError(
                f"JointTorque turns rods in the plane; the positions have {dimension} entries, not 2"
            )

    def size(self, dimension: int) -> int:
        return 1

    def labels(self, dimension: int) -> tuple[str, ...]:
        return (f"torque.{self.rod.on}" if self.rod.on else "torque",)

    def units(self, dimension: int) -> tuple[str, ...]:
        return ("N m",)

    def effort(self, u: Any) -> Any:
        return ca.dot(u, u)

    def acts(self, configuration: Any, q: Any, u: Any) -> Any:
        # The torque works on the angle between the rods: its force on q is that angle's slope.
        place = ca.SX.sym("q", configuration.size)
        at = {name: body for name, body, _ in configuration.members(place, 0 * place, 1.0)}
        signed = [(1.0, self.rod)] + ([] if self.against is None else [(-1.0, self.against)])
        slope = ca.SX.zeros(configuration.size)
        for sign, rod in signed:
            arm = rod.arm(at)
            across = ca.vertcat(-arm[1], arm[0]) / ca.dot(arm, arm)
            slope += sign * ca.jacobian(arm, place).T @ across
        return ca.Function("slope", [place], [slope])(q) * u

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        most = np.full(1, np.inf if self.limit is None else self.limit)
        return -most, most

    def torque_limit(self) -> float | None:
        return self.limit

    @property
    def limit_unit(self) -> str:
        return "N m"

    def times(self, factor: float) -> JointTorque:
        return self if self.limit is None else replace(self, limit=factor * self.limit)

    @property
    def limit_words(self) -> str:
        return "joint torque"

    def needs(self, eased: Actuator) -> str:
        return f"a joint torque of {up(eased.torque_limit() or 0.0)} N m (you gave {self.limit:g} N m)"

    def unlimited(self) -> Actuator:
        return replace(self, limit=None)

    def share(self, u: np.ndarray) -> float:
        return float(np.abs(u).max(initial=0.0)) / (self.limit or np.inf)

    def violation(self, value: float, unit: str) -> tuple[float, str]:
        return value * (self.limit or 1.0), "N m"

    def words(self) -> str:
        where = f"on the rod of {self.against.on or 'the body'}" if self.against else "in the room"
        limit = "without a limit" if self.limit is None else f"of at most {self.limit:g} N m"
        return f"a torque {limit} on the rod of {self.rod.on or 'the body'}, its motor {where}"


@dataclass(frozen=True)
class On(Actuator):
    """An actuator of point masses that pushes one body of a system.

    Parameters
    ----------
    body : str
        Its name.
    push : Actuator
        Such as `BoxForce(10)`, or `FreeForce()`.
    axes : sequence of int, optional
        The axes along which it pushes, 0 for x; all if not given.
    """

    body: str
    push: Actuator
    axes: Sequence[int] | None = None
    adjustable: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        of_kind("On: body", self.body, str)
        of_kind("On: push", self.push, Actuator)
        if self.push.burns or self.push.throttle(ca.SX.sym("u", 8)) is not None:
            raise ValueError(
                f"On: {type(self.push).__name__} burns propellant; bodies of a system keep their masses"
            )
        if self.axes is not None:
            given = entries(self.axes)
            if not given or not all(type(axis) is int and axis in (0, 1, 2) for axis in given):
                raise ValueError(
                    f"On: axes must list some of 0, 1, 2, which are x, y, z; got {short(self.axes)}"
                )
            checked(self, axes=given)

    @property
    def bodies(self) -> tuple[str, ...]:
        return (self.body,)

    def metered(self, dimension: int) -> Actuator:
        raise ValueError("least fuel is for a single body so far; minimise Effort() or Time()")

    @property
    def structure(self) -> tuple:
        return type(self), self.body, self.axes, type(self.push), self.push.structure

    def _axes(self, dimension: int) -> tuple[int, ...]:
        return tuple(range(dimension)) if self.axes is None else tuple(self.axes)

    def check_dimension(self, dimension: int) -> None:
        if not all(0 <= axis < dimension for axis in self._axes(dimension)):
            raise ValueError(f"On: axes must be among 0 to {dimension - 1}; got {short(self.axes)}")
        self.push.check_dimension(dimension)

    def size(self, dimension: int) -> int:
        return self.push.size(len(self._axes(dimension)))

    def labels(self, dimension: int) -> tuple[str, ...]:
        return tuple(f"{self.body}.{'xyz'[axis]}" for axis in self._axes(dimension))

    def units(self, dimension: int) -> tuple[str, ...]:
        return self.push.units(len(self._axes(dimension)))

    def effort(self, u: Any) -> Any:
        return self.push.effort(u)

    def acts(self, configuration: Any, q: Any, u: Any) -> Any:
        whole, force = ca.SX.zeros(configuration.dimension), ca.SX(self.push.force(u))
        for i, axis in enumerate(self._axes(configuration.dimension)):
            whole[axis] = force[i]
        return configuration.on(self.body, q, whole, None)

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        return self.push.bounds(len(self._axes(dimension)))

    def rows(self, u: Any) -> list[Row]:
        return self.push.rows(u)

    def force_limit(self) -> float | None:
        return self.push.force_limit()

    def excess(self, u: np.ndarray) -> np.ndarray:
        return self.push.excess(u)

    def times(self, factor: float) -> On:
        return replace(self, push=self.push.times(factor))

    def needs(self, eased: Actuator) -> str:
        return self.push.needs(getattr(eased, "push", eased))

    def unlimited(self) -> Actuator | None:
        free = self.push.unlimited()
        return None if free is None else replace(self, push=free)

    def share(self, u: np.ndarray) -> float:
        return self.push.share(u)

    def violation(self, value: float, unit: str) -> tuple[float, str]:
        return self.push.violation(value, unit)

    def words(self) -> str:
        along = "" if self.axes is None else f" along {', '.join('xyz'[axis] for axis in self.axes)}"
        return f"on {self.body}{along}: {self.push.words()}"
