"""The path panel: where the body goes, what pulls it, where it must not be, and where it is pushed."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np

from dmoc.constraints import KeepIn, KeepOut
from dmoc.effects.gravity import PointGravity
from dmoc.plot_style import ATTRACTOR, DARK, FORBIDDEN, PALE, PATH, PUSH, readable, within_steps
from dmoc.solution import Solution

MOST_DOTS = 40
ARROWS = 20
# Length of the longest force arrow, and how far beyond the path zones are shown, as parts of the extent.
ARROW, REACH = 0.12, 0.5

Corners = tuple[np.ndarray, np.ndarray]


def draw_path(axes: Any, solution: Solution) -> None:
    """Path in the plane or in space, or position against time in one dimension."""
    if solution.dimension == 1:
        _draw_line(axes, solution)
        return
    size, unit = readable(np.ptp(solution.position, axis=0), "m")
    path = within_steps(solution, solution.position)[1] / size
    tails, arrows, longest = _arrows(solution)
    view = _view(solution, np.concatenate([path, (tails + arrows) / size]), size)
    proxies = _draw_zones(axes, solution, view, size)
    axes.plot(*path.T, color=PATH, label="path", zorder=3)
    if solution.steps <= MOST_DOTS:
        ends = solution.position[:: solution.order // 2] / size
        axes.plot(*ends.T, ".", color=PATH, label="step ends", zorder=3)
    proxies += _draw_arrows(axes, tails / size, arrows / size, longest)
    _mark_ends(axes, path[:1].T, path[-1:].T)
    if solution.dimension == 3:
        floor = np.full(len(path), view[0][2])
        axes.plot(path[:, 0], path[:, 1], floor, color=PALE, linewidth=1.2, label="its shadow", zorder=0)
        # drawn by the order given, else the path would hide behind what it passes in front of
        axes.computed_zorder = False
    _frame(axes, view, unit)
    _legend(axes, proxies)


def _draw_line(axes: Any, solution: Solution) -> None:
    times, path = within_steps(solution, solution.position)
    (late, unit_late), (size, unit) = readable(times, "s"), readable(path, "m")
    for zone in solution.problem.constraints if solution.problem else ():
        if isinstance(zone, KeepOut):
            low, high = zone.center[0] - zone.radius, zone.center[0] + zone.radius
            axes.axhspan(low / size, high / size, color=FORBIDDEN, alpha=0.3, label="keep-out zone")
        elif isinstance(zone, KeepIn):
            for edge in (edge for edge in (*zone.lower, *zone.upper) if np.isfinite(edge)):
                axes.axhline(edge / size, color=FORBIDDEN, linestyle="--", label="keep-in zone")
    axes.plot(times / late, path[:, 0] / size, color=PATH, label="position")
    _mark_ends(axes, (times[:1] / late, path[:1, 0] / size), (times[-1:] / late, path[-1:, 0] / size))
    axes.set(xlabel=f"time [{unit_late}]", ylabel=f"x [{unit}]")
    axes.set_title("Position")
    _legend(axes, [])


def _mark_ends(axes: Any, start: Any, goal: Any) -> None:
    style = {"linestyle": "none", "markerfacecolor": "white", "markeredgecolor": DARK, "zorder": 6}
    axes.plot(*start, marker="o", markersize=10, label="start", **style)
    axes.plot(*goal, marker="*", markersize=17, label="goal", **style)


def _arrows(solution: Solution) -> tuple[np.ndarray, np.ndarray, float]:
    """Tails and arrows [m] of the force at a few places along the path, and the largest force there [N]."""
    places, force = solution.position, solution.force
    if solution.hold:
        ends = places[:: solution.order // 2]
        places = 0.5 * (ends[1:] + ends[:-1])
    few = np.unique(np.linspace(0, len(force) - 1, ARROWS).round().astype(int))
    places, force = places[few], force[few]
    strength = np.linalg.norm(force, axis=1)
    longest = float(strength.max(initial=0.0))
    extent = float(np.linalg.norm(np.ptp(solution.position, axis=0)))
    seen = strength > 0.02 * longest
    return places[seen], force[seen] * (ARROW * extent / (longest or 1.0)), longest


def _draw_arrows(axes: Any, tails: np.ndarray, arrows: np.ndarray, longest: float) -> list[Any]:
    from matplotlib.lines import Line2D

    if not len(tails):
        return []
    if tails.shape[1] == 2:
        style = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "width": 0.005, "zorder": 4}
    else:
        style = {"arrow_length_ratio": 0.3, "linewidth": 1.5, "zorder": 4}
    axes.quiver(*tails.T, *arrows.T, color=PUSH, **style).set_gid("force")
    unit_size, unit = readable(longest, "N")
    words = f"force, longest {longest / unit_size:.3g} {unit}"
    return [Line2D([], [], color=PUSH, marker=">", markersize=7, label=words)]


def _view(solution: Solution, drawn: np.ndarray, size: float) -> Corners:
    """Corners of what is shown: the path with its arrows, and as much of the scene as lies near it."""
    # the last iterate of a failed solve may hold anything
    drawn = drawn[np.isfinite(drawn).all(axis=1)]
    low, high = (drawn.min(axis=0), drawn.max(axis=0)) if len(drawn) else np.zeros((2, solution.dimension))
    extent = float((high - low).max()) or 1.0
    near, far = low - REACH * extent, high + REACH * extent
    zones = solution.problem.constraints if solution.problem else ()
    boxes = [(center / size, center / size) for center in _attractors(solution)]
    for zone in zones:
        if isinstance(zone, KeepOut):
            center = np.array(zone.center)
            boxes.append(((center - zone.radius) / size, (center + zone.radius) / size))
        elif isinstance(zone, KeepIn):
            # walls far away would make the path a dot
            walls = (np.array(side) / size for side in (zone.lower, zone.upper))
            boxes.append(tuple(np.where((w > near) & (w < far), w, low) for w in walls))  # type: ignore[arg-type]
    for corner, opposite in boxes:
        if (opposite > near).all() and (corner < far).all():
            low, high = np.minimum(low, np.maximum(corner, near)), np.maximum(high, np.minimum(opposite, far))
    return low - 0.05 * extent, high + 0.05 * extent


def _attractors(solution: Solution) -> list[np.ndarray]:
    """Centres of the point masses [m]."""
    effects = solution.problem.effects if solution.problem else ()
    centers = [effect.center for effect in effects if isinstance(effect, PointGravity)]
    return [np.zeros(solution.dimension) if center is None else np.array(center) for center in centers]


def _draw_zones(axes: Any, solution: Solution, view: Corners, size: float) -> list[Any]:
    """Draw what is forbidden and what attracts; entries for the legend."""
    from matplotlib.patches import Patch

    proxies = []
    for zone in solution.problem.constraints if solution.problem else ():
        if isinstance(zone, KeepOut):
            draw = _draw_disc if solution.dimension == 2 else _draw_sphere
            draw(axes, np.array(zone.center) / size, zone.radius / size, view)
            proxies.append(Patch(facecolor=FORBIDDEN, edgecolor=FORBIDDEN, alpha=0.5, label="keep-out zone"))
        elif isinstance(zone, KeepIn):
            _draw_room(axes, np.array(zone.lower) / size, np.array(zone.upper) / size, view)
    style = {"linestyle": "none", "marker": "o", "markerfacecolor": ATTRACTOR, "markeredgecolor": DARK}
    for center in _attractors(solution):
        if (center / size > view[0]).all() and (center / size < view[1]).all():
            axes.plot(*(center[:, None] / size), markersize=13, label="attractor", **style)
    return proxies


def _draw_disc(axes: Any, center: np.ndarray, radius: float, view: Corners) -> None:
    from matplotlib.patches import Circle

    disc = Circle(tuple(center), radius, facecolor=FORBIDDEN, edgecolor=FORBIDDEN, alpha=0.4)
    disc.set_gid("keep-out zone")
    axes.add_patch(disc)


def _draw_sphere(axes: Any, center: np.ndarray, radius: float, view: Corners) -> None:
    from matplotlib.colors import LightSource

    around, down = np.meshgrid(np.linspace(2 * np.pi, 0, 37), np.linspace(0, np.pi, 19))
    unit = np.stack([np.cos(around) * np.sin(down), np.sin(around) * np.sin(down), np.cos(down)])
    surface = center[:, None, None] + radius * unit
    # axes in space do not clip
    inside = np.all([(s >= a) & (s <= b) for s, a, b in zip(surface, *view, strict=True)], axis=0)
    surface = np.where(inside, surface, np.nan)
    light = LightSource(azdeg=225, altdeg=50)
    style = {"color": FORBIDDEN, "alpha": 0.35, "linewidth": 0, "lightsource": light, "zorder": 1}
    axes.plot_surface(*surface, **style).set_gid("keep-out zone")


def _draw_room(axes: Any, lower: np.ndarray, upper: np.ndarray, view: Corners) -> None:
    """The edges of a box, as far as they are in view."""
    n = len(lower)
    for along in range(n):
        others = [axis for axis in range(n) if axis != along]
        span = max(lower[along], view[0][along]), min(upper[along], view[1][along])
        for corner in product(*[(lower[axis], upper[axis]) for axis in others]):
            if not all(view[0][axis] < c < view[1][axis] for axis, c in zip(others, corner, strict=True)):
                continue
            edge = np.empty((n, 2))
            edge[along], edge[others] = span, np.array(corner)[:, None]
            axes.plot(*edge, color=FORBIDDEN, linestyle="--", label="keep-in zone")


def _frame(axes: Any, view: Corners, unit: str) -> None:
    from matplotlib.ticker import MaxNLocator

    names = "xyz"[: len(view[0])]
    axes.set(**{f"{name}label": f"{name} [{unit}]" for name in names})
    axes.set_title("Path", loc="left")
    if len(names) == 2:
        # limits that are not fixed let the equal scales fill the panel
        axes.dataLim.set_points(np.array(view))
        axes.set(xmargin=0, ymargin=0)
        axes.set_aspect("equal", adjustable="datalim")
        return
    spans = view[1] - view[0]
    for i, name in enumerate(names):
        axis = getattr(axes, f"{name}axis")
        axes.set(**{f"{name}lim": (view[0][i], view[1][i])})
        # a short side has room for few numbers
        axis.set_major_locator(MaxNLocator(2 + round(4 * spans[i] / spans.max())))
        # matplotlib measures this distance along the other two sides; make it the same for all three
        axis.labelpad = max(18 * np.linalg.norm(spans) / np.delete(spans, i).max() - 21, 7.0)
    for artist in (*axes.lines, *axes.collections):
        # the enlarged box reaches beyond the rectangle that would clip it; only its sides are laid out
        artist.set_clip_on(False)
        artist.set_in_layout(False)
    # a tall box would reach into the legend below
    axes.set_box_aspect(spans, zoom=0.95 if spans[2] > 1.5 * spans[:2].max() else 1.07)
    axes.set_anchor("N")
    axes.view_init(elev=25, azim=-60)


def _legend(axes: Any, proxies: list[Any]) -> None:
    """Below the panel."""
    handles, labels = entries_once(axes, proxies)
    columns = -(-len(labels) // 2) if len(labels) > 4 else 4
    below = -0.06 if axes.name == "3d" else -0.11
    axes.legend(handles, labels, ncol=columns, loc="upper center", bbox_to_anchor=(0.5, below))


def entries_once(axes: Any, more: Sequence[Any] = ()) -> tuple[list[Any], list[str]]:
    """Handles and labels for a legend, each label once."""
    handles, labels = axes.get_legend_handles_labels()
    entries = dict(zip(labels, handles, strict=True)) | {handle.get_label(): handle for handle in more}
    return list(entries.values()), list(entries)
