"""The path for other numbers, to first order, as a CasADi function of its own."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from dmoc.planners.planner import Planner
from dmoc.planners.residual import velocities_of
from dmoc.planners.terms import TERMS, Exported, Term, named
from dmoc.sensitivity.kkt import ActiveSet
from dmoc.sensitivity.optimum import Optimum


def prediction(planner: Planner, solution: Any) -> Exported:
    """The plan for other numbers near a solution, whose factorised optimality conditions become one matrix.

    Limits that act at the solution act on, others begin to where they are met; see `predict`.
    """
    optimum = Optimum.of(solution, planner.scene.problem, opened=False)
    by_name = {one.name: one for one in optimum.numbers.kept}
    numbers = {name: symbol for name, symbol in planner.numbers.symbols().items() if name in by_name}
    total = optimum.matrices[0].shape[1]
    moved = ActiveSet(optimum).tangent(np.eye(total))
    lower, upper, *_ = optimum.matrices
    stated = np.concatenate([np.nan_to_num(one.value) for one in optimum.numbers.kept])
    by = ca.vertcat(*[numbers[one.name] for one in optimum.numbers.kept]) - ca.DM(stated)
    x = ca.DM(optimum.x) + _sparse(moved.x) @ by
    low, high = (
        ca.DM(bound) + _sparse(side.toarray()) @ by
        for bound, side in zip(optimum.bounds[:2], (lower, upper), strict=True)
    )
    path = planner.unpack(ca.fmin(ca.fmax(x, low), high), numbers | _own(planner, numbers))
    path |= planner.scene.parted(velocities_of(planner.scene, path), "speeds")
    outputs = {name: path[name] for name in planner.plan_names}
    known = planner.scene.terms | planner.numbers.terms
    terms = {name: known.get(name) or TERMS.get(name) or Term("", name) for name in (*numbers, *outputs)}
    words = "the plan for other numbers near the exported solution, to first order"
    return Exported(named("predict", numbers, outputs), words, terms)


def _own(planner: Planner, numbers: dict[str, ca.MX]) -> dict[str, ca.MX]:
    """Mass, times and the like that are no arguments here, as the problem states them."""
    problem = planner.scene.problem
    own = {"mass": problem.mass, "start_time": problem.start_time, "duration": problem.duration_bounds[0]}
    return {name: ca.MX(float(value)) for name, value in own.items() if name not in numbers}


def _sparse(matrix: np.ndarray) -> ca.DM:
    return ca.sparsify(ca.DM(matrix))
