"""An orbit that changes evenly between two states around an attractor."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from dmoc.basics.numerics import cross, cubic_spline, root
from dmoc.basics.records import dataclass
from dmoc.guess.spiral import MOST_BENT, MOST_BEYOND, ROUNDS, SAMPLES_A_TURN, _axes


@dataclass(frozen=True)
class Winding:
    """Revolutions from one state to another around one attractor; three axes, from the attractor.

    The modified equinoctial elements of M. J. H. Walker, Celestial Mechanics 36 (1985), change as the
    least effort changes them while the orbit is nearly a circle of speed V, averaged over a revolution.
    The mean square of the thrust per unit mass is then (dV/dt)^2 + 2 V^2 (di/dt)^2 + 0.4 V^2 (de/dt)^2 (the
    best thrust swings with the angle L: across as cos L, along and up as 2 cos L and sin L), so the
    optimum is a straight line in polar coordinates, passed evenly. The body moves as fast as on the orbit
    of the moment. The number of revolutions is the one that takes about the duration, plus `more`; the time
    that is left over goes into an earlier or later change of the orbit, and if that is not enough into a
    higher or lower orbit on the way, by a parabola: the least effort for a phase alone.
    """

    mu: float
    duration: float
    start: tuple[np.ndarray, np.ndarray]
    goal: tuple[np.ndarray, np.ndarray]
    more: int = 0

    def positions(self, fractions: np.ndarray) -> np.ndarray:
        """At these fractions of the duration, shape (count, 3) [m]."""
        times = self._times(self.turns, self.bend)
        at = cubic_spline(times / times[-1], self._grid(self.turns)[0])(fractions)
        begin, swept = self._swept(self.turns)
        elements, longitude = self._elements(self._even(at), self.bend), begin + at * swept
        cos, sin = np.cos(longitude), np.sin(longitude)
        radius, axes = self._radius(elements, cos, sin), _axes(*elements[3:])
        return radius[:, None] * (axes[0] * cos + axes[1] * sin).T @ self._frame

    @property
    def eccentricity(self) -> float:
        """Eccentricity of the end where it is larger [-]."""
        return max(float(np.hypot(*elements[1:3])) for elements, _ in self._ends)

    @cached_property
    def turns(self) -> int:
        """Whole revolutions beyond the angle between the ends."""
        # The time is nearly proportional to the angle, so their ratio corrects any first number.
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
        return self._swept(0)[1] > 0 or self.turns > 0

    @property
    def velocity_change(self) -> float:
        """Mean thrust per unit mass (root mean square) times the duration, if no phase were to be met [m/s]."""
        (first, _), (last, _) = self._ends
        fast, slow = first[0] ** -0.5, last[0] ** -0.5
        return float(np.sqrt(self.mu * (fast**2 + slow**2 - 2 * fast * slow * np.cos(self._angle))))

    @cached_property
    def bend(self) -> float:
        """How much earlier than evenly the orbit changes [-]; beyond 0.9 it goes above or below both."""

        def excess(bend: float) -> float:
            return self._time(self.turns, bend) - self.duration

        if abs(excess(0.0)) < 1e-6 * self.duration:
            return 0.0
        most = MOST_BENT + MOST_BEYOND
        # Where no bend meets the duration, the one is taken that misses it least.
        if excess(-most) * excess(most) > 0:
            return min(0.0, -most, most, key=lambda bend: abs(excess(bend)))
        return root(excess, -most, most, 1e-6)

    def _time(self, turns: int, bend: float = 0.0) -> float:
        return float(self._times(turns, bend)[-1])

    def _times(self, turns: int, bend: float) -> np.ndarray:
        """The times at the fractions of the angle [s]: dt = r^2 / sqrt(mu p) dL."""
        _, time, cos, sin, pieces = self._grid(turns)
        elements = self._elements(time, bend)
        pace = self._radius(elements, cos, sin) ** 2 / np.sqrt(self.mu * elements[0])
        return np.append(0.0, np.cumsum(0.5 * (pace[1:] + pace[:-1]) * pieces))

    def _grid(self, turns: int) -> tuple[np.ndarray, ...]:
        """Even fractions of the angle, those of the time of an even change; of L cosine, sine and steps."""
        if turns not in self._grids:
            at = np.linspace(0.0, 1.0, SAMPLES_A_TURN * (turns + 1) + 1)
            begin, swept = self._swept(turns)
            longitude = begin + at * swept
            cos, sin = np.cos(longitude), np.sin(longitude)
            self._grids[turns] = at, self._even(at), cos, sin, np.diff(longitude)
        return self._grids[turns]

    @cached_property
    def _grids(self) -> dict[int, tuple[np.ndarray, ...]]:
        return {}

    def _swept(self, turns: int) -> tuple[float, float]:
        """The angle L at the start, and how much of it is passed."""
        begin, end = (longitude for _, longitude in self._ends)
        end = begin + (end - begin) % (2 * np.pi) + 2 * np.pi * turns
        return begin, end - begin

    def _elements(self, time: np.ndarray, bend: float) -> np.ndarray:
        """p, f, g, h, k of the moment, shape (5, count), at fractions of the time of an even change."""
        (first, _), (last, _) = self._ends
        bent = float(np.clip(bend, -MOST_BENT, MOST_BENT))
        speed, share = self._line(time + bent * time * (1 - time))
        # Beyond the largest bend a parabola in the speed leads above or below both orbits.
        upward = 1 if last[0] >= first[0] else -1
        speed = speed * (1 - 4 * upward * (bend - bent) * time * (1 - time))
        others = first[1:, None] + share * (last - first)[1:, None]
        return np.concatenate([[speed**-2], others])

    def _line(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Root of 1/p, and the share of the change of the other elements, at fractions of the time."""
        (first, _), (last, _) = self._ends
        fast, slow, angle = first[0] ** -0.5, last[0] ** -0.5, self._angle
        x, y = fast + time * (slow * np.cos(angle) - fast), time * slow * np.sin(angle)
        return np.hypot(x, y), np.arctan2(y, x) / angle if angle > 1e-6 else time

    @cached_property
    def _angle(self) -> float:
        """The angle between the speeds of both ends whose cost is that of the changes of e and of the plane."""
        (first, _), (last, _) = self._ends
        # At an angle of pi the line would pass through a speed of 0, which no orbit has.
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
    def _radius(elements: np.ndarray, cos: np.ndarray, sin: np.ndarray) -> np.ndarray:
        return elements[0] / (1 + elements[1] * cos + elements[2] * sin)

    @cached_property
    def _frame(self) -> np.ndarray:
        """Rows: three axes, the last one along the mean angular momentum."""
        spins = [cross(*state) for state in (self.start, self.goal)]
        normal = sum(spin / np.linalg.norm(spin) for spin in spins)
        normal = normal / np.linalg.norm(normal)
        first = cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
        first /= np.linalg.norm(first)
        return np.stack([first, cross(normal, first), normal])

    @cached_property
    def _ends(self) -> list[tuple[np.ndarray, float]]:
        """(p, f, g, h, k) and L of the start and of the goal."""
        found = []
        for q, v in ((self._frame @ part for part in state) for state in (self.start, self.goal)):
            spin = cross(q, v)
            x, y, z = spin / np.linalg.norm(spin)
            # Elements count from the mean plane, so 1 + z vanishes only for opposite orbits, which are left
            # out.
            h, k = -y / (1 + z), x / (1 + z)
            first, second = _axes(h, k)
            e = cross(v, spin) / self.mu - q / np.linalg.norm(q)
            elements = np.array([spin @ spin / self.mu, e @ first, e @ second, h, k])
            found.append((elements, float(np.arctan2(q @ second, q @ first))))
        return found
