"""Solve a mission, coarse to fine."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dmoc.basics.arguments import whole
from dmoc.basics.digits import lasting
from dmoc.missions.guess import guessed
from dmoc.missions.mission import Mission
from dmoc.missions.program import MissionPath, MissionProgram, kicks_of
from dmoc.missions.solution import Kick, MissionSolution
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.march import force_of
from dmoc.motion.mesh import uniform_mesh
from dmoc.motion.momenta import end_momenta
from dmoc.motion.reference import goal_miss
from dmoc.motion.scales import path_scales
from dmoc.nlp.ipopt import STATUSES, Answer, Interrupt, Watch
from dmoc.results.estimate import local_errors
from dmoc.results.facts import Error, Level, Provenance
from dmoc.results.solution import NOT_MET, OUT_OF_TIME, Solution, reported
from dmoc.scene.problem import TransferProblem
from dmoc.solver.meshes import A_TURN, UNEVEN, WIDEST_ROUNDING
from dmoc.solver.rung import rounded

# A leg has this order if none is asked for: inside a leg nothing switches, so that a high order pays.
ORDER = 6
# A leg has this many steps at each order, if no number is asked for.
STEPS = {2: 80, 4: 24, 6: 12, 8: 10}
# An attempt from a guess ends after this many iterations.
MOST_TRYING = 500
# A mesh is refined if its steps err by more than this part of the path [-], at most so many times.
ACCURATE, MOST_MENDED = 1e-5, 3
# Refinement to a tolerance ends after this many meshes, or on one of more steps than this.
MOST_MESHES, MOST_STEPS = 12, 20_000
# Where an attempt fails, the free durations are tried so many times as long.
OTHER_DURATIONS = (0.5, 2.0, 0.25, 4.0)


@dataclass(frozen=True)
class Attempt:
    """One run of Ipopt on one set of meshes."""

    program: MissionProgram
    answer: Answer
    level: Level

    @property
    def solved(self) -> bool:
        return self.answer.status == "solved"

    @property
    def path(self) -> MissionPath:
        return self.program.path(self.answer)


class Climb:
    """The attempts at one mission, in their order."""

    def __init__(self, mission: Mission, options: Any, progress: Any, time_limit: float | None, hold: bool):
        self.mission, self.options, self.progress, self.hold = mission, options or {}, progress, hold
        self.interrupt = Interrupt(time_limit)
        self.levels: list[Level] = []

    def attempt(
        self, path: MissionPath, rounding: float | None = None, most: int | None = None, carried: bool = False
    ) -> Attempt:
        """Solve on the meshes of a path."""
        begun, mission = time.perf_counter(), self.mission
        problems = [_rounded(problem, rounding) for problem in mission.stretches]
        program = MissionProgram.of(mission, problems, path)
        watch = self._watch(program)
        limits = {} if most is None else {"ipopt.max_iter": most}
        built = time.perf_counter() - begun
        answer = program.solve(path, limits | self.options, watch, carried)
        if watch.error is not None:
            raise watch.error
        steps = sum(len(leg.program.mesh) - 1 for leg in program.legs)
        level = Level(
            max(leg.program.scheme.order for leg in program.legs),
            steps,
            answer.iterations,
            mission.objective.sense * answer.objective * program.cost,
            built,
            answer.seconds,
            answer.status,
            evaluations=answer.evaluations,
        )
        self.levels.append(level)
        return Attempt(program, answer, level)

    def _watch(self, program: MissionProgram) -> Watch:
        def tell(iteration: int, objective: float, x: np.ndarray, g: np.ndarray) -> bool:
            cost = self.mission.objective.sense * objective * program.cost
            orders = max(leg.program.scheme.order for leg in program.legs)
            steps = sum(len(leg.program.mesh) - 1 for leg in program.legs)
            worst = program.worst(x.ravel(), g.ravel(), 1)
            name, size = (worst[0][0], worst[0][1]) if worst else ("", 0.0)
            return bool(self.progress(orders, steps, iteration, cost, name, size))

        return Watch(*program.sizes, tell if self.progress else None, self.interrupt)

    def from_guess(self, path: MissionPath) -> Attempt:
        """The first answer: |F| rounded widely at first, and other durations where that fails."""
        stages = self._stages()
        tried = self._staged(path, stages)
        if tried.solved or tried.answer.status == "stopped" or not self.mission.free_duration:
            return tried
        best = tried
        for factor in OTHER_DURATIONS:
            other = self._staged(_stretched(self.mission, path, factor), stages)
            if other.solved or other.answer.status == "stopped":
                return other
        return best

    def _staged(self, path: MissionPath, stages: list[float | None]) -> Attempt:
        for i, width in enumerate(stages):
            tried = self.attempt(path, width, MOST_TRYING, carried=i > 0)
            if not tried.solved:
                return tried
            path = tried.path
        return tried

    def _stages(self) -> list[float | None]:
        """Widths of the rounding of |F|, from wide to what is asked for."""
        own = [leg.actuator.smoothing for leg in self.mission.stretches if leg.actuator.smoothing is not None]
        if not own:
            return [None]
        count = max(int(np.ceil(np.log10(WIDEST_ROUNDING / min(own)))), 0)
        return [*(WIDEST_ROUNDING * 0.1**i for i in range(count)), None]

    def refined(self, attempt: Attempt, tol: float | None) -> tuple[Attempt, Error | None, bool]:
        """The answer on meshes that are fine enough, its estimated error, and whether that meets `tol`."""
        error, changes = None, []
        for _ in range(MOST_MENDED if tol is None else MOST_MESHES):
            errors = self._errors(attempt)
            worst = max(float(each.sum()) for each in errors)
            wanted = ACCURATE if tol is None else tol
            if tol is None and worst <= wanted:
                break
            finer = attempt.path.onto(_finer(attempt.path, errors))
            if sum(len(leg.mesh) - 1 for leg in finer.legs) > MOST_STEPS:
                break
            found = self.attempt(finer, carried=True)
            if not found.solved:
                found = self.attempt(_cold(finer), carried=True)
            if not found.solved:
                if found.answer.status == "stopped":
                    return found, error, False
                break
            changes.append(_change(attempt, found))
            attempt = found
            if tol is not None:
                error = self._error(attempt, changes)
                self.levels[-1] = replace(self.levels[-1], error=error.largest)
                if error.largest <= tol:
                    return attempt, error, True
        return attempt, error, tol is None

    def _error(self, attempt: Attempt, changes: list[float]) -> Error:
        """Estimated errors: of the steps of a leg in sum, of the objective, and the integrator's miss of a leg."""
        path, missed = attempt.path, 0.0
        for problem, leg, begin in zip(self.mission.stretches, path.legs, path.begins, strict=True):
            missed = max(missed, path_scales(leg).share(*goal_miss(Dynamics.of(problem), leg, begin)))
        worst = max(float(errors.sum()) for errors in self._errors(attempt))
        return Error(worst, _left(changes), missed)

    def _errors(self, attempt: Attempt) -> list[np.ndarray]:
        path = attempt.path
        return [
            local_errors(Dynamics.of(problem), leg, begin)
            for problem, leg, begin in zip(self.mission.stretches, path.legs, path.begins, strict=True)
        ]


def solve_mission(
    mission: Mission,
    order: int | None = None,
    steps: int | None = None,
    tol: float | None = None,
    hold: bool = False,
    guess: Any = None,
    options: dict[str, Any] | None = None,
    progress: Any = None,
    time_limit: float | None = None,
) -> MissionSolution:
    """Solve a mission; the arguments are those of `dmoc.solve`, and `steps` are those of each leg."""
    if steps is not None:
        whole("steps", steps, least=2)
    climb = Climb(mission, options, progress, time_limit, hold)
    given = mission.guess if guess is None else guess
    given = getattr(given, "path", given)
    if isinstance(given, MissionPath):
        path = given
        if order or steps:
            path = given.onto(_meshes(mission, path, order, steps))
    else:
        coarse = [(uniform_mesh(leg.steps or steps or STEPS[leg.order or order or ORDER]), leg.order or order or ORDER) for leg in mission.plan]
        path = guessed(mission, coarse, given)
        if steps is None:
            path = guessed(mission, _meshes(mission, path, order, steps), given)
    with climb.interrupt:
        first = climb.attempt(path) if path.warm else climb.from_guess(path)
        if not first.solved:
            return _answered(climb, first)
        if steps is None:
            regraded = first.path.onto(_meshes(mission, first.path, order, steps))
            if any(not np.array_equal(a.mesh, b.mesh) for a, b in zip(regraded.legs, first.path.legs, strict=True)):
                again = climb.attempt(regraded, carried=True)
                first = again if again.solved else first
        found, error, met = (first, None, True) if steps and tol is None else climb.refined(first, tol)
    return _answered(climb, found, tol, error, met)


def _meshes(
    mission: Mission, path: MissionPath, order: int | None, steps: int | None
) -> list[tuple[np.ndarray, int]]:
    """A mesh for each leg along a path: equal steps, or equal angles where it passes near an attractor."""
    found = []
    for leg, problem, mine in zip(mission.plan, mission.stretches, path.legs, strict=True):
        this = leg.order or order or ORDER
        count = leg.steps or steps
        rates = problem.attraction.rates(mine.place)
        at = mine.fractions
        angles = np.append(0.0, np.cumsum(0.5 * (rates[1:] + rates[:-1]) * np.diff(at)))
        turns = angles[-1] * mine.duration / (2 * np.pi)
        if count is None:
            have = (len(mine.mesh) - 1) * mine.order // this if mine.multipliers else 0
            count = max(STEPS[this], int(np.ceil(turns * A_TURN[this])), have)
        mesh = uniform_mesh(count)
        if rates.max() > UNEVEN * rates.min() > 0:
            mesh = np.interp(mesh, angles / angles[-1], at)
            mesh[0], mesh[-1] = 0.0, 1.0
        found.append((mesh, this))
    return found


def _finer(path: MissionPath, errors: Sequence[np.ndarray]) -> list[tuple[np.ndarray, int]]:
    """Meshes on which the steps that make up the errors of all legs are cut in two."""
    total = np.concatenate(errors)
    order = np.argsort(total)
    least = min(leg.order for leg in path.legs)
    small = np.cumsum(total[order]) <= 0.5 * 2.0**-least * total.sum()
    cut = np.ones(len(total), bool)
    cut[order[small]] = False
    found, at = [], 0
    for leg in path.legs:
        mine = cut[at : at + len(leg.mesh) - 1]
        at += len(mine)
        middles = 0.5 * (leg.mesh[1:] + leg.mesh[:-1])[mine]
        found.append((np.sort(np.concatenate([leg.mesh, middles])), leg.order))
    return found


def _change(coarse: Attempt, fine: Attempt) -> float:
    """What the objective changes from mesh to mesh, of itself [-]."""
    scale = max(abs(fine.level.objective), 1e-12 * fine.program.cost)
    return abs(fine.level.objective - coarse.level.objective) / scale


def _left(changes: list[float]) -> float:
    """The error left after the last change: as much as it, or less where changes fall fast."""
    last = changes[-1]
    fall = changes[-2] / last if len(changes) > 1 and last > 0 else 0.0
    return last / (fall - 1) if fall > 2 else last


def _rounded(problem: TransferProblem, rounding: float | None) -> TransferProblem:
    return problem if problem.actuator.smoothing is None else rounded(problem, rounding)


def _cold(path: MissionPath) -> MissionPath:
    return replace(path, legs=tuple(replace(leg, multipliers={}) for leg in path.legs), forces={})


def _stretched(mission: Mission, path: MissionPath, factor: float) -> MissionPath:
    """A path whose free legs last so many times as long, within their bounds."""
    legs = []
    for leg, problem in zip(path.legs, mission.stretches, strict=True):
        duration = float(np.clip(factor * leg.duration, *problem.duration_bounds))
        legs.append(replace(leg, duration=duration))
    begins = path.begins[0] + np.append(0.0, np.cumsum([leg.duration for leg in legs]))[:-1]
    return replace(path, legs=tuple(legs), begins=tuple(float(t) for t in begins))


def _answered(
    climb: Climb, attempt: Attempt, tol: float | None = None, error: Error | None = None, met: bool = True
) -> MissionSolution:
    """The answer of an attempt as a MissionSolution."""
    mission, program, answer = climb.mission, attempt.program, attempt.answer
    path, status = attempt.path, answer.status
    costs = program.costs(answer.x)
    about = Provenance(
        mission.name, mission.parameters, path.begins[0], mission.objective.unit_with(mission.actuator)
    )
    legs = tuple(
        _leg_solution(mission, i, path, costs[i], status, climb.levels[-1]) for i in range(len(path.legs))
    )
    if status == "solved":
        message, success = "a local optimum", True
    else:
        message, success = STATUSES[status].advice, False
    if status == "stopped" and climb.interrupt.late:
        status = OUT_OF_TIME
        message = STATUSES[OUT_OF_TIME].advice
    if success and not met:
        status, success = NOT_MET, False
        reached = "unknown" if error is None else f"{error.largest:.1e}"
        message = f"the estimated error is {reached}, you asked for {tol:g}; {STATUSES[NOT_MET].advice}"
    impulses = _impulses(mission, path, legs)
    mass = float(path.legs[-1].mass[-1])
    sizes = [kick.size for kick in impulses if kick.joint == "goal"]
    for event in mission.joints[-1].events:
        mass = event.burnt(mass, sizes.pop(0) if event.unknowns(1) else 0.0)
    return MissionSolution(
        mission,
        legs,
        impulses,
        path.own,
        path.forces,
        attempt.level.objective,
        mass,
        success,
        status,
        message,
        tuple(climb.levels),
        worst=() if success else tuple(program.worst(answer.x, answer.g)),
        warnings=_warnings(mission, legs) if success else (),
        tolerance=tol,
        error=error,
        reason=f"{len(legs)} legs of {', '.join(str(leg.steps) for leg in legs)} steps",
        provenance=replace(about, options=climb.options),
    )


def _leg_solution(
    mission: Mission, index: int, path: MissionPath, cost: float, status: str, level: Level
) -> Solution:
    leg = path.legs[index]
    problem = mission.fixed_at(index, path.begins[index], float(leg.mass[0]), leg.duration)
    dynamics = Dynamics.of(problem)
    momentum, velocity = end_momenta(dynamics, leg, problem.start_time)
    return Solution(
        problem=problem,
        path=leg,
        **reported(leg, velocity, momentum, force_of(dynamics, leg)),
        objective=mission.objective.sense * cost,
        success=status == "solved",
        status=status,
        message="a leg of a mission",
        ladder=(level,),
        provenance=Provenance.of(problem),
    )


def _impulses(mission: Mission, path: MissionPath, legs: Sequence[Solution]) -> tuple[Kick, ...]:
    found = []
    for joint in mission.joints:
        kicks = kicks_of(joint, path.own.get(joint.name), mission.dimension)
        if joint.left is None:
            time_, place = path.begins[0], path.legs[0].place[0]
        else:
            time_ = path.begins[joint.left] + path.legs[joint.left].duration
            place = path.legs[joint.left].place[-1]
        found += [Kick(joint.name, float(time_), place, change) for change in kicks]
    return tuple(found)


def _warnings(mission: Mission, legs: Sequence[Solution]) -> tuple[str, ...]:
    found = []
    for name, leg, stretch in zip(mission.leg_names, legs, mission.stretches, strict=True):
        bound = stretch.limit_of_duration(leg.duration)
        if bound is not None:
            other = "shorter" if bound == "shortest" else "longer"
            found.append(
                f"{name} ends on its {bound} duration of {lasting(leg.duration, 6)}: a {other} one may cost less"
            )
    return tuple(found)
