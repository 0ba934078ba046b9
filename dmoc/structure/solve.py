"""Solve a transfer by its structure: a coarse answer, its arcs as legs with free ends, the legs improved."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.basics.memory import unchanged
from dmoc.checks.verification import Report
from dmoc.missions.answer import answered
from dmoc.missions.attempt import Attempt
from dmoc.missions.checks import verify_mission
from dmoc.missions.climb import MOST_MESHES, NEARER, STAYING, Climb
from dmoc.missions.solution import MissionSolution
from dmoc.results.solution import Solution
from dmoc.rungs.rung import cut_short
from dmoc.scene.problem import TransferProblem
from dmoc.solver.solve import check_numerics
from dmoc.structure.arcs import (
    Arc,
    alike,
    arcs_of,
    can_be_parted,
    from_plain,
    is_clear,
    plain,
    surely_seen,
    told,
    without_waiting,
)
from dmoc.structure.build import FOUND_ORDER, ORDER, Course, mission_of, path_of
from dmoc.structure.coarse import ENDED, LESS_ROUNDED, ROUNDED, coarse_answer
from dmoc.structure.improve import improved, is_pulled, not_turned_round
from dmoc.structure.modes import FREE, REVERSED
from dmoc.structure.solution import structured

# A second coarse answer has so many times the steps.
FINER = 3
# Without a tolerance the objective may change by this part of it on the last meshes [-]: more says that
# something switches inside a leg.
SETTLED = 1e-6
# Arcs are improved so many times.
MOST_ROUNDS = 10
# How near to limits Ipopt begins from nearly the answer, and with which parameter of the barrier [-]; where the
# first leads nowhere the second is tried.
NEAR = (1e-9, 1e-6), (1e-4, 1e-2)
# With an arc more the answer is further away: held as near as before, `two_body_fuel` takes 78 iterations
# to move its shortest burn, not 28 [-].
GROWING = 100.0
# An answer that costs more than the coarse one by over this part of it [-] is another optimum, or none.
WORSE = 0.1
# Without the coasts at its ends an answer may cost this part more [-], as much as the coarse mesh is off.
SAME_COST = 1e-3
# An attempt from nearly the answer ends after this many iterations, on arcs of a second coarse answer after
# that many.
MOST_ITERATIONS, PATIENT = 100, 250
# Legs between which the force is turned round are right on fewer meshes than this, or it turns fast instead.
FEW_MESHES = 4
# Finding the legs takes at most this much work, iterations times steps, beside so many times that of the coarse
# answer: about two seconds. Where they are not found by then the ordinary ladder goes on.
MOST_WORK, MOST_TIMES = 20_000, 2
# Without a tolerance, legs are refined until their steps err by less than this part of the path [-].
ACCURATE = 1e-9
# Nor may the objective change by more than this part of it [-]: what steps err by says nothing of how well the
# controls follow a fast turn of the thrust.
STILL = 1e-8


@unchanged()
def solve_by_structure(
    problem: TransferProblem,
    order: int | None = None,
    steps: int | None = None,
    tol: float | None = None,
    otherwise: Callable[[], Solution] | None = None,
    **more: Any,
) -> Solution | MissionSolution | None:
    """The answer as a mission of arcs; None where that does not succeed.

    `order` and `steps` are those of the coarse answer, `otherwise` gives the one of the ordinary ladder, which
    is asked for where the coarse one costs far less; `more` are further arguments of `dmoc.solve`. The
    independent checks judge the result. What was found when the user or the time ended it is told as it is.
    """
    check_numerics(order, steps, tol, False, more.get("options"), more.get("progress"), more.get("time_limit"))
    if not can_be_parted(problem):
        return None
    coarse = coarse_answer(problem, order, steps, **more)
    if coarse.success and not is_clear(coarse):
        again = coarse_answer(problem, coarse.order, coarse.steps, ROUNDED, **more | {"guess": coarse.path})
        if again.status in ENDED:
            return again
        # Where that one is not found, or not in time, the first one stands.
        coarse = replace(again, ladder=(*coarse.ladder, *again.ladder)) if again.success else coarse
    if not coarse.success:
        return coarse if coarse.status in ENDED else None
    found = _by_arcs(problem, coarse, tol, more)
    if (found is None or _is_dear(found, coarse)) and order is None and steps is None:
        if len(arcs_of(coarse)) == 1:
            return found
        # Where a burn is hardly longer than a step the arcs are seen on a finer mesh.
        finer = coarse_answer(problem, coarse.order, FINER * coarse.steps, LESS_ROUNDED, **more)
        if finer.status in ENDED:
            return finer
        found = (_by_arcs(problem, finer, tol, more, PATIENT) if finer.success else None) or found
    if found is None or not _is_dear(found, coarse):
        return found
    return None if otherwise is None else _better(found, otherwise())


def _is_dear(found: Solution | MissionSolution, coarse: Solution, part: float = WORSE) -> bool:
    """Whether an answer costs so much more than the coarse one that another optimum may be better."""
    sense = coarse.require_problem().objective.sense
    return found.optimal and sense * (found.objective - coarse.objective) > part * abs(coarse.objective)


def _better(found: Solution | MissionSolution, other: Solution) -> MissionSolution | Solution:
    """The one of two answers to stay with: the other one where that is an optimum and costs less."""
    sense = found.require_problem().objective.sense
    return other if other.optimal and sense * (found.objective - other.objective) > 0 else found


def _by_arcs(
    problem: TransferProblem,
    coarse: Solution,
    tol: float | None,
    more: dict[str, Any],
    most: int = MOST_ITERATIONS,
) -> Solution | MissionSolution | None:
    """The answer as a mission of the arcs of a coarse one; an attempt ends after `most` iterations.

    If the time was over before there was one, the coarse answer.
    """
    arcs = arcs_of(coarse)
    if most > MOST_ITERATIONS:
        arcs = surely_seen(arcs, coarse)
    if len(arcs) == 1 and arcs[0].alike == (FREE, None):
        return None
    numerics = more.get("options"), more.get("progress"), bool(more.get("compiled")), more.get("time_limit")
    # To wait at either end may cost nothing: of legs that may last as long as they like Ipopt finds no optimum.
    moving = without_waiting(arcs) if problem.free_duration and not problem.goal.anchored else arcs
    tried = {arcs: np.inf, not_turned_round(arcs): np.inf}
    tried.setdefault(moving, SAME_COST)
    for these, dearer in tried.items():
        climb = Climb(mission_of(problem, these), *numerics)
        climb.sharp, climb.staying = True, NEARER if most > MOST_ITERATIONS else STAYING
        climb.most_finer = MOST_ITERATIONS
        climb.levels.extend(coarse.ladder)
        with climb.interrupt:
            found = _improved(climb, problem, these, (coarse,), tol, most)
        if climb.interrupt.late and not (found and found.optimal):
            return cut_short(coarse, climb.interrupt.seconds, True)
        if found is None or _is_dear(found, coarse, dearer):
            continue
        if found.status in ENDED:
            return found
        sure = found.optimal and _is_settled(found, len(coarse.ladder))
        if sure and not is_pulled(from_plain(found.arcs), found) and verdict(found).ok:
            return found
    return None


def _is_settled(found: MissionSolution, coarse: int) -> bool:
    """Whether the last two meshes of one order agree on the objective, unless the tolerance has been met.

    The first `coarse` levels of the ladder are those of the coarse answer.
    """
    last = found.ladder[-1]
    same = [level for level in found.ladder[coarse:] if level.order == last.order and level.status == "solved"]
    if found.tolerance is not None or len(same) < 2 or last.order == FOUND_ORDER:
        return True
    return abs(same[-1].objective - same[-2].objective) <= SETTLED * abs(last.objective)


def verdict(found: MissionSolution) -> Report:
    """The judgement of the independent checks."""
    return verify_mission(found)


def _improved(
    climb: Climb,
    problem: TransferProblem,
    arcs: tuple[Arc, ...],
    legs: Sequence[Solution],
    tol: float | None,
    iterations: int,
) -> MissionSolution | None:
    """The arcs of an answer on fine meshes, once no mesh shows that one is missing or in vain."""
    spent = climb.work
    most = MOST_WORK + MOST_TIMES * spent
    if tol is None:
        climb.most_work = spent + most
    # Where the force is turned round at once nothing is left for many meshes; where it turns fast there is.
    turned = any(REVERSED in arc.kind for arc in arcs)
    climb.most_meshes = FEW_MESHES if turned else MOST_MESHES
    for _ in range(MOST_ROUNDS):
        settled = _settled(climb, problem, arcs, legs, (spent + most, iterations))
        if settled is None:
            return None
        known, first, found = settled
        arcs = known
        if first.solved:
            # Where controls keep to a limit they may be wrong between nodes on steps that fly them exactly.
            seen = all(arc.alike == (FREE, None) for arc in arcs)
            attempt, found = _of_high_order(climb, problem, first, found, tol, seen)
            # What meshes of low order do not show may be seen now, and is, before they are refined.
            arcs = known if attempt is first else improved(problem, known, found)
            if alike(arcs, known):
                before = len(climb.levels)
                last, error, met = climb.refined(attempt, tol, ACCURATE, STILL, seen)
                if turned and len(climb.levels) >= before + FEW_MESHES:
                    return None
                if attempt is not first and climb.levels[-1].status == "iteration limit":
                    # Along limits controls of high order may hardly be determined: those of low order are.
                    last, error, met = climb.refined(first, tol, ACCURATE, STILL, seen)
                found = answered(climb, last, error, met, tol)
                arcs = improved(problem, known, found) if found.optimal and last is not attempt else arcs
        legs = found.legs
        if alike(arcs, known):
            return structured(found, arcs=plain(arcs), reason=told(arcs, found))
    return None


def _settled(
    climb: Climb,
    problem: TransferProblem,
    arcs: tuple[Arc, ...],
    legs: Sequence[Solution],
    most: tuple[int, int],
) -> tuple[tuple[Arc, ...], Attempt, MissionSolution] | None:
    """The arcs that neither lack one nor have one in vain, the attempt at them and its answer.

    `most` is how much work there may be at all, and after how many iterations an attempt ends.
    """
    for _ in range(MOST_ROUNDS):
        climb.mission = mission_of(problem, arcs)
        path = path_of(problem, arcs, legs)
        for near in NEAR:
            if climb.work > most[0]:
                return None
            attempt = climb.attempt(path, most=most[1], near=near)
            if attempt.solved or attempt.answer.status == "stopped":
                break
        if attempt.solved and attempt.level.iterations > MOST_ITERATIONS:
            climb.valley = NEAR[0]
        if attempt.answer.status == "stopped":
            return arcs, attempt, answered(climb, attempt)
        if not attempt.solved:
            return None
        found = answered(climb, attempt)
        better = improved(problem, arcs, found)
        if alike(better, arcs):
            return better, attempt, found
        if len(better) > len(arcs):
            climb.staying = max(climb.staying, GROWING)
        arcs, legs = better, found.legs
    return None


def _of_high_order(
    climb: Climb,
    problem: TransferProblem,
    attempt: Attempt,
    found: MissionSolution,
    tol: float | None,
    seen: bool,
) -> tuple[Attempt, MissionSolution]:
    """The attempt and the answer on meshes of high order, where those it was found on are not fine enough.

    That is not `seen` by the errors of steps where controls keep to a limit.
    """
    if seen and attempt.largest_error <= (ACCURATE if tol is None else tol):
        return attempt, found
    course = Course.of(found.legs)
    path = attempt.path
    spans = [(begin, begin + leg.duration) for begin, leg in zip(path.begins, path.legs, strict=True)]
    onto = path.onto([(course.mesh(problem, span, ORDER), ORDER) for span in spans])
    finer = climb.on_finer(onto, most=2 * MOST_ITERATIONS)
    return (finer, answered(climb, finer)) if finer.solved else (attempt, found)
