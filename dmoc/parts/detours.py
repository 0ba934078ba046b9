"""A ball to stay out of, and how a starting path gets past one that is in its way."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, checked, matching_length, number, vector
from dmoc.basics.digits import down
from dmoc.basics.records import dataclass
from dmoc.parts.constraint import Constraint, checked_on, checked_point
from dmoc.parts.outline import Ball, Shape
from dmoc.parts.rows import Row

# A path that passes the centre within this part of the radius [-] is pushed aside: no side is clearly nearer.
CENTRAL = 0.05
# A path is pushed aside by this part of the radius [-]: enough for the optimiser to see which side is nearer.
PUSHED = 0.3
# A detour passes the centre at this many radii [-], so that half a radius is left between path and ball.
CLEARANCE = 1.5


@dataclass(frozen=True)
class KeepOut(Constraint):
    """Stay outside a sphere (a disc in the plane).

    Parameters
    ----------
    center : sequence of float
        Centre [m].
    radius : float
        Radius [m].
    point : sequence of float, optional
        Of a body that turns, in body axes from the centre of mass [m]; that centre if not given.
    on : str
        The name of the body, where there are several.
    """

    center: Vector
    radius: float
    point: Vector | None = None
    on: str = ""

    def __post_init__(self) -> None:
        checked(
            self,
            center=vector("center", self.center, "m"),
            radius=number("radius", self.radius, "m", positive=True),
            point=checked_point(self, self.point),
            on=checked_on(self),
        )

    @property
    def adjustable(self) -> tuple[str, ...]:  # type: ignore[override]
        return ("center", "radius") if self.point is None else ("center", "radius", "point")

    def check_dimension(self, dimension: int) -> None:
        matching_length(self, "center", len(self.center), dimension)

    def rows(self, t: Any, q: Any, u: Any, m: Any) -> list[Row]:
        offset = (q - self.center) / self.radius
        return [Row("clearance", ca.dot(offset, offset), 1.0, np.inf)]

    def excess(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.maximum(0.0, self.radius - np.linalg.norm(q - np.asarray(self.center), axis=1))

    def clearance(self, t: np.ndarray, q: np.ndarray) -> np.ndarray:
        return np.linalg.norm(q - np.asarray(self.center), axis=1) - self.radius

    def words(self) -> str:
        center = f"({', '.join(f'{x:g}' for x in self.center)})"
        return f"stays {self.radius:g} m away from {center} m{self.of_point}"

    def violation(self, value: float, unit: str) -> tuple[float, str]:
        return self.radius * (1 - np.sqrt(max(1 - value, 0.0))), "m"

    def eased(self, slack: float) -> KeepOut | None:
        # The row is |d|^2 / radius^2 >= 1 - slack, so the radius shrinks by the root; from 1 on nothing is
        # left.
        return replace(self, radius=self.radius * float(np.sqrt(1 - slack))) if slack < 1 else None

    def needs(self, eased: Constraint, index: int, amount: str) -> str:
        radius = down(eased.feature())
        return f"keep-out {index}{self.of_body} of at most {radius} m radius (you gave {self.radius:g} m)"

    def outline(self) -> tuple[Shape, ...]:
        return (Ball(np.array(self.center), self.radius),)

    def feature(self) -> float:
        return self.radius

    def off_centre(self, path: np.ndarray, fractions: np.ndarray) -> np.ndarray:
        return off_centre(path, fractions, np.asarray(self.center), self.radius)

    def ways_round(self, path: np.ndarray, fractions: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
        return ways_round(path, fractions, np.asarray(self.center), self.radius)


def off_centre(path: np.ndarray, fractions: np.ndarray, center: np.ndarray, radius: float) -> np.ndarray:
    """Push a path aside where it runs through the centre of a ball.

    At the centre both sides are equally near, and every step of the optimiser would keep to the middle.
    """
    if path.shape[1] == 1:
        return path
    offset = path - center
    distance = np.linalg.norm(offset, axis=1)
    node, along = _passing(path, int(np.argmin(distance)))
    aside = offset[node] - (offset[node] @ along) * along
    if distance[node] > radius or np.linalg.norm(aside) > CENTRAL * radius:
        return path
    if np.linalg.norm(aside) <= 1e-6 * radius:
        # A direction across the path: the axis that it follows least, turned against the one it follows most.
        order = np.argsort(np.abs(along), kind="stable")
        aside = np.zeros_like(along)
        aside[order[0]], aside[order[-1]] = along[order[-1]], -along[order[0]]
    # The push fades to zero two radii from the centre and at both ends, which must stay where they are.
    near = np.maximum(0.0, 1 - (distance / (2 * radius)) ** 2) ** 2 * 4 * fractions * (1 - fractions)
    push = PUSHED * radius * near / max(near[node], 1e-3)
    return path + push[:, None] * aside / np.linalg.norm(aside)


def ways_round(
    path: np.ndarray, fractions: np.ndarray, center: np.ndarray, radius: float
) -> Iterator[tuple[str, np.ndarray]]:
    """Bends of a path, zero at its ends, that take it past a ball on either side of it."""
    node, along = _passing(path, int(np.argmin(np.linalg.norm(path - center, axis=1))))
    # The axes without their parts along the path; an axis nearly along it would leave no direction across.
    across = np.eye(len(center)) - np.outer(along, along)
    sides = [side / np.linalg.norm(side) for side in across if np.linalg.norm(side) > 0.5]
    # The bend rises from zero at the start to one at the node nearest to the centre, and falls to zero.
    peak = fractions[node]
    shape = np.where(fractions < peak, fractions / peak, (1 - fractions) / (1 - peak))
    shape = np.sin(0.5 * np.pi * shape)[:, None]
    gap = path[node] - center
    for i, direction in enumerate(sides):
        for sign in (1, -1):
            # The path moves across its direction only: moves along it would change the speed, not the place.
            reach = sign * CLEARANCE * radius * direction - gap
            yield f"{'+' if sign > 0 else '-'}{i + 1} side", shape * (reach - along * (reach @ along))


def _passing(path: np.ndarray, nearest: int) -> tuple[int, np.ndarray]:
    """An inner node next to the nearest one, and the direction of the path there."""
    node = min(max(nearest, 1), len(path) - 2)
    along = path[node + 1] - path[node - 1]
    return node, along / (np.linalg.norm(along) or 1.0)
