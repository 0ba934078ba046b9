"""From an accuracy to an answer: a trial on a coarse mesh, the order that pays, and finer meshes from there."""

from __future__ import annotations

from functools import partial
from typing import Any

from dmoc.meshes.choices import TRIAL_ORDER, best_order, is_uneven, trial_path, with_as_many_nodes
from dmoc.meshes.smooth import finer, smooth_path
from dmoc.results.solution import NOT_MET, Solution
from dmoc.results.switches import is_singular
from dmoc.solver.flat import flat_optimum
from dmoc.solver.ladder import UNEXPLAINED, Ladder
from dmoc.solver.leapt import past_zones
from dmoc.solver.mended import on_shorter_steps
from dmoc.solver.refinement import Refinement
from dmoc.solver.second_look import cheaper_revolutions

# Where the second mesh leads nowhere, a solve begins anew on so many times the steps of the first.
MORE = 3
# A smooth transfer is solved on so many meshes, each as fine as the error of the one before asks for.
MOST_AT_ONCE = 2


def climb_to_tolerance(
    ladder: Ladder, tol: float, order: int | None, steps: int | None, hold: bool, guess: Any
) -> Solution:
    """Refine until the estimated error is below a tolerance, on meshes that each cut steps of the one before.

    A trial on a coarse mesh tells whether controls switch or limits set in, and so which order pays. Without
    limits it may be the answer. All step ends are kept from mesh to mesh: the answer on one is a good start for
    the next, and the change there tells the error.
    """
    smooth = not (ladder.problem.limited or hold)
    if smooth and order is None and steps is None:
        # Nothing can switch, so that no trial is needed.
        first = smooth_path(ladder.problem, tol, guess)
        order = first.order
    else:
        first = trial_path(ladder.problem, order or TRIAL_ORDER, steps, hold, guess)
    trial = flat_optimum(ladder, first, tol)
    if trial is None:
        trial, first = on_shorter_steps(ladder, ladder.climb_to(first, guess), first, guess)
    if guess is None:
        trial = cheaper_revolutions(
            ladder, trial, partial(trial_path, ladder.problem, first.order, steps, hold)
        )
    trial = past_zones(ladder, trial, first, guess, refined=True)
    if not trial.solved:
        return ladder.solution(trial, tolerance=tol)
    path = trial.path
    given, cost = "smooth" if smooth else "the order as given", trial.level.objective
    order, reason = (order, given) if order else best_order(ladder.problem, path, cost, tol)
    reason = "; ".join([*trial.notes, reason])
    if order != path.order:
        trial = ladder.solve_on(path.onto(with_as_many_nodes(path, order), order, hold))
        if not trial.solved:
            return ladder.solution(trial, tolerance=tol)
    local = not is_singular(ladder.problem, path)
    refinement = Refinement(ladder, tol, local, reason)
    # Close past an attractor one mesh does not tell its own error: the cost of a flyby was six times as far off
    # as its steps and the miss of the goal said.
    at_once = smooth and not is_uneven(ladder.problem, path)
    for more in reversed(range(MOST_AT_ONCE if at_once else 0)):
        if refinement.meets_at_once(trial):
            return refinement.settled(reason)
        if more:
            mesh = finer(trial.path, refinement.errors[trial.number], tol)
            again = ladder.solve_on(trial.path.onto(mesh, order, hold))
            trial = again if again.solved else trial
    found = refinement.of(trial, order, hold)
    limited = any("max_" in name for name in ladder.options or ())
    if refinement.best is not None or found.status not in (*UNEXPLAINED, NOT_MET) or limited:
        return found
    # The second mesh led nowhere from the answer on the first one: begin anew, on as many steps.
    first = trial_path(ladder.problem, order, MORE * (len(trial.nlp.mesh) - 1), hold, guess)
    trial = flat_optimum(ladder, first, tol) or ladder.climb_to(first, guess)
    return Refinement(ladder, tol, local, reason).of(trial, order, hold) if trial.solved else found
