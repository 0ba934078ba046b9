"""Checks of several paths, of which the worst one is told."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from dmoc.checks.evidence import Evidence
from dmoc.checks.verification import Check
from dmoc.results.solution import Solution


def fastest(leg: Solution) -> float:
    """The largest speed at the step ends of a leg [m/s]."""
    return float(np.linalg.norm(leg.velocity, axis=1).max(initial=0.0))


def worst_of(
    names: Sequence[str], legs: Sequence[Evidence], check: Callable[[Evidence], Check], named: bool = False
) -> Check:
    """The check of the leg in which it is nearest to its limit, or beyond it; an only leg is not `named`."""
    found = [check(leg) for leg in legs]

    def share(one: Check) -> float:
        if one.value is None:
            return -1.0
        if not one.ok:
            return np.inf
        return one.value / one.limit if one.limit else 0.0

    worst = int(np.argmax([share(one) for one in found]))
    if len(legs) == 1 and not named:
        return found[0]
    name = names[worst]
    return replace(found[worst], note=f"{name}: {found[worst].note}" if found[worst].note else name)
