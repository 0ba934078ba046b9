"""The rows of a mission as a whole: how long legs last together, and that its path closes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import both_ends
from dmoc.chains.joining import Given
from dmoc.chains.path import MissionPath
from dmoc.chains.within import Placed
from dmoc.motion.dynamics import Dynamics
from dmoc.nlp.layout import LEG_START, Layout
from dmoc.nlp.units import Units
from dmoc.parts.rows import Row
from dmoc.scene.mission import Mission

# The rows that belong to no joint are in the group of this name.
WHOLE = "mission"


def row_to_drop(mission: Mission, legs: Sequence[Placed], path: MissionPath) -> int:
    """Which velocity is not asked for again at the end of a closed path: the largest at its start, or none, -1.

    Where nothing does work the energy gives one of them, and a row for it would depend on the others.
    """
    still = all(event.keeps_energy for joint in mission.joints for event in joint.events)
    kept = still and all(_keeps_energy(leg.program.dynamics) for leg in legs)
    return int(np.argmax(np.abs(path.legs[0].start_velocity))) if kept else -1


def _keeps_energy(dynamics: Dynamics) -> bool:
    """Whether a leg has no controls, and no effect that does work or changes with time."""
    push = ca.SX(dynamics.point(*dynamics.symbols())[2])
    return not dynamics.controls and not dynamics.depends_on_time and push.is_zero()


def spans_of(mission: Mission, legs: int) -> list[tuple[int, int, Any]]:
    """The first and the last leg of each duration that is asked of several of them, and that duration [s]."""
    whole = [] if mission.duration is None else [(0, legs - 1, mission.duration)]
    return [*mission.sums, *whole]


def put_spans(mission: Mission, legs: int, rows: Layout, sides: Sequence[np.ndarray]) -> None:
    """Put those durations among the lower and upper bounds of the rows of joints, which `sides` are, scaled."""
    for i, (_, _, span) in enumerate(spans_of(mission, legs)):
        group = rows[WHOLE]
        for side, end in zip(sides, both_ends(span), strict=True):
            side[group.start + i] = end * group.scales[0, i]


def whole_rows(
    mission: Mission, legs: Sequence[Placed], drop: int, given: Given
) -> tuple[list[Row], np.ndarray, ca.SX]:
    """Rows of the mission as a whole: its duration, and that its path closes."""
    pool: dict[tuple[int, ...], ca.SX] = {}

    def take(places: np.ndarray) -> ca.SX:
        return pool.setdefault(tuple(places), ca.SX.sym("x", len(places)))

    first, last = legs[0], legs[-1]
    rows: list[Row] = []
    for begin, end, span in spans_of(mission, len(legs)):
        total = ca.SX(0)
        if begin < end:
            total = take(legs[end].at(LEG_START, 0)) - take(legs[begin].at(LEG_START, 0))
        free = "duration" in legs[end].program.columns
        lasts = take(legs[end].at("duration", 0)) if free else given.duration(end)
        rows.append(Row("duration", total + lasts, *both_ends(span), "s"))
    if mission.closes:
        begin = take(first.at("position", 0)) + first.program.units.origin
        end = take(last.at("position", -1)) + last.program.units.origin
        gap = take(last.at("goal.velocity", 0)) - take(first.at("start.velocity", 0))
        body = first.program.dynamics.configuration
        away = body.along(begin, end - begin)
        rows += [
            Row(f"closed.position.{name}", away[i], 0.0, 0.0, "m") for i, name in enumerate(body.velocity_names)
        ]
        rows += [
            Row(f"closed.velocity.{name}", gap[i], 0.0, 0.0, "m/s")
            for i, name in enumerate(body.velocity_names)
            if i != drop
        ]
    if not rows:
        return [], np.zeros(0, int), ca.SX(0, 1)
    return rows, np.concatenate([*map(np.array, pool)]), ca.vertcat(*pool.values())


def with_rows(rows: Layout, name: str, new: Sequence[Row], units: Units, bounds: list) -> Layout:
    """The layout of joints with one more group, whose scaled bounds are put behind the others."""
    if not new:
        return rows
    scale = np.array([[1 / units.of(row.unit) for row in new]])
    bounds.append(
        (
            np.array([row.lower for row in new]) * scale.ravel(),
            np.array([row.upper for row in new]) * scale.ravel(),
        )
    )
    return rows.add(name, "end", [row.name for row in new], 1, scale, None, [row.unit for row in new])
