"""Solve a mission, coarse to fine."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.chains.path import MissionPath, cold
from dmoc.chains.program import MissionProgram
from dmoc.diagnosis.legs import mission_cause
from dmoc.ipopt.options import NEAR
from dmoc.ipopt.watch import Interrupt, Watch
from dmoc.missions.answer import answered, straightened
from dmoc.missions.attempt import Attempt, change, rounded_to
from dmoc.missions.drops import with_best_drops
from dmoc.missions.guess import first_path, meshes_along
from dmoc.missions.meshes import coarser, widths_of
from dmoc.missions.sharper import onto_magnitude
from dmoc.missions.solution import MissionSolution
from dmoc.results.estimate import left_after
from dmoc.results.facts import Error, Level
from dmoc.rungs.rung import settled
from dmoc.scene.mission import Mission
from dmoc.solver.ladder import UNEXPLAINED
from dmoc.solver.solve import check_numerics

# An attempt from a guess ends after this many iterations.
MOST_TRYING = 200
# A mesh is refined if its steps err by more than this part of the path [-], at most so many times.
ACCURATE, MOST_MENDED = 1e-5, 3
# Near to the answer Ipopt is asked for this [-]: at limits the barrier leaves an error of that size.
SHARP = 1e-12
# That is near the rounding of the rows: three iterations without a gain end a run that has no barrier left.
ENDING = {"ipopt.tol": SHARP, "ipopt.acceptable_iter": 3, "ipopt.acceptable_compl_inf_tol": 10 * SHARP}
# There a step must not break the rows by more than so many times what the path breaks, or than one scaled [-].
# Where the cost hardly depends on where legs end the path stays nearer: Ipopt would else leave the valley.
STAYING, NEARER, VALLEY = 1.0, 0.1, 1e-2
# Refinement to a tolerance ends after this many meshes, or on one of more steps than this.
MOST_MESHES, MOST_STEPS = 12, 20_000
# An impulse below so many times its rounding is none, once that is narrow enough [-].
IDLE, NARROW = 10.0, 1e-4
# Where an attempt fails, the free durations are tried so many times as long.
OTHER_DURATIONS = (0.5, 2.0, 0.25, 4.0)


class Climb:
    """The attempts at one mission, in their order."""

    # What sees it as Ipopt does, and what makes a solution of an attempt.
    program: Any = MissionProgram
    answered: Any = answered
    # Order, steps, whether forces are held, and the guess, as they were asked for.
    asked: tuple[int | None, int | None, bool, Any] = (None, None, False, None)
    # Whether all attempts are to be as sharp as those from nearly the answer.
    sharp = False
    # How near attempts from nearly the answer stay to it.
    staying = STAYING
    # So many meshes are refined to a tolerance, until so much work, and each in at most so many iterations.
    most_meshes, most_work = MOST_MESHES, np.inf
    most_finer: int | None = None
    # `near` for finer meshes where the cost hardly depends on where legs end: they begin without multipliers.
    valley: tuple[float, float] | None = None

    def __init__(self, mission: Any, options: Any, progress: Any, compiled: bool, time_limit: float | None):
        self.mission, self.options, self.progress = mission, options or {}, progress
        self.compiled = compiled
        self.interrupt = Interrupt(time_limit)
        self.levels: list[Level] = []
        # The last attempt that solved the mission itself, not one whose |F| is rounded more widely.
        self.held: Attempt | None = None
        # What is in the way, where no attempt succeeded, and what another start led to.
        self.reason = self.told = ""

    @property
    def work(self) -> int:
        """Iterations times steps so far, which take about equally long."""
        return sum(level.iterations * level.steps for level in self.levels)

    def solve(self, path: MissionPath, tol: float | None, given: bool) -> Any:
        """From a path to the answer; on its meshes alone if these are given and there is no tolerance."""
        with self.interrupt:
            first = self.first(path)
            if not first.solved:
                return self.answered(first)
            first = self.prepared(first, path)
            if given and tol is None:
                return self.answered(first)
            return self.answered(*self.finished(first, path, tol), tol)

    def first(self, path: MissionPath) -> Attempt:
        """The first answer or, where none is found, an attempt that failed and why."""
        first = self.attempt(path) if path.warm else self.from_guess(path)
        if not (first.solved or path.warm or self.interrupt.seen):
            first = self.otherwise(first, path)
        return first if first.solved else self.explained(path, first)

    def otherwise(self, attempt: Attempt, path: Any) -> Attempt:
        """What else is tried where a guess leads to no answer."""
        return attempt

    def prepared(self, first: Attempt, path: Any) -> Attempt:
        """The first answer with parts dropped at the best time, no thrust reversed, and graded steps."""
        order, steps, hold, guess = self.asked
        if not path.warm and guess is None:
            first = with_best_drops(self, first, lambda one: first_path(one, order, steps, hold, None))
        first = straightened(self, first, MOST_TRYING)
        first = self.regraded(first, meshes_along(self.mission, first.path, order, steps))
        return onto_magnitude(self, first)

    def finished(self, first: Attempt, path: Any, tol: float | None) -> tuple[Attempt, Error | None, bool]:
        """The answer on fine meshes, its error, and whether that is what was asked for."""
        return self.refined(first, tol)

    def attempt(self, path: MissionPath, *args: Any, **how: Any) -> Attempt:
        """Solve on the meshes of a path, and again where the answer hardly takes the force of its units."""
        made = self._run(path, *args, **how)
        return made if how.get("near") else settled(made, lambda found: self._run(found, *args, **how))

    def _run(
        self,
        path: MissionPath,
        rounding: float | None = None,
        most: int | None = None,
        carried: bool = False,
        near: tuple[float, float] | None = None,
    ) -> Attempt:
        """Solve on the meshes of a path.

        Where that is nearly the answer without multipliers, `near` says how near to limits Ipopt begins, and
        with which parameter of the barrier [-].
        """
        begun, mission = time.perf_counter(), self.mission
        problems = [rounded_to(problem, rounding) for problem in mission.stretches]
        program: MissionProgram = self.program.of(self.mission, problems, path, rounding)
        watch = self._watch(program)
        limits: dict[str, Any] = {} if most is None else {"ipopt.max_iter": most}
        if self.sharp:
            limits |= ENDING
        if near is not None:
            limits |= dict.fromkeys(NEAR, near[0]) | {"ipopt.mu_init": near[1], **ENDING}
            limits["ipopt.theta_max_fact"] = self.staying if self.valley is None else VALLEY
        built = time.perf_counter() - begun
        answer = program.solve(path, limits, self.options, watch, carried, self.compiled)
        if watch.error is not None:
            raise watch.error
        level = Level(
            *program.numerics,
            answer.iterations,
            mission.objective.sense * answer.objective * program.cost,
            built,
            answer.seconds,
            answer.status,
            evaluations=answer.evaluations,
        )
        self.levels.append(level)
        made = Attempt(program, answer, level)
        self.held = made if made.solved and rounding is None else self.held
        return made

    def _watch(self, program: MissionProgram) -> Watch:
        def tell(iteration: int, objective: float, x: np.ndarray, g: np.ndarray) -> bool:
            cost = self.mission.objective.sense * objective * program.cost
            worst = program.worst(x.ravel(), g.ravel(), 1)
            name, size = (program.name_of(*worst[0][1:]), worst[0][0]) if worst else ("", 0.0)
            return bool(self.progress(*program.numerics, iteration, cost, name, size))

        return Watch(tell if self.progress else None, self.interrupt)

    def from_guess(self, path: MissionPath) -> Attempt:
        """The first answer: |F| rounded widely at first, and other durations where that fails.

        Many steps come after few: in the first iterations on many MUMPS can take minutes, and nothing stops it.
        """
        if (few := coarser(path)) is not None:
            tried = self.from_guess(few)
            if tried.solved:
                tried = self.on_finer(tried.path.onto(path.meshes))
            if tried.solved or tried.answer.status == "stopped":
                return tried
        tried = self.staged(path)
        if tried.solved or tried.answer.status == "stopped" or not self.mission.free_duration:
            return tried
        for factor in OTHER_DURATIONS:
            other = self.staged(path.stretched(self.mission, factor))
            if other.solved or other.answer.status == "stopped":
                return other
        return tried

    def explained(self, path: MissionPath, failed: Attempt) -> Attempt:
        """A failed attempt; or the answer from a path that the search for the cause finds."""
        if failed.answer.status not in UNEXPLAINED or self.interrupt.seen:
            return failed
        starts = path, cold(failed.path)
        near, self.reason = mission_cause(failed.program, starts, self.levels.append, self.interrupt)
        return failed if near is None else self.staged(near)

    def staged(self, path: MissionPath) -> Attempt:
        """An answer from a path that may be far from it, with |F| rounded widely at first."""
        for i, width in enumerate(widths_of(self.mission)):
            tried = self.attempt(path, width, MOST_TRYING, carried=i > 0)
            if not tried.solved:
                return tried
            path = tried.path
            if width is not None and width <= NARROW:
                path = path.without_idle(self.mission, IDLE * width * path.diagonal / path.duration)
        return tried

    def regraded(self, attempt: Attempt, meshes: list[tuple[np.ndarray, int]]) -> Attempt:
        """The answer on meshes that suit the path found, where these are others."""
        same = [
            np.array_equal(leg.mesh, mesh) for leg, (mesh, _) in zip(attempt.path.legs, meshes, strict=True)
        ]
        again = attempt if all(same) else self.attempt(attempt.path.onto(meshes), carried=True)
        return again if again.solved else attempt

    def refined(
        self,
        attempt: Attempt,
        tol: float | None,
        accurate: float = ACCURATE,
        still: float = np.inf,
        seen: bool = True,
    ) -> tuple[Attempt, Error | None, bool]:
        """The answer on meshes that are fine enough, its estimated error, and whether that meets `tol`.

        Without a tolerance the steps of a leg are to err by no more than `accurate` in sum, and the objective
        by about the part `still` of it, which is `seen` on one more mesh at least if steps do not show it.
        """
        error: Error | None = None
        changes: list[float] = []
        for _ in range(MOST_MENDED if tol is None and np.isinf(still) else self.most_meshes):
            rest = left_after(changes) if changes else 0.0 if seen else np.inf
            if tol is None and attempt.largest_error <= accurate and rest <= still:
                break
            # Of arcs nothing is left to be found, but in other missions errors tell where limits set in.
            onto = attempt.path.finer(attempt.to_cut(tol or accurate, self.sharp, tol is not None))
            if sum(len(leg.mesh) - 1 for leg in onto.legs) > MOST_STEPS or self.work > self.most_work:
                break
            found = self.on_finer(onto, self.most_finer)
            if found.answer.status == "stopped":
                return found, error, False
            if not found.solved:
                break
            changes.append(change(attempt, found))
            attempt = found
            if tol is not None:
                error = self._error(attempt, changes, attempt.largest_error)
                self.levels[-1] = replace(self.levels[-1], error=error.largest)
                if error.largest <= tol:
                    return attempt, error, True
        return attempt, error, tol is None

    def on_finer(self, onto: MissionPath, most: int | None = None) -> Attempt:
        """The answer on finer meshes, from that on coarser ones."""
        if self.valley is not None:
            return self.attempt(cold(onto), near=self.valley, most=2 * MOST_TRYING)
        found = self.attempt(onto, carried=True, most=most)
        if found.solved or found.answer.status == "stopped" or most is not None:
            return found
        return self.attempt(cold(onto), carried=True)

    def _error(self, attempt: Attempt, changes: list[float], summed: float) -> Error:
        """Estimated errors: of a leg's steps in sum, of the objective, and the integrator's miss of a leg."""
        return attempt.counted(Error(summed, left_after(changes), attempt.missed))


def solve_mission(
    mission: Mission,
    order: int | None = None,
    steps: int | None = None,
    tol: float | None = None,
    hold: bool = False,
    mesh: Any = None,
    guess: Any = None,
    options: dict[str, Any] | None = None,
    progress: Any = None,
    compiled: bool = False,
    time_limit: float | None = None,
) -> MissionSolution:
    """Solve a mission; the arguments are those of `dmoc.solve`, and `steps` are those of each leg."""
    check_numerics(order, steps, tol, hold, options, progress, time_limit)
    if mesh is not None:
        raise ValueError("a mission has a mesh for each leg; give steps, or Leg(steps=...)")
    climb = Climb(mission, options, progress, compiled, time_limit)
    climb.asked = order, steps, hold, guess
    return climb.solve(first_path(mission, order, steps, hold, guess), tol, steps is not None)
