"""Balances of a path: momentum and spin against impulses, energy against work; and how its errors grow."""

from __future__ import annotations

import casadi as ca
import numpy as np

from dmoc.basics.quaternions import rotated
from dmoc.checks.evidence import Evidence
from dmoc.configurations.acting import specific_lagrangian, state_symbols
from dmoc.configurations.coordinates import ATTITUDE
from dmoc.motion.march import wrench_of
from dmoc.motion.momenta import along_path, rates_along

# A control is switched within a step if it changes there by more than this part of the most it takes [-]: at a
# node between the two values of a switch one of its two steps has half of it, the other may have little.
SWITCHED = 0.25


def balance(evidence: Evidence) -> tuple[float, float]:
    """By how much momentum and impulse differ, over all impulses [-], and the sum of all impulses [m/s].

    The sums are exact: what a step gives to its nodes, added up, is the impulse of forces alone. For a body
    that turns the same holds for its angular momentum about the centre of mass, seen in space axes: R(q) turns
    what each node gets from body axes, and the inertia's part adds up to nothing.
    """
    nodes = np.concatenate(evidence.position[evidence.at])
    impulse = along_path(evidence.dynamics, nodes, np.concatenate(evidence.momenta))
    ends = [evidence.boundary_momentum(place) for place in (0, -1)]
    first, last = (
        _in_space(evidence, evidence.position[[place]], end[None])
        for place, end in zip((0, -1), ends, strict=True)
    )
    # Added up over a step, the parts of the inertia cancel, and the impulse is left.
    given = _in_space(evidence, nodes, impulse).reshape(*evidence.at.shape, -1).sum(axis=0)
    held = _in_space(evidence, evidence.position, evidence.reactions)
    given = np.concatenate([given, held])
    change, speeds = (last - first)[0], evidence.speeds
    gross = float(np.abs(given[:, speeds]).sum()) + evidence.speed
    off = np.abs(change - given.sum(axis=0))
    error = off[speeds].max(initial=0.0) / gross
    if evidence.rates.any():
        spins = float(np.abs(given[:, evidence.rates]).sum()) + evidence.spin
        error = max(error, off[evidence.rates].max() / spins)
    return float(error), gross


def _in_space(evidence: Evidence, position: np.ndarray, momenta: np.ndarray) -> np.ndarray:
    """Momenta, one row a place, with the spins turned from body into space axes."""
    found = momenta.copy()
    made = evidence.path.coordinates
    for at, rates in zip(made.quaternions, made.turning, strict=True):
        found[:, rates] = rotated(position[:, at], momenta[:, rates])
    return found


def _held(evidence: Evidence) -> np.ndarray:
    """What a held control does per unit mass at each node of its step, shape (s+1, steps, freedom)."""
    return np.array(
        [
            evidence.per_mass(
                wrench_of(evidence.dynamics, evidence.position[at], evidence.path.control), evidence.mass[at]
            )
            for at in evidence.at
        ]
    )


def energy_gap(evidence: Evidence) -> float | None:
    """Change of energy against work, over the largest of kinetic energy and total work; None if not kept."""
    body = evidence.dynamics.configuration
    t, q, v, m = state_symbols(body.size)
    potential = ca.SX(specific_lagrangian(evidence.problem.effects, body, t, q, v, m))
    if evidence.path.coordinates.spins.any():
        # What wheels store of energy depends on their own inertia, which counts for nothing else.
        return None
    if ca.depends_on(potential, t) or (evidence.dynamics.actuator.burns and ca.depends_on(potential, m)):
        return None
    attitude = q[np.flatnonzero(evidence.path.coordinates.kinds == ATTITUDE)]
    if body.turning_share(2.0) != 1 and ca.depends_on(potential, attitude):
        # A potential per unit mass does work on the turn per start mass.
        return None
    at = [(evidence.time[i], evidence.position[i], evidence.velocity[i], evidence.mass[i]) for i in (0, -1)]
    change = float(evidence.dynamics.energy(*at[1])) - float(evidence.dynamics.energy(*at[0]))
    push = evidence.loads[1]
    rates = rates_along(evidence.dynamics, evidence.position, evidence.node_velocity)
    switched = 0.0
    if not evidence.path.hold:
        pushed = evidence.per_mass(evidence.wrench, evidence.mass)
        parts = np.sum((pushed + push) * rates, axis=1) * evidence.weights
        switched = _of_switches(evidence, pushed, rates)
    elif body.surplus:
        # A held force that is fixed to a turning body turns with it within a step.
        held = _held(evidence)
        power = np.einsum("jkn,jkn->k", evidence.rule.weights[:, None, None] * held, rates[evidence.at])
        work = power * evidence.path.duration * np.diff(evidence.path.mesh)
        parts = np.concatenate([work, np.sum(push * rates, axis=1) * evidence.weights])
    else:
        # The work of a held force is that force times the way of its step.
        moves = np.diff(evidence.position[evidence.ends], axis=0)
        middle = evidence.mass[evidence.at].mean(axis=0)
        work = np.sum(evidence.force * moves, axis=1) / middle
        parts = np.concatenate([work, np.sum(push * rates, axis=1) * evidence.weights])
    gaps = np.abs(change - parts.sum() - np.array([0.0, switched]))
    return float(gaps.min() / max(evidence.kinetic, np.abs(parts).sum()))


def _of_switches(evidence: Evidence, pushed: np.ndarray, rates: np.ndarray) -> float:
    """How much more work impulses of steps with a switch do at their mean velocity than node by node [J/kg].

    The force of a burn that is shorter than a step meets the velocity of one node, which may be that before or
    after all of it. Elsewhere the work of an impulse says nothing: of a free body it follows from the momentum.
    """
    lengths = evidence.path.duration * np.diff(evidence.path.mesh)
    forces = evidence.rule.weights[:, None, None] * pushed[evidence.at] * lengths[:, None]
    ends = rates[evidence.ends]
    by_steps = np.sum(forces.sum(axis=0) * 0.5 * (ends[1:] + ends[:-1]), axis=1)
    by_nodes = np.einsum("jkn,jkn->k", forces, rates[evidence.at])
    return float((by_steps - by_nodes)[_switches(evidence)].sum())


def _switches(evidence: Evidence) -> np.ndarray:
    """Steps within which a limited control changes by a good part of the most that it takes."""
    control = evidence.path.control
    if not evidence.problem.actuator.limited:
        return np.zeros(len(evidence.path.mesh) - 1, bool)
    return (np.ptp(control[evidence.at], axis=0) > SWITCHED * np.abs(control).max(axis=0)).any(axis=1)


def amplification(matrices: np.ndarray) -> float:
    """How much a small error can grow, at most, from the start to any step or from any step to the goal."""
    since_start = np.empty_like(matrices)
    # The map from the k-th step to the goal is the whole product times the inverse of the map up to that step.
    product = np.eye(matrices.shape[1])
    for k, matrix in enumerate(matrices):
        product = since_start[k] = matrix @ product
    try:
        to_goal = product @ np.linalg.inv(since_start)
    except np.linalg.LinAlgError:
        to_goal = since_start
    sizes = np.sqrt(np.square([since_start, to_goal]).sum(axis=(2, 3)))
    return float(np.nan_to_num(sizes.max(), nan=np.inf))


def misses(evidence: Evidence, off: np.ndarray) -> str:
    """Errors of position and velocity in words, one entry a freedom each."""
    moved, slipped = np.split(off, 2)
    speeds, parts = evidence.speeds, []
    if speeds.any():
        parts += [f"{moved[speeds].max():.2g} m", f"{slipped[speeds].max():.2g} m/s"]
    if evidence.rates.any():
        parts.append(f"{np.degrees(np.linalg.norm(moved[evidence.rates])):.2g} degrees")
    return ", ".join(parts)
