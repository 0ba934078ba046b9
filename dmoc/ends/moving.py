"""A boundary state that moves along a known path, and turns with it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import short
from dmoc.basics.quaternions import AXES, QUATERNION, columns_of
from dmoc.basics.records import dataclass
from dmoc.effects.user_functions import as_column, tried
from dmoc.ends.base import Boundary
from dmoc.parts.rows import Row

# The remedy that is told where a function of time given to `Moving` cannot be used.
OF_TIME = "it must take a CasADi time [s] and give {} numbers: write it with casadi's functions"


@dataclass(frozen=True)
class Moving(Boundary):
    """A state that moves along a known path: the body is there at the time the transfer starts or ends.

    With an attitude it turns, too, as a tumbling target does: the body has that attitude then. Where
    this has no attitude, or no position, and the other end has one, the body is free in it.

    Parameters
    ----------
    position : callable or None
        Function of the time [s], a CasADi symbol, that gives the position [m], one entry an axis; None for an
        attitude alone.
    velocity : callable, "matched" or None
        Function of the time that gives the velocity [m/s]; "matched" is the derivative of the
        position, None leaves the velocity free (an interception).
    attitude : callable, optional
        Function of the time that gives a quaternion from body to space, scalar first; it is made a unit one.
    rate : callable, "matched" or None
        Function of the time that gives the angular rate in body axes [rad/s]; "matched" is that of the
        attitude, None leaves it free.
    """

    position: Callable | None
    velocity: Callable | str | None = "matched"
    attitude: Callable | None = None
    rate: Callable | str | None = "matched"

    def __post_init__(self) -> None:
        if self.position is None and self.attitude is None:
            raise ValueError("Moving: position and attitude are both None; give a function of the time for one")
        for name, unit in (("position", "m"), ("attitude", "-")):
            given = getattr(self, name)
            if given is not None and not callable(given):
                fixed = "State(position, velocity)" if name == "position" else "Pose or Attitude"
                raise ValueError(
                    f"Moving: {name} must be a function of the time [s]; got {short(given)}; "
                    f"use {fixed} for what does not move"
                )
            self._check_slope(*(("velocity", "m/s") if unit == "m" else ("rate", "rad/s")))
        self._check_sizes()

    def _check_slope(self, name: str, unit: str) -> None:
        given = getattr(self, name)
        word = given is None or (isinstance(given, str) and given == "matched")
        if not (callable(given) or word):
            raise ValueError(
                f"Moving: {name} must be a function of the time [{unit}], 'matched' or None; got {short(given)}"
            )

    def _check_sizes(self) -> None:
        wanted = {"position": "1 to 3", "velocity": "1 to 3", "attitude": "4", "rate": "3"}
        for name, count in wanted.items():
            if callable(given := getattr(self, name)):
                tried(f"Moving: {name}", given, [ca.SX.sym("t")], OF_TIME.format(count))
        if self.position is not None:
            sizes = [part.numel() for part in self._moved(ca.SX.sym("t"))]
            if not 1 <= sizes[0] <= 3 or len(set(sizes)) > 1:
                raise ValueError(
                    "Moving: position and velocity must have the same 1 to 3 entries; "
                    f"got {sizes[0]} and {sizes[-1]}"
                )
        if self.attitude is not None:
            sizes = [part.numel() for part in self._turned(ca.SX.sym("t"))]
            if sizes[0] != QUATERNION or (len(sizes) > 1 and sizes[1] != AXES):
                raise ValueError(
                    f"Moving: attitude must have 4 entries and rate 3; got {sizes[0]} and {sizes[-1]}"
                )

    def _moved(self, t: Any) -> list[Any]:
        """Position [m] and, unless it is free, velocity [m/s]."""
        if self.position is None:
            return []
        position = ca.SX(as_column(self.position(t)))
        if self.velocity is None:
            return [position]
        moving = as_column(self.velocity(t)) if callable(self.velocity) else ca.jacobian(position, t)
        return [position, ca.densify(moving)]

    def _turned(self, t: Any) -> list[Any]:
        """Unit quaternion and, unless it is free, rate in body axes [rad/s]."""
        if self.attitude is None:
            return []
        given = ca.SX(as_column(self.attitude(t)))
        attitude = given / ca.sqrt(ca.dot(given, given))
        if self.rate is None or given.numel() != QUATERNION:
            return [attitude]
        if callable(self.rate):
            return [attitude, ca.densify(as_column(self.rate(t)))]
        return [attitude, 2 * columns_of(attitude).T @ ca.jacobian(attitude, t)]

    @cached_property
    def _motion(self) -> ca.Function:
        """t -> position [m] and velocity [m/s], then attitude and rate [rad/s]: those that are known."""
        t = ca.SX.sym("t")
        return ca.Function("motion", [t], [*self._moved(t), *self._turned(t)])

    @cached_property
    def dimension(self) -> int:
        return AXES if self.position is None else self._motion.numel_out(0)

    @property
    def has_position(self) -> bool:
        return self.position is not None

    @cached_property
    def motion(self) -> ca.Function | None:
        t = ca.SX.sym("t")
        return None if self.position is None else ca.Function("place", [t], [self._moved(t)[0]])

    @property
    def turns_body(self) -> bool:
        return self.attitude is not None

    @property
    def point(self) -> Boundary:
        return Moving(self.position, self.velocity) if self.turns_body else self

    @property
    def structure(self) -> tuple:
        return type(self), self.position, self.velocity, self.attitude, self.rate

    @property
    def anchored(self) -> bool:
        return True

    def fixed(self) -> tuple[np.ndarray, np.ndarray]:
        axes, turns = self.dimension if self.has_position else 0, self.turns_body
        return np.full(axes + QUATERNION * turns, np.nan), np.full(axes + AXES * turns, np.nan)

    def rows(self, t: Any, q: Any, v: Any, m: Any) -> list[Row]:
        axes, known = self.dimension if self.has_position else 0, self._motion.call([t])
        wanted = []
        if self.has_position:
            wanted.append(("position", q[:axes] - known.pop(0), "m"))
            if self.velocity is not None:
                wanted.append(("velocity", v[:axes] - known.pop(0), "m/s"))
        if self.turns_body:
            # The vector of the turn that is left, conj(q_goal) o q: zero for either sign of q.
            wanted.append(("attitude", 2 * columns_of(known.pop(0)).T @ q[axes:], "rad"))
            if self.rate is not None:
                wanted.append(("rate", v[axes:] - known.pop(0), "rad/s"))
        return [
            Row(f"{name}.{axis}", gap[i], 0.0, 0.0, unit)
            for name, gap, unit in wanted
            for i, axis in enumerate("xyz"[: gap.numel()])
        ]

    def estimate(self, t: float, near: tuple | None = None) -> tuple[np.ndarray, np.ndarray]:
        known = [np.array(ca.DM(value)).ravel() for value in self._motion.call([t])]
        q, v = self.fixed()
        axes = self.dimension if self.has_position else 0
        if self.has_position:
            q[:axes] = known.pop(0)
            if self.velocity is not None:
                v[:axes] = known.pop(0)
        if self.turns_body:
            q[axes:] = known.pop(0)
            if self.rate is not None:
                v[axes:] = known.pop(0)
        return q, v

    def words(self) -> str:
        parts = []
        if self.has_position:
            # a planet has a name
            what = getattr(self.position, "title", "a point that moves")
            parts.append(f"{what}, with {'any velocity' if self.velocity is None else 'its velocity'}")
        if self.turns_body:
            parts.append(f"an attitude that turns, with {'any rate' if self.rate is None else 'its rate'}")
        return " and ".join(parts)
