"""Where a transfer starts and ends."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np

from dmoc.basics.arguments import FreeVector, checked, entries, same_length, vector
from dmoc.basics.docstrings import Duties
from dmoc.basics.records import dataclass
from dmoc.parts.rows import Row


class Boundary(Duties):
    """A condition on time, position, velocity and mass at one end of the transfer.

    A frozen dataclass that derives from this has these duties:

    1. Say how many axes it has: `dimension`. A boundary that works in any number of axes gives 0, and
       `with_dimension` then gives one with the axes of the other end.
    2. State what must hold: `fixed` gives the entries of position and velocity that are plain numbers, `rows`
       every other condition. Rows must be independent of each other and of the fixed entries.
    3. Say in words what it is: `words`.

    What follows has a default, and better answers make better guesses and re-solves:

    4. `estimate`: a likely state for the starting guess; the default knows the fixed entries alone. `anchored`
       says whether its position can be trusted without a look at the other end.
    5. `structure`: everything that is built into `rows`. Fields named in `adjustable`, which may change from
       one solve to the next without a rebuild, are left out of it and may be symbols inside `rows`.

    Not its business: the other end, the path, meshes, units, scaling and multipliers. `t`, `q`, `v`, `m` are
    CasADi expressions in SI units; `q` and `v` are columns of the problem's dimension.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> from dmoc import Boundary, Row, State, TransferProblem, solve
    >>> @dataclass(frozen=True)
    ... class OnGround(Boundary):
    ...     height: float
    ...     adjustable = ("height",)
    ...     @property
    ...     def dimension(self):
    ...         return 2
    ...     def rows(self, t, q, v, m):
    ...         return [Row("height", q[1] - self.height, 0.0, 0.0, "m")]
    ...     def words(self):
    ...         return f"any point at a height of {self.height:g} m"
    >>> problem = TransferProblem(1.0, State((0, 1), (1, 0)), OnGround(0.0), duration=2.0)
    >>> print(abs(solve(problem).position[-1, 1]) < 1e-9)
    True
    """

    adjustable: ClassVar[tuple[str, ...]] = ()

    @property
    @abstractmethod
    def dimension(self) -> int:
        """Number of axes; 0 where the other end decides."""

    @property
    def structure(self) -> tuple:
        """The type and all that is built into the rows: equal for boundaries that one NLP can serve."""
        return (type(self),)

    @property
    def has_position(self) -> bool:
        """Whether it says where the body is; an attitude alone does not."""
        return True

    @property
    def motion(self) -> Any:
        """A function of the time [s] that gives the place [m] where it moves along a known path, else None."""
        return None

    @property
    def turns_body(self) -> bool:
        """Whether it says how the body is turned, too."""
        return False

    @property
    def point(self) -> Boundary:
        """The same for a point mass: without the attitude."""
        return self

    def oriented(self, start: Boundary) -> Boundary:
        """The same goal, told which of the two quaternions of an attitude the way from a start leads to."""
        return self

    def the_other_way(self) -> Boundary:
        """The same goal, whose attitude is reached by the turn the other way round."""
        return self

    def with_dimension(self, dimension: int) -> Boundary:
        """The same boundary with this number of axes, if its own `dimension` is 0; else itself."""
        return self

    def fixed(self) -> tuple[np.ndarray, np.ndarray]:
        """Position [m] and velocity [m/s] entries that are fixed numbers; NaN where they are not."""
        free = np.full(self.dimension, np.nan)
        return free, free.copy()

    def rows(self, t: Any, q: Any, v: Any, m: Any) -> list[Row]:
        """Further conditions, each independent of the others and of the fixed entries."""
        return []

    def estimate(self, t: float, near: tuple | None = None) -> tuple[np.ndarray, np.ndarray]:
        """A position and velocity for the starting guess; NaN where nothing is known.

        `near` is a position and velocity to be close to: those that the other end coasts to.
        """
        return self.fixed()

    @property
    def anchored(self) -> bool:
        """Whether the estimate of the position stands by itself, without the other end."""
        return not np.isnan(self.fixed()[0]).any()

    @property
    def moves(self) -> bool:
        """Whether its place or attitude is known, but only at a given time."""
        return self.anchored and bool(np.isnan(self.fixed()[0]).any())

    @abstractmethod
    def words(self) -> str:
        """One line for a person."""


@dataclass(frozen=True)
class State(Boundary):
    """A position and a velocity; entries that are None are free.

    Parameters
    ----------
    position : sequence of float or None
        [m], one entry an axis. An entry that is None is free; None alone frees all of them.
    velocity : sequence of float or None
        [m/s], the same.
    """

    position: FreeVector
    velocity: FreeVector

    def __post_init__(self) -> None:
        position, velocity = self.position, self.velocity
        if position is None and velocity is None:
            raise ValueError("State: position and velocity are both None; fix at least one of them [m], [m/s]")
        if position is None:
            position = (None,) * len(entries(velocity) or (velocity,))
        if velocity is None:
            velocity = (None,) * len(entries(position) or (position,))
        checked(
            self,
            position=vector("position", position, "m", free=True),
            velocity=vector("velocity", velocity, "m/s", free=True),
        )
        same_length("State", position=self.position, velocity=self.velocity)

    @property
    def dimension(self) -> int:
        return len(self.fixed()[0])

    def fixed(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.position, float), np.array(self.velocity, float)

    def words(self) -> str:
        return f"position {_entries(self.position)} m, velocity {_entries(self.velocity)} m/s"


def _entries(values: Any) -> str:
    return "(" + ", ".join("free" if value is None else f"{value:g}" for value in values) + ")"
