"""Many small functions, mapped over steps or nodes and scattered into one sparse NLP: CasADi's graph of it.

The exact derivatives of one evaluation of a block (CasADi SX) are mapped, and picked to their places in the
global Jacobian and Hessian. Nothing here loops over the evaluations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import casadi as ca
import numpy as np

from dmoc.assembly.blocks import Assembly, Block, Scaling, pattern_of, places_of

# Sums of at most this many entries are made by picking one entry after the other; the rest of a longer one, as
# for a free duration that is in every step, is added up at once.
MOST_PICKED = 8
# A vector whose runs of equal numbers are at least this long on average is put together from one number a run:
# that saves time in the build.
LEAST_RUN = 100


def assemble(
    blocks: Sequence[Block],
    scaling: Scaling,
    parameter_count: int,
    compiled: bool = False,
    parametric: bool = False,
) -> Assembly:
    """Map the blocks and scatter them.

    With `compiled` the kernels are machine code. If `parametric`, the numbers of the scaling are parameters
    behind the others, in the order of `Assembly.numbers`; else they are constants.
    """
    columns, rows = len(scaling.columns), len(scaling.rows)
    x, p = ca.MX.sym("x", columns), [ca.MX.sym("p", parameter_count)]

    def number(values: np.ndarray) -> ca.MX:
        if not parametric:
            return _constant(values)
        p.append(ca.MX.sym("number", len(values)))
        return p[-1]

    # The order of what follows is that of the parameters.
    column_scale, row_scale, cost_scale = map(number, (scaling.columns, scaling.rows, np.array([scaling.cost])))
    values = [
        ca.reshape(number(given.ravel(order="F")), *given.shape) if parametric else ca.MX(ca.DM(given))
        for given in scaling.values
    ]
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", rows)
    vectors = x * column_scale, p[0], lam_g * row_scale, cost_scale * lam_f
    pieces: dict[str, list] = {kind: [] for kind in ("rows", "cost", "gradient", "jacobian", "hessian")}
    for block, numbers in zip(blocks, values, strict=True):
        for kind, piece in _evaluated(block, numbers, *vectors, compiled):
            pieces[kind].append((piece, places_of(block, kind, rows, columns)))

    f = cost_scale * sum((ca.sum2(piece) for piece, _ in pieces["cost"]), ca.MX(0))
    g = _summed(pieces["rows"], rows) * row_scale
    slopes = _summed(pieces["gradient"], columns) * (cost_scale * column_scale)
    jacobian = _matrix(pieces["jacobian"], scaling.rows, scaling.columns, number)
    hessian = _matrix(pieces["hessian"], scaling.columns, scaling.columns, number)
    given = [x, ca.vertcat(*p)]
    return Assembly(
        given[0],
        given[1],
        f,
        g,
        ca.Function("objective", given, [f]),
        ca.Function("constraints", given, [g]),
        # CasADi wants f or g as a further output of these functions. Ipopt never asks for it, so a constant
        # that costs nothing stands there.
        ca.Function("nlp_grad_f", given, [ca.MX(1, 1), slopes], ["x", "p"], ["f", "grad_f_x"]),
        ca.Function("nlp_jac_g", given, [ca.MX(rows, 1), jacobian], ["x", "p"], ["g", "jac_g_x"]),
        ca.Function("nlp_hess_l", [*given, lam_f, lam_g], [hessian], ["x", "p", "lam_f", "lam_g"], ["h"]),
        parametric,
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
    block: Block,
    values: ca.MX,
    unknowns: ca.MX,
    parameters: ca.MX,
    multipliers: ca.MX,
    weight: ca.MX,
    compiled: bool,
) -> Iterator[tuple[str, ca.MX]]:
    """Kind and value of every result of a block that is not zero by its structure, one column an evaluation."""
    kernel, count = block.kernel, block.count
    p = [block.first + place for place in kernel.used[1]]
    # Of an empty matrix repeated CasADi writes C code that newer compilers refuse.
    same = ca.repmat(parameters[p], 1, count) if p else ca.MX(0, count)
    given = [_columns(unknowns, block.columns), values, same]
    dual = [_columns(multipliers, block.targets), ca.repmat(weight, 1, count)]
    for kind, function in kernel.results(compiled).items():
        yield kind, function.map(count)(*given, *(dual if kind == "hessian" else ()))


def _summed(pieces: Sequence[tuple[ca.MX, np.ndarray]], size: int) -> ca.MX:
    """A vector whose entry i is the sum of all entries of the pieces whose place is i."""
    if not pieces:
        return ca.MX(ca.DM.zeros(size))
    places = np.concatenate([place.ravel(order="F") for _, place in pieces])
    counts = np.bincount(places, minlength=size)
    return _picked(pieces, np.argsort(places, kind="stable"), np.cumsum(counts) - counts, counts)


def _matrix(
    pieces: Sequence[tuple], row_scale: np.ndarray, column_scale: np.ndarray, number: Callable
) -> ca.MX:
    """A sparse matrix of such sums, times both scales, whose product is a `number`.

    Places are column * rows + row.
    """
    rows, columns = len(row_scale), len(column_scale)
    if not pieces:
        return ca.MX(rows, columns)
    keys = np.concatenate([place.ravel(order="F") for _, place in pieces])
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    starts = np.flatnonzero(np.diff(keys, prepend=-1))
    pattern, row, column = pattern_of(keys[starts], rows, columns)
    picked = _picked(pieces, order, starts, np.diff(starts, append=len(keys)))
    if picked.is_zero():
        # CasADi drops such entries from the pattern, and they would have a number without a place.
        return ca.MX(rows, columns)
    return ca.MX(pattern, picked * number(row_scale[row] * column_scale[column]))


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
