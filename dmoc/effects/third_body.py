"""The pull of another body, seen from the body at the origin."""

from __future__ import annotations

from typing import Any

import casadi as ca

from dmoc.basics.arguments import checked, matching_length, number
from dmoc.basics.records import dataclass
from dmoc.effects.base import Conservative
from dmoc.effects.user_functions import given_motion, position_at


@dataclass(frozen=True)
class ThirdBody(Conservative):
    """Pull of a third body on coordinates that fall with the body at the origin.

    The acceleration is mu ((s - q)/|s - q|^3 - s/|s|^3), direct less indirect. With x = q.(q - 2 s)/|s|^2
    and R = |s - q|/|s| = sqrt(1 + x) its potential, which is zero at the origin, reads

        l = mu/(2 |s|) (x^2 (R + 2) / (R (1 + R)^2) - |q|^2/|s|^2),

    where nothing cancels, however distant the third body is or however close. There is no force at the
    origin; at the third body itself (q = s) the effect is undefined.

    Parameters
    ----------
    mu : float
        Gravitational parameter of the third body [m^3/s^2].
    position : callable or sequence of float
        Its position s relative to the origin [m]: a function of the time [s], for example
        `circular_motion`, `kepler_motion` or `tabulated_motion`, or a fixed point. Never zero.

    References
    ----------
    R. H. Battin, An Introduction to the Mathematics and Methods of Astrodynamics, revised edition
    (1999), chapter 8: the acceleration without cancellation, with the same x (his q); the potential
    here is its integral.
    """

    mu: float
    position: Any

    def __post_init__(self) -> None:
        checked(
            self,
            mu=number("mu", self.mu, "m^3/s^2", positive=True),
            position=given_motion("ThirdBody", "position", self.position),
        )
        if isinstance(self.position, tuple) and not any(self.position):
            raise ValueError(
                f"ThirdBody: position must not be the origin [m]; got {self.position!r}: "
                "the body there is a PointGravity"
            )

    def check_dimension(self, dimension: int) -> None:
        column = position_at(self.position, ca.SX.sym("t"), dimension)
        matching_length(self, "position", column.numel(), dimension)

    def lagrangian(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        s = position_at(self.position, t, q.numel())
        offset, distance = s - q, ca.dot(s, s)
        x = ca.dot(q, q - 2 * s) / distance
        # the same as sqrt(1 + x), but close to the third body, where x is near -1, the sum would lose digits
        ratio = ca.sqrt(ca.dot(offset, offset) / distance)
        tide = x * x * (ratio + 2) / (ratio * (1 + ratio) * (1 + ratio))
        return 0.5 * self.mu / ca.sqrt(distance) * (tide - ca.dot(q, q) / distance)
