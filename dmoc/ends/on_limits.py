"""Boundary states that no path can have: beyond a limit, or on its edge and led beyond it by their velocity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dmoc.basics.quaternions import normalised, times
from dmoc.configurations.coordinates import ATTITUDE, Coordinates
from dmoc.configurations.of_problem import free_configuration

# A state on a limit may lie beyond it by the rounding of its own numbers: by this part of them [-].
ROUNDING = 1e-9
# A velocity leads beyond a limit if the state is so after this part of the shortest duration [-]. That must be
# by more than this part of its numbers, and at twice the time by less than so many times as much [-]: along an
# edge that bends it is four times as much, and straight across it twice.
AFTER, SEEN, STRAIGHT = 1e-6, 1e-13, 3.0


def refuse_ends_beyond_limits(problem: Any) -> None:
    """Raise ValueError if a boundary state of a transfer breaks a constraint, or must do so at once."""
    made = free_configuration(problem).coordinates
    for end in ("start", "goal"):
        _refuse(end, problem, made, problem.constraints, True)


def refuse_mission_ends(mission: Any, whole: Any) -> None:
    """The same of a mission, by the constraints of its first and of its last leg.

    What happens at the start or at the goal, such as an impulse, changes the velocity there. `whole` is the
    mission as one transfer without constraints.
    """
    made = free_configuration(whole).coordinates
    for end, at in (("start", 0), ("goal", -1)):
        constraints, events = mission.stretches[at].constraints, mission.joints[at].events
        try:
            _refuse(end, whole, made, constraints, not events)
        except ValueError as error:
            raise ValueError(f"{mission.leg_names[at]}: {error}") from error


def _refuse(end: str, problem: Any, made: Coordinates, constraints: Sequence[Any], keeps: bool) -> None:
    """The same of one end; whether it `keeps` its velocity along the path."""
    (shortest, longest), forth = problem.duration_bounds, 1.0 if end == "start" else -1.0
    # Of a goal of free duration every time must be impossible, as zones may move.
    lasts = [0.0] if end == "start" else [shortest, longest]
    position, velocity = getattr(problem, end).fixed()
    after = forth * AFTER * shortest
    soon = _moved(made, position, velocity, after * np.arange(3.0))
    for i, constraint in enumerate(constraints):
        state = constraint.seen_of(made, position[None], velocity[None])
        known = state[1] if constraint.limits_speed else state[0]
        if np.isnan(known).any() or (constraint.limits_speed and not keeps):
            continue
        size, name = np.abs(known).max() or 1.0, f"{type(constraint).__name__} (constraint {i + 1})"
        asked = f"{constraint.subject} {constraint.words()}; move the {end} or the constraint"
        excess = float(constraint.excess_at(np.array([problem.start_time + lasts[0]]), *state)[0])
        if excess > ROUNDING * size:
            raise ValueError(f"{end} breaks {name} by {excess:.3g} {constraint.unit}: {asked}")
        seen = constraint.seen_of(made, soon, np.repeat(velocity[None], 3, axis=0))
        if not keeps or constraint.limits_speed or np.isnan(seen[0]).any():
            continue
        if all(_leads_beyond(constraint, problem.start_time + last, after, seen, size) for last in lasts):
            way = "goes on beyond it" if end == "start" else "comes from beyond it"
            raise ValueError(f"{end} is on the edge of {name} and {way}: {asked}, or turn its velocity")


def _leads_beyond(constraint: Any, time: float, after: float, seen: tuple, size: float) -> bool:
    """Whether a state on a limit and two that follow it, equally far apart in time, lead straight beyond it."""
    at, soon, later = constraint.excess_at(time + after * np.arange(3.0), *seen)
    return bool(SEEN * size < soon - at and later - at < STRAIGHT * (soon - at))


def _moved(made: Coordinates, position: np.ndarray, velocity: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Coordinates after these times at a velocity, one row each; attitudes are unit quaternions."""
    blocks = zip(made.blocks, made.cut(position), made.parted(velocity), strict=True)
    moved = [
        normalised(at + after[:, None] * 0.5 * times(at, np.append(0.0, rate)))
        if block.kind == ATTITUDE
        else at + after[:, None] * rate
        for block, at, rate in blocks
    ]
    return np.concatenate(moved, axis=1)
