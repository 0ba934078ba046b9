"""Solution: what a solve found, in SI units, with what it took; saved to and loaded from netCDF."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dmoc.mesh import Guess
from dmoc.problem import TransferProblem


class SolveError(RuntimeError):
    """Raised by `Solution.raise_for_status` when the optimisation failed."""


@dataclass(frozen=True)
class Level:
    """One rung of the ladder from coarse to fine."""

    order: int
    steps: int
    iterations: int
    objective: float
    build_s: float
    solve_s: float
    status: str


@dataclass(frozen=True)
class Solution:
    """The answer to a transfer problem on the last mesh, whether it succeeded or not.

    Attributes
    ----------
    path : Guess
        Positions [m], controls, masses [kg], boundary velocities [m/s] and multipliers on the mesh.
    time : array, shape (nodes,)
        Times of the nodes [s].
    force : array, shape (nodes, axes), or (steps, axes) with hold
        Force of the actuator [N].
    velocity, momentum : arrays, shape (steps+1, axes)
        At the step ends, from the discrete Legendre transforms [m/s]; momentum is per unit mass.
    costate : array, shape (nodes, axes)
        Multipliers of the discrete Euler-Lagrange equations [unit of the objective per m/s].
    status, message : str
        What the solver said, and what to try if it failed.
    ladder : tuple of Level
        The meshes on the way, coarse to fine.
    worst : tuple of (str, float)
        Names of the worst scaled constraint violations of a failed solve, with their sizes.
    """

    problem: TransferProblem
    path: Guess
    velocity: np.ndarray
    momentum: np.ndarray
    force: np.ndarray
    objective: float
    success: bool
    status: str
    message: str
    ladder: tuple[Level, ...]
    stationarity: float
    worst: tuple[tuple[str, float], ...] = ()
    details: dict[str, Any] = field(default_factory=dict, compare=False)

    @property
    def order(self) -> int:
        return self.path.order

    @property
    def hold(self) -> bool:
        return self.path.hold

    @property
    def steps(self) -> int:
        return len(self.path.mesh) - 1

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return self.path.duration

    @property
    def time(self) -> np.ndarray:
        return self.problem.start_time + self.duration * self.path.fractions

    @property
    def end_times(self) -> np.ndarray:
        """Times of the step ends [s], shape (steps+1,)."""
        return self.problem.start_time + self.duration * self.path.mesh

    @property
    def position(self) -> np.ndarray:
        """Positions of the nodes [m], shape (nodes, axes)."""
        return self.path.position

    @property
    def final_mass(self) -> float:
        """Mass at the goal [kg]."""
        return float(self.path.mass[-1])

    @property
    def costate(self) -> np.ndarray:
        return self.path.multipliers["smooth:row:dynamics"]

    @property
    def iterations(self) -> int:
        """Iterations of Ipopt on all meshes."""
        return sum(level.iterations for level in self.ladder)

    @property
    def build_s(self) -> float:
        """Seconds spent on building NLPs."""
        return sum(level.build_s for level in self.ladder)

    @property
    def solve_s(self) -> float:
        """Seconds spent in Ipopt."""
        return sum(level.solve_s for level in self.ladder)

    def raise_for_status(self) -> Solution:
        """Itself if the solve succeeded.

        Raises
        ------
        SolveError
            With what failed and what to try.
        """
        if not self.success:
            raise SolveError(f"{self.status}: {self.message}")
        return self
