"""The discrete equations as CasADi functions of their own: named arguments in SI units, nothing of dmoc needed.

Arguments of all functions follow one vocabulary, `TERMS`. Matrices have one column a node, a step end
or a step, so that what one function gives fits into the next. Every graph here is built from slices,
maps and accumulations: its size, and that of C code made from it, does not grow with the number of steps.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import Scheme
from dmoc.motion.step import step_map
from dmoc.parts.rows import with_symbols
from dmoc.scene.problem import TransferProblem


@dataclass(frozen=True)
class Term:
    """Unit and meaning of an argument."""

    unit: str
    words: str


@dataclass(frozen=True)
class Exported:
    """A function that leaves the package, and what its arguments mean beyond `TERMS`."""

    function: ca.Function
    words: str
    terms: dict[str, Term] = field(default_factory=dict)

    def term(self, name: str) -> Term:
        return self.terms.get(name) or TERMS[name]


# Unit and meaning of every argument that has one name in all functions.
TERMS = {
    "position": Term("m", "position"),
    "velocity": Term("m/s", "velocity"),
    "mass": Term("kg", "mass at the start"),
    "next_position": Term("m", "position at the end of the step"),
    "next_velocity": Term("m/s", "velocity at the end of the step"),
    "next_mass": Term("kg", "mass at the end of the step"),
    "time": Term("s", "time at the start of the step"),
    "time_step": Term("s", "length of the step"),
    "start_time": Term("s", "time at the start"),
    "duration": Term("s", "duration of all steps"),
    "positions": Term("m", "positions at the nodes, one column a node"),
    "velocities": Term("m/s", "velocities at the step ends, one column an end"),
    "start_velocity": Term("m/s", "velocity at the start"),
    "goal_velocity": Term("m/s", "velocity at the goal"),
    "forces": Term("N", "controls of the actuator, one column a node, or a step where they are held"),
    "masses": Term("kg", "masses at the nodes, one column a node"),
    "residual": Term("N", "force minus what the discrete motion needs, one column a node"),
}


@dataclass(frozen=True)
class Scene:
    """What acts, and the scheme that steps it: equal steps of one order, with nodal or held controls."""

    problem: TransferProblem
    rule: Scheme
    steps: int
    hold: bool

    @cached_property
    def dynamics(self) -> Dynamics:
        return Dynamics.of(self.problem)

    @property
    def axes(self) -> int:
        return self.problem.dimension

    @property
    def controls(self) -> int:
        """Number of controls at a node."""
        return self.problem.actuator.size(self.axes)

    @property
    def nodes(self) -> int:
        return self.steps * self.rule.degree + 1

    @property
    def burns(self) -> bool:
        return self.problem.actuator.burns

    @property
    def explicit(self) -> bool:
        """Whether a step has no root to find."""
        return self.rule.degree == 1 and not self.dynamics.depends_on_velocity

    def shape(self, name: str) -> tuple[int, int]:
        """Shape of an argument of `TERMS` that belongs to the whole path."""
        columns = self.steps if self.hold else self.nodes
        shapes = {"forces": (self.controls, columns), "masses": (1, self.nodes)}
        shapes |= {"positions": (self.axes, self.nodes), "velocities": (self.axes, self.steps + 1)}
        shapes |= dict.fromkeys(("position", "velocity", "start_velocity", "goal_velocity"), (self.axes, 1))
        return shapes.get(name, (1, 1))

    def symbols(self, *names: str) -> dict[str, ca.MX]:
        return {name: ca.MX.sym(name, *self.shape(name)) for name in names}

    @cached_property
    def flow(self) -> ca.Function:
        """(u, numbers of the actuator it looks at) -> propellant burnt [kg/s]; 0 where the mass is constant."""
        twin, symbols = with_symbols(self.problem.actuator, "actuator")
        u = ca.SX.sym("u", self.controls)
        rate = ca.SX(twin.flow(u)) if self.burns else ca.SX(0)
        used = {
            f"actuator_{name}": symbol
            for name, symbol in zip(twin.adjustable, symbols, strict=True)
            if ca.depends_on(rate, symbol)
        }
        return ca.Function("flow", [u, *used.values()], [rate], ["u", *used], ["rate"])

    def flow_numbers(self) -> dict[str, ca.MX]:
        """Symbols for the actuator's numbers that the propellant flow depends on."""
        names = self.flow.name_in()[1:]
        return {name: ca.MX.sym(name, self.flow.numel_in(1 + i)) for i, name in enumerate(names)}

    @property
    def step_columns(self) -> int:
        """Number of nodes of a step with a control of their own; 1 where it is held."""
        return 1 if self.hold else self.rule.degree + 1

    def split(self, forces: ca.MX) -> ca.MX:
        """Controls of each step, stacked: one column a step."""
        if self.hold:
            return forces
        return ca.vertcat(*self.at_nodes(forces))

    def at_nodes(self, values: ca.MX) -> list[ca.MX]:
        """Values at node 0 of every step, at node 1, .. : one column a step each."""
        s = self.rule.degree
        return [values[:, j : j + s * (self.steps - 1) + 1 : s] for j in range(s + 1)]

    def momentum(self, time: Any, position: Any, velocity: Any, mass: Any) -> Any:
        """dl/dv [m/s]."""
        return self.dynamics.point(time, position, velocity, mass)[1]


def number_terms(names: Iterable[str]) -> dict[str, Term]:
    """Further arguments that are numbers of the actuator."""
    units = {"actuator_exhaust_velocity": "m/s"}
    return {name: Term(units.get(name, ""), "of the actuator, as in the problem") for name in names}


def march(scene: Scene) -> ca.Function:
    """One step of (displacement from origin, momentum per mass, mass, number of the step).

    (state, controls stacked, constants) -> next state, displacements and masses of nodes 1 .. s of the step,
    velocity at its end. The constants, start_time, h, origin and the numbers of the flow, are one column: it
    is the same for all steps, and generated C code then needs no table with a copy of it for every step.
    """
    n, rule, columns = scene.axes, scene.rule, scene.step_columns
    state, stacked = ca.MX.sym("state", 2 * n + 2), ca.MX.sym("u", scene.controls * columns)
    lengths = np.cumsum([0, 1, 1, n, *(value.numel() for value in scene.flow_numbers().values())])
    same = ca.MX.sym("same", int(lengths[-1]))
    start_time, h, origin, *numbers = ca.vertsplit(same, lengths.tolist())
    r, p, mass, count = ca.vertsplit(state, [0, n, 2 * n, 2 * n + 1, 2 * n + 2])
    u = ca.reshape(stacked, scene.controls, columns)
    masses = ca.repmat(mass, rule.degree + 1)
    if scene.burns:
        flows = [scene.flow(u[:, j if columns > 1 else 0], *numbers) for j in range(rule.degree + 1)]
        masses = masses - h * (ca.DM(rule.integral) @ ca.vertcat(*flows))
    t = start_time + count * h
    dq, dp, v = step_map(scene.dynamics, rule, scene.hold)(r, p, masses, u, t, h, origin)
    # positions at the inner nodes: the position in a step is a polynomial of degree s, whose slope is known at
    # all s + 1 nodes, so that integrating the slope gives it exactly
    inner = [r + h * (v @ ca.DM(row)) for row in rule.integral[1:-1]]
    end = ca.vertcat(r + dq, p + dp, masses[-1], count + 1)
    velocity = scene.dynamics.velocity(t + h, origin + r + dq, p + dp, masses[-1])
    function = ca.Function(
        "march", [state, stacked, same], [end, ca.horzcat(*inner, r + dq), masses[1:].T, velocity]
    )
    return function.expand() if scene.explicit else function


def one_step(scene: Scene) -> Exported:
    """The one-step map."""
    given = scene.symbols("position", "velocity", "mass", "time", "time_step")
    given["forces"] = ca.MX.sym("forces", scene.controls, scene.step_columns)
    given |= scene.flow_numbers()
    q, v, m, t, h, u, *numbers = given.values()
    state = ca.vertcat(ca.MX.zeros(scene.axes), scene.momentum(t, q, v, m), m, 0)
    end, _, _, velocity = march(scene)(state, ca.vec(u), ca.vertcat(t, h, q, *numbers))
    outputs = {"next_position": q + end[: scene.axes], "next_velocity": velocity}
    if scene.burns:
        outputs["next_mass"] = end[-2]
    function = named("step", given, outputs)
    words = "one step of the integrator; forces at its nodes, or one that is held"
    terms = number_terms(scene.flow.name_in()[1:])
    return Exported(function.expand() if scene.explicit else function, words, terms)


def all_steps(scene: Scene) -> Exported:
    """The integrator over all steps from the start."""
    given = scene.symbols("position", "velocity", "mass", "start_time", "duration", "forces")
    given |= scene.flow_numbers()
    q, v, m, t, duration, u, *numbers = given.values()
    state = ca.vertcat(ca.MX.zeros(scene.axes), scene.momentum(t, q, v, m), m, 0)
    steps = march(scene).mapaccum("march_all", scene.steps)
    same = ca.vertcat(t, duration / scene.steps, q, *numbers)
    _, moves, masses, speeds = steps(state, scene.split(u), same)
    inner = ca.repmat(q, 1, scene.nodes - 1) + moves
    outputs = {"positions": ca.horzcat(q, inner), "velocities": ca.horzcat(v, speeds)}
    if scene.burns:
        outputs["masses"] = ca.horzcat(m, masses)
    words = "the integrator over all steps, from position and velocity at the start"
    return Exported(named("rollout", given, outputs), words, number_terms(scene.flow.name_in()[1:]))


def named(name: str, given: dict[str, ca.MX], outputs: dict[str, ca.MX]) -> ca.Function:
    """A function whose arguments are called as they are here; outputs of the values are dense."""
    return ca.Function(name, list(given.values()), list(outputs.values()), list(given), list(outputs))
