"""Plans with numbers that a flight told, and what a plan will tell of numbers before it is flown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.basics.arguments import of_kind
from dmoc.ends.base import State
from dmoc.identification.estimate import Estimate
from dmoc.nlp.placement import fisher
from dmoc.nlp.transcription import unassembled
from dmoc.nlp.units import units_of
from dmoc.parts.largest import MASS, Information, constants_of
from dmoc.results.solution import Outcome, Solution
from dmoc.scene.problem import TransferProblem


def foresee(solution: Any, unknown: str | Sequence[str], noise: float, every: float) -> dict[str, float]:
    """Standard deviations that `identify` will give numbers after a flight of this plan.

    To first order, with the state at the start unknown and exact forces: the inverse of the Fisher information,
    whose logarithm is the objective `Information`, which says where it comes from. Any plan has one, whatever
    it was made for.

    Parameters
    ----------
    solution : Solution
        Of a transfer of one body that does not turn, with its problem.
    unknown, noise, every
        As for `Information`.

    Returns
    -------
    dict of float
        By the names [SI]; infinite where the flight does not tell them.

    Raises
    ------
    ValueError
        If the solution is not such a one, there is no such number, or nothing is measured on the flight.
    """
    of_kind("solution", solution, Outcome)
    problem = solution.require_problem()
    if not isinstance(solution, Solution):
        raise ValueError("foresee takes the solution of one transfer, not that of a mission or of a team")
    solution.path.refuse_unusable("solution")
    if not solution.optimal:
        raise ValueError(f"foresee needs a path that can be flown; this solve ended with {solution.status!r}")
    objective = Information(unknown, noise, every)
    if objective.every > solution.duration:
        raise ValueError(
            f"every is {objective.every:g} s, longer than the flight of {solution.duration:g} s: nothing would "
            f"be measured on it; give at most {solution.duration:g} s"
        )
    twin = replace(problem, objective=objective)
    program, _ = unassembled(twin, solution.path, units_of(twin, solution.path))
    matrix = fisher(program, solution.path) * solution.duration / (objective.every * objective.noise**2)
    known = {one.name: one.value for one in constants_of(twin.effects)} | {MASS: problem.mass}
    count = len(objective.learns)
    size = np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(matrix / np.outer(size, size))
    hidden = values <= len(matrix) * np.finfo(float).eps
    inverse = (vectors / np.where(hidden, np.inf, values)) @ vectors.T / np.outer(size, size)
    blind = (np.abs(vectors[-count:, hidden]) > np.sqrt(np.finfo(float).eps)).any(axis=1)
    spread = np.where(blind, np.inf, np.sqrt(np.diag(inverse)[-count:]))
    return {name: float(one * abs(known[name])) for name, one in zip(objective.learns, spread, strict=True)}


def plan_for(estimate: Estimate, problem: TransferProblem | None = None, **changes: Any) -> TransferProblem:
    """A problem with the estimated numbers in it: mass, inertia, effects, thrusters, exhaust velocity.

    Where propellant burns, the mass is what is left at the end of the flight.

    Parameters
    ----------
    estimate : Estimate
    problem : TransferProblem, optional
        The plan whose numbers are to be replaced: its mass and inertia where the estimate has them, and its
        effects by those of the estimate. Without it a plan from where the flight ends, at rest or not.
    changes
        Further arguments of `TransferProblem`: without a problem at least goal and duration.

    Raises
    ------
    ValueError
        If the identification failed, or a number of it is not observable.
    """
    of_kind("estimate", estimate, Estimate)
    if not estimate.success:
        raise ValueError(f"the identification failed: {estimate.message}")
    if blind := [name for name, sigma in estimate.sigma.items() if not np.isfinite(sigma)]:
        raise ValueError(f"{blind[0]} is not observable in this flight: nothing can be planned with it")
    known = estimate.problem
    left = float(estimate.mass[-1])
    found: dict[str, Any] = {"mass": left, "effects": known.effects}
    if known.inertia is not None:
        shrunk = left / known.mass if getattr(known.actuator, "inertia_law", "") == "scaled" else 1.0
        found["inertia"] = tuple(tuple(shrunk * x for x in row) for row in known.inertia)
    if hasattr(known.actuator, "positions") or (known.actuator.burns and problem is None):
        found["actuator"] = known.actuator
    elif known.actuator.burns and problem is not None and problem.actuator.burns:
        found["actuator"] = replace(problem.actuator, exhaust_velocity=known.actuator.exhaust_velocity)
    if problem is not None:
        if problem.system is not None:
            raise ValueError("plan_for takes the plan of one body; this problem is one of several")
        return replace(problem, **found | changes)
    if missing := [name for name in ("goal", "duration") if name not in changes]:
        raise ValueError(f"give a problem, or a {missing[0]} of the plan")
    if "start" not in changes:
        if known.inertia is not None:
            raise ValueError("give the start of the plan: that of a body that turns is a Pose")
        found["start"] = State(tuple(estimate.position[-1]), tuple(estimate.velocity[-1]))
    return TransferProblem(**found | {"start_time": float(estimate.flight.times[-1])} | changes)
