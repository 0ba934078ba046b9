"""Air whose density is known at some heights: from a table, or from the model NRLMSIS 2.1."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import checked, number, short
from dmoc.basics.records import dataclass
from dmoc.effects.atmosphere import AroundABody, checked_wind

# The polynomial has at least and at most these degrees, and follows the table so closely if it can [-].
LOWEST, HIGHEST, CLOSE = 3, 16, 1e-3
# A table that it follows less closely than this is refused [-].
REFUSED = 0.1
# The model is asked at so many heights, evenly in their logarithm, and at these places of the globe [degrees].
HEIGHTS, LATITUDES, LONGITUDES = 181, np.arange(-85.0, 86.0, 10.0), np.arange(0.0, 360.0, 15.0)
# Rotation of the Earth [rad/s].
EARTH_RATE = 7.2921159e-5


@dataclass(frozen=True)
class TabulatedAtmosphere(AroundABody):
    """Air around a sphere at the origin, whose density is known at some heights.

    The logarithm of the density is the polynomial in the logarithm of the height that comes closest to the
    table, of the lowest degree up to 16 that is within 0.1 % of it. Above and below the table it goes on
    exponentially, as at its ends; deeper than the surface it stays what it is there. The air turns with the
    sphere about the z axis.

    Parameters
    ----------
    heights : sequence of float
        At least 4 increasing heights above the surface, all above it [m].
    densities : sequence of float
        Density at each [kg/m^3].
    radius : float
        Radius of the sphere [m].
    rate : float
        Angular velocity of sphere and air [rad/s], 7.2921e-5 for the Earth.
    wind : Wind, sequence of float or callable, optional
        Velocity of the air on top of that [m/s]; see `Wind`.
    source : str
        Where the table is from, for the words of a scene.

    Raises
    ------
    ValueError
        If the table has no meaning, or the polynomial is more than 10 % off somewhere in it.
    """

    heights: tuple
    densities: tuple
    radius: float
    rate: float = 0.0
    wind: Any = None
    source: str = ""

    def __post_init__(self) -> None:
        heights, densities = (_column(self, name) for name in ("heights", "densities"))
        if len(heights) < LOWEST + 1 or (np.diff(heights) <= 0).any() or heights[0] <= 0:
            raise ValueError(
                f"heights must be at least 4 increasing heights above 0 m; got {short(self.heights)}"
            )
        if len(densities) != len(heights) or (densities <= 0).any():
            raise ValueError(
                f"densities must be {len(heights)} positive numbers [kg/m^3], one a height; "
                f"got {short(self.densities)}"
            )
        if not isinstance(self.source, str):
            raise ValueError(f"source must be a text; got {short(self.source)}")
        checked(
            self,
            heights=tuple(heights.tolist()),
            densities=tuple(densities.tolist()),
            radius=number("radius", self.radius, "m", positive=True),
            rate=number("rate", self.rate, "rad/s"),
            wind=checked_wind(self.wind),
        )
        if self.error > REFUSED:
            raise ValueError(
                f"densities: the polynomial through their logarithms is {100 * self.error:.2g} % off; "
                "give a smoother table, or one of fewer heights"
            )

    @cached_property
    def _fit(self) -> tuple[np.polynomial.Chebyshev, float]:
        """The polynomial, and by how much it is off at most [-]."""
        x, y = np.log(self.heights), np.log(self.densities)
        found = None
        for degree in range(LOWEST, min(HIGHEST, len(x) - 1) + 1):
            # A table that spans little of a polynomial's reach has several that are as good.
            polynomial = np.polynomial.Chebyshev.fit(x, y, degree)
            off = float(np.abs(np.expm1(polynomial(x) - y)).max())
            if found is None or off < found[1]:
                found = polynomial, off
            if off < CLOSE:
                break
        assert found is not None
        return found

    @property
    def error(self) -> float:
        """By how much of itself the density is off at a height of the table at most [-]."""
        return self._fit[1]

    def _numbers(self) -> list[str]:
        """Where the table is from and how well it is met, in place of all its numbers."""
        low, high = (f"{height / 1e3:.6g}" for height in (self.heights[0], self.heights[-1]))
        source = [self.source] if self.source else []
        return [*source, f"a table from {low} to {high} km that is met to {100 * self.error:.2g} %"]

    def density_at(self, t: Any, q: Any) -> Any:
        height = self.height_at(q)
        low, high = self.heights[0], self.heights[-1]
        inside = ca.fmin(ca.fmax(height, low), high)
        polynomial = self._fit[0]
        # The slope over the height itself at both ends, for what is beyond them.
        ends = [polynomial.deriv()(math.log(end)) / end for end in (low, high)]
        below, above = ca.fmax(ca.fmin(height, low), 0.0) - low, ca.fmax(height, high) - high
        return ca.exp(_clenshaw(polynomial, ca.log(inside)) + ends[0] * below + ends[1] * above)


def msis_atmosphere(
    date: str,
    f107: float,
    ap: float,
    f107_mean: float | None = None,
    lowest: float = 120e3,
    highest: float = 1000e3,
    radius: float = 6378137.0,
    rate: float = EARTH_RATE,
    wind: Any = None,
) -> TabulatedAtmosphere:
    """The Earth's air on a date, from the model NRLMSIS 2.1 in a table made once, without a network.

    The density at each height is the mean over the globe at the date. By day and by night, or from pole to
    pole, it is at 400 km some 70 % above and 40 % below the mean, at 800 km twice and a third of it: `source`
    tells the least and the largest ratio in the table. The model itself is some 15 % off on quiet days.

    Parameters
    ----------
    date : str
        ISO text in UTC, such as "2025-06-01T12:00".
    f107 : float
        Radio flux of the Sun at 10.7 cm of the day before [1e-22 W/m^2/Hz], 70 quiet to 250 active.
    ap : float
        Planetary index of the magnetic field, mean of the day [-], 4 quiet to 400 storm.
    f107_mean : float, optional
        Mean flux of 81 days around it; `f107` if not given.
    lowest, highest : float
        Heights between which the table is [m].
    radius, rate : float
        Of the Earth and its air [m], [rad/s].
    wind : Wind, sequence of float or callable, optional
        As of `TabulatedAtmosphere`.

    Raises
    ------
    ValueError
        If pymsis is not installed (`pip install pymsis`), the date is none, or a number has no meaning.

    References
    ----------
    J. T. Emmert et al., NRLMSIS 2.0: A Whole-Atmosphere Empirical Model of Temperature and Neutral Species
    Densities, Earth and Space Science 8 (2021); version 2.1: Journal of Geophysical Research 127 (2022).
    """
    flux, field = number("f107", f107, "-", positive=True), number("ap", ap, "-", nonnegative=True)
    mean = flux if f107_mean is None else number("f107_mean", f107_mean, "-", positive=True)
    bottom, top = (number("height", height, "m", positive=True) for height in (lowest, highest))
    if not bottom < top:
        raise ValueError(f"lowest must be below highest; got {bottom:g} and {top:g} m")
    heights = np.geomspace(bottom, top, HEIGHTS)
    found = _asked(date, heights, flux, mean, field)
    weights = np.cos(np.radians(LATITUDES))[None, :, None]
    density = (found * weights).sum(axis=(0, 1)) / (weights.sum() * len(LONGITUDES))
    spread = found / density
    source = f"NRLMSIS 2.1 on {date}, F10.7 {flux:g} and {mean:g}, ap {field:g}, mean over the globe"
    source += f" ({spread.min():.2g} to {spread.max():.2g} times that by place)"
    return TabulatedAtmosphere(tuple(heights), tuple(density), radius, rate, wind, source)


def _asked(date: str, heights: np.ndarray, flux: float, mean: float, field: float) -> np.ndarray:
    """Densities [kg/m^3] over the globe, shape (longitudes, latitudes, heights)."""
    try:
        import pymsis
    except ImportError:
        raise ValueError("the air of a date needs pymsis: pip install pymsis") from None
    try:
        when = np.datetime64(date)
    except (TypeError, ValueError):
        raise ValueError(f'date must be ISO text such as "2025-06-01T12:00"; got {short(date)}') from None
    # All indices are given, so that pymsis asks no network for them.
    indices: dict[str, Any] = {"f107s": [flux], "f107as": [mean], "aps": [[field] * 7]}
    found = pymsis.calculate(when, LONGITUDES, LATITUDES, heights / 1e3, version=2.1, **indices)
    return np.asarray(found, float)[0, ..., pymsis.Variable.MASS_DENSITY]


def _clenshaw(polynomial: np.polynomial.Chebyshev, x: Any) -> Any:
    """A Chebyshev series at a CasADi expression (Clenshaw, 1955)."""
    offset, factor = polynomial.mapparms()
    u = offset + factor * x
    last = before = 0.0
    for coefficient in polynomial.coef[:0:-1].tolist():
        last, before = coefficient + 2 * u * last - before, last
    return float(polynomial.coef[0]) + u * last - before


def _column(part: Any, name: str) -> np.ndarray:
    """Numbers of a table."""
    try:
        values = np.asarray(getattr(part, name), float)
    except Exception:
        # the conversion of a user's own objects may raise anything
        values = np.array(np.nan)
    if values.ndim != 1 or not np.isfinite(values).all():
        unit = "m" if name == "heights" else "kg/m^3"
        raise ValueError(f"{name} must be finite numbers [{unit}]; got {short(getattr(part, name))}")
    return values
