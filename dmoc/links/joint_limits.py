"""Limits of joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from dmoc.basics.arguments import checked, number, short
from dmoc.basics.digits import down, up
from dmoc.basics.records import dataclass
from dmoc.effects.base import Body
from dmoc.links.along import states_of
from dmoc.links.joint import Joint, room
from dmoc.parts.constraint import Constraint
from dmoc.parts.rows import Row


@dataclass(frozen=True)
class JointLimit(Constraint):
    """Keep a joint between two stops.

    Parameters
    ----------
    joint : Revolute or Prismatic
        One of the links.
    low, high : float or None
        Smallest and largest angle [rad] or way [m]; None leaves one side free.
    """

    joint: Any
    low: float | None = None
    high: float | None = None
    turns_body: ClassVar[bool] = True
    moves_body: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if not isinstance(self.joint, Joint) or self.joint.coordinates != 1:
            raise ValueError(f"JointLimit: joint must be a Revolute or Prismatic; got {short(self.joint)}")
        if self.low is None and self.high is None:
            raise ValueError("JointLimit: low and high are both None; give at least one of them")
        for name in ("low", "high"):
            if (value := getattr(self, name)) is not None:
                checked(self, **{name: number(f"JointLimit: {name}", value, self.unit)})
        if self.low is not None and self.high is not None and self.low >= self.high:
            raise ValueError(
                f"JointLimit: low must be less than high; got {self.low:g} and {self.high:g} {self.unit}"
            )

    @property
    def unit(self) -> str:  # type: ignore[override]
        return self.joint.coordinate_units[0]

    @property
    def limits_joint(self) -> bool:
        return True

    @property
    def bodies(self) -> tuple[str, ...]:
        return self.joint.holds

    @property
    def stops(self) -> tuple[float, ...]:
        return tuple(side for side in (self.low, self.high) if side is not None)

    @property
    def structure(self) -> tuple:
        return type(self), self.joint, self.low, self.high

    def rows_at(self, t: Any, at: Mapping[str, Body], u: Any, m: Any) -> list[Row]:
        low = -np.inf if self.low is None else self.low
        high = np.inf if self.high is None else self.high
        return [Row(self.joint.name, self.joint.coordinate(at), low, high, self.unit)]

    def speed_rows_at(self, at: Mapping[str, Body]) -> list[Row]:
        return []

    def seen_of(self, made: Any, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        at = states_of(made, q)
        base = at[self.joint.to] if self.joint.to else room(len(q))
        return self.joint.measured(base, at[self.joint.on]), v

    def excess(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        below = 0.0 if self.low is None else self.low - q[:, 0]
        above = 0.0 if self.high is None else q[:, 0] - self.high
        return np.maximum(0.0, np.maximum(below, above))

    def eased(self, slack: float) -> JointLimit:
        low = None if self.low is None else self.low - slack
        return replace(self, low=low, high=None if self.high is None else self.high + slack)

    def needs(self, eased: Any, index: int, amount: str) -> str:
        sides = [] if eased.low is None else [f"from {down(eased.low)}"]
        sides += [] if eased.high is None else [f"to {up(eased.high)}"]
        return f"a joint {self.joint.name} that goes {' '.join(sides)} {self.unit} ({self._given()})"

    def _given(self) -> str:
        sides = [] if self.low is None else [f"from {self.low:g}"]
        return "you gave " + " ".join(sides + ([] if self.high is None else [f"to {self.high:g}"]))

    def words(self) -> str:
        low = "" if self.low is None else f" at least {self.low:g} {self.unit}"
        high = "" if self.high is None else f" at most {self.high:g} {self.unit}"
        return f"keeps the joint of {self.joint.name}{' and'.join(filter(None, (low, high)))}"
