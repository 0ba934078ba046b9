"""What an NLP is put together from: small functions, the places that they are mapped to, and what they make.

A block is a function of a few variables that is evaluated `count` times, each time on other columns
of the unknowns and into other rows of the constraints. Nothing here knows mechanics.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from dmoc.assembly.kernel import Kernel
from dmoc.basics.records import dataclass


@dataclass(frozen=True)
class Block:
    """A kernel that is evaluated `count` times.

    Attributes
    ----------
    columns : int array, shape (len(z), count)
        Which unknown each local one is; no unknown twice in one evaluation.
    targets : int array, shape (len(rows), count)
        Which constraint each row is added to; rows with the same target are added up.
    values : array, shape (len(d), count)
        The numbers d.
    first : int
        Where the parameters of its kernel begin among those of the NLP.
    """

    kernel: Kernel
    columns: np.ndarray
    targets: np.ndarray
    values: np.ndarray
    first: int = 0

    @property
    def count(self) -> int:
        return self.columns.shape[1]

    def moved(self, columns: int, rows: int, parameters: int) -> Block:
        """The block behind others: so many unknowns, rows and parameters come before its own."""
        places = self.columns + columns, self.targets + rows
        return Block(self.kernel, *places, self.values, self.first + parameters)


@dataclass(frozen=True)
class Scaling:
    """The numbers that depend on units and mesh, beside the blocks.

    Unknowns are `columns` times x, row i is `rows[i]` times the sum of what blocks add to it, the objective is
    `cost` times the sum of the costs; `values` are the numbers d of each block.
    """

    columns: np.ndarray
    rows: np.ndarray
    cost: float
    values: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, blocks: Sequence[Block], columns: np.ndarray, rows: np.ndarray, cost: float) -> Scaling:
        return cls(columns, rows, cost, tuple(block.values[block.kernel.used[0]] for block in blocks))


@dataclass(frozen=True)
class Assembly:
    """The functions of one NLP in scaled unknowns: x -> f, g and exact sparse derivatives.

    `objective`, `constraints`, `gradient`, `jacobian` take (x, p); `hessian` takes (x, p, lam_f, lam_g) and
    gives the upper triangle. Where `parametric`, p ends with what `numbers` gives for a scaling: units and mesh
    may then be others. `solvers` are those that were made for it.
    """

    x: ca.MX
    p: ca.MX
    f: ca.MX
    g: ca.MX
    objective: ca.Function
    constraints: ca.Function
    gradient: ca.Function
    jacobian: ca.Function
    hessian: ca.Function
    parametric: bool = False
    solvers: dict[Any, Any] = field(default_factory=dict, init=False, compare=False, repr=False)

    def numbers(self, scaling: Scaling) -> np.ndarray:
        """The last entries of p for other units or another mesh; none where these are constants."""
        if not self.parametric:
            return np.empty(0)
        pairs = zip((scaling.rows, scaling.columns), self._entries, strict=True)
        products = [side[row] * scaling.columns[column] for side, (row, column) in pairs]
        values = [given.ravel(order="F") for given in scaling.values]
        return np.concatenate([scaling.columns, scaling.rows, [scaling.cost], *values, *products])

    @cached_property
    def _entries(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Rows and columns of the entries of Jacobian and Hessian."""
        patterns = self.jacobian.sparsity_out(1), self.hessian.sparsity_out(0)
        return [(np.array(pattern.row(), int), np.array(pattern.get_col(), int)) for pattern in patterns]

    @cached_property
    def leaning(self) -> Assembly:
        """The same NLP whose objective has half the weighted sum of squares of x - place as a further term.

        The entries of place, then the weights, stand behind the other parameters.
        """
        x, size = self.x, self.x.numel()
        place, weight = ca.MX.sym("place", size), ca.MX.sym("weight", size)
        p, away = ca.vertcat(self.p, place, weight), x - place
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", self.g.numel())
        slopes = self.gradient(x, self.p)[1] + weight * away
        hessian = self.hessian(x, self.p, lam_f, lam_g) + lam_f * ca.diag(weight)
        f = self.f + 0.5 * ca.dot(weight * away, away)
        jacobian = [ca.MX(*self.g.shape), self.jacobian(x, self.p)[1]]
        return replace(
            self,
            p=p,
            f=f,
            objective=ca.Function("objective", [x, p], [f]),
            constraints=ca.Function("constraints", [x, p], [self.g]),
            gradient=ca.Function("nlp_grad_f", [x, p], [ca.MX(1, 1), slopes], ["x", "p"], ["f", "grad_f_x"]),
            jacobian=ca.Function("nlp_jac_g", [x, p], jacobian, ["x", "p"], ["g", "jac_g_x"]),
            hessian=ca.Function(
                "nlp_hess_l", [x, p, lam_f, lam_g], [hessian], ["x", "p", "lam_f", "lam_g"], ["h"]
            ),
        )


def places_of(block: Block, kind: str, rows: int, columns: int) -> np.ndarray:
    """Where the results belong: unknowns, rows or, in a matrix, column * rows + row of every nonzero."""
    if kind == "jacobian":
        row, column = block.kernel.jacobian.get_triplet()
        return block.columns[column] * rows + block.targets[row]
    if kind == "hessian":
        row, column = block.kernel.hessian.get_triplet()
        first, second = block.columns[row], block.columns[column]
        # the upper triangle
        return np.maximum(first, second) * columns + np.minimum(first, second)
    return {"rows": block.targets, "gradient": block.columns, "cost": np.zeros((1, block.count), int)}[kind]


def pattern_of(places: np.ndarray, rows: int, columns: int) -> tuple[ca.Sparsity, np.ndarray, np.ndarray]:
    """The pattern of a matrix by its increasing places, column * rows + row, then row and column of each."""
    column, row = np.divmod(places, rows)
    begins = np.searchsorted(column, np.arange(columns + 1))
    return ca.Sparsity(rows, columns, begins.tolist(), row.tolist()), row, column


@dataclass(frozen=True)
class Sums:
    """Entries of which those with the same of `size` places are added up."""

    places: np.ndarray
    size: int

    def of(self, entries: np.ndarray) -> np.ndarray:
        """The sums, shape (size,)."""
        return np.bincount(self.places, entries, self.size)

    @classmethod
    def in_matrix(
        cls, places: np.ndarray, rows: int, columns: int
    ) -> tuple[Sums, ca.Sparsity, np.ndarray, np.ndarray]:
        """Those that make the nonzeros of a matrix, its pattern, and row and column of each nonzero."""
        order = np.argsort(places, kind="stable")
        known = places[order]
        first = np.diff(known, prepend=-1) > 0
        nonzeros = np.empty(len(places), np.int32)
        nonzeros[order] = np.cumsum(first) - 1
        return cls(nonzeros, int(first.sum())), *pattern_of(known[first], rows, columns)
