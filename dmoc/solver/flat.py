"""Least fuel to an open place on an orbit with thrust to spare: many paths cost nearly the same."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np

from dmoc.basics.memory import remembered
from dmoc.configurations.acting import state_symbols
from dmoc.guess.open_ends import end_estimates, two_burns, velocity_change_between
from dmoc.meshes.widths import WIDEST_ROUNDING, rounding_stages
from dmoc.motion.path import DiscretePath
from dmoc.parts.objectives import Effort
from dmoc.results.switches import has_linear_controls
from dmoc.rungs.rung import HELD, Rung, let_go, rounded, widths_on_the_way
from dmoc.scene.problem import TransferProblem
from dmoc.solver.ladder import Ladder

# There is thrust to spare if the change of velocity takes less than this part of the duration at the largest
# thrust, and the path of least effort no more than this part of that thrust [-]: where it takes more, least
# fuel has burns at places that cost decides on. Twelve random transfers between circles took 0.03 to 0.11,
# `leo_raise` all.
TO_SPARE = 0.3
# Least effort takes this many iterations at most: of twelve transfers eleven took 22 to 73.
MOST_EFFORT = 100
# Each answer that is held near the one before takes this many at most: those of eleven transfers took 3 to 33.
MOST_NEAR = 60
# An answer from two burns is held near them as strongly as this [-], with |F| rounded more and then as asked.
# Held less, or with |F| rounded as asked at once, some of nine transfers between circles led nowhere.
NEAR_BURNS = 0.1
# That takes at most this many iterations each time: the nine transfers took 13 to 53.
MOST_FROM_BURNS = 100


def held_near_least_effort(ladder: Ladder, first: DiscretePath) -> Rung | None:
    """An answer on the mesh of a guess that is held near the path of least effort, or None.

    From a spiral Ipopt wanders among paths of nearly the same fuel, for hundreds of iterations. Least effort
    has one optimum near by; held near it, and near each other as |F| is rounded less, least fuel takes about
    five iterations each time and lies a thousandth above its optimum.
    """
    problem = ladder.problem
    widths = [width for _, width in rounding_stages([first.mesh], problem)]
    wide = None if widths[0] is None else max(WIDEST_ROUNDING, widths[0])
    effort = replace(rounded(problem, wide), objective=Effort())
    rung = ladder.ask(effort, first, "least effort", MOST_EFFORT)
    if not rung.solved or np.abs(rung.path.control).max() > TO_SPARE * (problem.actuator.force_limit() or 0.0):
        return None
    path = replace(rung.path, multipliers={})
    for width in widths:
        rung = ladder.try_on(path, width, MOST_NEAR, lean=HELD[0])
        if not rung.solved:
            return rung if rung.stopped else None
        path = rung.path
    return rung


def flat_optimum(ladder: Ladder, first: DiscretePath, tolerance: float | None = None) -> Rung | None:
    """An optimum on the mesh of a guess by way of two burns or of the path of least effort, or None."""
    if first.multipliers or not _may_be_flat(ladder.problem):
        return None
    for held in (held_near_two_burns, held_near_least_effort):
        rung = held(ladder, first)
        if rung is not None and rung.solved:
            rung = let_go(ladder.try_on, rung, HELD[0], tolerance)
        if rung is not None:
            return rung
    return None


def held_near_two_burns(ladder: Ladder, first: DiscretePath) -> Rung | None:
    """An answer on the mesh of a guess that is held near a path of two short burns, or None.

    From the path of least effort, with thrust all along, most attempts lead nowhere on the way to few burns.
    """
    path = two_burns(ladder.problem, first)
    if path is None:
        return None
    for width in widths_on_the_way(ladder.problem):
        rung = ladder.try_on(path, width, MOST_FROM_BURNS, lean=NEAR_BURNS)
        if not rung.solved:
            return rung if rung.stopped else None
        path = rung.path
    return rung


def _may_be_flat(problem: TransferProblem) -> bool:
    """Whether a fixed time is to be spent on the way between orbits, one of which leaves its place open."""
    limit, duration = problem.actuator.force_limit(), problem.duration_bounds[0]
    open_place = not (problem.start.anchored and problem.goal.anchored)
    between_orbits = problem.attraction.lone is not None and open_place and not problem.free_duration
    if not between_orbits or limit is None or problem.constraints:
        return False
    if not has_linear_controls(problem) or _aims_at_a_place(problem):
        return False
    ends = end_estimates(problem, duration)
    if not np.isfinite(ends).all():
        return False
    return problem.mass * velocity_change_between(problem, ends) < TO_SPARE * limit * duration


def _aims_at_a_place(problem: TransferProblem) -> bool:
    """Whether the objective is one of the place or velocity at the goal: it takes all the thrust there is."""

    def found() -> bool:
        t, q, v, m = state_symbols(problem.dimension)
        return bool(ca.depends_on(ca.SX(problem.objective.terminal(t, q, v, m)), ca.vertcat(q, v)))

    return remembered(found, "aims at a place", problem.objective, problem.dimension)
