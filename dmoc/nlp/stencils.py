"""The contributions of one node, one step and the two ends to the NLP, as small functions of few unknowns.

An effect that looks only at time, position and mass acts once a node, with the node's whole weight;
one that looks at the velocity acts in every step with that step's own velocities. Either way the
rows add up to the discrete Euler-Lagrange equations of `dmoc.motion.step`. Nothing here depends on the
mesh, on units or on numbers that may change from solve to solve: a stencil that was written down once
serves every mesh, and every problem of the same structure.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import casadi as ca

from dmoc.basics.memory import remembered
from dmoc.basics.unknown import with_field
from dmoc.configurations.acting import point_function, split_effects, state_symbols
from dmoc.configurations.of_problem import configuration_of
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import Scheme, scheme
from dmoc.motion.path import INNER_MASSES
from dmoc.motion.step import step_momenta, step_velocities, weighted
from dmoc.nlp.draft import ALL, Draft
from dmoc.nlp.frames import are_alike, lone_pull
from dmoc.nlp.layout import CONSTRAINT, Owner, Stencil, Stencils
from dmoc.nlp.lesson import Lesson
from dmoc.parts.rows import Row, built_in, title, with_symbols
from dmoc.results.flown_cost import mass_worth
from dmoc.scene.problem import TransferProblem

# A stencil takes the first entry of a group: that of the start.
FIRST = slice(0, 1)
# A stencil takes the last entry of a group: that of the goal.
LAST = slice(-1, None)


def stencils_of(
    problem: TransferProblem, order: int, hold: bool, curved: bool = False, joined: bool = False
) -> Stencils:
    """The stencils of a problem, written down once for all problems of the same structure.

    If `curved`, in the unknowns of a `Chart`. If `joined`, of a leg of a mission, whose time and mass at the
    start are unknowns.
    """
    # The type belongs to the key: the structure of a user's part may happen to equal that of one of dmoc's.
    same = [_structure(part) for part in (problem.actuator, problem.start, problem.goal)]
    zones = [(_structure(constraint), constraint.on) for constraint in problem.constraints]
    shape = configuration_of(problem), problem.free_duration, order, hold, curved, joined
    make = partial(_written, problem, scheme(order), hold, curved, joined)
    return remembered(make, "formulas", *shape, problem.effects, same, problem.objective, zones)


def _structure(part: Any) -> tuple:
    """What the rows of a part depend on beside its adjustable numbers.

    Numbers of the library's parts are symbols or bounds. A user's own part may build any number into its rows
    that it does not name as adjustable.
    """
    known = type(part).__module__.startswith("dmoc.")
    return type(part), part.structure, () if known else tuple(built_in(part).items())


def _written(problem: TransferProblem, rule: Scheme, hold: bool, curved: bool, joined: bool) -> Stencils:
    writer = Writer(problem, rule, hold, curved, joined)
    return Stencils((writer.node(), writer.step(), writer.ends()), writer.parameters.numel())


class Writer:
    """A problem's formulas while they are being written down: its parts with symbols as their numbers."""

    def __init__(self, problem: TransferProblem, rule: Scheme, hold: bool, curved: bool, joined: bool):
        self.problem, self.rule, self.hold, self.curved = problem, rule, hold, curved
        self.joined = joined
        self.origin, self.start_time = ca.SX.sym("origin", problem.size), ca.SX.sym("start_time")
        self.mass = ca.SX.sym("mass")
        head = [self.origin, self.start_time, self.mass]
        if not problem.free_duration:
            self.duration = ca.SX.sym("duration")
            head.append(self.duration)
        twins = [with_symbols(part, f"part_{i}") for i, part in enumerate(problem.adjustable_parts)]
        self.parameters = ca.vertcat(*head, *[symbol for _, symbols in twins for symbol in symbols])
        self.actuator, self.objective, self.start, self.goal, *others = [twin for twin, _ in twins]
        self.constraints, unknown = others[: len(problem.constraints)], iter(others[len(problem.constraints) :])
        self.effects = tuple(next(unknown) if one.adjustable else one for one in problem.effects)
        # After the effects comes an unknown inertia.
        for part in unknown:
            problem = with_field(problem, "inertia", part.moments)
        self.dynamics = Dynamics.of(problem, self.effects)
        # A cost of the final mass is paid where propellant is burnt, as that of Fuel is: by the rows of masses
        # the two are the same. Paid at the goal alone, it took five times the iterations, or did not end.
        self.mass_worth = mass_worth(problem)
        self.lesson = Lesson(self) if problem.objective.learns else None
        # Whether controls and their cost are the same in every frame.
        self.alike = curved and self._is_alike()

    def node(self) -> Stencil:
        """Impulse, cost and limits of one node."""
        draft, n, body = Draft(self), self.dynamics.positions, self.dynamics.configuration
        r, frame = draft.place()
        u = None if self.hold else draft.control(frame)
        m, duration = draft.mass(ALL), draft.duration()
        fraction, weight = draft.number("fraction"), draft.number("weight")
        t, q = draft.clock() + fraction * duration, r + self.origin
        # The kinetic energy and effects that look at the velocity act in the steps, with their own velocities.
        resting, _ = split_effects(self.effects, body)
        # What turns with the frame is added in it: there it is free of the angle.
        turning: Any = 0
        if self.curved and (pull := lone_pull(resting, body)) is not None:
            turning = draft.pulled(pull[1])
            resting = tuple(one for one in resting if one is not pull[0])
        dldq, _, push = point_function(resting, body, kinetic=False)(t, q, ca.DM.zeros(n), m)
        driven = 0 if u is None else body.driven(self.actuator, q, u, m)
        push, turning = (push, turning + driven) if self.alike else (push + driven, turning)
        if body.conditions:
            push = push - body.pull(q, draft.take("reaction", body.conditions))
        draft.add("dynamics", frame.T @ (duration * weight * (dldq + push)) + duration * weight * turning)
        if body.surplus:
            rows = [Row(str(i), row, 0.0, 0.0) for i, row in enumerate(ca.vertsplit(body.g(q))[: body.surplus])]
            draft.limit(CONSTRAINT, "node", rows)
        self._links(draft, "", body.links_at(q))
        at = body.at(q, ca.DM.zeros(n), m) if self.constraints else {}
        for i, constraint in enumerate(self.constraints):
            rows = constraint.rows_at(t, at, u, m)
            draft.limit(constraint.title(i), "node", rows, Owner("constraints", i))
        if u is not None:
            draft.limit("actuator", "control", self.actuator.rows(u), Owner("actuator"))
        if not self._cost_in_steps():
            draft.cost = duration * weight * self._rate(t, q, ca.DM.zeros(n), u, m)
        return draft.stencil("node")

    def step(self) -> Stencil:
        """Momenta of one step; cost and limits that look at its velocities or at a held control."""
        rule, problem = self.rule, self.problem
        draft, size = Draft(self), self.dynamics.controls
        # nodes[j] picks the j-th node of every step out of all steps * s + 1 nodes.
        nodes = [slice(j, j - rule.degree or None, rule.degree) for j in range(rule.degree + 1)]
        r, frames = map(list, zip(*(draft.place(at) for at in nodes), strict=True))
        r = draft.between(r) if self.curved else r
        duration, costly = draft.duration(), self._cost_in_steps() or problem.actuator.burns
        begin, length = draft.number("begin"), draft.number("length")
        h, m = length * duration, [draft.mass(at) for at in nodes]
        u: list = [None] * (rule.degree + 1)
        if self.hold:
            u = [draft.take("force", size)] * (rule.degree + 1)
        elif costly:
            u = [draft.control(frame, at) for frame, at in zip(frames, nodes, strict=True)]
        body = self.dynamics.configuration
        push = [
            body.driven(self.actuator, place + self.origin, u[0], mass) if self.hold else 0
            for place, mass in zip(r, m, strict=True)
        ]
        moving = self.dynamics.step_point(rule.degree, split_effects(self.effects, body)[1])
        t0 = draft.clock() + begin * duration

        def point(t, r, v, m):
            return moving(t, r + self.origin, v, m)

        v = step_velocities(rule, h, r)
        if body.surplus and rule.degree > 1:
            v = draft.between(v)
        momenta = step_momenta(rule, point, t0, h, r, m, push, body, self.origin, v)
        for momentum, frame, at in zip(momenta, frames, nodes, strict=True):
            draft.add("dynamics", frame.T @ momentum, at)
        moves = [position - r[0] for position in r[1:]]
        for i, constraint in enumerate(self.constraints):
            at_gauss = [weighted(row[1:], moves) / h for row in rule.slopes_at(rule.gauss_points())]
            states = zip(rule.values_at(rule.gauss_points()), at_gauss, strict=True)
            inside = [body.at(self.origin + weighted(row, r), v, self.mass) for row, v in states]
            rows = [
                row._replace(name=str(g)) for g, at in enumerate(inside) for row in constraint.speed_rows_at(at)
            ]
            draft.limit(constraint.title(i), "step", rows, Owner("constraints", i))
        if self.hold:
            draft.limit("actuator", "control", self.actuator.rows(u[0]), Owner("actuator"))
        if problem.actuator.burns:
            self._burn(draft, h, m, [self.actuator.flow(control) for control in u])
        if self._cost_in_steps():
            if self.hold:
                v[0], v[-1] = self._end_velocities(t0, h, r, m, push)
            rates = [
                self._rate(t0 + c * h, r[j] + self.origin, v[j], u[j], m[j]) for j, c in enumerate(rule.points)
            ]
            draft.cost = h * weighted(rule.weights, rates)
        return draft.stencil("step")

    def _end_velocities(self, t0: Any, h: Any, r: list, m: list, push: list) -> tuple:
        """Velocities at the ends of a step from its momenta.

        The mean velocity of a step does not change with a held force that alternates from step to step, so a
        cost of that velocity would let the force alternate.
        """

        def point(t, r, v, m):
            return self.dynamics.step_point(self.rule.degree)(t, r + self.origin, v, m)

        body = self.dynamics.configuration
        momenta = step_momenta(self.rule, point, t0, h, r, m, push, body, self.origin)
        momenta = [body.along(q + self.origin, p) for q, p in zip(r, momenta, strict=True)]
        ends = ((t0, r[0], -momenta[0], m[0]), (t0 + h, r[-1], momenta[-1], m[-1]))
        found = []
        for t, q, p, m in ends:
            at = q + self.origin
            found.append(body.velocity(at, self.dynamics.velocity(t, at, p, m)))
        return tuple(found)

    def _burn(self, draft: Draft, h: Any, m: list, flow: list) -> None:
        """Node masses by the Lobatto IIIA matrix A: m_i = m_0 - h sum_j A_ij flow_j, s rows a step.

        The last row of A is the weights, so the mass used equals the quadrature of the flow exactly.
        """
        matrix = self.rule.integral
        rows = [
            Row(str(i), m[i] - m[0] + h * weighted(matrix[i], flow), 0.0, 0.0, "kg")
            for i in range(1, len(matrix))
        ]
        draft.limit("mass_flow", "between", [rows[-1]._replace(name="")])
        draft.limit(INNER_MASSES, "step", rows[:-1])

    def ends(self) -> Stencil:
        """Momenta of the boundary states, conditions on them and the cost of the goal."""
        draft, body = Draft(self), self.dynamics.configuration
        (first, before), (last, after) = (draft.place(at) for at in (FIRST, LAST))
        first, last = first + self.origin, last + self.origin
        v = {end: draft.velocity(end, frame) for end, frame in (("start", before), ("goal", after))}
        start_time = draft.clock()
        goal_time = start_time + draft.duration()
        states = {
            "start": (start_time, first, v["start"], draft.mass(FIRST)),
            "goal": (goal_time, last, v["goal"], draft.mass(LAST)),
        }
        for name, frame, at in (("start", before.T, FIRST), ("goal", -after.T, LAST)):
            t, q, w, m = states[name]
            draft.add("dynamics", frame @ self.dynamics.point(t, q, body.velocity(q, w), m)[1], at)
        for end in ("start", "goal"):
            self._links(draft, end, body.opening(states[end][1], states[end][2]))
        for end, condition in (("start", self.start), ("goal", self.goal)):
            draft.limit(f"{end}.condition", "end", condition.rows(*states[end]), Owner(end))
            _, q, w, _ = states[end]
            here = body.at(q, body.velocity(q, w), self.mass)
            speed = [(i, rows) for i, one in enumerate(self.constraints) if (rows := one.speed_rows_at(here))]
            for count, (i, rows) in enumerate(speed):
                name = f"{end}.speed" + (f"_{count + 1}" if count else "") + self.constraints[i].row_of_body
                draft.limit(name, "end", rows, Owner("constraints", i, end))
        t, q, w, m = states["goal"]
        seen = self._seen((t, q, body.velocity(q, w), m))
        burnt = self.mass_worth * (states["start"][3] - m)
        draft.cost = self.objective.sense * ca.SX(self.objective.terminal(*seen) + burnt)
        return draft.stencil("ends")

    def _links(self, draft: Draft, end: str, rows: Any) -> None:
        """Rows that keep the links together at a node or, of velocities, at one end; link by link."""
        begin = 0
        for i, (link, units) in enumerate(
            zip(self.problem.links, self.dynamics.configuration.link_units, strict=True)
        ):
            known = [unit if unit in ("m", "rad") else "" for unit in units]
            mine = [
                Row(str(k), rows[begin + k], 0.0, 0.0, unit and unit + "/s" * bool(end))
                for k, unit in enumerate(known)
            ]
            begin += len(units)
            name = f"{end}.{title(link, i)}" if end else title(link, i)
            draft.limit(name, "end" if end else "node", mine, Owner("links", i, end))

    def _rate(self, t: Any, q: Any, v: Any, u: Any, m: Any) -> Any:
        t, q, v, m = self._seen((t, q, v, m))
        rate = self.objective.rate(self.actuator, t, q, v, u, m)
        if self.mass_worth:
            rate = rate - self.mass_worth * self.actuator.flow(u)
        return self.objective.sense * rate

    def _is_alike(self) -> bool:
        """Whether a control acts, burns and costs the same in every frame."""
        t, q, v, m = state_symbols(self.dynamics.positions)

        def acts(u: ca.SX) -> ca.SX:
            return self.dynamics.configuration.driven(self.actuator, q, u, m)

        def tells(u: ca.SX) -> ca.SX:
            limits = [row.expression for row in self.actuator.rows(u)]
            burnt = [self.actuator.flow(u)] if self.actuator.burns else []
            return ca.vertcat(self._rate(t, q, v, u, m), *burnt, *limits)

        return are_alike(acts, tells, self.dynamics.controls, self.dynamics.positions)

    def _seen(self, state: tuple) -> tuple:
        """A state as an objective sees it: position and velocity of a body in space."""
        t, q, v, m = state
        body = self.dynamics.configuration.body(q, v)
        return t, body.position, body.velocity, m

    def _cost_in_steps(self) -> bool:
        """Whether the running cost looks at the velocity or at a held control."""
        n = self.dynamics.positions
        v, u = ca.SX.sym("v", n), ca.SX.sym("u", self.dynamics.controls)
        rate = ca.SX(self._rate(ca.SX.sym("t"), ca.SX.sym("q", n), v, u, ca.SX.sym("m")))
        return ca.depends_on(rate, v) or (self.hold and ca.depends_on(rate, u))
