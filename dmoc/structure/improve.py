"""What a solved chain of arcs lacks, and what it has in vain."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from dmoc.missions.solution import MissionSolution
from dmoc.results.solution import Solution
from dmoc.scene.problem import TransferProblem
from dmoc.structure.arcs import ACTS, BURN, COAST, PARTLY, Arc, is_switched, joined, spans_of
from dmoc.structure.modes import AND, REVERSED, lacking, names_of
from dmoc.structure.speeds import is_of_speed, sped
from dmoc.structure.surfaces import NEAR, pierced, pulled, room, touched

# A leg is empty if it lasts less than this many times its shortest duration.
EMPTY = 1.5
# An arc is missing where the switching function is on the wrong side by more than this part of its scale [-].
WRONG = 1e-6
# It is in doubt up to this many times what it is at a switch, where it should be zero [-].
DOUBT = 10.0
# An arc between two touches of a limit is at it throughout if it is within this part of all the room [-].
SAME = 1e-5
# A zone pulls where a multiplier of its surface with the wrong sign is more than this part of the largest [-].
PULLS = 0.1
# A new arc begins with this part of the whole duration on either side of where that is furthest wrong [-]: a
# longer one leads away from the answer so far.
NEW = 1e-3
# A new way along a zone begins with this part of it [-].
TURNING = 1e-2


def improved(problem: TransferProblem, arcs: Sequence[Arc], found: MissionSolution) -> tuple[Arc, ...]:
    """The arcs of an answer without empty ones and with missing ones; the same if there are none."""
    arcs = settled(arcs, found)
    if (less := without_empty(arcs, found)) != arcs:
        return less
    if (along := _followed(problem, arcs, found)) != arcs:
        return along
    other = None if is_switched(problem) else _other_limits(problem, arcs, found)
    if other is not None:
        return other
    more: list[Arc] = []
    missing = [_wrong(arcs, i, leg) for i, leg in enumerate(found.legs)] if is_switched(problem) else []
    # At both of its switches the function of a leg is zero, but for the errors of its steps.
    both = [i for i in range(1, len(missing) - 1) if all(_is_switch(*arcs[k : k + 2]) for k in (i - 1, i))]
    doubt = max([WRONG, *(DOUBT * abs(float(missing[i][-1])) for i in both)])
    missing = [np.where(wrong > doubt, wrong, 0.0) for wrong in missing]
    for i, wrong in enumerate(missing):
        # At a switch the function is zero but for errors; at a touch of a burn or of a coast it need not be.
        wrong[[0] * (i > 0 and _is_zero(*arcs[i - 1 : i + 1]))] = 0.0
        wrong[[-1] * (i < len(missing) - 1 and _is_zero(*arcs[i : i + 2]))] = 0.0
    worst = max((float(wrong.max()) for wrong in missing), default=0.0)
    for i, (arc, leg) in enumerate(zip(arcs, found.legs, strict=True)):
        begin = arcs[i - 1].end if i else 0.0
        # One more arc may be enough: what is wrong elsewhere is asked again with it.
        if worst and missing[i].max() == worst:
            parts = _turned(problem, arcs, i, found, missing[i]) or _parted(arcs, i, found, missing[i])
        else:
            parts = _touching(problem, arcs, i, leg, found.objective)
        more += [part._replace(end=begin + (arc.end - begin) * part.end) for part in parts] or [arc]
    return tuple(more)


def _other_limits(
    problem: TransferProblem, arcs: tuple[Arc, ...], found: MissionSolution
) -> tuple[Arc, ...] | None:
    """The arcs with one more, in which controls keep to other limits, or None where none lacks."""
    if not names_of(problem):
        return None
    least = ACTS * abs(found.objective)
    touching = [arc.touches is not None for arc in arcs]
    lacks = lacking(problem, [arc.kind for arc in arcs], touching, [leg.path for leg in found.legs], least)
    if lacks is None:
        return None
    index, kind, wrong = lacks
    begin = arcs[index - 1].end if index else 0.0
    parts = _parted(arcs, index, found, wrong, kind)
    scaled = [part._replace(end=begin + (arcs[index].end - begin) * part.end) for part in parts]
    return (*arcs[:index], *scaled, *arcs[index + 1 :])


def not_turned_round(arcs: tuple[Arc, ...]) -> tuple[Arc, ...]:
    """The arcs without joints at which a full force is turned round; the same if there are none."""
    plain = tuple(arc._replace(kind=arc.kind.removesuffix(AND + REVERSED)) for arc in arcs)
    return arcs if plain == arcs else joined(plain)


def is_pulled(arcs: Sequence[Arc], found: MissionSolution) -> bool:
    """Whether a zone holds a path on its surface from which that should leave."""
    stretches = found.require_problem().stretches
    return any(
        pulled(stretch.constraints[one.constraint], one.constraint, one, leg.path) > PULLS
        for arc, leg, stretch in zip(arcs, found.legs, stretches, strict=True)
        if (one := arc.follows) is not None and not stretch.constraints[one.constraint].limits_speed
    )


def settled(arcs: Sequence[Arc], found: MissionSolution) -> tuple[Arc, ...]:
    """Arcs with the ends that their legs have."""
    ends = np.cumsum([leg.duration for leg in found.legs]) / found.duration
    return tuple(arc._replace(end=float(end)) for arc, end in zip(arcs, ends, strict=True))


def without_empty(arcs: tuple[Arc, ...], found: MissionSolution) -> tuple[Arc, ...]:
    """The arcs without those that last as little as they may; one along a limit becomes a touch of it."""
    empty = [
        leg.duration < EMPTY * stretch.duration_bounds[0]
        for leg, stretch in zip(found.legs, found.require_problem().stretches, strict=True)
    ]
    if not any(empty) or all(empty):
        return arcs
    left: list[Arc] = []
    for arc, drop in zip(arcs, empty, strict=True):
        if drop and left:
            touches = arc.follows or arc.touches or left[-1].touches
            in_vain = is_of_speed(found.require_problem(), arc.follows)
            left[-1] = left[-1]._replace(end=arc.end, touches=None if in_vain else touches)
        elif not drop:
            left.append(arc)
    return joined(left)


def _followed(problem: TransferProblem, arcs: tuple[Arc, ...], found: MissionSolution) -> tuple[Arc, ...]:
    """The arcs with those that stay at a limit between two touches of it as ways along that limit."""
    left = list(arcs)
    for i, (one, two) in enumerate(pairwise(arcs)):
        surface = one.touches
        if is_of_speed(problem, surface):
            continue
        if surface is not None and surface == two.touches and two.follows is None:
            rooms = [
                room(problem, leg.path, surface, leg.path.fractions, leg.path.position) for leg in found.legs
            ]
            most, whole = float(np.abs(rooms[i + 1]).max()), float(np.ptp(np.concatenate(rooms)))
            leg = found.legs[i + 1]
            broken = any(one == surface for _, one in pierced(problem, leg.path, leg.provenance.start_time))
            if most < SAME * whole or (broken and most < NEAR * whole):
                left[i + 1] = two._replace(follows=surface)
    if tuple(left) == arcs:
        return arcs
    # Between two ways along the same limit there is no touch of it.
    return joined(
        one._replace(touches=None) if one.follows and one.alike == two.alike else one
        for one, two in zip(left, [*left[1:], left[-1]._replace(kind="")], strict=True)
    )


def _wrong(arcs: tuple[Arc, ...], index: int, leg: Solution) -> np.ndarray:
    """By how much the switching function says at each node of a leg that a burn coasts, or a coast burns.

    With S = dH/d|F| the rate dS/dt is -(d|lambda|/dt) / m in burns as in coasts, lambda being the costate of
    the velocity, and S is zero at a switch (Lawden, 1963): no costate of the mass is needed.
    """
    switches = [i for i in (index - 1, index) if 0 <= i < len(arcs) - 1 and _is_switch(arcs[i], arcs[i + 1])]
    path, length = leg.path, np.linalg.norm(leg.costate, axis=1)
    if arcs[index].kind not in (BURN, COAST) or not switches:
        return np.zeros(len(length))
    mass = 0.5 * (path.mass[1:] + path.mass[:-1])
    switching = np.append(0.0, np.cumsum(-np.diff(length) / mass))
    switching -= switching[0 if switches[0] < index else -1]
    return switching * (1 if arcs[index].kind == BURN else -1) * path.mass[0] / length.max()


def _parted(
    arcs: tuple[Arc, ...], index: int, found: MissionSolution, wrong: np.ndarray, kind: str = ""
) -> list[Arc]:
    """An arc with one of another kind in it where it is furthest wrong: a burn with a coast, or the reverse."""
    arc, leg, peak = arcs[index], found.legs[index], int(np.argmax(wrong))
    at = leg.path.fractions
    right = np.flatnonzero(wrong == 0.0)
    first, last = int(right[right < peak].max(initial=0)), int(right[right > peak].min(initial=len(at) - 1))
    share = NEW * found.duration / leg.duration
    begin, end = max(at[first], at[peak] - share), min(at[last], at[peak] + share)
    kind = kind or (COAST if arc.kind == BURN else BURN)
    other = arc._replace(kind=kind, end=end, touches=None)
    before = [] if peak == 0 else [arc._replace(end=begin, touches=None)]
    if peak == len(at) - 1:
        return [*before, other._replace(end=1.0, touches=arc.touches)]
    return [*before, other, arc._replace(end=1.0)]


def _turned(
    problem: TransferProblem, arcs: tuple[Arc, ...], index: int, found: MissionSolution, wrong: np.ndarray
) -> list[Arc]:
    """A coast with a way along the zone that it touches where it most lacks a burn; else nothing."""
    arc, peak = arcs[index], int(np.argmax(wrong))
    share = min(TURNING * found.duration / found.legs[index].duration, 0.5)
    begin = arcs[index - 1].touches if index else None
    if arc.kind != COAST or arc.follows:
        return []
    if peak == 0 and begin is not None and not is_of_speed(problem, begin):
        return [Arc(PARTLY, share, begin, begin), arc._replace(end=1.0)]
    if peak == len(wrong) - 1 and arc.touches is not None and not is_of_speed(problem, arc.touches):
        return [arc._replace(end=1 - share), Arc(PARTLY, 1.0, arc.touches, arc.touches)]
    return []


def _is_zero(one: Arc, other: Arc) -> bool:
    """Whether the switching function is zero between two arcs: where a burn, or part of the thrust, begins."""
    return _is_switch(one, other) or {one.kind, other.kind} == {PARTLY, COAST}


def _is_switch(one: Arc, other: Arc) -> bool:
    return {one.kind, other.kind} == {BURN, COAST} and one.touches is None


def _touching(
    problem: TransferProblem, arcs: Sequence[Arc], index: int, leg: Solution, objective: float
) -> list[Arc]:
    """The parts of an arc between touches that it does not know of yet."""
    arc = arcs[index]
    # The start and the goal may be on a limit; else that is a touch.
    known = (
        None if index == 0 else (arcs[index - 1].touches, arcs[index - 1].follows, arc.follows),
        None if index == len(arcs) - 1 else (arc.touches, arc.follows, arcs[index + 1].follows),
    )
    acts = touched(problem, leg.path, ACTS * abs(objective))
    marks = [
        (0.5 * (first + last), surface)
        for surface, mask in acts.items()
        for first, last in spans_of(leg.path, mask)
    ]
    marks = marks or pierced(problem, leg.path, leg.provenance.start_time, known)
    marks = [mark for mark in marks if mark[1] != arc.follows]
    for surface, mask in sped(problem, leg.path, ACTS * abs(objective)).items():
        if surface != arc.follows:
            first, last = spans_of(leg.path, mask)[0]
            begun = [arc._replace(end=first, touches=surface)] if first > 0 else []
            kept = arc._replace(end=last, follows=surface, touches=surface if last < 1 else arc.touches)
            return [*begun, kept, *([arc] if last < 1 else [])]
    if not marks:
        return []
    return [*(arc._replace(end=at, touches=surface) for at, surface in sorted(marks)), arc._replace(end=1.0)]
