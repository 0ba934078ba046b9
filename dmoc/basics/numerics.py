"""A cubic spline, motion with an error estimate, a root, the chain rule, functions in plain memory.

Importing SciPy takes longer.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from typing import Any

import casadi as ca
import numpy as np

# A function of columns is evaluated in so many at once; a longer map takes long to make.
MOST_COLUMNS = 512
# Two unknowns whose coupling is below this [-], the unknowns being near 1, are solved separately: no digit
# changes.
UNCOUPLED = 1e-17


def cubic_spline(x: np.ndarray, y: np.ndarray, slopes: tuple | None = None) -> Callable:
    """The twice differentiable cubic through `y` at the increasing `x`: a function of places.

    It has these `slopes` at both ends or, without them, one polynomial for the first two pieces and
    one for the last two ("not-a-knot").

    Parameters
    ----------
    x, y : arrays, shapes (count,) and (count, ...)
        At least three points.
    slopes : tuple, optional
        First and last derivative, of the shape of a row of `y`.

    References
    ----------
    C. de Boor, A Practical Guide to Splines (2001), chapter IV.
    """
    # The points lie along the last axis: NumPy is slow over a short one.
    values = np.ascontiguousarray(y.T)
    h = np.diff(x)
    rises = np.diff(values) / h
    left, right = h[1:] / (h[1:] + h[:-1]), h[:-1] / (h[1:] + h[:-1])
    below, above = 0.5 * left, 0.5 * right
    middle = 1.5 * (left * rises[..., :-1] + right * rises[..., 1:])
    if slopes is not None:
        first, last = (np.transpose(end) for end in slopes)
        middle[..., 0] -= below[0] * first
        middle[..., -1] -= above[-1] * last
        inner = _tridiagonal(below, above, middle)
    else:
        begin = (2 + right[0]) * left[0] * rises[..., 0] + right[0] ** 2 * rises[..., 1]
        end = (2 + left[-1]) * right[-1] * rises[..., -1] + left[-1] ** 2 * rises[..., -2]
        if len(h) > 2:
            above[0], middle[..., 0] = right[0], 2 * middle[..., 0] - begin
            below[-1], middle[..., -1] = left[-1], 2 * middle[..., -1] - end
            inner = _tridiagonal(below, above, middle)
        else:
            # Through three points there is one parabola.
            inner = middle / 1.5
        first, last = (begin - inner[..., 0]) / left[0], (end - inner[..., -1]) / right[-1]
    slope = np.concatenate([first[..., None], inner, last[..., None]], axis=-1)
    second = (3 * rises - 2 * slope[..., :-1] - slope[..., 1:]) / h
    third = (slope[..., 1:] + slope[..., :-1] - 2 * rises) / h**2

    def spline(places: np.ndarray) -> np.ndarray:
        piece = np.clip(np.searchsorted(x, places, side="right") - 1, 0, len(h) - 1)
        along, found = places - x[piece], third[..., piece]
        for power in (second, slope, values):
            found = found * along + power[..., piece]
        return found.T

    return spline


def _tridiagonal(below: np.ndarray, above: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution of below[i] x[i-1] + x[i] + above[i] x[i+1] = right[i], by parallel cyclic reduction.

    Every pass puts the equations of both neighbours into each one, so that the next neighbours are
    twice as far away and coupled by about the square: seven passes, however many unknowns there are.
    (R. W. Hockney, C. R. Jesshope, Parallel Computers (1981), section 5.4.)
    """
    reach = 1
    while reach < len(below) and max(below.max(), above.max(), -below.min(), -above.min()) > UNCOUPLED:
        lower, upper = below[reach:], above[:-reach]
        pivot, known = np.ones_like(below), right.copy()
        pivot[reach:] -= lower * upper
        pivot[:-reach] -= upper * lower
        known[..., reach:] -= lower * right[..., :-reach]
        known[..., :-reach] -= upper * right[..., reach:]
        further_below, further_above = np.zeros_like(below), np.zeros_like(above)
        further_below[reach:] = -lower * below[:-reach]
        further_above[:-reach] = -upper * above[reach:]
        below, above, right = further_below / pivot, further_above / pivot, known / pivot
        reach *= 2
    return right


def adams(motion: dict[str, ca.SX], places: np.ndarray, tol: float, most_steps: int) -> ca.Function:
    """Adams' method of variable order for `motion`: its "ode", in "x", "t" and "p", from t = 0 on.

    The states at increasing `places` of t are the columns of "xf". Scale the state to about 1: errors
    are `tol` relative and a thousandth of that absolute. Called, it prints nothing and ends in bounded
    time: with a RuntimeError after `most_steps` from one place to the next, or at a singularity.

    References
    ----------
    A. C. Hindmarsh et al., SUNDIALS, ACM Trans. Math. Softw. 31 (2005).
    """
    settings = {
        "reltol": tol,
        "abstol": 1e-3 * tol,
        "linear_multistep_method": "adams",
        "nonlinear_solver_iteration": "functional",
        "max_num_steps": most_steps,
        # A fixed first step: else it would follow from the first place, and all steps with it.
        "step0": 1e-7,
        "disable_internal_warnings": True,
        "show_eval_warnings": False,
    }
    return ca.integrator("adams", "cvodes", motion, 0.0, places.tolist(), settings)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The vector product of two vectors of three entries, for which NumPy's takes ten times as long."""
    (a0, a1, a2), (b0, b1, b2) = a.tolist(), b.tolist()
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def root(function: Callable[[float], float], a: float, b: float, tol: float) -> float:
    """Where a function changes its sign between a and b: false position by the Illinois rule.

    M. Dowell, P. Jarratt, BIT 11 (1971): the value at an end that stays is halved, so that this end moves, too.
    """
    at_a, at_b = function(a), function(b)
    while at_b and abs(b - a) > tol:
        c = b - at_b * (b - a) / (at_b - at_a)
        at_c = function(c)
        a, at_a = (b, at_b) if at_b * at_c < 0 else (a, 0.5 * at_a)
        b, at_b = c, at_c
    return b


def chained(rows: ca.SX, total: ca.SX, z: ca.SX, y: ca.SX, known: ca.SX) -> list[ca.SX]:
    """Jacobian of rows, upper triangle of the Hessian of the total, and its slope, in z where y is known(z)."""
    moves, both = ca.jacobian(known, z), ca.vertcat(z, y)
    second, first = ca.hessian(total, both)
    n = z.numel()
    mixed, lam = second[:n, n:] @ moves, ca.SX.sym("lam", y.numel())
    bent = ca.substitute(ca.hessian(ca.dot(lam, known), z)[0], lam, first[n:])
    jacobian = ca.jacobian(rows, z) + ca.jacobian(rows, y) @ moves
    hessian = second[:n, :n] + mixed + mixed.T + moves.T @ (second[n:, n:] @ moves) + bent
    slope = first[:n] + moves.T @ first[n:]
    parts = ca.substitute([jacobian, ca.triu(hessian), slope], [y], [known])
    return [ca.sparsify(part) for part in ca.cse(parts)]


def used_in(symbols: ca.SX, *results: ca.SX) -> list[int]:
    """Which of some symbols are in the results."""
    found = {symbol.element_hash() for symbol in ca.symvar(ca.veccat(*results))}
    return [i for i, symbol in enumerate(symbols.elements()) if symbol.element_hash() in found]


def nonzeros_of(matrix: ca.SX) -> ca.SX:
    """The structural nonzeros of a matrix as a column."""
    return ca.vertcat(*matrix.nonzeros()) if matrix.nnz() else ca.SX(0, 1)


def in_plain_memory(
    function: ca.Function, given: dict[str, np.ndarray]
) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """The nonzeros of a function's outputs and its statistics; inputs that are not given are zero.

    To copy arrays into CasADi's matrices and back takes a tenth of the time of a small solve.
    """
    outputs = {name: np.empty(function.nnz_out(i)) for i, name in enumerate(function.name_out())}
    inputs = {
        i: np.ascontiguousarray(np.broadcast_to(given[name], function.nnz_in(i)), float)
        for i, name in enumerate(function.name_in())
        if name in given
    }
    buffer, evaluate = connected(function, inputs, list(outputs.values()))
    try:
        before = buffer.stats()
    except RuntimeError:  # It has not run yet.
        before = {}
    evaluate()
    stats = buffer.stats()
    # Calls are counted on from run to run.
    return outputs, stats | {n: stats[n] - before.get(n, 0) for n in stats if n.startswith("n_call")}


def columns(function: ca.Function, *given: Any) -> tuple[np.ndarray, ...]:
    """The outputs of a function for many columns, one evaluation for each, side by side as CasADi has them.

    CasADi's own call takes 6 µs a column, whatever the function: 70 ms for 12,000 in place of 1.3 ms.

    Parameters
    ----------
    function : casadi.Function
        Its inputs are dense.
    *given : arrays, shape (rows, columns)
        One for each input; what has one column, or is a number, is the same in all evaluations.
    """
    inputs = [_of_columns(one, function.numel_in(i)) for i, one in enumerate(given)]
    count = max(map(len, inputs))
    inputs = [np.broadcast_to(one, (count, one.shape[1])) if len(one) != count else one for one in inputs]
    inputs = [np.ascontiguousarray(one) for one in inputs]
    outputs = [np.empty((count, function.nnz_out(i))) for i in range(function.n_out())]
    for first in range(0, count, MOST_COLUMNS):
        part = slice(first, min(first + MOST_COLUMNS, count))
        these, those = {i: one[part] for i, one in enumerate(inputs)}, [one[part] for one in outputs]
        connected(side_by_side(function, part.stop - first), these, those)[1]()
    return tuple(_dense(values, function.sparsity_out(i)) for i, values in enumerate(outputs))


def _of_columns(given: Any, size: int) -> np.ndarray:
    """Columns as rows of this size."""
    values = np.atleast_2d(np.asarray(given, float)).T
    if not size:
        return np.zeros((1, 0))
    return np.full((1, size), values.item()) if values.size == 1 else values.reshape(-1, size)


@lru_cache(maxsize=256)
def side_by_side(function: ca.Function, count: int) -> ca.Function:
    return function.map(count) if count > 1 else function


def connected(
    function: ca.Function, inputs: dict[int, np.ndarray], outputs: list[np.ndarray]
) -> tuple[Any, Callable]:
    """A buffer of a function and what evaluates it, from arrays into arrays, which must live as long as it."""
    buffer, evaluate = function.buffer()
    for i, values in inputs.items():
        if values.size:
            buffer.set_arg(i, memoryview(values))  # type: ignore[arg-type]
    for i, values in enumerate(outputs):
        if values.size:
            buffer.set_res(i, memoryview(values))  # type: ignore[arg-type]

    def run() -> None:
        evaluate()
        if buffer.ret():
            raise RuntimeError(f"CasADi cannot evaluate {function.name()!r}")

    return buffer, run


def _dense(values: np.ndarray, sparsity: ca.Sparsity) -> np.ndarray:
    """Matrices side by side, by the nonzeros of each, one row a matrix."""
    rows, across = sparsity.shape
    if not sparsity.is_dense():
        full = np.zeros((len(values), rows * across))
        full[:, sparsity.find()] = values
        values = full
    return values.reshape(len(values) * across, rows).T


def coefficients() -> tuple[np.ndarray, ...]:
    """DOP853's places, slopes and weights of its stages, and weights of its third and fifth order errors.

    They are SciPy's. Its integrators take as long to import as a small solve, so their table is read alone.
    """
    try:
        table = _scipys_table()
        stages = len(table.B)
        return table.C[:stages], table.A[:stages, :stages], table.B, table.E3, table.E5
    except (AttributeError, ImportError, OSError):
        from scipy.integrate import DOP853

        return DOP853.C, DOP853.A, DOP853.B, DOP853.E3, DOP853.E5


def _scipys_table() -> Any:
    """SciPy's module of coefficients, which holds numbers alone, loaded without the package around it."""
    folder = find_spec("scipy").submodule_search_locations[0]  # type: ignore[union-attr, index]
    spec = spec_from_file_location("dop853", f"{folder}/integrate/_ivp/dop853_coefficients.py")
    table = module_from_spec(spec)  # type: ignore[arg-type]
    spec.loader.exec_module(table)  # type: ignore[union-attr]
    return table
