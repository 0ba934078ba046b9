"""Curved unknowns around an attractor: a path that arrives earlier or later is near, not far, in them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.records import dataclass
from dmoc.guess.coast import VERY_MANY_TURNS
from dmoc.guess.starting import angle_around
from dmoc.motion.path import DiscretePath
from dmoc.scene.problem import TransferProblem

# A body whose distance from the axis falls below this part of that from the attractor [-] has no such unknowns:
# at the axis itself the angle around it is not defined.
LEAST_REACH = 0.5


@dataclass(frozen=True)
class Chart:
    """Cylindrical unknowns of every node, counted from a path: out [m], along [m] and up [m].

    The axis goes through the attractor, across the mean plane of the motion. With the frame E = (e_r, e_t, n)
    of a node at the angle along / reach from its place on the path,

        q = attractor + height n + (reach + out) e_r + up n,      F = E f,      E^T (rows of motion) = 0

    hold in place of q, F and the rows themselves: a path that is turned as a whole has the same forces and
    costates f and E^T lambda, and over many revolutions arriving a little later is nearly that.

    Attributes
    ----------
    normal : array, shape (3,)
        The axis, a unit vector.
    out, along : arrays, shape (nodes, axes)
        e_r and e_t of each node on the path.
    reach : array, shape (nodes,)
        Its distance from the axis [m].
    foot : array, shape (nodes, axes)
        The place on the axis beside it [m], from the origin of the unknowns.
    height : array, shape (nodes,)
        How far that is from the attractor, along the axis [m].
    """

    normal: np.ndarray
    out: np.ndarray
    along: np.ndarray
    reach: np.ndarray
    foot: np.ndarray
    height: np.ndarray

    @property
    def axes(self) -> int:
        return self.out.shape[1]

    @property
    def axis(self) -> np.ndarray:
        """The direction of the axis in the scene's own axes; none of it lies in a plane scene."""
        return self.normal[: self.axes]

    @property
    def turns(self) -> float:
        """How many revolutions the path makes."""
        cosines = np.sum(self.out[1:] * self.out[:-1], axis=1)
        return float(np.arccos(np.clip(cosines, -1.0, 1.0)).sum() / (2 * np.pi))

    def turning(self, vectors: np.ndarray) -> np.ndarray:
        """The change of vectors, one a node, by a turn around the axis, per radian."""
        full = np.cross(self.normal, np.pad(vectors, ((0, 0), (0, 3 - self.axes))))
        return full[:, : self.axes]

    def numbers(self) -> dict[str, np.ndarray]:
        """The numbers that stencils take, one a node."""
        tables = {"out": self.out, "along": self.along, "foot": self.foot}
        named = {f"{name}.{i}": table[:, i] for name, table in tables.items() for i in range(self.axes)}
        normals = {f"normal.{i}": np.full_like(self.reach, self.normal[i]) for i in range(self.axes)}
        return named | normals | {"reach": self.reach, "height": self.height}

    def frames(self, angle: np.ndarray) -> np.ndarray:
        """E of every node, shape (nodes, axes, axes), at angles from the path [rad]."""
        cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
        columns = [cos * self.out + sin * self.along, cos * self.along - sin * self.out]
        if self.axes == 3:
            columns.append(np.broadcast_to(self.normal, self.out.shape))
        return np.stack(columns, axis=2)


def drafted(number: Callable[[str], Any], place: Any) -> tuple[Any, Any]:
    """Position from the origin and frame of one node, from its unknowns; `number` gives the chart's numbers."""
    axes = place.numel()
    out, along, foot, normal = (
        ca.vertcat(*(number(f"{name}.{i}") for i in range(axes))) for name in ("out", "along", "foot", "normal")
    )
    reach = number("reach")
    cos, sin = ca.cos(place[1] / reach), ca.sin(place[1] / reach)
    columns = [cos * out + sin * along, cos * along - sin * out, normal][:axes]
    position = foot + (reach + place[0]) * columns[0] + (place[2] * normal if axes == 3 else 0)
    return position, ca.horzcat(*columns)


def pulled(number: Callable[[str], Any], place: Any, mu: Any) -> Any:
    """E^T of the attractor's pull per mass [m/s^2] on a node, from its unknowns: the axis goes through it.

    In this frame it is free of the angle. In the scene's own axes a node has 467 instructions for its second
    derivatives and 8 entries of them; so it has 53 and 3.
    """
    out, up = number("reach") + place[0], number("height") + place[2] if place.numel() == 3 else 0.0
    square = out**2 + up**2
    return -mu / (square * ca.sqrt(square)) * ca.vertcat(*[out, 0.0, up][: place.numel()])


def chart_of(problem: TransferProblem, guess: DiscretePath, origin: np.ndarray) -> Chart | None:
    """The chart around a guess; None where such unknowns do not suit the problem."""
    lone, n = problem.attraction.lone, problem.dimension
    turns = problem.turns or bool(problem.links)
    if (
        lone is None
        or turns
        or guess.hold
        or problem.constraints
        or problem.objective.learns
        or angle_around(problem, guess) < 2 * np.pi * VERY_MANY_TURNS
        or not _turns_with_it(problem)
    ):
        return None
    offset = guess.position - lone.place(n)
    full = np.pad(offset, ((0, 0), (0, 3 - n)))
    normal = np.cross(full[:-1], full[1:]).sum(axis=0)
    normal = normal / (np.linalg.norm(normal) or 1.0)
    height = full @ normal
    level = full - height[:, None] * normal
    reach = np.linalg.norm(level, axis=1)
    if (reach <= LEAST_REACH * np.linalg.norm(full, axis=1)).any():
        return None
    out = level / reach[:, None]
    along = np.cross(normal, out)
    foot = (height[:, None] * normal)[:, :n] + lone.place(n) - origin
    return Chart(normal, out[:, :n], along[:, :n], reach, foot, height)


def is_curved(problem: TransferProblem, guess: DiscretePath) -> bool:
    """Whether the unknowns of a solve from this guess are those of a chart."""
    return chart_of(problem, guess, guess.position[0]) is not None


def _turns_with_it(problem: TransferProblem) -> bool:
    """Whether ends are fixed as a whole or not at all, and no limit of a control belongs to an axis."""
    n = problem.dimension
    if problem.actuator.labels(n)[n:] not in ((), ("throttle",)):
        return False
    free = all(np.isinf(side[:n]).all() for side in problem.actuator.bounds(n))
    whole = all(
        np.isnan(part).all() or not np.isnan(part).any()
        for end in (problem.start, problem.goal)
        for part in end.fixed()
    )
    return free and whole
