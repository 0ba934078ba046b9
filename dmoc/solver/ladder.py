"""The ladder: one problem solved on mesh after mesh, each from the answer of the one before."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from dmoc.diagnosis.cause import Cause
from dmoc.diagnosis.giving import Remedy
from dmoc.diagnosis.iterate import refuse_undefined_motion, refuse_undefined_rows, worst_in_units
from dmoc.guess.chart import chart_of, is_curved
from dmoc.guess.starting import starting_guess
from dmoc.ipopt.options import advice_of, barrier_from, ipopt_alone
from dmoc.ipopt.run import Interrupt
from dmoc.meshes.choices import coarse_to_fine
from dmoc.meshes.widths import rounding_stages
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.path import DiscretePath
from dmoc.motion.stability import refuse_unstable
from dmoc.nlp.solving import Progress
from dmoc.nlp.transcription import transcribe_onto
from dmoc.nlp.units import units_of
from dmoc.results.facts import Level
from dmoc.results.solution import Solution
from dmoc.results.switches import burns_unpaid
from dmoc.rungs import rung as rungs
from dmoc.rungs.full import at_full_force
from dmoc.rungs.rung import Rung, held_answer, nowhere_zero, rounded, settled, told
from dmoc.rungs.tube import FROM_HALFWAY, HALFWAY, around, in_tube, led, out_of_tube
from dmoc.scene.problem import TransferProblem

# The cause of a failure is looked for on meshes of up to this many nodes, where that takes little time.
MOST_EXPLAINED = 2000
# Where a transfer of free duration fails, its guess may be too short: another one lasts so many times as long.
LONGER = 10
# Where it was as long as may be, so many shorter durations are tried.
SOONER = 2
# One of several attempts ends after this many iterations: those that get there take 20 to 130, others wander.
MOST_TRYING = 150
# A refinement of a mesh ends after this many iterations, and then each other way to it after the number above.
MOST_REFINING = 300
# These statuses do not tell whether there is a path at all, so its cause is looked for.
UNEXPLAINED = ("infeasible", "restoration failed", "iteration limit", "failed")


class Ladder:
    """Climbs from mesh to mesh for one problem. Every attempt is a `Rung`, a value that nobody changes."""

    def __init__(
        self,
        problem: TransferProblem,
        options: dict[str, Any] | None = None,
        progress: Progress | None = None,
        compiled: bool = False,
        time_limit: float | None = None,
    ):
        self.problem, self.options, self.progress, self.compiled = problem, options, progress, compiled
        self.dynamics, self.interrupt = Dynamics.of(problem), Interrupt(time_limit)
        # Whether a problem that a message names has an answer, if somebody can say.
        self.holds: Callable[[Remedy], bool] | None = None
        self.patient = True  # a finer mesh is tried where a coarse one has no path
        self._limited = any("max_" in name for name in options or ())
        self.rungs, self._levels = list[Rung](), list[Level]()  # all attempts so far
        self._last: Rung | None = None  # the last one at the problem itself
        self.tell = self._levels.append  # takes attempts that were made elsewhere

    def climb_to(self, first: DiscretePath, given: Any = None) -> Rung:
        """The answer on the mesh of a first guess, by way of coarser meshes unless it has multipliers.

        On the coarsest mesh the guess is made anew from `given`, as the first guess was: if that one were
        carried there from a finer mesh, its controls would no longer fit its path.
        """
        refuse_unstable(self.dynamics, first, self.problem.start_time, self.problem.duration_bounds)
        order, meshes = coarse_to_fine(self.problem, first)
        anew = len(meshes) > 1 and not first.multipliers
        known = starting_guess(self.problem, meshes[0], order, first.hold, given) if anew else first
        refuse_undefined_motion(self.dynamics, self.problem, known)
        last = self._last
        if last and not last.solved:
            from dmoc.diagnosis.search import lacks_propellant

            if cause := lacks_propellant(self.problem, known, self):
                return replace(last, cause=cause)
        if first.multipliers:
            return self._explained(self.solve_on(first), first, None, None)
        cause, curved = None, is_curved(self.problem, first)
        # In the unknowns of a chart no wide rounding of |F| has to lead to the right paths.
        stages = [(mesh, None) for mesh in meshes] if curved else rounding_stages(meshes, self.problem)
        for (mesh, rounding), (following, _) in zip(stages, [*stages[1:], (None, None)], strict=True):
            if mesh is following and nowhere_zero(known, self.problem):
                continue
            this = first.order if mesh is first.mesh else order
            start, again = known.onto(mesh, this, first.hold), first.onto(mesh, this, first.hold)
            rung = self._solved_or_explained(start, again, rounding, cause, mesh is first.mesh)
            cause = None if rung.cause is None or rung.cause.coarse else rung.cause
            if rung.stopped or not (rung.solved or (self.patient and not (cause and cause.hopeless))):
                return rung
            # A coarse mesh may have no path where a finer one does: then go on from the first guess.
            known = rung.path if rung.solved else first
        return rungs.by_half(self.solve_on, rung, first) if self._unexplained(rung) else rung

    def _solved_or_explained(
        self, start: DiscretePath, first: DiscretePath, rounding: float | None, known: Cause | None, last: bool
    ) -> Rung:
        """An answer, or why there is none.

        From a guess it is tried in few iterations first, as the search for a cause may find a path; not on the
        last mesh if a cause is known from one before.
        """
        given = start.multipliers or (last and known) or self._limited
        quick = not given and len(start.position) <= MOST_EXPLAINED
        rung = self._solved_sooner_or_later(start, first, rounding, MOST_TRYING if quick else None)
        rung = self._explained(rung, start, rounding, known)
        if not quick or not self._unexplained(rung):
            return rung
        if (held := held_answer(self.problem, partial(self.try_on, rounding=rounding), start)) is not None:
            return replace(held, cause=rung.cause)
        return replace(self._solved_sooner_or_later(start, first, rounding), cause=rung.cause)

    def _solved_sooner_or_later(
        self, start: DiscretePath, first: DiscretePath, rounding: float | None, most: int | None = None
    ) -> Rung:
        """An attempt and, where the duration is free and it fails, another one with a longer duration."""
        rung = self.solve_on(start, rounding, most)
        if rung.solved or rung.stopped or not self.problem.free_duration:
            return rung
        shortest, longest = self.problem.duration_bounds
        if first.duration < longest:
            return self.solve_on(replace(first, duration=min(longest, LONGER * first.duration)), rounding, most)
        # The first guess was as long as may be: a moving target may be met sooner.
        for duration in np.geomspace(shortest, longest, 2 + SOONER)[-2:0:-1]:
            guess = starting_guess(self.problem, first.mesh, first.order, first.hold, None, duration)
            sooner = self.solve_on(guess, rounding, most)
            if sooner.solved or sooner.stopped:
                return sooner
        return rung

    def _unexplained(self, rung: Rung) -> bool:
        """Whether an attempt failed without a reason; one that the user cut short has a reason."""
        return rung.answer.status in UNEXPLAINED and not (self._limited or (rung.cause and rung.cause.words()))

    def _explained(self, rung: Rung, start: DiscretePath, rounding: float | None, known: Cause | None) -> Rung:
        """A failed attempt with its cause; if the search for it finds a path, the answer from there."""
        rung = replace(rung, cause=known)
        if known is not None or not self._unexplained(rung) or len(start.position) > MOST_EXPLAINED:
            return rung
        from dmoc.diagnosis.search import confirmed_cause

        problem = rounded(self.problem, rounding)
        cause = confirmed_cause(problem, start, self.tell, self.interrupt, self.problem)
        if self.interrupt.seen:
            return replace(rung, answer=replace(rung.answer, status="stopped"))
        found = cause.path
        return replace(rung, cause=cause) if found is None else self.solve_on(found, rounding, MOST_TRYING)

    def try_on(
        self,
        guess: DiscretePath,
        rounding: float | None = None,
        most: int = MOST_TRYING,
        pinned: bool = False,
        lean: float = 0.0,
    ) -> Rung:
        """One attempt of at most so many iterations, to see where a guess leads; `pinned` in its duration.

        With `lean` the answer is held near the guess, as strongly as `NLP.leaning` says.
        """
        problem, limits = rounded(self.problem, rounding), {"ipopt.max_iter": most}
        return self._attempt(guess, problem, limits, pinned=pinned, lean=lean)

    def ask(
        self, problem: TransferProblem, guess: DiscretePath, question: str, most: int = MOST_TRYING
    ) -> Rung:
        """One attempt of few iterations at another problem, whose answer helps; `question` says what it is."""
        return self._attempt(guess, problem, {"ipopt.max_iter": most}, question=question)

    def refine_on(self, guess: DiscretePath, pinned: bool = False, lean: float = 0.0) -> Rung:
        """Solve on a finer mesh from the answer on a coarser one, in a few hundred iterations or not at all.

        Where equally good paths differ in their duration Ipopt wanders from one to the other: what fails is
        tried again with the duration `pinned` to that of the coarser mesh, and with a wider rounding of |F| on
        the way. Pinned from the outset, the free duration comes last. `lean` is how strongly an answer is held
        near the guess. Around an attractor a path that leads nowhere walks in tubes first.
        """
        by_way = rungs.widths_on_the_way(self.problem)
        free: list[tuple[bool, list[float | None]]] = [(False, [None])]
        ways: list[tuple[bool, list[float | None]]] = [(True, [None]), (True, by_way)]
        if not self.problem.free_duration or burns_unpaid(self.problem):
            ways = [(False, by_way)]
        walks = not (lean or pinned) and around(self.problem, guess) is not None
        for pin, widths in ways + free if pinned else free + ways:
            start = guess
            for width in widths:
                most = MOST_TRYING if pin or width or walks else MOST_REFINING
                rung = self.try_on(start, width, most, pin, lean)
                if walks and not (pin or width):
                    rung = led(rung, self.ask, self.problem, start, self.try_on)
                start = rung.path if rung.solved else start
            if rung.stopped or rung.solved:
                break
        return rung

    def solve_on(self, guess: DiscretePath, rounding: float | None = None, most: int | None = None) -> Rung:
        """Solve on the mesh of a guess, in `most` iterations a try.

        A warm start that fails is tried again cold.
        """
        problem, limits = rounded(self.problem, rounding), {} if most is None else {"ipopt.max_iter": most}
        if guess.multipliers:
            # What takes longer from an answer near by wanders among paths that cost the same.
            few = {} if problem.actuator.smoothing is None else {"ipopt.max_iter": MOST_TRYING}
            warm = self._attempt(guess, problem, few | limits)
            if warm.solved or warm.stopped:
                return warm
            if few and (held := held_answer(self.problem, partial(self.try_on, rounding=rounding), guess)):
                return held
            guess = replace(guess, multipliers={})
        # In the unknowns of a chart Ipopt does not leave the guess for other revolutions.
        if is_curved(problem, guess):
            return self._attempt(guess, problem, limits)
        near = in_tube(problem, guess)
        onward = barrier_from(problem, guess) | limits
        if near is not None and (tubed := self._attempt(guess, near, HALFWAY | limits)).solved:
            guess, onward = out_of_tube(tubed.path), limits | FROM_HALFWAY
        here = partial(self._attempt, problem=problem, limits=onward)
        return led(here(guess), self.ask, problem, guess, here)

    def _attempt(self, guess: DiscretePath, problem: TransferProblem, limits: Any = None, **how: Any) -> Rung:
        """One attempt, and more where its answer hardly takes the force that its units were made for."""
        run: Callable[..., Rung] = partial(self._run, guess, **how)
        rung = at_full_force(run, problem, guess, limits or {}) or run(problem, limits)
        return rung if how.get("lean") else settled(rung, lambda path: self._run(path, problem, limits, **how))

    def _run(
        self,
        guess: DiscretePath,
        problem: TransferProblem,
        limits: dict[str, Any] | None = None,
        question: str = "",
        pinned: bool = False,
        lean: float = 0.0,
    ) -> Rung:
        last = self._last
        if last is not None and not question and self.interrupt.seen:
            return replace(last, answer=replace(last.answer, status="stopped"))
        begun = time.perf_counter()
        carried = last is not None and not np.array_equal(guess.mesh, last.nlp.mesh)
        units = units_of(problem, guess)
        chart = chart_of(problem, guess, units.origin)
        nlp = transcribe_onto(problem, guess, units, self.compiled, chart, ipopt_alone(self.options))
        watch = nlp.watch(problem, self.progress, self.interrupt)
        asked_of = nlp.leaning(guess, lean) if lean else nlp
        solver = asked_of.solver(self.options, bool(guess.multipliers), carried, watch, limits)
        built = time.perf_counter() - begun
        answer = asked_of.run(solver, problem, guess, pinned)
        # Later attempts start from answers, where all rows have values.
        if last is None and answer.status == "invalid number":
            refuse_undefined_rows(nlp, problem, guess)
        if lean:
            true = float(nlp.assembly.objective(answer.x, nlp.parameters(problem)))
            answer = replace(answer, objective=true)
        if watch.error is not None:
            raise watch.error
        level = replace(nlp.level(answer, built), question=question)
        asked = problem if question else rungs.answered(self.problem, problem)
        pull = nlp.pull(nlp.unpack(answer.x, problem), guess, lean) if lean else 0.0
        rung = Rung(len(self._levels), asked, nlp, answer, level, pinned=pinned, pull=pull)
        self.rungs.append(rung)
        self._levels.append(level)
        self._last = self._last if question else rung
        return rung

    def solution(self, rung: Rung, errors: dict[int, float] | None = None, **found: Any) -> Solution:
        """The answer of one rung as a Solution with the whole ladder; `errors` by the number of the rung.

        If the time was over there, the answer is that of the last mesh that was solved.
        """
        if rung.stopped and self.interrupt.late:
            return self._out_of_time(rung, errors, **found)
        known = errors or {}
        reason = "" if rung.cause is None or rung.solved else told(rung.cause, self.problem, self.holds)
        levels = tuple(replace(level, error=known.get(i)) for i, level in enumerate(self._levels))
        message = "a local optimum" if rung.solved else reason or advice_of(rung.answer.status, self.options)
        worst = () if rung.solved else worst_in_units(rung.nlp, rung.problem, rung.answer.x, rung.answer.g)
        more = {"worst": worst, "warnings": rung.warnings(), **found}
        solution = rung.nlp.solution(rung.problem, rung.answer, levels, message, self.options, **more)
        # What would be enough may have been left unproven.
        late = not (rung.solved or reason) and self.interrupt.late
        return rungs.cut_short(solution, self.interrupt.seconds, False) if late else solution

    def _out_of_time(self, rung: Rung, errors: dict[int, float] | None, **found: Any) -> Solution:
        """The best that there is when the time is over: the last answer to the problem, or the last iterate."""
        answers = [one for one in self.rungs if one.solved and not one.level.question]
        best = answers[-1] if answers else replace(rung, answer=replace(rung.answer, status="failed"))
        return rungs.cut_short(self.solution(best, errors, **found), self.interrupt.seconds, bool(answers))
