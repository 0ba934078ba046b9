"""What the control that is flown costs, against the sum over the nodes that the objective is."""

from __future__ import annotations

from functools import partial

import casadi as ca
import numpy as np

from dmoc.basics.memory import remembered
from dmoc.basics.numerics import columns
from dmoc.configurations.acting import state_symbols
from dmoc.configurations.of_problem import configuration_of
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.flown import flown
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import step_nodes
from dmoc.motion.path import DiscretePath
from dmoc.parts.actuator import told_of
from dmoc.scene.problem import TransferProblem

# An objective of 0 is replaced by this, the smallest number of full precision, before something is divided by
# it.
TINY = float(np.finfo(float).tiny)
# The size of the objective is estimated from this many nodes: more do not change its first digit.
SAMPLED = 400


def unpriced(problem: TransferProblem, dynamics: Dynamics, path: DiscretePath, objective: float) -> float:
    """By how much the control that is flown costs more or less than the objective, over it [-].

    They differ where the polynomial through the nodes of a step breaks the limit of the actuator and another
    control of the same impulse is flown: the integral of its square is not the sum over the nodes.
    """
    if path.hold or path.order == 2:
        return 0.0
    known, rule, many = flown(dynamics, path), scheme(path.order), scheme(8)
    if not known.broken.any():
        return 0.0
    piece = np.searchsorted(path.mesh, 0.5 * (known.mesh[1:] + known.mesh[:-1])) - 1
    pieces, steps = np.flatnonzero(known.broken[piece]), np.flatnonzero(known.broken)
    owner, length = piece[pieces], np.diff(path.mesh)
    lasts = np.diff(known.mesh)[pieces]
    inside = (known.mesh[pieces] - path.mesh[owner])[:, None] + lasts[:, None] * many.points
    controls = np.einsum("pj,jkn->kpn", rule.values_at(many.points), known.nodes[:, pieces])
    rates = _rates(problem, path, owner, inside / length[owner, None], controls)
    nodes = path.control[step_nodes(len(length), rule)[:, steps]].swapaxes(0, 1)
    summed = _rates(problem, path, steps, np.tile(rule.points, (len(steps), 1)), nodes)
    gap = lasts @ rates @ many.weights - length[steps] @ summed @ rule.weights
    return float(abs(path.duration * gap) / max(abs(objective), TINY))


def _rates(
    problem: TransferProblem, path: DiscretePath, steps: np.ndarray, inside: np.ndarray, controls: np.ndarray
) -> np.ndarray:
    """Running cost at fractions of steps, shape (count, places); controls have shape (count, places, size)."""
    rule = scheme(path.order)
    at, length = step_nodes(len(path.mesh) - 1, rule)[:, steps].T, path.duration * np.diff(path.mesh)[steps]
    values = rule.values_at(inside.ravel()).reshape(*inside.shape, -1)
    slopes = rule.slopes_at(inside.ravel()).reshape(*inside.shape, -1) / length[:, None, None]
    q = np.einsum("kpj,kjn->nkp", values, path.place[at])
    v = np.einsum("kpj,kjn->nkp", slopes, path.place[at])
    m = np.einsum("kpj,kj->kp", values, path.mass[at])
    t = problem.start_time + path.duration * path.mesh[steps, None] + length[:, None] * inside
    n, u = path.place.shape[1], np.moveaxis(controls, 2, 0)
    rate, _ = cost_functions(problem)
    many = t.size
    q, v, u = (values.reshape(count, many) for values, count in ((q, n), (v, n), (u, len(u))))
    found = rate(t.reshape(1, many), q, v, u, m.reshape(1, many))
    return np.array(found).reshape(inside.shape)


def cost_functions(problem: TransferProblem) -> tuple[ca.Function, ca.Function]:
    """(t, q, v, u, m) -> running cost, (t, q, v, m) -> cost of the end."""
    parts = configuration_of(problem), problem.objective, problem.actuator
    return remembered(partial(_written, problem), "cost", *parts)


def mass_worth(problem: TransferProblem) -> float:
    """By how much a unit of mass at the goal changes the objective [per kg], where propellant is burnt.

    0 where nothing is burnt, or where that depends on the state.
    """
    if not problem.actuator.burns:
        return 0.0
    objective = problem.objective.paid_at_goal

    def found() -> float:
        t, q, v, m = state_symbols(int(configuration_of(problem).coordinates.places.sum()))
        slope = ca.jacobian(ca.SX(objective.terminal(t, q, v, m)), m)
        return float(slope) if slope.is_constant() else 0.0

    return remembered(found, "worth of mass", configuration_of(problem), objective)


def _written(problem: TransferProblem) -> tuple[ca.Function, ca.Function]:
    t, q, v, m = state_symbols(int(configuration_of(problem).coordinates.places.sum()))
    u = ca.SX.sym("u", problem.controls)
    rate = problem.objective.rate(problem.actuator, t, q, v, u, m)
    terminal = ca.Function("terminal", [t, q, v, m], [problem.objective.terminal(t, q, v, m)])
    return ca.Function("rate", [t, q, v, u, m], [rate]), terminal


def cost_along(problem: TransferProblem, guess: DiscretePath) -> float:
    """About the objective along a guess."""
    return costs_along(problem, guess)[0]


def costs_along(
    problem: TransferProblem, guess: DiscretePath, *instead: np.ndarray, of_way: bool = False
) -> list[float]:
    """About the objective along a guess, and with each of these controls all the way.

    A guess that leaves its start at another velocity than the start's has an impulse there. As the force of one
    node it grows with the number of steps, so at the ends no more counts than the largest force in between.
    `of_way`: a final mass counts as the propellant that is burnt on the way, but for legs of missions, which
    have a unit of their own.
    """
    rate, terminal = cost_functions(problem)
    some = np.linspace(0, len(guess.position) - 1, min(len(guess.position), SAMPLED)).astype(int)
    fractions = guess.fractions[some]
    times = problem.start_time + guess.duration * fractions
    velocity = np.gradient(guess.place[some], times, axis=0)
    sizes = np.linalg.norm(guess.control, axis=1)
    most = sizes[1:-1].max(initial=0.0) or sizes.max()
    control = guess.control * np.minimum(1.0, most / np.maximum(sizes, most or 1.0))[:, None]
    if guess.hold:
        nodes = np.searchsorted(guess.mesh, fractions, side="right") - 1
        some_controls = control[np.minimum(nodes, len(guess.mesh) - 2)]
    else:
        some_controls = control[some]
    controls = [some_controls, *(np.broadcast_to(one, some_controls.shape) for one in instead)]
    along = [times[None], guess.place[some].T, velocity.T, guess.mass[some][None]]
    t, q, v, m = (np.tile(values, (1, len(controls))) for values in along)
    rates = columns(rate, t, q, v, np.concatenate(controls).T, m)[0].reshape(len(controls), -1)
    own = problem.objective.paid_at_goal is problem.objective
    worth = mass_worth(problem) if of_way and own else 0.0
    if worth:
        flow = told_of(problem.actuator, "flow", np.concatenate(controls))
        rates = rates - worth * flow.reshape(rates.shape)
    last = guess.goal_velocity[guess.coordinates.speeds]
    end = float(terminal(times[-1], guess.place[-1], last, guess.mass[-1])) - worth * float(guess.mass[-1])
    return [float(np.trapezoid(row, times)) + end for row in rates]
