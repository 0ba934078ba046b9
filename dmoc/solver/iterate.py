"""Faults of one iterate by name: values that are not finite, and rows that do not hold."""

from __future__ import annotations

import casadi as ca
import numpy as np

from dmoc.effects.base import Conservative, Effect
from dmoc.motion.configuration import Translation
from dmoc.motion.dynamics import Dynamics, state_symbols
from dmoc.motion.mesh import node_weights
from dmoc.motion.path import DiscretePath
from dmoc.nlp.layout import Group
from dmoc.nlp.solving import NLP
from dmoc.scene.problem import TransferProblem

# At most this many violated rows and bounds are told of, the worst first.
COUNT = 10
# A row or bound is told of if its scaled violation is above this [-]: round-off alone stays below.
SEEN = 1e-9
# The remedy that is told where a guess lies at a place without finite values.
REMEDY = "stay where it is defined, or give another guess"


def refuse_undefined_motion(dynamics: Dynamics, problem: TransferProblem, guess: DiscretePath) -> None:
    """Refuse a guess at which an effect has no value.

    Raises
    ------
    ValueError
        With the effect, the node and the arguments that the effect had there.
    """
    with np.errstate(all="ignore"):
        state = _states(problem, guess)
        if not all(np.isfinite(value.full()).all() for value in dynamics.point(*state)):
            raise ValueError(_undefined_effect(problem, state))


def refuse_undefined_rows(nlp: NLP, problem: TransferProblem, guess: DiscretePath) -> None:
    """Refuse a guess at which the objective, a row or one of their derivatives has no value.

    Raises
    ------
    ValueError
        With its name.
    """
    x, p, parts = nlp.pack(guess), nlp.parameters(problem), nlp.assembly
    slopes, entries = parts.gradient(x, p)[1], parts.jacobian(x, p)[1]
    rows = np.isfinite(parts.constraints(x, p).full().ravel())
    np.logical_and.at(rows, entries.sparsity().row(), np.isfinite(entries.nonzeros()))
    cost = np.concatenate([parts.objective(x, p).full().ravel(), slopes.full().ravel()])
    if rows.all() and np.isfinite(cost).all():
        return
    objective = f"the objective {type(problem.objective).__name__}"
    name = objective if rows.all() else nlp.rows.name_of(int(np.argmin(rows)))
    raise ValueError(f"{name} or its derivative is not a finite number at the guess; {REMEDY}")


def _states(problem: TransferProblem, guess: DiscretePath) -> tuple[np.ndarray, ...]:
    """Times, positions, velocities, masses of the nodes of a guess, side by side."""
    times = problem.start_time + guess.duration * guess.fractions
    velocity = np.gradient(guess.position, times, axis=0)
    velocity[0], velocity[-1] = guess.start_velocity, guess.goal_velocity
    return times[None], guess.position.T, velocity.T, guess.mass[None]


def _undefined_effect(problem: TransferProblem, state: tuple) -> str:
    """Which effect has no value, and at which node."""
    for effect in problem.effects:
        point = Dynamics(Translation(problem.dimension), (effect,)).point(*state)
        finite = np.isfinite(np.vstack([value.full() for value in point])).all(axis=0)
        if not finite.all():
            node = int(np.argmin(finite))
            where = _arguments(effect, [part[:, node] for part in state])
            place = {0: "at the start", finite.size - 1: "at the goal"}.get(
                node, f"at node {node} of the guess"
            )
            return f"{type(effect).__name__} is not a finite number {place}: {where}; {REMEDY}"
    return f"the effects together are not a finite number at the guess; {REMEDY}"


def _arguments(effect: Effect, state: list[np.ndarray]) -> str:
    """The arguments that an effect depends on, in words; the distance to its centre alone where that is 0."""
    position = state[1]
    center = getattr(effect, "center", None)
    offset = position - (
        np.zeros(len(position)) if center is None else np.asarray(center, float)[: len(position)]
    )
    symbols = state_symbols(len(position))
    value = effect.lagrangian(*symbols) if isinstance(effect, Conservative) else effect.force(*symbols)  # type: ignore[attr-defined]
    looks = [ca.depends_on(ca.SX(value), symbol) for symbol in symbols]
    distance = float(np.linalg.norm(offset))
    if looks[1] and distance <= 1e-12 * (1 + np.abs(position).max()):
        return f"distance {distance:.2g} m from {_listed(position - offset)} m"
    words = [
        f"{name} {_listed(part)} {unit}"
        for name, part, unit, look in zip(
            ("time", "position", "velocity", "mass"), state, ("s", "m", "m/s", "kg"), looks, strict=True
        )
        if look
    ]
    return ", ".join(words)


def _listed(values: np.ndarray) -> str:
    text = ", ".join(f"{value:.6g}" for value in values)
    return f"({text})" if len(values) > 1 else text


def worst_in_units(nlp: NLP, problem: TransferProblem, x, g) -> tuple[tuple[str, float, str], ...]:
    """The ten most violated rows and bounds, worst scaled violation first: name, violation, unit."""
    duration = nlp.unpack(x, problem).duration
    found = []
    for group, place, scaled in nlp.violations(problem, x, g, COUNT):
        if scaled > SEEN:
            index, component = divmod(place - group.start, len(group.labels))
            value = scaled * group.scales[index, component]
            if group in nlp.rows.groups:
                value = scaled / group.scales[index, component]
                size, unit = _row(nlp, problem, group, index, component, value, duration)
            else:
                size, unit = value, _unit_of_unknown(problem, group, component)
            found.append((group.name_of(place), float(size), unit))
    return tuple(found)


def _row(
    nlp: NLP, problem: TransferProblem, group: Group, index: int, component: int, value: float, duration: float
) -> tuple[float, str]:
    """Size and unit of a row's violation for a person, from its `value` in the unit that the NLP has for it."""
    if group.owner is None and group.kind == "smooth":
        # A row of motion is a momentum per mass; over the node's share of the time it is a force.
        weight = duration * node_weights(nlp.mesh, nlp.scheme)[index]
        return value * problem.mass / weight, "N"
    unit = group.units[component]
    if group.owner is None or group.owner.field in ("start", "goal"):
        return value, unit or "-"
    return group.owner.of(problem).violation(value, unit)


def _unit_of_unknown(problem: TransferProblem, group: Group, component: int) -> str:
    units = {"position": "m", "mass": "kg", "duration": "s", "start.velocity": "m/s", "goal.velocity": "m/s"}
    return units.get(group.name) or problem.actuator.units(problem.dimension)[component]
