"""A rigid body with reaction wheels: a gyrostat."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from dmoc.basics.quaternions import columns_of
from dmoc.basics.records import dataclass
from dmoc.configurations.coordinates import Coordinates
from dmoc.configurations.rigid import RigidBody
from dmoc.effects.base import Body


@dataclass(frozen=True)
class Gyrostat(RigidBody):
    """A rigid body that carries reaction wheels, whose angular momenta h about their axes are velocities.

    Its angular momentum in body axes is J w + A h, where the columns of A are the axes of the wheels and J is
    the inertia of the whole without that of each wheel about its own axis. The coordinates of the wheels are
    the time integrals of h. By their motors dh/dt = u; nothing from outside turns the body for that, so
    that J w + A h stays the same in space, and Euler's equation reads J dw/dt + w x (J w + A h) = tau - A u.

    References
    ----------
    Z. R. Manchester, M. A. Peck, J. Guid. Control Dyn. 39 (2016), section on gyrostats.
    P. C. Hughes, Spacecraft Attitude Dynamics (1986), chapter 3.

    Parameters
    ----------
    wheels : tuple of 3-tuples
        Unit vectors along the axes of the wheels, in body axes [-].
    """

    wheels: tuple[tuple[float, ...], ...] = ()

    @property
    def before(self) -> int:
        return self.axes + len(self.wheels)

    @property
    def names(self) -> tuple[str, ...]:
        rigid = super().names
        return (*rigid[: self.axes], *(f"wheel{i + 1}" for i in range(len(self.wheels))), *rigid[self.axes :])

    @property
    def velocity_names(self) -> tuple[str, ...]:
        rigid = super().velocity_names
        return (*rigid[: self.axes], *(f"h{i + 1}" for i in range(len(self.wheels))), *rigid[self.axes :])

    @property
    def coordinates(self) -> Coordinates:
        return Coordinates.of_rigid_body(self.axes, len(self.wheels))

    def _momentum(self, column: Any) -> tuple[Any, Any]:
        """The entries of a column that belong to the wheels, and A times them."""
        held = column[self.axes : self.before]
        return held, ca.DM(self.wheels).T @ held

    def inertia(self, q: Any, v: Any, m: Any) -> tuple[Any, Any]:
        # Besides the kinetic energy of the body, with h as given functions of time: h . A'w.
        moved, along = super().inertia(q, v, m)
        attitude, slope, linear, _ = self._split(q, v)
        held, total = self._momentum(v)
        spin = 2 * total / m
        moved = moved - ca.vertcat(ca.SX.zeros(self.before), columns_of(slope) @ spin)
        turning = along[-attitude.numel() :] + columns_of(attitude) @ spin
        return moved, ca.vertcat(linear, held / m, turning)

    def step_inertia(self, h: Any, q: Sequence, move: Any, m: Any) -> list:
        first, last = (node[self.before :] for node in q)
        turned = columns_of(first).T @ move[self.before :]
        held, total = self._momentum(move / h)
        along = ca.vertcat(move[: self.axes] / h, held / m)
        spin = 4 / h * (self._per_mass(m) @ turned) + 2 * total / m
        return [ca.vertcat(-along, -columns_of(last) @ spin), ca.vertcat(along, columns_of(first) @ spin)]

    def body(self, q: Any, v: Any, m: Any = None) -> Body:
        return super().body(q, v, m)._replace(wheels=v[self.axes : self.before])

    def generalised(self, q: Any, force: Any, torque: Any, spun: Any = None) -> Any:
        rigid = super().generalised(q, force, torque)
        motors = ca.SX.zeros(len(self.wheels)) if spun is None else spun
        return ca.vertcat(rigid[: self.axes], motors, rigid[self.axes :])

    def accelerations(self, w: Any, force: Any, torque: Any, spun: Any, m: Any) -> Any:
        inertia, rate = self._per_mass(m), w[self.before :]
        axes = ca.DM(self.wheels).T
        momentum = inertia @ rate + axes @ w[self.axes : self.before] / m
        pushed = torque - axes @ spun / m - ca.cross(rate, momentum)
        return ca.vertcat(force, spun, ca.solve(inertia, pushed))
