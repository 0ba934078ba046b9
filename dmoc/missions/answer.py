"""The answer of an attempt at a mission as a MissionSolution."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.digits import lasting
from dmoc.chains.path import MissionPath, kicks_of
from dmoc.chains.program import MissionProgram
from dmoc.diagnosis.iterate import SEEN, in_units
from dmoc.diagnosis.wrong_way import in_two_pieces, turned_round
from dmoc.ipopt.options import advice_of
from dmoc.ipopt.run import Answer
from dmoc.missions.solution import Kick, MissionSolution
from dmoc.results.facts import Error, Level, Provenance
from dmoc.results.solution import NOT_MET, Solution, part_solution
from dmoc.rungs.rung import cut_short, unmet
from dmoc.scene.clock import cautions_of, dates_of
from dmoc.scene.mission import Mission
from dmoc.scene.problem import TransferProblem

# What an answer of Ipopt is.
LOCAL = "a local optimum"


def answered(
    climb: Any, attempt: Any, error: Error | None = None, met: bool = True, tol: float | None = None
) -> MissionSolution:
    """The answer of an attempt as a MissionSolution; that of the last mesh solved if the time was over."""
    return in_time(_answered, climb, attempt, error, met, tol)


def in_time(make: Callable, climb: Any, attempt: Any, error: Error | None, met: bool, tol: float | None) -> Any:
    """What `make` makes of an attempt or, if the time was over in it, of the last one that was solved."""
    if attempt.answer.status != "stopped" or not climb.interrupt.late:
        return make(climb, attempt, error, met, tol)
    # Where legs were added since, the last one that was solved had others.
    held = climb.held
    same = held and len(held.path.legs) == len(climb.mission.stretches)
    attempt = (held if same else attempt).out_of_time()
    return cut_short(make(climb, attempt, error, True, tol), climb.interrupt.seconds, attempt.solved)


def outcome_of(
    climb: Any, attempt: Any, error: Error | None, met: bool, tol: float | None, broken: str = ""
) -> tuple[str, bool, str]:
    """Status, success and message of an attempt; `broken` says what its answer breaks between nodes."""
    status = attempt.answer.status
    if not attempt.solved:
        return status, False, climb.reason or advice_of(status, climb.options)
    if broken:
        return "infeasible", False, broken
    if not met:
        return NOT_MET, False, unmet(None if error is None else error.largest, tol)
    return status, True, LOCAL


def straightened(climb: Any, attempt: Any, most: int) -> Any:
    """An attempt, or one in at most so many iterations in which no thrust along a line points the wrong way."""
    if not any(map(in_two_pieces, climb.mission.stretches)):
        return attempt

    def legs_of(one: Any) -> tuple[Sequence[Solution], float]:
        found = _answered(climb, one, None, True, None)
        return found.legs, found.objective

    def again(legs: list) -> Any:
        other = climb.attempt(replace(attempt.path, legs=tuple(legs), forces={}), most=most)
        return other if other.solved else None

    return turned_round(attempt, legs_of, again, climb.mission.objective.sense)


def _answered(climb: Any, attempt: Any, error: Error | None, met: bool, tol: float | None) -> MissionSolution:
    mission, program, answer = climb.mission, attempt.program, attempt.answer
    path = attempt.path
    made = mission_solution(
        mission, path, costs_of(program, answer.x), attempt.level.objective, answer.status, climb.levels
    )
    steps = ", ".join(str(leg.steps) for leg in made.legs)
    status, success, message = outcome_of(climb, attempt, error, met, tol)
    return replace(
        made,
        success=success,
        status=status,
        message=message,
        ladder=tuple(climb.levels),
        worst=() if success else worst_rows(program, answer, path),
        warnings=_warnings(mission, made.legs) if success else (),
        tolerance=tol,
        error=error,
        reason=f"{len(made.legs)} legs of {steps} steps{climb.told}",
        provenance=replace(made.provenance, options=climb.options),
    )


def mission_solution(
    mission: Mission,
    path: MissionPath,
    costs: np.ndarray,
    objective: float,
    status: str,
    levels: Sequence[Level],
) -> MissionSolution:
    """A path as the solution of a mission; `costs` are those of its legs, as they are minimised."""
    unit = mission.objective.unit_with(mission.actuator)
    about = Provenance(mission.name, mission.parameters, path.begins[0], unit, **dates_of(mission))
    legs = tuple(_leg_solution(mission, i, path, costs[i], status, levels[-1]) for i in range(len(path.legs)))
    impulses = _impulses(mission, path, legs)
    mass = float(path.legs[-1].mass[-1])
    sizes = [kick.size for kick in impulses if kick.joint == "goal"]
    for event in mission.joints[-1].events:
        mass = event.burnt(mass, sizes.pop(0) if event.pushes else 0.0)
    return MissionSolution(
        mission,
        legs,
        impulses,
        path.own,
        path.forces,
        objective,
        mass,
        status == "solved",
        status,
        LOCAL,
        (levels[-1],),
        provenance=about,
    )


def worst_rows(
    program: MissionProgram, answer: Answer, path: MissionPath
) -> tuple[tuple[str, float, str], ...]:
    """The most violated rows and bounds, worst scaled violation first: name with leg or joint, size, unit."""
    found = []
    for scaled, place, column in program.worst(answer.x, answer.g):
        if scaled <= SEEN:
            break
        found.append((program.name_of(place, column), *_size_of(program, path, scaled, place, column)))
    return tuple(found)


def _size_of(
    program: MissionProgram, path: MissionPath, scaled: float, place: int, column: bool
) -> tuple[float, str]:
    for i, (placed, leg) in enumerate(zip(program.legs, path.legs, strict=True)):
        layout = placed.program.columns if column else placed.program.rows
        at = place - (placed.columns if column else placed.rows)
        if 0 <= at < layout.size:
            problem = program.mission.fixed_at(i, path.begins[i], float(leg.mass[0]), leg.duration)
            return in_units(placed.program, problem, layout.group_at(at), at, scaled, leg.duration)
    # The unknowns of joints have no bounds: this is a row.
    group = program.rows.group_at(place - program.first_row)
    component = (place - program.first_row - group.start) % len(group.labels)
    return scaled / float(group.scales[0, component]), group.units[component] or "-"


def costs_of(program: MissionProgram, x: np.ndarray) -> np.ndarray:
    """What each leg costs, without what belongs to joints, as it is minimised [unit of the objective]."""
    values, parameters = x * program.column_scales(), program.parameters()
    ends = [leg.columns for leg in program.legs[1:]] + [program.sizes[0]]
    found = np.zeros(len(program.legs))
    for block in program.blocks[: program.leg_blocks]:
        known, used = block.kernel.used
        given = values[block.columns], block.values[known], parameters[[block.first + place for place in used]]
        mine = int(np.searchsorted(ends, block.columns.min(), side="right"))
        found[mine] += float(ca.sum2(block.kernel.functions["cost"](*given)))
    return found


def _leg_solution(
    mission: Mission, index: int, path: MissionPath, cost: float, status: str, level: Level
) -> Solution:
    leg = path.legs[index]
    problem = mission.fixed_at(index, path.begins[index], float(leg.mass[0]), leg.duration)
    return part_solution(problem, leg, mission.objective.sense * cost, status, level, "a leg of a mission")


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
    parts = zip(mission.leg_names, mission.stretches, [leg.duration for leg in legs], strict=True)
    return (*at_limits(parts), *cautions_of(mission))


def at_limits(parts: Iterable[tuple[str, TransferProblem, float]], kind: str = "duration") -> list[str]:
    """What ends on a limit of its duration, in words: names, problems and durations [s] of parts."""
    found = []
    for name, problem, lasts in parts:
        bound = problem.limit_of_duration(lasts)
        if bound is not None:
            other = "shorter" if bound == "shortest" else "longer"
            ends = f"{name} ends on its {bound} {kind} of {lasting(lasts, 6)}"
            found.append(f"{ends}: a {other} one may cost less")
    return found
