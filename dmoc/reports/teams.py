"""Teams in words and tables: their bodies, and what holds between them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rich.console import Group, RenderableType
from rich.text import Text

from dmoc.basics.digits import lasting
from dmoc.reports.layout import pairs, plain_table
from dmoc.reports.missions import impulses_table

if TYPE_CHECKING:
    from dmoc.teams.solution import TeamSolution


def team_scene(team: Any, scene: Callable) -> RenderableType:
    """What is to be done, in words, body by body as `scene` says it of one, then what holds between them."""
    parts: list[RenderableType] = []
    for name, one in zip(team.names, team.members, strict=True):
        parts += [Text(name, "bold"), scene(one), Text()]
    words = [part.words() for part in team.together] or "nothing"
    return Group(*parts, Text("all of them", "bold"), pairs([("together", words), ("objective", "their sum")]))


def bodies_table(solution: TeamSolution) -> RenderableType:
    """What each body costs and weighs at the end; below it the least distance of each two."""
    unit = solution.provenance.objective_unit
    table = plain_table(["body", f"costs [{unit}]", "mass at its end [kg]"], slice(1, 3))
    for name, one in zip(solution.names, solution.members, strict=True):
        table.add_row(name, f"{one.objective or 0.0:.6g}", f"{one.final_mass:.6g}")
    near = plain_table(["two bodies", "least distance at a node [m]", "at"], slice(1, 3))
    for i, first in enumerate(solution.names):
        for second in solution.names[i + 1 :]:
            apart = solution.distance(first, second)
            when = float(solution.time[apart.argmin()])
            near.add_row(f"{first}, {second}", f"{apart.min():.6g}", lasting(when, 6) if when else "0 s")
    parts: list[RenderableType] = [Text("Bodies", "bold"), table, Text(), near]
    if hasattr(solution, "joints"):
        parts += [Text(), *_phases(solution)]
    return Group(*parts)


def _phases(solution: Any) -> list[RenderableType]:
    """Of a team of missions the phases of its clock, and the impulses of its bodies."""
    table = plain_table(["phase", "begins", "lasts", "order", "steps", *solution.names], slice(1, 5))
    for i, legs in enumerate(zip(*(one.legs for one in solution.members), strict=True)):
        begin = legs[0].provenance.start_time
        when = lasting(begin, 6) if begin else "0 s"
        names = [leg.provenance.problem_name for leg in legs]
        table.add_row(
            str(i + 1), when, lasting(legs[0].duration, 6), str(legs[0].order), str(legs[0].steps), *names
        )
    pairs = zip(solution.names, solution.members, strict=True)
    kicks = [(f"{kick.joint} of {name}", kick) for name, one in pairs for kick in one.impulses]
    return [Text("Phases", "bold"), table, *([Text(), *impulses_table(kicks)] if kicks else [])]
