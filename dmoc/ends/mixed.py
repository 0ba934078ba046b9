"""Ends of a body that turns where one of them speaks of its place alone, or of its attitude alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmoc.basics.quaternions import AXES, QUATERNION
from dmoc.basics.records import dataclass
from dmoc.ends.base import Boundary, State
from dmoc.ends.poses import Attitude, Pose
from dmoc.parts.rows import Row

FREE = (None,) * AXES


@dataclass(frozen=True)
class OneOfTwo(Boundary):
    """An end of a body that moves and turns, which asks for its place alone or for its attitude alone.

    Parameters
    ----------
    part : Boundary
        An end of the centre of mass, such as an orbit, or one of an attitude that turns; the other is free.
    """

    part: Boundary

    @property
    def dimension(self) -> int:
        return AXES

    @property
    def structure(self) -> tuple:
        # The numbers of the part are built into the rows: a twin with symbols is made of an end itself alone.
        built_in = [(name, getattr(self.part, name)) for name in self.part.adjustable]
        return type(self), type(self.part), self.part.structure, *built_in

    @property
    def turns_body(self) -> bool:
        return True

    @property
    def point(self) -> Boundary:
        return State(FREE, FREE) if self.part.turns_body else self.part

    @property
    def anchored(self) -> bool:
        return not self.part.turns_body and self.part.anchored

    @property
    def moves(self) -> bool:
        return self.part.moves

    def _whole(self, state: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """A state of the part with the entries that it does not speak of, which are free."""
        q, v = state
        if self.part.turns_body:
            return np.append(np.full(AXES, np.nan), q), np.append(np.full(AXES, np.nan), v)
        return np.append(q, np.full(QUATERNION, np.nan)), np.append(v, np.full(AXES, np.nan))

    def fixed(self) -> tuple[np.ndarray, np.ndarray]:
        return self._whole(self.part.fixed())

    def estimate(self, t: float, near: tuple | None = None) -> tuple[np.ndarray, np.ndarray]:
        return self._whole(self.part.estimate(t))

    def rows(self, t: Any, q: Any, v: Any, m: Any) -> list[Row]:
        mine = slice(AXES, None) if self.part.turns_body else slice(None, AXES)
        return self.part.rows(t, q[mine], v[mine], m)

    def words(self) -> str:
        return f"{self.part.words()}, {'any position' if self.part.turns_body else 'any attitude'}"


def with_both(inertia: Any, start: Boundary, goal: Boundary) -> dict[str, Boundary]:
    """Start and goal of a problem, each with a place and an attitude where one of the two has them.

    An end that says nothing of the place, or of the attitude, leaves it and its velocity or rate free. Ends
    stay as they are where the body has no inertia, or where neither has an attitude.

    Raises
    ------
    ValueError
        If the place of a body that turns has not three axes.
    """
    ends = {"start": start, "goal": goal}
    # Ends that were completed for reaction wheels are completed anew.
    bodies = {name: getattr(end, "body", end) for name, end in ends.items()}
    moves = any(end.has_position for end in bodies.values())
    if inertia is None or not moves or not any(end.turns_body for end in bodies.values()):
        return ends
    return {
        name: ends[name] if end.has_position and end.turns_body else _completed(name, end)
        for name, end in bodies.items()
    }


def _completed(name: str, end: Boundary) -> Boundary:
    if isinstance(end, Attitude):
        return Pose(None, None, end.quaternion, end.rate, end.other_way)
    if end.turns_body:
        return OneOfTwo(end)
    end = end.with_dimension(AXES)
    if end.dimension != AXES:
        raise ValueError(
            f"a body that turns moves in space: its {name} must have three axes; it has {end.dimension}"
        )
    if isinstance(end, State):
        return Pose(end.position, end.velocity, None, None)
    return OneOfTwo(end)
