"""What pushes one body of several, or turns one rod against another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise
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
        of_kind("On: push", self.push, Actuator)
        if self.push.burns or self.push.throttle(ca.SX.sym("u", 8)) is not None:
            raise ValueError(
                f"On: {type(self.push).__name__} burns propellant; bodies of a system keep their masses"
            )
        if self.axes is not None:
            checked(self, axes=tuple(int(axis) for axis in entries(self.axes) or ()))

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


@dataclass(frozen=True)
class Several(Actuator):
    """Several actuators at once. `TransferProblem(actuator=[...])` makes it of a list.

    Parameters
    ----------
    parts : sequence of Actuator
    """

    parts: Sequence[Actuator]
    adjustable: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        parts = entries(self.parts) or ()
        for i, part in enumerate(parts):
            of_kind(f"actuator[{i}]", part, Actuator)
            if part.burns:
                raise ValueError(f"actuator[{i}]: one of several may not burn propellant; got {part.words()}")
        checked(self, parts=parts)

    @property
    def structure(self) -> tuple:
        return type(self), *[(type(part), part.structure) for part in self.parts]

    @property
    def effort_unit(self) -> str:  # type: ignore[override]
        units = dict.fromkeys(part.effort_unit for part in self.parts)
        return " + ".join(units)

    def check_dimension(self, dimension: int) -> None:
        for part in self.parts:
            part.check_dimension(dimension)

    def size(self, dimension: int) -> int:
        return sum(part.size(dimension) for part in self.parts)

    def labels(self, dimension: int) -> tuple[str, ...]:
        return tuple(label for part in self.parts for label in part.labels(dimension))

    def units(self, dimension: int) -> tuple[str, ...]:
        return tuple(unit for part in self.parts for unit in part.units(dimension))

    def _cut(self, u: Any, dimension: int) -> list[Any]:
        ends = list(accumulate((part.size(dimension) for part in self.parts), initial=0))
        return [u[first:last] for first, last in pairwise(ends)]

    def _known(self, u: Any) -> list[tuple[Actuator, Any]]:
        """The parts and their controls, where the number of axes is told by the number of controls."""
        count = u.shape[-1] if isinstance(u, np.ndarray) else u.numel()
        axes = next(axes for axes in (2, 3, 1) if self.size(axes) == count)
        ends = list(accumulate((part.size(axes) for part in self.parts), initial=0))
        cuts = [slice(first, last) for first, last in pairwise(ends)]
        columns = [u[:, cut] if isinstance(u, np.ndarray) else u[cut] for cut in cuts]
        return list(zip(self.parts, columns, strict=True))

    def effort(self, u: Any) -> Any:
        return sum(part.effort(mine) for part, mine in self._known(u))

    def acts(self, configuration: Any, q: Any, u: Any) -> Any:
        return sum(
            part.acts(configuration, q, mine)
            for part, mine in zip(self.parts, self._cut(u, configuration.dimension), strict=True)
        )

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        sides = [part.bounds(dimension) for part in self.parts]
        return np.concatenate([low for low, _ in sides]), np.concatenate([high for _, high in sides])

    def rows(self, u: Any) -> list[Row]:
        found = []
        for i, (part, mine) in enumerate(self._known(u)):
            found += [row._replace(name=f"{i + 1}.{row.name}") for row in part.rows(mine)]
        return found

    def force_limit(self) -> float | None:
        known = [limit for part in self.parts if (limit := part.force_limit()) is not None]
        return max(known, default=None)

    def torque_limit(self) -> float | None:
        known = [limit for part in self.parts if (limit := part.torque_limit()) is not None]
        return max(known, default=None)

    def excess(self, u: np.ndarray) -> np.ndarray:
        return np.max([part.excess(mine) for part, mine in self._known(u)], axis=0)

    def times(self, factor: float) -> Several:
        return replace(self, parts=tuple(part.times(factor) for part in self.parts))

    def needs(self, eased: Actuator) -> str:
        pairs = zip(self.parts, getattr(eased, "parts", self.parts), strict=True)
        return " and ".join(part.needs(other) for part, other in pairs if part.limited)

    def unlimited(self) -> Actuator | None:
        free = [part.unlimited() for part in self.parts]
        return None if None in free else replace(self, parts=tuple(part for part in free if part))

    def share(self, u: np.ndarray) -> float:
        return max(part.share(mine) for part, mine in self._known(u))

    def words(self) -> str:
        return "; ".join(part.words() for part in self.parts)
