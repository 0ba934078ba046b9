"""The optima of a team that several guesses lead to: bodies pass each other on other sides."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from dmoc.scene.team import Team
from dmoc.solver.starts import SAME_OBJECTIVE, SAME_PATH, Optimum
from dmoc.teams.climb import TeamClimb, first_path
from dmoc.teams.guess import guessed, other_sides
from dmoc.teams.path import TeamPath

# Random bends are this part of the extent of a path [-].
BENT = 0.2


def team_optima(
    team: Team, starts: int, order: int | None = None, hold: bool = False, guess: Any = None
) -> list[Optimum]:
    """The distinct optima that `starts` guesses lead to, the best first.

    The first guess is the default one; then each pair that comes near passes on its other side, in all ways;
    then come random bends, the same ones every time.
    """
    found: list[Optimum] = []
    for _, (name, path) in zip(range(starts), _variants(team, order, hold, guess), strict=False):
        climb = TeamClimb(team, None, None, False, None)
        with climb.interrupt:
            tried = climb.from_guess(path)
        if tried.answer.status == "stopped":
            break
        if tried.solved:
            put(found, Optimum(tried.level.objective, tried.path, (name,)))
    return sorted(found, key=lambda optimum: team.objective.sense * optimum.objective)


def put(found: list[Optimum], new: Optimum) -> None:
    """Add an optimum, or its guess to one that is the same."""
    for i, old in enumerate(found):
        near = abs(new.objective - old.objective) <= SAME_OBJECTIVE * abs(old.objective)
        alike = len(new.path.legs) == len(old.path.legs)
        gaps = [
            np.abs(one.place - other.place).max() / (one.diagonal or 1.0)
            for one, other in zip(new.path.legs, old.path.legs, strict=alike)
            if len(one.place) == len(other.place)
        ]
        if near and alike and max(gaps, default=0.0) < SAME_PATH:
            found[i] = Optimum(old.objective, old.path, old.starts + new.starts)
            return
    found.append(new)


def _variants(team: Team, order: int | None, hold: bool, guess: Any) -> Iterator[tuple[str, TeamPath]]:
    """Names and guesses, the default one first."""
    base = first_path(team, order, None, hold, guess)
    yield "default", base
    if base.warm:
        return
    numerics = base.mesh, base.order, hold
    straight = guessed(team, numerics, guess, bent=False)
    for i, sides in enumerate(other_sides(team, straight)):
        # The first way is the one that the default guess takes where no side is nearer.
        if i:
            passed = "".join("+-"[side < 0] for side in sides if side)
            yield f"sides {passed}", guessed(team, numerics, guess, sides)
    draw = np.random.default_rng(0)
    fractions = base.legs[0].fractions[:, None]
    number = 0
    while True:
        number += 1
        legs = [
            leg.moved(BENT * leg.diagonal * np.sin(np.pi * fractions) * draw.uniform(-1, 1, leg.place.shape[1]))
            for leg in base.legs
        ]
        yield f"random bends {number}", TeamPath(tuple(legs), base.begins)
