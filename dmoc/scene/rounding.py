"""Problems that differ in how widely |F| is rounded at zero."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from dmoc.scene.problem import TransferProblem


def sharp_as(problem: TransferProblem, smoothing: float | None) -> TransferProblem:
    """The problem with |F| rounded as little as in an answer of it that rounds it less."""
    engine: Any = problem.actuator
    if smoothing is None or engine.smoothing is None or engine.smoothing <= smoothing:
        return problem
    return replace(problem, actuator=replace(engine, smoothing=smoothing))


def sharper(asked: Any, share: float) -> Any:
    """A transfer, a mission, a team or its timetable with |F| rounded over this part of each width, if less."""

    def less(actuator: Any) -> Any:
        width = getattr(actuator, "smoothing", None)
        return actuator if width is None or share >= 1 else replace(actuator, smoothing=share * width)

    def of_part(part: Any) -> Any:
        own = getattr(part, "actuator", None)
        return part if own is None else replace(part, actuator=less(own))

    if (team := getattr(asked, "team", None)) is not None:
        return replace(asked, team=sharper(team, share))
    if (members := getattr(asked, "members", None)) is not None:
        return replace(asked, members=tuple(sharper(one, share) for one in members))
    if (legs := getattr(asked, "legs", None)) is None:
        return of_part(asked)
    return replace(asked, actuator=less(asked.actuator), legs=tuple(map(of_part, legs)))


def sharp_as_parts(asked: Any, parts: Iterable[Any]) -> Any:
    """A mission, a team or its timetable with |F| rounded as little as in the parts of an answer.

    An answer may round |F| less than was asked for, by one factor in all its parts.
    """
    pairs = (
        (one.provenance.smoothing, own.actuator.smoothing)
        for one, own in zip(parts, asked.stretches, strict=True)
    )
    return sharper(asked, min((have / wide for have, wide in pairs if have and wide), default=1.0))
