"""Forces, momentum, energy and acceleration of a body as functions of one state, all per unit mass."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import casadi as ca

from dmoc.basics.memory import remembered_property
from dmoc.basics.records import dataclass
from dmoc.configurations.acting import (
    kinetic_at_nodes,
    point_function,
    specific_lagrangian,
    split_effects,
    state_symbols,
    symbols_in,
)
from dmoc.configurations.base import Configuration
from dmoc.configurations.of_problem import configuration_of
from dmoc.configurations.rigid import newton_euler
from dmoc.effects.base import Effect
from dmoc.parts.actuator import Actuator
from dmoc.parts.forces import FreeForce


@dataclass(frozen=True)
class Dynamics:
    """The effects that act on a body and the actuator that pushes it, without start, goal and duration."""

    configuration: Configuration
    effects: tuple[Effect, ...] = ()
    actuator: Actuator = FreeForce()

    @classmethod
    def of(cls, problem: Any, effects: tuple[Effect, ...] | None = None) -> Dynamics:
        """The dynamics of a transfer problem, with its own effects or with others in their place."""
        return cls(configuration_of(problem), problem.effects if effects is None else effects, problem.actuator)

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
        return self.actuator.size(self.configuration.dimension)

    @cached_property
    def unknowns(self) -> list[ca.SX]:
        """Symbols of unknown numbers in it: with them its functions serve as parts of formulas alone."""
        moments = getattr(self.configuration, "moments", None)
        return [
            *symbols_in(self.effects),
            *symbols_in((moments,)),
            *symbols_in(tuple(vars(self.actuator).values())),
        ]

    @property
    def loose(self) -> dict[str, bool]:
        """Options of its functions: those with unknown numbers have symbols that are no arguments."""
        return {"allow_free": bool(self.unknowns)}

    def symbols(self) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
        """Symbols t, q, v, m."""
        return state_symbols(self.positions)

    def states(self) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX, ca.SX]:
        """Symbols t, q, w, m, and dq/dt = Z(q) w: for a point mass w and dq/dt are one."""
        t, q, _, m = self.symbols()
        w = ca.SX.sym("w", self.freedom)
        return t, q, w, m, self.configuration.velocity(q, w)

    @remembered_property
    def point(self) -> ca.Function:
        """(t, q, v, m) -> dl/dq [m/s^2], dl/dv [m/s], F/m [m/s^2] of all effects and the kinetic energy."""
        return point_function(self.effects, self.configuration)

    def step_point(self, degree: int, effects: tuple[Effect, ...] | None = None) -> ca.Function:
        """`point` of all effects or of these as `step_momenta` takes it: see `kinetic_at_nodes`."""
        kinetic = kinetic_at_nodes(self.configuration, degree)
        if kinetic and effects is None:
            return self.point
        return point_function(self.effects if effects is None else effects, self.configuration, kinetic)

    @remembered_property
    def energy(self) -> ca.Function:
        """(t, q, w, m) -> v . dl/dv - l, the energy per unit mass [J/kg]."""
        t, q, v, m = self.symbols()
        kinetic = self.configuration.kinetic(q, v, m)
        lagrangian = kinetic + specific_lagrangian(self.effects, self.configuration, t, q, v, m)
        energy = ca.Function("energy", [t, q, v, m], [ca.dot(v, ca.gradient(lagrangian, v)) - lagrangian])
        t, q, w, m, v = self.states()
        return (
            ca.Function("energy", [t, q, w, m], [energy(t, q, v, m)]) if self.configuration.surplus else energy
        )

    @remembered_property
    def momentum(self) -> ca.Function:
        """(t, q, w, m) -> p = Z' dl/dv: momentum [m/s] and spin in body axes [m^2/s], per unit mass."""
        t, q, w, m, v = self.states()
        along = self.configuration.along(q, self.point(t, q, v, m)[1])
        return ca.Function("momentum", [t, q, w, m], [along], self.loose)

    @remembered_property
    def velocity(self) -> ca.Function:
        """(t, q, p, m) -> w [m/s], [rad/s] that belongs to the momentum p = Z' dl/dv, as far as links let it.

        Raises
        ------
        ValueError
            If the Lagrangian is not quadratic in the velocity.
        """
        t, q, w, m, _ = self.states()
        p = ca.SX.sym("p", self.freedom)
        momentum = self.momentum(t, q, w, m)
        inertia = ca.jacobian(momentum, w)
        if ca.depends_on(inertia, w):
            raise ValueError("an effect's lagrangian is not quadratic in the velocity; state it as a Force")
        # The momentum is linear in the velocity: inertia times velocity, plus its value at rest.
        at_rest = self.momentum(t, q, ca.DM.zeros(self.freedom), m)
        free = ca.solve(inertia, p - at_rest)
        if not self.configuration.joined:
            return ca.Function("velocity", [t, q, p, m], [free], self.loose)
        bars = self.configuration.bars(q)
        return ca.Function("velocity", [t, q, p, m], [free - _taken(inertia, bars, bars @ free)])

    @remembered_property
    def acceleration(self) -> ca.Function:
        """(t, q, w, m, f) -> dw/dt of the continuous motion under the actuator's f.

        f is a force [N] and, for a rigid body, a torque in body axes [N m] below it. A body turns by Euler's
        equations, not by the constrained ones of the scheme.
        """
        t, q, w, m, v = self.states()
        f = ca.SX.sym("f", self.freedom)
        if self.configuration.surplus:
            rate = self._held(t, q, w, m, self._by_euler(t, q, w, m, f))
            return ca.Function("acceleration", [t, q, w, m, f], [ca.densify(rate)])
        dldq, dldv, push = self.point(t, q, v, m)
        # The Euler-Lagrange equation d/dt dl/dv = dl/dq + F/m, its left side by the chain rule.
        change = ca.jacobian(dldv, q) @ v + ca.jacobian(dldv, t)
        rate = ca.solve(ca.jacobian(dldv, v), dldq + push + f / m - change)
        rate = self._held(t, q, v, m, rate)
        return ca.Function("acceleration", [t, q, v, m, f], [ca.densify(rate)])

    def _held(self, t: Any, q: Any, w: Any, m: Any, rate: Any) -> Any:
        """dw/dt of what would be `rate` without links: their forces are such that they do not open."""
        body = self.configuration
        if not body.joined:
            return rate
        turning = ca.jtimes(body.opening(q, w), q, body.velocity(q, w))
        bars = body.bars(q)
        inertia = ca.jacobian(self.momentum(t, q, w, m), w)
        return rate - _taken(inertia, bars, bars @ rate + turning)

    def _by_euler(self, t: Any, q: Any, w: Any, m: Any, f: Any) -> Any:
        """dw/dt of rigid bodies: Newton's equation of their centres of mass and Euler's of their rates."""
        _, _, slope, _ = self.symbols()
        acts = point_function(self.effects, self.configuration, kinetic=False)(t, q, slope, m)
        found = newton_euler(self.configuration, (t, q, slope, w, m), acts, f)
        return ca.substitute(found, slope, self.configuration.velocity(q, w))

    @remembered_property
    def linearised(self) -> tuple[ca.Function, bool]:
        """(t, q, w, m) -> slopes of the motion without thrust in (q, w), and whether they are constant.

        For a point mass d(q', v')/d(q, v). For a rigid body attitudes change by a small turn e about the body
        axes: q moves by Z(q) e, so that de/dt = de' - w x e.
        """
        t, q, w, m, v = self.states()
        jacobian = self._slopes((t, q, w, m, v), self.acceleration(t, q, w, m, ca.DM.zeros(self.freedom)))
        constant = not ca.depends_on(jacobian, ca.vertcat(t, q, w, *([m] if self.actuator.burns else [])))
        return ca.Function("flow", [t, q, w, m], [ca.densify(jacobian)]), constant

    @remembered_property
    def linearised_under_thrust(self) -> ca.Function:
        """(t, q, w, m, u) -> the same slopes under controls that stay."""
        t, q, w, m, v = self.states()
        u = ca.SX.sym("u", self.controls)
        jacobian = self._slopes((t, q, w, m, v), self.acceleration(t, q, w, m, self.wrench(q, u)))
        return ca.Function("flow", [t, q, w, m, u], [ca.densify(jacobian)])

    def _slopes(self, state: tuple, rate: Any) -> Any:
        """Slopes of the motion whose dw/dt is `rate` in (q, w)."""
        _, q, w, _, v = state
        if not self.configuration.surplus:
            return ca.jacobian(ca.vertcat(v, rate), ca.vertcat(q, v))
        tangent, turned = self.configuration.tangent(q), ca.SX.sym("e", self.freedom)
        moving = ca.jacobian(v, q) @ tangent - ca.jacobian(ca.jtimes(tangent @ turned, q, v), turned)
        inverse = ca.solve(tangent.T @ tangent, tangent.T)
        above = ca.horzcat(inverse @ moving, ca.SX.eye(self.freedom))
        below = ca.horzcat(ca.jacobian(rate, q) @ tangent, ca.jacobian(rate, w))
        return ca.vertcat(above, below)

    @remembered_property
    def depends_on_velocity(self) -> bool:
        """Whether a step of order 2 is implicit: an effect looks at the velocity, or the body turns."""
        return bool(not self.configuration.plain or split_effects(self.effects, self.configuration)[1])

    @remembered_property
    def depends_on_time(self) -> bool:
        """Whether the Lagrangian depends on time, so that energy is not to be balanced."""
        t, q, v, m = self.symbols()
        lagrangian = specific_lagrangian(self.effects, self.configuration, t, q, v, m)
        return bool(ca.depends_on(ca.SX(lagrangian), t))

    @remembered_property
    def tangential(self) -> ca.Function:
        """(t, q, m, column) -> a momentum without what the reactions of links take up."""
        t, q, w, m, _ = self.states()
        column, bars = ca.SX.sym("column", self.freedom), self.configuration.bars(q)
        inertia = ca.jacobian(self.momentum(t, q, w, m), w)
        taken = inertia @ _taken(inertia, bars, bars @ ca.solve(inertia, column))
        return ca.Function("tangential", [t, q, m, column], [ca.densify(column - taken)])

    @remembered_property
    def bars(self) -> ca.Function:
        """q -> C(q), the slope of the links along the independent velocities."""
        q = ca.SX.sym("q", self.positions)
        return ca.Function("bars", [q], [ca.densify(self.configuration.bars(q))])

    @remembered_property
    def to_freedom(self) -> ca.Function:
        """(q, column of the size of q) -> Z(q)' column."""
        q, column = ca.SX.sym("q", self.positions), ca.SX.sym("column", self.positions)
        return ca.Function("to_freedom", [q, column], [ca.densify(self.configuration.along(q, column))])

    @remembered_property
    def to_slopes(self) -> ca.Function:
        """(q, w) -> dq/dt = Z(q) w."""
        _, q, w, _, slopes = self.states()
        return ca.Function("to_slopes", [q, w], [ca.densify(slopes)])

    @remembered_property
    def wrench(self) -> ca.Function:
        """(q, u) -> force in space axes [N]; of a rigid body torques on wheels and in body axes, too [N m]."""
        q, u = ca.SX.sym("q", self.positions), ca.SX.sym("u", self.controls)
        body = self.configuration
        acts = ca.densify(body.along(q, self.actuator.acts(body, q, u)))
        return ca.Function("wrench", [q, u], [acts], self.loose)


def _taken(inertia: Any, bars: Any, opening: Any) -> Any:
    """What reactions of links take of a velocity that would open them: M^-1 C' (C M^-1 C')^-1 opening."""
    back = ca.solve(inertia, bars.T)
    return back @ ca.solve(bars @ back, opening)
