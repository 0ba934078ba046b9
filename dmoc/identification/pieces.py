"""Small functions with their first derivatives, evaluated many times and scattered into sparse matrices."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy import sparse

from dmoc.basics.memory import Shelf
from dmoc.basics.numerics import nonzeros_of

# So many functions are held in this process: flights of one kind share them.
_FUNCTIONS = Shelf(60)


@dataclass(frozen=True)
class Piece:
    """A function of some unknowns, evaluated `count` times, and where unknowns and results stand.

    Attributes
    ----------
    functions : pair of Function
        (unknowns, numbers) of all evaluations -> results; and beside them structural nonzeros of the Jacobian.
    pattern : tuple of arrays
        Row and column of each nonzero.
    columns : int array, shape (unknowns, count)
    targets : int array, shape (results, count)
        Results of one place are added up.
    numbers : array, shape (numbers, count)
    """

    functions: tuple[ca.Function, ca.Function]
    pattern: tuple[np.ndarray, np.ndarray]
    columns: np.ndarray
    targets: np.ndarray
    numbers: np.ndarray

    @property
    def results(self) -> int:
        """How many results an evaluation has."""
        return len(self.targets)

    def values(self, x: np.ndarray) -> np.ndarray:
        """Results, one column an evaluation."""
        return self.functions[0](x[self.columns], self.numbers).full()

    def at(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Results and nonzeros of the Jacobian, one column an evaluation."""
        values, slopes = self.functions[1](x[self.columns], self.numbers)
        return values.full(), slopes.full()


def made(
    key: tuple, count: int, write: Callable[[], tuple[Sequence[ca.SX], Sequence[ca.SX], ca.SX]]
) -> tuple[tuple[ca.Function, ca.Function], tuple[np.ndarray, np.ndarray]]:
    """The functions of a piece and its pattern; `write` gives its unknowns, its numbers and its results.

    `key` must tell it from all others; objects in it are held, so that no other gets their identity.
    """

    def make() -> tuple:
        unknowns, numbers, results = write()
        z, d, r = ca.vertcat(*unknowns), ca.vertcat(*numbers), ca.densify(ca.SX(results))
        slopes = ca.jacobian(r, z)
        row, column = slopes.sparsity().get_triplet()
        outputs = [r], [r, nonzeros_of(slopes)]
        functions = tuple(ca.Function("piece", [z, d], each).map(count) for each in outputs)
        return functions, (np.array(row, int), np.array(column, int)), key

    name = tuple(part if isinstance(part, (str, int, bytes, float, tuple)) else id(part) for part in key)
    return _FUNCTIONS.get((*name, count), make)[:2]


def values(pieces: Sequence[Piece], x: np.ndarray, count: int) -> np.ndarray:
    """The results of all pieces."""
    total = np.zeros(count)
    for piece in pieces:
        np.add.at(total, piece.targets, piece.values(x))
    return total


def summed(pieces: Sequence[Piece], x: np.ndarray, count: int) -> tuple[np.ndarray, sparse.csr_matrix]:
    """The results of all pieces, and their Jacobian."""
    total, parts = np.zeros(count), []
    for piece in pieces:
        values, slopes = piece.at(x)
        np.add.at(total, piece.targets, values)
        row, column = piece.pattern
        if len(row):
            parts.append((slopes.ravel(), piece.targets[row].ravel(), piece.columns[column].ravel()))
    if not parts:
        return total, sparse.csr_matrix((count, len(x)))
    values, rows, columns = (np.concatenate(side) for side in zip(*parts, strict=True))
    return total, sparse.coo_matrix((values, (rows, columns)), shape=(count, len(x))).tocsr()
