"""Links: holonomic constraints g(q) = 0 on where a body may be."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.effects.base import Body, Part


class Holonomic(Part):
    """A link that holds a body: it stays where g(q) = 0.

    A frozen dataclass that derives from this has one duty, `g`. The force of the link is found with the path,
    as `solution.reaction`, and does no work.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> from dmoc import Holonomic, State, TransferProblem, solve
    >>> @dataclass(frozen=True)
    ... class Wire(Holonomic):
    ...     steepness: float
    ...     def g(self, q):
    ...         return q[1] - self.steepness * q[0] ** 2
    >>> along = State((-1, 1), (0, 0)), State((1, 1), (0, 0))
    >>> problem = TransferProblem(1.0, *along, duration=2.0, links=[Wire(1.0)])
    >>> solution = solve(problem)
    >>> print(abs(solution.position[:, 1] - solution.position[:, 0] ** 2).max() < 1e-9)
    True
    """

    # The unit of g: the force of the link is then per unit of it.
    unit: ClassVar[str] = "m"

    # Whether it looks at the attitudes of the bodies that it holds.
    joins_attitudes: ClassVar[bool] = False
    # Whether a picture shows where it is, by one number.
    shown: bool = False

    @abstractmethod
    def g(self, q: Any) -> Any:
        """What the link keeps at zero [`unit`], one entry or a column, for a CasADi position q [m].

        Its slope in q must not vanish where g is zero: |q| - 1, or (|q|^2 - 1) / 2, but never (|q| - 1)^2.
        """

    def g_of(self, at: Mapping[str, Body]) -> Any:
        """The same for bodies by their names: `g` of the one that the link is `on`, or of the only one."""
        return self.g(at[getattr(self, "on", "")].position)

    @property
    def row_units(self) -> tuple[str, ...]:
        """The units of the entries of g; `unit` for as many as there are if it is empty."""
        return ()

    @property
    def holds(self) -> tuple[str, ...]:
        """The names of the bodies that it holds; an only body has an empty name."""
        return (getattr(self, "on", ""),)

    # Whether what it carries may come to one place by two ways round.
    @property
    def goes_round(self) -> bool:
        return False

    def led(
        self, at: dict[str, Body], fractions: np.ndarray, other_way: bool = False
    ) -> dict[str, Body] | None:
        """The body that it carries, by its name, led from its first to its last state, or the other way round.

        The states `at` are arrays of one row a time: a straight line, or as other links have led them. None
        where the link knows no way.
        """
        return None

    def lines(self, at: dict[str, Body]) -> list[np.ndarray]:
        """Lines that a picture draws of it for states of bodies, (times, points, dimension) each [m]."""
        return []

    def level(self, dimension: int) -> ca.Function | None:
        """The one number that is zero where its body may be, of its position [m], for a picture.

        None where it is no surface, and no wire in the plane: of attitudes, of several bodies or numbers, or of
        a link that has `lines`.
        """
        own = type(self).lines is Holonomic.lines
        if not own or self.joins_attitudes or len(self.holds) > 1:
            return None
        q = ca.SX.sym("q", dimension)
        g = ca.SX(self.g(q))
        return ca.Function("level", [q], [g]) if g.numel() == 1 else None

    def check_dimension(self, dimension: int) -> None:
        """Raise ValueError if the link has no meaning in this many dimensions."""

    def violation(self, value: float, unit: str) -> tuple[float, str]:
        """Size and unit of a row's violation for a person; `value` is its size in the row's own `unit`."""
        return value, unit or "-"
