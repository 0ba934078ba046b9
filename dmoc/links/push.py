"""What pushes one body of several, or turns one rod against another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import checked, entries, number, of_kind, short
from dmoc.basics.digits import up
from dmoc.basics.records import dataclass
from dmoc.links.joints import Prismatic, Revolute, Spherical
from dmoc.links.rods import Rod
from dmoc.parts.actuator import Actuator
from dmoc.parts.outline import Jet
from dmoc.parts.rows import Row


@dataclass(frozen=True)
class JointTorque(Actuator):
    """A motor in a joint, or one that turns a rod in the plane.

    Parameters
    ----------
    joint : Revolute, Spherical or Rod
        One of the links. In a ball joint there are three torques, in axes of the body that the joint carries.
    limit : float, optional
        Largest torque [N m]; none if not given.
    against : Rod, optional
        Of a rod: the rod on which the motor sits; it stands in the room if not given.
    """

    joint: Any
    limit: float | None = None
    against: Rod | None = None
    adjustable: ClassVar[tuple[str, ...]] = ()
    effort_unit: ClassVar[str] = "N^2 m^2 s"
    unit: ClassVar[str] = "N m"
    word: ClassVar[str] = "torque"

    def __post_init__(self) -> None:
        name = type(self).__name__
        self._check_joint(name)
        if self.against is not None:
            of_kind(f"{name}: against", self.against, Rod)
            of_kind(f"{name}: joint of a motor that sits on a rod", self.joint, Rod)
        if self.limit is not None:
            checked(self, limit=number(f"{name}: limit", self.limit, self.unit, positive=True))

    def _check_joint(self, name: str) -> None:
        if not isinstance(self.joint, (Rod, Revolute, Spherical)):
            raise ValueError(f"{name}: joint must be a Revolute, Spherical or Rod; got {short(self.joint)}")

    @property
    def structure(self) -> tuple:
        return type(self), self.joint, self.against, self.limit is None

    @property
    def bodies(self) -> tuple[str, ...]:
        joints = [self.joint] if self.against is None else [self.joint, self.against]
        return tuple(name for joint in joints for name in joint.holds)

    def check_dimension(self, dimension: int) -> None:
        if isinstance(self.joint, Rod) and dimension != 2:
            raise ValueError(
                f"JointTorque turns rods in the plane; the positions have {dimension} entries, not 2"
            )

    def size(self, dimension: int) -> int:
        return self.joint.motors

    def labels(self, dimension: int) -> tuple[str, ...]:
        name = f"{self.word}.{self.joint.name}".rstrip(".")
        return (name,) if self.joint.motors == 1 else tuple(f"{name}.{axis}" for axis in "xyz")

    def units(self, dimension: int) -> tuple[str, ...]:
        return (self.unit,) * self.joint.motors

    def effort(self, u: Any) -> Any:
        return ca.dot(u, u)

    def acts(self, configuration: Any, q: Any, u: Any) -> Any:
        at = configuration.at(q, ca.SX.zeros(configuration.size), 1.0)
        acts = self.joint.driven(configuration, q, at, u)
        return acts if self.against is None else acts - self.against.driven(configuration, q, at, u)

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        most = np.full(self.joint.motors, np.inf if self.limit is None else self.limit)
        return -most, most

    def torque_limit(self) -> float | None:
        return self.limit

    @property
    def limit_unit(self) -> str:
        return self.unit

    def times(self, factor: float) -> JointTorque:
        return self if self.limit is None else replace(self, limit=factor * self.limit)

    @property
    def limit_words(self) -> str:
        return f"joint {self.word}"

    def needs(self, eased: Actuator) -> str:
        enough = up(eased.main_limit() or 0.0)
        where = f" in the joint of {self.joint.name}" if self.joint.on else ""
        return f"a joint {self.word} of {enough} {self.unit}{where} (you gave {self.limit:g} {self.unit})"

    def unlimited(self) -> Actuator:
        return replace(self, limit=None)

    def share(self, u: np.ndarray) -> float:
        return float(np.abs(u).max(initial=0.0)) / (self.limit or np.inf)

    def violation(self, value: float, unit: str) -> tuple[float, str]:
        return value * (self.limit or 1.0), self.unit

    def words(self) -> str:
        limit = "without a limit" if self.limit is None else f"of at most {self.limit:g} {self.unit}"
        if not isinstance(self.joint, Rod):
            return f"a {self.word} {limit} in the joint of {self.joint.on or 'the body'}"
        where = f"on the rod of {self.against.on or 'the body'}" if self.against else "in the room"
        return f"a torque {limit} on the rod of {self.joint.on or 'the body'}, its motor {where}"


@dataclass(frozen=True)
class JointForce(JointTorque):
    """A motor that pushes along a slide.

    Parameters
    ----------
    joint : Prismatic
        One of the links.
    limit : float, optional
        Largest force [N]; none if not given.
    """

    against: None = None
    effort_unit: ClassVar[str] = "N^2 s"
    unit: ClassVar[str] = "N"
    word: ClassVar[str] = "force"

    def _check_joint(self, name: str) -> None:
        of_kind(f"{name}: joint", self.joint, Prismatic)

    def torque_limit(self) -> float | None:
        return None

    def force_limit(self) -> float | None:
        return self.limit


@dataclass(frozen=True)
class On(Actuator):
    """An actuator that pushes one body of a system.

    Parameters
    ----------
    body : str
        Its name.
    push : Actuator
        Such as `BoxForce(10)` or, of a body that turns, `Torque(1)`, `Wrench()`, `Thrusters(...)`.
    axes : sequence of int, optional
        Of a force: the axes along which it pushes, 0 for x; all if not given.
    """

    body: str
    push: Actuator
    axes: Sequence[int] | None = None
    adjustable: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        of_kind("On: body", self.body, str)
        of_kind("On: push", self.push, Actuator)
        if self.push.burns:
            raise ValueError(
                f"On: {type(self.push).__name__} burns propellant; bodies of a system keep their masses"
            )
        if self.push.wheel_axes:
            raise ValueError("On: wheels are for a single body so far; use a Torque")
        if self.axes is not None:
            if self.push.turns_body:
                raise ValueError(f"On: axes are for a force; leave them out with {type(self.push).__name__}")
            given = entries(self.axes)
            if not given or not all(type(axis) is int and axis in (0, 1, 2) for axis in given):
                raise ValueError(
                    f"On: axes must list some of 0, 1, 2, which are x, y, z; got {short(self.axes)}"
                )
            checked(self, axes=given)

    @property
    def turns_body(self) -> bool:  # type: ignore[override]
        return self.push.turns_body

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
        if self.push.turns_body:
            return tuple(f"{self.body}.{label}" for label in self.push.labels(dimension))
        return tuple(f"{self.body}.{'xyz'[axis]}" for axis in self._axes(dimension))

    def units(self, dimension: int) -> tuple[str, ...]:
        return self.push.units(len(self._axes(dimension)))

    def jets(self) -> list[Jet]:
        return [replace(jet, body=self.body) for jet in self.push.jets()]

    def effort(self, u: Any) -> Any:
        return self.push.effort(u)

    def acts(self, configuration: Any, q: Any, u: Any) -> Any:
        if self.push.turns_body:
            rotation = configuration.at(q, ca.SX.zeros(configuration.size), 1.0)[self.body].rotation
            return configuration.on(self.body, q, *self.push.wrench(rotation, u))
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

    def torque_limit(self) -> float | None:
        return self.push.torque_limit()

    @property
    def effort_unit(self) -> str:  # type: ignore[override]
        return self.push.effort_unit

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
