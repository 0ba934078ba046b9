"""Many small functions, mapped over steps or nodes and scattered into one sparse NLP.

A block is a function of a few variables that is evaluated `count` times, each time on other columns
of the unknowns and into other rows of the constraints. The exact derivatives of one evaluation
(CasADi SX) are mapped, and picked to their places in the global Jacobian and Hessian. Nothing here loops
over the evaluations, and nothing here knows mechanics.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np

from dmoc.basics.compiled import compiled
from dmoc.basics.numerics import chained, nonzeros_of, used_in

# Sums of at most this many entries are made by picking one entry after the other; the rest of a longer one, as
# for a free duration that is in every step, is added up at once.
MOST_PICKED = 8
# A vector whose runs of equal numbers are at least this long on average is put together from one number a run:
# that saves time in the build.
LEAST_RUN = 100


@dataclass(frozen=True)
class Kernel:
    """rows(z, d, p) and cost(z, d, p) of one evaluation, with their exact derivatives; see `kernel`.

    Attributes
    ----------
    functions : dict of Function
        "rows", "cost", "gradient" of the cost and the structural nonzeros of "jacobian" and "hessian". They
        take z and those d and p that rows and cost depend on; "hessian" also takes multipliers and weight.
    used : lists of int
        Indices of those d and of those p.
    jacobian, hessian : Sparsity
        Of the rows, and of the upper triangle of weight cost + multipliers . rows.
    costly : bool
        Whether there is a cost at all.
    slope : Function
        (z, d, p, multipliers, weight) -> gradient of weight cost + multipliers . rows, the rows, the cost.
    """

    name: str
    functions: dict[str, ca.Function]
    used: tuple[list[int], list[int]]
    jacobian: ca.Sparsity
    hessian: ca.Sparsity
    costly: bool
    slope: ca.Function

    @cached_property
    def compiled(self) -> dict[str, ca.Function]:
        """The functions as machine code where that can be had."""
        return compiled(self.functions)


def kernel(
    name: str,
    variables: ca.SX,
    data: ca.SX,
    parameters: ca.SX,
    rows: ca.SX,
    cost: ca.SX,
    between: tuple[ca.SX, ca.SX] | None = None,
) -> Kernel:
    """The kernel of rows (a column) and a cost (a scalar).

    They are expressions of local unknowns z, numbers d that differ between evaluations and the
    parameters p of the NLP, each a column of symbols. `between` are symbols in them and the expressions of z, d
    and p that these stand for: derivatives are made by the chain rule in them, which takes fewer instructions
    where rows depend on few of them at a time.
    """
    multipliers, weight = ca.SX.sym("lam", rows.numel()), ca.SX.sym("sigma")
    total = weight * cost + ca.dot(multipliers, rows)
    if between is None:
        hessian, slope = ca.hessian(total, variables)
        jacobian, hessian = ca.jacobian(rows, variables), ca.triu(hessian)
    else:
        jacobian, hessian, slope = chained(rows, total, variables, *between)
        rows, cost = ca.substitute([rows, cost], [between[0]], [between[1]])
    outputs = {
        "rows": ca.densify(rows),
        "cost": ca.densify(cost),
        "gradient": ca.densify(ca.gradient(cost, variables)),
        "jacobian": nonzeros_of(jacobian),
        "hessian": nonzeros_of(hessian),
    }
    used = used_in(data, rows, cost), used_in(parameters, rows, cost)
    arguments = [variables, data[used[0]], parameters[used[1]]]
    dual = [*arguments, multipliers, weight]
    functions = {
        kind: ca.Function(f"{name}_{kind}", dual if kind == "hessian" else arguments, [result])
        for kind, result in outputs.items()
    }
    slope = ca.Function(name, dual, [ca.densify(part) for part in (slope, rows, cost)])
    return Kernel(name, functions, used, jacobian.sparsity(), hessian.sparsity(), not cost.is_zero(), slope)


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

    def leaning(self, place: np.ndarray, weight: np.ndarray) -> Assembly:
        """The same NLP whose objective has half the weighted sum of squares of x - place as a further term."""
        x, p, away, sparse = self.x, self.p, self.x - place, ca.sparsify(ca.DM(weight))
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", self.g.numel())
        slopes = self.gradient(x, p)[1] + sparse * away
        hessian = self.hessian(x, p, lam_f, lam_g) + lam_f * ca.diag(sparse)
        return replace(
            self,
            f=self.f + 0.5 * ca.dot(sparse * away, away),
            gradient=ca.Function("nlp_grad_f", [x, p], [ca.MX(1, 1), slopes], ["x", "p"], ["f", "grad_f_x"]),
            hessian=ca.Function(
                "nlp_hess_l", [x, p, lam_f, lam_g], [hessian], ["x", "p", "lam_f", "lam_g"], ["h"]
            ),
        )


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
    x, parameters = ca.MX.sym("x", columns), ca.MX.sym("p", parameter_count)
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", rows)
    scaled, multipliers = x * _constant(column_scale), lam_g * _constant(row_scale)
    vectors = scaled, parameters, multipliers, cost_scale * lam_f
    pieces: dict[str, list] = {kind: [] for kind in ("rows", "cost", "gradient", "jacobian", "hessian")}
    for block in blocks:
        for kind, piece in _evaluated(block, *vectors, compiled):
            pieces[kind].append((piece, _places(block, kind, rows, columns)))

    f = cost_scale * sum((ca.sum2(piece) for piece, _ in pieces["cost"]), ca.MX(0))
    g = _summed(pieces["rows"], row_scale)
    slopes = _summed(pieces["gradient"], cost_scale * column_scale)
    jacobian = _matrix(pieces["jacobian"], row_scale, column_scale)
    hessian = _matrix(pieces["hessian"], column_scale, column_scale)
    given = [x, parameters]
    return Assembly(
        x,
        parameters,
        f,
        g,
        ca.Function("objective", given, [f]),
        ca.Function("constraints", given, [g]),
        # CasADi wants f or g as a further output of these functions. Ipopt never asks for it, so a constant
        # that costs nothing stands there.
        ca.Function("nlp_grad_f", given, [ca.MX(1, 1), slopes], ["x", "p"], ["f", "grad_f_x"]),
        ca.Function("nlp_jac_g", given, [ca.MX(rows, 1), jacobian], ["x", "p"], ["g", "jac_g_x"]),
        ca.Function("nlp_hess_l", [*given, lam_f, lam_g], [hessian], ["x", "p", "lam_f", "lam_g"], ["h"]),
    )


def _constant(values: np.ndarray) -> ca.MX:
    """Numbers as a vector, put together from few pieces where there are long runs of equal numbers."""
    starts = np.flatnonzero(np.diff(values, prepend=np.nan))
    if len(starts) > len(values) / LEAST_RUN:
        return ca.MX(ca.DM(values))
    lengths = np.diff(starts, append=len(values)).tolist()
    runs = zip(lengths, values[starts].tolist(), strict=True)
    return ca.vertcat(*[ca.MX(ca.Sparsity.dense(length, 1), value) for length, value in runs])


def _columns(vector: ca.MX, places: np.ndarray) -> ca.MX:
    """The entries of a vector at places, as a matrix of the same shape."""
    return ca.reshape(vector[places.ravel(order="F").tolist()], *places.shape)


def _evaluated(
    block: Block, unknowns: ca.MX, parameters: ca.MX, multipliers: ca.MX, weight: ca.MX, compiled: bool
) -> Iterator[tuple[str, ca.MX]]:
    """Kind and value of every result of a block that is not zero by its structure, one column an evaluation."""
    kernel, count = block.kernel, block.count
    d, used = kernel.used
    p = [block.first + place for place in used]
    given = [_columns(unknowns, block.columns), ca.DM(block.values[d]), ca.repmat(parameters[p], 1, count)]
    dual = [_columns(multipliers, block.targets), ca.repmat(weight, 1, count)]
    for kind, function in (kernel.compiled if compiled else kernel.functions).items():
        if function.numel_out(0) and (kernel.costly or kind not in ("cost", "gradient")):
            yield kind, function.map(count)(*given, *(dual if kind == "hessian" else ()))


def _places(block: Block, kind: str, rows: int, columns: int) -> np.ndarray:
    """Where the results belong: unknowns, rows or, in a matrix, column * rows + row of every nonzero."""
    if kind == "jacobian":
        row, column = block.kernel.jacobian.get_triplet()
        return block.columns[column] * rows + block.targets[row]
    if kind == "hessian":
        row, column = block.kernel.hessian.get_triplet()
        first, second = block.columns[row], block.columns[column]
        # the upper triangle
        return np.maximum(first, second) * columns + np.minimum(first, second)
    return {"rows": block.targets, "gradient": block.columns, "cost": np.empty(0)}[kind]


def _summed(pieces: Sequence[tuple[ca.MX, np.ndarray]], scale: np.ndarray) -> ca.MX:
    """A vector whose entry i is scale_i times the sum of all entries of the pieces whose place is i."""
    if not pieces:
        return ca.MX(ca.DM.zeros(len(scale)))
    places = np.concatenate([place.ravel(order="F") for _, place in pieces])
    counts = np.bincount(places, minlength=len(scale))
    picked = _picked(pieces, np.argsort(places, kind="stable"), np.cumsum(counts) - counts, counts)
    return picked * _constant(scale)


def _matrix(pieces: Sequence[tuple], row_scale: np.ndarray, column_scale: np.ndarray) -> ca.MX:
    """A sparse matrix of such sums: places are column * rows + row, and both scales are multiplied."""
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
    return ca.MX(pattern, picked * _constant(row_scale[row] * column_scale[column]))


def _picked(pieces: Sequence[tuple], order: np.ndarray, starts: np.ndarray, counts: np.ndarray) -> ca.MX:
    """Sums of the entries order[starts_i], order[starts_i + 1], .. of the pieces, counts_i of them.

    Entries are picked, not multiplied by a matrix of ones: that takes a tenth of the time to build.
    """
    # One more entry, a zero, is picked for every place to which nothing is added.
    values, nothing = ca.veccat(*[piece for piece, _ in pieces], 0), len(order)
    picked = np.full(len(counts), nothing)
    picked[counts > 0] = order[starts[counts > 0]]
    total = values[picked.tolist()]
    for turn in range(1, min(counts.max(), MOST_PICKED)):
        some = np.flatnonzero(counts > turn)
        total[some.tolist()] += values[order[starts[some] + turn].tolist()]
    # Long sums belong to an unknown that is in every step, such as a free duration.
    for place in np.flatnonzero(counts > MOST_PICKED):
        begin, end = starts[place] + MOST_PICKED, starts[place] + counts[place]
        total[int(place)] += ca.sum1(values[order[begin:end].tolist()])
    return total
