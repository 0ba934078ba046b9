"""The sensitivities of a path that is known, and what measured positions along it would tell."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from dmoc.motion.mesh import node_weights
from dmoc.nlp.lesson import SENSITIVITY, SHARE, SPREAD, at_start, pairs, ways_of
from dmoc.nlp.placement import Placement
from dmoc.nlp.stencils import stencils_of

# A path along which a number moves nothing is taken to begin with as if it moved it by this part of the extent [-]:
# the logarithm of no information has no value.
LEAST = 1e-6
BEGIN = 1e-2


def sensitivities(program: Any, values: dict[str, Any], p: np.ndarray) -> dict[str, np.ndarray]:
    """Sensitivities at all nodes, shape (nodes, ways x axes), shares and spreads, of a path by its unknowns.

    The rows are linear in the sensitivities and as banded as those of motion: one factorisation has them.
    """
    problem, columns, rows = program.problem, program.columns, program.rows
    stencils = stencils_of(problem, program.scheme.order, program.hold)
    placed = Placement(problem, stencils, program.scheme, program.hold, program.mesh, program.units)
    group, targets = columns[SENSITIVITY], rows[SENSITIVITY]
    s = np.zeros((group.count, len(group.labels)))
    s[0] = at_start(problem)
    whole = dict(values) | {SENSITIVITY: s}
    whole |= {name: np.zeros(len(columns[name].labels)) for name in (SHARE, SPREAD)}
    x = np.concatenate([np.ravel(whole[one.name]) for one in columns.groups])
    left, entries = np.zeros(rows.size), []
    for block in placed.blocks:
        known, used = block.kernel.used
        given = x[block.columns], block.values[known], np.tile(p[np.array(used, int)][:, None], block.count)
        np.add.at(left, block.targets, block.kernel.functions["rows"](*given).full())
        row, column = map(np.array, block.kernel.jacobian.get_triplet())
        slopes = block.kernel.functions["jacobian"](*given).full()
        entries.append((slopes.ravel(), block.targets[row].ravel(), block.columns[column].ravel()))
    slopes, row, column = (np.concatenate(side) for side in zip(*entries, strict=True))
    size = len(group.labels)
    down, across = row - targets.start, column - group.start - size
    mine = (down >= 0) & (down < targets.stop - targets.start - size) & (across >= 0) & (column < group.stop)
    count = size * (group.count - 1)
    matrix = sparse.coo_matrix((slopes[mine], (down[mine], across[mine])), shape=(count, count)).tocsc()
    try:
        found = splu(matrix).solve(-left[targets.start : targets.start + count])
    except RuntimeError:
        found = np.zeros(count)
    s[1:] = np.where(np.isfinite(found), found, 0.0).reshape(-1, size)
    shares, spreads = _regressed(program, s)
    length = program.units.length
    return {SENSITIVITY: s, SHARE: shares, SPREAD: np.where(spreads < LEAST * length, BEGIN * length, spreads)}


def fisher(program: Any, path: Any) -> np.ndarray:
    """The mean products of the sensitivities of a path to the start and to the numbers, a symmetric matrix."""
    x = program.pack(path) * program.columns.scales()
    return gram_of(program, program.columns[SENSITIVITY].of(x))


def gram_of(program: Any, s: np.ndarray) -> np.ndarray:
    """The mean products of sensitivities along the path, a symmetric matrix."""
    table = s.reshape(len(s), len(ways_of(program.problem)), -1)
    return np.einsum("k,kia,kja->ij", node_weights(program.mesh, program.scheme), table, table)


def _regressed(program: Any, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The shares of the ways before it in the sensitivity to each number, and the size of what is left [m]."""
    gram, first = gram_of(program, s), 2 * program.problem.dimension
    shares, spreads = np.zeros(len(pairs(program.problem))), []
    for k in range(first, len(gram)):
        share = np.linalg.lstsq(gram[:k, :k], gram[:k, k], rcond=None)[0]
        shares[[i for i, (own, _) in enumerate(pairs(program.problem)) if own == k]] = share
        spreads.append(np.sqrt(max(gram[k, k] - gram[:k, k] @ share, 0.0)))
    return shares, np.array(spreads)
