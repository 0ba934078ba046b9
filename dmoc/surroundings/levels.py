"""Surfaces in space on which a function changes its sign, as triangles."""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations

import numpy as np

# Along the longest side of a box the function is asked at so many places, along any at this many at least.
PLACES, FEWEST = 41, 9
# An edge of the grid is halved so often until the place of the sign is known: to a thousandth of it.
HALVINGS = 10
# A cube is cut into six tetrahedra along its diagonal: the corners of each, as steps along the axes.
TETRAHEDRA = [
    np.cumsum([np.zeros(3, int), *np.eye(3, dtype=int)[list(way)]], axis=0) for way in permutations(range(3))
]
# By how many corners of a tetrahedron are inside, listed first: the edges on which triangles have corners.
TRIANGLES = {
    1: (((0, 1), (0, 2), (0, 3)),),
    2: (((0, 2), (0, 3), (1, 3)), ((0, 2), (1, 3), (1, 2))),
    3: (((3, 0), (3, 1), (3, 2)),),
}


def level_surface(
    values: Callable[[np.ndarray], np.ndarray], low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The surface in a box behind which a function is positive, by marching tetrahedra.

    Doi and Koide, IEICE Transactions E74 (1991). The function need not be smooth, nor have a sign on the other
    side: each crossing of an edge is found by halving.

    Parameters
    ----------
    values : function of places, shape (count, 3), with values of shape (count,)
    low, high : arrays, shape (3,)
        Corners of the box.

    Returns
    -------
    places : array, shape (count, 3)
    triangles : array of int, shape (triangles, 3)
        The corners of each triangle among the places; none where the function has one sign in all of the box.
    """
    sides = high - low
    counts = np.maximum(np.ceil(PLACES * sides / sides.max()).astype(int), FEWEST)
    marks = [np.linspace(a, b, count) for a, b, count in zip(low, high, counts, strict=True)]
    grid = np.stack(np.meshgrid(*marks, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = np.asarray(values(grid)) > 0
    edges = _edges(inside, counts)
    known, which = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    within = np.where(inside[known[:, 0]], known[:, 0], known[:, 1])
    outside = known.sum(axis=1) - within
    near, far = grid[within], grid[outside]
    for _ in range(HALVINGS if len(known) else 0):
        middle = 0.5 * (near + far)
        holds = (np.asarray(values(middle)) > 0)[:, None]
        near, far = np.where(holds, middle, near), np.where(holds, far, middle)
    return 0.5 * (near + far), which.reshape(-1, 3)


def _edges(inside: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """The edges of the grid on which triangles have their corners, three after another, as pairs of places."""
    corners = np.stack(np.meshgrid(*[np.arange(count - 1) for count in counts], indexing="ij"), axis=-1)
    strides = np.array([counts[1] * counts[2], counts[2], 1])
    cubes = corners.reshape(-1, 3) @ strides
    found = [np.empty((0, 2), int)]
    for steps in TETRAHEDRA:
        ends = cubes[:, None] + steps @ strides
        some = inside[ends]
        for count, triangles in TRIANGLES.items():
            cut = some.sum(axis=1) == count
            first = np.argsort(~some[cut], axis=1, kind="stable")
            ordered = np.take_along_axis(ends[cut], first, axis=1)
            found += [ordered[:, np.array(triangle)].reshape(-1, 2) for triangle in triangles]
    return np.concatenate(found)
