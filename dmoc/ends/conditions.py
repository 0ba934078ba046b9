"""Any condition on the state at one end of a transfer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, checked, entries, number, short
from dmoc.basics.memory import remembered
from dmoc.basics.records import dataclass
from dmoc.effects.user_functions import as_column, tried
from dmoc.ends.base import Boundary, State
from dmoc.parts.rows import Row


@dataclass(frozen=True)
class Condition(Boundary):
    """Any condition function(t, q, v, m) = 0, in addition to the entries that a State fixes.

    Parameters
    ----------
    function : callable
        (t [s], q [m], v [m/s], m [kg]) -> a CasADi expression or a list of them, each zero where the
        condition holds. They must be independent of each other and of what `state` fixes.
    name : str
        Name of the rows, such as "circular".
    scale : float or sequence of float
        Typical size of each value, in its own unit.
    state : State, optional
        Entries of position and velocity that are fixed; none if not given.
    """

    function: Callable
    name: str = "condition"
    scale: float | Vector = 1.0
    state: State | None = None

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise ValueError(f"Condition: function must be a function (t, q, v, m); got {short(self.function)}")
        if not isinstance(self.name, str) or not self.name:
            raise ValueError(f"Condition: name must be a word; got {short(self.name)}")
        scales = entries(self.scale)
        if scales is None:
            scale: Any = number("scale", self.scale, "unit of the condition", positive=True)
        else:
            scale = tuple(number(f"scale[{i}]", s, "", positive=True) for i, s in enumerate(scales))
        checked(self, scale=scale)
        if self.state is not None:
            if not isinstance(self.state, State):
                raise ValueError(f"Condition: state must be a dmoc.State; got {short(self.state)}")
            self._check_values()

    @property
    def dimension(self) -> int:
        return 0 if self.state is None else self.state.dimension

    @property
    def structure(self) -> tuple:
        return type(self), self.function, self.name, self.scale

    def with_dimension(self, dimension: int) -> Condition:
        free = (None,) * dimension
        return replace(self, state=State(free, free)) if self.state is None else self

    def fixed(self) -> tuple[np.ndarray, np.ndarray]:
        return super().fixed() if self.state is None else self.state.fixed()

    def rows(self, t: Any, q: Any, v: Any, m: Any) -> list[Row]:
        values = as_column(self.function(t, q, v, m))
        count = values.numel()
        names = [self.name] if count == 1 else [f"{self.name}_{i + 1}" for i in range(count)]
        scales = np.broadcast_to(self.scale, (count,))
        return [Row(names[i], values[i] / float(scales[i]), 0.0, 0.0) for i in range(count)]

    def _check_values(self) -> None:
        n = self.dimension
        given = ca.SX.sym("t"), ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("m")
        remedy = "it must take (t, q, v, m) as CasADi expressions and give one or a list of them"
        name = f"Condition {self.name!r}: function"
        count = remembered(
            lambda: tried(name, self.function, list(given), remedy), "tried", name, self.function, n
        )
        if isinstance(self.scale, tuple) and len(self.scale) != count:
            raise ValueError(
                f"Condition {self.name!r}: scale has {len(self.scale)} entries but the function gives {count} "
                f"values; give one number or {count}"
            )

    def words(self) -> str:
        condition = f"the condition {self.name!r}"
        if self.state is None or np.isnan(self.state.fixed()).all():
            return condition
        return f"{self.state.words()}, {condition}"
