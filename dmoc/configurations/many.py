"""Several bodies in one configuration."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import accumulate
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.records import dataclass
from dmoc.configurations.base import Configuration
from dmoc.configurations.coordinates import Coordinates
from dmoc.effects.base import Body


@dataclass(frozen=True)
class Many(Configuration):
    """Bodies side by side: first the places of all, then the attitudes of those that turn; energies add up.

    All is per unit of the mass of all bodies: the energy of each counts by its share of that.

    Parameters
    ----------
    bodies : tuple of str
        Their names.
    parts : tuple of Configuration
        The configuration of each.
    shares : tuple of float
        The mass of each over that of all [-].
    """

    bodies: tuple[str, ...]
    parts: tuple[Configuration, ...]
    shares: tuple[float, ...]

    @property
    def names(self) -> tuple[str, ...]:
        return self._named([part.names for part in self.parts], self._entries)

    @property
    def velocity_names(self) -> tuple[str, ...]:
        return self._named([part.velocity_names for part in self.parts], self._motions)

    def _named(self, each: Sequence[tuple[str, ...]], entries: list[np.ndarray]) -> tuple[str, ...]:
        named = [f"{body}.{name}" for body, names in zip(self.bodies, each, strict=True) for name in names]
        return tuple(named[i] for i in np.argsort(np.concatenate(entries)))

    @cached_property
    def coordinates(self) -> Coordinates:
        pairs = zip(self.bodies, self.parts, strict=True)
        return Coordinates.side_by_side({name: part.coordinates for name, part in pairs})

    @cached_property
    def _entries(self) -> list[np.ndarray]:
        """Which coordinates belong to each body."""
        return [np.flatnonzero(self.coordinates.of_body(body)[0]) for body in self.bodies]

    @cached_property
    def _motions(self) -> list[np.ndarray]:
        """Which independent velocities belong to each body."""
        return [np.flatnonzero(self.coordinates.of_body(body)[1]) for body in self.bodies]

    @property
    def dimension(self) -> int:
        return self.parts[0].dimension

    def cut(self, column: Any) -> list[Any]:
        """The entries of a column of the size of q that belong to each body."""
        return [ca.SX(column)[mine.tolist()] for mine in self._entries]

    def _stacked(self, columns: Sequence[Any]) -> Any:
        """A column of the size of q from the entries of each body."""
        return ca.vertcat(*columns)[np.argsort(np.concatenate(self._entries)).tolist()]

    def _each(self, q: Any, v: Any, m: Any) -> list[tuple[float, Configuration, Any, Any, Any]]:
        """Share, configuration, coordinates, their rates and mass of each body."""
        states = zip(self.shares, self.parts, self.cut(q), self.cut(v), strict=True)
        return [(share, part, qs, vs, share * m) for share, part, qs, vs in states]

    def kinetic(self, q: Any, v: Any, m: Any) -> Any:
        return sum(share * part.kinetic(qs, vs, ms) for share, part, qs, vs, ms in self._each(q, v, m))

    def inertia(self, q: Any, v: Any, m: Any) -> tuple[Any, Any]:
        moved, along = [], []
        for share, part, qs, vs, ms in self._each(q, v, m):
            first, second = part.inertia(qs, vs, ms)
            moved.append(ca.SX.zeros(part.size) + share * first)
            along.append(share * second)
        return self._stacked(moved), self._stacked(along)

    def step_inertia(self, h: Any, q: Sequence, move: Any, m: Any) -> list:
        nodes, moves = [self.cut(node) for node in q], self.cut(move)
        found = [
            [
                share * ca.SX(end)
                for end in part.step_inertia(h, [node[i] for node in nodes], moves[i], share * m)
            ]
            for i, (share, part) in enumerate(zip(self.shares, self.parts, strict=True))
        ]
        return [self._stacked(ends) for ends in zip(*found, strict=True)]

    def g(self, q: Any) -> Any:
        return ca.vertcat(*[part.g(qs) for part, qs in zip(self.parts, self.cut(q), strict=True)])

    def pull(self, q: Any, reaction: Any) -> Any:
        counts = list(accumulate((part.surplus for part in self.parts), initial=0))
        pulls = []
        for part, qs, first, last in zip(self.parts, self.cut(q), counts[:-1], counts[1:], strict=True):
            pulls.append(part.pull(qs, reaction[first:last]) if part.surplus else ca.SX.zeros(part.size))
        return self._stacked(pulls)

    def tangent(self, q: Any) -> Any:
        blocks = ca.diagcat(*[part.tangent(qs) for part, qs in zip(self.parts, self.cut(q), strict=True)])
        rows, columns = (np.argsort(np.concatenate(entries)) for entries in (self._entries, self._motions))
        return blocks[rows.tolist(), columns.tolist()]

    def pieces(self) -> list[tuple[Configuration, Any, Any, float]]:
        return [
            (part, mine.tolist(), moving.tolist(), share)
            for part, mine, moving, share in zip(
                self.parts, self._entries, self._motions, self.shares, strict=True
            )
        ]

    def body(self, q: Any, v: Any, m: Any = None) -> Body:
        each = self.members(q, v, 1.0)
        place, speed = (
            sum(share * getattr(body, name) for share, (_, body, _) in zip(self.shares, each, strict=True))
            for name in ("position", "velocity")
        )
        return Body(place, speed)

    def members(self, q: Any, v: Any, m: Any) -> list[tuple[str, Body, Any]]:
        named = zip(self.bodies, self._each(q, v, m), strict=True)
        return [(name, part.body(qs, vs), ms) for name, (_, part, qs, vs, ms) in named]

    def generalised(self, q: Any, force: Any, torque: Any, spun: Any = None) -> Any:
        raise TypeError("a force acts on one of several bodies: `on`")

    def on(self, name: str, q: Any, force: Any, torque: Any) -> Any:
        places = zip(self.bodies, self.parts, self.cut(q), strict=True)
        return self._stacked(
            [
                part.on(name, qs, force, torque) if body == name else ca.SX.zeros(part.size)
                for body, part, qs in places
            ]
        )
