"""Ends of a body that carries reaction wheels."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.quaternions import AXES, QUATERNION
from dmoc.basics.records import dataclass
from dmoc.bodies.wheels import MomentumLimit
from dmoc.ends.base import Boundary
from dmoc.parts.actuator import Actuator
from dmoc.parts.rows import Row


@dataclass(frozen=True)
class WithWheels(Boundary):
    """An end of the body alone, and what its reaction wheels hold there.

    Parameters
    ----------
    body : Boundary
        The end without wheels.
    momenta : sequence of float or None
        Angular momentum of each wheel [N m s]; an entry that is None is free.
    counted : bool
        Whether the time integrals of the momenta count from here.
    """

    body: Boundary
    momenta: tuple[float | None, ...]
    counted: bool

    @property
    def dimension(self) -> int:
        return self.body.dimension

    @property
    def structure(self) -> tuple:
        return type(self), type(self.body), self.body.structure, len(self.momenta)

    @property
    def has_position(self) -> bool:
        return self.body.has_position

    @property
    def turns_body(self) -> bool:
        return True

    @property
    def point(self) -> Boundary:
        return self.body.point

    @property
    def anchored(self) -> bool:
        return self.body.anchored

    @property
    def moves(self) -> bool:
        return self.body.moves

    def oriented(self, start: Boundary) -> Boundary:
        return replace(self, body=self.body.oriented(getattr(start, "body", start)))

    def the_other_way(self) -> Boundary:
        return replace(self, body=self.body.the_other_way())

    def _joined(self, state: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """A state of the body alone with the entries of the wheels before its attitude and its rate."""
        q, v = state
        held = np.array(self.momenta, float)
        turned = np.full(len(held), 0.0 if self.counted else np.nan)
        return (
            np.concatenate([q[:-QUATERNION], turned, q[-QUATERNION:]]),
            np.concatenate([v[:-AXES], held, v[-AXES:]]),
        )

    def fixed(self) -> tuple[np.ndarray, np.ndarray]:
        return self._joined(self.body.fixed())

    def estimate(self, t: float, near: tuple | None = None) -> tuple[np.ndarray, np.ndarray]:
        return self._joined(self.body.estimate(t))

    def rows(self, t: Any, q: Any, v: Any, m: Any) -> list[Row]:
        def alone(column: Any, last: int) -> Any:
            axes = column.numel() - last - len(self.momenta)
            return ca.vertcat(column[:axes], column[-last:])

        return self.body.rows(t, alone(q, QUATERNION), alone(v, AXES), m)

    def words(self) -> str:
        held = ", ".join("free" if value is None else f"{value:g}" for value in self.momenta)
        return f"{self.body.words()}, wheels with ({held}) N m s"


def with_wheels(actuator: Actuator, start: Boundary, goal: Boundary, limits: tuple) -> dict[str, Any]:
    """The ends and the constraints of a problem whose actuator has wheels; as they are where it has none.

    Ends that were completed for wheels before are completed anew.
    """
    bodies = [getattr(end, "body", end) for end in (start, goal)]
    count = len(actuator.wheel_axes)
    # What the wheels state themselves is stated anew below; what was stated beside them stays.
    others = tuple(limit for limit in limits if not isinstance(limit, MomentumLimit) or limit.is_beside(count))
    if count and all(body.turns_body for body in bodies):
        held = getattr(actuator, "start_momentum", None), getattr(actuator, "goal_momentum", None)
        free: tuple = (0.0,) * count, (None,) * count
        bodies = [
            WithWheels(body, momenta or otherwise, counted)
            for body, momenta, otherwise, counted in zip(bodies, held, free, (True, False), strict=True)
        ]
    return {"start": bodies[0], "goal": bodies[1], "constraints": (*others, *actuator.own_limits)}
