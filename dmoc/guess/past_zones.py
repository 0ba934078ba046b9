"""Paths past the zones that stand in the way of another path."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import casadi as ca
import numpy as np

from dmoc.motion.path import DiscretePath
from dmoc.parts.constraint import Constraint
from dmoc.scene.problem import TransferProblem

# A path that was bent past one zone is bent at most this many times a zone to clear the others: two zones that
# overlap may each push it into the other.
BENDS_A_ZONE = 2
# A path that is in a zone by more than this part of the zone's size runs through it, on neither side [-].
THROUGH = 0.5
# Two paths are one way if they differ by less than this part of the extent [-].
SAME_WAY = 0.05


def ways_past(problem: TransferProblem, base: DiscretePath) -> Iterator[tuple[str, DiscretePath]]:
    """Names and paths, each bent past one zone on one of its sides."""
    for i, constraint in enumerate(problem.constraints):
        for way, bend in constraint.ways_round(base.place_of(constraint), base.fractions):
            yield f"{way} of {constraint.named(i)}", bent(problem, base, constraint, bend)


def bent(problem: TransferProblem, path: DiscretePath, zone: Constraint, bend: np.ndarray) -> DiscretePath:
    """A path with the body that a zone limits moved by a bend [m], and what links hold to it moved along."""
    moved = path.moved(bend, zone.on)
    if not problem.links:
        return moved
    # What keeps to links is loaded for problems with links alone.
    from dmoc.links.along import kept_on_links

    return replace(path, position=kept_on_links(problem, moved.position, zone.on))


def clear_ways(problem: TransferProblem, base: DiscretePath) -> list[DiscretePath]:
    """Different paths past all zones, the shortest first, and after them those that still cut a zone.

    Each begins as one of `ways_past`. What it then still cuts it passes on the side to which it was bent or, as
    another path, on the nearer side.
    """
    found: list[tuple[bool, float, DiscretePath]] = []
    extent = base.diagonal or 1.0
    for _, first in ways_past(problem, base):
        for nearer in (False, True):
            path, clear = _past_the_others(problem, base, first, nearer)
            if all(np.abs(path.place - old.place).max() > SAME_WAY * extent for _, _, old in found):
                length = float(np.linalg.norm(np.diff(path.place, axis=0), axis=1).sum())
                found.append((not clear, length, path))
    return [path for _, _, path in sorted(found, key=lambda one: one[:2])]


def _past_the_others(
    problem: TransferProblem, base: DiscretePath, first: DiscretePath, nearer: bool
) -> tuple[DiscretePath, bool]:
    """A bent path, bent again past the zones that it cuts, the deepest first; and whether it clears all."""
    path = first
    times = problem.start_time + base.duration * base.fractions
    zones = [zone for zone in problem.constraints if not zone.turns_body]
    for _ in range(BENDS_A_ZONE * len(zones)):
        places = [path.place_of(zone) for zone in zones]
        excess = zip(zones, places, strict=True)
        deep = [float(zone.excess_at(times, place, np.zeros_like(place)).max()) for zone, place in excess]
        deepest = zones[int(np.argmax(deep))]
        bends = deepest.ways_round(path.place_of(deepest), path.fractions)
        ways = [bend for _, bend in bends]
        if max(deep) <= 0 or not ways:
            return path, max(deep) <= 0
        aside = path.place_of(deepest) - base.place_of(deepest)
        worth = [-float(np.abs(bend).max()) if nearer else float((bend * aside).sum()) for bend in ways]
        path = bent(problem, path, deepest, ways[int(np.argmax(worth))])
    return path, False


def has_sides(problem: TransferProblem, path: DiscretePath) -> bool:
    """Whether a path passes zones on sides that an answer should keep to: it runs through none of them."""
    times = problem.start_time + path.duration * path.fractions
    zones = [zone for zone in problem.constraints if not (zone.turns_body or zone.limits_speed)]
    zones = [zone for zone in zones if not np.isfinite(zone.bounds(problem.dimension)).any()]
    places = [path.place_of(zone) for zone in zones]
    return bool(zones) and all(
        zone.excess_at(times, place, np.zeros_like(place)).max() <= THROUGH * zone.feature()
        for zone, place in zip(zones, places, strict=True)
    )


def off_centres(problem: TransferProblem, guess: DiscretePath) -> DiscretePath:
    """A guess moved off the middle of zones, with what links carry along it."""
    for zone in problem.constraints:
        seen = guess.place_of(zone)
        if (bend := zone.off_centre(seen, guess.fractions) - seen).any():
            guess = bent(problem, guess, zone, bend)
    if not problem.links:
        return guess
    # What links carry is loaded for problems with links alone.
    from dmoc.guess.turning import resting_load

    return replace(guess, reaction=resting_load(problem, guess))


def off_saddles(problem: TransferProblem, duration: float, place: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """The place of the goal; off one where a condition is not met and, to first order, no way leads nearer.

    Such as the centre of a circle that is to be reached. It moves along one open axis to where the condition
    is met to second order.
    """
    is_open = np.isnan(problem.goal.fixed()[0])
    t, m, q, v = ca.SX.sym("t"), ca.SX.sym("m"), ca.SX.sym("q", len(place)), ca.SX.sym("v", len(speed))
    rows = problem.goal.rows(t, q, v, m) if is_open.any() and len(place) == problem.dimension else []
    found = np.array(place)
    for row in rows:
        slope = ca.densify(ca.gradient(row.expression, ca.vertcat(q, v)))
        bend = ca.densify(ca.diag(ca.hessian(row.expression, q)[0]))
        at = ca.Function("row", [t, q, v, m], [ca.densify(row.expression), slope, bend])
        numbers = at(problem.start_time + duration, found, speed, problem.mass)
        value, slopes, bends = (part.full().ravel() for part in numbers)
        off = float(value[0] - np.clip(value[0], row.lower, row.upper))
        # A condition without a value there is told of elsewhere.
        ways = np.flatnonzero(is_open & (np.sign(off) * np.sign(bends) < 0))
        if len(ways) and not slopes.any():
            found[ways[0]] += np.sqrt(-2 * off / bends[ways[0]])
    return found
