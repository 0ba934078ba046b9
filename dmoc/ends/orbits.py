"""Ends of a transfer that are orbits around a point mass."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, checked, flag, number, vector
from dmoc.basics.records import dataclass
from dmoc.ends.base import Boundary
from dmoc.ends.elements import ELEMENTS, element_rows, nearest_state, plane_elements
from dmoc.parts.rows import Row


class _Around(Boundary):
    """The fields that orbits share: `mu` and `center` of an attractor. Without a center the axes are open."""

    mu: float
    center: Vector | None

    @property
    def dimension(self) -> int:
        return 0 if self.center is None else len(self.center)

    def with_dimension(self, dimension: int) -> Any:
        return replace(self, center=(0.0,) * dimension) if self.center is None else self  # type: ignore[type-var]

    def _check_attractor(self, spatial: bool, size: float | None) -> None:
        name = type(self).__name__
        checked(self, mu=number("mu", self.mu, "m^3/s^2", positive=True))
        center = (0.0, 0.0, 0.0) if spatial and self.center is None else self.center
        if center is not None:
            center = vector("center", center, "m")
            if len(center) == 1 or (spatial and len(center) == 2):
                needed = "3 axes" if spatial else "2 or 3 axes"
                raise ValueError(f"{name} needs {needed}; got center={center!r} with {len(center)}")
            # Coordinates of such an orbit would have fewer than four digits, and nothing could be solved.
            far = max(map(abs, center))
            if size is not None and abs(size) < 1e4 * math.ulp(far):
                raise ValueError(
                    f"{name}: center is {far:g} m from the origin, where places {abs(size):g} m apart are "
                    "the same number; put the origin nearer"
                )
        checked(self, center=center)

    def _anywhere(self, distance: float) -> tuple[np.ndarray, np.ndarray]:
        """A state on a circle around the center, on the x axis: an estimate from the distance [m] alone."""
        center = np.array(self.center)
        x, y = np.eye(len(center))[:2]
        return center + distance * x, math.sqrt(self.mu / distance) * y

    def _nearest(self, wanted: dict[str, float], near: tuple) -> tuple[np.ndarray, np.ndarray]:
        """The state near `near` that has these elements; in the plane its third entries are zero."""
        center = np.array(self.center)
        n = len(center)
        if not np.any(near[0] - center):
            # In the center itself no direction is nearer than another.
            near = self._anywhere(1.0)
        fill = np.zeros(3 - n)
        q, v = np.append(near[0] - center, fill), np.append(near[1], fill)
        offset, velocity = nearest_state(wanted, self.mu, q, v)
        return center + offset[:n], velocity[:n]


@dataclass(frozen=True)
class CircularOrbit(_Around):
    """Any point of a circular orbit, with the velocity of that orbit.

    In the plane |r| = radius and v = sqrt(mu / radius^3) z x r, three conditions; in space |r| = radius,
    |v|^2 = mu / radius and r . v = 0, or with a normal n . r = 0 and v = sqrt(mu / radius^3) n x r.

    Parameters
    ----------
    radius : float
        [m].
    mu : float
        Gravitational parameter of the attractor [m^3/s^2].
    center : sequence of float, optional
        Where the attractor is [m]; the origin if not given.
    normal : sequence of float, optional
        In space, the direction of the angular momentum; any if not given. For an inclination alone
        use `Orbit(mu, a=radius, e=0, i=inclination)`.
    clockwise : bool
        In the plane, the sense of the rotation.
    """

    radius: float
    mu: float
    center: Vector | None = None
    normal: Vector | None = None
    clockwise: bool = False

    def __post_init__(self) -> None:
        checked(self, radius=number("radius", self.radius, "m", positive=True))
        if self.normal is not None:
            normal = vector("normal", self.normal, "-")
            length = math.hypot(*normal)
            if len(normal) != 3 or length == 0:
                raise ValueError(f"CircularOrbit: normal must be a direction in space; got {self.normal!r}")
            checked(self, normal=tuple(x / length for x in normal))
        self._check_attractor(self.normal is not None, self.radius)
        checked(self, clockwise=flag("CircularOrbit: clockwise", self.clockwise))
        if self.clockwise and self.dimension == 3:
            raise ValueError("CircularOrbit: clockwise has no meaning in space; give normal=(0, 0, -1)")

    @property
    def adjustable(self) -> tuple[str, ...]:  # type: ignore[override]
        return ("radius", "mu", "center", *(["normal"] if self.normal is not None else []))

    @property
    def structure(self) -> tuple:
        return type(self), self.clockwise, self.normal is None

    def rows(self, t: Any, q: Any, v: Any, m: Any) -> list[Row]:
        offset = (q - self.center) / self.radius
        velocity = v / ca.sqrt(self.mu / self.radius)
        rows = [Row("radius", ca.dot(offset, offset), 1.0, 1.0)]
        if q.shape[0] == 2:
            turned = ca.vertcat(-offset[1], offset[0]) * (-1 if self.clockwise else 1)
        elif self.normal is None:
            radial = Row("radial", ca.dot(offset, velocity), 0.0, 0.0)
            return [*rows, Row("speed", ca.dot(velocity, velocity), 1.0, 1.0), radial]
        else:
            turned = ca.cross(self.normal, offset)
            rows.append(Row("plane", ca.dot(offset, self.normal), 0.0, 0.0))
        gap = velocity - turned
        axes = enumerate("xyz"[: q.shape[0]])
        return [*rows, *(Row(f"velocity.{axis}", gap[i], 0.0, 0.0) for i, axis in axes)]

    def estimate(self, t: float, near: tuple | None = None) -> tuple[np.ndarray, np.ndarray]:
        wanted: dict[str, Any] = {"a": self.radius, "e": 0.0}
        if self.normal is not None:
            wanted |= plane_elements(np.array(self.normal))
        elif self.dimension == 2:
            wanted["i"] = math.pi if self.clockwise else 0.0
        return self._nearest(wanted, near or self._anywhere(self.radius))

    def words(self) -> str:
        sense = "" if self.dimension != 2 else ", clockwise" if self.clockwise else ", counter-clockwise"
        plane = "" if self.normal is None else f", normal {_point(self.normal)}"
        where = "" if self.center is None else f" around {_point(self.center)} m"
        return f"any point of a circular orbit of radius {self.radius:g} m{where}{plane}{sense}"


@dataclass(frozen=True)
class Orbit(_Around):
    """Any state whose orbital elements are those given; elements that are None are free.

    Stated through the energy, the components e_r = h^2/(mu r) - 1 and e_s = -(r . v) h/(mu r) of the
    eccentricity vector along and across the position, and the direction of the angular momentum, so
    that neither e = 0 nor i = 0 is singular. Where an equation holds for two opposite directions, an
    inequality excludes the wrong one. In the plane there are a, e, argp (from the x axis), nu and i,
    which is 0 for counter-clockwise, pi for clockwise and None for either.

    Parameters
    ----------
    mu : float
        Gravitational parameter of the attractor [m^3/s^2].
    a : float, optional
        Semi-major axis [m], negative for a hyperbola.
    e : float, optional
        Eccentricity [-].
    i : float, optional
        Inclination [rad], 0 to pi.
    raan : float, optional
        Right ascension of the ascending node [rad]. It does not exist at i = 0 and pi.
    argp : float, optional
        Argument of the periapsis [rad]; at i = 0 and pi and in the plane, its angle from the x axis.
    nu : float, optional
        True anomaly [rad]. At e = 0 only argp + nu has a meaning: give both or neither.
    center : sequence of float, optional
        Where the attractor is [m]; the origin if not given.

    References
    ----------
    R. H. Battin, An Introduction to the Mathematics and Methods of Astrodynamics (1999), chapter 3.
    """

    mu: float
    a: float | None = None
    e: float | None = None
    i: float | None = None
    raan: float | None = None
    argp: float | None = None
    nu: float | None = None
    center: Vector | None = None

    def __post_init__(self) -> None:
        for name in ELEMENTS:
            value = getattr(self, name)
            if value is not None:
                unit = {"a": "m", "e": "-"}.get(name, "rad")
                checked(self, **{name: number(name, value, unit, nonnegative=name == "e")})
        if not self._given:
            raise ValueError("Orbit: every element is None; give at least one of " + ", ".join(ELEMENTS))
        self._check_attractor(self.raan is not None or self.i not in (None, 0.0, math.pi), self.a)
        self._check_elements()

    def _check_elements(self) -> None:
        a, e, i = self.a, self.e, self.i
        if a == 0:
            raise ValueError("Orbit: a must not be 0 m")
        if a is not None and e is not None and (e == 1 or (a > 0) != (e < 1)):
            raise ValueError(
                f"Orbit: no orbit has a = {a:g} m and e = {e:g}; an ellipse has a > 0 and e < 1, "
                "a hyperbola a < 0 and e > 1, and a parabola no a"
            )
        if i is not None and not 0 <= i <= math.pi:
            raise ValueError(f"Orbit: i must be within 0 and pi rad; got {i:g}; angles are not in degrees")
        if i in (0.0, math.pi) and self.raan is not None:
            raise ValueError(
                f"Orbit: raan does not exist at i = {i:g}; leave it out, argp counts from the x axis"
            )
        if e == 0 and (self.argp is None) != (self.nu is None):
            raise ValueError("Orbit: at e = 0 only argp + nu has a meaning; give both or neither")

    @property
    def _given(self) -> dict[str, float]:
        return {name: getattr(self, name) for name in ELEMENTS if getattr(self, name) is not None}

    @property
    def adjustable(self) -> tuple[str, ...]:  # type: ignore[override]
        # Other rows state e = 0, i = 0 and i = pi, so a change to or from one of these needs a new NLP.
        special = {"e": (0.0,), "i": (0.0, math.pi)}
        free = (name for name, value in self._given.items() if value not in special.get(name, ()))
        return ("mu", "center", *free)

    @property
    def structure(self) -> tuple:
        special = {name: value for name, value in self._given.items() if name not in self.adjustable}
        return type(self), self.adjustable, tuple(special.items())

    def rows(self, t: Any, q: Any, v: Any, m: Any) -> list[Row]:
        planar = q.shape[0] == 2
        fill = ca.SX.zeros(1 if planar else 0)
        return element_rows(self, ca.vertcat(q - self.center, fill), ca.vertcat(v, fill), planar)

    def estimate(self, t: float, near: tuple | None = None) -> tuple[np.ndarray, np.ndarray]:
        if near is None and self.a is None:
            return self.fixed()
        return self._nearest(self._given, near or self._anywhere(abs(self.a or 1.0)))

    def words(self) -> str:
        units = {"a": " m", "e": ""}
        elements = [f"{name} = {value:g}{units.get(name, ' rad')}" for name, value in self._given.items()]
        where = "" if self.center is None else f" around {_point(self.center)} m"
        return f"an orbit with {', '.join(elements)}{where}"


def _point(values: Vector) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"
