"""The structure of a path: its arcs, what the controls do in each, and the limits that it touches."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from dmoc.basics.digits import lasting
from dmoc.guess.starting import angle_around
from dmoc.meshes.choices import first_path
from dmoc.missions.solution import MissionSolution
from dmoc.motion.path import DiscretePath
from dmoc.results.solution import Solution
from dmoc.results.switches import control_shares
from dmoc.scene.problem import TransferProblem
from dmoc.structure.modes import (
    FREE,
    FULL,
    INSIDE,
    SINGULAR_NODES,
    kinds_along,
    names_of,
    runs_of,
    switch,
    turned_round,
)
from dmoc.structure.speeds import beside, sped
from dmoc.structure.surfaces import Surface, touched

# What the controls do in an arc.
BURN, COAST, SINGULAR = "burn", "coast", "singular arc"
# Where the way is along a zone, part of the thrust is what turns the path with the surface.
PARTLY = "partial thrust"
# Such an arc is a contact with more than this part of the thrust [-], and not all of it at more than so many
# nodes.
PART, MOST_FULL = 0.1, 2
# A limit acts if loosening it by its own size would change the objective by this part of it [-].
ACTS = 1e-5
# A path follows a limit if that acts over more than this many steps; else it touches it.
FOLLOWED_STEPS = 2.5
# Over more revolutions than this there are too many arcs.
MOST_TURNS = 10
# An arc is clearly there if it is longer than so many times the way from one node to the next [-].
CLEAR = 3.0


class Arc(NamedTuple):
    """A part of a path: what the controls do, where it ends, what it follows, what it touches at its end.

    `kind` is one of the words above or says to which limits controls keep; `end` is a fraction of the whole
    duration.
    """

    kind: str
    end: float
    follows: Surface | None = None
    touches: Surface | None = None

    @property
    def alike(self) -> tuple:
        """What must be equal for two neighbours to be one arc."""
        return self.kind, self.follows

    def words(self) -> str:
        """What it is, for people and as the name of its leg."""
        return self.kind if self.follows is None else f"{self.kind} along a limit".removeprefix("arc ")


def is_switched(problem: TransferProblem) -> bool:
    """Whether the cost is linear in one control with limits, from nothing to full."""
    shares = control_shares(problem, np.zeros((1, problem.controls)))
    return shares.shape[1] == 1 and float(shares[0, 0]) == 0.0


def can_be_parted(problem: TransferProblem) -> bool:
    """Whether arcs can be seen: of one body that does not turn, in few revolutions."""
    return not (
        problem.turns
        or problem.links
        or any(part.turns_body or part.point for part in problem.constraints)
        or angle_around(problem, first_path(problem, 2, 100)) > 2 * np.pi * MOST_TURNS
    )


def has_switches(problem: TransferProblem) -> bool:
    """Whether an answer may have several arcs: of full thrust and none, contacts, or limits of a force."""
    several = bool(problem.constraints) or is_switched(problem) or bool(names_of(problem))
    return several and can_be_parted(problem)


def arcs_of(solution: Solution) -> tuple[Arc, ...]:
    """The arcs of an answer on a coarse mesh."""
    problem, path = solution.require_problem(), solution.path
    cuts = _switches(problem, path) if is_switched(problem) else _limits_kept(solution)
    cuts = turned_round(problem, path, cuts, (BURN, FULL))
    marks: list[tuple[float, float, Surface]] = []
    least, step = ACTS * abs(solution.objective), 1.0 / (len(path.mesh) - 1)
    for surface, acts in touched(problem, path, least).items():
        spans = spans_of(path, acts)
        if is_switched(problem):
            cuts, spans = _partly_on(problem, path, cuts, spans)
        marks += [(*span, surface) for span in spans]
    kept = sped(problem, path, least)
    along = [(*span, surface) for surface, acts in kept.items() for span in spans_of(path, acts)]
    return _merged(beside(cuts, along, step), sorted([*marks, *along]), step, kept)


def _switches(problem: TransferProblem, path: DiscretePath) -> list[tuple[str, float]]:
    """Kinds of arcs and the fractions at which they end, by the one control that is switched."""
    share = control_shares(problem, path.control)[:, 0]
    at = path.fractions
    kinds = np.where(share > 0.5, BURN, COAST).astype(object)
    # Where |F| is rounded at zero a flat switch looks like one.
    between = (share > INSIDE) & (share < 1 - INSIDE) & (problem.actuator.smoothing is None)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], between.astype(int), [0]])))
    for first, last in edges.reshape(-1, 2):
        if last - first >= SINGULAR_NODES:
            kinds[first:last] = SINGULAR
    found = []
    for node in np.flatnonzero(kinds[1:] != kinds[:-1]):
        before, after = share[node] - 0.5, share[node + 1] - 0.5
        part = before / (before - after) if before * after < 0 else 0.5
        found.append((str(kinds[node]), float(at[node] + part * (at[node + 1] - at[node]))))
    return [*found, (str(kinds[-1]), 1.0)]


def _partly_on(
    problem: TransferProblem, path: DiscretePath, cuts: list[tuple[str, float]], spans: list
) -> tuple[list[tuple[str, float]], list]:
    """Switches and contacts with a zone; in those with part of the thrust nothing switches.

    A contact begins and ends halfway between two nodes.
    """
    share, at = control_shares(problem, path.control)[:, 0], path.fractions
    found = []
    for first, last in spans:
        one, two = (int(np.searchsorted(at, end)) for end in (first, last))
        mine = share[max(one - 1, 0) : two + 2]
        if one > 0 and two < len(at) - 1 and mine.max() > PART and (mine > 1 - INSIDE).sum() <= MOST_FULL:
            first, last = 0.5 * (at[one - 1] + at[one]), 0.5 * (at[two] + at[two + 1])
            begins = [0.0, *(end for _, end in cuts)]
            before = [
                (kind, min(end, first))
                for (kind, end), begin in zip(cuts, begins, strict=False)
                if begin < first
            ]
            cuts = [*before, (PARTLY, last), *(cut for cut in cuts if cut[1] > last)]
        found.append((float(first), float(last)))
    return _without_slivers(cuts, 1.0 / (len(at) - 1)), found


def _without_slivers(cuts: list[tuple[str, float]], spacing: float) -> list[tuple[str, float]]:
    """Switches without burns beside a contact that are shorter than from node to node."""
    left: list[tuple[str, float]] = []
    for i, (kind, end) in enumerate(cuts):
        beside = PARTLY in (left[-1][0] if left else "", cuts[i + 1][0] if i + 1 < len(cuts) else "")
        if not (kind == BURN and beside and end - (left[-1][1] if left else 0.0) < spacing):
            left.append((kind, end))
    return left


def _limits_kept(solution: Solution) -> list[tuple[str, float]]:
    """The limits that controls keep to and the fractions at which that changes."""
    problem, path = solution.require_problem(), solution.path
    if not names_of(problem):
        return [(FREE, 1.0)]
    kinds, at = kinds_along(problem, path, ACTS * abs(solution.objective)), path.fractions
    found = []
    for node in runs_of(kinds):
        part = switch(problem, path, node)
        found.append((str(kinds[node]), float(at[node] + part * (at[node + 1] - at[node]))))
    return [*found, (str(kinds[-1]), 1.0)]


def is_clear(coarse: Solution) -> bool:
    """Whether a coarse answer shows its arcs well: |F| is not rounded, or none of them is short."""
    if coarse.require_problem().actuator.smoothing is None:
        return True
    shortest = np.diff([0.0, *(arc.end for arc in arcs_of(coarse))]).min()
    return bool(shortest * (len(coarse.path.fractions) - 1) > CLEAR)


def surely_seen(arcs: tuple[Arc, ...], solution: Solution) -> tuple[Arc, ...]:
    """The arcs without those, but for the first and the last one, that are shorter than from node to node.

    They may be none; those that are missing then are found by the switching function.
    """
    left, spacing = list(arcs), 1.0 / (len(solution.path.fractions) - 1)
    while len(left) > 2:
        lengths = np.diff([arc.end for arc in left[:-1]])
        place = int(np.argmin(lengths))
        if lengths[place] >= spacing:
            break
        before, short = left[place], left.pop(place + 1)
        left[place] = before._replace(end=short.end, touches=before.touches or short.touches)
        left = list(joined(left))
    return tuple(left)


def without_waiting(arcs: tuple[Arc, ...]) -> tuple[Arc, ...]:
    """The arcs without a coast at the begin or the end.

    Where one is worth its time after all, the switching function finds that it is missing.
    """
    first, last = int(arcs[0].kind == COAST), len(arcs) - int(arcs[-1].kind == COAST)
    if last - first < 2 or arcs[last - 1].touches is not None:
        return arcs
    begin, end = (arcs[0].end if first else 0.0), arcs[last - 1].end
    left = [arc._replace(end=(arc.end - begin) / (end - begin)) for arc in arcs[first:last]]
    return (*left[:-1], left[-1]._replace(end=1.0))


def joined(arcs: Iterable[Arc]) -> tuple[Arc, ...]:
    """Neighbours that are alike, and have no touch between them, are one arc."""
    left: list[Arc] = []
    for arc in arcs:
        if left and left[-1].alike == arc.alike and left[-1].touches in (None, arc.follows):
            left[-1] = arc
        else:
            left.append(arc)
    return tuple(left)


def spans_of(path: DiscretePath, acts: np.ndarray) -> list[tuple[float, float]]:
    """First and last fraction of each run of nodes; gaps within a step do not part a run."""
    at, steps = path.fractions, path.order // 2
    nodes = np.flatnonzero(acts)
    runs = np.split(nodes, np.flatnonzero(np.diff(nodes) > steps + 1) + 1)
    return [(float(at[run[0]]), float(at[run[-1]])) for run in runs]


def _merged(
    cuts: list, marks: list[tuple[float, float, Surface]], step: float, kept: Container[Surface] = ()
) -> tuple[Arc, ...]:
    """Arcs between all switches, touches, and begins and ends of ways along limits.

    Those that are `kept` are never touched at one instant alone.
    """
    places: list[tuple[float, Surface | None]] = [(end, None) for _, end in cuts]
    follows: list[tuple[float, float, Surface]] = []
    for first, last, surface in marks:
        # Nothing keeps a coast at a limit: what looks like that is a touch.
        kinds = _kinds_within(cuts, first, last)
        long = last - first > FOLLOWED_STEPS * step and COAST not in kinds
        if long or surface in kept or PARTLY in kinds:
            follows.append((first, last, surface))
            places += [(first, surface), (last, surface)]
        else:
            places.append((0.5 * (first + last), surface))
    arcs, begin = [], 0.0
    for end, touch in sorted(places, key=lambda place: (place[0], place[1] is None)):
        if end <= begin:
            continue
        middle = 0.5 * (begin + end)
        kind = next(kind for kind, last in cuts if middle <= last)
        along = next((one for first, last, one in follows if first <= middle <= last), None)
        if along in kept and kind in (BURN, COAST):
            # What keeps the speed at its limit is between nothing and full.
            kind = SINGULAR
        arcs.append(Arc(kind, end, along, touch))
        begin = end
    return tuple(arcs)


def _kinds_within(cuts: list[tuple[str, float]], first: float, last: float) -> set[str]:
    """The kinds of arcs between two fractions of the duration."""
    begins = [0.0, *(end for _, end in cuts)]
    return {kind for (kind, end), begin in zip(cuts, begins, strict=False) if begin < last and end > first}


def alike(one: Sequence[Arc], other: Sequence[Arc]) -> bool:
    """Whether two chains of arcs are the same but for the times."""
    return [arc._replace(end=0.0) for arc in one] == [arc._replace(end=0.0) for arc in other]


def plain(arcs: Sequence[Arc]) -> tuple[list[Any], ...]:
    """Arcs as plain data, for files."""
    return tuple(
        [arc.kind, arc.end, *(surface if surface is None else list(surface) for surface in arc[2:])]
        for arc in arcs
    )


def from_plain(data: Sequence[list[Any]]) -> tuple[Arc, ...]:
    """Arcs from plain data."""
    return tuple(
        Arc(str(kind), float(end), *(None if one is None else Surface(*one) for one in surfaces))
        for kind, end, *surfaces in data
    )


def told(arcs: Sequence[Arc], found: MissionSolution) -> str:
    """What was found, such as `3 legs: burn 0.41 s, coast 1.9 s, burn 0.2 s`."""
    lengths = [f"{arc.words()} {lasting(leg.duration, 4)}" for arc, leg in zip(arcs, found.legs, strict=True)]
    return f"{len(arcs)} leg{'s' * (len(arcs) > 1)}: {', '.join(lengths)}"
