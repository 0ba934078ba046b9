"""Where other bodies are: positions as functions of the time, for `ThirdBody` and `RadiationPressure`.

A motion is any function of the time [s] that gives a CasADi column [m] (2 or 3 entries). Those made
here are values: they compare equal, can be hashed and pickled. In the plane a motion of 3 entries
whose third is identically zero gives its first two.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import checked, number
from dmoc.basics.records import dataclass
from dmoc.effects.base import Part


def circular_motion(radius: float, rate: float, phase: float = 0.0, inclination: float = 0.0) -> CircularMotion:
    """A body on a circle: radius (cos u, cos i sin u, sin i sin u) with u = phase + rate t.

    Parameters
    ----------
    radius : float
        Distance from the origin [m].
    rate : float
        Angular velocity [rad/s].
    phase : float
        Angle from the x axis at t = 0 [rad].
    inclination : float
        Tilt i of the circle about the x axis [rad].

    Returns
    -------
    CircularMotion
        A function of the time [s] that gives the position [m].

    Raises
    ------
    ValueError
        If the radius is not positive or a number is not finite.
    """
    return CircularMotion(radius, rate, phase, inclination)


def kepler_motion(
    mu: float, a: float, e: float, i: float, node: float, argument: float, mean_anomaly: float
) -> KeplerMotion:
    """A body on an ellipse about the origin, by Kepler's equation E - e sin E = M.

    Newton's method runs a fixed number of times from M + e sin M / sqrt(1 - 2 e cos M + e^2), so that
    the position is smooth in the time; it is exact to round-off up to e = 0.99.

    Parameters
    ----------
    mu : float
        Gravitational parameter of the origin, plus that of the body if it matters [m^3/s^2].
    a : float
        Semi-major axis [m].
    e : float
        Eccentricity, 0 to 0.99 [-].
    i : float
        Inclination [rad].
    node : float
        Longitude of the ascending node [rad].
    argument : float
        Argument of the pericentre [rad].
    mean_anomaly : float
        Mean anomaly at t = 0 [rad].

    Returns
    -------
    KeplerMotion
        A function of the time [s] that gives the position [m].

    Raises
    ------
    ValueError
        If a number is out of range.

    References
    ----------
    R. H. Battin, An Introduction to the Mathematics and Methods of Astrodynamics, revised edition
    (1999), chapters 3 (orbit in space) and 5 (Kepler's equation).
    """
    return KeplerMotion(mu, a, e, i, node, argument, mean_anomaly)


def tabulated_motion(times: Any, positions: Any) -> TabulatedMotion:
    """A body whose positions are known at some times, joined by a cubic spline.

    The error is of order 4 in the spacing; velocity and acceleration are continuous. Outside of the
    table the body goes on straight ahead: let the table cover the whole transfer.

    Parameters
    ----------
    times : sequence of float
        At least 4 increasing times [s].
    positions : array, shape (count, dimension)
        Positions then [m].

    Returns
    -------
    TabulatedMotion
        A function of the time [s] that gives the position [m].

    Raises
    ------
    ValueError
        If the times do not increase or the shapes do not fit.
    """
    return TabulatedMotion(times, positions)


@dataclass(frozen=True)
class CircularMotion(Part):
    """On a circle; made by `circular_motion`.

    Parameters
    ----------
    radius : float
        [m]
    rate : float
        [rad/s]
    phase, inclination : float
        [rad]
    """

    radius: float
    rate: float
    phase: float
    inclination: float

    def __post_init__(self) -> None:
        checked(
            self,
            radius=number("radius", self.radius, "m", positive=True),
            rate=number("rate", self.rate, "rad/s"),
            phase=number("phase", self.phase, "rad"),
            inclination=number("inclination", self.inclination, "rad"),
        )

    def __call__(self, t: Any) -> Any:
        u = self.phase + self.rate * t
        across = self.radius * ca.sin(u)
        return ca.vertcat(
            self.radius * ca.cos(u), math.cos(self.inclination) * across, math.sin(self.inclination) * across
        )


@dataclass(frozen=True)
class KeplerMotion(Part):
    """On an ellipse; made by `kepler_motion`.

    Parameters
    ----------
    mu : float
        [m^3/s^2]
    a : float
        [m]
    e : float
        [-]
    i, node, argument, mean_anomaly : float
        [rad]
    """

    mu: float
    a: float
    e: float
    i: float
    node: float
    argument: float
    mean_anomaly: float

    def __post_init__(self) -> None:
        checked(
            self,
            mu=number("mu", self.mu, "m^3/s^2", positive=True),
            a=number("a", self.a, "m", positive=True),
            e=number("e", self.e, "-", nonnegative=True),
        )
        if self.e > 0.99:
            raise ValueError(
                f"e must not exceed 0.99 [-]; got {self.e:g}: give such a motion as a table (tabulated_motion)"
            )
        angles = ("i", "node", "argument", "mean_anomaly")
        checked(self, **{name: number(name, getattr(self, name), "rad") for name in angles})

    def __call__(self, t: Any) -> Any:
        e, mean = self.e, self.mean_anomaly + math.sqrt(self.mu / self.a) / self.a * t
        anomaly = mean + e * ca.sin(mean) / ca.sqrt(1 - 2 * e * ca.cos(mean) + e * e)
        # the number of iterations is fixed, so that the expression is one for all times. Newton's method
        # doubles the digits: two iterations reach round-off up to e = 0.3, six up to 0.99
        for _ in range(2 if e <= 0.3 else 6):
            anomaly -= (anomaly - e * ca.sin(anomaly) - mean) / (1 - e * ca.cos(anomaly))
        along = self.a * (ca.cos(anomaly) - e)
        across = self.a * math.sqrt(1 - e * e) * ca.sin(anomaly)
        toward, ahead = self._axes()
        return ca.vertcat(*[x * along + y * across for x, y in zip(toward, ahead, strict=True)])

    def _axes(self) -> tuple[tuple, tuple]:
        """Unit vectors to the pericentre and 90 degrees ahead of it."""
        (cn, sn), (cw, sw), (ci, si) = (
            (math.cos(angle), math.sin(angle)) for angle in (self.node, self.argument, self.i)
        )
        toward = (cn * cw - sn * sw * ci, sn * cw + cn * sw * ci, sw * si)
        return toward, (-cn * sw - sn * cw * ci, -sn * sw + cn * cw * ci, cw * si)


@dataclass(frozen=True)
class TabulatedMotion(Part):
    """Through a table, by a cubic spline; made by `tabulated_motion`.

    Parameters
    ----------
    times : sequence of float
        [s]
    positions : array
        [m]
    """

    times: tuple
    positions: tuple

    def __post_init__(self) -> None:
        try:
            times, positions = np.asarray(self.times, float), np.asarray(self.positions, float)
        except Exception:
            # the conversion of a user's own objects may raise anything
            raise ValueError("times and positions must be numbers [s], [m]") from None
        if times.ndim != 1 or len(times) < 4 or not np.isfinite(times).all() or (np.diff(times) <= 0).any():
            raise ValueError(
                f"times must be at least 4 finite increasing times [s]; got an array of shape {times.shape}"
            )
        good = positions.ndim == 2 and len(positions) == len(times) and 1 <= positions.shape[1] <= 3
        if not good or not np.isfinite(positions).all():
            raise ValueError(
                f"positions must be finite, of shape ({len(times)}, dimension), one row a time [m]; "
                f"got shape {positions.shape}"
            )
        checked(
            self,
            times=tuple(times.tolist()),
            positions=tuple(map(tuple, positions.tolist())),
        )

    @cached_property
    def _spline(self) -> tuple[ca.Function, ca.Function]:
        values = np.ravel(self.positions).tolist()
        position = ca.interpolant("position", "bspline", [list(self.times)], values)
        t = ca.MX.sym("t")
        return position, ca.Function("slope", [t], [ca.jacobian(position(t), t)], {"never_inline": True})

    def at(self, times: np.ndarray) -> np.ndarray:
        """Positions at times within the table [m], shape (count, dimension)."""
        return np.array(self._spline[0](np.asarray(times, float)[None, :])).T

    def __call__(self, t: Any) -> Any:
        position, slope = self._spline
        # CasADi's spline is zero outside of its table; the motion goes on straight ahead there instead
        inside = ca.fmin(ca.fmax(t, self.times[0]), self.times[-1])
        return position(inside) + slope(inside) * (t - inside)
