"""What a page shows over time beside the panels of the pictures: altitude or clearance, and the mass."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from dmoc.answers.distances import from_attractors, from_zones
from dmoc.pages.panels import read
from dmoc.plots.lanes import CHANGED, LEG_COLOURS, lanes_of, looks_of
from dmoc.plots.page import draw_speed, panels_of
from dmoc.plots.sheet import shade_burns
from dmoc.plots.style import LIMIT, PALE, PATH, readable
from dmoc.plots.team import LANES, drawn
from dmoc.results.moments import moving

# Curves between the nodes have about so many points in all.
POINTS = 600
# Of more zones than this the nearest one alone has a curve.
MOST_ZONES = 4


def panels_over_time(solution: Any, late: float) -> list[dict[str, Any]]:
    """All panels over time of any solution, where a unit of time has `late` seconds."""
    parts = parts_of(solution)
    if hasattr(solution, "members"):
        draws = [*LANES, *_distances(parts)]
    elif hasattr(solution, "legs"):
        draws = [*lanes_of(solution), *_distances(parts)]
    else:
        draws = [*panels_of(solution), *_speed(solution), *_distances(parts), *_mass(solution)]

    def draw(axes: Any, lane: Any) -> None:
        lane(axes, solution, late)
        for part in parts:
            shade_burns(axes, part, late)
        for leg in parts[1:] if hasattr(solution, "legs") else ():
            axes.axvline(leg.provenance.start_time / late)

    return [read(draw, lane) for lane in draws]


def parts_of(solution: Any) -> list[Any]:
    """The legs of a mission, the bodies of a team, or the transfer itself."""
    return list(solution.parts)


def _distances(parts: list[Any]) -> list[Any]:
    """Altitude above the attractor or distance from it, and clearance from zones, where there are such."""
    known = [part for part in parts if part.problem is not None and _is_one_body(part)]
    draws = []
    if any(from_attractors(part) for part in known):
        draws.append(partial(_draw_altitude, known))
    if any(from_zones(part) for part in known):
        draws.append(partial(_draw_clearance, known))
    return draws


def _is_one_body(part: Any) -> bool:
    return not part.problem.links and len(part.problem.names) < 2 and part.dimension > 0


def _fine(part: Any) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and coordinates between the nodes, too."""
    count = max(POINTS // part.steps, 2) * part.steps + 1
    nodes = part.path.fractions
    fractions = np.interp(np.linspace(0, len(nodes) - 1, count), np.arange(len(nodes)), nodes)
    return part.provenance.start_time + part.duration * fractions, moving(part, fractions)[0]


def _draw_altitude(parts: list[Any], axes: Any, solution: Any, late: float) -> None:
    curves, above = [], False
    for part in parts:
        times, q = _fine(part)
        for distance, radius in from_attractors(part).values():
            curves.append((part, times, distance(times, q) - radius))
            above = above or radius > 0
    size, unit = readable(np.concatenate([height for *_, height in curves]), "m")
    looks = _looks(solution)
    for part, times, height in curves:
        axes.plot(times / late, height / size, **looks[id(part)])
    axes.set_ylabel(f"{'altitude' if above else 'distance'} [{unit}]")
    axes.set_title("Altitude" if above else "Distance from the attractor")


def _draw_clearance(parts: list[Any], axes: Any, solution: Any, late: float) -> None:
    curves = []
    for part in parts:
        times, q = _fine(part)
        zones = {name: clear(times, q) for name, clear in from_zones(part)}
        if len(zones) > MOST_ZONES:
            zones = {"nearest zone": np.min(list(zones.values()), axis=0)}
        curves += [(part, name, times, gap) for name, gap in zones.items()]
    size, unit = readable(np.concatenate([gap for *_, gap in curves]), "m")
    looks = _looks(solution)
    for i, (part, name, times, gap) in enumerate(curves):
        look = looks[id(part)] if len(parts) > 1 else {"color": (PATH, *LEG_COLOURS[1:])[i % 4], "label": name}
        axes.plot(times / late, gap / size, **look)
    axes.axhline(0.0, label="_edge", **LIMIT | {"color": PALE})
    axes.set_ylabel(f"clearance [{unit}]")
    axes.set_title("Clearance from the zones")


def _looks(solution: Any) -> dict[int, dict[str, Any]]:
    """The look of the curve of each part of a solution, by its identity."""
    if hasattr(solution, "members"):
        return {id(part): {**style, "label": label} for label, part, style in drawn(solution)}
    if hasattr(solution, "legs"):
        looks = zip(solution.legs, looks_of(solution.legs), strict=True)
        return {id(leg): {**look.style, "label": look.label} for leg, look in looks}
    return {id(solution): {"color": PATH, "label": "_one"}}


def _speed(solution: Any) -> list[Any]:
    """The speed of a body that turns, of which the pictures have no panel."""
    turns = bool(solution.path.attitudes) and solution.reaction is None
    return [draw_speed] * bool(turns and solution.dimension)


def _mass(solution: Any) -> list[Any]:
    mass = solution.path.mass
    return [_draw_mass] * bool(np.ptp(mass) > CHANGED * mass.max())


def _draw_mass(axes: Any, solution: Any, late: float) -> None:
    size, unit = readable(solution.path.mass, "kg")
    axes.plot(solution.time / late, solution.path.mass / size, color=PATH, label="_mass")
    axes.set_ylabel(f"mass [{unit}]")
    axes.set_title("Mass")
