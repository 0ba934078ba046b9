"""Modified equinoctial elements, and how an acceleration changes them."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.records import dataclass
from dmoc.scene.problem import TransferProblem


@dataclass(frozen=True)
class Elements:
    """Modified equinoctial elements around an attractor, in units in which its mu is 1.

    p, f, g, (h, k,) L of M. J. H. Walker, B. Ireland and J. Owens, Celestial Mechanics 36 (1985); without h and
    k in the plane. The third axis of their frame is across the orbit of the start.
    """

    mu: float
    length: float
    center: np.ndarray
    frame: np.ndarray

    @classmethod
    def of(cls, problem: TransferProblem, state: tuple[np.ndarray, np.ndarray]) -> Elements:
        lone, n = problem.attraction.lone, problem.dimension
        assert lone is not None
        center = lone.place(n)
        q, v = (np.pad(part, (0, 3 - n)) for part in (state[0] - center, state[1]))
        normal = np.cross(q, v)
        out = q / np.linalg.norm(q)
        normal = normal / np.linalg.norm(normal)
        frame = np.stack([out, np.cross(normal, out), normal])[:, :n]
        return cls(lone.mu, float(np.linalg.norm(q)), center, frame)

    @property
    def axes(self) -> int:
        return self.frame.shape[1]

    @property
    def slow(self) -> int:
        """How many elements stay on an orbit."""
        return 5 if self.axes == 3 else 3

    @property
    def time(self) -> float:
        """The unit of time [s]."""
        return float(np.sqrt(self.length**3 / self.mu))

    @property
    def speed(self) -> float:
        """The unit of speed [m/s]."""
        return self.length / self.time

    def found(self, state: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        """The elements of a state [m], [m/s]; the angle L within a revolution."""
        q = self.frame @ (state[0] - self.center) / self.length
        v = self.frame @ state[1] / self.speed
        spin = np.cross(q, v)
        size = np.linalg.norm(spin)
        x, y, z = spin / size
        h, k = -y / (1 + z), x / (1 + z)
        first = np.array([1 - k * k + h * h, 2 * h * k, -2 * k]) / (1 + h * h + k * k)
        second = np.array([2 * h * k, 1 + k * k - h * h, 2 * h]) / (1 + h * h + k * k)
        e = np.cross(v, spin) - q / np.linalg.norm(q)
        angle = np.arctan2(q @ second, q @ first)
        tilt = [h, k] if self.slow == 5 else []
        return np.array([size**2, e @ first, e @ second, *tilt, angle])

    def state(self, slow: Any, angle: Any) -> tuple[Any, Any, Any]:
        """Position [m], velocity [m/s] and the axes out, along and across, one a column, in CasADi."""
        p, f, g = slow[0], slow[1], slow[2]
        h, k = (slow[3], slow[4]) if self.slow == 5 else (0, 0)
        cos, sin, square = ca.cos(angle), ca.sin(angle), 1 + h * h + k * k
        first = ca.vertcat(1 - k * k + h * h, 2 * h * k, -2 * k) / square
        second = ca.vertcat(2 * h * k, 1 + k * k - h * h, 2 * h) / square
        r = p / (1 + f * cos + g * sin)
        out, along = cos * first + sin * second, cos * second - sin * first
        v = (-(sin + g) * first + (cos + f) * second) / ca.sqrt(p)
        turned = ca.DM(self.frame).T
        axes = ca.horzcat(out, along, ca.cross(out, along))
        return ca.DM(self.center) + self.length * turned @ (r * out), self.speed * turned @ v, turned @ axes

    def effect(self, slow: Any, angle: Any) -> Any:
        """d(elements)/dt for an acceleration out, along and across: Gauss's equations, shape (slow + 1, 3)."""
        p, f, g = slow[0], slow[1], slow[2]
        h, k = (slow[3], slow[4]) if self.slow == 5 else (0, 0)
        cos, sin = ca.cos(angle), ca.sin(angle)
        w, tilt = 1 + f * cos + g * sin, h * sin - k * cos
        rows = [
            ca.horzcat(0, 2 * p / w, 0),
            ca.horzcat(sin, ((w + 1) * cos + f) / w, -g * tilt / w),
            ca.horzcat(-cos, ((w + 1) * sin + g) / w, f * tilt / w),
            ca.horzcat(0, 0, (1 + h * h + k * k) * cos / (2 * w)),
            ca.horzcat(0, 0, (1 + h * h + k * k) * sin / (2 * w)),
            ca.horzcat(0, 0, tilt / w),
        ]
        if self.slow == 3:
            rows = [*rows[:3], rows[5]]
        return ca.sqrt(p) * ca.vertcat(*rows)

    def motion(self, slow: Any) -> Any:
        """Revolutions a unit of time, times 2 pi, without thrust and other effects."""
        return ((1 - slow[1] ** 2 - slow[2] ** 2) / slow[0]) ** 1.5

    def speed_around(self, slow: Any, angle: Any) -> Any:
        """dL/dt there, without thrust and other effects."""
        return ca.sqrt(slow[0]) * ((1 + slow[1] * ca.cos(angle) + slow[2] * ca.sin(angle)) / slow[0]) ** 2
