"""What lies around a path on a page: attractors and zones, as traces of plotly.js."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from dmoc.pages.traces import apart, line, rounded, trace
from dmoc.parts.outline import Ball, Box, Cone
from dmoc.plots.style import FORBIDDEN, PALE
from dmoc.plots.surroundings import colour_of, draw_region
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

# A circle has so many points, a sphere so many around and so many from pole to pole.
ROUND, AROUND, DOWN = 121, 37, 19
# Zones can be seen through: so much of them covers what is behind [-].
CLEAR = 0.3
# Light from all sides: the far side of a sphere would be black.
LIGHTING = {"ambient": 0.75, "diffuse": 0.5, "specular": 0.05, "roughness": 0.9}


def scenery_traces(around: Any, view: Corners, size: float) -> list[dict[str, Any]]:
    """Traces of all zones and attractors in a view [m], in a unit of `size` [m]."""
    found, zone = [], FORBIDDEN.lower()
    for shape in outlines(around):
        if isinstance(shape, Ball):
            found.append(_ball(shape.center / size, shape.radius / size, zone, "keep-out zone", CLEAR))
        elif isinstance(shape, Box):
            corners = view[0] / size, view[1] / size
            edges = room_edges(shape.lower / size, shape.upper / size, corners)
            found += [_dashed(edge.T, "keep-in zone") for edge in edges]
        elif isinstance(shape, Cone):
            found += _cone(cone_surface(around, shape) / size)
    for region in regions(around):
        found += _region(region, view, size, zone)
    for way in ways(around):
        look = line(within(way.points, view) / size, way.name, PALE, 1.5)
        look["line"]["dash"] = "dot"
        found.append(look)
    for (center, radius), source in zip(attractors(around), sources(around), strict=True):
        if (center > view[0]).all() and (center < view[1]).all():
            colour = colour_of(source).lower()
            if radius:
                found.append(_ball(center / size, radius / size, colour, "attractor", 0.95))
            else:
                found.append(_dot(center / size, colour))
    return found


def _region(region: Region, view: Corners, size: float, zone: str) -> list[dict[str, Any]]:
    """A region or a link that tells no shape of its own; nothing where none of it is in view."""
    if len(view[0]) == 3:
        places, triangles = level_surface(region.values, *view)
        if not len(triangles):
            return []
        corners = {axis: rounded(part) for axis, part in zip("xyz", places.T / size, strict=True)}
        sides = {name: part.tolist() for name, part in zip("ijk", triangles.T, strict=True)}
        look = {"color": PALE if region.held else zone, "opacity": CLEAR, "lighting": LIGHTING}
        return [{"type": "mesh3d", "name": region.name, "hoverinfo": "name", **corners, **sides, **look}]
    axes = Figure().add_subplot()
    if not draw_region(axes, region, view, 1.0):
        return []
    paths = axes.collections[0].get_paths()
    for path in paths:
        # matplotlib leaves out points that are near each other in pixels, which these places are not in
        path.should_simplify = False
    if region.held:
        lines = apart([np.asarray(part) for path in paths for part in path.to_polygons(closed_only=False)])
        return [line(within(lines, view) / size, region.name, PALE, 2)]
    edges = apart([np.asarray(edge) for path in paths for edge in path.to_polygons()])
    return [_area(edges / size, zone, region.name, CLEAR)]


def _ball(center: np.ndarray, radius: float, colour: str, name: str, opacity: float) -> dict[str, Any]:
    if len(center) == 2:
        turn = np.linspace(0, 2 * np.pi, ROUND)
        ring = center + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        return _area(ring, colour, name, opacity)
    around, down = np.meshgrid(np.linspace(0, 2 * np.pi, AROUND), np.linspace(0, np.pi, DOWN))
    unit = np.stack([np.cos(around) * np.sin(down), np.sin(around) * np.sin(down), np.cos(down)])
    return _surface(center[:, None, None] + radius * unit, colour, name, opacity)


def _surface(points: np.ndarray, colour: str, name: str, opacity: float) -> dict[str, Any]:
    """A surface of one colour through a grid of points, shape (3, rows, columns)."""
    look: dict[str, Any] = {"colorscale": [[0, colour], [1, colour]], "showscale": False, "opacity": opacity}
    look["lighting"] = LIGHTING
    look |= {"contours": {axis: {"highlight": False} for axis in "xyz"}}
    places = {axis: rounded(part) for axis, part in zip("xyz", points, strict=True)}
    return {"type": "surface", "name": name, "hoverinfo": "name", **places, **look}


def _area(points: np.ndarray, colour: str, name: str, opacity: float) -> dict[str, Any]:
    """A filled polygon in the plane."""
    look = {"mode": "lines", "fill": "toself", "fillcolor": _clear(colour, opacity), "line": {"width": 0}}
    return trace(points) | look | {"name": name, "hoverinfo": "name", "hoveron": "fills"}


def _clear(colour: str, opacity: float) -> str:
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity})"


def _dashed(points: np.ndarray, name: str) -> dict[str, Any]:
    look = {"color": FORBIDDEN.lower(), "width": 2, "dash": "dash"}
    return trace(points) | {"mode": "lines", "line": look, "name": name, "hoverinfo": "name"}


def _cone(surface: np.ndarray) -> list[dict[str, Any]]:
    """The two sides of a cone in the plane; in space its surface and its rim."""
    name = "approach cone"
    if len(surface) == 2:
        return [_dashed(surface[:, :, side].T, name) for side in (0, 1)]
    return [_surface(surface, FORBIDDEN.lower(), name, 0.15), _dashed(surface[:, -1, :].T, name)]


def _dot(place: np.ndarray, colour: str) -> dict[str, Any]:
    marker = {"size": 9 if len(place) == 3 else 16, "color": colour, "line": {"width": 1, "color": "ink"}}
    look = {"mode": "markers", "marker": marker, "name": "attractor", "hoverinfo": "name"}
    return trace(place[None]) | look
