"""Many small functions, mapped over steps or nodes and scattered into one sparse NLP.

A block is a function of a few variables that is evaluated `count` times, each time on other columns
of the unknowns and into other rows of the constraints. The exact derivatives of one evaluation
(CasADi SX) are mapped, and one sparse product puts them at their places in the global Jacobian and
Hessian. Nothing here loops over the evaluations, and nothing here knows mechanics.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np


@dataclass(frozen=True)
class Block:
    """rows(z, d, p) and cost(z, d, p), evaluated `count` times.

    Attributes
    ----------
    variables, data, parameters : SX columns
        Local unknowns z, numbers d that differ between evaluations, parameters p of the NLP.
    rows, cost : SX
        Constraint rows (a column) and a scalar; rows with the same target are added up.
    columns : int array, shape (len(z), count)
        Which unknown each local one is; no unknown twice in one evaluation.
    targets : int array, shape (len(rows), count)
        Which constraint each row is added to.
    values : array, shape (len(d), count)
        The numbers d.
    """

    name: str
    variables: ca.SX
    data: ca.SX
    parameters: ca.SX
    rows: ca.SX
    cost: ca.SX
    columns: np.ndarray
    targets: np.ndarray
    values: np.ndarray

    @property
    def count(self) -> int:
        return self.columns.shape[1]

    def kernels(self) -> dict[str, ca.Function]:
        """One evaluation: rows, cost, and the structural nonzeros of their derivatives."""
        multipliers, weight = ca.SX.sym("lam", self.rows.numel()), ca.SX.sym("sigma")
        arguments = [self.variables, self.data, self.parameters]
        jacobian = ca.jacobian(self.rows, self.variables)
        lagrangian = weight * self.cost + ca.dot(multipliers, self.rows)
        hessian = ca.triu(ca.hessian(lagrangian, self.variables)[0])
        gradient = ca.gradient(self.cost, self.variables)
        outputs = {
            "rows": (arguments, ca.densify(self.rows)),
            "cost": (arguments, ca.densify(self.cost)),
            "gradient": (arguments, ca.densify(gradient)),
            "jacobian": (arguments, _nonzeros(jacobian)),
            "hessian": ([*arguments, multipliers, weight], _nonzeros(hessian)),
        }
        return {
            kind: ca.Function(f"{self.name}_{kind}", given, [out]) for kind, (given, out) in outputs.items()
        }

    def jacobian_entries(self) -> tuple[np.ndarray, np.ndarray]:
        """Global (row, column) of every nonzero of every evaluation, in the order the kernel gives them."""
        row, column = ca.jacobian(self.rows, self.variables).sparsity().get_triplet()
        return self.targets[row].ravel(order="F"), self.columns[column].ravel(order="F")

    def hessian_entries(self) -> tuple[np.ndarray, np.ndarray]:
        """The same for the upper triangle of the Hessian."""
        weight, multipliers = ca.SX.sym("sigma"), ca.SX.sym("lam", self.rows.numel())
        lagrangian = weight * self.cost + ca.dot(multipliers, self.rows)
        row, column = ca.triu(ca.hessian(lagrangian, self.variables)[0]).sparsity().get_triplet()
        first, second = self.columns[row].ravel(order="F"), self.columns[column].ravel(order="F")
        return np.minimum(first, second), np.maximum(first, second)


@dataclass(frozen=True)
class Assembly:
    """The functions of one NLP in scaled unknowns: x -> f, g and exact sparse derivatives.

    `objective`, `constraints`, `gradient`, `jacobian` take (x, p); `hessian` takes
    (x, p, lam_f, lam_g) and gives the upper triangle.
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


def assemble(
    blocks: Sequence[Block],
    column_scale: np.ndarray,
    row_scale: np.ndarray,
    cost_scale: float,
    parameter_count: int,
) -> Assembly:
    """Map the blocks and scatter them.

    Unknowns are `column_scale` times x, constraint i is `row_scale[i]` times its rows' sum, the
    objective `cost_scale` times the sum of the costs.
    """
    columns, rows = len(column_scale), len(row_scale)
    x, p = ca.MX.sym("x", columns), ca.MX.sym("p", parameter_count)
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", rows)
    unknowns, multipliers = ca.DM(column_scale) * x, ca.DM(row_scale) * lam_g
    pieces: dict[str, list] = {kind: [] for kind in ("rows", "cost", "gradient", "jacobian", "hessian")}
    for block in blocks:
        given = [
            ca.reshape(unknowns[_order(block.columns)], block.columns.shape[0], block.count),
            ca.DM(block.values),
            ca.repmat(p, 1, block.count),
        ]
        local = ca.reshape(multipliers[_order(block.targets)], block.targets.shape[0], block.count)
        weight = ca.repmat(cost_scale * lam_f, 1, block.count)
        for kind, kernel in block.kernels().items():
            arguments = [*given, local, weight] if kind == "hessian" else given
            # an output that is empty or structurally zero is not worth a map
            useful = kernel.numel_out(0) > 0 and not (kind in ("cost", "gradient") and block.cost.is_zero())
            pieces[kind].append(ca.vec(kernel.map(block.count)(*arguments)) if useful else None)

    g = _scatter_rows(pieces["rows"], [b.targets.ravel(order="F") for b in blocks], row_scale)
    f = cost_scale * sum((ca.sum1(piece) for piece in pieces["cost"] if piece is not None), ca.MX(0))
    slopes = _scatter_rows(
        pieces["gradient"], [b.columns.ravel(order="F") for b in blocks], cost_scale * column_scale
    )
    jacobian = _scatter_matrix(
        pieces["jacobian"], [b.jacobian_entries() for b in blocks], row_scale, column_scale
    )
    hessian = _scatter_matrix(
        pieces["hessian"], [b.hessian_entries() for b in blocks], column_scale, column_scale
    )
    return Assembly(
        x,
        p,
        f,
        g,
        ca.Function("objective", [x, p], [f]),
        ca.Function("constraints", [x, p], [g]),
        # the hooks also have f or g as an output, which Ipopt never asks for; a constant costs nothing
        ca.Function("nlp_grad_f", [x, p], [ca.MX(1, 1), slopes], ["x", "p"], ["f", "grad_f_x"]),
        ca.Function("nlp_jac_g", [x, p], [ca.MX(rows, 1), jacobian], ["x", "p"], ["g", "jac_g_x"]),
        ca.Function("nlp_hess_l", [x, p, lam_f, lam_g], [hessian], ["x", "p", "lam_f", "lam_g"], ["h"]),
    )


def _order(indices: np.ndarray) -> list:
    return indices.ravel(order="F").tolist()


def _nonzeros(matrix: ca.SX) -> ca.SX:
    return ca.vertcat(*matrix.nonzeros()) if matrix.nnz() else ca.SX(0, 1)


def _scatter(places: np.ndarray, length: int, values: np.ndarray) -> ca.DM:
    """Sparse matrix with one entry a column: entry j of a vector goes to places[j], times values[j]."""
    count = len(places)
    return ca.DM(ca.Sparsity(length, count, list(range(count + 1)), places.tolist()), values)


def _scatter_rows(pieces: list, targets: list[np.ndarray], scale: np.ndarray) -> ca.MX:
    total = ca.MX(ca.DM.zeros(len(scale)))
    for piece, target in zip(pieces, targets, strict=True):
        if piece is not None:
            total = total + _scatter(target, len(scale), scale[target]) @ piece
    return total


def _scatter_matrix(pieces, entries, row_scale: np.ndarray, column_scale: np.ndarray) -> ca.MX:
    shape = len(row_scale), len(column_scale)
    kept = [(piece, *at) for piece, at in zip(pieces, entries, strict=True) if piece is not None]
    if not kept:
        return ca.MX(*shape)
    keys = [column * shape[0] + row for _, row, column in kept]
    unique, inverse = np.unique(np.concatenate(keys), return_inverse=True)
    starts = np.searchsorted(unique // shape[0], np.arange(shape[1] + 1))
    pattern = ca.Sparsity(*shape, starts.tolist(), (unique % shape[0]).tolist())
    splits = np.split(inverse, np.cumsum([len(key) for key in keys])[:-1])
    nonzeros = ca.MX(ca.DM.zeros(len(unique)))
    for (piece, row, column), places in zip(kept, splits, strict=True):
        nonzeros = nonzeros + _scatter(places, len(unique), row_scale[row] * column_scale[column]) @ piece
    return ca.MX(pattern, nonzeros)
