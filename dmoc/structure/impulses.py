"""How many impulses: the primer vector says where another one helps, and one of no size is taken away.

References
----------
D. F. Lawden, Optimal Trajectories for Space Navigation (1963).
P. M. Lion, M. Handelsman, Primer vector on fixed-time impulsive trajectories, AIAA J. 6 (1968).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.legs.events import Impulse
from dmoc.legs.legs import Leg, both_ends
from dmoc.missions.checks import HELPS, worth_of
from dmoc.missions.path import MissionPath, cut, merged
from dmoc.missions.solution import MissionSolution
from dmoc.scene.mission import Mission

# There are no more than so many impulses.
MOST_IMPULSES = 8
# A new impulse is at first this part of all others together [-].
FIRST_SIZE = 0.02
# An impulse below this part of all together is taken away [-].
NO_SIZE = 1e-5
# A part of a coast lasts at least this part of it [-].
LEAST_PART = 1e-4
# Another impulse must save at least this part of the objective [-].
WORTH = 1e-7


def with_best_impulses(found: MissionSolution, solve: Callable[..., MissionSolution]) -> MissionSolution:
    """The answer with as many impulses as the primer vector asks for, from an answer with some.

    Parameters
    ----------
    found : MissionSolution
    solve : callable
        (mission, guess) -> MissionSolution.
    """
    best, ladder, told = found, found.ladder, []
    while best.success and len(best.impulses) < MOST_IMPULSES:
        started = _with_another(best)
        if started is None:
            break
        mission, path = started
        tried = _without_idle(solve(mission, path), solve)
        ladder += tried.ladder
        if not tried.success or tried.objective > (1 - WORTH) * best.objective:
            break
        told.append(f"{len(tried.impulses)} impulses cost {tried.objective:.8g}")
        best = tried
    best = _without_idle(best, solve)
    return replace(best, ladder=ladder, reason="; ".join([best.reason, *told]))


def _with_another(found: MissionSolution) -> tuple[Mission, MissionPath] | None:
    """The mission with one more impulse where the primer vector is longest, and a path to start from."""
    worth = worth_of(found)
    if worth is None:
        return None
    axes, longest, best = found.dimension, 1 + HELPS, None
    for index, leg in enumerate(found.legs):
        primer = leg.costate[1:-1, :axes] / worth
        sizes = np.linalg.norm(primer, axis=1)
        if len(sizes) and not leg.path.control.shape[1] and sizes.max() > longest:
            place = int(np.argmax(sizes))
            longest, best = float(sizes[place]), (index, float(leg.path.fractions[1 + place]), -primer[place])
    if best is None:
        return None
    index, fraction, way = best
    first, last = cut(found.legs[index].path, fraction)
    mission = _split(found.require_problem(), index)
    path = found.path
    total = sum(kick.size for kick in found.impulses) or 1.0
    kick = FIRST_SIZE * total * way / np.linalg.norm(way)
    legs = (*path.legs[:index], first, last, *path.legs[index + 1 :])
    begins = (*path.begins[: index + 1], path.begins[index] + first.duration, *path.begins[index + 1 :])
    own = {
        _renamed(found.require_problem(), name, lambda i: i + 1 if i > index else i): values
        for name, values in path.own.items()
    }
    return mission, MissionPath(legs, begins, own | {f"joint {index + 1}": kick}, near=True)


def _renamed(mission: Mission, name: str, moved: Callable[[int], int]) -> str:
    """The name of a joint after legs were added or taken away."""
    if name in ("start", "goal"):
        return name
    return f"joint {moved(int(name.split()[-1]))}"


def _split(mission: Mission, index: int) -> Mission:
    """The mission with one leg in two parts and an impulse between them, as long together as the leg was."""
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


def _without_idle(found: MissionSolution, solve: Callable[..., MissionSolution]) -> MissionSolution:
    """The answer without impulses of no size between two coasts."""
    while found.success:
        total = sum(kick.size for kick in found.impulses)
        mission = found.require_problem()
        idle = [
            i
            for i, joint in enumerate(mission.joints)
            if len(joint.events) == 1
            and joint.boundary is None
            and joint.events[0].pushes
            and np.linalg.norm(found.own[joint.name]) < NO_SIZE * total
        ]
        if not idle:
            return found
        tried = solve(*_merged(found, idle[0]))
        if not tried.success:
            return found
        found = tried
    return found


def _merged(found: MissionSolution, joint: int) -> tuple[Mission, MissionPath]:
    """The mission without the impulse at a joint, and a path to start from."""
    mission, path = found.require_problem(), found.path
    places = [i for i, one in enumerate(mission.legs) if isinstance(one, Leg)]
    first, last = places[joint - 1], places[joint]
    bounds = [mission.stretches[i].duration_bounds for i in (joint - 1, joint)]
    whole = (bounds[0][0] + bounds[1][0], bounds[0][1] + bounds[1][1])
    sums = []
    for a, b, how in mission.sums:
        if (a, b) == (joint - 1, joint):
            whole = how
        else:
            sums.append((a - (a >= joint), b - (b >= joint), how))
    leg = replace(mission.plan[joint - 1], duration=whole)
    legs = (*mission.legs[:first], leg, *mission.legs[last + 1 :])
    one = merged(path.legs[joint - 1], path.legs[joint])
    own = {
        _renamed(mission, name, lambda i: i - 1 if i > joint else i): values
        for name, values in path.own.items()
        if name != f"joint {joint}"
    }
    begins = (*path.begins[:joint], *path.begins[joint + 1 :])
    new = MissionPath((*path.legs[: joint - 1], one, *path.legs[joint + 1 :]), begins, own, near=True)
    return replace(mission, legs=legs, sums=tuple(sums)), new
