"""What one would write by hand in CasADi for the same transfer: the methods dmoc is measured against.

Each is written as a practised user of CasADi would: scaled unknowns, one function of a node or a step,
mapped, CasADi's own exact derivatives, Ipopt from a cold start. All but `plain` have position and
velocity as states. They know transfers of fixed duration between two states, with effects, and with a
force that is free or limited (FreeForce, BoxForce, BallForce).

    dmoc study orbit_raise --against scripts/alternatives.py --plot study.png

A method takes (problem, steps) and returns a `dmoc.studies.accuracy.Formulation`; any file with a dictionary
METHODS of such functions can stand in place of this one.

References
----------
J. T. Betts, Practical Methods for Optimal Control and Estimation Using Nonlinear Programming (2010).
W. W. Hager, Runge-Kutta methods in optimal control and the transformed adjoint system (2000).
"""

from __future__ import annotations

from functools import partial

import casadi as ca
import numpy as np
from scipy.interpolate import CubicSpline

from dmoc import State, TransferProblem
from dmoc.configurations.of_problem import configuration_of
from dmoc.effects import Force
from dmoc.guess.starting import starting_guess
from dmoc.motion.dynamics import Dynamics, specific_lagrangian
from dmoc.motion.mesh import uniform_mesh
from dmoc.nlp.units import units_of
from dmoc.studies.accuracy import Formulation


class Draft:
    """An NLP while it is being written down, in units that make its numbers of order 1.

    Time is a fraction of the duration; h is that of a step.
    """

    def __init__(self, problem: TransferProblem, steps: int):
        two_states = isinstance(problem.start, State) and isinstance(problem.goal, State)
        if not two_states or problem.free_duration or problem.constraints or problem.actuator.burns:
            raise ValueError(
                "the alternatives know only transfers of fixed duration between two states, without "
                "constraints or an engine; study another problem, or leave --against out"
            )
        self.problem, self.steps, self.n, self.h = problem, steps, problem.dimension, 1 / steps
        self.duration = problem.duration_bounds[0]
        guess = starting_guess(problem, uniform_mesh(min(max(steps, 100), 2000)), 2, False)
        self.units = units_of(problem, guess)
        self.scale = np.repeat([self.units.length, self.units.length / self.duration], self.n)
        self.origin = np.concatenate([self.units.origin, np.zeros(self.n)])
        clamped = tuple((1, v * self.duration) for v in (guess.start_velocity, guess.goal_velocity))
        self._path = CubicSpline(guess.fractions, guess.position, bc_type=clamped)
        self._unknowns: list[tuple] = []

    def time(self, fraction):
        return self.problem.start_time + self.duration * fraction

    def unknown(self, name: str, guess: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> ca.MX:
        """Unknowns, one column a node, of the shape of their guess."""
        symbol = ca.MX.sym(name, *guess.shape)
        bounds = (np.broadcast_to(side, guess.shape) for side in (lower, upper))
        self._unknowns.append((symbol, *(part.ravel(order="F") for part in (guess, *bounds))))
        return symbol

    def states(self, fractions: np.ndarray, entries: slice = slice(None)) -> ca.MX:
        """States, or some of their entries, of which the first and the last are those of the problem."""
        found = np.hstack([self._path(fractions), self._path(fractions, 1) / self.duration])
        guess = ((found - self.origin) / self.scale).T
        lower, upper = np.full_like(guess, -np.inf), np.full_like(guess, np.inf)
        for place, end in ((0, self.problem.start), (-1, self.problem.goal)):
            known = (np.concatenate(end.fixed()) - self.origin) / self.scale
            lower[:, place], upper[:, place] = (
                np.nan_to_num(known, nan=-np.inf),
                np.nan_to_num(known, nan=np.inf),
            )
        return self.unknown("s", guess[entries], lower[entries], upper[entries])

    def forces(self, count: int) -> ca.MX:
        low, high = (side[:, None] / self.units.force for side in self.problem.actuator.bounds(self.n))
        return self.unknown("u", np.zeros((self.n, count)), low, high)

    def rates(self) -> ca.Function:
        """(fraction, state, force) -> change of the state and running cost, both a fraction of the duration."""
        tau, s, u = ca.SX.sym("tau"), ca.SX.sym("s", 2 * self.n), ca.SX.sym("u", self.n)
        problem, state, force = self.problem, s * self.scale + self.origin, u * self.units.force
        t, q, v, m = self.time(tau), state[: self.n], state[self.n :], problem.mass
        push = Dynamics.of(problem).acceleration(t, q, v, m, force)
        cost = problem.objective.sense * problem.objective.rate(problem.actuator, t, q, v, force, m)
        outputs = [self.duration * ca.vertcat(v, push) / self.scale, self.duration * cost / self.units.cost]
        return ca.Function("rates", [tau, s, u], outputs)

    def limits(self, forces: ca.MX) -> tuple[ca.MX, np.ndarray, np.ndarray]:
        """Rows that keep every force within a limit that is not a bound, and their bounds."""
        u = ca.SX.sym("u", self.n)
        rows = self.problem.actuator.rows(u * self.units.force)
        function = ca.Function("limit", [u], [ca.vertcat(ca.SX(0, 1), *[row.expression for row in rows])])
        count, lower, upper = forces.shape[1], [row.lower for row in rows], [row.upper for row in rows]
        values = ca.vec(function.map(count)(forces)) if rows else ca.MX(0, 1)
        return values, np.tile(lower, count), np.tile(upper, count)

    def formulation(self, defects: ca.MX, cost: ca.MX, ends: ca.MX, forces: ca.MX, points) -> Formulation:
        """The NLP; `ends` are the first and last state, side by side."""
        problem, last = self.problem, ends[:, 1] * self.scale + self.origin
        at_goal = (self.time(1.0), last[: self.n], last[self.n :], problem.mass)
        terminal = problem.objective.sense * problem.objective.terminal(*at_goal) / self.units.cost
        limits, low, high = self.limits(forces)
        symbols, guess, lower, upper = zip(*self._unknowns, strict=True)
        zeros = np.zeros(defects.numel())
        return Formulation(
            x=ca.veccat(*symbols),
            f=ca.sum2(cost) + terminal,
            g=ca.vertcat(ca.vec(defects), limits),
            guess=np.concatenate(guess),
            bounds=(np.concatenate(lower), np.concatenate(upper)),
            row_bounds=(np.append(zeros, low), np.append(zeros, high)),
            objective_unit=problem.objective.sense * self.units.cost,
            ends=ends * self.scale + self.origin,
            controls=forces * self.units.force,
            points=points,
        )


def trapezoid(problem: TransferProblem, steps: int) -> Formulation:
    """Trapezoidal collocation, force linear over each step: order 2 (Betts)."""
    draft = Draft(problem, steps)
    at = np.linspace(0, 1, steps + 1)
    s, u = draft.states(at), draft.forces(steps + 1)
    change, cost = draft.rates().map(steps + 1)(at[None], s, u)
    defects = s[:, 1:] - s[:, :-1] - 0.5 * draft.h * (change[:, 1:] + change[:, :-1])
    return draft.formulation(defects, cost * weights(steps, (0.5, 0.5)), s[:, [0, steps]], u, (0.0, 1.0))


def rk4_shooting(problem: TransferProblem, steps: int, hold: bool = False) -> Formulation:
    """Multiple shooting, a classical Runge-Kutta step each, force at its ends and middle: order 4 (Hager).

    With `hold` the force is constant over each step, as is often seen: order 2.
    """
    draft = Draft(problem, steps)
    at, h, rates = np.linspace(0, 1, steps + 1), draft.h, draft.rates()
    tau, before, f = ca.SX.sym("tau"), ca.SX.sym("s", 2 * draft.n), ca.SX.sym("u", draft.n, 1 if hold else 3)
    first, middle, last = (f, f, f) if hold else ca.horzsplit(f)
    k1, c1 = rates(tau, before, first)
    k2, c2 = rates(tau + h / 2, before + h / 2 * k1, middle)
    k3, c3 = rates(tau + h / 2, before + h / 2 * k2, middle)
    k4, c4 = rates(tau + h, before + h * k3, last)
    outputs = [before + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), h / 6 * (c1 + 2 * c2 + 2 * c3 + c4)]
    step = ca.Function("step", [tau, before, ca.vec(f)], outputs)
    s, u = draft.states(at), draft.forces(steps if hold else 2 * steps + 1)
    stages = u if hold else ca.vertcat(u[:, :-1:2], u[:, 1::2], u[:, 2::2])
    after, cost = step.map(steps)(at[None, :-1], s[:, :-1], stages)
    points = (0.5,) if hold else (0.0, 0.5, 1.0)
    return draft.formulation(s[:, 1:] - after, cost, s[:, [0, steps]], u, points)


def hermite_simpson(problem: TransferProblem, steps: int) -> Formulation:
    """Hermite-Simpson collocation, separated form, force at ends and middle: order 4 (Betts)."""
    draft = Draft(problem, steps)
    at, h = np.linspace(0, 1, 2 * steps + 1), draft.h
    s, u = draft.states(at), draft.forces(2 * steps + 1)
    change, cost = draft.rates().map(2 * steps + 1)(at[None], s, u)
    s0, s1, s2 = s[:, :-1:2], s[:, 1::2], s[:, 2::2]
    f0, f1, f2 = change[:, :-1:2], change[:, 1::2], change[:, 2::2]
    middle = s1 - 0.5 * (s0 + s2) - h / 8 * (f0 - f2)
    defects = ca.vertcat(middle, s2 - s0 - h / 6 * (f0 + 4 * f1 + f2))
    cost = cost * weights(steps, (1 / 6, 4 / 6, 1 / 6))
    return draft.formulation(defects, cost, s[:, [0, 2 * steps]], u, (0.0, 0.5, 1.0))


def radau(problem: TransferProblem, steps: int, degree: int) -> Formulation:
    """Radau collocation of degree d, a force at each of its points: order 2 d - 1."""
    draft = Draft(problem, steps)
    points = ca.collocation_points(degree, "radau")
    slopes, _, shares = (np.array(numbers) for numbers in ca.collocation_coeff(points))
    at = np.append(0.0, (np.arange(steps)[:, None] + points).ravel() * draft.h)
    s, u = draft.states(at), draft.forces(degree * steps)
    change, cost = draft.rates().map(degree * steps)(at[None, 1:], s[:, 1:], u)
    # the last point of a step is the first of the next
    nodes = [s[:, :-1:degree], *[s[:, 1 + j :: degree] for j in range(degree)]]
    defects = [
        sum(float(slopes[j, i]) * node for j, node in enumerate(nodes)) - draft.h * change[:, i::degree]
        for i in range(degree)
    ]
    cost = cost * draft.h * np.tile(shares.ravel(), steps)[None]
    return draft.formulation(ca.vertcat(*defects), cost, s[:, [0, degree * steps]], u, tuple(points))


def plain(problem: TransferProblem, steps: int) -> Formulation:
    """Equation (16) as it is written down, over three neighbouring positions: dmoc's own scheme of order 2."""
    draft = Draft(problem, steps)
    at, n, h = np.linspace(0, 1, steps + 1), draft.n, draft.h
    q, v = draft.states(at, slice(n)), draft.states(np.array([0.0, 1.0]), slice(n, None))
    u = draft.forces(steps + 1)
    momenta, at_rest = _momenta(draft), ca.DM(n, steps + 1)
    kick = h * draft.units.force * draft.duration / problem.mass / draft.scale[-1]
    tau, *three, f = ca.SX.sym("tau"), *(ca.SX.sym(name, n) for name in ("before", "here", "after", "f"))
    row = momenta(tau - h, *three[:2], at_rest[:, 0])[1] - momenta(tau, *three[1:], at_rest[:, 0])[0] + kick * f
    inside = ca.Function("inside", [tau, *three, f], [ca.cse(row)]).map(steps - 1)
    rows = inside(at[None, 1:-1], q[:, :-2], q[:, 1:-1], q[:, 2:], u[:, 1:-1])
    leaving, _, start = momenta(0.0, q[:, 0], q[:, 1], v[:, 0])
    _, arriving, _ = momenta(1.0 - h, q[:, -2], q[:, -1], v[:, 1])
    goal = momenta(1.0, q[:, -1], q[:, -1], v[:, 1])[2]
    defects = [start - leaving + 0.5 * kick * u[:, 0], rows, arriving - goal + 0.5 * kick * u[:, -1]]
    _, cost = draft.rates().map(steps + 1)(at[None], ca.vertcat(q, at_rest), u)
    ends = ca.vertcat(q[:, [0, steps]], v)
    return draft.formulation(ca.horzcat(*defects), cost * weights(steps, (0.5, 0.5)), ends, u, (0.0, 1.0))


def _momenta(draft: Draft) -> ca.Function:
    """(fraction, q0, q1, v) -> momenta that leave q0 and arrive at q1 in a step, and that of (q0, v)."""
    n, problem, (length, speed) = draft.n, draft.problem, draft.scale[[0, -1]]
    tau, q0, q1, v = ca.SX.sym("tau"), *(ca.SX.sym(name, n) for name in ("q0", "q1", "v"))
    ends = [(draft.time(at), q * length + draft.units.origin) for at, q in ((tau, q0), (tau + draft.h, q1))]
    h, m, velocity = draft.h * draft.duration, problem.mass, speed * (q1 - q0) / draft.h

    def lagrangian(t, q, v):
        return 0.5 * ca.dot(v, v) + specific_lagrangian(problem.effects, configuration_of(problem), t, q, v, m)

    working = [effect for effect in problem.effects if isinstance(effect, Force)]
    pushes = [0.5 * h / m * sum(e.force(t, q, velocity, m) for e in working) for t, q in ends]
    action = 0.5 * h * sum(lagrangian(t, q, velocity) for t, q in ends)
    leaving, arriving = (
        ca.gradient(action, q) / length + push for q, push in zip((q0, q1), pushes, strict=True)
    )
    resting = ca.gradient(lagrangian(*ends[0], speed * v), v) / speed
    return ca.Function("momenta", [tau, q0, q1, v], [-leaving / speed, arriving / speed, resting / speed])


def weights(steps: int, shares: tuple) -> np.ndarray:
    """Weights of the nodes, a row, of a quadrature with these shares at equidistant nodes of each step."""
    inner, row = len(shares) - 1, np.zeros(steps * (len(shares) - 1) + 1)
    for j, share in enumerate(shares):
        row[j : j + inner * (steps - 1) + 1 : inner] += share / steps
    return row[None]


METHODS = {
    "plain": plain,
    "trapezoid": trapezoid,
    "RK4 shooting": rk4_shooting,
    "RK4 shooting, held": partial(rk4_shooting, hold=True),
    "Hermite-Simpson": hermite_simpson,
    "Radau 3": partial(radau, degree=3),
    "Radau 5": partial(radau, degree=5),
}
