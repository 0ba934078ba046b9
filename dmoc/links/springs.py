"""Springs and dampers in joints, which act on both bodies that a joint holds together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dmoc.basics.arguments import checked, number, short
from dmoc.basics.records import dataclass
from dmoc.effects.base import Between, Body
from dmoc.links.joint import Joint
from dmoc.links.rods import Rod


class _InJoint(Between):
    """What springs and dampers share: the joint in which they sit."""

    joint: Joint | Rod

    def _check_joint(self) -> None:
        name = type(self).__name__
        if not isinstance(self.joint, (Joint, Rod)) or self.joint.coordinates != 1:
            raise ValueError(f"{name}: joint must be a Revolute, Prismatic or Rod; got {short(self.joint)}")

    def _told(self, kind: str, value: float, time: str = "") -> str:
        """A constant of it in words: in N m for each radian of a hinge, in N for each metre of a slide."""
        unit, _ = self.joint.coordinate_units
        force = "N m" if unit == "rad" else "N"
        return f"a {kind} of {value:g} {force}{time}/{unit} in the joint of {self.joint.name}"

    def check_dimension(self, dimension: int) -> None:
        if isinstance(self.joint, Rod) and dimension != 2:
            raise ValueError(
                f"{type(self).__name__}: a rod turns in the plane; positions have {dimension} entries, not 2"
            )


@dataclass(frozen=True)
class JointSpring(_InJoint):
    """A linear spring in a joint, with the energy k x^2 / 2.

    Parameters
    ----------
    joint : Revolute, Prismatic or Rod
        One of the links; the spring of a rod turns it against the room, in the plane.
    stiffness : float
        k [N m/rad], in a slide [N/m].
    rest : float
        Where it is at rest: an angle [rad], of a rod from the x axis, or a way [m].
    """

    joint: Any
    stiffness: float
    rest: float = 0.0

    def __post_init__(self) -> None:
        self._check_joint()
        checked(
            self, stiffness=number("JointSpring: stiffness", self.stiffness, "N m/rad or N/m", positive=True)
        )
        checked(self, rest=number("JointSpring: rest", self.rest, "rad or m"))

    def energy_between(self, t: Any, at: Mapping[str, Body]) -> Any:
        return 0.5 * self.stiffness * self.joint.from_rest(at, self.rest) ** 2

    def words(self) -> str:
        return (
            f"{self._told('spring', self.stiffness)}, at rest at {self.rest:g} {self.joint.coordinate_units[0]}"
        )


@dataclass(frozen=True)
class JointDamper(_InJoint):
    """A viscous damper in a joint: it resists the rate of the joint in proportion.

    Parameters
    ----------
    joint : Revolute, Prismatic or Rod
        One of the links; the damper of a rod sits in the room, in the plane.
    damping : float
        [N m s/rad], in a slide [N s/m].
    """

    joint: Any
    damping: float

    def __post_init__(self) -> None:
        self._check_joint()
        checked(self, damping=number("JointDamper: damping", self.damping, "N m s/rad or N s/m", positive=True))

    def acts_between(self, configuration: Any, t: Any, q: Any, at: Mapping[str, Body]) -> Any:
        return self.joint.driven(configuration, q, at, -self.damping * self.joint.rate(at))

    def words(self) -> str:
        return self._told("damper", self.damping, " s")
