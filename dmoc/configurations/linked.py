"""A configuration that links hold: fewer ways to move than velocities."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import casadi as ca

from dmoc.basics.records import dataclass
from dmoc.configurations.base import Configuration
from dmoc.configurations.coordinates import Coordinates
from dmoc.effects.base import Body


@dataclass(frozen=True)
class Linked(Configuration):
    """The configuration `free` of bodies, held by links.

    Velocities stay those of the free bodies, and dg/dq Z w = 0 holds for them: what a user sees of a bob on a
    rod is its velocity in space. The reactions of the links are unknowns of the NLP and of a step beside those
    of unit quaternions, so that no tangent matrix of the links is needed there; where one is (rows that are
    reported, matrices of a step) it is an orthonormal basis of the null space, found place by place.

    References
    ----------
    S. Leyendecker, S. Ober-Bloebaum, J. E. Marsden, M. Ortiz, Discrete mechanics and optimal control
    for constrained systems, Optim. Control Appl. Meth. 31 (2010).
    """

    free: Configuration
    links: tuple[Any, ...]

    @property
    def names(self) -> tuple[str, ...]:
        return self.free.names

    @property
    def velocity_names(self) -> tuple[str, ...]:
        return self.free.velocity_names

    @property
    def coordinates(self) -> Coordinates:
        return self.free.coordinates

    @property
    def dimension(self) -> int:
        return self.free.dimension

    @property
    def joined(self) -> int:
        return self._links.numel_out(0)

    def kinetic(self, q: Any, v: Any, m: Any) -> Any:
        return self.free.kinetic(q, v, m)

    def inertia(self, q: Any, v: Any, m: Any) -> tuple[Any, Any]:
        return self.free.inertia(q, v, m)

    def step_inertia(self, h: Any, q: Sequence, move: Any, m: Any) -> list:
        return self.free.step_inertia(h, q, move, m)

    @cached_property
    def _links(self) -> ca.Function:
        """q -> g of the links, and its slope."""
        q, each = self._equations
        g = ca.vertcat(*each)
        return ca.Function("links", [q], [ca.densify(g), ca.jacobian(g, q)])

    @property
    def _equations(self) -> tuple[ca.SX, list[ca.SX]]:
        """Coordinates, and g of each link at them."""
        q = ca.SX.sym("q", self.size)
        at = self.free.at(q, ca.SX.zeros(self.size), 1.0)
        return q, [ca.vec(ca.SX(link.g_of(at))) for link in self.links]

    @cached_property
    def link_units(self) -> tuple[tuple[str, ...], ...]:
        counts = [g.numel() for g in self._equations[1]]
        return tuple(
            link.row_units or (link.unit,) * count for link, count in zip(self.links, counts, strict=True)
        )

    def links_at(self, q: Any) -> Any:
        return self._links(q)[0]

    def opening(self, q: Any, w: Any) -> Any:
        return self._links(q)[1] @ self.velocity(q, w)

    def bars(self, q: Any) -> Any:
        slope = self._links(q)[1]
        return slope @ self.tangent(q) if self.surplus else slope

    def g(self, q: Any) -> Any:
        return ca.vertcat(self.free.g(q), self.links_at(q))

    def pull(self, q: Any, reaction: Any) -> Any:
        own = self.free.surplus
        held = self._links(q)[1].T @ reaction[own:]
        return held + self.free.pull(q, reaction[:own]) if own else held

    def tangent(self, q: Any) -> Any:
        return self.free.tangent(q)

    def turning_share(self, m: Any) -> Any:
        return self.free.turning_share(m)

    def shared(self, column: Any, m: Any) -> Any:
        return self.free.shared(column, m)

    def pieces(self) -> list[tuple[Configuration, Any, Any, float]]:
        return self.free.pieces()

    def body(self, q: Any, v: Any, m: Any = None) -> Body:
        return self.free.body(q, v, m)

    def members(self, q: Any, v: Any, m: Any) -> list[tuple[str, Body, Any]]:
        return self.free.members(q, v, m)

    def on(self, name: str, q: Any, force: Any, torque: Any) -> Any:
        return self.free.on(name, q, force, torque)

    def generalised(self, q: Any, force: Any, torque: Any, spun: Any = None) -> Any:
        return self.free.generalised(q, force, torque, spun)

    def rotation(self, q: Any) -> Any:
        return self.free.rotation(q)
