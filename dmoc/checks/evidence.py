"""A solution together with the numbers that its checks need, each computed once."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from dmoc.motion.dynamics import Dynamics
from dmoc.motion.flown import Flown, flown
from dmoc.motion.lobatto import scheme
from dmoc.motion.march import force_of
from dmoc.motion.mesh import node_weights, step_nodes
from dmoc.motion.momenta import end_momenta, legendre_momenta, node_velocities, step_matrices
from dmoc.results.solution import Solution
from dmoc.scene.problem import TransferProblem

# The rounding error of a number counts as ten times the smallest relative one [-]: several additions lie
# between the numbers of a solution and those that a check compares.
ROUNDING = 10 * np.finfo(float).eps


class Evidence:
    """The numbers of one solution: momenta, velocities, forces, and the scales they are judged by."""

    def __init__(self, solution: Solution):
        self.solution, self.path = solution, solution.path
        self.problem: TransferProblem = solution.require_problem()
        self.dynamics = Dynamics.of(self.problem)
        self.rule, self.begin = scheme(self.path.order), self.problem.start_time
        self.time = self.begin + self.path.duration * self.path.fractions
        self.at = step_nodes(len(self.path.mesh) - 1, self.rule)
        self.ends = slice(None, None, self.rule.degree)
        self.weights = self.path.duration * node_weights(self.path.mesh, self.rule)
        self.position, self.mass = self.path.position, self.path.mass
        self.force = force_of(self.dynamics, self.path.control)
        self.momenta = legendre_momenta(self.dynamics, self.path, self.begin)
        self.momentum, self.velocity = end_momenta(self.dynamics, self.path, self.begin, self.momenta)

    def undefined(self) -> str:
        """The names of the arrays that hold a number that is not finite; empty if there is none."""
        parts: dict[str, Any] = {
            "mesh": self.path.mesh,
            "duration": self.path.duration,
            "position": self.position,
            "control": self.path.control,
            "mass": self.mass,
            "start velocity": self.path.start_velocity,
            "goal velocity": self.path.goal_velocity,
            "velocity": self.velocity,
            "force of an effect": self.pulls,
        }
        return ", ".join(name for name, values in parts.items() if not np.isfinite(values).all())

    def misreported(self) -> float:
        """How far velocity, momentum and force of the solution are off those of its path [-]."""
        solution, largest = self.solution, self.largest or 1.0
        reports = (
            (solution.velocity, self.velocity, self.speed),
            (solution.momentum, self.momentum, np.abs(self.momentum).max() or 1.0),
            (solution.force, self.force, largest),
        )
        if any(np.shape(reported) != true.shape for reported, true, _ in reports):
            return np.inf
        return float(np.max([np.abs(reported - true).max() / scale for reported, true, scale in reports]))

    @cached_property
    def flown(self) -> Flown:
        """The control between nodes."""
        return flown(self.dynamics, self.path)

    @cached_property
    def node_velocity(self) -> np.ndarray:
        """Velocity at every node: from the momenta at the step ends, of a polynomial with those inside."""
        return node_velocities(self.path, self.velocity)

    @cached_property
    def point(self) -> tuple[np.ndarray, np.ndarray]:
        """dl/dq and F/m of the effects at every node, each of shape (nodes, axes) [m/s^2]."""
        state = self.time[None], self.position.T, self.node_velocity.T, self.mass[None]
        dldq, _, push = self.dynamics.point(*state)
        return dldq.full().T, ca.densify(push).full().T

    @property
    def pulls(self) -> np.ndarray:
        """Accelerations by potentials and by other effects at every node, shape (nodes, 2 axes) [m/s^2]."""
        return np.concatenate(self.point, axis=1)

    def boundary_momentum(self, place: int) -> np.ndarray:
        """dl/dv of the boundary state at the start (0) or the goal (-1) [m/s]."""
        velocity = self.path.goal_velocity if place else self.path.start_velocity
        state = self.time[place], self.position[place], velocity, self.mass[place]
        return self.dynamics.point(*state)[1].full().ravel()

    @cached_property
    def matrices(self) -> np.ndarray:
        """Derivative of the one-step map along the path, shape (steps, 2 axes, 2 axes) [SI]."""
        return step_matrices(self.dynamics, self.path, self.begin)

    # The checks judge those numbers by the scales that follow.

    @cached_property
    def largest(self) -> float:
        """Largest component of the force used [N]."""
        return float(np.abs(self.force).max(initial=0.0))

    @cached_property
    def acceleration(self) -> float:
        """The largest acceleration in play, of the scene or of the actuator [m/s^2]."""
        return float(max(np.abs(self.pulls).max(), self.largest / self.mass.min()))

    @cached_property
    def extent(self) -> float:
        """Diagonal of the box around the path [m]; at least a billionth of what it could cover."""
        return max(self.path.diagonal, 1e-9 * self.acceleration * self.path.duration**2) or 1.0

    @cached_property
    def speed(self) -> float:
        """Largest speed at the step ends [m/s]; at least what crosses the extent in the duration."""
        return max(float(np.linalg.norm(self.velocity, axis=1).max()), self.extent / self.path.duration)

    @cached_property
    def typical_force(self) -> float:
        """The force that moves the mass over the extent in the duration [N]."""
        return float(self.mass.max()) * self.extent / self.path.duration**2

    @cached_property
    def rounding(self) -> float:
        """Ten times the rounding error of a position [m]: far from the origin no check can be stricter."""
        return ROUNDING * float(np.abs(self.position).max())

    @cached_property
    def shortest(self) -> float:
        """Shortest time between nodes, about [s]."""
        return float(self.path.duration * np.diff(self.path.mesh).min() / self.rule.degree)
