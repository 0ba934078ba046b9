"""What one node, one step and the two ends contribute to the NLP, as small functions of few unknowns.

An effect that looks only at time, position and mass acts once a node, with the node's whole weight;
one that looks at the velocity acts in every step with that step's own velocities. Either way the
rows add up to the discrete Euler-Lagrange equations of `mechanics`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from dmoc.assembly import Block
from dmoc.layout import Group, Layout
from dmoc.lobatto import Scheme
from dmoc.mechanics import Dynamics, point_function, split_effects, step_momenta, step_velocities, weighted
from dmoc.mesh import node_fractions, node_weights, step_nodes
from dmoc.problem import TransferProblem
from dmoc.rows import Row, with_symbols

AXES = "xyz"


class Transcript:
    """The layout of unknowns and rows of one problem on one mesh, and the blocks that fill it."""

    def __init__(self, problem: TransferProblem, rule: Scheme, hold: bool, mesh: np.ndarray, units: Any):
        self.problem, self.rule, self.hold, self.mesh, self.units = problem, rule, hold, mesh, units
        self.steps = len(mesh) - 1
        self.dynamics = Dynamics(problem.dimension, problem.effects, problem.actuator)
        self._symbols()
        self.columns = self._columns()
        self.rows = Layout()
        self._lower: list[np.ndarray] = []
        self._upper: list[np.ndarray] = []
        weights = node_weights(mesh, rule)
        impulse = problem.mass / (units.force * units.time)
        self._add_rows("dynamics", "smooth", _zeros(problem.dimension), len(weights), impulse)
        self.blocks = [self._node_block(), self._step_block(), self._ends_block()]

    @property
    def row_bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Scaled bounds of all rows."""
        return np.concatenate(self._lower), np.concatenate(self._upper)

    def _symbols(self) -> None:
        problem = self.problem
        self.origin, self.start_time = ca.SX.sym("origin", problem.dimension), ca.SX.sym("start_time")
        self.mass = ca.SX.sym("mass")
        head = [self.origin, self.start_time, self.mass]
        if not problem.free_duration:
            self.duration = ca.SX.sym("duration")
            head.append(self.duration)
        twins = [with_symbols(part, f"part_{i}") for i, part in enumerate(problem.adjustable_parts)]
        self.parameters = ca.vertcat(*head, *[symbol for _, symbols in twins for symbol in symbols])
        self.actuator, self.objective, self.start, self.goal, *self.constraints = [twin for twin, _ in twins]

    def _columns(self) -> Layout:
        problem, units, rule = self.problem, self.units, self.rule
        axes, nodes = AXES[: problem.dimension], self.steps * rule.degree + 1
        speed = units.length / units.time
        columns = Layout().add("position", "node", axes, nodes, units.length)
        labels = problem.actuator.labels(problem.dimension)
        columns = columns.add("force", "control", labels, self.steps if self.hold else nodes, units.force)
        if problem.actuator.burns:
            columns = columns.add("mass", "node", ("",), nodes, units.mass)
        columns = columns.add("start.velocity", "end", axes, 1, speed)
        columns = columns.add("goal.velocity", "end", axes, 1, speed)
        return columns.add("duration", "end", ("",), 1, units.time) if problem.free_duration else columns

    def _add_rows(self, name: str, kind: str, rows: Sequence[Row], count: int, scale=1.0) -> Group:
        self.rows = self.rows.add(name, kind, [row.name for row in rows], count, scale)
        group = self.rows.groups[-1]
        self._lower.append((np.array([row.lower for row in rows]) * group.scales).ravel())
        self._upper.append((np.array([row.upper for row in rows]) * group.scales).ravel())
        return group

    def _node_block(self) -> Block:
        """Impulse, cost and limits of one node."""
        local = _Local(self, self.steps * self.rule.degree + 1)
        r = local.take("position", self.columns["position"].indices)
        u = None if self.hold else local.take("force", self.columns["force"].indices)
        m, duration = local.mass(slice(None)), local.duration()
        fraction, weight = (
            local.number(node_fractions(self.mesh, self.rule)),
            local.number(node_weights(self.mesh, self.rule)),
        )
        n, t, q = self.problem.dimension, self.start_time + fraction * duration, r + self.origin
        resting, _ = split_effects(self.problem.effects, n)
        dldq, _, push = point_function(resting, n, kinetic=False)(t, q, ca.DM.zeros(n), m)
        push = push if u is None else push + self.actuator.force(u) / m
        local.add(self.rows["dynamics"], duration * weight * (dldq + push))
        for i, constraint in enumerate(self.constraints):
            local.limit(_title(constraint, i), "node", constraint.rows(t, q, u, m))
        if u is not None:
            local.limit("actuator", "control", self.actuator.rows(u))
        if not self._cost_in_steps():
            local.cost = duration * weight * self._rate(t, q, ca.DM.zeros(n), u, m)
        return local.block("node")

    def _step_block(self) -> Block:
        """Momenta of one step; cost and limits that look at its velocities or at a held control."""
        rule, problem, n = self.rule, self.problem, self.problem.dimension
        local = _Local(self, self.steps)
        nodes = step_nodes(self.steps, rule)
        r = [local.take("position", self.columns["position"].indices[:, at]) for at in nodes]
        duration, costly = local.duration(), self._cost_in_steps() or problem.actuator.burns
        begin, length = local.number(self.mesh[:-1]), local.number(np.diff(self.mesh))
        h, m = length * duration, [local.mass(at) for at in nodes]
        u: list = [None] * (rule.degree + 1)
        if self.hold:
            u = [local.take("force", self.columns["force"].indices)] * (rule.degree + 1)
        elif costly:
            u = [local.take("force", self.columns["force"].indices[:, at]) for at in nodes]
        push = [self.actuator.force(u[0]) / mass if self.hold else 0 for mass in m]
        moving = point_function(split_effects(problem.effects, n)[1], n, kinetic=True)
        t0 = self.start_time + begin * duration

        def point(t, r, v, m):
            return moving(t, r + self.origin, v, m)

        momenta = step_momenta(rule, point, t0, h, r, m, push)
        for momentum, at in zip(momenta, nodes, strict=True):
            local.add(self.rows["dynamics"], momentum, at)
        moves = [position - r[0] for position in r[1:]]
        for i, constraint in enumerate(self.constraints):
            at_gauss = [weighted(row[1:], moves) / h for row in rule.slopes_at(rule.gauss_points())]
            rows = [
                row._replace(name=str(g)) for g, v in enumerate(at_gauss) for row in constraint.speed_rows(v)
            ]
            local.limit(_title(constraint, i), "step", rows)
        if self.hold:
            local.limit("actuator", "control", self.actuator.rows(u[0]))
        if problem.actuator.burns:
            self._burn(local, h, m, [self.actuator.flow(control) for control in u])
        if self._cost_in_steps():
            v = step_velocities(rule, h, r)
            if self.hold:
                v[0], v[-1] = self._end_velocities(t0, h, r, m, push)
            rates = [
                self._rate(t0 + c * h, r[j] + self.origin, v[j], u[j], m[j]) for j, c in enumerate(rule.points)
            ]
            local.cost = h * weighted(rule.weights, rates)
        return local.block("step")

    def _end_velocities(self, t0: Any, h: Any, r: list, m: list, push: list) -> tuple:
        """Velocities at the ends of a step from its momenta.

        Its mean velocity does not see a held force that alternates from step to step, and a cost of
        it alone lets the force do so.
        """

        def point(t, r, v, m):
            return self.dynamics.point(t, r + self.origin, v, m)

        momenta = step_momenta(self.rule, point, t0, h, r, m, push)
        ends = ((t0, r[0], -momenta[0], m[0]), (t0 + h, r[-1], momenta[-1], m[-1]))
        first, last = (self.dynamics.velocity(t, q + self.origin, p, m) for t, q, p, m in ends)
        return first, last

    def _burn(self, local: _Local, h: Any, m: list, flow: list) -> None:
        """Node masses by the Lobatto IIIA matrix A: m_i = m_0 - h sum_j A_ij flow_j, s rows a step.

        The last row of A is the weights, so the mass used equals the quadrature of the flow exactly.
        """
        rows = [
            (m[i] - m[0] + h * weighted(row, flow)) / self.units.mass
            for i, row in enumerate(self.rule.integral[1:], start=1)
        ]
        local.limit("mass_flow", "between", [Row("", rows[-1], 0.0, 0.0)])
        local.limit("mass_inside", "step", [Row(str(i), row, 0.0, 0.0) for i, row in enumerate(rows[:-1])])

    def _ends_block(self) -> Block:
        """Momenta of the boundary states, conditions on them and the cost of the goal."""
        local = _Local(self, 1)
        position = self.columns["position"].indices
        first, last = (local.take("position", position[:, [at]]) + self.origin for at in (0, -1))
        v = {
            end: local.take(f"{end}.velocity", self.columns[f"{end}.velocity"].indices)
            for end in ("start", "goal")
        }
        start_time, goal_time = self.start_time, self.start_time + local.duration()
        states = {
            "start": (start_time, first, v["start"], local.mass([0])),
            "goal": (goal_time, last, v["goal"], local.mass([-1])),
        }
        dynamics = self.rows["dynamics"]
        local.add(dynamics, self.dynamics.point(*states["start"])[1], [0])
        local.add(dynamics, -self.dynamics.point(*states["goal"])[1], [dynamics.count - 1])
        for end, condition in (("start", self.start), ("goal", self.goal)):
            local.limit(f"{end}.condition", "end", condition.rows(*states[end]))
            rows = [row for constraint in self.constraints for row in constraint.speed_rows(v[end])]
            local.limit(f"{end}.speed", "end", rows)
        local.cost = self.objective.sense * ca.SX(self.objective.terminal(*states["goal"]))
        return local.block("ends")

    def _rate(self, *state) -> Any:
        return self.objective.sense * self.objective.rate(self.actuator, *state)

    def _cost_in_steps(self) -> bool:
        """Whether the running cost looks at the velocity or at a held control."""
        n = self.problem.dimension
        v, u = ca.SX.sym("v", n), ca.SX.sym("u", self.actuator.size(n))
        rate = ca.SX(self._rate(ca.SX.sym("t"), ca.SX.sym("q", n), v, u, ca.SX.sym("m")))
        return ca.depends_on(rate, v) or (self.hold and ca.depends_on(rate, u))


class _Local:
    """The unknowns, numbers and rows of one block while it is being written down."""

    def __init__(self, transcript: Transcript, count: int):
        self.transcript, self.count, self.cost = transcript, count, ca.SX(0)
        self._symbols: list[ca.SX] = []
        self._columns: list[np.ndarray] = []
        self._data: list[ca.SX] = []
        self._values: list[np.ndarray] = []
        self._rows: list[ca.SX] = []
        self._targets: list[np.ndarray] = []

    def take(self, name: str, columns: np.ndarray) -> ca.SX:
        """Symbols for the unknowns at `columns`, shape (components, count)."""
        self._symbols.append(ca.SX.sym(name, columns.shape[0]))
        self._columns.append(columns)
        return self._symbols[-1]

    def number(self, values: np.ndarray) -> ca.SX:
        """A symbol for a number that differs between evaluations."""
        self._data.append(ca.SX.sym("d"))
        self._values.append(values)
        return self._data[-1]

    def mass(self, nodes: Any) -> ca.SX:
        """The mass at nodes: unknowns if it burns away, a parameter if not."""
        if not self.transcript.problem.actuator.burns:
            return self.transcript.mass
        return self.take("mass", self.transcript.columns["mass"].indices[:, nodes])

    def duration(self) -> ca.SX:
        """The duration: an unknown if it is free, a parameter if not."""
        if not self.transcript.problem.free_duration:
            return self.transcript.duration
        return self.take("duration", np.repeat(self.transcript.columns["duration"].indices, self.count, axis=1))

    def add(self, group: Group, rows: ca.SX, at: Sequence[int] | np.ndarray | None = None) -> None:
        """Add to rows of a group that others also add to."""
        self._rows.append(rows)
        self._targets.append(group.indices if at is None else group.indices[:, at])

    def limit(self, name: str, kind: str, rows: Sequence[Row]) -> None:
        """Rows of this block alone."""
        if rows:
            units = self.transcript.units
            sizes = {"": 1.0, "m": units.length, "m/s": units.length / units.time}
            scale = np.array([[1 / sizes[row.unit] for row in rows]])
            group = self.transcript._add_rows(name, kind, rows, self.count, scale)
            self.add(group, ca.vertcat(*[row.expression for row in rows]))

    def block(self, name: str) -> Block:
        return Block(
            name,
            ca.vertcat(*self._symbols),
            ca.vertcat(*self._data),
            self.transcript.parameters,
            ca.vertcat(*self._rows),
            ca.SX(self.cost),
            np.vstack(self._columns),
            np.vstack(self._targets),
            np.vstack(self._values) if self._values else np.empty((0, self.count)),
        )


def _title(constraint: Any, index: int) -> str:
    """KeepOut, second in the list: keep_out_2."""
    return re.sub(r"(?<!^)(?=[A-Z])", "_", type(constraint).__name__).lower() + f"_{index + 1}"


def _zeros(dimension: int) -> list[Row]:
    return [Row(axis, 0, 0.0, 0.0) for axis in AXES[:dimension]]
