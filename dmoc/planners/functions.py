"""The discrete equations as CasADi functions of their own: named arguments in SI units, nothing of dmoc needed.

Arguments of all functions follow one vocabulary, `dmoc.planners.terms`. Matrices have one column a node, a
step end or a step, so that what one function gives fits into the next. Every graph here is built from slices,
maps and accumulations: its size, and that of C code made from it, does not grow with the number of steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.records import dataclass
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import Scheme
from dmoc.motion.step import step_map
from dmoc.parts.rows import with_symbols
from dmoc.planners.terms import PARTS, TERMS, Exported, Part, Term, named, number_terms, opened_effects
from dmoc.scene.problem import TransferProblem


@dataclass(frozen=True)
class Scene:
    """What acts, and the scheme that steps it: steps of one order, with nodal or held controls.

    They are equal, or `mesh` has the fractions of the duration at their ends.
    """

    problem: TransferProblem
    rule: Scheme
    steps: int
    hold: bool
    mesh: tuple[float, ...] = ()

    @cached_property
    def dynamics(self) -> Dynamics:
        """With symbols for the unknown constants of effects."""
        return Dynamics.of(self.problem, self._opened[0])

    @cached_property
    def _opened(self) -> tuple[tuple, dict[str, int], dict[str, Term]]:
        return opened_effects(self.problem.effects)

    @property
    def constants(self) -> dict[str, int]:
        """What unknown constants of effects are called, and their sizes: they are arguments."""
        return self._opened[1]

    def closed(self, function: ca.Function) -> ca.Function:
        """A function of the dynamics with the unknown constants as further arguments."""
        if not self.constants:
            return function
        given = function.sx_in()
        return ca.Function(function.name(), [*given, *self.dynamics.unknowns], function.call(given))

    def constants_in(self, given: Mapping[str, ca.MX]) -> list[ca.MX]:
        return [given[name] for name in self.constants]

    @property
    def axes(self) -> int:
        """Number of axes of space."""
        return self.problem.dimension

    @property
    def turns(self) -> bool:
        """Whether there is an attitude among the coordinates."""
        return bool(self.dynamics.configuration.surplus)

    @property
    def held(self) -> bool:
        """Whether forces hold a constraint: of unit quaternions, or of links."""
        return bool(self.dynamics.configuration.conditions)

    @cached_property
    def parts(self) -> dict[Part, tuple[int, int]]:
        """The parts of the body, and how many coordinates and velocities each has."""
        blocks = self.dynamics.configuration.coordinates.blocks
        found: dict[Part, tuple[int, int]] = {}
        for block in blocks:
            # The places of several bodies stand one below the other.
            size, freedom = found.get(PARTS[block.kind], (0, 0))
            found[PARTS[block.kind]] = size + block.size, freedom + block.freedom
        return found

    def names(self, kind: str, prefix: str = "") -> dict[str, int]:
        """What the parts of a column are called that is of one kind, a field of `Part`, and their sizes."""
        which = 0 if kind in ("place", "places", "rows") else 1
        return {prefix + getattr(part, kind): sizes[which] for part, sizes in self.parts.items()}

    def joined(self, given: Mapping[str, ca.MX], kind: str, prefix: str = "") -> ca.MX:
        """Coordinates or velocities, a column each, from the arguments that are their parts."""
        return ca.vertcat(*[given[name] for name in self.names(kind, prefix)])

    def parted(self, columns: ca.MX, kind: str, prefix: str = "") -> dict[str, ca.MX]:
        """The parts of coordinates or velocities as arguments."""
        return rows_of(columns, self.names(kind, prefix))

    @cached_property
    def terms(self) -> dict[str, Term]:
        """What arguments of this scene mean where it is not what they mean in all."""
        own = dict(self._opened[2])
        if not self.held:
            return own
        units = dict.fromkeys(self.problem.actuator.units(self.axes))
        found = own | {"forces": Term(", ".join(units), TERMS["forces"].words)}
        gaps = dict.fromkeys(unit for link in self.dynamics.configuration.link_units for unit in link)
        gap = ", ".join(gaps)
        exerted = ", ".join(dict.fromkeys(self.dynamics.configuration.reaction_units))
        found["residual_links"] = Term(gap, TERMS["residual_links"].words)
        found["largest_residual_links"] = Term(gap, "largest gap of a link")
        words = "forces per unit mass that keep quaternions unit ones, then those of links, one column a node"
        found["reactions"] = Term(
            exerted, words if self.turns else "forces of links per unit mass, one column a node"
        )
        return found

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
        shapes["reactions"] = (self.dynamics.configuration.conditions, self.nodes)
        shapes |= {path: (size, self.nodes) for path, size in self.names("places").items()}
        shapes |= {path: (size, self.steps + 1) for path, size in self.names("speeds").items()}
        states = self.names("place") | self.names("speed")
        states |= self.names("speed", "start_") | self.names("speed", "goal_")
        return shapes.get(name) or ((states | self.constants).get(name, 1), 1)

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

    def momentum(self, time: Any, position: Any, velocity: Any, mass: Any, constants: list) -> Any:
        """dl/dv [m/s]; of a body that turns Z' dl/dv, whose last entries are its spin [m^2/s]."""
        if self.turns:
            return self.closed(self.dynamics.momentum)(time, position, velocity, mass, *constants)
        return self.closed(self.dynamics.point)(time, position, velocity, mass, *constants)[1]


def rows_of(columns: ca.MX, sizes: Mapping[str, int]) -> dict[str, ca.MX]:
    """Some rows for every name, in turn."""
    if len(sizes) == 1:
        return dict.fromkeys(sizes, columns)
    pieces = ca.vertsplit(columns, np.cumsum([0, *sizes.values()]).tolist())
    return dict(zip(sizes, pieces, strict=True))


def march(scene: Scene) -> ca.Function:
    """One step of (displacement from origin, momentum per mass, mass, number of the step).

    (state, controls stacked, constants) -> next state, displacements and masses of nodes 1 .. s of the step,
    velocity at its end. The constants, start_time, h, origin and the numbers of the flow, are one column: it
    is the same for all steps, and generated C code then needs no table with a copy of it for every step.
    """
    n, rule, columns = scene.dynamics.positions, scene.rule, scene.step_columns
    p_end = n + scene.dynamics.freedom
    state, stacked = ca.MX.sym("state", p_end + 2), ca.MX.sym("u", scene.controls * columns)
    flows = [value.numel() for value in scene.flow_numbers().values()]
    lengths = np.cumsum([0, 1, 1, n, *flows, *scene.constants.values()])
    same = ca.MX.sym("same", int(lengths[-1]))
    start_time, h, origin, *numbers = ca.vertsplit(same, lengths.tolist())
    numbers, constants = numbers[: len(flows)], numbers[len(flows) :]
    r, p, mass, count = ca.vertsplit(state, [0, n, p_end, p_end + 1, p_end + 2])
    u = ca.reshape(stacked, scene.controls, columns)
    masses = ca.repmat(mass, rule.degree + 1)
    if scene.burns:
        burnt = [scene.flow(u[:, j if columns > 1 else 0], *numbers) for j in range(rule.degree + 1)]
        masses = masses - h * (ca.DM(rule.integral) @ ca.vertcat(*burnt))
    t = start_time + count * h
    dq, dp, v = step_map(scene.dynamics, rule, scene.hold)(r, p, masses, u, t, h, origin, *constants)
    # positions at the inner nodes: the position in a step is a polynomial of degree s, whose slope is known at
    # all s + 1 nodes, so that integrating the slope gives it exactly
    inner = [r + h * (v @ ca.DM(row)) for row in rule.integral[1:-1]]
    end = ca.vertcat(r + dq, p + dp, masses[-1], count + 1)
    velocity = scene.closed(scene.dynamics.velocity)(t + h, origin + r + dq, p + dp, masses[-1], *constants)
    function = ca.Function(
        "march", [state, stacked, same], [end, ca.horzcat(*inner, r + dq), masses[1:].T, velocity]
    )
    return function.expand() if scene.explicit else function


def timed_march(scene: Scene) -> ca.Function:
    """All steps of a mesh: below the controls of each step stand the time it begins and its length [s]."""
    one = march(scene)
    state, same = ca.MX.sym("state", one.numel_in(0)), ca.MX.sym("same", one.numel_in(2) - 2)
    below = ca.MX.sym("below", one.numel_in(1) + 2)
    end, *found = one(state, below[:-2], ca.vertcat(below[-2:], same))
    # The count of steps, by which those of equal length know their time, stays 0.
    function = ca.Function("timed", [state, below, same], [ca.vertcat(end[:-1], 0), *found])
    return function.mapaccum("march_all", scene.steps)


def one_step(scene: Scene, name: str = "step") -> Exported:
    """The one-step map."""
    given = scene.symbols(*scene.names("place"), *scene.names("speed"), "mass", "time", "time_step")
    given["forces"] = ca.MX.sym("forces", scene.controls, scene.step_columns)
    numbers = scene.flow_numbers()
    given |= numbers | scene.symbols(*scene.constants)
    q, v = scene.joined(given, "place"), scene.joined(given, "speed")
    m, t, h = given["mass"], given["time"], given["time_step"]
    momentum = scene.momentum(t, q, v, m, scene.constants_in(given))
    state = ca.vertcat(ca.MX.zeros(scene.dynamics.positions), momentum, m, 0)
    same = ca.vertcat(t, h, q, *numbers.values(), *scene.constants_in(given))
    end, _, _, velocity = march(scene)(state, ca.vec(given["forces"]), same)
    outputs = scene.parted(q + end[: scene.dynamics.positions], "place", "next_")
    outputs |= scene.parted(velocity, "speed", "next_")
    if scene.burns:
        outputs["next_mass"] = end[-2]
    function = named(name, given, outputs)
    words = "one step of the integrator; forces at its nodes, or one that is held"
    terms = scene.terms | number_terms(numbers)
    return Exported(function.expand() if scene.explicit else function, words, terms)


def all_steps(scene: Scene, name: str = "rollout") -> Exported:
    """The integrator over all steps from the start."""
    state_names = *scene.names("place"), *scene.names("speed")
    given = scene.symbols(*state_names, "mass", "start_time", "duration", "forces")
    numbers = scene.flow_numbers()
    given |= numbers | scene.symbols(*scene.constants)
    q, v = scene.joined(given, "place"), scene.joined(given, "speed")
    m, t = given["mass"], given["start_time"]
    momentum = scene.momentum(t, q, v, m, scene.constants_in(given))
    state = ca.vertcat(ca.MX.zeros(scene.dynamics.positions), momentum, m, 0)
    forces, same = scene.split(given["forces"]), ca.vertcat(q, *numbers.values(), *scene.constants_in(given))
    if scene.mesh:
        ends = ca.DM(scene.mesh).T
        times = ca.vertcat(t + given["duration"] * ends[:-1], given["duration"] * ca.diff(ends, 1, 1))
        _, moves, masses, speeds = timed_march(scene)(state, ca.vertcat(forces, times), same)
    else:
        steps = march(scene).mapaccum("march_all", scene.steps)
        same = ca.vertcat(t, given["duration"] / scene.steps, same)
        _, moves, masses, speeds = steps(state, forces, same)
    inner = ca.repmat(q, 1, scene.nodes - 1) + moves
    outputs = scene.parted(ca.horzcat(q, inner), "places") | scene.parted(ca.horzcat(v, speeds), "speeds")
    if scene.burns:
        outputs["masses"] = ca.horzcat(m, masses)
    words = f"the integrator over all steps, from {' and '.join(state_names)} at the start"
    return Exported(named(name, given, outputs), words, scene.terms | number_terms(numbers))
