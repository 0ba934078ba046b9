"""The constants of effects as numbers of a problem that may change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from dmoc.basics.unknown import at, is_number, numeric_fields, opened, with_field
from dmoc.configurations.acting import split_effects
from dmoc.effects.base import Effect
from dmoc.motion.dynamics import Dynamics
from dmoc.parts.rows import with_symbols


def with_open_effects(problem: Any) -> Any:
    """The problem with every constant of its effects an `Unknown`, where the formulas allow it.

    They do not where an effect of a user's own takes its number for more than arithmetic of CasADi, and not
    where links join bodies.
    """
    if hasattr(problem, "members"):
        members = tuple(with_open_effects(member) for member in problem.members)
        return with_field(problem, "members", members)
    if hasattr(problem, "plan"):
        first = problem.stretches[0]
        legs = tuple(
            replace(leg, effects=_opened(leg.effects, first)) if getattr(leg, "effects", None) else leg
            for leg in problem.legs
        )
        return replace(problem, effects=_opened(problem.effects, first), legs=legs)
    return problem if problem.links else with_field(problem, "effects", _opened(problem.effects, problem))


def _opened(effects: Sequence[Effect], problem: Any) -> tuple[Effect, ...]:
    configuration = Dynamics.of(problem).configuration
    found = []
    for effect in effects:
        names: list[str] = []
        for name in numeric_fields(effect):
            if not is_number(at(effect, name)):
                continue
            try:
                split_effects([with_symbols(opened(effect, [*names, name]), "probe")[0]], configuration)
            except Exception:
                # Whatever a formula raises that takes a number for more than a term.
                continue
            names.append(name)
        found.append(opened(effect, names))
    return tuple(found)
