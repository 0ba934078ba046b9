"""The functions of a large NLP, evaluated in plain memory: no graph of it is built.

CasADi's graph of an NLP of 200,000 steps takes 4 s and 450 MB to build; to evaluate it takes about as long as
without one. Small functions are evaluated for some hundred columns at a time, and NumPy adds up their results.
What is here has values only: no derivatives of its own, no C code.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import casadi as ca
import numpy as np

from dmoc.assembly.blocks import Assembly, Block, Scaling, Sums, places_of
from dmoc.basics.numerics import MOST_COLUMNS, connected, side_by_side
from dmoc.basics.records import dataclass


@dataclass(frozen=True)
class Stream:
    """One function of a kernel, evaluated for all columns of a block.

    Attributes
    ----------
    function : Function
        For `width` columns side by side.
    places : tuple of int arrays, shape (count, size)
        Which unknown each local one is and, where `function` takes multipliers, which row each of them is of.
    values : array, shape (count, len(d))
    parameters : int array
        Which of those of the NLP the function takes.
    """

    function: ca.Function
    width: int
    places: tuple[np.ndarray, ...]
    values: np.ndarray
    parameters: list[int]

    @classmethod
    def of(cls, block: Block, kind: str, function: ca.Function, values: np.ndarray) -> Stream:
        """That of one kind of result of a block."""
        width = min(block.count, MOST_COLUMNS)
        places = (block.columns, block.targets) if kind == "hessian" else (block.columns,)
        parameters = [block.first + place for place in block.kernel.used[1]]
        # Half the memory of NumPy's own kind of integer.
        across = tuple(np.ascontiguousarray(one.T, np.int32) for one in places)
        return cls(side_by_side(function, width), width, across, np.ascontiguousarray(values.T), parameters)

    def evaluated(self, vectors: Sequence[np.ndarray], p: np.ndarray, weight: float) -> np.ndarray:
        """The results, one evaluation after the other; `vectors` are what its places point into."""
        count, width = len(self.values), self.width
        taken = [np.empty((width, places.shape[1])) for places in self.places]
        numbers, same = np.empty((width, self.values.shape[1])), np.tile(p[self.parameters], (width, 1))
        inputs = [taken[0], numbers, same, *taken[1:]] + [np.full((width, 1), weight)] * (len(taken) - 1)
        found = np.empty((width, self.function.nnz_out(0) // width))
        evaluate = connected(self.function, dict(enumerate(inputs)), [found])[1]
        results = np.empty((count, found.shape[1]))
        for first in range(0, count, width):
            some = min(width, count - first)
            part = slice(first, first + some)
            for vector, places, into in zip(vectors, self.places, taken, strict=False):
                np.take(vector, places[part], out=into[:some], mode="clip")
            numbers[:some] = self.values[part]
            evaluate()
            results[part] = found[:some]
        return results.ravel()


@dataclass(frozen=True)
class Total:
    """Results of streams, added up to the nonzeros of a vector or a matrix, times `scales`."""

    streams: list[Stream]
    sums: Sums
    scales: np.ndarray

    def evaluated(self, vectors: Sequence[np.ndarray], p: np.ndarray, weight: float) -> np.ndarray:
        """The nonzeros, of what `Stream.evaluated` takes."""
        parts = [stream.evaluated(vectors, p, weight) for stream in self.streams]
        return self.sums.of(np.concatenate([np.empty(0), *parts])) * self.scales


class InMemory(ca.Callback):
    """A CasADi function that is evaluated by Python on plain memory.

    Parameters
    ----------
    name : str
    inputs : dict of int
        Length of each input vector by its name.
    outputs : dict of Sparsity
        Of each output; only the last one has nonzeros.
    evaluate : callable
        (array of each input) -> nonzeros of the last output.
    """

    def __init__(
        self, name: str, inputs: dict[str, int], outputs: dict[str, ca.Sparsity], evaluate: Callable
    ) -> None:
        ca.Callback.__init__(self)
        self.inputs, self.outputs, self.evaluate = inputs, outputs, evaluate
        self.construct(name, {})

    def get_n_in(self) -> int:
        return len(self.inputs)

    def get_n_out(self) -> int:
        return len(self.outputs)

    def get_name_in(self, i: int) -> str:
        return list(self.inputs)[i]

    def get_name_out(self, i: int) -> str:
        return list(self.outputs)[i]

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(list(self.inputs.values())[i])

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return list(self.outputs.values())[i]

    def has_eval_buffer(self) -> bool:
        return True

    def eval_buffer(self, given: Sequence, results: Sequence) -> int:
        if results[-1] is not None:
            # What is not given is zero.
            sizes = self.inputs.values()
            read = [
                np.zeros(n) if one is None else np.frombuffer(one) for n, one in zip(sizes, given, strict=True)
            ]
            np.frombuffer(results[-1])[:] = self.evaluate(*read)
        return 0


def assemble_streamed(
    blocks: Sequence[Block], scaling: Scaling, parameter_count: int, compiled: bool = False
) -> Assembly:
    """The functions of the NLP that these blocks make; with `compiled` the kernels are machine code."""
    columns, rows, cost = scaling.columns, scaling.rows, scaling.cost
    totals = {
        kind: _total(kind, blocks, scaling, compiled)
        for kind in ("cost", "rows", "gradient", "jacobian", "hessian")
    }
    primal = {"x": len(columns), "p": parameter_count}
    dual = primal | {"lam_f": 1, "lam_g": len(rows)}

    def made(name: str, kind: str, inputs: dict[str, int], outputs: dict[str, ca.Sparsity]) -> InMemory:
        total = totals[kind][1]

        def evaluate(x, p, weight=1.0, multipliers=None):
            vectors = [x * columns] if multipliers is None else [x * columns, multipliers * rows]
            return total.evaluated(vectors, p, cost * np.asarray(weight).item())

        return InMemory(name, inputs, outputs, evaluate)

    pattern = {kind: found[0] for kind, found in totals.items()}
    objective = made("objective", "cost", primal, {"f": pattern["cost"]})
    constraints = made("constraints", "rows", primal, {"g": pattern["rows"]})
    nothing, empty = ca.Sparsity(1, 1), ca.Sparsity(len(rows), 1)
    x, p = ca.MX.sym("x", len(columns)), ca.MX.sym("p", parameter_count)
    return Assembly(
        x,
        p,
        objective(x, p),
        constraints(x, p),
        objective,
        constraints,
        made("nlp_grad_f", "gradient", primal, {"f": nothing, "grad_f_x": pattern["gradient"]}),
        made("nlp_jac_g", "jacobian", primal, {"g": empty, "jac_g_x": pattern["jacobian"]}),
        made("nlp_hess_l", "hessian", dual, {"h": pattern["hessian"]}),
    )


def _total(kind: str, blocks: Sequence[Block], scaling: Scaling, compiled: bool) -> tuple[ca.Sparsity, Total]:
    """The pattern of one kind of result, and what evaluates its nonzeros."""
    columns, rows = scaling.columns, scaling.rows
    streams, places = [], []
    for block, values in zip(blocks, scaling.values, strict=True):
        if (function := block.kernel.results(compiled).get(kind)) is not None:
            streams.append(Stream.of(block, kind, function, values))
            places.append(places_of(block, kind, len(rows), len(columns)).ravel(order="F"))
    entries = np.concatenate([np.empty(0, int), *places])
    if kind in ("jacobian", "hessian"):
        heights = rows if kind == "jacobian" else columns
        sums, pattern, row, column = Sums.in_matrix(entries, len(heights), len(columns))
        return pattern, Total(streams, sums, heights[row] * columns[column])
    scales = {"rows": rows, "gradient": scaling.cost * columns, "cost": np.array([scaling.cost])}[kind]
    return ca.Sparsity.dense(len(scales)), Total(streams, Sums(entries, len(scales)), scales)
