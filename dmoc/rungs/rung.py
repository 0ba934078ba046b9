"""One attempt on one mesh, as a value, and the problems that lead to its own: held or rounded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from dmoc.basics.digits import lasting
from dmoc.basics.records import dataclass
from dmoc.diagnosis.cause import Cause
from dmoc.diagnosis.giving import Remedy
from dmoc.ipopt.run import STATUSES, Answer
from dmoc.meshes.widths import WIDEST_ROUNDING, WIDEST_UNPAID
from dmoc.motion.path import DURATION, DiscretePath
from dmoc.nlp.solving import NLP
from dmoc.nlp.units import outgrown
from dmoc.results.facts import Level, off_optimum
from dmoc.results.solution import NOT_MET, OUT_OF_TIME, Solution
from dmoc.results.switches import burns_unpaid, has_linear_controls
from dmoc.scene.clock import cautions_of
from dmoc.scene.problem import TransferProblem

# A duration that was kept is told of if another may save more than this part of the objective, to first order
# [-].
WORTH_TELLING = 1e-5
# Where many paths cost the same an answer is held near its guess as strongly as this or, where that leads
# nowhere, as the next [-].
HELD = (1e-2, 1e-3)
# An attempt that is held ends after this many iterations: of four transfers between circles all got there.
MOST_HOLDING = 200
# An answer is let go by holding the next one near it, this many times as strongly [-]; where that leads nowhere
# the root of this is tried, and the root of that.
LESS, LEAST_LESS = 0.3, 0.7
# Each of these attempts ends after this many iterations, those that get there take 4 to 60, and there are no
# more than so many.
MOST_LETTING_GO, MOST_LET_GO = 60, 30
# On the way to a path that a wide rounding of |F| would find sooner, it is first this many times as wide. Where
# propellant burns that no cost counts it is over these parts of the largest thrust [-].
WIDER, UNPAID = 10.0, [WIDEST_UNPAID, 0.1, 0.01]
# A mesh that fails without a reason is tried again with half its steps if it has at least this many step ends.
LEAST_HALVED = 9
# A throttle is far from zero if it is everywhere more than this many times the widest rounding of |F| [-]: that
# changes |F| by 2 % at most.
FAR = 5.0


@dataclass(frozen=True)
class Rung:
    """One attempt on one mesh: the NLP, Ipopt's answer, its place in the ladder, the cause of a failure.

    `pinned` says that it kept the duration of its guess, free as that is; `notes` tell a user of the way to it.
    `pull` is by how much it is no optimum since it was held near its guess [-].
    """

    number: int
    problem: TransferProblem
    nlp: NLP
    answer: Answer
    level: Level
    cause: Cause | None = None
    pinned: bool = False
    notes: tuple[str, ...] = ()
    pull: float = 0.0

    @property
    def solved(self) -> bool:
        return self.answer.status == "solved"

    @property
    def stopped(self) -> bool:
        """Whether the user ended it."""
        return self.answer.status == "stopped"

    @cached_property
    def path(self) -> DiscretePath:
        """The path of the answer, with its multipliers."""
        return self.nlp.path(self.problem, self.answer)

    @property
    def outgrown(self) -> bool:
        """Whether the answer takes far less than the units were made for."""
        return outgrown(self.problem, self.nlp.units, self.path)

    @property
    def cost(self) -> float:
        """The objective with the sign of a minimum, in its own unit."""
        return self.problem.objective.sense * self.level.objective

    @property
    def gain(self) -> float:
        """What another duration may save, to first order and of the objective, by a change by its own length.

        Zero unless the duration of the guess was kept.
        """
        if not self.pinned:
            return 0.0
        # Where nothing is to be paid, the unit of the cost stands in for it.
        path, cost = self.path, max(abs(self.level.objective), self.nlp.units.cost)
        return float(np.abs(path.multipliers[DURATION]).max() * path.duration / cost)

    def warnings(self) -> tuple[str, ...]:
        """What a user should know of an answer that is right."""
        duration = self.path.duration
        bound = self.problem.limit_of_duration(duration)
        if not self.solved:
            return ()
        known = (*self.notes, *cautions_of(self.problem))
        if bound is not None:
            other = "shorter" if bound == "shortest" else "longer"
            told = f"the duration ends on its {bound} limit of {lasting(duration, 6)}"
            return (*known, f"{told}: a {other} one may cost less")
        if self.gain > WORTH_TELLING:
            told = f"the duration of {lasting(duration, 6)} was kept as it was: another one may cost less"
            return (*known, told)
        return known


def settled(made: Any, again: Callable[[Any], Any]) -> Any:
    """An attempt; while its answer takes far less than its units were made for, the one again from there.

    Of a transfer or of a chain of them. The last one that solved it, or the one that the user ended.
    """
    while made.solved and made.outgrown:
        other = again(made.path)
        if not other.solved:
            return other if other.answer.status == "stopped" else made
        made = other
    return made


def told(cause: Cause, problem: TransferProblem, holds: Callable[[Remedy], bool] | None) -> str:
    """A cause in words, with remedies that hold, if there is somebody to say which do."""
    # Between several attractors a guess may pass on the wrong side of one, where far more is needed.
    local = problem.attraction.first is not None and problem.attraction.lone is None
    return (cause.proven(holds) if holds else cause).words(local)


def by_half(solve_on: Callable[[DiscretePath], Rung], failed: Rung, first: DiscretePath) -> Rung:
    """A second attempt by way of half as many steps, where a mesh fails without a reason: it often works."""
    if len(first.mesh) < LEAST_HALVED:
        return failed
    half = solve_on(first.onto(np.append(first.mesh[:-1:2], 1.0), first.order, first.hold))
    if not half.solved:
        return half if half.stopped else failed
    return replace(solve_on(half.path.onto(first.mesh, first.order, first.hold)), cause=failed.cause)


def held_answer(problem: TransferProblem, try_on: Callable[..., Rung], start: DiscretePath) -> Rung | None:
    """An optimum by way of an answer that is held near a path and then let go, or None.

    Where many paths cost the same Ipopt wanders among them. The attempts are made by `try_on` from a path with
    a strength to hold it. The first begins without multipliers: with them the barrier is so low that a switch
    moves from node to node.
    """
    for lean in HELD if has_linear_controls(problem) else ():
        rung = try_on(replace(start, multipliers={}), most=MOST_HOLDING, lean=lean)
        if rung.stopped:
            return rung
        if rung.solved:
            return let_go(try_on, rung, lean)
    return None


def let_go(try_on: Callable[..., Rung], rung: Rung, lean: float, tolerance: float | None = None) -> Rung | None:
    """An optimum from an answer that was held so strongly; None if there is no way to it in a few attempts.

    Each answer is held near the one before, and begins with its multipliers: a switch then moves by little.
    Every second one is held as strongly as the one before it, which ends up nearer to the optimum, and the next
    one less. Held at a tenth each, and begun anew, attempts took a hundred iterations or wandered.
    """
    share = LESS
    for _ in range(MOST_LET_GO):
        if rung.pull <= off_optimum(tolerance):
            return rung
        tried = try_on(rung.path, most=MOST_LETTING_GO, pinned=rung.pinned, lean=share * lean)
        if tried.stopped:
            return tried
        if tried.solved:
            rung, lean = tried, share * lean
            share = 1.0 if share < 1 else LESS
        elif LEAST_LESS < share < 1:
            return None
        else:
            share = LESS if share == 1 else share**0.5
    return None


def at_rest(try_on: Callable[..., Rung], rung: Rung, lean: float, tolerance: float | None = None) -> Rung:
    """An optimum near a held answer on the same mesh, if there is a way to it; else that answer.

    On the first of several meshes it takes little, and all later answers begin near their own: that of the
    coarse trial lies a long way up a flat valley from them, and to go down there took minutes on the last mesh.
    """
    found = let_go(try_on, rung, lean, tolerance)
    # Another optimum that costs a hundredth more is no better answer.
    if found is None or found.stopped or found.cost - rung.cost > 0.01 * abs(rung.cost):
        return rung
    return found


def answered(asked: TransferProblem, used: TransferProblem) -> TransferProblem:
    """The problem that an attempt answers: as asked for, or with |F| rounded less."""
    wanted, have = asked.actuator.smoothing, used.actuator.smoothing
    sharper = wanted is not None and have is not None and have < wanted
    return replace(asked, actuator=used.actuator) if sharper else asked


def widths_on_the_way(problem: TransferProblem) -> list[float | None]:
    """Over what |F| is rounded on the way to an answer that is not found at once, the last as asked for."""
    rounding = problem.actuator.smoothing
    if rounding is None:
        return [None]
    return [*(UNPAID if burns_unpaid(problem) else [WIDER * rounding]), None]


def rounded(problem: TransferProblem, rounding: float | None) -> TransferProblem:
    """The problem with this rounding of |F| at zero."""
    if rounding is None:
        return problem
    engine: Any = problem.actuator
    return replace(problem, actuator=replace(engine, smoothing=rounding))


def nowhere_zero(path: DiscretePath, problem: TransferProblem) -> bool:
    """Whether |F| is far from zero all along a path: no wide rounding of it has to lead to the next answer."""
    engine, used = problem.actuator, path.control[:, -1]
    if engine.smoothing is None or not used.any():
        return False
    most = engine.bounds(problem.dimension)[1][-1]
    return bool(used.min() > FAR * max(engine.smoothing, WIDEST_ROUNDING) * most)


def unmet(error: float | None, tol: float | None) -> str:
    """That a tolerance is not met, in words; the estimated error may not be known."""
    reached = "unknown" if error is None else f"{error:.1e}"
    return f"the estimated error is {reached}, you asked for {tol:g}; {STATUSES[NOT_MET].advice}"


def cut_short(solution: Solution, seconds: float | None, is_answer: bool) -> Solution:
    """The best that there is when so many seconds were over: an answer on a coarser mesh, or an iterate."""
    over = f"the time limit of {seconds:g} s ended it"
    if not is_answer:
        return replace(solution, message=f"{over} before any mesh was solved: give more time")
    where = f"order {solution.order}, {solution.steps} steps"
    told = f"{over}; this is the answer on the last mesh that was solved ({where})"
    return replace(solution, success=False, status=OUT_OF_TIME, message=told)
