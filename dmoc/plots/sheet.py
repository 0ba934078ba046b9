"""The page that pictures of solutions stand on: its panels, headline and footnote."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dmoc.parts.objectives import Objective
from dmoc.plots.path import burning, entries_once
from dmoc.plots.style import DARK, PUSH, WARNING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dmoc.checks.verification import Report
    from dmoc.results.solution import Solution

# Units in the headline have this sign for a square.
SQUARED = "\u00b2"

# What changes by less than this part of itself does not change, in a picture [-].
STEADY = 1e-6
# What a picture on a light background has in these colours, one on a dark background has in those: letters and
# lines, the page itself, and what would be too dark on it.
ON_DARK = {
    "#000000": "#e4e6e8",
    "#222222": "#e4e6e8",
    "#262626": "#e4e6e8",
    "#ffffff": "#14171b",
    "#b0b0b0": "#4a525b",
    "#0072b2": "#4aa8e0",
    "#56b4e9": "#bfe3ff",
    "#d55e00": "#f58a42",
    "#009e73": "#35c79c",
    "#b03a00": "#ff9a62",
}
# The walls of a box in space and the lines on them on a dark background.
WALL = "#1d2228"
GRID = "#343b43"
# What has colours of these kinds is turned dark.
COLOURED = ("color", "facecolor", "edgecolor", "markerfacecolor", "markeredgecolor")


def darkened(page: Figure, dark: bool = True) -> Figure:
    """A picture turned to a dark background, if it is to be dark."""
    if not dark:
        return page
    from matplotlib.colors import to_hex, to_rgb, to_rgba_array

    for artist in page.findobj():
        for kind in COLOURED:
            if not (hasattr(artist, f"get_{kind}") and hasattr(artist, f"set_{kind}")):
                continue
            colours = to_rgba_array(getattr(artist, f"get_{kind}")())
            turned = [to_rgb(ON_DARK.get(to_hex(one), one)) for one in colours]
            # What has none of these colours is left alone: surfaces in space tell theirs in the order of depth.
            if any(to_hex(one) in ON_DARK for one in colours):
                found = np.concatenate([turned, colours[:, 3:]], axis=1)
                getattr(artist, f"set_{kind}")(found[0] if len(found) == 1 else found)
    boxes: Any = [axes for axes in page.axes if axes.name == "3d"]
    for box in boxes:
        for axis in (box.xaxis, box.yaxis, box.zaxis):
            axis.set_pane_color(WALL)
            # in space a grid takes its colour from here when it is drawn
            axis._axinfo["grid"]["color"] = GRID
    return page


def new_page(dimension: int) -> Figure:
    """An empty page for a path in so many dimensions."""
    from matplotlib.figure import Figure

    page = Figure(figsize=(13.33, 7.5))
    # The layout does not see the label of the z axis in space, so the columns are kept further apart.
    page.set_layout_engine("constrained", w_pad=0.08, h_pad=0.06, wspace=0.1 if dimension == 3 else 0.02)
    return page


def new_panels(page: Figure, dimension: int, wide: bool, count: int) -> tuple[Any, list[Any]]:
    """The path panel on the left, or above if it is wide, and those over time."""
    if wide:
        grid = page.add_gridspec(2, count, height_ratios=(1.5, 1.0))
        return page.add_subplot(grid[0, :]), [page.add_subplot(grid[1, column]) for column in range(count)]
    grid = page.add_gridspec(count, 2, width_ratios=(1.15, 1.0))
    path = page.add_subplot(grid[:, 0], projection="3d" if dimension == 3 else None)
    return path, [page.add_subplot(grid[row, 1]) for row in range(count)]


def arrange(page: Figure, panels: Sequence[Any], wide: bool, time_unit: str) -> None:
    """Legends of the panels over time, and one axis of time for all of them."""
    for panel in panels:
        steady(panel)
        where: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.05)}
        if wide:
            where = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.3), "ncol": 2}
        panel.legend(*entries_once(panel), borderaxespad=0.0, **where)
        if panel is not panels[0]:
            panel.sharex(panels[0])
        panel.tick_params(labelbottom=wide or panel is panels[-1])
    for panel in panels if wide else panels[-1:]:
        panel.set_xlabel(f"time [{time_unit}]")
    if not wide:
        page.align_ylabels(panels)


def steady(panel: Any) -> None:
    """Show a curve that changes by rounding alone as the level that it is."""
    low, high = panel.get_ylim()
    level = 0.5 * (low + high)
    if high - low < STEADY * abs(level):
        panel.set_ylim(sorted((0.95 * level, 1.05 * level)))


def entitle(page: Figure, solution: Any, report: Report | None, late: float, late_unit: str) -> None:
    """Headline and footnote, dark red where something is wrong."""
    words = _headline(solution, late, late_unit)
    page.suptitle(words, fontsize=16, color=DARK if solution.optimal else WARNING)
    words, good = _footnote(solution, report)
    page.supxlabel(words, fontsize=11, color=DARK if good else WARNING)


def shade_burns(axes: Any, solution: Solution, late: float) -> None:
    """Shade when an engine that also coasts is on."""
    if (on := burning(solution)) is None:
        return
    times = solution.end_times if solution.hold else solution.time
    on, step = (np.append(on, False), "post") if solution.hold else (on, None)
    style = {"transform": axes.get_xaxis_transform(), "color": PUSH, "alpha": 0.18, "linewidth": 0, "zorder": 0}
    axes.fill_between(times / late, 0, 1, where=on, step=step, **style).set_gid("engine on")


def _headline(solution: Any, late: float, late_unit: str) -> str:
    """The objective, duration and final mass, with times in the unit of the time axis."""
    about, problem = solution.provenance, solution.problem
    name = "" if about.problem_name == "problem" else about.problem_name.replace("_", " ") + ": "
    if not solution.optimal:
        return f"{name}NOT SOLVED ({solution.status}), the last iterate"
    kind = "objective" if problem is None else _wanted(problem.objective)
    size, unit = (late, late_unit) if about.objective_unit == "s" else (1.0, about.objective_unit)
    words = f"{name}{kind} {solution.objective / size:.6g} {unit.replace('^2', SQUARED)}"
    if about.objective_unit != "s":
        words += f", duration {solution.duration / late:.6g} {late_unit}"
    told = np.ptp(solution.path.mass) <= 1e-9 * solution.path.mass.max() or kind.endswith("final mass")
    return words if told else f"{words}, final mass {solution.final_mass:.6g} kg"


def _wanted(objective: Objective) -> str:
    """Such as `least effort` or `greatest final mass`."""
    return f"{'least' if objective.sense > 0 else 'greatest'} {objective.label}"


def _footnote(solution: Any, report: Report | None) -> tuple[str, bool]:
    """One line on numerics and checks, and whether all is well."""
    spent = solution.build_s + solution.solve_s
    mesh = f"order {solution.order}, {solution.steps} steps, {solution.iterations} iterations, {spent:.2g} s"
    scene = "" if solution.problem else "; problem not attached: zones and limits are not shown"
    if report is None:
        return mesh + scene, True
    failed = [check.name for check in report.checks if not check.ok]
    words = f"checks failed: {', '.join(failed)}" if failed else f"all {len(report.checks)} checks hold"
    return f"{mesh}; {words}{scene}", not failed
