"""Forces, momentum, energy and acceleration of a body as functions of one state, all per unit mass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from dmoc.basics.memory import remembered_property
from dmoc.effects.base import Conservative, Effect, Force
from dmoc.motion.configuration import Configuration, Translation
from dmoc.parts.actuator import Actuator
from dmoc.parts.forces import FreeForce


@dataclass(frozen=True)
class Dynamics:
    """The effects that act on a body and the actuator that pushes it, without start, goal and duration."""

    configuration: Configuration
    effects: tuple[Effect, ...] = ()
    actuator: Actuator = FreeForce()  # noqa: RUF009 - immutable

    @classmethod
    def of(cls, problem: Any, effects: tuple[Effect, ...] | None = None) -> Dynamics:
        """The dynamics of a transfer problem, with its own effects or with others in their place."""
        return cls(
            Translation(problem.dimension), problem.effects if effects is None else effects, problem.actuator
        )

    @property
    def positions(self) -> int:
        """Number of coordinates of q."""
        return self.configuration.size

    @property
    def freedom(self) -> int:
        """Number of velocities and of momenta."""
        return self.configuration.freedom

    @property
    def controls(self) -> int:
        """Number of controls at a node."""
        return self.actuator.size(self.configuration.size)

    def symbols(self) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
        """Symbols t, q, v, m."""
        return state_symbols(self.positions)

    @remembered_property
    def point(self) -> ca.Function:
        """(t, q, v, m) -> dl/dq [m/s^2], dl/dv [m/s], F/m [m/s^2] of all effects and the kinetic energy."""
        return point_function(self.effects, self.configuration)

    @remembered_property
    def energy(self) -> ca.Function:
        """(t, q, v, m) -> v . dl/dv - l, the energy per unit mass [J/kg]."""
        t, q, v, m = self.symbols()
        kinetic = self.configuration.kinetic(q, v, m)
        lagrangian = kinetic + specific_lagrangian(self.effects, t, q, v, m)
        return ca.Function("energy", [t, q, v, m], [ca.dot(v, ca.gradient(lagrangian, v)) - lagrangian])

    @remembered_property
    def velocity(self) -> ca.Function:
        """(t, q, p, m) -> v [m/s] that belongs to the momentum p = dl/dv [m/s].

        Raises
        ------
        ValueError
            If the Lagrangian is not quadratic in the velocity.
        """
        t, q, v, m = self.symbols()
        p = ca.SX.sym("p", self.freedom)
        momentum = self.point(t, q, v, m)[1]
        inertia = ca.jacobian(momentum, v)
        if ca.depends_on(inertia, v):
            raise ValueError("an effect's lagrangian is not quadratic in the velocity; state it as a Force")
        # The momentum is linear in the velocity: inertia times velocity, plus its value at rest.
        at_rest = self.point(t, q, ca.DM.zeros(self.positions), m)[1]
        return ca.Function("velocity", [t, q, p, m], [ca.solve(inertia, p - at_rest)])

    @remembered_property
    def acceleration(self) -> ca.Function:
        """(t, q, v, m, f) -> dv/dt [m/s^2] of the continuous motion under an actuator force f [N]."""
        t, q, v, m = self.symbols()
        f = ca.SX.sym("f", self.positions)
        dldq, dldv, push = self.point(t, q, v, m)
        # The Euler-Lagrange equation d/dt dl/dv = dl/dq + F/m, whose left side is written out by the chain
        # rule.
        change = ca.jacobian(dldv, q) @ v + ca.jacobian(dldv, t)
        rate = ca.solve(ca.jacobian(dldv, v), dldq + push + f / m - change)
        return ca.Function("acceleration", [t, q, v, m, f], [ca.densify(rate)])

    @remembered_property
    def linearised(self) -> tuple[ca.Function, bool]:
        """(t, q, v, m) -> d(q', v')/d(q, v) of the motion without thrust, and whether it is constant."""
        t, q, v, m = self.symbols()
        rate = self.acceleration(t, q, v, m, ca.DM.zeros(self.positions))
        jacobian = ca.jacobian(ca.vertcat(v, rate), ca.vertcat(q, v))
        constant = not ca.depends_on(jacobian, ca.vertcat(t, q, v, *([m] if self.actuator.burns else [])))
        return ca.Function("flow", [t, q, v, m], [ca.densify(jacobian)]), constant

    @remembered_property
    def depends_on_velocity(self) -> bool:
        """Whether an effect looks at the velocity, so that even a step of order 2 is implicit."""
        return bool(split_effects(self.effects, self.positions)[1])

    @remembered_property
    def depends_on_time(self) -> bool:
        """Whether the Lagrangian depends on time, so that energy is not to be balanced."""
        t, q, v, m = self.symbols()
        return bool(ca.depends_on(ca.SX(specific_lagrangian(self.effects, t, q, v, m)), t))


def state_symbols(positions: int) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """Symbols t, q, v, m."""
    return ca.SX.sym("t"), ca.SX.sym("q", positions), ca.SX.sym("v", positions), ca.SX.sym("m")


def specific_lagrangian(effects: Sequence[Effect], t, q, v, m) -> Any:
    """Sum of the conservative effects' Lagrangians per unit mass, without 1/2 |v|^2 [J/kg]."""
    return sum((e.lagrangian(t, q, v, m) for e in effects if isinstance(e, Conservative)), ca.SX(0))


def point_function(
    effects: Sequence[Effect], configuration: Configuration, kinetic: bool = True
) -> ca.Function:
    """(t, q, v, m) -> dl/dq, dl/dv, F/m of these effects, with or without the kinetic energy."""
    size = configuration.size
    t, q, v, m = state_symbols(size)
    lagrangian = specific_lagrangian(effects, t, q, v, m)
    push = sum((e.force(t, q, v, m) / m for e in effects if isinstance(e, Force)), ca.SX.zeros(size))
    moved, inertia = configuration.inertia(q, v, m) if kinetic else (0, 0)
    change = ca.gradient(lagrangian, q) + moved, ca.gradient(lagrangian, v) + inertia
    return ca.Function("point", [t, q, v, m], [*change, push])


def split_effects(effects: Sequence[Effect], positions: int) -> tuple[tuple[Effect, ...], tuple[Effect, ...]]:
    """Effects that look only at t, q, m, and those that look at the velocity.

    The first are evaluated once a node. The second are evaluated in each of the two steps that share a
    node, since each step has a velocity of its own there.
    """
    t, q, v, m = state_symbols(positions)

    def looks_at_velocity(effect: Effect) -> bool:
        act = effect.lagrangian if isinstance(effect, Conservative) else effect.force  # type: ignore[attr-defined]
        return ca.depends_on(ca.SX(act(t, q, v, m)), v)

    known = [(looks_at_velocity(effect), effect) for effect in effects]
    return tuple(e for moving, e in known if not moving), tuple(e for moving, e in known if moving)
