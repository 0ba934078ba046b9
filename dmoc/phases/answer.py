"""The answer of an attempt at a team of missions as a PhasedSolution."""

from __future__ import annotations

from typing import Any

from dmoc.missions.answer import at_limits, costs_of, in_time, mission_solution, outcome_of, worst_rows
from dmoc.phases.cuts import phased_cuts
from dmoc.phases.path import PhasedPath
from dmoc.phases.solution import PhasedSolution
from dmoc.phases.timetable import Timetable
from dmoc.results.facts import Error, Provenance
from dmoc.scene.clock import cautions_of, dates_of
from dmoc.teams.answer import in_distances, run_through


def answered(
    climb: Any, attempt: Any, error: Error | None = None, met: bool = True, tol: float | None = None
) -> PhasedSolution:
    """The answer of an attempt as a PhasedSolution; that of the last mesh solved if the time was over."""
    return in_time(_answered, climb, attempt, error, met, tol)


def _answered(climb: Any, attempt: Any, error: Error | None, met: bool, tol: float | None) -> PhasedSolution:
    plan, program, answer = attempt.program.mission, attempt.program, attempt.answer
    team, path = plan.team, attempt.path
    broken = run_through(phased_cuts(plan, path)) if attempt.solved else ""
    status, success, message = outcome_of(climb, attempt, error, met, tol, broken)
    about = Provenance(
        team.name,
        team.parameters,
        path.begins[0],
        team.objective.unit_with(team.actuator),
        options=climb.options,
        **dates_of(team),
    )
    of_legs, of_bodies = costs_of(program, answer.x), program.costs(answer.x)
    members = tuple(
        mission_solution(
            mission,
            path.of(i),
            of_legs[i * plan.count : (i + 1) * plan.count],
            mission.objective.sense * float(of_bodies[i]),
            answer.status,
            [attempt.level],
        )
        for i, mission in enumerate(plan.cut)
    )
    between = {name: values for name, values in path.forces.items() if name not in _of_joints(program)}
    steps = ", ".join(str(len(mesh) - 1) for mesh in path.mesh)
    return PhasedSolution(
        team,
        members,
        team.names,
        between,
        path.densities,
        attempt.level.objective,
        success,
        status,
        message,
        tuple(climb.levels),
        worst=() if success else in_distances(plan, worst_rows(program, answer, path)),
        warnings=_warnings(plan, path) if success else (),
        tolerance=tol,
        error=error,
        reason=f"{len(members)} bodies in {plan.count} phases of {steps} steps{climb.told}",
        provenance=about,
        joints=plan.order,
    )


def _of_joints(program: Any) -> set[str]:
    """The names of the groups of rows that belong to joints of bodies."""
    return {group.name for group in program.rows.groups if group.start < program.joint_rows}


def _warnings(plan: Timetable, path: PhasedPath) -> tuple[str, ...]:
    """Legs that end on a limit of their duration as stated, and phases that are as short as may be."""
    found = []
    for name, mission, mine in zip(plan.names, plan.missions, plan.leg_of, strict=True):
        lasts = [float(path.durations[mine == i].sum()) for i in range(len(mission.plan))]
        words = [f"{word} of {name}" for word in mission.leg_names]
        found += at_limits(zip(words, mission.stretches, lasts, strict=True))
    if short := plan.short(path.durations):
        found.append(
            f"joints of two bodies end at one time in phase {short[0] + 1}: another order of them may cost less"
        )
    return (*found, *cautions_of(plan.team))
