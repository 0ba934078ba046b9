"""Missions in words and tables: their legs, what happens between them, and their impulses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Group, RenderableType
from rich.text import Text

from dmoc.basics.digits import lasting
from dmoc.reports.ends import dates_rows
from dmoc.reports.layout import effect_words, pairs, plain_table

if TYPE_CHECKING:
    from dmoc.missions.solution import Kick, MissionSolution
    from dmoc.scene.mission import Mission


def mission_scene(mission: Mission) -> RenderableType:
    """What is to be done, in words, leg by leg."""
    rows: list[tuple[str, Any]] = [
        ("body", f"{mission.mass:g} kg, axes {', '.join('xyz'[: mission.dimension])}"),
        ("start", _joint_words(mission, 0)),
    ]
    rows += [("start time", f"free between {' and '.join(lasting(t, 6) for t in mission.start_bounds)}")] * (
        mission.start_bounds[0] < mission.start_bounds[1]
    )
    legs = zip(mission.leg_names, mission.stretches, mission.plan, strict=True)
    for i, (name, leg, stated) in enumerate(legs):
        effects = [effect_words(effect) for effect in leg.effects] or ["no effect: the body is free"]
        told = [_span(leg), leg.actuator.words(), *effects, *(c.words() for c in leg.constraints)]
        own = [] if stated.objective is None else [f"adds its own: {stated.objective.words().rstrip('.')}"]
        rows.append((name, told + own))
        rows.append((mission.joints[i + 1].name, _joint_words(mission, i + 1)))
    if mission.duration is not None:
        ends = mission.duration if isinstance(mission.duration, tuple) else (mission.duration,)
        rows.append(("duration", " to ".join(lasting(end, 6) for end in ends)))
    rows.append(("objective", mission.objective.words().rstrip(".")))
    rows += dates_rows(mission)
    return pairs(rows)


def _span(leg: Any) -> str:
    shortest, longest = leg.duration_bounds
    if leg.free_duration:
        return f"free between {lasting(shortest, 6)} and {lasting(longest, 6)}"
    return lasting(shortest, 6)


def _joint_words(mission: Mission, index: int) -> list[str]:
    joint = mission.joints[index]
    words = [event.words() for event in joint.events]
    if joint.boundary is not None:
        where = joint.boundary.words()
        words = [*words, where] if joint.right is None else [where, *words]
    return words or ["one leg follows the other"]


def legs_table(solution: MissionSolution) -> RenderableType:
    """When each leg begins, how long it lasts, what it costs and weighs; below it the impulses."""
    mission = solution.require_problem()
    unit = solution.provenance.objective_unit
    table = plain_table(
        ["leg", "begins", "lasts", "order", "steps", f"costs [{unit}]", "mass at its end [kg]"], slice(1, 7)
    )
    for name, leg in zip(mission.leg_names, solution.legs, strict=True):
        table.add_row(
            name,
            lasting(leg.provenance.start_time, 6) if leg.provenance.start_time else "0 s",
            lasting(leg.duration, 6),
            str(leg.order),
            str(leg.steps),
            f"{leg.objective or 0.0:.6g}",
            f"{leg.final_mass:.6g}",
        )
    parts: list[RenderableType] = [Text("Legs", "bold"), table]
    if solution.arcs:
        parts.append(Text(f"found from a coarse answer: {solution.reason}"))
    if solution.impulses:
        parts += [Text(), *impulses_table([(kick.joint, kick) for kick in solution.impulses])]
    return Group(*parts)


def impulses_table(kicks: Sequence[tuple[str, Kick]]) -> list[RenderableType]:
    """Impulses with the names of their joints."""
    table = plain_table(["impulse at", "time", "velocity change [m/s]", "along each axis [m/s]"], slice(1, 3))
    for name, kick in kicks:
        along = ", ".join(f"{value:.5g}" for value in kick.change)
        when = lasting(kick.time, 6) if kick.time else "0 s"
        table.add_row(name, when, f"{kick.size:.8g}", f"({along})")
    return [Text("Impulses", "bold"), table]
