"""Paths that keep to links: how a guess gets from one place to another where the straight line breaks them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

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


def along_links(links: Sequence[Any], start: np.ndarray, goal: np.ndarray, fractions: np.ndarray) -> np.ndarray:
    """Places at fractions of the way from `start` to `goal` that keep to the links, shape (count, dimension).

    From each place the path goes on towards the goal as far as the links let it, at an even pace. Entries of
    the goal that are NaN are free.
    """
    on = _OnLinks(links, len(start))
    aim = on.put(np.where(np.isnan(goal), start, goal), ~np.isnan(goal))
    distance = float(np.linalg.norm(aim - start))
    if distance == 0.0:
        return np.tile(start, (len(fractions), 1))
    places, piece = [start], PIECE * distance
    ahead = np.zeros(len(start))
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
    found = np.stack([np.interp(fractions * way[-1], way, column) for column in path.T], axis=1)
    return np.array([on.put(place) for place in found])


class _OnLinks:
    """Links as functions of the place."""

    def __init__(self, links: Sequence[Any], dimension: int):
        q = ca.SX.sym("q", dimension)
        g = ca.vertcat(*[link.g(q) for link in links])
        self.function = ca.Function("links", [q], [ca.densify(g), ca.densify(ca.jacobian(g, q))])

    def _at(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        gap, slope = self.function(place)
        return gap.full().ravel(), slope.full()

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
