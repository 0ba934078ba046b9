"""How effects act on a configuration, per unit mass, as functions of one state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from dmoc.configurations.base import Configuration
from dmoc.effects.base import Effect


def kinetic_at_nodes(configuration: Configuration, degree: int) -> bool:
    """Whether the kinetic energy of a step is taken from its nodes; else it is `step_inertia`."""
    return not (configuration.surplus and degree == 1)


def state_symbols(positions: int) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """Symbols t, q, v, m."""
    return ca.SX.sym("t"), ca.SX.sym("q", positions), ca.SX.sym("v", positions), ca.SX.sym("m")


def specific_lagrangian(effects: Sequence[Effect], configuration: Configuration, t, q, v, m) -> Any:
    """Sum of the conservative effects' Lagrangians per unit mass, without the kinetic energy [J/kg]."""
    total = ca.SX(0)
    for _, body, mass in configuration.members(q, v, m):
        terms = [effect.lagrangian_of(t, body, mass) for effect in effects]
        mine = sum((term for term in terms if term is not None), ca.SX(0))
        total = total + (mine if mass is m else mass / m * mine)
    for effect in effects:
        if effect.joins and (energy := effect.energy_between(t, configuration.at(q, v, m))) is not None:
            total = total - energy / m
    return total


def point_function(
    effects: Sequence[Effect], configuration: Configuration, kinetic: bool = True
) -> ca.Function:
    """(t, q, v, m) -> dl/dq, dl/dv, F/m of these effects, with or without the kinetic energy."""
    t, q, v, m = state_symbols(configuration.size)
    lagrangian = specific_lagrangian(effects, configuration, t, q, v, m)
    push = ca.SX.zeros(configuration.size)
    for effect in effects:
        for name, body, mass in configuration.members(q, v, m):
            force, torque = effect.wrench_of(t, body, mass)
            if force is not None or torque is not None:
                push = push + configuration.on(name, q, force, torque) / m
        if effect.joins:
            acts = effect.acts_between(configuration, t, q, configuration.at(q, v, m))
            push = push if acts is None else push + acts / m
    moved, inertia = configuration.inertia(q, v, m) if kinetic else (0, 0)
    change = configuration.shared(ca.gradient(lagrangian, q), m) + moved, ca.gradient(lagrangian, v) + inertia
    outputs = [*change, configuration.shared(push, m)]
    # Numbers that are unknown stay symbols; such a function serves as a part of formulas alone.
    free = symbols_in((*effects, getattr(configuration, "moments", None)))
    return ca.Function("point", [t, q, v, m], outputs, {"allow_free": bool(free)})


def symbols_in(parts: Any) -> list[ca.SX]:
    """The symbols that stand for unknown numbers in effects, and in parts of them."""
    if isinstance(parts, ca.SX):
        return [parts]
    if isinstance(parts, tuple):
        return [symbol for part in parts for symbol in symbols_in(part)]
    return symbols_in(tuple(vars(parts).values())) if hasattr(parts, "adjustable") else []


def split_effects(
    effects: Sequence[Effect], configuration: Configuration
) -> tuple[tuple[Effect, ...], tuple[Effect, ...]]:
    """Effects that look only at t, q, m, and those that look at the velocity.

    The first are evaluated once a node. The second are evaluated in each of the two steps that share a
    node, since each step has a velocity of its own there.
    """
    t, q, v, m = state_symbols(configuration.size)
    members = configuration.members(q, v, m)

    def looks_at_velocity(effect: Effect) -> bool:
        acts = [
            act
            for _, body, mass in members
            for act in (effect.lagrangian_of(t, body, mass), *effect.wrench_of(t, body, mass))
        ]
        if effect.joins:
            at = configuration.at(q, v, m)
            acts += [effect.energy_between(t, at), effect.acts_between(configuration, t, q, at)]
        return any(ca.depends_on(ca.SX(act), v) for act in acts if act is not None)

    known = [(looks_at_velocity(effect), effect) for effect in effects]
    return tuple(e for moving, e in known if not moving), tuple(e for moving, e in known if moving)
