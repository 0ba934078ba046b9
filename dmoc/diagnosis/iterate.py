"""Faults of one iterate by name: values that are not finite, and rows that do not hold."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np

from dmoc.basics.numerics import columns
from dmoc.configurations.acting import state_symbols
from dmoc.effects.base import Effect
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.mesh import node_weights
from dmoc.motion.momenta import velocity_along
from dmoc.motion.path import DiscretePath
from dmoc.nlp.layout import LEG_MASS, LEG_START, Group
from dmoc.nlp.program import Program
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
        state = _states(dynamics, problem, guess)
        if not all(np.isfinite(value).all() for value in columns(dynamics.point, *state)):
            raise ValueError(_undefined_effect(dynamics, problem, state))


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
    finite = np.isfinite(entries.nz[:].full().ravel())
    if not finite.all():
        rows[np.array(entries.sparsity().row())[~finite]] = False
    cost = np.concatenate([parts.objective(x, p).full().ravel(), slopes.full().ravel()])
    if rows.all() and np.isfinite(cost).all():
        return
    # The NLP counts from its own origin: a place next to an attractor may come to lie on it by rounding.
    origin = nlp.units.origin
    refuse_undefined_motion(nlp.dynamics, problem, replace(guess, position=guess.position - origin + origin))
    objective = f"the objective {type(problem.objective).__name__}"
    name = objective if rows.all() else nlp.rows.name_of(int(np.argmin(rows)))
    raise ValueError(f"{name} or its derivative is not a finite number at the guess; {REMEDY}")


def _states(dynamics: Dynamics, problem: TransferProblem, guess: DiscretePath) -> tuple[np.ndarray, ...]:
    """Times, positions, dq/dt, masses of the nodes of a guess, side by side."""
    times = problem.start_time + guess.duration * guess.fractions
    velocity = np.gradient(guess.position, times, axis=0)
    ends = np.array([guess.start_velocity, guess.goal_velocity])
    velocity[[0, -1]] = velocity_along(dynamics, guess.position[[0, -1]], ends)
    return times[None], guess.position.T, velocity.T, guess.mass[None]


def _undefined_effect(dynamics: Dynamics, problem: TransferProblem, state: tuple) -> str:
    """Which effect has no value, and at which node."""
    for effect in problem.effects:
        point = replace(dynamics, effects=(effect,)).point(*state)
        finite = np.isfinite(np.vstack([value.full() for value in point])).all(axis=0)
        if not finite.all():
            node = int(np.argmin(finite))
            where = _arguments(dynamics, effect, [part[:, node] for part in state])
            place = {0: "at the start", finite.size - 1: "at the goal"}.get(
                node, f"at node {node} of the guess"
            )
            return f"{type(effect).__name__} is not a finite number {place}: {where}; {REMEDY}"
    return f"the effects together are not a finite number at the guess; {REMEDY}"


def _arguments(dynamics: Dynamics, effect: Effect, state: list[np.ndarray]) -> str:
    """The arguments that an effect depends on, in words; the distance to its centre alone where that is 0."""
    body = dynamics.configuration
    position = state[1][body.coordinates.places]
    center = getattr(effect, "center", None)
    offset = position - (
        np.zeros(len(position)) if center is None else np.asarray(center, float)[: len(position)]
    )
    symbols = state_symbols(body.size)
    t, q, v, m = symbols
    seen = body.body(q, v)
    acts = [effect.lagrangian_of(t, seen, m), *effect.wrench_of(t, seen, m)]
    looks = [any(ca.depends_on(ca.SX(act), one) for act in acts if act is not None) for one in symbols]
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
    return tuple(
        (group.name_of(place), *in_units(nlp, problem, group, place, scaled, duration))
        for group, place, scaled in nlp.violations(problem, x, g, COUNT)
        if scaled > SEEN
    )


def in_units(
    nlp: Program, problem: TransferProblem, group: Group, place: int, scaled: float, duration: float
) -> tuple[float, str]:
    """Size and unit of the scaled violation of one row or bound, of a path that lasts `duration` [s]."""
    index, component = divmod(place - group.start, len(group.labels))
    if not any(group is one for one in nlp.rows.groups):
        return float(scaled * group.scales[index, component]), _unit_of_unknown(nlp, problem, group, component)
    value = scaled / group.scales[index, component]
    size, unit = _row(nlp, problem, group, (index, component), value, duration)
    return float(size), unit


def _row(
    nlp: Program, problem: TransferProblem, group: Group, place: tuple[int, int], value: float, duration: float
) -> tuple[float, str]:
    """Size and unit of a row's violation for a person, from its `value` in the unit of the NLP."""
    index, component = place
    if group.owner is None and group.kind == "smooth":
        # A row of motion is a momentum per mass; over the node's share of the time it is a force.
        weight = duration * node_weights(nlp.mesh, nlp.scheme)[index]
        unit = "N" if nlp.dynamics.configuration.coordinates.places[component] else "N m"
        return value * problem.mass / weight, unit
    unit = group.units[component]
    if group.owner is None or group.owner.field in ("start", "goal"):
        return value, unit or "-"
    return group.owner.of(problem).violation(value, unit)


def _unit_of_unknown(nlp: Program, problem: TransferProblem, group: Group, component: int) -> str:
    blocks = nlp.dynamics.configuration.coordinates
    if group.name == "position":
        return str(blocks.sized("m", "-", "N m s^2")[component])
    if group.name.endswith(".velocity"):
        return str(blocks.paced("m/s", "rad/s", "N m s")[component])
    if group.name == "reaction":
        return nlp.dynamics.configuration.reaction_units[component]
    units = {"mass": "kg", LEG_MASS: "kg", "duration": "s", LEG_START: "s"}
    return units.get(group.name) or problem.actuator.units(problem.dimension)[component]
