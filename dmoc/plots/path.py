"""The path panel: the path, the scene around it, and the force along it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np

from dmoc.parts.outline import Ball, Box
from dmoc.plots.style import DARK, FORBIDDEN, PALE, PATH, PUSH, SETTINGS, readable, within_steps
from dmoc.plots.surroundings import draw_scene
from dmoc.plots.turning import draw_triads, paths_of_points
from dmoc.results.solution import Solution
from dmoc.surroundings.view import Corners, outlines, view_of

# Step ends are drawn as dots if there are at most this many steps: more would hide the line.
MOST_DOTS = 40
# At most this many arrows show the force along the path: more would stand on one another.
ARROWS = 20
# The longest arrow of the force is this part of the extent [-].
ARROW = 0.12
# The name, unit and colour of the arrows along a path.
FORCE = ("force", "N", PUSH)
# So wide and so high may a box in space be [units of matplotlib's panel, which has 0.185 of them across]: the
# numbers and labels stand around it, most of them below.
ROOM = np.array([0.178, 0.155])
# A flat box is seen from so much higher up [degrees].
HIGHER = 25.0
# Numbers from this on are long [-]: their signs and digits take the room of two short ones.
LONG_NUMBER = 1000.0
# A legend below a panel has room for so many letters, of which each mark with its gaps takes so many.
LETTERS, MARK = 74, 7
# What the line on the floor of the box is.
PROJECTION = "projection"
# Numbers with powers of ten between these two are written without one [-], as in all other panels.
PLAIN = SETTINGS["axes.formatter.limits"]
# In space they are so below this power of ten [-]: at the corner of the box numbers of five digits overlap.
PLAIN_IN_SPACE = 4
# A plane path whose width is more than this many times its height gets a panel over the whole page.
WIDE = 2.5


def draw_path(axes: Any, solution: Solution, beside: bool = False) -> None:
    """Path in the plane or in space, or position against time in one dimension; the legend below or beside."""
    if solution.dimension == 1:
        _draw_line(axes, solution)
        return
    low, high = _view(solution)
    size, unit = scale_of(solution.position, low, high)
    path = within_steps(solution, solution.position)[1] / size
    tails, arrows, longest = _arrows(solution)
    view = low / size, high / size
    proxies = draw_scene(axes, solution, view, size)
    mark_burns(axes, solution, solution.position.T / size)
    # Beside the axes of a body, the path has a colour of its own.
    axes.plot(*path.T, color=DARK if solution.path.attitudes else PATH, label="path", zorder=3)
    if solution.steps <= MOST_DOTS:
        ends = solution.position[:: solution.order // 2] / size
        axes.plot(*ends.T, ".", color=PATH, label="step ends", zorder=3)
    proxies += draw_arrows(axes, tails / size, arrows / size, longest)
    mark_ends(axes, path[:1].T, path[-1:].T)
    if solution.path.attitudes:
        draw_triads(axes, solution, size)
    for label, swept in paths_of_points(solution).items():
        axes.plot(*swept.T / size, color=DARK, linestyle="--", linewidth=1.5, label=label, zorder=3)
    if solution.dimension == 3:
        floor = np.full(len(path), view[0][2])
        # Beside the axes of a body there is no room for its entry in the legend.
        below = "_projection" if solution.path.attitudes else PROJECTION
        axes.plot(path[:, 0], path[:, 1], floor, color=PALE, linewidth=1.2, label=below, zorder=0)
        # The order is given, since matplotlib would hide the path behind surfaces that it passes in front of.
        axes.computed_zorder = False
    frame(axes, view, unit)
    legend(axes, proxies, beside)


def scale_of(position: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[float, str]:
    """Size [m] and name of the unit of all axes, such as `10^5 km`, for a view between two corners [m].

    The power of ten belongs to the name: matplotlib would print one for each axis, and that of z on its label.
    """
    size, unit = readable(np.ptp(position, axis=0), "m")
    power = int(np.floor(np.log10(max(np.abs([low, high]).max() / size, 1e-300))))
    if PLAIN[0] < power < (PLAIN_IN_SPACE if len(low) == 3 else PLAIN[1]):
        return size, unit
    return size * 10.0**power, f"$10^{{{power}}}$ {unit}"


def is_wide(solution: Solution) -> bool:
    """Whether a path in the plane and its surroundings are much wider than high."""
    if solution.dimension != 2:
        return False
    return lies_wide(_view(solution))


def lies_wide(view: Corners) -> bool:
    """Whether a view in the plane is much wider than high."""
    spans = np.subtract(*view[::-1])
    return len(spans) == 2 and bool(spans[0] > WIDE * spans[1])


def _view(solution: Solution) -> Corners:
    tails, arrows, _ = _arrows(solution)
    swept = paths_of_points(solution).values()
    return view_of(solution, np.concatenate([solution.position, tails + arrows, *swept]))


def burning(solution: Solution) -> np.ndarray | None:
    """Where an engine that also coasts is on: a value a node, or a step if held; None for what never coasts."""
    if solution.path.attitudes:
        return None
    strength = np.linalg.norm(solution.force, axis=1)
    # The rounding of |F| at zero leaves a little thrust while coasting, far below a fiftieth.
    on = strength > 0.02 * strength.max(initial=0.0)
    switches = solution.problem is not None and solution.problem.actuator.coasts
    return on if switches and on.any() and not on.all() else None


def mark_burns(axes: Any, solution: Solution, curve: np.ndarray) -> None:
    """A broad line under the curve of the nodes where the engine is on."""
    if (on := burning(solution)) is None:
        return
    if solution.hold:
        on = np.append(np.repeat(on, solution.order // 2), False)
    shown = np.where(on, curve, np.nan)
    axes.plot(*shown, color=PUSH, linewidth=7, alpha=0.4, solid_capstyle="butt", label="engine on", zorder=2)


def _draw_line(axes: Any, solution: Solution) -> None:
    times, path = within_steps(solution, solution.position)
    (late, unit_late), (size, unit) = readable(times, "s"), readable(path, "m")
    for shape in outlines(solution):
        if isinstance(shape, Ball):
            low, high = shape.center[0] - shape.radius, shape.center[0] + shape.radius
            axes.axhspan(low / size, high / size, color=FORBIDDEN, alpha=0.3, label="keep-out zone")
        elif isinstance(shape, Box):
            for edge in (edge for edge in (*shape.lower, *shape.upper) if np.isfinite(edge)):
                axes.axhline(edge / size, color=FORBIDDEN, linestyle="--", label="keep-in zone")
    mark_burns(axes, solution, np.array([solution.time / late, solution.position[:, 0] / size]))
    axes.plot(times / late, path[:, 0] / size, color=PATH, label="position")
    mark_ends(axes, (times[:1] / late, path[:1, 0] / size), (times[-1:] / late, path[-1:, 0] / size))
    axes.set(xlabel=f"time [{unit_late}]", ylabel=f"x [{unit}]")
    axes.set_title("Position")
    legend(axes, [])


def mark_ends(axes: Any, start: Any, goal: Any) -> None:
    style = {"linestyle": "none", "markerfacecolor": "white", "markeredgecolor": DARK, "zorder": 6}
    axes.plot(*start, marker="o", markersize=10, label="start", **style)
    axes.plot(*goal, marker="*", markersize=17, label="goal", **style)


def _arrows(solution: Solution) -> tuple[np.ndarray, np.ndarray, float]:
    """Tails and arrows [m] of the force at a few places along the path, and the largest force there [N]."""
    return scaled_arrows(*pushes(solution), extent_of(solution.position))


def pushes(solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Places [m] along the path and the force there [N], where there may be one."""
    places, force = solution.position, solution.force
    if solution.hold:
        ends = places[:: solution.order // 2]
        places = 0.5 * (ends[1:] + ends[:-1])
    if (on := burning(solution)) is not None:
        # All arrows stand in burns: a coast has none, and a short burn might have got none.
        places, force = places[on], force[on]
    return places, force


def extent_of(position: np.ndarray) -> float:
    """Diagonal of the box around some places [m]."""
    return float(np.linalg.norm(np.ptp(position, axis=0)))


def scaled_arrows(
    places: np.ndarray, force: np.ndarray, extent: float, most: int = ARROWS
) -> tuple[np.ndarray, np.ndarray, float]:
    """Tails and arrows [m] of what acts at some of the places, and the largest of it."""
    few = np.unique(np.linspace(0, len(force) - 1, min(most, len(force))).round().astype(int))
    places, force = places[few], force[few]
    strength = np.linalg.norm(force, axis=1)
    longest = float(strength.max(initial=0.0))
    seen = strength > 0.02 * longest
    return places[seen], force[seen] * (ARROW * extent / (longest or 1.0)), longest


def draw_arrows(
    axes: Any, tails: np.ndarray, arrows: np.ndarray, longest: float, of: tuple[str, str, str] = FORCE
) -> list[Any]:
    """Arrows of what acts along a path, `of` its name, unit and colour; its entry in the legend."""
    from matplotlib.lines import Line2D

    if not len(tails):
        return []
    if tails.shape[1] == 2:
        style = {
            "angles": "xy",
            "scale_units": "xy",
            "scale": 1.0,
            "units": "inches",
            "width": 0.03,
            "zorder": 4,
        }
    else:
        style = {"arrow_length_ratio": 0.3, "linewidth": 1.5, "zorder": 4}
    name, base, colour = of
    axes.quiver(*tails.T, *arrows.T, color=colour, **style).set_gid(name)
    unit_size, unit = readable(longest, base)
    words = f"{name}, longest {longest / unit_size:.4g} {unit}"
    return [Line2D([], [], color=colour, marker=">", markersize=7, label=words)]


def frame(axes: Any, view: Corners, unit: str) -> None:
    from matplotlib.ticker import MaxNLocator

    names = "xyz"[: len(view[0])]
    axes.set(**{f"{name}label": f"{name} [{unit}]" for name in names})
    axes.set_title("Path", loc="left")
    if len(names) == 2:
        # With limits that are not fixed, axes of equal scale fill the whole panel.
        axes.dataLim.set_points(np.array(view))
        axes.set(xmargin=0, ymargin=0)
        axes.set_aspect("equal", adjustable="datalim")
        return
    spans = view[1] - view[0]
    tall = spans[2] > 0.9 * spans[:2].max()
    for i, name in enumerate(names):
        axis = getattr(axes, f"{name}axis")
        axes.set(**{f"{name}lim": (view[0][i], view[1][i])})
        # a short side has room for few numbers, and any side for few that are long
        most = 4 if np.abs(view).max() < LONG_NUMBER else 3
        axis.set_major_locator(MaxNLocator(2 + round(most * spans[i] / spans.max())))
        # a power of ten of its own, as for a low z, would stand on the label
        axis.set_major_formatter("{x:g}")
        # matplotlib measures this distance along the other two sides; make it the same for all three
        least = 12.0 if name != "z" else 17.0 if tall else 9.0
        axis.labelpad = max(18 * np.linalg.norm(spans) / np.delete(spans, i).max() - 21, least)
    for artist in (*axes.lines, *axes.collections):
        # marks on a side of the box reach beyond the rectangle that would clip them; its sides set the layout
        artist.set_clip_on(False)
        artist.set_in_layout(False)
    axes.set_anchor("N")
    # What is flat is seen from higher up: it would be a line otherwise.
    flat = float(np.clip(1 - 2 * spans[2] / spans[:2].max(), 0.0, 1.0))
    axes.view_init(elev=25 + HIGHER * flat, azim=-60)
    axes.set_box_aspect(spans, zoom=_zoom(axes, view, spans))


def _zoom(axes: Any, view: Corners, spans: np.ndarray) -> float:
    """How much larger than matplotlib draws it a box in space may be to fill its panel, and not to be cut."""
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    axes.set_box_aspect(spans)
    corners = np.array(list(product(*zip(*view, strict=True))))
    seen = np.stack(proj_transform(*corners.T, axes.get_proj())[:2], axis=1)
    return float((ROOM / np.ptp(seen, axis=0)).min())


def legend(axes: Any, proxies: list[Any], beside: bool = False) -> None:
    """Below the panel, or to its right."""
    handles, labels = entries_once(axes, proxies)
    if beside:
        axes.legend(handles, labels, loc="upper left", bbox_to_anchor=(1.01, 1.0))
        return
    columns = _columns(labels)
    below = -0.06 if axes.name == "3d" else -0.11
    if axes.name == "3d" and len(labels) > 2 * columns:
        # a third row would reach into the line at the foot; in space there is room above
        below = 0.0
    axes.legend(handles, labels, ncol=columns, loc="upper center", bbox_to_anchor=(0.5, below))


def _columns(labels: list[str]) -> int:
    """In how many columns a legend is as wide as its panel at most."""
    for columns in (4, 3):
        # matplotlib fills columns so: of 9 entries the first of four has 3, the others 2 each
        widths = [max(map(len, part)) for part in np.array_split(labels, columns) if len(part)]
        # Three rows would reach into the line below the panels, where two do.
        if sum(widths) + MARK * len(widths) <= LETTERS and not (columns == 4 and 4 < len(labels) <= 6):
            return columns
    return 3


def entries_once(axes: Any, more: Sequence[Any] = ()) -> tuple[list[Any], list[str]]:
    """Handles and labels for a legend, each label once."""
    handles, labels = axes.get_legend_handles_labels()
    entries = dict(zip(labels, handles, strict=True)) | {handle.get_label(): handle for handle in more}
    return list(entries.values()), list(entries)
