"""The optima of a mission that several guesses lead to: of other times and numbers of revolutions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.basics.digits import lasting
from dmoc.chains.path import MissionPath
from dmoc.guess.open_ends import turned_around
from dmoc.missions.climb import OTHER_DURATIONS, Climb
from dmoc.missions.drops import timed
from dmoc.missions.guess import first_path, likely_durations
from dmoc.scene.mission import Mission
from dmoc.solver.starts import SAME_OBJECTIVE, Optimum

# Two answers are one optimum only if their legs last as long but for this part of the mission's duration [-].
SAME_TIMES = 1e-2
# Start times are tried at these parts of the interval that is free [-].
STARTS = (0.1, 0.9, 0.3, 0.7)


def mission_optima(
    mission: Mission, starts: int, order: int | None = None, hold: bool = False, guess: Any = None
) -> list[Optimum]:
    """The distinct optima that `starts` guesses lead to on the first meshes, the best first.

    The guesses are the default one, then such with free legs that last other times, that start at other times
    and, around a lone attractor, that take more and fewer revolutions, each in turn; then random durations and
    start times. The same numbers are drawn every time.
    """
    found: list[Optimum] = []
    for _, (name, path) in zip(range(starts), _variants(mission, order, hold, guess), strict=False):
        climb = Climb(mission, None, None, False, None)
        with climb.interrupt:
            attempt = climb.from_guess(path)
            # On a mesh that is too coarse for its path an answer may seem cheaper than any true one.
            attempt = climb.refined(attempt, None)[0] if attempt.solved else attempt
        if attempt.answer.status == "stopped":
            break
        if attempt.solved:
            _add(found, Optimum(attempt.level.objective, attempt.path, (name,)))
    return sorted(found, key=lambda optimum: mission.objective.sense * optimum.objective)


def _add(found: list[Optimum], new: Optimum) -> None:
    """Add the start of an optimum to an equal one that was found before, or else the optimum to the list."""
    times = _times(new.path)
    for i, old in enumerate(found):
        near = abs(new.objective - old.objective) <= SAME_OBJECTIVE * abs(old.objective)
        if near and np.abs(_times(old.path) - times).max() < SAME_TIMES * times[1:].sum():
            found[i] = replace(old, starts=old.starts + new.starts)
            return
    found.append(new)


def _times(path: Any) -> np.ndarray:
    """When a mission begins and how long its legs last [s]."""
    return np.array([path.begins[0], *(leg.duration for leg in path.legs)])


def _variants(mission: Mission, order: int | None, hold: bool, guess: Any) -> Iterator[tuple[str, MissionPath]]:
    """Names and guesses; they end where nothing is free."""
    base = first_path(mission, order, None, hold, guess)
    yield "default", base

    def at(start: float, durations: np.ndarray) -> MissionPath:
        return first_path(timed(mission, start, durations), order, None, hold, None)

    usual, begin = likely_durations(mission), base.begins[0]
    families = [
        _longer(mission, usual, begin, at),
        _later(mission, usual, at),
        _turned(mission, base, order, hold),
    ]
    while families:
        for family in tuple(families):
            if (one := next(family, None)) is None:
                families.remove(family)
            else:
                yield one
    if mission.free_duration or isinstance(mission.start_time, tuple):
        yield from _drawn(mission, at)


def _longer(mission: Mission, usual: np.ndarray, begin: float, at: Any) -> Iterator[tuple[str, MissionPath]]:
    for factor in OTHER_DURATIONS if mission.free_duration else ():
        yield f"durations x {factor:g}", at(begin, factor * usual)


def _later(mission: Mission, usual: np.ndarray, at: Any) -> Iterator[tuple[str, MissionPath]]:
    earliest, latest = mission.start_bounds
    for share in STARTS if latest > earliest else ():
        start = earliest + share * (latest - earliest)
        yield f"start at {lasting(start, 3)}", at(start, usual)


def _turned(
    mission: Mission, base: MissionPath, order: int | None, hold: bool
) -> Iterator[tuple[str, MissionPath]]:
    lone = mission.stretches[0].attraction.lone
    if lone is None or mission.dimension < 2 or base.attitudes:
        return
    center = lone.place(mission.dimension)
    times = [begin + leg.duration * leg.fractions for begin, leg in zip(base.begins, base.legs, strict=True)]
    every, places = np.concatenate(times), base.place
    shares = (every - every[0]) / (every[-1] - every[0])
    for turns in (1, -1, 2, -2):
        around = center + turned_around(places - center, turns * shares)
        yield f"{turns:+d} revolutions", first_path(mission, order, None, hold, (every, around))


def _drawn(mission: Mission, at: Any) -> Iterator[tuple[str, MissionPath]]:
    """Random durations and start times, without end."""
    # The seed is fixed: a second run must find the same optima.
    draw, number = np.random.default_rng(0), 0
    logs = np.log([leg.duration_bounds for leg in mission.stretches])
    while True:
        number += 1
        start = draw.uniform(*mission.start_bounds)
        yield f"draw {number}", at(start, np.exp(draw.uniform(logs[:, 0], logs[:, 1])))
