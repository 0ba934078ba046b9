"""What one would write by hand in CasADi for the same transfer: the methods dmoc is measured against.

Each is written as a practised user of CasADi would: scaled unknowns, one function of a node or a step,
mapped, CasADi's own exact derivatives, Ipopt from a cold start. All but `plain` have position and
velocity as states, and of a body that turns its quaternion and rate, by dq/dt = q o w / 2 and Euler's
equations: nothing but its own accuracy keeps the quaternion's length. They know transfers of fixed duration
between two states, with effects, and with forces and torques that are free or limited.

    dmoc study orbit_raise --against scripts/alternatives.py --plot study.png
    dmoc study reorientation --against scripts/alternatives.py

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

from dmoc import Attitude, Pose, State, TransferProblem
from dmoc.basics.quaternions import conjugate, normalised, times
from dmoc.configurations.acting import specific_lagrangian
from dmoc.configurations.of_problem import configuration_of
from dmoc.guess.starting import starting_guess
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.mesh import uniform_mesh
from dmoc.nlp.units import units_of
from dmoc.studies.accuracy import Formulation


class Draft:
    """An NLP while it is being written down, in units that make its numbers of order 1.

    Time is a fraction of the duration; h is that of a step.
    """

    def __init__(self, problem: TransferProblem, steps: int):
        states = all(isinstance(end, (State, Pose, Attitude)) for end in (problem.start, problem.goal))
        more = problem.free_duration or problem.constraints or problem.actuator.burns
        if not states or more or problem.actuator.wheel_axes:
            raise ValueError(
                "the alternatives know only transfers of fixed duration between two states, without "
                "constraints, an engine or wheels; study another problem, or leave --against out"
            )
        self.problem, self.steps, self.h = problem, steps, 1 / steps
        self.dynamics, self.body = Dynamics.of(problem), configuration_of(problem)
        # Numbers of coordinates, of velocities and of controls.
        self.n, self.freedom, self.size = self.body.size, self.body.freedom, problem.controls
        self.duration = problem.duration_bounds[0]
        guess = starting_guess(problem, uniform_mesh(min(max(steps, 100), 2000)), 2, False)
        self.units, made = units_of(problem, guess), self.body.coordinates
        length, attitudes = self.units.length, [1.0, 0.0]
        self.scale = np.append(made.sized(length, *attitudes), made.paced(length, *attitudes) / self.duration)
        self.push = np.array([self.units.of(unit) for unit in problem.actuator.units(problem.dimension)])
        self.origin = np.concatenate([self.units.origin, np.zeros(self.freedom)])
        ends = zip(guess.position[[0, -1]], (guess.start_velocity, guess.goal_velocity), strict=True)
        slopes = [self.dynamics.to_slopes(*end).full().ravel() * self.duration for end in ends]
        self._path = CubicSpline(guess.fractions, guess.position, bc_type=tuple((1, slope) for slope in slopes))
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
        found = self._guessed(fractions)
        guess = ((found - self.origin) / self.scale).T
        lower, upper = np.full_like(guess, -np.inf), np.full_like(guess, np.inf)
        for place, end in ((0, self.problem.start), (-1, self.problem.goal)):
            state = np.concatenate(end.fixed())
            for at in self.body.coordinates.quaternions if place else []:
                # Three entries of a quaternion that keeps its length are enough; a fourth is a row too many.
                state[at.start + np.argmax(np.abs(state[at]))] = np.nan
            known = (state - self.origin) / self.scale
            lower[:, place], upper[:, place] = (
                np.nan_to_num(known, nan=-np.inf),
                np.nan_to_num(known, nan=np.inf),
            )
        return self.unknown("s", guess[entries], lower[entries], upper[entries])

    def _guessed(self, fractions: np.ndarray) -> np.ndarray:
        """Coordinates and velocities of the guess, a row each."""
        q, slopes = self._path(fractions), self._path(fractions, 1) / self.duration
        parts = [slopes[:, self.body.coordinates.places]]
        for at in self.body.coordinates.quaternions:
            q[:, at] = normalised(q[:, at])
            parts.append(2 * times(conjugate(q[:, at]), slopes[:, at])[:, 1:])
        return np.hstack([q, *parts])

    def forces(self, count: int) -> ca.MX:
        low, high = (
            side[:, None] / self.push[:, None] for side in self.problem.actuator.bounds(self.problem.dimension)
        )
        return self.unknown("u", np.zeros((self.size, count)), low, high)

    def rates(self) -> ca.Function:
        """(fraction, state, force) -> change of the state and running cost, both a fraction of the duration."""
        tau, s, u = ca.SX.sym("tau"), ca.SX.sym("s", self.n + self.freedom), ca.SX.sym("u", self.size)
        problem, state, force = self.problem, s * self.scale + self.origin, u * self.push
        t, q, w, m = self.time(tau), state[: self.n], state[self.n :], problem.mass
        push = self.dynamics.acceleration(t, q, w, m, self.dynamics.wrench(q, force))
        v = self.body.velocity(q, w)
        seen = self.body.body(q, v)
        rate = problem.objective.rate(problem.actuator, t, seen.position, seen.velocity, force, m)
        cost = problem.objective.sense * rate
        outputs = [self.duration * ca.vertcat(v, push) / self.scale, self.duration * cost / self.units.cost]
        return ca.Function("rates", [tau, s, u], outputs)

    def limits(self, forces: ca.MX) -> tuple[ca.MX, np.ndarray, np.ndarray]:
        """Rows that keep every force within a limit that is not a bound, and their bounds."""
        u = ca.SX.sym("u", self.size)
        rows = self.problem.actuator.rows(u * self.push)
        function = ca.Function("limit", [u], [ca.vertcat(ca.SX(0, 1), *[row.expression for row in rows])])
        count, lower, upper = forces.shape[1], [row.lower for row in rows], [row.upper for row in rows]
        values = ca.vec(function.map(count)(forces)) if rows else ca.MX(0, 1)
        return values, np.tile(lower, count), np.tile(upper, count)

    def formulation(self, defects: ca.MX, cost: ca.MX, ends: ca.MX, forces: ca.MX, points) -> Formulation:
        """The NLP; `ends` are the first and last state, side by side."""
        problem, last = self.problem, ends[:, 1] * self.scale + self.origin
        places, speeds = (
            np.flatnonzero(mask) for mask in (self.body.coordinates.places, self.body.coordinates.speeds)
        )
        at_goal = (self.time(1.0), last[places], last[self.n + speeds], problem.mass)
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
            controls=forces * self.push,
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
    tau, before, f = (
        ca.SX.sym("tau"),
        ca.SX.sym("s", len(draft.scale)),
        ca.SX.sym("u", draft.size, 1 if hold else 3),
    )
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
    """Equation (16) as it is written down, over three neighbouring positions: dmoc's own scheme of order 2.

    Of a body that turns the rows are those of Manchester and Peck, and each quaternion keeps its length by one
    more.
    """
    draft = Draft(problem, steps)
    at, n, h = np.linspace(0, 1, steps + 1), draft.n, draft.h
    q, v = draft.states(at, slice(n)), draft.states(np.array([0.0, 1.0]), slice(n, None))
    u = draft.forces(steps + 1)
    momenta, kick = _momenta(draft), _kick(draft)
    tau, f = ca.SX.sym("tau"), ca.SX.sym("f", draft.size)
    three, still = [ca.SX.sym(name, n) for name in ("before", "here", "after")], ca.DM(draft.freedom, 1)
    passing = momenta(tau - h, *three[:2], still)[1] - momenta(tau, *three[1:], still)[0]
    row = ca.vertcat(passing + kick(three[1], f), draft.body.g(three[1]))
    inside = ca.Function("inside", [tau, *three, f], [ca.cse(row)]).map(steps - 1)
    rows = inside(at[None, 1:-1], q[:, :-2], q[:, 1:-1], q[:, 2:], u[:, 1:-1])
    leaving, _, start = momenta(0.0, q[:, 0], q[:, 1], v[:, 0])
    _, arriving, _ = momenta(1.0 - h, q[:, -2], q[:, -1], v[:, 1])
    goal = momenta(1.0, q[:, -1], q[:, -1], v[:, 1])[2]
    length = ca.Function("length", [three[0]], [draft.body.g(three[0])])
    first = start - leaving + 0.5 * kick(q[:, 0], u[:, 0])
    last = arriving - goal + 0.5 * kick(q[:, -1], u[:, -1])
    defects = ca.vertcat(first, ca.vec(rows), last, length(q[:, -1]))
    _, cost = draft.rates().map(steps + 1)(at[None], ca.vertcat(q, ca.DM(draft.freedom, steps + 1)), u)
    ends = ca.vertcat(q[:, [0, steps]], v)
    return draft.formulation(defects, cost * weights(steps, (0.5, 0.5)), ends, u, (0.0, 1.0))


def _kick(draft: Draft) -> ca.Function:
    """(q, u) -> what the controls of a node give in the time of a step, in the units of `_momenta`."""
    q, u = ca.SX.sym("q", draft.n), ca.SX.sym("u", draft.size)
    wrench = draft.dynamics.wrench(q * draft.scale[: draft.n] + draft.origin[: draft.n], u * draft.push)
    given = draft.h * draft.duration * wrench / draft.problem.mass / draft.scale[draft.n :]
    return ca.Function("kick", [q, u], [given])


def _momenta(draft: Draft) -> ca.Function:
    """(fraction, q0, q1, w) -> momenta that leave q0 and arrive at q1 in a step, and that of (q0, w)."""
    n, problem, body = draft.n, draft.problem, draft.body
    tau, q0, q1, w = (
        ca.SX.sym("tau"),
        *(ca.SX.sym(name, n) for name in ("q0", "q1")),
        ca.SX.sym("w", draft.freedom),
    )
    times_at = draft.time(tau), draft.time(tau + draft.h)
    places = [q * draft.scale[:n] + draft.origin[:n] for q in (q0, q1)]
    here = [ca.SX.sym(name, n) for name in ("here", "there")]
    h, m, slope = draft.h * draft.duration, problem.mass, (here[1] - here[0]) / (draft.h * draft.duration)

    def potentials(t, q, v):
        return specific_lagrangian(problem.effects, body, t, q, v, m)

    def pushed(t, q):
        acts = [effect.wrench_of(t, body.body(q, slope), m) for effect in problem.effects]
        return sum(0.5 * h / m * body.generalised(q, *act) for act in acts if act != (None, None))

    ends = list(zip(times_at, here, strict=True))
    action = h * body.kinetic(here[0], slope, m) + 0.5 * h * sum(potentials(t, q, slope) for t, q in ends)
    leaving, arriving = (body.along(q, ca.gradient(action, q) + pushed(t, q)) for t, q in ends)
    v = ca.SX.sym("v", n)
    moving = ca.gradient(body.kinetic(here[0], v, m) + potentials(times_at[0], here[0], v), v)
    resting = body.along(here[0], ca.substitute(moving, v, body.velocity(here[0], w * draft.scale[n:])))
    speed = draft.scale[n:]
    found = ca.substitute([-leaving / speed, arriving / speed, resting / speed], here, places)
    return ca.Function("momenta", [tau, q0, q1, w], found)


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
