"""Whether another impulse would help a mission, by the primer vector."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmoc.checks.verification import Check

# Another impulse helps if the primer vector is longer than its length at impulses by this part [-].
HELPS = 1e-4


def primer_check(solution: Any) -> Check:
    """Whether another impulse would help: the primer vector is longer there than at impulses (Lawden, 1963)."""
    times, sizes = solution.primer
    worth = worth_of(solution)
    if worth is None:
        return Check("primer", None, None, "-", True, "the objective does not count velocity changes alone")
    place = int(np.argmax(sizes))
    longest = float(sizes[place]) / worth
    if longest <= 1 + HELPS:
        return Check("primer", longest, None, "-", True, "no further impulse would help")
    note = (
        f"another impulse near {times[place]:.6g} s would help: {longest - 1:.2g} m/s saved for each m/s there"
    )
    return Check("primer", longest, None, "-", True, note)


def worth_of(solution: Any) -> float | None:
    """What 1 m/s costs by the objective, where only impulses are paid for; else None."""
    objective = solution.require_problem().objective
    terms: Any = [(weight, term) for weight, term in objective.terms if weight]
    return float(terms[0][0]) if len(terms) == 1 and float(terms[0][1].kick(1.0, 1.0)) == 1.0 else None
