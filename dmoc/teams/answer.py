"""The answer of an attempt at a team as a TeamSolution."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from dmoc.missions.answer import at_limits, costs_of, in_time, outcome_of, worst_rows
from dmoc.results.between import Cut
from dmoc.results.facts import Error, Provenance
from dmoc.results.solution import part_solution
from dmoc.scene.clock import cautions_of, dates_of
from dmoc.scene.team import Team
from dmoc.teams.cuts import team_cuts
from dmoc.teams.path import TeamPath
from dmoc.teams.solution import TeamSolution


def answered(
    climb: Any, attempt: Any, error: Error | None = None, met: bool = True, tol: float | None = None
) -> TeamSolution:
    """The answer of an attempt as a TeamSolution; that of the last mesh solved if the time was over."""
    return in_time(_answered, climb, attempt, error, met, tol)


def _answered(climb: Any, attempt: Any, error: Error | None, met: bool, tol: float | None) -> TeamSolution:
    team, program, answer = climb.mission, attempt.program, attempt.answer
    path = attempt.path
    broken = run_through(team_cuts(team, path)) if attempt.solved else ""
    status, success, message = outcome_of(climb, attempt, error, met, tol, broken)
    about = Provenance(
        team.name,
        team.parameters,
        team.start_time,
        team.objective.unit_with(team.actuator),
        options=climb.options,
        **dates_of(team),
    )
    costs = costs_of(program, answer.x)
    members = [
        part_solution(
            one := team.fixed_at(i, team.start_time, float(leg.mass[0]), path.duration),
            leg,
            one.objective.sense * float(cost),
            answer.status,
            attempt.level,
            "a body of a team",
        )
        for i, (leg, cost) in enumerate(zip(path.legs, costs, strict=True))
    ]
    return TeamSolution(
        team,
        tuple(members),
        team.names,
        path.forces,
        path.densities,
        attempt.level.objective,
        success,
        status,
        message,
        tuple(climb.levels),
        worst=() if success else in_distances(team, worst_rows(program, answer, path)),
        warnings=_warnings(team, path) if success else (),
        tolerance=tol,
        error=error,
        reason=f"{len(members)} bodies on {len(path.mesh) - 1} steps",
        provenance=about,
    )


def in_distances(team: Any, rows: Sequence[tuple[str, float, str]]) -> tuple[tuple[str, float, str], ...]:
    """Violated rows with those at the nodes of two bodies as what they lack of their distance [m]."""
    kept = {
        name: limit
        for name, (part, *_) in zip(team.pair_names(), team.pairs(), strict=True)
        if (limit := part.limit(team.dimension)) is not None
    }
    found = []
    for name, size, unit in rows:
        begins = (
            (begin, limit) for begin, limit in kept.items() if name.startswith((f"{begin}[", f"{begin} in "))
        )
        limit = next((limit for _, limit in begins), None)
        found.append((name, *((size, unit) if limit is None else limit.violation(size, ""))))
    return tuple(found)


def _warnings(team: Team, path: TeamPath) -> tuple[str, ...]:
    found = at_limits([("the duration", team.members[0], path.duration)], "limit")
    return (*found, *cautions_of(team))


def run_through(cuts: Iterable[Cut]) -> str:
    """What two bodies break between nodes by running through each other there, in words; empty if nothing."""
    cuts = [cut for cut in cuts if len(cut.steps)]
    if not cuts:
        return ""
    worst = max(cuts, key=lambda cut: cut.value)
    return (
        f"{worst.name} is broken by {worst.value:.3g} m: no way was found on which they pass each other; give "
        "them more room or time, keep less distance, or try another guess or a finer mesh"
    )
