"""Why a solve failed, in the user's words and units, and what would be enough."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dmoc.basics.records import dataclass
from dmoc.diagnosis.giving import Remedy
from dmoc.motion.path import DiscretePath

# The ladder ends on a coarse mesh if the transfer needs over 5 % more than its limits [-]: a little may be due
# to the mesh, and a finer one is then worth its time.
HOPELESS = 0.05
# At most this many rows that cannot be met together are named, the worst first: a message must stay short.
MOST_NAMED = 5
# A row is named only if it is missed by more than this part of the worst miss [-].
NAMED_SHARE = 1e-3


@dataclass(frozen=True)
class Cause:
    """The cause of a failure: the limits that would be enough, or the rows that cannot be met.

    Attributes
    ----------
    path : DiscretePath or None
        A path that meets every row, if there is one after all.
    needs : tuple of tuples of Remedy
        Changes that would be enough, each by itself: "a force limit of 0.26 N (you gave 0.2 N)"; each followed
        by larger ones, should it not be enough.
    rows : tuple of str
        Rows that cannot be met together; empty where a limit explains it.
    excess : float
        How much more the transfer needs than its limits allow, relative to them [-]; infinite if no limit is
        to blame.
    zones : bool
        Whether zones are in the way, of which each alone would have to give way.
    turns : bool
        Whether the actuator can turn the body about every axis.
    coarse : bool
        Whether twice as many steps need so much less that the mesh may be to blame, and not the problem.
    shown : bool
        Whether a path of the problem with each change was found, so that no other proof is needed.
    """

    path: DiscretePath | None = None
    needs: tuple[tuple[Remedy, ...], ...] = ()
    rows: tuple[str, ...] = ()
    excess: float = np.inf
    zones: bool = False
    turns: bool = True
    coarse: bool = False
    shown: bool = False

    @property
    def hopeless(self) -> bool:
        """Whether no finer mesh can help."""
        return self.shown or (HOPELESS < self.excess < np.inf and not self.coarse)

    def proven(self, holds: Callable[[Remedy], bool]) -> Cause:
        """The same with those changes alone that are enough, as `holds` finds, each as small as that may be."""
        if self.shown:
            return self
        found = (next((one for one in need if holds(one)), None) for need in self.needs)
        return replace(self, needs=tuple((one,) for one in found if one is not None))

    def words(self, local: bool = False) -> str:
        """One line for a person; empty if nothing was found. `local` if other guesses may well need less."""
        parts = []
        if self.needs:
            where = "with steps as long as these " if self.coarse else ""
            what = "a path near the guess" if local else "the transfer"
            parts.append(f"{where}{what} needs {', or '.join(need[0].words for need in self.needs)}")
        if self.rows:
            parts.append(f"these rows cannot be met together: {', '.join(self.rows)}")
            if not self.turns:
                parts.append("the actuator makes no torque about some axis")
        return "; ".join(parts)
