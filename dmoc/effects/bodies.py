"""Effects on a body that turns: gravity gradient, a pivot under gravity, drag and radiation on flat plates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, checked, entries, number, short, vector
from dmoc.basics.records import dataclass
from dmoc.effects.base import Attractor, Body, BodyConservative, BodyForce
from dmoc.effects.user_functions import as_column, tried

# The speed of light [m/s], exact by definition.
LIGHT = 299_792_458.0
# A plate counts as lit over this part of its area at grazing incidence [-]: the rounding of the corner there.
GRAZING = 1e-2


@dataclass(frozen=True)
class GravityGradient(BodyConservative):
    """Torque of a point mass on a body that is not round: V = -mu tr(J)/(2 r^3) + 3 mu r.J r/(2 r^5).

    The attraction of the centre of mass is not in it: list `PointGravity`, too. For an attitude alone, give the
    place of the body.

    Parameters
    ----------
    mu : float
        Gravitational parameter [m^3/s^2].
    center : sequence of float, optional
        Place of the point mass [m]; the origin if not given.
    place : function of the time, or sequence of float, optional
        Where the body is [m], where the problem is its attitude alone.

    References
    ----------
    P. C. Hughes, Spacecraft Attitude Dynamics (1986), section 8.1.
    """

    mu: float
    center: Vector = (0.0, 0.0, 0.0)
    place: Callable | Vector | None = None

    def __post_init__(self) -> None:
        checked(
            self,
            mu=number("mu", self.mu, "m^3/s^2", positive=True),
            center=_three("center", self.center, "m"),
        )
        if callable(self.place):
            _of_time("GravityGradient: place", self.place)
        elif self.place is not None:
            checked(self, place=_three("place", self.place, "m"))

    def attractor(self) -> Attractor | None:
        return None

    @property
    def moves_body(self) -> bool:  # type: ignore[override]
        return self.place is None

    def lagrangian(self, t: Any, body: Body, m: Any) -> Any:
        if self.place is None:
            position = body.position
        else:
            position = as_column(self.place(t)) if callable(self.place) else as_column(self.place)
        offset = position - as_column(self.center)
        radius = ca.sqrt(ca.dot(offset, offset))
        inertia = body.inertia if isinstance(body.inertia, ca.SX) else ca.DM(np.asarray(body.inertia))
        seen = body.rotation.T @ offset
        pull = ca.trace(inertia) / (2 * radius**3) - 3 * ca.dot(seen, inertia @ seen) / (2 * radius**5)
        return self.mu * pull / m


@dataclass(frozen=True)
class PivotGravity(BodyConservative):
    """Uniform gravity on a body that is held at a fixed point: the heavy top.

    The problem is the attitude alone, and its inertia is that about the pivot.

    Parameters
    ----------
    acceleration : sequence of float
        Acceleration of gravity in space axes [m/s^2].
    arm : sequence of float
        Centre of mass from the pivot, in body axes [m].
    """

    acceleration: Vector
    arm: Vector

    moves_body: ClassVar[bool] = False

    def __post_init__(self) -> None:
        checked(
            self,
            acceleration=_three("acceleration", self.acceleration, "m/s^2"),
            arm=_three("arm", self.arm, "m"),
        )

    def lagrangian(self, t: Any, body: Body, m: Any) -> Any:
        return ca.dot(as_column(self.acceleration), body.rotation @ as_column(self.arm))


@dataclass(frozen=True)
class Plates:
    """The outside of a body as flat plates: areas, outward normals, and offsets of their centres.

    Parameters
    ----------
    areas : sequence of float
        [m^2]
    normals : sequence of sequences
        Outward, in body axes [-]; made unit vectors.
    offsets : sequence of sequences
        Centre of each plate from the centre of mass, in body axes [m].
    """

    areas: Sequence[float]
    normals: Sequence[Vector]
    offsets: Sequence[Vector]

    def __post_init__(self) -> None:
        areas = tuple(
            number(f"areas[{i}]", x, "m^2", positive=True) for i, x in enumerate(entries(self.areas) or ())
        )
        normals = tuple(_three(f"normals[{i}]", x, "-") for i, x in enumerate(entries(self.normals) or ()))
        offsets = tuple(_three(f"offsets[{i}]", x, "m") for i, x in enumerate(entries(self.offsets) or ()))
        if not areas or not len(areas) == len(normals) == len(offsets):
            raise ValueError(
                f"Plates: give an area, a normal and an offset each; got {len(areas)}, {len(normals)} "
                f"and {len(offsets)}"
            )
        if not all(np.linalg.norm(normal) > 0 for normal in normals):
            raise ValueError(f"Plates: normals must not be zero; got {short(self.normals)}")
        units = tuple(tuple(float(x) for x in np.array(n) / np.linalg.norm(n)) for n in normals)
        checked(self, areas=areas, normals=units, offsets=offsets)

    def wrench(self, rotation: Any, toward: Any, push: Callable[[Any, Any], Any]) -> tuple[Any, Any]:
        """Force in space axes and torque in body axes of all plates that face a direction.

        `toward` is the unit vector in body axes from the body to where it is pushed from, and `push` gives
        the force per area in body axes from the cosine of incidence, 0 for a plate that turns away, and the
        normal.
        """
        force, torque = ca.SX.zeros(3), ca.SX.zeros(3)
        for area, normal, offset in zip(self.areas, self.normals, self.offsets, strict=True):
            cosine = ca.dot(ca.DM(normal), toward)
            # max(cosine, 0) with its corner rounded.
            facing = 0.5 * (cosine + ca.sqrt(cosine**2 + GRAZING**2))
            part = area * push(facing, ca.DM(normal))
            force, torque = force + part, torque + ca.cross(ca.DM(offset), part)
        return rotation @ force, torque


@dataclass(frozen=True)
class PlateDrag(BodyForce):
    """Drag of free molecules on flat plates: rho |v|^2 A cos(incidence), times a coefficient.

    Parameters
    ----------
    plates : Plates
    density : float or function of (t, q)
        Density of the atmosphere [kg/m^3].
    coefficient : float
        Half of the usual drag coefficient [-].
    """

    plates: Plates
    density: float | Callable
    coefficient: float = 1.1

    def __post_init__(self) -> None:
        _check_plates(self.plates)
        if callable(self.density):
            given = [ca.SX.sym("t"), ca.SX.sym("q", 3)]
            remedy = "it must take (t, q) and give a density [kg/m^3]"
            if tried("PlateDrag: density", self.density, given, remedy) != 1:
                raise ValueError(f"PlateDrag: density gives more than one number; {remedy}")
        else:
            checked(self, density=number("density", self.density, "kg/m^3", positive=True))
        checked(self, coefficient=number("coefficient", self.coefficient, "-", positive=True))

    def wrench(self, t: Any, body: Body, m: Any) -> tuple[Any, Any]:
        speed = ca.sqrt(ca.dot(body.velocity, body.velocity) + 1e-16)
        ahead = body.rotation.T @ body.velocity / speed
        density = as_column(self.density(t, body.position)) if callable(self.density) else self.density
        pressure = self.coefficient * density * speed**2
        return self.plates.wrench(body.rotation, ahead, lambda facing, normal: -pressure * facing * ahead)


@dataclass(frozen=True)
class PlateRadiation(BodyForce):
    """Radiation pressure on flat plates that reflect a part of the light like mirrors.

    A plate of reflectivity rho is pushed by P A cos(i) [(1 - rho) s + 2 rho cos(i) n] away from the light.

    Parameters
    ----------
    plates : Plates
    direction : sequence of float
        Direction to the light, in space axes [-]; made a unit vector.
    flux : float
        Power of the light [W/m^2]; 1361 is that of the Sun at 1 AU.
    reflectivity : float
        0 absorbs all, 1 reflects all [-].
    """

    plates: Plates
    direction: Vector
    flux: float = 1361.0
    reflectivity: float = 0.3

    moves_body: ClassVar[bool] = False

    def __post_init__(self) -> None:
        _check_plates(self.plates)
        direction = np.array(_three("direction", self.direction, "-"))
        if not direction.any():
            raise ValueError("PlateRadiation: direction must not be zero [-]")
        checked(
            self,
            direction=tuple(float(x) for x in direction / np.linalg.norm(direction)),
            flux=number("flux", self.flux, "W/m^2", positive=True),
            reflectivity=number("reflectivity", self.reflectivity, "-", nonnegative=True),
        )
        if self.reflectivity > 1:
            raise ValueError(f"PlateRadiation: reflectivity must be 0 to 1 [-]; got {self.reflectivity:g}")

    def wrench(self, t: Any, body: Body, m: Any) -> tuple[Any, Any]:
        toward, mirror = body.rotation.T @ as_column(self.direction), self.reflectivity

        def push(facing: Any, normal: Any) -> Any:
            return -self.flux / LIGHT * facing * ((1 - mirror) * toward + 2 * mirror * facing * normal)

        return self.plates.wrench(body.rotation, toward, push)


def _check_plates(plates: Any) -> None:
    if not isinstance(plates, Plates):
        raise ValueError(f"plates must be dmoc.Plates(areas, normals, offsets); got {short(plates)}")


def _of_time(name: str, function: Callable) -> None:
    """Raise ValueError unless a function of the time gives three numbers."""
    remedy = "it must take a CasADi time [s] and give 3 numbers: write it with casadi's functions"
    if (count := tried(name, function, [ca.SX.sym("t")], remedy)) != 3:
        raise ValueError(f"{name} must give 3 numbers; it gives {count}")


def _three(name: str, value: Any, unit: str) -> tuple[float, ...]:
    found = vector(name, value, unit)
    if len(found) != 3:
        raise ValueError(f"{name} must have three entries [{unit}]; got {short(value)}")
    return found
