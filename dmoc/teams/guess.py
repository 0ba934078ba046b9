"""The paths of all bodies to start from, bent so that no two of them run into each other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from dmoc.basics.arguments import entries, short
from dmoc.ends.base import State
from dmoc.guess.open_ends import end_estimates
from dmoc.guess.starting import guess_duration, starting_guess
from dmoc.parts.detours import CENTRAL, CLEARANCE
from dmoc.scene.problem import TransferProblem
from dmoc.scene.team import Team
from dmoc.teams.path import TeamPath

# Paths are bent apart at most so many times: bends past one body may lead into another one.
PASSES = 3


def guessed(
    team: Team,
    numerics: tuple[np.ndarray, int, bool],
    given: Any = None,
    sides: Sequence[int] = (),
    bent: bool = True,
) -> TeamPath:
    """A guess on a mesh, order and kind of control: each body's own, bent apart from those of the others.

    Two bodies that change places head-on have a path through each other as their guess. There both ways
    round are equally near: the gradient of their distance has no part across the path, and every step of the
    optimiser keeps to the line until rounding errors break the tie, after 210 iterations instead of 10 and to
    a side that nobody can foretell. So they are bent sideways, each to its own left (in space, around the axis
    that they move along least): a team that crosses in one place then turns around it as on a roundabout.
    `sides` has -1 for pairs that pass on the other side.
    """
    parts, duration = _each(team, given), max(map(guess_duration, team.members))
    legs = [
        starting_guess(problem, *numerics, mine, duration)
        for problem, mine in zip(aimed(team.members, team.meetings(), duration), parts, strict=True)
    ]
    start = TeamPath(tuple(legs), (team.start_time,) * len(legs))
    return bent_apart(team, start, sides) if bent else start


def _each(team: Team, given: Any) -> tuple:
    """A guess for each body, or None."""
    if given is None:
        return (None,) * len(team.members)
    found = entries(given)
    if found is None or len(found) != len(team.members):
        raise ValueError(
            f"guess of a team must be a former solution or {len(team.members)} guesses, one a body; "
            f"got {short(given)}"
        )
    return found


def aimed(
    members: Sequence[TransferProblem], meetings: Sequence[set[int]], duration: float
) -> list[TransferProblem]:
    """The transfers of all bodies, each by itself, where they meet nobody; they last about `duration` [s].

    Those that are to meet go to a place that one of their goals says; else to the middle of where they would
    be or, where something attracts them, to where the first of them coasts: the middle of two orbits is on
    neither.
    """
    found = list(members)
    for bodies in map(sorted, meetings):
        ends = {i: _end(members[i], duration) for i in bodies}
        given = [state for state, known in ends.values() if known]
        states = given or [state for state, _ in ends.values()]
        drawn = any(members[i].attraction.sources for i in bodies)
        first = bool(given) or drawn
        place, velocity = states[0] if first else (np.mean([place for place, _ in states], axis=0), None)
        for i, (_, known) in ends.items():
            if not known and not found[i].turns:
                aim = None if velocity is None or np.isnan(velocity).any() else tuple(velocity)
                found[i] = replace(found[i], goal=State(tuple(place), aim))
    return found


def _end(problem: TransferProblem, duration: float) -> tuple[tuple[np.ndarray, np.ndarray], bool]:
    """Where a body would end and how fast [m], [m/s], and whether its own goal says where."""
    (begin, _), (place, velocity) = end_estimates(problem, duration)
    known = not np.isnan(problem.goal.point.estimate(problem.start_time + duration)[0]).any()
    begin = np.where(np.isnan(begin), 0.0, begin)
    return (np.where(np.isnan(place), begin, place), velocity), known


def bent_apart(team: Any, path: Any, sides: Sequence[int] = ()) -> Any:
    """A path on which bodies that come nearer to each other than they may are bent to their sides."""
    if team.dimension == 1:
        return path
    for _ in range(PASSES):
        ways = path.ways
        bends = [np.zeros_like(way) for way in ways]
        near = list(too_near(team, path))
        for place, a, b, distance in near:
            side = sides[place] if place < len(sides) else 0
            bend = _bend(ways[b] - ways[a], path.fractions, distance, side)
            bends[a] -= 0.5 * bend
            bends[b] += 0.5 * bend
        path = path.moved(bends)
        if not near:
            break
    return path


def too_near(team: Any, path: Any) -> Iterator[tuple[int, int, int, float]]:
    """Pairs that come nearer than they may: which of all pairs, the two bodies, and what they are to keep."""
    ways = path.ways
    for i, (part, a, b) in enumerate(team.pairs()):
        if not (distance := part.distance_kept):
            continue
        if _nearest(ways[b] - ways[a]) < distance:
            yield i, a, b, distance


def _nearest(apart: np.ndarray) -> float:
    """The least distance of the origin from the chords between places, but for the two at the ends [m]."""
    begin, chord = apart[1:-2], np.diff(apart[1:-1], axis=0)
    along = -np.sum(begin * chord, axis=1) / np.maximum(np.sum(chord**2, axis=1), np.finfo(float).tiny)
    foot = begin + np.clip(along, 0.0, 1.0)[:, None] * chord
    both = np.concatenate([apart[1:-1], foot])
    return float(np.linalg.norm(both, axis=1).min())


def other_sides(team: Any, path: Any) -> Iterator[tuple[int, ...]]:
    """Which pairs pass on which side, all ways in turn: those that come near; the usual way is the first."""
    near = [i for i, *_ in too_near(team, path)]
    for signs in product((1, -1), repeat=len(near)):
        sides = [0] * len(team.pairs())
        for place, sign in zip(near, signs, strict=True):
            sides[place] = sign
        yield tuple(sides)


def _bend(apart: np.ndarray, fractions: np.ndarray, distance: float, side: int) -> np.ndarray:
    """How the way of one body as the other one sees it is bent past it, zero at both ends [m].

    It passes on the side (1 left, -1 right) or, if that is 0, on the nearer one: on the left if none is.
    """
    node = int(np.argmin(np.linalg.norm(apart[1:-1], axis=1))) + 1
    along = apart[node + 1] - apart[node - 1]
    if not np.linalg.norm(along):
        return np.zeros_like(apart)
    along = along / np.linalg.norm(along)
    left = _left_of(along)
    aside = float(apart[node] @ left)
    if side == 0:
        side = 1 if abs(aside) <= CENTRAL * distance else int(np.sign(aside))
    peak = fractions[node]
    shape = np.where(fractions < peak, fractions / peak, (1 - fractions) / (1 - peak))
    reach = side * CLEARANCE * distance - aside
    # On the side where it is it may be far enough already.
    reach = reach if side * reach > 0 else 0.0
    return np.sin(0.5 * np.pi * shape)[:, None] * reach * left


def _left_of(along: np.ndarray) -> np.ndarray:
    """A direction across another one: to its left, seen from the axis that it follows least."""
    if len(along) == 2:
        return np.array([-along[1], along[0]])
    # z before y before x, where they are equal: a team that moves in a plane x-y passes as in the plane.
    axis = np.eye(3)[2 - int(np.argmin(np.abs(along[::-1])))]
    left = np.cross(axis, along)
    return left / np.linalg.norm(left)
