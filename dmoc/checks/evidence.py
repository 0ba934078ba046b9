"""A solution together with the numbers that its checks need, each computed once."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.numerics import columns
from dmoc.configurations.acting import point_function
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.flown import Flown, flown
from dmoc.motion.lobatto import scheme
from dmoc.motion.march import force_of
from dmoc.motion.mesh import node_weights, step_nodes
from dmoc.motion.momenta import (
    along_path,
    end_momenta,
    legendre_momenta,
    node_velocities,
    step_matrices,
    velocity_along,
    without_reactions,
)
from dmoc.motion.scales import LEAST_TURN, Scales, least_extent, path_scales, wheel_momentum
from dmoc.results.solution import Solution, reported
from dmoc.scene.problem import TransferProblem

# The rounding error of a number counts as ten times the smallest relative one [-]: several additions lie
# between the numbers of a solution and those that a check compares.
ROUNDING = 10 * np.finfo(float).eps


class Evidence:
    """The numbers of one solution: momenta, velocities, forces, and the scales they are judged by.

    These scales do not fall below `least`, an extent [m] and a speed [m/s]: a leg may stand still.
    """

    def __init__(self, solution: Solution, least: tuple[float, float] = (0.0, 0.0)):
        self.least = least
        self.solution, self.path = solution, solution.path
        self.problem: TransferProblem = solution.require_problem()
        self.dynamics = Dynamics.of(self.problem)
        self.rule, self.begin = scheme(self.path.order), self.problem.start_time
        self.time = self.begin + self.path.duration * self.path.fractions
        self.at = step_nodes(len(self.path.mesh) - 1, self.rule)
        self.ends = slice(None, None, self.rule.degree)
        self.weights = self.path.duration * node_weights(self.path.mesh, self.rule)
        self.position, self.mass = self.path.position, self.path.mass
        self.wrench = force_of(self.dynamics, self.path)
        self.momenta = legendre_momenta(self.dynamics, self.path, self.begin)
        self.momentum, self.velocity = end_momenta(self.dynamics, self.path, self.begin, self.momenta)
        self.speeds, self.rates = self.path.coordinates.speeds, self.path.coordinates.rates

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
        true = reported(self.path, self.velocity, self.momentum, self.wrench)
        floors = {
            "velocity": self.speed,
            "rate": self.rate,
            "force": self.largest,
            "torque": self.largest_torque,
        }
        gaps = []
        for name, values in true.items():
            told = getattr(self.solution, name)
            if np.shape(told) != values.shape:
                return np.inf
            scale = floors.get(name) or np.abs(values).max(initial=0.0) or 1.0
            gaps.append(np.abs(told - values).max(initial=0.0) / scale)
        return float(np.max(gaps))

    @cached_property
    def flown(self) -> Flown:
        """The control between nodes."""
        return flown(self.dynamics, self.path)

    @cached_property
    def node_velocity(self) -> np.ndarray:
        """dq/dt at every node: from the momenta at the step ends, of a polynomial with those inside."""
        return node_velocities(
            self.path, velocity_along(self.dynamics, self.position[self.ends], self.velocity)
        )

    @cached_property
    def loads(self) -> tuple[np.ndarray, np.ndarray]:
        """What potentials and what other effects do at every node along Z(q), each of shape (nodes, freedom).

        Per unit mass: accelerations [m/s^2], then torques in body axes [m^2/s^2].
        """
        resting = point_function(self.problem.effects, self.dynamics.configuration, kinetic=False)
        state = self.time, self.position.T, self.node_velocity.T, self.mass
        dldq, _, push = columns(resting, *state)
        pull, work = (along_path(self.dynamics, self.position, part.T) for part in (dldq, push))
        return pull, work

    def per_mass(self, wrench: np.ndarray | float, mass: np.ndarray) -> np.ndarray:
        """Forces and torques, one row a place, per unit mass [m/s^2], [m^2/s^2]."""
        share = np.ones_like(mass) * self.dynamics.configuration.turning_share(mass)
        return wrench / mass[:, None] * np.where(self.rates, share[:, None], 1.0)

    @property
    def pulls(self) -> np.ndarray:
        """Accelerations by potentials and by other effects at every node, shape (nodes, 2 axes) [m/s^2]."""
        return np.concatenate([load[:, self.speeds] for load in self.loads], axis=1)

    def boundary_momentum(self, place: int) -> np.ndarray:
        """Z' dl/dv of the boundary state at the start (0) or the goal (-1) [m/s], [m^2/s]."""
        velocity = self.path.goal_velocity if place else self.path.start_velocity
        state = self.time[place], self.position[place], velocity, self.mass[place]
        return self.dynamics.momentum(*state).full().ravel()

    @cached_property
    def rows(self) -> np.ndarray:
        """What is left of the discrete equations at every node, along Z(q), shape (nodes, freedom)."""
        rows = np.zeros_like(self.position)
        np.add.at(rows, self.at, self.momenta)
        rows = along_path(self.dynamics, self.position, rows)
        rows[0] += self.boundary_momentum(0)
        rows[-1] -= self.boundary_momentum(-1)
        return without_reactions(self.dynamics, self.time, self.position, self.mass, rows)

    @cached_property
    def reactions(self) -> np.ndarray:
        """Impulses of links at every node along the velocities, per unit mass, shape (nodes, freedom)."""
        held = self.dynamics.configuration.joined
        if not held or self.path.reaction is None:
            return np.zeros((len(self.position), self.dynamics.freedom))
        bars = columns(self.dynamics.bars, self.position.T)[0].reshape(held, len(self.position), -1)
        return -np.einsum("rkn,kr->kn", bars, self.path.reaction[:, -held:]) * self.weights[:, None]

    @cached_property
    def matrices(self) -> np.ndarray:
        """Derivative of the one-step map along the path, shape (steps, 2 axes, 2 axes) [SI]."""
        return step_matrices(self.dynamics, self.path, self.begin)

    def link_gaps(self) -> tuple[np.ndarray, np.ndarray]:
        """The largest gap of a link at every node over the extent, and rate of opening at every step end [-].

        The rate is that of the velocities reported, over the speed.
        """
        body = self.dynamics.configuration
        if not body.joined:
            return np.empty(0), np.empty(0)
        q, w = ca.SX.sym("q", body.size), ca.SX.sym("w", body.freedom)
        gap = ca.Function("gap", [q], [ca.densify(body.links_at(q))])(self.position.T).full()
        rate = ca.Function("rate", [q, w], [ca.densify(body.opening(q, w))])
        velocity = self.velocity.copy()
        velocity[0], velocity[-1] = self.path.start_velocity, self.path.goal_velocity
        opening = rate(self.position[self.ends].T, velocity.T).full()
        lengths = np.array([unit == "m" for link in body.link_units for unit in link])[:, None]
        gaps = np.abs(gap) / np.where(lengths, self.extent, 1.0)
        openings = np.abs(opening) / np.where(lengths, self.speed, self.rate)
        return gaps.max(axis=0), openings.max(axis=0)

    @cached_property
    def link_turn(self) -> float:
        """The largest angle by which the direction of a link turns between two nodes [rad]."""
        held = self.dynamics.configuration.joined
        if not held:
            return 0.0
        bars = columns(self.dynamics.bars, self.position.T)[0].reshape(held, len(self.position), -1)
        bars = bars / np.linalg.norm(bars, axis=2, keepdims=True)
        return float(np.arccos(np.clip(np.sum(bars[:, 1:] * bars[:, :-1], axis=2).min(), -1.0, 1.0)))

    # The checks judge those numbers by the scales that follow.

    @cached_property
    def largest(self) -> float:
        """Largest component of the force used [N]."""
        return float(np.abs(self.force).max(initial=0.0))

    @cached_property
    def largest_torque(self) -> float:
        """Largest component of the torque used [N m]."""
        return float(np.abs(self.wrench[:, self.rates]).max(initial=0.0))

    @property
    def force(self) -> np.ndarray:
        """Force of the actuator in space axes [N], one row a node or with hold a step."""
        return self.wrench[:, self.speeds]

    @cached_property
    def acceleration(self) -> float:
        """The largest acceleration in play, of the scene or of the actuator [m/s^2]."""
        return float(max(np.abs(self.pulls).max(initial=0.0), self.largest / self.mass.min()))

    @cached_property
    def extent(self) -> float:
        """Diagonal of the box around the path [m]; at least a billionth of what it could cover.

        Of a body that turns also at least the way of its parts in the least turn.
        """
        covered = 1e-9 * self.acceleration * self.path.duration**2
        least = least_extent(self.problem.mass, self.problem.inertia)
        return max(self.path.diagonal, covered, least, self.least[0]) or 1.0

    @cached_property
    def speed(self) -> float:
        """Largest speed at the step ends [m/s]; at least what crosses the extent in the duration."""
        linear = np.linalg.norm(self.velocity[:, self.speeds], axis=1)
        return max(float(linear.max()), self.extent / self.path.duration, self.least[1])

    @cached_property
    def turn(self) -> float:
        """Largest angle by which the body is turned from its start [rad]; 1 rad for a point mass."""
        return path_scales(self.path).turn

    @cached_property
    def rate(self) -> float:
        """Largest angular rate at the step ends [rad/s]; at least what makes the turn in the duration."""
        rates = np.linalg.norm(self.velocity[:, self.rates], axis=1)
        return max(float(rates.max()), self.turn / self.path.duration)

    @cached_property
    def spin(self) -> float:
        """Largest angular momentum per unit mass at the step ends [m^2/s]; at least of the largest rate."""
        spins = np.linalg.norm(self.momentum[:, self.rates], axis=1)
        return max(float(spins.max()), self.problem.moment * self.rate / float(self.mass[0])) or 1.0

    @cached_property
    def torque_scale(self) -> float:
        """The torque that errors are judged by [N m]: of the actuator, of the scene, or what turns the body."""
        pulled = [np.abs(load[:, self.rates]).max(initial=0.0) for load in self.loads]
        scene = float(self.mass.max()) * max(*pulled, self.spin / self.path.duration)
        if self.rate * self.path.duration <= LEAST_TURN:
            # Of a body that does not turn a force on a lever says how large a torque is.
            scene = max(scene, self.typical_force * self.extent)
        return max(self.problem.actuator.torque_limit() or 0.0, self.largest_torque, 1e-3 * scene) or 1.0

    @cached_property
    def force_of_turn(self) -> float:
        """The force that gives the parts of a body the least turn in the duration [N]; 0 for a point mass."""
        least = least_extent(self.problem.mass, self.problem.inertia)
        return float(self.mass.max()) * least / self.path.duration**2

    @cached_property
    def kinetic(self) -> float:
        """Kinetic energy per unit mass of the largest speed and rate [J/kg]."""
        return 0.5 * self.speed**2 + (0.0 if self.speeds.all() else 0.5 * self.spin * self.rate)

    @property
    def scales(self) -> Scales:
        """The sizes that errors are judged by."""
        return Scales(
            self.extent,
            self.speed,
            self.turn,
            self.rate,
            self.path.coordinates,
            wheel_momentum(self.path),
            self.path.duration,
        )

    @cached_property
    def sizes(self) -> np.ndarray:
        """Sizes of the ways to move, and of momenta, one entry a freedom each."""
        return np.concatenate([self.scales.positions, np.where(self.speeds, self.speed, self.spin)])

    @cached_property
    def in_size(self) -> np.ndarray:
        """What makes the entries of `matrices` shares of the sizes."""
        free = self.dynamics.freedom
        ways = free - self.dynamics.configuration.joined
        # In the ways that links let be all places have one size.
        sizes = np.concatenate([part[:ways] for part in np.split(self.sizes, 2)])
        return sizes / sizes[:, None]

    @cached_property
    def typical_force(self) -> float:
        """The force that moves the mass over the extent in the duration [N]."""
        return float(self.mass.max()) * self.extent / self.path.duration**2

    @cached_property
    def rounding(self) -> float:
        """Ten times the rounding error of a position [m]: far from the origin no check can be stricter."""
        return ROUNDING * float(np.abs(self.path.place).max(initial=0.0))

    @cached_property
    def shortest(self) -> float:
        """Shortest time between nodes, about [s]."""
        return float(self.path.duration * np.diff(self.path.mesh).min() / self.rule.degree)
