"""A rigid body in space, or its attitude alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import entries, number, short
from dmoc.basics.quaternions import QUATERNION, columns_of, rotation_of
from dmoc.basics.records import dataclass
from dmoc.configurations.base import AXES, Configuration
from dmoc.configurations.coordinates import Coordinates
from dmoc.effects.base import Body


@dataclass(frozen=True)
class Moments:
    """The inertia of a body as a part of a problem whose numbers are unknown."""

    moments: Any
    adjustable: ClassVar[tuple[str, ...]] = ("moments",)


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
    constant : bool
        It does not shrink. Turning is then described per start mass, moving per mass.
    """

    moments: tuple[tuple[float, ...], ...]
    axes: int = 3
    start_mass: float | None = None
    constant: bool = False

    @property
    def before(self) -> int:
        """Number of coordinates before the quaternion, and of velocities before the rate."""
        return self.axes

    @property
    def names(self) -> tuple[str, ...]:
        return (*AXES[: self.axes], "qs", "qx", "qy", "qz")

    @property
    def velocity_names(self) -> tuple[str, ...]:
        return (*AXES[: self.axes], "wx", "wy", "wz")

    @property
    def coordinates(self) -> Coordinates:
        return Coordinates.of_rigid_body(self.axes)

    @property
    def dimension(self) -> int:
        return len(AXES)

    @property
    def matrix(self) -> Any:
        """J [kg m^2], shape (3, 3); of an unknown inertia symbols, row after row."""
        unknown = isinstance(self.moments, ca.SX)
        return ca.reshape(self.moments, len(AXES), len(AXES)) if unknown else np.array(self.moments)

    def _per_mass(self, m: Any) -> Any:
        """J per unit mass [m^2]."""
        moments = self.matrix
        moments = ca.DM(moments) if isinstance(moments, np.ndarray) else moments
        return moments / (m if self.start_mass is None else self.start_mass)

    def _split(self, q: Any, v: Any) -> tuple[Any, Any, Any, Any]:
        """Attitude, its slope, velocity in space and rate in body axes w = 2 H' L(q)' v."""
        attitude, slope = q[self.before :], v[self.before :]
        return attitude, slope, v[: self.axes], 2 * columns_of(attitude).T @ slope

    def kinetic(self, q: Any, v: Any, m: Any) -> Any:
        _, _, linear, rate = self._split(q, v)
        return 0.5 * (ca.dot(linear, linear) + ca.dot(rate, self._per_mass(m) @ rate))

    def inertia(self, q: Any, v: Any, m: Any) -> tuple[Any, Any]:
        attitude, slope, linear, rate = self._split(q, v)
        spin = 2 * self._per_mass(m) @ rate
        # w is also -2 H' L(v)' q, which gives the derivative in q.
        moved = ca.vertcat(ca.SX.zeros(self.before), -columns_of(slope) @ spin)
        return moved, ca.vertcat(linear, columns_of(attitude) @ spin)

    def step_inertia(self, h: Any, q: Sequence, move: Any, m: Any) -> list:
        # The rate is the same at both nodes, 2/h times the vector part of conj(q_0) (q_1 - q_0), in which q_0
        # counts for nothing. Written so, the second derivatives of a step take less than half the instructions.
        first, last = (node[self.before :] for node in q)
        turned = columns_of(first).T @ move[self.before :]
        along, spin = move[: self.axes] / h, 4 / h * (self._per_mass(m) @ turned)
        return [ca.vertcat(-along, -columns_of(last) @ spin), ca.vertcat(along, columns_of(first) @ spin)]

    def g(self, q: Any) -> Any:
        attitude = q[self.before :]
        return ca.dot(attitude, attitude) - 1

    def pull(self, q: Any, reaction: Any) -> Any:
        return ca.vertcat(ca.SX.zeros(self.before), 2 * q[self.before :] * reaction)

    def tangent(self, q: Any) -> Any:
        return ca.diagcat(ca.DM.eye(self.before), 0.5 * columns_of(q[self.before :]))

    def body(self, q: Any, v: Any, m: Any = None) -> Body:
        attitude, _, linear, rate = self._split(q, v)
        shrinks = self.start_mass is not None and not self.constant and m is not None
        inertia = self._per_mass(m) * m if shrinks else self.matrix
        return Body(q[: self.axes], linear, attitude, self.rotation(q), rate, inertia)

    def turning_share(self, m: Any) -> Any:
        return m / self.start_mass if self.constant and self.start_mass is not None else 1

    def shared(self, column: Any, m: Any) -> Any:
        if not self.constant:
            return column
        return ca.vertcat(column[: self.before], self.turning_share(m) * column[self.before :])

    def generalised(self, q: Any, force: Any, torque: Any, spun: Any = None) -> Any:
        zeros = ca.SX.zeros(self.axes), ca.SX.zeros(QUATERNION)
        along = zeros[0] if force is None or not self.axes else force
        turning = zeros[1] if torque is None else 2 * columns_of(q[self.before :]) @ torque
        return ca.vertcat(along, turning)

    def rotation(self, q: Any) -> Any:
        return rotation_of(q[self.before :])

    def accelerations(self, w: Any, force: Any, torque: Any, spun: Any, m: Any) -> Any:
        """dw/dt: of the centre of mass, and by Euler's equation J dw/dt + w x J w = tau.

        The force [m/s^2] and the torque in body axes [m^2/s^2] are per unit mass, what acts on wheels is not.
        """
        inertia, rate = self._per_mass(m), w[self.before :]
        return ca.vertcat(force, ca.solve(inertia, torque - ca.cross(rate, inertia @ rate)))


def newton_euler(body: Configuration, state: tuple, acts: tuple, f: Any) -> Any:
    """dw/dt by Newton's equation of each centre of mass and Euler's equations of each rate.

    `state` is t, q, dq/dt, w, m; `acts` are dl/dq, dl/dv and F/m of the effects, without the kinetic energy.
    What the actuator does is `f`: forces [N], motor torques and torques in body axes [N m].

    Raises
    ------
    ValueError
        If a potential depends on the rate.
    """
    (t, q, slope, w, m), (dldq, dldv, push) = state, acts
    pulled, found = dldq + push, ca.SX.zeros(body.freedom)
    turned = body.along(q, pulled)
    for part, mine, moving, share in body.pieces():
        one: Any = part
        axes, before, mass = one.axes, one.before, m if share == 1.0 else share * m
        own, given = dldv[mine], f[moving]
        if ca.depends_on(own[before:], slope):
            raise ValueError("a BodyConservative's lagrangian depends on the rate; state it as a BodyForce")
        change = ca.jacobian(own[:axes], q) @ slope + ca.jacobian(own[:axes], t)
        inertia = ca.DM.eye(axes) * share + ca.jacobian(own[:axes], slope[mine][:axes])
        pull = pulled[mine][:axes] + given[:axes] / m - change
        along = ca.solve(inertia, pull) if axes else ca.SX.zeros(0)
        torque = (turned[moving][before:] + one.turning_share(m) * given[before:] / m) / share
        found[moving] = one.accelerations(w[moving], along, torque, given[axes:before], mass)
    return found


def checked_inertia(value: Any) -> tuple[tuple[float, ...], ...]:
    """An inertia in body axes [kg m^2] as a symmetric matrix: from three numbers or a matrix.

    Raises
    ------
    ValueError
        If it is no inertia of a body: not symmetric, not positive, or one principal moment above the sum of
        the others.
    """
    given = entries(value)
    rows = None if given is None else [entries(row) for row in given]
    if given is None or len(given) != len(AXES) or rows is None:
        raise ValueError(f"inertia must be three numbers or three rows of three [kg m^2]; got {short(value)}")
    if all(row is None for row in rows):
        moments = [number(f"inertia[{i}]", x, "kg m^2", positive=True) for i, x in enumerate(given)]
        matrix = np.diag(moments)
    elif all(row is not None and len(row) == len(AXES) for row in rows):
        matrix = np.array(
            [
                [number(f"inertia[{i}][{j}]", x, "kg m^2") for j, x in enumerate(row or ())]
                for i, row in enumerate(rows)
            ]
        )
    else:
        raise ValueError(f"inertia must be three numbers or three rows of three [kg m^2]; got {short(value)}")
    size = np.abs(matrix).max()
    if np.abs(matrix - matrix.T).max() > 1e-9 * size:
        raise ValueError(f"inertia must be symmetric [kg m^2]; got {short(value)}")
    small, middle, large = np.linalg.eigvalsh(matrix)
    if small <= 0:
        raise ValueError(f"inertia must have positive principal moments [kg m^2]; the smallest is {small:.3g}")
    # A flat plate has equality; the rounding of numbers with nine digits is allowed for.
    if large > (small + middle) * (1 + 1e-9):
        raise ValueError(
            f"no body has the principal moments {small:.4g}, {middle:.4g}, {large:.4g} kg m^2: none can be "
            "more than the sum of the two others"
        )
    return tuple(tuple(float(x) for x in row) for row in 0.5 * (matrix + matrix.T))
