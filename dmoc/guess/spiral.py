"""A path between two orbits around one attractor: an orbit that changes evenly, and the motion along it."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.memory import remembered
from dmoc.basics.numerics import adams
from dmoc.basics.records import dataclass


@dataclass(frozen=True)
class Spiral:
    """From the orbit of a start to that of a goal in a given time; three axes, from the attractor.

    Angular momentum h and eccentricity vector e go in straight lines from one orbit to the other, so
    neither circles nor flat orbits are special. The direction u to the body turns as on the orbit of
    the moment, du/dt = h x u / r^2 with r = h^2 / (mu (1 + e . u)): the path needs little force, and
    its angle comes out by itself. One end keeps its place, the other one is where the motion leads.
    """

    mu: float
    center: np.ndarray
    duration: float
    start: tuple[np.ndarray, np.ndarray]
    goal: tuple[np.ndarray, np.ndarray]
    from_goal: bool = False

    @property
    def eccentricity(self) -> float:
        """Eccentricity of the end where it is larger [-]."""
        return float(np.linalg.norm(self._elements[1], axis=1).max())

    @property
    def climb(self) -> float:
        """Change of the distance from the attractor [m]."""
        return float(abs(np.linalg.norm(self.goal[0]) - np.linalg.norm(self.start[0])))

    @property
    def velocity_change(self) -> float:
        """Rough velocity change under a small thrust [m/s], after T. N. Edelbaum, ARS Journal 31 (1961)."""
        h, e = self._elements
        lengths = np.linalg.norm(h, axis=1)
        slow, fast = sorted(self.mu / lengths)
        tilt = np.arccos(np.clip(h[0] @ h[1] / lengths.prod(), -1.0, 1.0))
        across = np.cos(min(0.5 * np.pi * tilt, np.pi))
        # Edelbaum's law holds between circles; a change of the eccentricity adds about V / 2 for each unit.
        circles = np.sqrt(slow**2 + fast**2 - 2 * slow * fast * across)
        return float(circles + 0.5 * fast * np.linalg.norm(e[1] - e[0]))

    def states(self, fractions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions [m] and velocities [m/s] of the orbits of the moment, shape (count, 3).

        At increasing fractions of the duration. NaN where there is no angular momentum.
        """
        turning = remembered(_turning, "turning")
        constants = np.concatenate(self._elements).T, self.mu, self.duration
        begin, sign, place = (1.0, -1, self.goal[0]) if self.from_goal else (0.0, 1, self.start[0])
        passed, direction = ca.SX.sym("passed"), ca.SX.sym("direction", 3)
        rate = sign * turning(begin + sign * passed, direction, *constants)[0]
        motion = {"t": passed, "x": direction, "ode": rate}
        march = adams(motion, (sign * (fractions - begin))[::sign], tol=1e-9, most_steps=10_000_000)
        try:
            directions = march(x0=place / np.linalg.norm(place))["xf"].full()[:, ::sign]
        except RuntimeError:
            directions = np.full((3, len(fractions)), np.nan)
        _, q, v = turning(fractions[None], directions, *constants)
        return q.full().T, v.full().T

    @cached_property
    def _elements(self) -> tuple[np.ndarray, np.ndarray]:
        """h and e of the start and of the goal, each of shape (2, 3)."""
        q, v = (np.stack(parts) for parts in zip(self.start, self.goal, strict=True))
        h = np.cross(q, v)
        return h, np.cross(v, h) / self.mu - q / np.linalg.norm(q, axis=1, keepdims=True)


def _turning() -> ca.Function:
    """Fraction, direction, h and e of both ends, mu, duration -> rate of the direction, position, velocity."""
    fraction, direction, ends = ca.SX.sym("fraction"), ca.SX.sym("direction", 3), ca.SX.sym("ends", 3, 4)
    mu, duration = ca.SX.sym("mu"), ca.SX.sym("duration")
    share = ca.vertcat(1 - fraction, fraction)
    h, e = ends[:, :2] @ share, ends[:, 2:] @ share
    # A straight line between two vectors h of different direction is too short in between: its length is set.
    # Then e and the direction are put back into the plane across h.
    h = h * (ca.dot(share, ca.vertcat(ca.norm_2(ends[:, 0]), ca.norm_2(ends[:, 1]))) / ca.norm_2(h))
    square = ca.sumsqr(h)
    e = e - h * (ca.dot(h, e) / square)
    u = direction - h * (ca.dot(h, direction) / square)
    u = u / ca.norm_2(u)
    # Near the open side of a parabola or hyperbola r would be infinite: it is at most 20 h^2 / mu.
    r = square / mu / ca.fmax(1 + ca.dot(e, u), 0.05)
    rate = duration / r**2 * ca.cross(h, direction)
    given = [fraction, direction, ends, mu, duration]
    return ca.Function("turning", given, [rate, r * u, mu / square * ca.cross(h, e + u)])


# After the fraction x of the time a winding has gone x + bend x (1 - x) of the way between two orbits, with a
# bend of at most this size [-]: it would no longer grow all along with a bend beyond 1.
MOST_BENT = 0.9
# A bend that is not enough is exceeded by at most this [-]: the speed then leaves the range between both
# orbits, by no more than a tenth.
MOST_BEYOND = 0.1
# The time along a winding is summed up at this many places a revolution.
SAMPLES_A_TURN = 100
# The number of revolutions is corrected at most this many times, each time by the time that the last one takes.
ROUNDS = 5


def _axes(h: Any, k: Any) -> tuple[np.ndarray, np.ndarray]:
    """The equinoctial axes in the orbit's plane."""
    square = 1 + h * h + k * k
    first = np.array([1 + h * h - k * k, 2 * h * k, -2 * k]) / square
    return first, np.array([2 * h * k, 1 - h * h + k * k, 2 * h]) / square
