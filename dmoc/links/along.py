"""Paths that keep to links: how a guess gets from one place to another where the straight line breaks them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.quaternions import AXES, slerp
from dmoc.configurations.base import Configuration
from dmoc.configurations.coordinates import ATTITUDE, Coordinates
from dmoc.configurations.of_problem import configuration_of
from dmoc.effects.base import Body

# A path is followed in pieces of this part of the distance between its ends.
PIECE = 0.01
# A path that has not come to its end after so many pieces is given up: it goes round and round.
MOST_PIECES = 2000
# Newton's method puts a place back on its links with so many steps; quadratic convergence takes three to five.
MOST_NEWTON = 20
# A place is on its links if a step of Newton's method moves it by less than this part of the distance.
ON_LINKS = 1e-12
# A direction that links leave less than this part of [-] leads nowhere: the path first goes aside.
LOST = 0.05
# Where a straight line is off its links by less than this part of its length, it is good enough to begin with.
BENT = 1e-6


def guess_along(problem: Any, fractions: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """A path that keeps to the links of a problem, and the velocities at its ends, 0 where they are free.

    Raises
    ------
    ValueError
        If the start is not known.
    """
    (start, first), (goal, last) = problem.start.fixed(), problem.goal.fixed()
    if np.isnan(start).any():
        raise ValueError("a body on links needs a start whose position is known, or a guess of the path")
    likely = problem.goal.likely(problem.start) if problem.system is not None else start
    path = along_links(problem, configuration_of(problem), (start, goal, likely), fractions)
    return path, (np.nan_to_num(first), np.nan_to_num(last))


def along_links(
    problem: Any, body: Configuration, ends: tuple, fractions: np.ndarray, round_by: Sequence[Any] = ()
) -> np.ndarray:
    """Coordinates at fractions of the way between two ends that keep to the links, shape (count, size).

    The ends are those of start and goal, and values for entries of the goal that are free, which are NaN.

    Rods turn evenly from their first to their last direction, the other bodies go straight. Where links know
    no such way, the path goes on from place to place towards the goal as far as they let it. Links in
    `round_by` lead what they carry the other way round.
    """
    start, goal, likely = ends
    if not body.conditions:
        return start + fractions[:, None] * (np.where(np.isnan(goal), likely, goal) - start)
    on = _OnLinks(body)
    aim = on.put(np.where(np.isnan(goal), likely, goal), ~np.isnan(goal))
    straight = start + fractions[:, None] * (aim - start)
    for turning in body.coordinates.quaternions:
        straight[:, turning] = slerp(start[turning], aim[turning], fractions)
    at, knows, waiting = states_of(body.coordinates, straight), False, list(problem.links)
    while waiting:
        # What sits on a body that another link carries waits for that one; of a ring the first begins.
        carried = {name for link in waiting for name in link.holds[-1:]}
        link = next((one for one in waiting if not carried & set(one.holds[:-1])), waiting[0])
        waiting.remove(link)
        led = link.led(at, fractions, link in round_by)
        knows |= led is not None
        at |= led or {}
    # A rail is straight: what goes straight keeps to it.
    path = coordinates_of(body, at)
    if not knows and np.abs(on.gaps(straight)).max() > BENT * float(np.linalg.norm(aim - start)):
        path = _step_by_step(on, start, aim, fractions)
    return np.array([on.put(place) for place in path])


def other_ways(problem: Any, fractions: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Names and paths on which hinges, rods and rigid bodies come to their goal the other way round.

    Each by itself, then two at a time.
    """
    body, (start, _), (goal, _) = configuration_of(problem), problem.start.fixed(), problem.goal.fixed()
    likely = problem.goal.likely(problem.start) if problem.system is not None else start
    made = body.coordinates
    straight = along_links(problem, body, (start, goal, likely), fractions)
    carried = {link.holds[-1] for link in problem.links}
    turning = [block.body for block in made.blocks if block.kind == ATTITUDE and block.body not in carried]
    loose = [name for name in turning if not np.isnan(goal[made.quaternion_of(name)]).any()]
    ways: list[Any] = [*(link for link in problem.links if link.goes_round), *loose]
    for chosen in (*combinations(ways, 1), *combinations(ways, 2)):
        flipped = goal.copy()
        for name in set(chosen) & set(loose):
            flipped[made.quaternion_of(name)] *= -1
        path = along_links(problem, body, (start, flipped, likely), fractions, chosen)
        # Where nothing turns there is no other way.
        if np.abs(path - straight).max() > BENT * max(1.0, np.abs(straight).max()):
            names = " and ".join(one if isinstance(one, str) else one.holds[-1] or "the rod" for one in chosen)
            yield f"the other way round of {names}", path


def kept_on_links(problem: Any, path: np.ndarray, held: str) -> np.ndarray:
    """A path whose nodes are put on the links of a problem; the place of one body stays where links let it."""
    on = _OnLinks(configuration_of(problem))
    made = on.body.coordinates
    kept, found = made.places & made.of_body(held)[0], path.copy()
    for i, place in enumerate(path):
        found[i] = on.put(place, kept)
        if np.abs(on.gaps(found[i][None])).max() > BENT * float(np.linalg.norm(place)):
            # It is out of reach: all bodies give way.
            found[i] = on.put(place)
    return found


def _step_by_step(on: _OnLinks, start: np.ndarray, aim: np.ndarray, fractions: np.ndarray) -> np.ndarray:
    """From place to place as near to the straight line as the links let be, at an even pace."""
    distance = float(np.linalg.norm(aim - start))
    places, piece, ahead = [start], PIECE * distance, np.zeros(len(start))
    for _ in range(MOST_PIECES):
        left = aim - places[-1]
        if np.linalg.norm(left) <= piece:
            break
        way = on.free_part(places[-1], left)
        if np.linalg.norm(way) < LOST * np.linalg.norm(left):
            # Links leave no way straight on: on the way so far, or aside where there is none.
            way = on.free_part(places[-1], ahead) if ahead.any() else on.aside(places[-1])
        ahead = way / (np.linalg.norm(way) or 1.0)
        places.append(on.put(places[-1] + piece * ahead))
    path = np.array([*places, aim])
    way = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1)))
    return np.stack([np.interp(fractions * way[-1], way, column) for column in path.T], axis=1)


def states_of(made: Coordinates, path: np.ndarray) -> dict[str, Body]:
    """Each body by its name, at rest, from coordinates of shape (count, size)."""
    found: dict[str, dict[str, np.ndarray]] = {}
    for block, part in zip(made.blocks, made.cut(path), strict=True):
        kind = "attitude" if block.kind == ATTITUDE else "position"
        found.setdefault(block.body, {})[kind] = part
    still = np.zeros((len(path), AXES))
    return {
        name: Body(parts["position"], 0 * parts["position"], parts.get("attitude"), None, still)
        for name, parts in found.items()
    }


def coordinates_of(body: Configuration, at: dict[str, Body]) -> np.ndarray:
    """The coordinates of bodies, shape (count, size)."""
    blocks = body.coordinates.blocks
    return np.hstack(
        [at[one.body].attitude if one.kind == ATTITUDE else at[one.body].position for one in blocks]
    )


class _OnLinks:
    """Links as functions of the place."""

    def __init__(self, body: Configuration):
        self.body = body
        q = ca.SX.sym("q", body.size)
        # Attitudes stay unit quaternions on the way.
        g = body.g(q) if body.surplus else body.links_at(q)
        self.function = ca.Function("links", [q], [ca.densify(g), ca.densify(ca.jacobian(g, q))])

    def _at(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        gap, slope = self.function(place)
        return gap.full().ravel(), slope.full()

    def gaps(self, places: np.ndarray) -> np.ndarray:
        """By how much places, one row each, are off the links."""
        return self.function(places.T)[0].full()

    def put(self, place: np.ndarray, kept: np.ndarray | None = None) -> np.ndarray:
        """The place on the links near by; entries that are `kept` stay, if the links let them."""
        free = np.ones(len(place), bool) if kept is None or kept.all() else ~kept
        found, size = place.copy(), float(np.linalg.norm(place)) or 1.0
        for _ in range(MOST_NEWTON):
            gap, slope = self._at(found)
            step = np.linalg.lstsq(slope[:, free], gap, rcond=None)[0]
            found[free] -= step
            if np.linalg.norm(step) < ON_LINKS * size:
                break
        return found

    def free_part(self, place: np.ndarray, way: np.ndarray) -> np.ndarray:
        """The part of a direction that the links let be."""
        _, slope = self._at(place)
        return way - np.linalg.lstsq(slope, slope @ way, rcond=None)[0]

    def aside(self, place: np.ndarray) -> np.ndarray:
        """Some direction that the links let be."""
        _, slope = self._at(place)
        parts = np.eye(len(place)) - np.linalg.pinv(slope) @ slope
        return parts[np.argmax(np.linalg.norm(parts, axis=1))]
