"""Where a body flies on a page: its path, what lies around it, and what moves, as traces of plotly.js."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmoc.basics.quaternions import normalised, rotated
from dmoc.films.frames import Scene, scene_of
from dmoc.pages.scenery import scenery_traces
from dmoc.pages.traces import INK, apart, line, rounded, trace
from dmoc.plots.mission import scenery
from dmoc.plots.path import scale_of
from dmoc.plots.style import AXIS_COLOURS, FORBIDDEN, PUSH, flown_force, readable, within_steps
from dmoc.plots.turning import globe_lines
from dmoc.surroundings.view import view_of

# The body is shown at so many times.
FRAMES = 241
# From no force to the largest the path goes from the first of these colours to the last.
COLD_TO_HOT = ((0.0, "#8fa3b8"), (0.5, "#e69f00"), (1.0, "#d55e00"))
# The side of a box in space is at least this part of its longest one [-], so that a flat scene has some depth.
THINNEST = 0.15
# A force that is smaller than this part of the largest mass times length by time squared is none [-].
NONE = 1e-12


def stage_of(solution: Any) -> dict[str, Any]:
    """What the stage of a page shows: traces that stand still, traces that move, times and the view.

    `moving` are traces whose `frames` hold the places of each time, shape (frames, points, axes).
    """
    scene = scene_of(solution, FRAMES)
    around: Any = scenery(solution) if _has_parts(solution) else solution
    view = _view(around, scene)
    # Directions on the unit sphere have no unit.
    size, unit = scale_of(scene.everything, *view) if solution.dimension else (1.0, "")
    still = [*_trails(solution, scene, size), *_marks(scene, size)]
    still += _directions(solution)
    if solution.dimension == scene.axes:
        still = [*scenery_traces(around, view, size), *still]
    return {
        "axes": scene.axes,
        "unit": unit,
        "view": rounded(np.stack(view, axis=1) / size),
        "shape": _shape(view),
        "flat": bool(scene.axes == 3 and np.ptp(view, axis=0)[2] < 0.3 * np.ptp(view, axis=0).max()),
        "still": still,
        "moving": _moving(scene, size),
        "push": scene.push_words,
    }


def _has_parts(solution: Any) -> bool:
    return hasattr(solution, "legs") or hasattr(solution, "members")


def _view(around: Any, scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the view [m]: all that moves, and what lies near."""
    everything = scene.everything
    low, high = everything.min(axis=0), everything.max(axis=0)
    if around.dimension == scene.axes:
        near = view_of(around, everything)
        low, high = np.minimum(low, near[0]), np.maximum(high, near[1])
    elif not around.dimension:
        low, high = -np.ones(3), np.ones(3)
    side = high - low
    wide = np.maximum(side * 1.04, THINNEST * (side.max() or 1.0))
    middle = 0.5 * (low + high)
    return middle - 0.5 * wide, middle + 0.5 * wide


def _shape(view: tuple[np.ndarray, np.ndarray]) -> list[float]:
    """The sides of the box, of which the longest is 1."""
    side = view[1] - view[0]
    return rounded(side / side.max())


def _trails(solution: Any, scene: Scene, size: float) -> list[dict[str, Any]]:
    """The paths: of a lone body coloured by the force on it, else each leg or body in its colour."""
    force = None if _has_parts(solution) or len(scene.trails) > 1 else _force_along(solution, scene)
    found = []
    for trail in scene.trails if solution.dimension else ():
        x = trail.points / size
        if force is None:
            name = trail.name or (scene.names[trail.body] if len(scene.names) > 1 else "") or "path"
            found.append(line(x, name, trail.colour, width=4 if scene.axes == 3 else 2.5))
            continue
        strength, unit = force
        colour = {"color": rounded(strength), "cmin": 0, "cmax": rounded([strength.max()])[0]}
        colour["colorscale"] = [list(stop) for stop in COLD_TO_HOT]
        about = {"name": "path", "text": [f"{value:.4g} {unit}" for value in strength], "unit": unit}
        about |= {"hovertemplate": "force %{text}<extra></extra>"}
        if scene.axes == 3:
            look = {"mode": "lines", "line": {"width": 6} | colour}
        else:
            # In the plane a line has one colour, so it is of dots close to each other.
            x, colour["color"] = _dense(x, strength)
            about["text"] = [f"{value:.4g} {unit}" for value in colour["color"]]
            look = {"mode": "markers", "marker": {"size": 5, "line": {"width": 0}} | colour}
        found.append(trace(x) | about | look)
    return found


def _dense(points: np.ndarray, values: np.ndarray, count: int = 1500) -> tuple[np.ndarray, list[float]]:
    """Points and values evenly along a line in the plane."""
    way = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    even = np.linspace(0.0, way[-1], count)
    place = np.stack([np.interp(even, way, column) for column in points.T], axis=1)
    return place, rounded(np.interp(even, way, values))


def _force_along(solution: Any, scene: Scene) -> tuple[np.ndarray, str] | None:
    """The size of the force at the points of the path, with its unit; None where there is no force."""
    if not solution.dimension or not np.abs(solution.force).max(initial=0.0) > 0:
        return None
    times, force = flown_force(solution)
    if solution.hold:
        times, force = np.repeat(solution.end_times, 2)[1:-1], np.repeat(solution.force, 2, axis=0)
    strength = np.interp(scene.trails[0].times, times, np.linalg.norm(force, axis=1))
    size, unit = readable(strength, "N")
    return strength / size, unit


def _marks(scene: Scene, size: float) -> list[dict[str, Any]]:
    """Start, goal and joints; arrows of impulses."""
    starts = np.array([scene.places[i][0] for i in range(len(scene.places))])
    goals = np.array([scene.places[i][-1] for i in range(len(scene.places))])
    found: list[dict[str, Any]] = []
    if not any(np.ptp(place) for place in scene.places):
        return found
    for points, name, symbol in (
        (starts, "start", "circle-open"),
        (scene.joints, "joint", "diamond-open"),
        (goals, "goal", "diamond" if scene.axes == 3 else "star"),
    ):
        if len(points):
            marker = {"symbol": symbol, "size": 7 if scene.axes == 3 else 11, "color": INK}
            look = {
                "mode": "markers",
                "marker": marker,
                "name": name,
                "hovertemplate": name + "<extra></extra>",
            }
            found.append(trace(points / size) | look)
    if scene.kicks:
        arrows = apart([arrow for _, arrow in scene.kicks])
        found.append(line(arrows / size, "impulse", INK, width=5 if scene.axes == 3 else 2.5))
    return found


def _directions(solution: Any) -> list[dict[str, Any]]:
    """Of a body that only turns: a sphere, the ways of its axes on it, and the cones of its limits."""
    if solution.dimension:
        return []
    found = [line(apart(globe_lines()), "", "#8a8f98", width=1) | {"opacity": 0.35}]
    for leg in getattr(solution, "legs", [solution]):
        attitude = normalised(within_steps(leg, leg.path.attitudes[0])[1])
        for i, name in enumerate("xyz"):
            along = rotated(attitude, np.broadcast_to(np.eye(3)[i], (len(attitude), 3)))
            found.append(line(along, f"way of body {name}", AXIS_COLOURS[i], width=4))
        for constraint in leg.problem.constraints if leg.problem else ():
            circle = constraint.on_sphere(np.array([leg.time[0], leg.time[-1]]), 121)
            if circle is not None:
                name = f"pointing keep-{'out' if circle[0] else 'in'}"
                found.append(line(apart(circle[1]), name, FORBIDDEN.lower(), width=5))
    return found


def _moving(scene: Scene, size: float) -> list[dict[str, Any]]:
    """What moves: links, body axes, pushes and bodies."""
    space = scene.axes == 3
    found = []

    def add(lines: list[np.ndarray], name: str, colour: str, width: float) -> None:
        frames = len(scene.times)
        gap = ((0, 0), (0, 1), (0, 0))
        full = [np.broadcast_to(one, (frames, *one.shape[1:])) for one in lines]
        points = np.concatenate([np.pad(one, gap, constant_values=np.nan) for one in full], axis=1) / size
        drawn = line(points[0], name, colour, width)
        found.append(drawn | {"hoverinfo": "skip", "frames": rounded(points)})

    if scene.links:
        add(scene.links, "links", INK, 5 if space else 2.5)
    for i, axis in enumerate("xyz" if scene.triads else ""):
        add(scene.triads[i::3], f"body {axis}", AXIS_COLOURS[i].lower(), 5 if space else 2.5)
    if scene.pushes:
        add(scene.pushes, scene.push_words, PUSH.lower(), 6 if space else 3)
    for i, place in enumerate(scene.places):
        if not np.ptp(place):
            continue
        name = scene.names[i] or "body"
        # A ring in the colour of the page parts the body from its path.
        marker = {
            "size": 8 if space else 13,
            "color": scene.colour(i).lower(),
            "line": {"width": 2, "color": "page"},
        }
        drawn = trace(place[:1] / size) | {"mode": "markers", "name": name, "marker": marker}
        found.append(drawn | {"hoverinfo": "skip", "frames": rounded(place[:, None] / size)})
    return found
