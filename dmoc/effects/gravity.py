"""Gravity and springs: effects with a potential."""

from __future__ import annotations

from typing import Any

import casadi as ca

from dmoc.basics.arguments import Vector, checked, matching_length, number, vector
from dmoc.basics.records import dataclass
from dmoc.effects.base import Attractor, Conservative
from dmoc.effects.user_functions import as_column


@dataclass(frozen=True)
class UniformGravity(Conservative):
    """The same acceleration everywhere: l = g . q.

    Parameters
    ----------
    acceleration : sequence of float
        g [m/s^2], one entry an axis, for example (0, 0, -9.81).
    """

    acceleration: Vector

    def __post_init__(self) -> None:
        checked(self, acceleration=vector("acceleration", self.acceleration, "m/s^2"))

    def check_dimension(self, dimension: int) -> None:
        matching_length(self, "acceleration", len(self.acceleration), dimension)

    def lagrangian(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        return ca.dot(as_column(self.acceleration), q)


@dataclass(frozen=True)
class PointGravity(Conservative):
    """Attraction by a point or a sphere: l = mu / |q - center|.

    Parameters
    ----------
    mu : float
        Gravitational parameter [m^3/s^2].
    center : sequence of float, optional
        Where the attractor is [m]; the origin if not given.
    """

    mu: float
    center: Vector | None = None

    def __post_init__(self) -> None:
        checked(self, mu=number("mu", self.mu, "m^3/s^2", positive=True))
        if self.center is not None:
            checked(self, center=vector("center", self.center, "m"))

    def check_dimension(self, dimension: int) -> None:
        if self.center is not None:
            # A centre in the plane of the first axes serves with fewer axes, too.
            beyond = any(self.center[dimension:])
            given = len(self.center) if beyond else min(len(self.center), dimension)
            matching_length(self, "center", given, dimension)

    def lagrangian(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        offset = q if self.center is None else q - as_column(self.center[: q.shape[0]])
        # a square root and products, since a power of 3/2 takes longer than all the rest of a step
        return self.mu / ca.sqrt(ca.dot(offset, offset))

    def attractor(self) -> Attractor:
        return Attractor(self.mu, None if self.center is None else tuple(self.center))


@dataclass(frozen=True)
class J2(Conservative):
    """Pull of an attractor's oblateness about the z axis, on top of a PointGravity at the origin.

    l = mu j2 radius^2 / (2 r^3) (1 - 3 z^2 / r^2); in two dimensions the motion is in the equator, z = 0.
    Undefined at the origin.

    Parameters
    ----------
    mu : float
        Gravitational parameter of the attractor [m^3/s^2].
    radius : float
        Its equatorial radius [m].
    j2 : float
        Second zonal harmonic, not normalised; 1.08263e-3 for the Earth [-].

    References
    ----------
    H. D. Curtis, Orbital Mechanics for Engineering Students, 3rd edition (2014), equation (12.30).
    """

    mu: float
    radius: float
    j2: float

    def __post_init__(self) -> None:
        checked(
            self,
            mu=number("mu", self.mu, "m^3/s^2", positive=True),
            radius=number("radius", self.radius, "m", positive=True),
            j2=number("j2", self.j2, "-"),
        )
        if abs(self.j2) >= 1:
            raise ValueError(
                f"j2 must be less than 1 [-] (1.08263e-3 for the Earth); got {self.j2:g}: "
                "the radius is an argument of its own"
            )

    def check_dimension(self, dimension: int) -> None:
        if dimension == 1:
            raise ValueError("J2 needs 2 (in the equator) or 3 dimensions; got 1")

    def lagrangian(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        squared = ca.dot(q, q)
        pull = 0.5 * self.mu * self.j2 * self.radius**2 / (squared * ca.sqrt(squared))
        return pull if q.numel() == 2 else pull * (1 - 3 * q[2] * q[2] / squared)

    def body_radius(self) -> float:
        return self.radius


@dataclass(frozen=True)
class Spring(Conservative):
    """A linear spring to a fixed point: l = -(stiffness / m) |q - anchor|^2 / 2.

    Parameters
    ----------
    stiffness : float
        Force per length [N/m].
    anchor : sequence of float
        Where the spring is at rest [m].
    """

    stiffness: float
    anchor: Vector

    def __post_init__(self) -> None:
        checked(
            self,
            stiffness=number("stiffness", self.stiffness, "N/m", nonnegative=True),
            anchor=vector("anchor", self.anchor, "m"),
        )

    def check_dimension(self, dimension: int) -> None:
        matching_length(self, "anchor", len(self.anchor), dimension)

    def lagrangian(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        offset = q - as_column(self.anchor)
        return -0.5 * self.stiffness / m * ca.dot(offset, offset)
