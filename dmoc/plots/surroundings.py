"""Surroundings of a path drawn into a panel: attractors and zones."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmoc.effects.base import Attractor
from dmoc.parts.outline import Ball, Box, Cone
from dmoc.plots.style import ALIKE, ATTRACTOR, BODIES, DARK, FORBIDDEN, PALE
from dmoc.results.solution import Solution
from dmoc.surroundings.levels import level_surface
from dmoc.surroundings.regions import Region, regions
from dmoc.surroundings.view import (
    Corners,
    attractors,
    cone_surface,
    outlines,
    room_edges,
    sources,
    ways,
    within,
)

# A forbidden region without a shape of its own is found on a grid of this many places along each axis.
REGION_POINTS = 600
# Its edge is where the limit is broken by this part of the most in view [-]: at zero it would be a stair.
EDGE = 1e-3
# Light comes from here onto balls, and takes away so much on the far side [-].
LIGHT = np.array([-0.45, -0.45, 0.77])
SHADE = 0.2
# The ways of ends that move have these lines in turn.
WAYS = ((0, (1, 2)), (0, (6, 3)))


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
    for region in regions(solution):
        if (draw_region if solution.dimension == 2 else _draw_surface)(axes, region, view, size):
            colour = PALE if region.held else FORBIDDEN
            proxies.append(Patch(facecolor=colour, edgecolor=colour, alpha=0.5, label=region.name))
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


def draw_region(axes: Any, region: Region, view: Corners, size: float) -> bool:
    """Fill a region of the plane, or draw the line of a link; whether there is any of it in view."""
    span = (view[1] - view[0]).max()
    # Axes of equal scale show more than the view along one of them.
    x, y = (np.linspace(view[0][i] - span, view[1][i] + span, REGION_POINTS) for i in (0, 1))
    places = np.stack([part.ravel() for part in np.meshgrid(x, y)], axis=1) * size
    values = np.asarray(region.values(places)).reshape(len(y), len(x))
    if not (values > 0).any():
        return False
    if region.held:
        drawn = axes.contour(x, y, values, levels=[0.0], colors=[PALE], linewidths=1.6, zorder=1)
    else:
        edge = [EDGE * values.max(where=np.isfinite(values), initial=0.0), np.inf]
        drawn = axes.contourf(x, y, values, levels=edge, colors=[FORBIDDEN], alpha=0.3, zorder=0)
    drawn.set_gid(region.name)
    return True


def _draw_surface(axes: Any, region: Region, view: Corners, size: float) -> bool:
    """The edge of a region in space, or the surface of a link; whether there is any of it in view."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    places, triangles = level_surface(region.values, view[0] * size, view[1] * size)
    if not len(triangles):
        return False
    corners = (places / size)[triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(across, axis=1)
    towards = np.abs(across @ LIGHT) / np.where(lengths > 0, lengths, 1.0)
    colours = _shaded(PALE if region.held else FORBIDDEN, towards)
    surface = Poly3DCollection(corners, facecolors=colours, alpha=0.3, linewidth=0, zorder=1)
    surface.set_gid(region.name)
    axes.add_collection3d(surface)
    return True


def _shaded(colour: str, towards: np.ndarray) -> np.ndarray:
    """Colours of faces, of which `towards` says by the cosine how much they look towards the light.

    The light is soft: through the near side of a body the far one is seen, and dark faces would be patches.
    """
    from matplotlib.colors import to_rgb

    bright = 1 - SHADE * (1 - towards)
    return np.concatenate([bright[..., None] * to_rgb(colour), np.ones((*bright.shape, 1))], axis=-1)


def _draw_ball(axes: Any, center: np.ndarray, radius: float, view: Corners, colour: str, name: str) -> None:
    """A disc in the plane, a shaded sphere in space."""
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
    style = {
        "facecolors": _shaded(colour, np.tensordot(LIGHT, unit, axes=1)),
        "shade": False,
        "alpha": 0.35,
        "linewidth": 0,
        "zorder": 1,
    }
    style |= {"rcount": parts, "ccount": parts}
    axes.plot_surface(*surface, **style).set_gid(name)


def _draw_cone(axes: Any, surface: np.ndarray) -> None:
    style = {"color": FORBIDDEN, "linestyle": "--", "linewidth": 1.2, "label": "approach cone"}
    if len(surface) == 3:
        axes.plot_surface(*surface, color=FORBIDDEN, alpha=0.12, linewidth=0, zorder=1).set_gid("approach cone")
        axes.plot(*surface[:, -1, :], **style)
    for side in np.linspace(0, surface.shape[2] - 1, 5 if len(surface) == 3 else 3).astype(int)[:-1]:
        axes.plot(*surface[:, :, side], **style)
