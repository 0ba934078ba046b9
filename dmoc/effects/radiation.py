"""Sunlight: its pressure, and the shadow of the body at the origin."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import checked, matching_length, number, short
from dmoc.basics.records import dataclass
from dmoc.effects.base import Force, Part
from dmoc.effects.user_functions import given_motion, position_at

# Pressure of sunlight on a black surface at one astronomical unit from the sun [N/m^2].
SOLAR_PRESSURE = 4.56e-6
# The mean distance of Earth and sun [m], exact by definition (IAU 2012).
ASTRONOMICAL_UNIT = 149_597_870_700.0
# A sun nearer to the origin than this [m] is refused: it must be a direction, or a position in other units, as
# the sun alone has a radius of 7e8 m.
NEAREST_SUN = 1e9


class Shadow(Part):
    """The shadow of a sphere at the origin; derive from this, as a frozen dataclass, for one of your own.

    Whoever implements a shadow gives `light`

    1. between 0 and 1, with CasADi operations alone, for columns of two and of three entries;
    2. with an edge of some width, since a jump has no derivative; a step of the path must not be longer;
    3. finite everywhere, also inside of the sphere, where only a guess goes.

    Not its business: the pressure, which `RadiationPressure` multiplies by the light, and where the sun is.
    """

    @abstractmethod
    def light(self, q: Any, sun: Any) -> Any:
        """Fraction of the sunlight at a position [m], 0 to 1; `sun` is the position of the sun [m]."""


@dataclass(frozen=True)
class CylindricalShadow(Shadow):
    """A cylinder behind a sphere at the origin, with a rounded edge.

    With x the distance behind the centre and y that from the axis, the light is
    1 - 1/4 (1 + tanh(sharpness (1 - y^2/radius^2)/2)) (1 + tanh(sharpness x/radius)): all derivatives exist
    everywhere, on the axis and at the centre too. From 12 % to 88 % of light is a way of
    2 radius / sharpness.

    Parameters
    ----------
    radius : float
        Radius of the sphere [m].
    sharpness : float
        Radius over half the width of the edge [-]; a step of the path should not be longer than the edge.
    """

    radius: float
    sharpness: float = 100.0

    def __post_init__(self) -> None:
        checked(
            self,
            radius=number("radius", self.radius, "m", positive=True),
            sharpness=number("sharpness", self.sharpness, "-", positive=True),
        )

    def light(self, q: Any, sun: Any) -> Any:
        behind, across = _behind(q, sun / ca.sqrt(ca.dot(sun, sun)))
        inside = 1 + ca.tanh(0.5 * self.sharpness * (1 - across / self.radius**2))
        return 1 - 0.25 * inside * (1 + ca.tanh(self.sharpness * behind / self.radius))


@dataclass(frozen=True)
class ConicalShadow(Shadow):
    """Umbra, penumbra and antumbra behind a sphere at the origin.

    Seen from the body, the discs of sphere and sun have the angular radii b = asin(radius/|q|) and
    a = atan(sun_radius/d), their centres are an angle c apart. With k = min(a, b), K = max(a, b) the light is
    1 - min(1, b^2/a^2) (1 - S((c - K)/(1.35 k))), where S is the quintic from 0 at -1 to 1 at 1: exactly
    dark in the umbra, exactly lit outside, twice continuously differentiable except at the apex of the
    umbra. Where b > 30 a (orbits as high as the geostationary one) it is within 0.02 of the overlap of the
    discs, within 0.15 anywhere. The penumbra is widened by 1.35 for that; a larger `sun_radius` widens it
    further, for an optimiser on a coarse mesh.

    Parameters
    ----------
    radius : float
        Radius of the sphere [m].
    sun_radius : float
        Radius of the sun [m].

    References
    ----------
    O. Montenbruck, E. Gill, Satellite Orbits (2000), section 3.4.2: the overlap of two discs.
    """

    radius: float
    sun_radius: float = 6.957e8

    def __post_init__(self) -> None:
        checked(
            self,
            radius=number("radius", self.radius, "m", positive=True),
            sun_radius=number("sun_radius", self.sun_radius, "m", positive=True),
        )

    def light(self, q: Any, sun: Any) -> Any:
        offset = sun - q
        distance = ca.sqrt(ca.dot(offset, offset))
        behind, across = _behind(q, offset / distance)
        # the angle between the two centres. The second term rounds it: by a thousandth of the radius on the
        # axis, where the angle alone has no derivative, and by half a millionth of the radius at the edge
        apart = ca.atan2(ca.sqrt(across + (1e-3 * self.radius) ** 2), behind)
        # inside of the sphere, where only a guess goes, the sphere is taken to fill half the sky
        beyond = ca.fmax(ca.dot(q, q) - self.radius**2, (1e-3 * self.radius) ** 2)
        sphere, disc = ca.atan2(self.radius, ca.sqrt(beyond)), ca.atan(self.sun_radius / distance)
        small, large = ca.fmin(sphere, disc), ca.fmax(sphere, disc)
        part = ca.fmin(1, ca.fmax(0, 0.5 + (apart - large) / (2.7 * small)))
        lit = part * part * part * (10 + part * (6 * part - 15))
        most = ca.fmin(1, sphere / disc)
        return 1 - most * most * (1 - lit)


@dataclass(frozen=True)
class RadiationPressure(Force):
    """Push of sunlight on a surface that faces the sun: F = -P (1 + reflectivity) area light (au/d)^2 e.

    P = 4.56e-6 N/m^2 at one astronomical unit; d and e are distance and direction of the sun from the
    body. Undefined at the sun itself.

    Parameters
    ----------
    area : float
        Cross section [m^2].
    reflectivity : float
        0 (black) to 1 (a mirror) [-]; the radiation pressure coefficient C_R is 1 + reflectivity.
    sun : callable or sequence of float
        Position of the sun [m]: a function of the time [s], for example `circular_motion`, or a fixed
        point: for a fixed direction 1.496e11 times its unit vector, for motion about the sun the origin.
    shadow : Shadow, optional
        `CylindricalShadow` or `ConicalShadow` of the body at the origin; none if not given.

    References
    ----------
    O. Montenbruck, E. Gill, Satellite Orbits (2000), section 3.4, equation (3.75).
    """

    area: float
    reflectivity: float
    sun: Any
    shadow: Shadow | None = None

    def __post_init__(self) -> None:
        checked(
            self,
            area=number("area", self.area, "m^2", nonnegative=True),
            reflectivity=number("reflectivity", self.reflectivity, "-"),
        )
        if not 0 <= self.reflectivity <= 1:
            raise ValueError(
                f"reflectivity must lie between 0 (black) and 1 (mirror) [-]; got {self.reflectivity:g}: "
                "for a radiation pressure coefficient C_R give C_R - 1"
            )
        checked(self, sun=given_motion("RadiationPressure", "sun", self.sun))
        if self.shadow is not None and not isinstance(self.shadow, Shadow):
            raise ValueError(
                "shadow must be a dmoc.Shadow such as CylindricalShadow(radius) or None; "
                f"got {short(self.shadow)}"
            )
        self._check_distance()

    def _check_distance(self) -> None:
        if callable(self.sun):
            return
        distance = float(np.linalg.norm(self.sun))
        if distance == 0 and self.shadow is not None:
            raise ValueError("RadiationPressure: the sun is at the origin [m], so nothing there casts a shadow")
        if 0 < distance < NEAREST_SUN:
            raise ValueError(
                f"RadiationPressure: sun must be a position [m], not a direction; got one at {distance:g} m: "
                f"multiply a direction by {ASTRONOMICAL_UNIT:.4g} m"
            )

    def check_dimension(self, dimension: int) -> None:
        column = position_at(self.sun, ca.SX.sym("t"), dimension)
        matching_length(self, "sun", column.numel(), dimension)
        if dimension == 1 and self.shadow is not None:
            raise ValueError("RadiationPressure: a shadow needs 2 or 3 dimensions; got 1")

    def force(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        sun = position_at(self.sun, t, q.numel())
        offset = sun - q
        squared = ca.dot(offset, offset)
        strength = SOLAR_PRESSURE * ASTRONOMICAL_UNIT**2 * (1 + self.reflectivity) * self.area
        push = -strength / (squared * ca.sqrt(squared)) * offset
        return push if self.shadow is None else self.shadow.light(q, sun) * push


def _behind(q: Any, sunward: Any) -> tuple[Any, Any]:
    """Distance behind the origin [m], and squared distance from the axis of the shadow [m^2]."""
    behind = -ca.dot(q, sunward)
    across = q + behind * sunward
    return behind, ca.dot(across, across)
