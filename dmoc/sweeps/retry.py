"""Which points of a sweep are worth a second look, and from which neighbour's answer.

The rule, as it was measured to pay: a point is first solved by itself. One that failed, or that is
worse than its neighbours on every side along a dimension, is tried again from the best of them; the
better answer counts. Where something became better, its own neighbours are tried from it, until
nothing does. A start from a neighbour takes a half to a quarter of the time of a cold one, but keeps
to the neighbour's branch of local optima, which was seen to be 90 times worse along whole runs; so
the first look is not from neighbours unless asked for.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

from dmoc.sweeps.plan import Plan

DIED = "worker died"
# What another guess cannot help.
BEYOND_HELP = ("refused", DIED)
# Answers this close, relatively, are the same optimum.
SAME = 1e-4
MOST_LOOKS = 8

Record = Mapping[str, Any]


def rank(record: Record) -> tuple[int, float]:
    """The less the better: every check holds, or only solved, or not; then the objective."""
    if not record.get("success"):
        return 2, math.inf
    objective = record["objective"]
    value = math.inf if objective is None else objective * record["objective_sense"]
    return 0 if record["checks_hold"] else 1, value


def better(new: Record, old: Record) -> bool:
    """Whether a record is to replace another one of the same point, or outdoes that of a neighbour."""
    (tier, value), (old_tier, old_value) = rank(new), rank(old)
    if tier != old_tier:
        return tier < old_tier
    alike = new.get("objective_name") == old.get("objective_name")
    return tier < 2 and alike and value < old_value - SAME * abs(old_value)


def first_retries(plan: Plan, records: Sequence[Record], follow: bool) -> dict[int, int]:
    """Points to try again after the first look, each with the neighbour to start from.

    With `follow` also the points where two runs meet: what one run found may suit the other.
    """
    found = {}
    for point, record in enumerate(records):
        if record["status"] in BEYOND_HELP:
            continue
        sides, tier = plan.neighbours(point), rank(record)[0]
        others = [other for side in sides for other in side if rank(records[other])[0] < tier]
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
    """Points to try after others became better, each with the best of those; `changed` has what they were.

    What was solved for the first time is offered to worse ones only, what replaced an answer to all.
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
