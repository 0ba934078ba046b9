"""Paths past the zones that stand in the way of another path."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dmoc.motion.path import DiscretePath
from dmoc.scene.problem import TransferProblem

# A path that was bent past one zone is bent at most this many times a zone to clear the others: two zones that
# overlap may each push it into the other.
BENDS_A_ZONE = 2
# Two paths are one way if they differ by less than this part of the extent [-].
SAME_WAY = 0.05


def ways_past(problem: TransferProblem, base: DiscretePath) -> Iterator[tuple[str, DiscretePath]]:
    """Names and paths, each bent past one zone on one of its sides."""
    for i, constraint in enumerate(problem.constraints):
        for way, bend in constraint.ways_round(base.place_of(constraint), base.fractions):
            yield f"{way} of {type(constraint).__name__} {i + 1}", base.moved(bend)


def clear_ways(problem: TransferProblem, base: DiscretePath) -> list[DiscretePath]:
    """Different paths past all zones, the shortest first, and after them those that still cut a zone.

    Each begins as one of `ways_past`. What it then still cuts it passes on the side to which it was bent or, as
    another path, on the nearer side.
    """
    found: list[tuple[bool, float, DiscretePath]] = []
    extent = base.diagonal or 1.0
    for _, bent in ways_past(problem, base):
        for nearer in (False, True):
            path, clear = _past_the_others(problem, base, bent, nearer)
            if all(np.abs(path.place - old.place).max() > SAME_WAY * extent for _, _, old in found):
                length = float(np.linalg.norm(np.diff(path.place, axis=0), axis=1).sum())
                found.append((not clear, length, path))
    return [path for _, _, path in sorted(found, key=lambda one: one[:2])]


def _past_the_others(
    problem: TransferProblem, base: DiscretePath, bent: DiscretePath, nearer: bool
) -> tuple[DiscretePath, bool]:
    """A bent path, bent again past the zones that it cuts, the deepest first; and whether it clears all."""
    path, still = bent, np.zeros_like(bent.place)
    times = problem.start_time + base.duration * base.fractions
    zones = [zone for zone in problem.constraints if not zone.turns_body]
    for _ in range(BENDS_A_ZONE * len(zones)):
        deep = [float(zone.excess_at(times, path.place_of(zone), still).max()) for zone in zones]
        deepest = zones[int(np.argmax(deep))]
        bends = deepest.ways_round(path.place_of(deepest), path.fractions)
        ways = [bend for _, bend in bends]
        if max(deep) <= 0 or not ways:
            return path, max(deep) <= 0
        aside = path.place - base.place
        worth = [-float(np.abs(bend).max()) if nearer else float((bend * aside).sum()) for bend in ways]
        path = path.moved(ways[int(np.argmax(worth))])
    return path, False
