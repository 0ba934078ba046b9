"""What holds between the bodies of a team: that they keep apart, or meet."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from itertools import combinations
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from dmoc.basics.arguments import checked, entries, flag, number, short
from dmoc.basics.digits import down
from dmoc.basics.docstrings import Duties
from dmoc.basics.records import dataclass
from dmoc.parts.constraint import Constraint
from dmoc.parts.detours import KeepOut
from dmoc.parts.rows import Row

# Two bodies change their frame at one time if the times differ by less than this part of them [-].
SAME = 1e-9


class Together(Duties):
    """Something that holds between bodies of a team, pair by pair.

    A frozen dataclass that derives from this has these duties:

    1. State what must hold, for two of its bodies: `rows` at every node of the clock that they share, or
       `goal_rows` at the end. Both see the difference of the two alone.
    2. Say in words what it is: `words`.
    3. Say what the way of one body as the other one sees it must keep, all along: `limit`.

    `between` names the bodies that it is about; all of the team if it is empty.
    """

    one_of = ("rows", "goal_rows")
    between: Sequence[str]

    def pairs(self, names: Sequence[str]) -> list[tuple[int, int]]:
        """The pairs of bodies that it speaks of, as places in a list of names."""
        mine = range(len(names)) if not self.between else [names.index(name) for name in self.between]
        return self.chosen(mine)

    def chosen(self, bodies: Sequence[int]) -> list[tuple[int, int]]:
        """The pairs of some bodies that rows are written for: each with each other one."""
        return list(combinations(bodies, 2))

    def rows(self, apart: Any) -> list[Row]:
        """Rows that hold at every node; `apart` is the place of one body from the other [m]."""
        return []

    def goal_rows(self, apart: Any, drift: Any) -> list[Row]:
        """Rows at the end, of the place and the velocity of one body from the other [m], [m/s]."""
        return []

    def limit(self, axes: int) -> Constraint | None:
        """What the way of one body keeps as the other one sees it, if anything."""
        return None

    def missed(self, apart: np.ndarray, drift: np.ndarray) -> float:
        """By how much goals with fixed entries break it [m or m/s]; NaN stands for an entry that is free."""
        return 0.0

    @property
    def meets(self) -> bool:
        """Whether it brings bodies to one place at the end."""
        return False

    @property
    def distance_kept(self) -> float:
        """The least distance between its bodies [m]; 0 where they may touch."""
        return 0.0

    def needs(self, slack: float) -> str:
        """In words, what would be enough if its rows gave way by `slack`."""
        return ""

    @abstractmethod
    def words(self) -> str:
        """One line for a person."""

    @property
    def who(self) -> str:
        """Its bodies in words."""
        return " and ".join(self.between) if self.between else "all bodies"


@dataclass(frozen=True)
class Apart(Together):
    """Every two bodies keep a distance all along.

    Rows act at the nodes that the bodies share; between nodes it is treated as a `KeepOut` of that radius
    around either of them, which moves along.

    Parameters
    ----------
    distance : float
        The least distance of their centres [m].
    between : sequence of str
        The names of the bodies that it is about; all of the team if there are none.
    """

    distance: float
    between: Sequence[str] = ()

    def __post_init__(self) -> None:
        checked(
            self,
            distance=number("Apart: distance", self.distance, "m", positive=True),
            between=_names("Apart", self.between),
        )

    def rows(self, apart: Any) -> list[Row]:
        ahead = apart / self.distance
        return [Row("distance", ca.dot(ahead, ahead), 1.0, np.inf)]

    def limit(self, axes: int) -> Constraint | None:
        return KeepOut((0.0,) * axes, self.distance)

    @property
    def distance_kept(self) -> float:
        return self.distance

    def needs(self, slack: float) -> str:
        # The row is |d|^2 / distance^2 >= 1 - slack.
        if slack >= 1:
            return f"no distance to be kept (you gave {self.distance:g} m)"
        least = down(self.distance * float(np.sqrt(1 - slack)))
        return f"a distance of at most {least} m (you gave {self.distance:g} m)"

    def words(self) -> str:
        return f"{self.who} keep {self.distance:g} m apart"


@dataclass(frozen=True)
class Meet(Together):
    """Bodies are at one place at the end, with one velocity; where and how fast is left open.

    Their own goals say what they still ask of that state: `Free()` for nothing.

    Parameters
    ----------
    velocity : bool
        Whether their velocities are equal, too.
    between : sequence of str
        The names of the bodies that meet; all of the team if there are none.
    """

    velocity: bool = True
    between: Sequence[str] = ()

    def __post_init__(self) -> None:
        flag("Meet: velocity", self.velocity)
        checked(self, between=_names("Meet", self.between))

    def chosen(self, bodies: Sequence[int]) -> list[tuple[int, int]]:
        """Each with the first: rows for all other pairs would follow from these."""
        return [(bodies[0], other) for other in bodies[1:]]

    def goal_rows(self, apart: Any, drift: Any) -> list[Row]:
        axes = range(apart.numel())
        rows = [Row(f"position.{'xyz'[i]}", apart[i], 0.0, 0.0, "m") for i in axes]
        if self.velocity:
            rows += [Row(f"velocity.{'xyz'[i]}", drift[i], 0.0, 0.0, "m/s") for i in axes]
        return rows

    def missed(self, apart: np.ndarray, drift: np.ndarray) -> float:
        both = np.append(apart, drift if self.velocity else 0.0)
        return float(np.nanmax(np.abs(both), initial=0.0))

    @property
    def meets(self) -> bool:
        return True

    def words(self) -> str:
        return f"{self.who} meet at the end" + (" with one velocity" if self.velocity else "")


class Frames(NamedTuple):
    """The frames that a body changes to on its way, in turn, and the time of each since the start [s].

    A time is NaN where it is not stated.
    """

    events: tuple[Any, ...] = ()
    times: tuple[float, ...] = ()

    @classmethod
    def of(cls, body: Any) -> Frames:
        """Those of a transfer or a mission."""
        if not hasattr(body, "joints"):
            return cls()
        spans = [leg.duration_bounds for leg in body.stretches]
        *fixed, whole = [low if low == high else np.nan for low, high in (*spans, body.duration_bounds)]
        ahead = np.cumsum([0.0, *fixed])
        behind = whole - np.cumsum([0.0, *fixed[::-1]])[::-1]
        times = np.where(np.isnan(ahead), behind, ahead)
        found = [
            (event, float(time))
            for joint, time in zip(body.joints, times, strict=True)
            for event in joint.events
            if event.changes_frame
        ]
        return cls(*map(tuple, zip(*found, strict=True))) if found else cls()

    def differ(self, other: Frames, all_along: bool) -> str:
        """In words, why two bodies are not in one frame at the end, or `all_along`; empty if they are."""
        if self.events != other.events:
            return "they do not change to the same frames in the same order"
        late = np.abs(np.subtract(self.times, other.times)) if all_along else np.empty(0)
        if np.isnan(late).any():
            return (
                "they change their frame at a time that is not stated; give the legs before it fixed durations"
            )
        if (late > SAME * np.maximum(self.times, 1.0)).any():
            return f"they change their frame {late.max():g} s apart; change the durations of the legs before it"
        return ""


def _names(owner: str, value: Any) -> tuple[str, ...]:
    """The names of two or more bodies; none stands for all.

    Raises
    ------
    ValueError
        If they are no names, fewer than two, or one is there twice.
    """
    found = entries(value)
    if found is None or not all(isinstance(name, str) for name in found):
        raise ValueError(f"{owner}: between must be the names of bodies; got {short(value)}")
    if len(found) == 1 or len(set(found)) < len(found):
        raise ValueError(f"{owner}: between must name two or more bodies, each once; got {short(value)}")
    return found
