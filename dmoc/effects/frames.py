"""Frames that move: rotation, the neighbourhood of a circular orbit, the restricted three-body problem."""

from __future__ import annotations

from typing import Any

import casadi as ca

from dmoc.basics.arguments import Vector, checked, number, vector
from dmoc.basics.records import dataclass
from dmoc.effects.base import Conservative, Effect
from dmoc.effects.gravity import PointGravity
from dmoc.effects.user_functions import as_column


@dataclass(frozen=True)
class RotatingFrame(Conservative):
    """Coordinates that turn at a constant rate: l = v . (w x q) + |w x q|^2 / 2.

    Positions and velocities are those seen in the turning frame; the momentum dl/dv is the
    velocity seen from outside.

    Parameters
    ----------
    rate : float or sequence of 3 floats
        Angular velocity w [rad/s]; a number turns about the z axis.
    """

    rate: float | Vector

    def __post_init__(self) -> None:
        try:
            single = len(self.rate) == 1  # type: ignore[arg-type]
        except TypeError:
            single = True
        rate = number("rate", self.rate, "rad/s") if single else vector("rate", self.rate, "rad/s")
        if not single and len(rate) != 3:  # type: ignore[arg-type]
            raise ValueError(f"rate must be one number (about z) or 3 numbers [rad/s]; got {self.rate!r}")
        checked(self, rate=rate)

    def check_dimension(self, dimension: int) -> None:
        if dimension == 1 or (dimension == 2 and isinstance(self.rate, tuple)):
            raise ValueError(
                f"RotatingFrame: rate {self.rate!r} has no meaning in {dimension} dimensions; "
                "a number needs 2 or 3 dimensions, a vector 3"
            )

    def lagrangian(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        rate = as_column(self.rate)
        if rate.numel() == 3:
            drift = ca.cross(rate, q)
        else:
            drift = ca.vertcat(-rate * q[1], rate * q[0], *([0] if q.numel() == 3 else []))
        return ca.dot(v, drift) + 0.5 * ca.dot(drift, drift)

    def turns_frame(self) -> bool:
        return True


@dataclass(frozen=True)
class ClohessyWiltshire(Conservative):
    """Motion relative to a body on a circular orbit, linearised: x radial, y along track, z normal.

    l = 2 n x vy + 3/2 n^2 x^2 - 1/2 n^2 z^2, which gives the Clohessy-Wiltshire equations
    x'' = 3 n^2 x + 2 n y', y'' = -2 n x', z'' = -n^2 z.

    Parameters
    ----------
    mean_motion : float
        n [rad/s] of the reference orbit.

    References
    ----------
    W. H. Clohessy, R. S. Wiltshire, Terminal guidance system for satellite rendezvous (1960).
    """

    mean_motion: float

    def __post_init__(self) -> None:
        checked(self, mean_motion=number("mean_motion", self.mean_motion, "rad/s", positive=True))

    def check_dimension(self, dimension: int) -> None:
        if dimension == 1:
            raise ValueError("ClohessyWiltshire needs 2 (x radial, y along track) or 3 dimensions; got 1")

    def lagrangian(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        n = self.mean_motion
        planar = 2 * n * q[0] * v[1] + 1.5 * (n * q[0]) ** 2
        return planar if q.numel() == 2 else planar - 0.5 * (n * q[2]) ** 2


def three_body(mass_ratio: float) -> tuple[Effect, ...]:
    """The circular restricted three-body problem in its turning frame, as a tuple of effects.

    Units are canonical: distance of the two primaries 1, their mass 1, rate of the frame 1; the
    larger stands at (-mass_ratio, 0, 0), the smaller at (1 - mass_ratio, 0, 0). With two axes it is the
    planar problem.

    Parameters
    ----------
    mass_ratio : float
        Mass of the smaller primary over the sum, between 0 and 1 [-].

    Raises
    ------
    ValueError
        If the ratio is not between 0 and 1.
    """
    ratio = number("mass_ratio", mass_ratio, "-", positive=True)
    if ratio >= 1:
        raise ValueError(f"mass_ratio must lie between 0 and 1 [-]; got {ratio:g}")
    return (
        RotatingFrame(1.0),
        PointGravity(1 - ratio, (-ratio, 0.0, 0.0)),
        PointGravity(ratio, (1 - ratio, 0.0, 0.0)),
    )
