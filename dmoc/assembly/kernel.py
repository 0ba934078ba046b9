"""The rows and the cost of one node, one step or the two ends, with their exact derivatives, as functions."""

from __future__ import annotations

from functools import cached_property

import casadi as ca

from dmoc.basics.numerics import chained, nonzeros_of, used_in
from dmoc.basics.records import dataclass


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
        from dmoc.assembly.compiled import compiled

        return compiled(self.functions)

    def results(self, compiled: bool) -> dict[str, ca.Function]:
        """The functions whose result is not zero by its structure; with `compiled` as machine code."""
        return {
            kind: function
            for kind, function in (self.compiled if compiled else self.functions).items()
            if function.numel_out(0) and (self.costly or kind not in ("cost", "gradient"))
        }


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
