"""Canonical units of a problem near a path, in which Ipopt sees numbers near 1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dmoc.motion.path import DiscretePath
from dmoc.results.flown_cost import cost_functions
from dmoc.scene.problem import TransferProblem

# The size of the objective is estimated from this many nodes: more do not change its first digit.
SAMPLED = 400
# The unit of force is at least this part of the limit [-], however small the largest force of a solution is.
LEAST_SHARE = 1e-3


@dataclass(frozen=True)
class Units:
    """Canonical units [m, s, N, kg, unit of the objective] and the origin [m]; Ipopt sees numbers near 1."""

    length: float
    time: float
    force: float
    mass: float
    cost: float
    origin: np.ndarray


def units_of(problem: TransferProblem, guess: DiscretePath) -> Units:
    """Canonical units of a problem near a path.

    Length: extent of the path, origin at its centre. Time: the duration. Force: the largest used
    where a solution is known, else the limit, else the force that moves the mass over that length in that
    time, or without effects the one that changes its velocities at the ends. Cost: the objective on the path,
    or with the unit of force all the way if that is more.
    """
    low, high = guess.position.min(axis=0), guess.position.max(axis=0)
    time = guess.duration
    speed = max(np.abs(guess.start_velocity).max(), np.abs(guess.goal_velocity).max())
    length = guess.diagonal or float(speed * time) or 1.0
    change = length / time
    if not problem.effects:
        # Without effects the actuator alone must change the velocities of both ends into the mean one.
        mean = (guess.position[-1] - guess.position[0]) / time
        turns = np.array([guess.start_velocity, guess.goal_velocity]) - mean
        change = max(change, float(np.linalg.norm(turns, axis=1).max()))
    typical = problem.mass * change / time
    limit = problem.actuator.force_limit()
    force = float(np.abs(guess.control).max(initial=0.0)) if guess.multipliers else 0.0
    if limit is not None:
        force = min(max(force, LEAST_SHARE * limit), limit) if force else limit
    force = max(force, LEAST_SHARE * typical) if force else typical
    cost = max(abs(cost_along(problem, guess)), abs(cost_along(problem, guess, force)))
    # All nozzles at once make no force, one of them does.
    cost = cost or abs(cost_along(problem, guess, force, alone=True)) or 1.0
    return Units(length, time, force, problem.mass, cost, 0.5 * (low + high))


def cost_along(problem: TransferProblem, guess: DiscretePath, force: float = 0.0, alone: bool = False) -> float:
    """About the objective along a guess, with `force` [N] in place of its controls if that is not zero.

    If `alone`, the first of the controls has that value and the others are zero.

    A guess that leaves its start at another velocity than the start's has an impulse there. As the force of one
    node it grows with the number of steps, so at the ends no more counts than the largest force in between.
    """
    rate, terminal = cost_functions(problem)
    some = np.linspace(0, len(guess.position) - 1, min(len(guess.position), SAMPLED)).astype(int)
    times = problem.start_time + guess.duration * guess.fractions[some]
    velocity = np.gradient(guess.position[some], times, axis=0)
    nodes = np.searchsorted(guess.mesh, guess.fractions[some], side="right") - 1
    sizes = np.linalg.norm(guess.control, axis=1)
    most = sizes[1:-1].max(initial=0.0) or sizes.max()
    control = guess.control * np.minimum(1.0, most / np.maximum(sizes, most or 1.0))[:, None]
    control = control[np.minimum(nodes, len(guess.mesh) - 2) if guess.hold else some]
    control = np.full_like(control, force) if force else control
    control[:, 1:] *= not alone
    rates = rate(times[None], guess.position[some].T, velocity.T, control.T, guess.mass[some][None])
    end = terminal(times[-1], guess.position[-1], guess.goal_velocity, guess.mass[-1])
    return float(np.trapezoid(np.array(rates).ravel(), times)) + float(end)
