"""Parts that may be left behind at several times: as early as may be, as late, or between two pushes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.basics.arguments import both_ends
from dmoc.chains.path import MissionPath
from dmoc.legs.legs import Leg
from dmoc.scene.mission import Mission

# An answer is another one if it costs less by more than this part of it [-].
LESS = 1e-6


def timed(mission: Mission, start: float, durations: np.ndarray) -> Mission:
    """A mission that begins at a time, and whose legs last given times within their bounds."""
    spans = iter(
        float(np.clip(duration, *leg.duration_bounds))
        for duration, leg in zip(durations, mission.stretches, strict=True)
    )
    legs = [replace(part, duration=next(spans)) if isinstance(part, Leg) else part for part in mission.legs]
    return replace(mission, legs=legs, duration=None, start_time=start)


def with_best_drops(climb: Any, first: Any, path_of: Callable[[Mission], MissionPath]) -> Any:
    """An answer, or a cheaper one from a start on which parts are left behind as early or as late as may be.

    What is dropped is no longer pushed, but neither does it brake any more: the cost may have a minimum at the
    earliest time and another one later. `path_of` makes the guess for a mission whose durations are known.
    """
    mission, sense = climb.mission, climb.mission.objective.sense
    had = [leg.duration for leg in first.path.legs]
    best = first
    for when, durations in _other_times(mission, sum(had)):
        if climb.interrupt.seen:
            break
        tried = climb.staged(path_of(timed(mission, first.path.begins[0], durations)))
        gain = sense * (best.level.objective - tried.level.objective) if tried.solved else 0.0
        if gain > LESS * abs(best.level.objective):
            climb.told = (
                f"; where parts are left behind as {when} as may be at first, {tried.level.objective:.6g} is "
                f"reached, else {first.level.objective:.6g}"
            )
            best = tried
    if climb.levels[-1] is best.level:
        return best
    # The last row of the table of meshes is that of the answer.
    again = climb.attempt(best.path, carried=True)
    return again if again.solved else best


def _other_times(mission: Mission, total: float) -> Iterator[tuple[str, np.ndarray]]:
    """Durations of all legs [s] with the drops whose time is free as early, then as late as may be."""
    bounds = np.array([leg.duration_bounds for leg in mission.stretches])
    free = bounds[:, 0] < bounds[:, 1]
    behind = [
        joint.right
        for joint in mission.joints[1:-1]
        if joint.right is not None
        and any(event.dropped for event in joint.events)
        and free[joint.right - 1 : joint.right + 1].all()
    ]
    if not behind:
        return
    if mission.duration is not None:
        total = float(np.clip(total, *both_ends(mission.duration)))
    for when, order in (("early", range(len(bounds))), ("late", reversed(range(len(bounds))))):
        durations, left = bounds[:, 0].copy(), total - bounds[:, 0].sum()
        # What the shortest legs leave belongs to the last ones, or to the first.
        for i in reversed(list(order)):
            more = min(max(left, 0.0), bounds[i, 1] - bounds[i, 0])
            durations[i] += more
            left -= more
        yield when, durations
