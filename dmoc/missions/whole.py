"""Rows of a mission as a whole: its duration, and that its path closes."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from dmoc.legs.legs import both_ends
from dmoc.missions.joining import Placed
from dmoc.missions.path import MissionPath
from dmoc.nlp.layout import LEG_START
from dmoc.parts.rows import Row
from dmoc.scene.mission import Mission


def row_to_drop(mission: Mission, path: MissionPath) -> int:
    """Which velocity is not asked for again at the end of a closed path: the largest at its start."""
    return int(np.argmax(np.abs(path.legs[0].start_velocity)))


def whole_rows(mission: Mission, legs: Sequence[Placed], drop: int) -> tuple[list[Row], np.ndarray, ca.SX]:
    """Rows of the mission as a whole: its duration, and that its path closes."""
    pool: list[tuple[np.ndarray, ca.SX]] = []

    def take(places: np.ndarray) -> ca.SX:
        pool.append((places, ca.SX.sym("x", len(places))))
        return pool[-1][1]

    first, last = legs[0], legs[-1]
    rows: list[Row] = []
    if mission.duration is not None:
        shortest, longest = both_ends(mission.duration)
        total = take(last.at(LEG_START, 0)) if len(legs) > 1 else ca.SX(0)
        total = total - take(first.at(LEG_START, 0)) if len(legs) > 1 else total
        free = "duration" in last.program.columns
        total = total + (take(last.at("duration", 0)) if free else last.program.problem.duration_bounds[0])
        rows.append(Row("duration", total, shortest, longest, "s"))
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
    places = np.concatenate([where for where, _ in pool])
    return rows, places, ca.vertcat(*[symbols for _, symbols in pool])
