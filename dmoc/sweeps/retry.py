"""Which points of a sweep are tried again, and from which neighbour's answer.

1. Every point is first solved from the problem's own guess. To start from a neighbour's answer would take
   a half to a quarter of the time, but it leads to the neighbour's branch of local optima, which was seen to
   be 90 times worse along whole rows of points; so it is done only where the user asks for it.
2. A point that failed, or that is worse than its neighbours on every side along a dimension, is tried again
   from the best of those neighbours. The better of the two answers counts.
3. Where a point became better, its neighbours are tried again from its answer, until none becomes better.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

from dmoc.sweeps.plan import Plan

# Status of a point whose worker process ended before it had an answer, twice.
DIED = "worker died"
# Points with these statuses are not tried again: another guess cannot help them.
BEYOND_HELP = ("refused", DIED)
# Objectives whose relative difference is below this [-] belong to the same optimum: meshes and tolerances of
# the solves explain it. A smaller number would have points tried again for digits that mean nothing.
SAME = 1e-4
# A point is tried at most this often: better answers that wander through a grid must come to an end.
MOST_LOOKS = 8

Record = Mapping[str, Any]


def rank(record: Record) -> tuple[int, float]:
    """A tier and a value, of which the smaller is the better.

    Tier 0 is solved with all checks, 1 solved, 2 not solved; the value is the objective, to be minimised.
    """
    if not record.get("success"):
        return 2, math.inf
    objective = record["objective"]
    value = math.inf if objective is None else objective * record["objective_sense"]
    return 0 if record["checks_hold"] else 1, value


def better(new: Record, old: Record) -> bool:
    """Whether a record is better than another by more than `SAME`: of the same point, or of a neighbour."""
    (tier, value), (old_tier, old_value) = rank(new), rank(old)
    if tier != old_tier:
        return tier < old_tier
    alike = new.get("objective_name") == old.get("objective_name")
    return tier < 2 and alike and value < old_value - SAME * abs(old_value)


def first_retries(plan: Plan, records: Sequence[Record], follow: bool) -> dict[int, int]:
    """Points to try again after all were tried once, each with the neighbour to start from.

    With `follow`, rows of points start from each other in runs of a few. Then the points where two runs meet
    are tried again too, for the answer of one run may be the start of a better one in the other.
    """
    found = {}
    for point, record in enumerate(records):
        if record["status"] in BEYOND_HELP:
            continue
        sides, tier = plan.neighbours(point), rank(record)[0]
        others = [other for side in sides for other in side if rank(records[other])[0] < tier]
        # a solved point is suspect where, along a dimension, the points on both sides of it are better
        if not others and tier < 2:
            others = [o for side in sides if all(better(records[o], record) for o in side) for o in side]
        if not others and follow:
            others = [other for other in plan.joined(point) if rank(records[other])[0] <= tier < 2]
        if others:
            found[point] = _best(others, records)
    return found


def further_retries(
    plan: Plan, records: Sequence[Record], changed: Mapping[int, Record], parents: Mapping[int, int]
) -> dict[int, int]:
    """Points to try again because a neighbour became better, each with the best such neighbour to start from.

    `changed` has the points that became better in the last wave, with the records they had before; `parents`
    the neighbour from which each point of that wave was started, which is not tried from that point again.
    A point that was solved for the first time is a start for its worse neighbours only. One that had an
    answer and now has a better one is a start for all of them: their answers may be of the branch it left.
    """
    found: dict[int, list[int]] = {}
    for point, old in changed.items():
        replaced = rank(old)[0] == rank(records[point])[0]
        for other in itertools.chain(*plan.neighbours(point)):
            useful = replaced or rank(records[other])[0] > rank(records[point])[0]
            if useful and other != parents[point] and records[other]["status"] not in BEYOND_HELP:
                found.setdefault(other, []).append(point)
    return {point: _best(others, records) for point, others in sorted(found.items())}


def _best(points: Sequence[int], records: Sequence[Record]) -> int:
    return min(points, key=lambda point: (*rank(records[point]), point))
