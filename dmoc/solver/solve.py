"""Solve a transfer problem: on a mesh that is asked for, or to an accuracy that is asked for."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

from dmoc.basics.arguments import flag, number, of_kind, short, whole
from dmoc.diagnosis.wrong_way import STUCK, in_two_pieces, turned_round
from dmoc.meshes.choices import first_path, followed
from dmoc.motion.lobatto import scheme
from dmoc.motion.path import DiscretePath
from dmoc.nlp.solving import Progress
from dmoc.results.solution import Solution
from dmoc.rungs.rung import Rung
from dmoc.scene.problem import TransferProblem
from dmoc.solver.flat import flat_optimum
from dmoc.solver.ladder import UNEXPLAINED, Ladder
from dmoc.solver.leapt import past_zones
from dmoc.solver.mended import on_shorter_steps, onto_goal, onto_magnitude, onto_price
from dmoc.solver.proven import holds
from dmoc.solver.revolutions import best_revolutions
from dmoc.solver.second_look import cheaper_revolutions
from dmoc.solver.starts import compared
from dmoc.solver.tolerance import climb_to_tolerance


def solve(
    problem: TransferProblem,
    order: int | None = None,
    steps: int | None = None,
    tol: float | None = None,
    hold: bool = False,
    mesh: Any = None,
    guess: Any = None,
    options: dict[str, Any] | None = None,
    progress: Progress | None = None,
    compiled: bool = False,
    time_limit: float | None = None,
    sharp: bool = True,
) -> Solution:
    """Solve a transfer problem, coarse to fine: `dmoc.solve` says what the arguments are.

    If not `sharp`, |F| stays rounded at zero as the problem says, however much that costs.
    """
    of_kind("problem", problem, TransferProblem)
    check_numerics(order, steps, tol, hold, options, progress, time_limit)
    problem = followed(problem, problem.guess if guess is None else guess)
    ladder = Ladder(problem, options, progress, compiled, time_limit)
    if tol is not None and mesh is not None:
        raise ValueError("give mesh or tol, not both: to meet a tolerance the mesh is chosen")
    ladder.holds = lambda other: holds(
        ladder, other, lambda trial: _solved(trial, order, steps, None, hold, mesh, guess)
    )
    own = problem.guess if guess is None else guess
    with ladder.interrupt:
        solution = _solved(ladder, order, steps, tol, hold, mesh, guess, sharp=sharp)

        def again(paths: list[DiscretePath]) -> Solution | None:
            other = _solved(ladder, order, steps, tol, hold, mesh, *paths, sharp=sharp)
            return other if other.optimal else None

        if solution.optimal:
            sense = problem.objective.sense
            solution = turned_round(solution, lambda one: ((one,), one.objective), again, sense)
        elif in_two_pieces(problem) and solution.status in UNEXPLAINED:
            return replace(solution, message=STUCK)
        # To solve again from the program's own guess would take longer than the warm start from an answer of
        # this process; of one from a file nobody knows what it answers.
        former = own is None or isinstance(own, DiscretePath) or getattr(own, "problem", None) is not None
        return solution if former else compared(ladder, solution, hold)


def _solved(
    ladder: Ladder,
    order: int | None,
    steps: int | None,
    tol: float | None,
    hold: bool,
    mesh: Any,
    guess: Any,
    *,
    sharp: bool = True,
) -> Solution:
    problem = ladder.problem
    # To an orbit as a whole, durations hardly differ in cost: from a long one the refinement to a tolerance
    # wanders (89 s instead of 7 s in one case), and no revolution is there to be missed.
    # Without limits the soundings are answers, and a guess may lead to one that is a hundred times as dear.
    anchored = problem.start.anchored and problem.goal.anchored
    tried = guess is None and mesh is None and (anchored or tol is None or not problem.limited)
    best = best_revolutions(ladder, order, hold) if tried else None
    if best is not None:
        guess = best.path
    if tol is not None:
        return climb_to_tolerance(ladder, tol, order, steps, hold, guess)
    order = order or (None if best is None else best.nlp.scheme.order)
    first = first_path(problem, order, steps, hold, guess, mesh)
    pinned, given = best is not None and best.pinned, guess
    flat = flat_optimum(ladder, first) if best is None else ladder.refine_on(first, pinned)
    rung = ladder.climb_to(first, given) if flat is None else flat
    is_open = steps is None and mesh is None
    if is_open and best is None:
        rung, first = on_shorter_steps(ladder, rung, first, given)

    def mended(rung: Rung) -> Rung:
        # Of an answer that need not be sharp only the way past the zones counts.
        rung = past_zones(ladder, rung, first, given, is_open or not sharp)
        if is_open:
            rung = onto_goal(ladder, rung, first, given, order, pinned)
            rung = onto_price(ladder, rung, pinned)
        return onto_magnitude(ladder, rung) if sharp else rung

    rung = mended(rung)
    if guess is None and mesh is None:
        other = cheaper_revolutions(ladder, rung, partial(first_path, problem, order, steps, hold))
        rung = mended(other) if other.number > rung.number else other
    return ladder.solution(rung)


def check_numerics(
    order: Any, steps: Any, tol: Any, hold: Any, options: Any, progress: Any, time_limit: Any
) -> None:
    """Raise ValueError if an argument of a solve, of a transfer or of a mission, has no meaning."""
    scheme(2 if order is None else order)
    flag("hold", hold)
    if options is not None and not all(isinstance(name, str) for name in of_kind("options", options, dict)):
        raise ValueError(f"options must have names such as 'ipopt.max_iter'; got {short(options)}")
    if steps is not None:
        whole("steps", steps, least=2)
    if tol is not None and not 1e-11 <= (asked := number("tol", tol, "-", positive=True)) <= 0.1:
        raise ValueError(f"tol must lie between 1e-11 and 0.1 [-]; got {asked:g}")
    if progress is not None and not callable(progress):
        raise ValueError(f"progress must be a function; got {short(progress)}")
    if time_limit is not None:
        number("time_limit", time_limit, "s", positive=True)
