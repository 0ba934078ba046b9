"""Air: how dense it is, how it moves, and the forces by which it resists."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import casadi as ca

from dmoc.basics.arguments import checked, matching_length, number, short, vector
from dmoc.basics.records import dataclass
from dmoc.effects.base import Force, Part
from dmoc.effects.user_functions import as_column, is_zero, tried

# Drag computes the speed |w| against the air as sqrt(|w|^2 + SPEED_FLOOR^2) [m/s], which has derivatives of
# every order at rest too; a micrometre a second changes no force that matters.
SPEED_FLOOR = 1e-6


@dataclass(frozen=True)
class Wind(Part):
    """The velocity of the air over the ground, for the argument `wind` of an atmosphere.

    `Drag(area, drag_coefficient, UniformAtmosphere(1.2, wind=Wind((-3, 0))))` is a drag with a wind.

    Parameters
    ----------
    field : sequence of float or callable
        [m/s], one entry an axis; or a function (t, q) of the time [s] and the position [m], written with
        casadi's functions, that gives it.
    """

    field: Any

    def __post_init__(self) -> None:
        if not callable(self.field):
            checked(self, field=vector("wind", self.field, "m/s"))

    def check_dimension(self, dimension: int) -> None:
        """Raise ValueError unless the field gives one velocity an axis."""
        remedy = (
            "it must take a CasADi time [s] and position [m] and give a velocity [m/s]: write it with "
            "casadi's functions (casadi.cos, not math.cos)"
        )
        symbols = [ca.SX.sym("t"), ca.SX.sym("q", dimension)]
        entries = tried(f"wind in {dimension} dimensions", self.velocity, symbols, remedy)
        matching_length(self, "the velocity", entries, dimension)

    def velocity(self, t: Any, q: Any) -> Any:
        """Velocity of the air [m/s]."""
        return as_column(self.field(t, q) if callable(self.field) else self.field)


class Atmosphere(Part):
    """Density and velocity of the air; derive from this, as a frozen dataclass, for one of your own.

    Whoever implements an atmosphere

    1. gives `density_at` with CasADi operations alone, smooth, never negative, and finite at places where only
       a guess goes, such as the inside of a planet;
    2. gives `velocity_at` if the air moves: wind, or rotation with the planet;
    3. overrides `check_dimension` where it has no meaning in one, two or three dimensions.

    Not its business: the force, which `Drag` makes of density and velocity, and the body's area.
    """

    def check_dimension(self, dimension: int) -> None:
        """Raise ValueError if the atmosphere has no meaning in this many dimensions."""

    @abstractmethod
    def density_at(self, t: Any, q: Any) -> Any:
        """Density [kg/m^3] at a time [s] and a position [m]."""

    def velocity_at(self, t: Any, q: Any) -> Any:
        """Velocity of the air there [m/s], a column; 0 if it is at rest."""
        return 0

    def body_radius(self) -> float:
        """Radius of the body at the origin that the air is around [m], 0 where there is none."""
        return 0.0


@dataclass(frozen=True)
class UniformAtmosphere(Atmosphere):
    """Air of the same density everywhere.

    Parameters
    ----------
    density : float
        [kg/m^3], 1.225 at sea level.
    wind : Wind, sequence of float or callable, optional
        Velocity of the air [m/s]; see `Wind`.
    """

    density: float
    wind: Any = None

    def __post_init__(self) -> None:
        checked(
            self,
            density=number("density", self.density, "kg/m^3", nonnegative=True),
            wind=checked_wind(self.wind),
        )

    def check_dimension(self, dimension: int) -> None:
        if self.wind is not None:
            self.wind.check_dimension(dimension)

    def density_at(self, t: Any, q: Any) -> Any:
        return self.density

    def velocity_at(self, t: Any, q: Any) -> Any:
        return 0 if self.wind is None else self.wind.velocity(t, q)


class AroundABody(Atmosphere):
    """Air whose density hangs on the height above a sphere around the origin, and that may turn with it."""

    radius: float
    rate: float
    wind: Any

    def body_radius(self) -> float:
        return self.radius

    def check_dimension(self, dimension: int) -> None:
        if dimension == 1:
            raise ValueError(f"{type(self).__name__} needs 2 or 3 dimensions; got 1")
        if self.wind is not None:
            self.wind.check_dimension(dimension)

    def height_at(self, q: Any) -> Any:
        """Height above the sphere [m]."""
        # At the centre of the sphere the square root alone has no derivative; the second term gives it one, and
        # is lost in rounding outside of the sphere.
        return ca.sqrt(ca.dot(q, q) + (1e-9 * self.radius) ** 2) - self.radius

    def velocity_at(self, t: Any, q: Any) -> Any:
        drift = 0 if self.wind is None else self.wind.velocity(t, q)
        if is_zero(self.rate):
            return drift
        return drift + self.rate * ca.vertcat(-q[1], q[0], *([0] if q.numel() == 3 else []))


@dataclass(frozen=True)
class ExponentialAtmosphere(AroundABody):
    """Air around a sphere at the origin, thinner with height: density exp((height - h)/scale_height).

    h = |q| - radius is the height of the body. The air turns with the sphere about the z axis: its velocity
    is rate (-y, x, 0). Deeper than five scale heights under the surface the density stays what it is there,
    so that a guess through the sphere does no harm.

    Parameters
    ----------
    density : float
        At the reference height [kg/m^3].
    height : float
        Reference height above the surface [m].
    scale_height : float
        Climb over which the density falls by the factor e [m].
    radius : float
        Radius of the sphere [m].
    rate : float
        Angular velocity of sphere and air [rad/s], 7.2921e-5 for the Earth.
    wind : Wind, sequence of float or callable, optional
        Velocity of the air on top of that [m/s]; see `Wind`.

    References
    ----------
    D. A. Vallado, Fundamentals of Astrodynamics and Applications, 4th edition (2013), section 8.6.2,
    table 8-4 (densities and scale heights of the Earth by height).
    """

    density: float
    height: float
    scale_height: float
    radius: float
    rate: float = 0.0
    wind: Any = None

    def __post_init__(self) -> None:
        checked(
            self,
            density=number("density", self.density, "kg/m^3", nonnegative=True),
            height=number("height", self.height, "m"),
            scale_height=number("scale_height", self.scale_height, "m", positive=True),
            radius=number("radius", self.radius, "m", positive=True),
            rate=number("rate", self.rate, "rad/s"),
            wind=checked_wind(self.wind),
        )
        if self.height >= self.radius:
            raise ValueError(
                f"ExponentialAtmosphere: height is above the surface and must be less than the radius; "
                f"got {self.height:g} and {self.radius:g} m"
            )

    def density_at(self, t: Any, q: Any) -> Any:
        above = ca.fmax(self.height_at(q), -5 * self.scale_height)
        return self.density * ca.exp((self.height - above) / self.scale_height)


@dataclass(frozen=True)
class Drag(Force):
    """Resistance of the air, with the square of the speed: F = -1/2 density drag_coefficient area |w| w.

    w is the velocity against the air; |w| is rounded to sqrt(|w|^2 + (1e-6 m/s)^2), so that all derivatives
    are finite at rest.

    Parameters
    ----------
    area : float
        Cross section [m^2].
    drag_coefficient : float
        About 2.2 for a satellite, 1 for a blunt body in air [-].
    atmosphere : Atmosphere
        `ExponentialAtmosphere`, `UniformAtmosphere` or your own: density and wind.

    References
    ----------
    H. D. Curtis, Orbital Mechanics for Engineering Students, 3rd edition (2014), section 12.4.
    """

    area: float
    drag_coefficient: float
    atmosphere: Atmosphere

    def __post_init__(self) -> None:
        checked(
            self,
            area=number("area", self.area, "m^2", nonnegative=True),
            drag_coefficient=number("drag_coefficient", self.drag_coefficient, "-", nonnegative=True),
        )
        if not isinstance(self.atmosphere, Atmosphere):
            raise ValueError(
                f"atmosphere must be a dmoc.Atmosphere; got {short(self.atmosphere)}: for one density [kg/m^3] "
                "everywhere give UniformAtmosphere(density)"
            )

    def body_radius(self) -> float:
        return self.atmosphere.body_radius()

    def check_dimension(self, dimension: int) -> None:
        self.atmosphere.check_dimension(dimension)

    def force(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        against = v - self.atmosphere.velocity_at(t, q)
        speed = ca.sqrt(ca.dot(against, against) + SPEED_FLOOR**2)
        density = self.atmosphere.density_at(t, q)
        return -0.5 * self.drag_coefficient * self.area * density * speed * against


@dataclass(frozen=True)
class LinearDrag(Force):
    """Resistance in proportion to the speed: F = -coefficient (v - wind).

    Parameters
    ----------
    coefficient : float
        Force per speed [N s/m].
    wind : Wind, sequence of float or callable, optional
        Velocity of the air [m/s]; see `Wind`.
    """

    coefficient: float
    wind: Any = None

    def __post_init__(self) -> None:
        checked(
            self,
            coefficient=number("coefficient", self.coefficient, "N s/m", nonnegative=True),
            wind=checked_wind(self.wind),
        )

    def check_dimension(self, dimension: int) -> None:
        if self.wind is not None:
            self.wind.check_dimension(dimension)

    def force(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        return -self.coefficient * (v if self.wind is None else v - self.wind.velocity(t, q))


def checked_wind(value: Any) -> Wind | None:
    return value if value is None or isinstance(value, Wind) else Wind(value)
