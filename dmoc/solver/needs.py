"""Limits that are too small: made larger, and told of in words."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from dmoc.parts.forces import BallForce, BoxForce
from dmoc.parts.speed import SpeedLimit
from dmoc.scene.problem import TransferProblem


def force_words(actuator: Any, factor: float) -> str:
    """The limit that is enough, so many times the one given, beside that one."""
    if isinstance(actuator, BoxForce) and isinstance(actuator.limit, tuple):
        needed = ", ".join(up(limit * factor) for limit in actuator.limit)
        given = ", ".join(f"{limit:g}" for limit in actuator.limit)
        return f"force limits of ({needed}) N (you gave ({given}) N)"
    given = actuator.force_limit()
    name = "force limit" if isinstance(actuator, (BallForce, BoxForce)) else "largest thrust"
    return f"a {name} of {up(given * factor)} N (you gave {given:g} N)"


def speed_limit(problem: TransferProblem) -> float | None:
    return min((limit.limit for limit in problem.constraints if isinstance(limit, SpeedLimit)), default=None)


def times_of_limit(actuator: BallForce | BoxForce, control: np.ndarray) -> float:
    """How many times the limit of an actuator the largest of some forces is."""
    share = np.abs(control) / np.asarray(actuator.limit)
    return float(np.linalg.norm(share, axis=1).max() if isinstance(actuator, BallForce) else share.max())


def times(part: Any, factor: float) -> Any:
    """An actuator or a constraint with limits so many times as large."""
    names = {field.name for field in fields(part)} if is_dataclass(part) else set()
    limits = {name: getattr(part, name) for name in names & {"limit", "max_thrust", "box"}}
    wider = {
        name: tuple(factor * one for one in limit) if isinstance(limit, tuple) else factor * limit
        for name, limit in limits.items()
        if limit is not None
    }
    return replace(part, **wider) if wider else part


def up(value: float) -> str:
    """Four digits, rounded away from what is too little."""
    return _rounded(value, np.ceil)


def down(value: float) -> str:
    return _rounded(value, np.floor)


def _rounded(value: float, how: Any) -> str:
    if value <= 0:
        return "0"
    unit = 10.0 ** (np.floor(np.log10(value)) - 3)
    # a whole number of units stays what it is
    return f"{how(round(value / unit, 2)) * unit:.10g}"
