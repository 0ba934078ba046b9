"""The surroundings of a path: attractors and zones, and how much of them is in view."""

from __future__ import annotations

from itertools import product

import numpy as np

from dmoc.answers.ways import Way, ways_of
from dmoc.effects.base import Attractor
from dmoc.parts.outline import Ball, Box, Cone, Shape
from dmoc.results.solution import Solution
from dmoc.surroundings.regions import regions

# Zones and attractors are shown up to this part of the extent beyond the path [-].
REACH = 0.5
# Whether a zone without a shape of its own is near is asked at so many places along each axis.
COARSE = 25

# The lower and the upper corner of a view or a box, in metres or in the unit of the drawing.
Corners = tuple[np.ndarray, np.ndarray]


def view_of(solution: Solution, drawn: np.ndarray) -> Corners:
    """Corners [m] of the view: points of the path and its arrows, and the scene near them."""
    # The last iterate of a failed solve may hold numbers that are not finite.
    drawn = drawn[np.isfinite(drawn).all(axis=1)]
    low, high = (drawn.min(axis=0), drawn.max(axis=0)) if len(drawn) else np.zeros((2, solution.dimension))
    extent = float((high - low).max()) or 1.0
    near, far = low - REACH * extent, high + REACH * extent
    zones = _near(solution, low - 2 * REACH * extent, high + 2 * REACH * extent)
    for shape in outlines(solution):
        if isinstance(shape, Box):
            # Walls far away would make the path a dot, and nothing behind near walls matters.
            walls = [shape.lower, shape.upper]
            low, high = (
                np.where((w > near) & (w < far), w, end) for w, end in zip(walls, (low, high), strict=True)
            )
            near, far = np.maximum(near, walls[0]), np.minimum(far, walls[1])
    for corner, opposite in [*_boxes(solution), *zones]:
        if (opposite > near).all() and (corner < far).all():
            low, high = np.minimum(low, np.maximum(corner, near)), np.maximum(high, np.minimum(opposite, far))
    return low - 0.05 * extent, high + 0.05 * extent


def _boxes(solution: Solution) -> list[Corners]:
    """Opposite corners of attractors, spheres and cones [m]."""
    boxes = [(center - radius, center + radius) for center, radius in attractors(solution)]
    for shape in outlines(solution):
        if isinstance(shape, Ball):
            boxes.append((shape.center - shape.radius, shape.center + shape.radius))
        elif isinstance(shape, Cone):
            rim = cone_surface(solution, shape).reshape(solution.dimension, -1)
            boxes.append((rim.min(axis=1), rim.max(axis=1)))
    return boxes + [(way.points.min(axis=0), way.points.max(axis=0)) for way in ways(solution)]


def _near(solution: Solution, near: np.ndarray, far: np.ndarray) -> list[Corners]:
    """Opposite corners of zones without a shape of their own that lie wholly in a box [m]."""
    marks = [np.linspace(low, high, COARSE) for low, high in zip(near, far, strict=True)]
    places = np.stack(np.meshgrid(*marks, indexing="ij"), axis=-1)
    found = []
    for region in regions(solution):
        if region.held:
            continue
        inside = np.argwhere((region.values(places.reshape(-1, len(marks))) > 0).reshape(places.shape[:-1]))
        if len(inside) and inside.min() > 0 and inside.max() < COARSE - 1:
            # its edge is up to a place of the grid further out
            low, high = inside.min(axis=0) - 1, inside.max(axis=0) + 1
            corner, opposite = ([side[i] for side, i in zip(marks, end, strict=True)] for end in (low, high))
            found.append((np.array(corner), np.array(opposite)))
    return found


def ways(solution: Solution) -> list[Way]:
    """The ways of ends that move."""
    if solution.problem is None or not solution.dimension:
        return []
    return ways_of(solution.problem, (solution.time[0], solution.time[-1]))


def within(points: np.ndarray, view: Corners) -> np.ndarray:
    """Points of a line, with gaps where it is out of view: nothing else cuts lines in space."""
    inside = np.all((points >= view[0]) & (points <= view[1]), axis=1)
    return np.where(np.asarray(inside)[:, None], points, np.nan)


def attractors(solution: Solution) -> list[tuple[np.ndarray, float]]:
    """Centres of the point masses and their radii where the scene tells them [m], else 0."""
    effects = solution.problem.effects if solution.problem else ()
    radius = max((effect.body_radius() for effect in effects), default=0.0)
    # Where the scene tells a radius it is that of the body at the origin.
    return [
        (source.place(solution.dimension), radius if source.center is None else 0.0)
        for source in sources(solution)
    ]


def outlines(solution: Solution) -> list[Shape]:
    """The shapes of all constraints, as they tell them."""
    constraints = solution.problem.constraints if solution.problem else ()
    return [shape for constraint in constraints for shape in constraint.outline()]


def sources(solution: Solution) -> tuple[Attractor, ...]:
    return solution.problem.attraction.sources if solution.problem else ()


def cone_surface(solution: Solution, cone: Cone) -> np.ndarray:
    """Points of a cone from the tip to as deep as the path goes [m], shape (axes, depths, around)."""
    axis, apex = cone.axis, cone.apex
    places = solution.position.reshape(-1, solution.dimension)
    depth = float(np.nanmax((places - apex) @ axis, initial=0.0))
    # In the plane the three angles lead to one side of the axis, to the other and back; in space they go round.
    across = np.linalg.svd(axis[None])[2][1:]
    around = np.linspace(0, 2 * np.pi, 3 if len(axis) == 2 else 37)
    circle = np.stack([np.cos(around), np.sin(around)])[: len(across)].T @ across
    slope = axis + np.tan(cone.half_angle) * circle
    return apex[:, None, None] + depth * np.linspace(0, 1, 9)[None, :, None] * slope.T[:, None, :]


def room_edges(lower: np.ndarray, upper: np.ndarray, view: Corners) -> list[np.ndarray]:
    """The edges of a box, as far as they are in view, shape (axes, 2) each."""
    n, found = len(lower), []
    for along in range(n):
        others = [axis for axis in range(n) if axis != along]
        span = max(lower[along], view[0][along]), min(upper[along], view[1][along])
        for corner in product(*[(lower[axis], upper[axis]) for axis in others]):
            if all(view[0][axis] < c < view[1][axis] for axis, c in zip(others, corner, strict=True)):
                edge = np.empty((n, 2))
                edge[along], edge[others] = span, np.array(corner)[:, None]
                found.append(edge)
    return found
