"""A path between two orbits around one attractor: an orbit that changes evenly, and the motion along it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


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
        """Positions [m] and velocities [m/s] of the orbits of the moment, shape (count, 3)."""
        from scipy.integrate import solve_ivp

        begin, end, place = (1.0, 0.0, self.goal[0]) if self.from_goal else (0.0, 1.0, self.start[0])
        settings = {"method": "DOP853", "rtol": 1e-7, "atol": 1e-9, "dense_output": True}
        arc = solve_ivp(self._turn, (begin, end), place / np.linalg.norm(place), **settings)
        h, e = self._orbits(fractions)
        u, r = self._places(h, e, arc.sol(fractions).T)
        return r * u, self.mu / (h * h).sum(axis=1, keepdims=True) * np.cross(h, e + u)

    def _turn(self, fraction: float, direction: np.ndarray) -> np.ndarray:
        h, e = self._orbits(np.array([fraction]))
        _, r = self._places(h, e, direction[None])
        (x, y, z), (a, b, c) = h[0], direction
        return np.array([y * c - z * b, z * a - x * c, x * b - y * a]) * (self.duration / r[0, 0] ** 2)

    def _places(self, h: np.ndarray, e: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unit vectors in the planes of the orbits, and the distances there."""
        square = (h * h).sum(axis=1, keepdims=True)
        u = direction - h * ((h * direction).sum(axis=1, keepdims=True) / square)
        u = u / np.sqrt((u * u).sum(axis=1, keepdims=True))
        return u, square / self.mu / np.maximum(1 + (e * u).sum(axis=1, keepdims=True), 0.05)

    def _orbits(self, fractions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """h and e of each moment: the length of h does not shrink as it tilts, and e stays in the plane."""
        h, e = self._elements
        share = np.stack([1 - fractions, fractions], axis=1)
        h_now, e_now, length = share @ h, share @ e, share @ self._spins
        square = (h_now * h_now).sum(axis=1)
        e_now = e_now - h_now * ((h_now * e_now).sum(axis=1) / square)[:, None]
        return h_now * (length / np.sqrt(square))[:, None], e_now

    @cached_property
    def _elements(self) -> tuple[np.ndarray, np.ndarray]:
        """h and e of the start and of the goal, each of shape (2, 3)."""
        q, v = (np.stack(parts) for parts in zip(self.start, self.goal, strict=True))
        h = np.cross(q, v)
        return h, np.cross(v, h) / self.mu - q / np.linalg.norm(q, axis=1, keepdims=True)

    @cached_property
    def _spins(self) -> np.ndarray:
        return np.linalg.norm(self._elements[0], axis=1)
