"""The surroundings of a path: attractors, zones, and how much of them is in view."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from dmoc.answers.ways import Way, ways_of
from dmoc.effects.base import Attractor
from dmoc.parts.constraint import Constraint
from dmoc.parts.outline import Ball, Box, Cone, Shape
from dmoc.plots.style import ALIKE, ATTRACTOR, BODIES, DARK, FORBIDDEN, PALE
from dmoc.results.solution import Solution

# Zones and attractors are shown up to this part of the extent beyond the path [-].
REACH = 0.5
# A forbidden region without a shape of its own is found on a grid of this many places along each axis.
REGION_POINTS = 600

# The ways of ends that move have these lines in turn.
WAYS = ((0, (1, 2)), (0, (6, 3)))
# The lower and the upper corner of a view or a box, in metres or in the unit of the drawing.
Corners = tuple[np.ndarray, np.ndarray]


def view_of(solution: Solution, drawn: np.ndarray) -> Corners:
    """Corners [m] of the view: points of the path and its arrows, and the scene near them."""
    # The last iterate of a failed solve may hold numbers that are not finite.
    drawn = drawn[np.isfinite(drawn).all(axis=1)]
    low, high = (drawn.min(axis=0), drawn.max(axis=0)) if len(drawn) else np.zeros((2, solution.dimension))
    extent = float((high - low).max()) or 1.0
    near, far = low - REACH * extent, high + REACH * extent
    for shape in outlines(solution):
        if isinstance(shape, Box):
            # Walls far away would make the path a dot, and nothing behind near walls matters.
            walls = [shape.lower, shape.upper]
            low, high = (
                np.where((w > near) & (w < far), w, end) for w, end in zip(walls, (low, high), strict=True)
            )
            near, far = np.maximum(near, walls[0]), np.minimum(far, walls[1])
    for corner, opposite in _boxes(solution):
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


def draw_scene(axes: Any, solution: Solution, view: Corners, size: float) -> list[Any]:
    """Draw zones and attractors; further entries for the legend."""
    from matplotlib.patches import Patch

    proxies = []
    for shape in outlines(solution):
        if isinstance(shape, Ball):
            _draw_ball(axes, shape.center / size, shape.radius / size, view, FORBIDDEN, "keep-out zone")
            proxies.append(Patch(facecolor=FORBIDDEN, edgecolor=FORBIDDEN, alpha=0.5, label="keep-out zone"))
        elif isinstance(shape, Box):
            for edge in room_edges(shape.lower / size, shape.upper / size, view):
                axes.plot(*edge, color=FORBIDDEN, linestyle="--", label="keep-in zone")
        elif isinstance(shape, Cone):
            _draw_cone(axes, cone_surface(solution, shape) / size)
    for zone in without_outline(solution):
        if draw_region(axes, zone, view, size):
            name = f"forbidden by {type(zone).__name__}"
            proxies.append(Patch(facecolor=FORBIDDEN, edgecolor=FORBIDDEN, alpha=0.5, label=name))
    for i, way in enumerate(ways(solution)):
        line = within(way.points / size, view)
        axes.plot(*line.T, color=PALE, linewidth=1.0, linestyle=WAYS[i % len(WAYS)], label=way.name, zorder=1)
    largest = max((source.mu for source in sources(solution)), default=1.0)
    for (center, radius), source in zip(attractors(solution), sources(solution), strict=True):
        colour = colour_of(source)
        if radius:
            _draw_ball(axes, center / size, radius / size, view, colour, "attractor")
            proxies.append(Patch(facecolor=colour, edgecolor=DARK, alpha=0.5, label="attractor"))
        elif (center / size > view[0]).all() and (center / size < view[1]).all():
            style = {"linestyle": "none", "marker": "o", "markerfacecolor": colour, "markeredgecolor": DARK}
            across = 13 if source.mu == largest else 9
            axes.plot(*(center[:, None] / size), markersize=across, label="attractor", **style)
    return proxies


def colour_of(source: Attractor) -> str:
    """The colour of a body that is known by its gravitational parameter, else that of any attractor."""
    known = (colour for mu, colour in BODIES.items() if abs(source.mu - mu) < ALIKE * mu)
    return next(known, ATTRACTOR)


def outlines(solution: Solution) -> list[Shape]:
    """The shapes of all constraints, as they tell them."""
    constraints = solution.problem.constraints if solution.problem else ()
    return [shape for constraint in constraints for shape in constraint.outline()]


def without_outline(solution: Solution) -> list[Constraint]:
    """Limits on positions in the plane that tell no shape of theirs."""
    if solution.problem is None or solution.dimension != 2:
        return []
    return [one for one in solution.problem.constraints if not one.limits_speed and not one.outline()]


def draw_region(axes: Any, zone: Constraint, view: Corners, size: float) -> bool:
    """Fill where a limit is broken by a body at rest; whether there is such a place in view."""
    span = (view[1] - view[0]).max()
    # Axes of equal scale show more than the view along one of them.
    x, y = (np.linspace(view[0][i] - span, view[1][i] + span, REGION_POINTS) for i in (0, 1))
    places = np.stack([part.ravel() for part in np.meshgrid(x, y)], axis=1) * size
    excess = zone.excess(places, np.zeros_like(places)).reshape(len(y), len(x))
    if not (excess > 0).any():
        return False
    edge = [1e-3 * span * size, np.inf]
    filled = axes.contourf(x, y, excess, levels=edge, colors=[FORBIDDEN], alpha=0.3, zorder=0)
    filled.set_gid(type(zone).__name__)
    return True


def sources(solution: Solution) -> tuple[Attractor, ...]:
    return solution.problem.attraction.sources if solution.problem else ()


def _draw_ball(axes: Any, center: np.ndarray, radius: float, view: Corners, colour: str, name: str) -> None:
    """A disc in the plane, a shaded sphere in space."""
    from matplotlib.colors import LightSource
    from matplotlib.patches import Circle

    if len(center) == 2:
        disc = Circle(tuple(center), radius, facecolor=colour, edgecolor=colour, alpha=0.4)
        disc.set_gid(name)
        axes.add_patch(disc)
        return
    # The poles are left out: a triangle without area has no shade.
    cut = ((center - radius < view[0]) | (center + radius > view[1])).any()
    # What the view cuts needs a finer grid for an edge without teeth.
    parts = 120 if cut else 30
    around, down = np.meshgrid(
        np.linspace(2 * np.pi, 0, parts + 1), np.linspace(1e-3, np.pi - 1e-3, parts // 2 + 1)
    )
    unit = np.stack([np.cos(around) * np.sin(down), np.sin(around) * np.sin(down), np.cos(down)])
    surface = center[:, None, None] + radius * unit
    # Matplotlib does not clip surfaces in space.
    inside = np.all([(s >= a) & (s <= b) for s, a, b in zip(surface, *view, strict=True)], axis=0)
    surface = np.where(inside, surface, np.nan)
    light = LightSource(azdeg=225, altdeg=50)
    style = {"color": colour, "alpha": 0.35, "linewidth": 0, "lightsource": light, "zorder": 1}
    style |= {"rcount": parts, "ccount": parts}
    axes.plot_surface(*surface, **style).set_gid(name)


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


def _draw_cone(axes: Any, surface: np.ndarray) -> None:
    style = {"color": FORBIDDEN, "linestyle": "--", "linewidth": 1.2, "label": "approach cone"}
    if len(surface) == 3:
        axes.plot_surface(*surface, color=FORBIDDEN, alpha=0.12, linewidth=0, zorder=1).set_gid("approach cone")
        axes.plot(*surface[:, -1, :], **style)
    for side in np.linspace(0, surface.shape[2] - 1, 5 if len(surface) == 3 else 3).astype(int)[:-1]:
        axes.plot(*surface[:, :, side], **style)


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
