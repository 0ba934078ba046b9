"""Many small functions, mapped over steps or nodes and scattered into one sparse NLP.

A block is a function of a few variables that is evaluated `count` times, each time on other columns
of the unknowns and into other rows of the constraints. The exact derivatives of one evaluation
(CasADi SX) are mapped, and one sparse product puts them at their places in the global Jacobian and
Hessian. Nothing here loops over the evaluations, and nothing here knows mechanics.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import casadi as ca
import numpy as np

from dmoc.compiled import compiled

# How many entries that belong to one place are picked one by one; more are added up as a whole.
MOST_PICKED = 8


@dataclass(frozen=True)
class Kernel:
    """rows(z, d, p) and cost(z, d, p) of one evaluation, with their exact derivatives; see `kernel`.

    Attributes
    ----------
    functions : dict of Function
        "rows", "cost", "gradient" of the cost and the structural nonzeros of "jacobian" and "hessian".
    jacobian, hessian : Sparsity
        Of the rows, and of the upper triangle of weight cost + multipliers . rows.
    costly : bool
        Whether there is a cost at all.
    slope : Function
        (z, d, p, multipliers, weight) -> gradient of weight cost + multipliers . rows, the rows, the cost.
    """

    name: str
    functions: dict[str, ca.Function]
    jacobian: ca.Sparsity
    hessian: ca.Sparsity
    costly: bool
    slope: ca.Function

    @cached_property
    def compiled(self) -> dict[str, ca.Function]:
        """The functions as machine code where that can be had."""
        return compiled(self.functions)

    def __reduce__(self) -> tuple:
        # machine code stays where it is
        return Kernel, tuple(getattr(self, field.name) for field in fields(self))


def kernel(name: str, variables: ca.SX, data: ca.SX, parameters: ca.SX, rows: ca.SX, cost: ca.SX) -> Kernel:
    """The kernel of rows (a column) and a cost (a scalar).

    They are expressions of local unknowns z, numbers d that differ between evaluations and the
    parameters p of the NLP, each a column of symbols.
    """
    multipliers, weight = ca.SX.sym("lam", rows.numel()), ca.SX.sym("sigma")
    hessian, slope = ca.hessian(weight * cost + ca.dot(multipliers, rows), variables)
    jacobian, hessian = ca.jacobian(rows, variables), ca.triu(hessian)
    arguments = [variables, data, parameters]
    dual = [*arguments, multipliers, weight]
    outputs = {
        "rows": (arguments, ca.densify(rows)),
        "cost": (arguments, ca.densify(cost)),
        "gradient": (arguments, ca.densify(ca.gradient(cost, variables))),
        "jacobian": (arguments, _nonzeros(jacobian)),
        "hessian": (dual, _nonzeros(hessian)),
    }
    return Kernel(
        name,
        {kind: ca.Function(f"{name}_{kind}", given, [out]) for kind, (given, out) in outputs.items()},
        jacobian.sparsity(),
        hessian.sparsity(),
        not cost.is_zero(),
        ca.Function(name, dual, [ca.densify(part) for part in (slope, rows, cost)]),
    )


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
    """

    kernel: Kernel
    columns: np.ndarray
    targets: np.ndarray
    values: np.ndarray

    @property
    def count(self) -> int:
        return self.columns.shape[1]


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
    compiled: bool = False,
) -> Assembly:
    """Map the blocks and scatter them.

    Unknowns are `column_scale` times x, constraint i is `row_scale[i]` times its rows' sum, the
    objective `cost_scale` times the sum of the costs. With `compiled` the kernels are machine code.
    """
    columns, rows = len(column_scale), len(row_scale)
    x, p = ca.MX.sym("x", columns), ca.MX.sym("p", parameter_count)
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", rows)
    unknowns, multipliers, weight = x * column_scale, lam_g * row_scale, cost_scale * lam_f
    pieces: dict[str, list] = {kind: [] for kind in ("rows", "cost", "gradient", "jacobian", "hessian")}
    for block in blocks:
        given = [_columns(unknowns, block.columns), ca.DM(block.values), ca.repmat(p, 1, block.count)]
        local = [_columns(multipliers, block.targets), ca.repmat(weight, 1, block.count)]
        places = {
            "rows": block.targets,
            "cost": np.zeros((1, block.count), int),
            "gradient": block.columns,
            "jacobian": _jacobian_places(block, rows),
            "hessian": _hessian_places(block, columns),
        }
        functions = block.kernel.compiled if compiled else block.kernel.functions
        for kind, function in functions.items():
            # an output that is empty or structurally zero is not worth a map
            if function.numel_out(0) == 0 or (kind in ("cost", "gradient") and not block.kernel.costly):
                continue
            found = function.map(block.count)(*given, *(local if kind == "hessian" else ()))
            pieces[kind].append((found, places[kind]))

    f = cost_scale * sum((ca.sum2(piece) for piece, _ in pieces["cost"]), ca.MX(0))
    g = _summed(pieces["rows"], row_scale)
    slopes = _summed(pieces["gradient"], cost_scale * column_scale)
    jacobian = _matrix(pieces["jacobian"], row_scale, column_scale)
    hessian = _matrix(pieces["hessian"], column_scale, column_scale)
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


def _nonzeros(matrix: ca.SX) -> ca.SX:
    return ca.vertcat(*matrix.nonzeros()) if matrix.nnz() else ca.SX(0, 1)


def _columns(vector: ca.MX, places: np.ndarray) -> ca.MX:
    """The entries of a vector at places, as a matrix of the same shape."""
    return ca.reshape(vector[places.ravel(order="F").tolist()], *places.shape)


def _jacobian_places(block: Block, rows: int) -> np.ndarray:
    """Global place, column * rows + row, of every nonzero of every evaluation."""
    row, column = block.kernel.jacobian.get_triplet()
    return block.columns[column] * rows + block.targets[row]


def _hessian_places(block: Block, columns: int) -> np.ndarray:
    """The same for the upper triangle of the Hessian."""
    row, column = block.kernel.hessian.get_triplet()
    first, second = block.columns[row], block.columns[column]
    return np.maximum(first, second) * columns + np.minimum(first, second)


def _summed(pieces: Sequence[tuple[ca.MX, np.ndarray]], scale: np.ndarray) -> ca.MX:
    """A vector whose entry i is scale_i times the sum of all entries of the pieces whose place is i."""
    if not pieces:
        return ca.MX(ca.DM.zeros(len(scale)))
    places = np.concatenate([place.ravel(order="F") for _, place in pieces])
    counts = np.bincount(places, minlength=len(scale))
    return _picked(pieces, np.argsort(places, kind="stable"), np.cumsum(counts) - counts, counts) * scale


def _matrix(pieces: Sequence[tuple[ca.MX, np.ndarray]], row_scale: np.ndarray, column_scale: np.ndarray) -> ca.MX:
    """The same for the nonzeros of a matrix, whose places are column * rows + row, with both their scales."""
    rows, columns = len(row_scale), len(column_scale)
    if not pieces:
        return ca.MX(rows, columns)
    keys = np.concatenate([place.ravel(order="F") for _, place in pieces])
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    starts = np.flatnonzero(np.diff(keys, prepend=-1))
    column, row = np.divmod(keys[starts], rows)
    begins = np.searchsorted(column, np.arange(columns + 1))
    pattern = ca.Sparsity(rows, columns, begins.tolist(), row.tolist())
    picked = _picked(pieces, order, starts, np.diff(starts, append=len(keys)))
    return ca.MX(pattern, picked * (row_scale[row] * column_scale[column]))


def _picked(pieces: Sequence[tuple], order: np.ndarray, starts: np.ndarray, counts: np.ndarray) -> ca.MX:
    """Sums of the entries order[starts_i], order[starts_i + 1], .. of the pieces, counts_i of them.

    Entries are picked, not multiplied by a matrix of ones: that takes a tenth of the time to build.
    """
    # one entry more, which is zero, stands where there is nothing to add
    values, nothing = ca.vertcat(*[ca.vec(piece) for piece, _ in pieces], 0), len(order)
    total = ca.MX(0)
    for turn in range(min(counts.max(), MOST_PICKED)):
        some = counts > turn
        picked = np.full(len(counts), nothing)
        picked[some] = order[starts[some] + turn]
        total = total + values[picked.tolist()]
    # an unknown that is in every step, as a free duration is
    for place in np.flatnonzero(counts > MOST_PICKED):
        begin, end = starts[place] + MOST_PICKED, starts[place] + counts[place]
        total[int(place)] += ca.sum1(values[order[begin:end].tolist()])
    return total
