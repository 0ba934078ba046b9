"""Paths past the zones that stand in the way of another path."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

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
        for way, bend in constraint.ways_round(base.position, base.fractions):
            yield f"{way} of {type(constraint).__name__} {i + 1}", replace(base, position=base.position + bend)


def clear_ways(problem: TransferProblem, base: DiscretePath) -> list[DiscretePath]:
    """Different paths past all zones, the shortest first, and after them those that still cut a zone.

    Each begins as one of `ways_past`. What it then still cuts it passes on the side to which it was bent or, as
    another path, on the nearer side.
    """
    found: list[tuple[bool, float, DiscretePath]] = []
    extent = float(np.linalg.norm(np.ptp(base.position, axis=0))) or 1.0
    for _, bent in ways_past(problem, base):
        for nearer in (False, True):
            path, clear = _past_the_others(problem, base, bent, nearer)
            if all(np.abs(path.position - old.position).max() > SAME_WAY * extent for _, _, old in found):
                length = float(np.linalg.norm(np.diff(path.position, axis=0), axis=1).sum())
                found.append((not clear, length, path))
    return [path for _, _, path in sorted(found, key=lambda one: one[:2])]


def _past_the_others(
    problem: TransferProblem, base: DiscretePath, bent: DiscretePath, nearer: bool
) -> tuple[DiscretePath, bool]:
    """A bent path, bent again past the zones that it cuts, the deepest first; and whether it clears all."""
    path, still = bent, np.zeros_like(bent.position)
    for _ in range(BENDS_A_ZONE * len(problem.constraints)):
        deep = [float(zone.excess(path.position, still).max()) for zone in problem.constraints]
        bends = problem.constraints[int(np.argmax(deep))].ways_round(path.position, path.fractions)
        ways = [bend for _, bend in bends]
        if max(deep) <= 0 or not ways:
            return path, max(deep) <= 0
        aside = path.position - base.position
        worth = [-float(np.abs(bend).max()) if nearer else float((bend * aside).sum()) for bend in ways]
        path = replace(path, position=path.position + ways[int(np.argmax(worth))])
    return path, False
