"""A path between two orbits around one attractor: an orbit that changes evenly, and the motion along it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.adams import adams
from dmoc.basics.memory import kept
from dmoc.basics.numerics import cubic_spline


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
        """The larger of the two ends'."""
        return float(np.linalg.norm(self._elements[1], axis=1).max())

    @property
    def climb(self) -> float:
        """Change of the distance from the attractor [m]."""
        return float(abs(np.linalg.norm(self.goal[0]) - np.linalg.norm(self.start[0])))

    @property
    def velocity_change(self) -> float:
        """About what it takes under a small thrust [m/s], after T. N. Edelbaum, ARS Journal 31 (1961)."""
        h, e = self._elements
        lengths = np.linalg.norm(h, axis=1)
        slow, fast = sorted(self.mu / lengths)
        tilt = np.arccos(np.clip(h[0] @ h[1] / lengths.prod(), -1.0, 1.0))
        across = np.cos(min(0.5 * np.pi * tilt, np.pi))
        circles = np.sqrt(slow**2 + fast**2 - 2 * slow * fast * across)
        return float(circles + 0.5 * fast * np.linalg.norm(e[1] - e[0]))

    def states(self, fractions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions [m] and velocities [m/s] of the orbits of the moment, shape (count, 3).

        At increasing fractions of the duration. NaN where there is no angular momentum.
        """
        turning = kept(_turning, "turning")
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
    # the length of h does not shrink as it tilts, and e and the direction stay in the plane
    h = h * (ca.dot(share, ca.vertcat(ca.norm_2(ends[:, 0]), ca.norm_2(ends[:, 1]))) / ca.norm_2(h))
    square = ca.sumsqr(h)
    e = e - h * (ca.dot(h, e) / square)
    u = direction - h * (ca.dot(h, direction) / square)
    u = u / ca.norm_2(u)
    r = square / mu / ca.fmax(1 + ca.dot(e, u), 0.05)
    rate = duration / r**2 * ca.cross(h, direction)
    given = [fraction, direction, ends, mu, duration]
    return ca.Function("turning", given, [rate, r * u, mu / square * ca.cross(h, e + u)])


# The share of the way between two orbits, x + bend x (1 - x), grows all along for a bend within these;
# beyond, the speed leaves that between the orbits, by no more than a tenth.
MOST_BENT, MOST_BEYOND = 0.9, 0.1
SAMPLES_A_TURN, ROUNDS = 100, 5


@dataclass(frozen=True)
class Winding:
    """Revolutions from one state to another around one attractor; three axes, from the attractor.

    The modified equinoctial elements of M. J. H. Walker, Celestial Mechanics 36 (1985), change as the
    least effort changes them while the orbit is nearly a circle of speed V, averaged over a revolution.
    The mean square of the thrust per unit mass is then (dV/dt)^2 + 2 V^2 (di/dt)^2 + 0.4 V^2 (de/dt)^2 (the
    best thrust swings with the angle L: across as cos L, along and up as 2 cos L and sin L), so the
    optimum is a straight line in polar coordinates, passed evenly. The body moves as fast as on the orbit
    of the moment. The number of revolutions is the one that takes about the duration, or so many `more`;
    what is left goes into an earlier or later change of the orbit, and if that is not enough into a higher or
    lower orbit on the way, by a parabola: the least effort for a phase alone.
    """

    mu: float
    duration: float
    start: tuple[np.ndarray, np.ndarray]
    goal: tuple[np.ndarray, np.ndarray]
    more: int = 0

    def positions(self, fractions: np.ndarray) -> np.ndarray:
        """At these fractions of the duration, shape (count, 3) [m]."""
        at, times = self._times(self.turns, self.bend)
        elements, longitude = self._orbits(
            cubic_spline(times / times[-1], at)(fractions), self.turns, self.bend
        )
        radius, axes = self._radius(elements, longitude), _axes(*elements[3:])
        return radius[:, None] * (axes[0] * np.cos(longitude) + axes[1] * np.sin(longitude)).T @ self._frame

    @property
    def eccentricity(self) -> float:
        """The larger of the two ends'."""
        return max(float(np.hypot(*elements[1:3])) for elements, _ in self._ends)

    @cached_property
    def turns(self) -> int:
        """Whole revolutions beyond the angle between the ends."""
        turns = 10
        for _ in range(ROUNDS):
            taken, known = self._time(turns) or self._time(turns + 1), turns
            turns = max(round((turns + 1) * self.duration / taken) - 1, 0)
            if turns == known:
                break
        return max(turns + self.more, 0)

    @property
    def lasts(self) -> bool:
        """Whether there is a way at all: from a place to itself there is none without a revolution."""
        return self._time(self.turns) > 0

    @cached_property
    def bend(self) -> float:
        """How much earlier than evenly the orbit changes; beyond 0.9, how far above or below both orbits."""

        def excess(bend: float) -> float:
            return self._time(self.turns, bend) - self.duration

        if abs(excess(0.0)) < 1e-6 * self.duration:
            return 0.0
        most = MOST_BENT + MOST_BEYOND
        if excess(-most) * excess(most) > 0:
            return min(0.0, -most, most, key=lambda bend: abs(excess(bend)))
        return _root(excess, -most, most, 1e-6)

    def _time(self, turns: int, bend: float = 0.0) -> float:
        return float(self._times(turns, bend)[1][-1])

    def _times(self, turns: int, bend: float) -> tuple[np.ndarray, np.ndarray]:
        """Fractions of the angle and the times there [s]: dt = r^2 / sqrt(mu p) dL."""
        at = np.linspace(0.0, 1.0, SAMPLES_A_TURN * (turns + 1) + 1)
        elements, longitude = self._orbits(at, turns, bend)
        pace = self._radius(elements, longitude) ** 2 / np.sqrt(self.mu * elements[0])
        pieces = 0.5 * (pace[1:] + pace[:-1]) * np.diff(longitude)
        return at, np.append(0.0, np.cumsum(pieces))

    def _orbits(self, at: np.ndarray, turns: int, bend: float) -> tuple[np.ndarray, np.ndarray]:
        """p, f, g, h, k of the moment, shape (5, count), and L, at fractions of the angle."""
        (first, begin), (last, end) = self._ends
        end = begin + (end - begin) % (2 * np.pi) + 2 * np.pi * turns
        time = self._even(at)
        bent = float(np.clip(bend, -MOST_BENT, MOST_BENT))
        speed, share = self._line(time + bent * time * (1 - time))
        upward = 1 if last[0] >= first[0] else -1
        speed = speed * (1 - 4 * upward * (bend - bent) * time * (1 - time))
        others = first[1:, None] + share * (last - first)[1:, None]
        return np.concatenate([[speed**-2], others]), begin + at * (end - begin)

    def _line(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Root of 1/p, and the share of the change of the other elements, at fractions of the time."""
        (first, _), (last, _) = self._ends
        fast, slow, angle = first[0] ** -0.5, last[0] ** -0.5, self._angle
        x, y = fast + time * (slow * np.cos(angle) - fast), time * slow * np.sin(angle)
        return np.hypot(x, y), np.arctan2(y, x) / angle if angle > 1e-6 else time

    @cached_property
    def _angle(self) -> float:
        """What changes of e and of the plane cost as an angle between speeds, the costs of the two added."""
        (first, _), (last, _) = self._ends
        tilt = 4 * np.arctan(0.5 * np.linalg.norm(last[3:] - first[3:]))
        return min(float(np.sqrt(0.4 * np.sum((last - first)[1:3] ** 2) + 2 * tilt**2)), 0.75 * np.pi)

    @cached_property
    def _even(self) -> Any:
        """Fractions of the time at those of the angle: dL/dt = V^3/mu on a circle."""
        time = np.linspace(0.0, 1.0, SAMPLES_A_TURN + 1)
        pace = self._line(time)[0] ** 3
        angle = np.append(0.0, np.cumsum(0.5 * (pace[1:] + pace[:-1])))
        return cubic_spline(angle / angle[-1], time)

    @staticmethod
    def _radius(elements: np.ndarray, longitude: np.ndarray) -> np.ndarray:
        return elements[0] / (1 + elements[1] * np.cos(longitude) + elements[2] * np.sin(longitude))

    @cached_property
    def _frame(self) -> np.ndarray:
        """Rows: three axes, the last one along the mean angular momentum."""
        spins = [np.cross(*state) for state in (self.start, self.goal)]
        normal = sum(spin / np.linalg.norm(spin) for spin in spins)
        normal = normal / np.linalg.norm(normal)
        first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
        first /= np.linalg.norm(first)
        return np.stack([first, np.cross(normal, first), normal])

    @cached_property
    def _ends(self) -> list[tuple[np.ndarray, float]]:
        """(p, f, g, h, k) and L of the start and of the goal."""
        found = []
        for q, v in ((self._frame @ part for part in state) for state in (self.start, self.goal)):
            spin = np.cross(q, v)
            x, y, z = spin / np.linalg.norm(spin)
            h, k = -y / (1 + z), x / (1 + z)
            first, second = _axes(h, k)
            e = np.cross(v, spin) / self.mu - q / np.linalg.norm(q)
            elements = np.array([spin @ spin / self.mu, e @ first, e @ second, h, k])
            found.append((elements, float(np.arctan2(q @ second, q @ first))))
        return found


def _axes(h: Any, k: Any) -> tuple[np.ndarray, np.ndarray]:
    """The equinoctial axes in the orbit's plane."""
    square = 1 + h * h + k * k
    first = np.array([1 + h * h - k * k, 2 * h * k, -2 * k]) / square
    return first, np.array([2 * h * k, 1 - h * h + k * k, 2 * h]) / square


def _root(function: Callable[[float], float], a: float, b: float, tol: float) -> float:
    """Where a function changes its sign between a and b: false position by the Illinois rule.

    M. Dowell, P. Jarratt, BIT 11 (1971): an end that stays counts half, so that both come closer.
    """
    at_a, at_b = function(a), function(b)
    while at_b and abs(b - a) > tol:
        c = b - at_b * (b - a) / (at_b - at_a)
        at_c = function(c)
        a, at_a = (b, at_b) if at_b * at_c < 0 else (a, 0.5 * at_a)
        b, at_b = c, at_c
    return b
