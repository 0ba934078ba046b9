"""CasADi by hand on the problems of `tasks.py`: collocation as a practised user writes it, and equation (16).

One function of a step, mapped over the steps, CasADi's own exact derivatives, Ipopt with its defaults but for
the tolerance. A finer mesh may start from the answer of a coarser one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import casadi as ca
import numpy as np
from scipy.interpolate import CubicSpline

from peers.answer import Answer
from peers.tasks import Task, guess, in_plane

OPTIONS = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.tol": 1e-9}
# The barrier parameter at the start of a solve from the answer of a coarser mesh.
BARRIER = 1e-4


@dataclass(frozen=True)
class Rule:
    """Collocation in a step: where states and controls stand, and what ties them together.

    Attributes
    ----------
    states, controls : arrays
        Places in a step. The last state is the first of the next step; so is the last control if `shared`.
    rows : array, shape (rows, states)
        With the states they make rows that equal h times `slopes` times the rates at the controls.
    slopes : array, shape (rows, controls)
    weights : array, shape (controls,)
        Of the cost.
    at : tuple of int
        States at the places of the controls.
    """

    states: np.ndarray
    controls: np.ndarray
    rows: np.ndarray
    slopes: np.ndarray
    weights: np.ndarray
    at: tuple[int, ...]
    shared: bool = False


def hermite_simpson() -> Rule:
    """Separated form, a control at ends and middle: order 4 (Betts 2010)."""
    rows = np.array([[-0.5, 1.0, -0.5], [-1.0, 0.0, 1.0]])
    slopes = np.array([[1 / 8, 0.0, -1 / 8], [1 / 6, 4 / 6, 1 / 6]])
    places = np.array([0.0, 0.5, 1.0])
    return Rule(places, places, rows, slopes, slopes[1], (0, 1, 2), True)


def collocation(degree: int, points: str) -> Rule:
    """At Radau or Legendre points, a control at each: order 2 d - 1 or 2 d."""
    places = np.array(ca.collocation_points(degree, points))
    slopes, ends, weights = (np.array(numbers) for numbers in ca.collocation_coeff(list(places)))
    rows, at = slopes.T, tuple(range(1, degree + 1))
    given, states = np.eye(degree), np.append(0.0, places)
    if points == "legendre":
        rows = np.block([[rows, np.zeros((degree, 1))], [-ends.reshape(1, -1), np.ones((1, 1))]])
        given, states = np.vstack([given, np.zeros(degree)]), np.append(states, 1.0)
    return Rule(states, places, rows, given, weights.ravel(), at)


RULES: dict[str, Callable[[], Rule]] = {"Hermite-Simpson": hermite_simpson}
RULES |= {f"Radau {d}": lambda d=d: collocation(d, "radau") for d in range(2, 8)}
RULES |= {f"Legendre {d}": lambda d=d: collocation(d, "legendre") for d in range(2, 8)}


@dataclass(frozen=True)
class Found:
    """States and controls on a mesh, a column each, at fractions of the duration."""

    at_states: np.ndarray
    states: np.ndarray
    at_controls: np.ndarray
    controls: np.ndarray
    objective: float = np.nan
    status: str = ""


def solve(task: Task, method: str, *steps: int) -> Callable[[], Answer]:
    """One solve from the statement, on so many equal steps, and again on finer ones from what was found."""
    found = None
    for count in steps:
        found = (
            plain(task, count, found) if method == "(16)" else collocated(task, RULES[method](), count, found)
        )
    assert found is not None
    return partial(_answer, task, method, steps[-1], found)


def _answer(task: Task, method: str, steps: int, found: Found) -> Answer:
    last = found.states[:, -1:].T
    end = (in_plane(last) if task.polar else last)[0, : task.axes]
    if method == "(16)":
        nodes = np.arange(steps)[:, None] + np.arange(2)
    else:
        rule = RULES[method]()
        count = len(rule.controls)
        nodes = np.arange(steps)[:, None] * (count - rule.shared) + np.arange(count)
    times, mesh = task.duration * found.at_controls, np.linspace(0.0, task.duration, steps + 1)
    return Answer(found.objective, mesh, times[nodes], found.controls.T[nodes], end, status=found.status)


def _started(task: Task, at_states: np.ndarray, at_controls: np.ndarray, coarse: Found | None) -> tuple:
    """States and controls to start from, a column each."""
    if coarse is None:
        return guess(task, at_states)[0].T, guess(task, at_controls)[1].T
    states = CubicSpline(coarse.at_states, coarse.states, axis=1)(at_states)
    rows = [np.interp(at_controls, coarse.at_controls, row) for row in coarse.controls]
    return states, np.array(rows)


def rates(task: Task) -> ca.Function:
    """(time, state, control) -> change of the state and running cost."""
    t, x, u = ca.SX.sym("t"), ca.SX.sym("x", 2 * task.axes), ca.SX.sym("u", task.controls)
    if task.thrust:
        acceleration = task.thrust / (1 - task.flow * t) * ca.vertcat(ca.sin(u), ca.cos(u))
    else:
        acceleration = task.unit / task.mass * u
    if task.polar:
        r, _, away, across = ca.vertsplit(x)
        turn = across / r
        spin = ca.vertcat(turn * across - task.mu / r**2, -away * turn)
        change = ca.vertcat(away, turn, acceleration + spin)
    else:
        change = ca.vertcat(x[task.axes :], acceleration)
    return ca.Function("rates", [t, x, u], [change, 0 if task.thrust else task.weight * ca.sumsqr(u)])


def collocated(task: Task, rule: Rule, steps: int, coarse: Found | None) -> Found:
    size, count, h = len(task.first), len(rule.states) - 1, task.duration / steps
    own = len(rule.controls) - rule.shared
    begins = np.arange(steps)[:, None] / steps
    at_states = np.append((begins + rule.states[:-1] / steps).ravel(), 1.0)
    at_controls = (begins + rule.controls[:own] / steps).ravel()
    if rule.shared:
        at_controls = np.append(at_controls, 1.0)
    x0, u0 = _started(task, at_states, at_controls, coarse)
    x, u = ca.MX.sym("x", *x0.shape), ca.MX.sym("u", *u0.shape)

    rate, t = rates(task), ca.SX.sym("t")
    xs, us = ca.SX.sym("xs", size, count + 1), ca.SX.sym("us", task.controls, len(rule.controls))
    seen = [
        rate(t + h * c, xs[:, i], us[:, j]) for j, (c, i) in enumerate(zip(rule.controls, rule.at, strict=True))
    ]
    change, cost = (ca.horzcat(*parts) for parts in zip(*seen, strict=True))
    defects = ca.mtimes(xs, rule.rows.T) - h * ca.mtimes(change, rule.slopes.T)
    step = ca.Function("step", [t, xs, us], [ca.vec(defects), h * ca.mtimes(cost, rule.weights)])
    parts = [x[:, i : i + count * (steps - 1) + 1 : count] for i in range(count + 1)]
    pushes = [u[:, j : j + own * (steps - 1) + 1 : own] for j in range(len(rule.controls))]
    rows, costs = step.map(steps)(
        task.duration * begins.T,
        ca.reshape(ca.vertcat(*parts), size, (count + 1) * steps),
        ca.reshape(ca.vertcat(*pushes), task.controls, len(rule.controls) * steps),
    )
    inside = x[: task.axes, :]
    more = [ca.vec(rows)]
    if task.thrust:
        more.append(x[3, -1] ** 2 * x[0, -1] - task.mu)
    objective = -x[0, -1] if task.thrust else ca.sum2(costs)
    fixed = np.full(x0.shape, np.nan)
    fixed[:, 0], fixed[:, -1] = task.first, task.last
    return _solved(task, (x, x0, at_states), (u, u0, at_controls), objective, more, inside, fixed, coarse)


def plain(task: Task, steps: int, coarse: Found | None) -> Found:
    """Equation (16) as it is written down, over positions and forces at the nodes: order 2."""
    n, h, at = task.axes, task.duration / steps, np.linspace(0.0, 1.0, steps + 1)
    x0, u0 = _started(task, at, at, coarse)
    x0 = x0[:n]
    x, u = ca.MX.sym("x", *x0.shape), ca.MX.sym("u", *u0.shape)
    push = h**2 / task.mass * u
    speeds = [h * ca.DM(task.first[n:]), h * ca.DM(task.last[n:])]
    rows = [
        x[:, 1] - x[:, 0] - 0.5 * push[:, 0] - speeds[0],
        ca.vec(2 * x[:, 1:-1] - x[:, :-2] - x[:, 2:] + push[:, 1:-1]),
        x[:, -1] - x[:, -2] + 0.5 * push[:, -1] - speeds[1],
    ]
    weights = np.full(steps + 1, h)
    weights[[0, -1]] = h / 2
    objective = task.weight * ca.mtimes(ca.sum1(u**2), weights)
    fixed = np.full(x0.shape, np.nan)
    fixed[:, 0], fixed[:, -1] = task.first[:n], task.last[:n]
    return _solved(task, (x, x0, at), (u, u0, at), objective, [row / h for row in rows], x, fixed, coarse)


def _solved(task, states, controls, objective, rows, places, fixed, coarse) -> Found:
    """The NLP with its bounds and spheres, solved by Ipopt."""
    (x, x0, at_states), (u, u0, at_controls) = states, controls
    outside = [ca.sum1((places - np.array(centre)) ** 2).T for centre in task.spheres]
    equal = ca.vertcat(*rows)
    nlp = {"x": ca.veccat(x, u), "f": objective, "g": ca.vertcat(equal, *outside)}
    free, limit = np.isnan(fixed), np.inf if task.limit is None else task.limit
    low, high = np.where(free, -np.inf, fixed), np.where(free, np.inf, fixed)
    sides = np.full(u0.size, limit)
    warm = {} if coarse is None or not (task.spheres or task.limit) else {"ipopt.mu_init": BARRIER}
    solver = ca.nlpsol("solver", "ipopt", nlp, OPTIONS | warm)
    more = nlp["g"].numel() - equal.numel()
    found = solver(
        x0=np.append(x0.ravel("F"), u0.ravel("F")),
        lbx=np.append(low.ravel("F"), -sides),
        ubx=np.append(high.ravel("F"), sides),
        lbg=np.append(np.zeros(equal.numel()), np.ones(more)),
        ubg=np.append(np.zeros(equal.numel()), np.full(more, np.inf)),
    )
    values = found["x"].full().ravel()
    x1, u1 = values[: x0.size].reshape(x0.shape, order="F"), values[x0.size :].reshape(u0.shape, order="F")
    best = abs(float(found["f"])) if task.thrust else float(found["f"])
    return Found(at_states, x1, at_controls, u1, best, solver.stats()["return_status"])
