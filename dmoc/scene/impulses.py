"""A mission with one impulse more, or one less."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from dmoc.basics.arguments import both_ends
from dmoc.legs.events import Impulse
from dmoc.legs.legs import Leg
from dmoc.scene.mission import Mission

# A part of a coast lasts at least this part of it [-].
LEAST_PART = 1e-4
# What is done with an impulse: one more parts a leg, one fewer leaves a joint.
MORE, FEWER = "more", "fewer"


def changed(mission: Mission, changes: Any) -> Mission:
    """The mission after changes: each is `MORE` and a leg, or `FEWER` and a joint."""
    for kind, index in changes:
        mission = with_impulse(mission, index) if kind == MORE else without_impulse(mission, index)
    return mission


def with_impulse(mission: Mission, index: int) -> Mission:
    """The mission with one leg in two parts, as long together as it was, and an impulse between them."""
    span = mission.stretches[index].duration
    part = _part(mission.plan[index], span)
    places = [i for i, one in enumerate(mission.legs) if isinstance(one, Leg)]
    like = next((one for one in mission.legs if isinstance(one, Impulse)), Impulse())
    at = places[index]
    legs = (*mission.legs[:at], part, like, part, *mission.legs[at + 1 :])
    sums = [(a + (a > index), b + (b >= index), how) for a, b, how in mission.sums]
    known = any(a <= index <= b for a, b, _ in mission.sums)
    more = [] if known else [(index, index + 1, span)]
    return replace(mission, legs=legs, sums=(*sums, *more))


def _part(leg: Leg, span: Any) -> Leg:
    shortest, longest = both_ends(span)
    least = min(shortest, LEAST_PART * longest)
    return replace(leg, duration=(least, longest), steps=None, name="")


def without_impulse(mission: Mission, joint: int) -> Mission:
    """The mission without the impulse that is the only event of a joint between two legs."""
    places = [i for i, one in enumerate(mission.legs) if isinstance(one, Leg)]
    first, last = places[joint - 1], places[joint]
    bounds = [mission.stretches[i].duration_bounds for i in (joint - 1, joint)]
    whole: Any = (bounds[0][0] + bounds[1][0], bounds[0][1] + bounds[1][1])
    sums = []
    for a, b, how in mission.sums:
        if (a, b) == (joint - 1, joint):
            whole = how
        else:
            sums.append((a - (a >= joint), b - (b >= joint), how))
    leg = replace(mission.plan[joint - 1], duration=whole)
    return replace(mission, legs=(*mission.legs[:first], leg, *mission.legs[last + 1 :]), sums=tuple(sums))
