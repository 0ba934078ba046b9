"""The configuration of a body: its coordinates, the constraint between them, its kinetic energy.

A configuration is q in R^size with a constraint g(q) = 0 of size - freedom entries. The columns of the
tangent matrix Z(q), of shape (size, freedom), span the directions in which q may move: dg/dq Z = 0. Three
sizes stay apart: positions (entries of q), freedom (velocities and momenta that are reported) and controls
(entries of u, which the actuator counts).

References
----------
S. Leyendecker, S. Ober-Bloebaum, J. E. Marsden, M. Ortiz, Discrete mechanics and optimal control
for constrained systems, Optim. Control Appl. Meth. 31 (2010).
Z. R. Manchester, M. A. Peck, Quaternion variational integrators for spacecraft dynamics, J. Guid.
Control Dyn. 39 (2016).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.quaternions import QUATERNION, columns_of, rotation_of
from dmoc.effects.base import Body

# Names of the axes of space.
AXES = "xyz"


class Configuration(ABC):
    """The coordinates of a body, or of several.

    A frozen dataclass that derives from this has these duties:

    1. Name its coordinates and velocities and say of what parts they are made: `names`, `velocity_names`,
       `blocks`.
    2. Give the kinetic energy per unit mass: `kinetic`. Its derivatives, `inertia`, are CasADi's gradients
       unless they are overridden by shorter expressions.
    3. Where there are more coordinates than freedom: the constraint `g`, its slope `pull`, the tangent matrix
       `tangent` and, for order 2, `step_inertia`.
    4. Say what an effect sees of it, `body`, and how a force and a torque act on it, `generalised`.

    Not its business: effects, actuators, meshes and units.
    """

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """A name for each coordinate, used for rows and in result files."""

    @property
    def velocity_names(self) -> tuple[str, ...]:
        """A name for each independent velocity."""
        return self.names

    @property
    def blocks(self) -> tuple[int, ...]:
        """Sizes of the parts of q in turn: 1 to 3 for a place in space [m], 4 for a unit quaternion."""
        return (self.size,)

    @property
    @abstractmethod
    def dimension(self) -> int:
        """Number of axes of the space in which forces act."""

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.names)

    @property
    def freedom(self) -> int:
        """Number of independent velocities, and of momenta."""
        return len(self.velocity_names)

    @property
    def surplus(self) -> int:
        """Number of entries of the constraint g."""
        return self.size - self.freedom

    @abstractmethod
    def kinetic(self, q: Any, v: Any, m: Any) -> Any:
        """Kinetic energy per unit mass [J/kg]."""

    def inertia(self, q: Any, v: Any, m: Any) -> tuple[Any, Any]:
        """Derivatives of the kinetic energy in q [m/s^2] and in v [m/s]."""
        energy = self.kinetic(q, v, m)
        return ca.gradient(energy, q), ca.gradient(energy, v)

    def step_inertia(self, h: Any, q: Sequence, move: Any, m: Any) -> list:
        """Derivatives of the kinetic energy of a step of order 2 in its two nodes q, per unit mass [m/s].

        `move` is the second less the first. Asked for where there are more coordinates than freedom; a
        configuration whose rate is the same at both nodes has shorter expressions.
        """
        (moved, first), (later, last) = (self.inertia(node, move / h, m) for node in q)
        mean = 0.5 * (first + last)
        return [0.5 * h * moved - mean, 0.5 * h * later + mean]

    def g(self, q: Any) -> Any:
        """The constraint g(q) = 0; no entries where the coordinates are free."""
        return ca.SX.zeros(0)

    def pull(self, q: Any, reaction: Any) -> Any:
        """(dg/dq)' times the constraint forces `reaction`."""
        return ca.jtimes(self.g(q), q, reaction, True)

    def tangent(self, q: Any) -> Any:
        """Z(q), shape (size, freedom)."""
        return ca.DM.eye(self.size)

    def along(self, q: Any, column: Any) -> Any:
        """Z(q)' times a column of the size of q; the column itself where Z is the identity."""
        return self.tangent(q).T @ column if self.surplus else column

    def velocity(self, q: Any, w: Any) -> Any:
        """dq/dt = Z(q) w; w itself where Z is the identity."""
        return self.tangent(q) @ w if self.surplus else w

    @abstractmethod
    def body(self, q: Any, v: Any) -> Body:
        """The body as effects see it."""

    @abstractmethod
    def generalised(self, q: Any, force: Any, torque: Any) -> Any:
        """The column of the size of q by which a force [N] and a torque in body axes [N m] act; None is 0."""

    def rotation(self, q: Any) -> Any:
        """R(q), which turns body axes into space axes; None for a body without an attitude."""
        return None


@dataclass(frozen=True)
class Translation(Configuration):
    """A point mass in a space of 1 to 3 `axes`: q is its position, g has no entries, Z is the identity."""

    axes: int

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(AXES[: self.axes])

    @property
    def dimension(self) -> int:
        return self.axes

    def kinetic(self, q: Any, v: Any, m: Any) -> Any:
        return 0.5 * ca.dot(v, v)

    def inertia(self, q: Any, v: Any, m: Any) -> tuple[Any, Any]:
        # The gradient of v . v / 2 would be written with a multiplication for each axis.
        return 0, v

    def body(self, q: Any, v: Any) -> Body:
        return Body(q, v)

    def generalised(self, q: Any, force: Any, torque: Any) -> Any:
        return force


@dataclass(frozen=True)
class RigidBody(Configuration):
    """A rigid body in space, or its attitude alone: a unit quaternion with g = q.q - 1, and Z = L(q) H / 2.

    The quaternion has no inertia of its own along q: the kinetic energy is w.J w / 2 with w = 2 H' L(q)' v.

    Parameters
    ----------
    moments : tuple of 3 tuples
        J in body axes about the centre of mass [kg m^2].
    axes : int
        3 with a position, 0 for the attitude alone.
    start_mass : float, optional
        Where propellant burns, the mass that has this inertia [kg]: it shrinks in proportion to the mass.
    """

    moments: tuple[tuple[float, ...], ...]
    axes: int = 3
    start_mass: float | None = None

    @property
    def names(self) -> tuple[str, ...]:
        return (*AXES[: self.axes], "qs", "qx", "qy", "qz")

    @property
    def velocity_names(self) -> tuple[str, ...]:
        return (*AXES[: self.axes], "wx", "wy", "wz")

    @property
    def blocks(self) -> tuple[int, ...]:
        return (self.axes, QUATERNION) if self.axes else (QUATERNION,)

    @property
    def dimension(self) -> int:
        return len(AXES)

    @property
    def matrix(self) -> np.ndarray:
        """J [kg m^2], shape (3, 3)."""
        return np.array(self.moments)

    def _per_mass(self, m: Any) -> Any:
        """J per unit mass [m^2]."""
        return ca.DM(self.matrix) / (m if self.start_mass is None else self.start_mass)

    def _split(self, q: Any, v: Any) -> tuple[Any, Any, Any, Any]:
        """Attitude, its slope, velocity in space and rate in body axes w = 2 H' L(q)' v."""
        attitude, slope = q[self.axes :], v[self.axes :]
        return attitude, slope, v[: self.axes], 2 * columns_of(attitude).T @ slope

    def kinetic(self, q: Any, v: Any, m: Any) -> Any:
        _, _, linear, rate = self._split(q, v)
        return 0.5 * (ca.dot(linear, linear) + ca.dot(rate, self._per_mass(m) @ rate))

    def inertia(self, q: Any, v: Any, m: Any) -> tuple[Any, Any]:
        attitude, slope, linear, rate = self._split(q, v)
        spin = 2 * self._per_mass(m) @ rate
        # w is also -2 H' L(v)' q, which gives the derivative in q.
        moved = ca.vertcat(ca.SX.zeros(self.axes), -columns_of(slope) @ spin)
        return moved, ca.vertcat(linear, columns_of(attitude) @ spin)

    def step_inertia(self, h: Any, q: Sequence, move: Any, m: Any) -> list:
        # The rate is the same at both nodes, 2/h times the vector part of conj(q_0) (q_1 - q_0), in which q_0
        # counts for nothing. Written so, the second derivatives of a step take less than half the instructions.
        first, last = (node[self.axes :] for node in q)
        turned = columns_of(first).T @ move[self.axes :]
        along, spin = move[: self.axes] / h, 4 / h * (self._per_mass(m) @ turned)
        return [ca.vertcat(-along, -columns_of(last) @ spin), ca.vertcat(along, columns_of(first) @ spin)]

    def g(self, q: Any) -> Any:
        attitude = q[self.axes :]
        return ca.dot(attitude, attitude) - 1

    def pull(self, q: Any, reaction: Any) -> Any:
        return ca.vertcat(ca.SX.zeros(self.axes), 2 * q[self.axes :] * reaction)

    def tangent(self, q: Any) -> Any:
        return ca.diagcat(ca.DM.eye(self.axes), 0.5 * columns_of(q[self.axes :]))

    def body(self, q: Any, v: Any) -> Body:
        attitude, _, linear, rate = self._split(q, v)
        return Body(q[: self.axes], linear, attitude, self.rotation(q), rate, self.matrix)

    def generalised(self, q: Any, force: Any, torque: Any) -> Any:
        zeros = ca.SX.zeros(self.axes), ca.SX.zeros(QUATERNION)
        along = zeros[0] if force is None or not self.axes else force
        turning = zeros[1] if torque is None else 2 * columns_of(q[self.axes :]) @ torque
        return ca.vertcat(along, turning)

    def rotation(self, q: Any) -> Any:
        return rotation_of(q[self.axes :])

    def angular_acceleration(self, rate: Any, torque: Any, m: Any) -> Any:
        """Euler's equation J dw/dt + w x J w = tau, with the torque per unit mass [m^2/s^2]."""
        inertia = self._per_mass(m)
        return ca.solve(inertia, torque - ca.cross(rate, inertia @ rate))


def configuration_of(problem: Any) -> Configuration:
    """The configuration of a transfer problem's body."""
    if problem.inertia is None:
        return Translation(problem.dimension)
    start_mass = problem.mass if problem.actuator.burns else None
    return RigidBody(problem.inertia, problem.dimension if problem.start.has_position else 0, start_mass)


def quaternions_in(blocks: tuple[int, ...]) -> list[slice]:
    """Where the unit quaternions stand among coordinates that are made of these blocks."""
    starts = np.cumsum([0, *blocks])
    return [
        slice(int(at), int(at) + size)
        for at, size in zip(starts[:-1], blocks, strict=True)
        if size == QUATERNION
    ]


def places_in(blocks: tuple[int, ...]) -> np.ndarray:
    """Which coordinates are places in space [m]: an array of bool, one entry a coordinate."""
    return np.concatenate([np.full(size, size != QUATERNION) for size in blocks])


def speeds_in(blocks: tuple[int, ...]) -> np.ndarray:
    """Which independent velocities are speeds [m/s] and not rates [rad/s]: an array of bool."""
    return np.concatenate([np.full(3 if size == QUATERNION else size, size != QUATERNION) for size in blocks])
