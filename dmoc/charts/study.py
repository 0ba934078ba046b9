"""Pictures of a study: error against time, one line a method."""

from __future__ import annotations

import os
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from dmoc.basics.files import as_path, whole_file
from dmoc.plots.page import SUFFIXES
from dmoc.plots.sheet import darkened
from dmoc.plots.style import DARK, SETTINGS, plain_numbers
from dmoc.studies.accuracy import COLD, COMPILED, Trial

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# The orders have colours of Okabe and Ito's palette, which stay apart under colour blindness.
COLOURS = {"order 2": "#E69F00", "order 4": "#009E73", "order 6": "#0072B2", "order 8": "#D55E00"}
# Other methods have these greys in turn, so that the orders stand out.
GREYS = ("#4D4D4D", "#808080", "#666666", "#8C8C8C", "#595959", "#737373")
# Other methods have these markers in turn, none of them the circle of the orders.
MARKERS = "sD^vPX*<>h"
# Other methods have these dashes in turn.
DASHES = ((0, (5, 2)), (0, (1, 1.5)), (0, (7, 2, 1, 2)), (0, (3, 1.5)), (0, (5, 1.5, 1, 1.5, 1, 1.5)))
# Two labels are at least this part of the panel's height apart [-], so that they do not overlap.
APART = 0.045


def save_study(trials: Sequence[Trial], path: str | os.PathLike, title: str = "", dark: bool = False) -> None:
    """Draw error against time into a file, whole or not at all.

    Parameters
    ----------
    trials : sequence of Trial
        From `work_precision`.
    path : path
        Ends in .png, .pdf or .svg, which decides the format.
    title : str
        Title of the figure: the problem that was solved.
    dark : bool
        On a dark background.

    Raises
    ------
    ValueError
        If the suffix is another one, the folder does not exist, or nothing was solved.
    """
    save_page(study_figure(trials, title), path, dark=dark)


def save_page(page: Figure, path: str | os.PathLike, dpi: float = 150, dark: bool = False) -> None:
    """Write a figure into a .png, .pdf or .svg file, whole or not at all; ValueError if it cannot be."""
    if as_path(path).suffix.lower() not in SUFFIXES:
        raise ValueError(f"cannot draw into {path}: the file must end in {', '.join(SUFFIXES)}")
    darkened(page, dark)
    with whole_file(path) as temporary:
        page.savefig(temporary, dpi=dpi)


def study_figure(trials: Sequence[Trial], title: str = "") -> Figure:
    """A matplotlib Figure: error of the objective and of the path against time, log over log."""
    import matplotlib
    from matplotlib.figure import Figure

    solved = [trial for trial in trials if trial.status == "solved"]
    if not solved:
        raise ValueError("nothing was solved, so there is nothing to draw; try other steps")
    with matplotlib.rc_context(SETTINGS):
        page = Figure(figsize=(13.33, 7.5), layout="constrained")
        left, right = page.subplots(1, 2, sharex=True)
        for axes, quantity, words in (
            (left, "error", "Relative error of the objective"),
            (right, "path_error", "Goal missed by an independent integrator, relative"),
        ):
            curves = {
                name: [(1e3 * t.seconds, getattr(t, quantity)) for t in solved if t.method == name]
                for name in dict.fromkeys(trial.method for trial in solved)
            }
            ends = _draw(axes, curves)
            _label(axes, ends)
            axes.set_title(words)
            axes.set_xlabel("build and solve [ms]")
        page.suptitle(title, fontsize=16, color=DARK)
    return page


def _draw(axes: Any, curves: dict[str, list[tuple[float, float]]]) -> list[tuple]:
    """Draw curves; where each ends, with its name and colour."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    others = [name for name in curves if name.removesuffix(COLD).removesuffix(COMPILED) not in COLOURS]
    ends = []
    for name, points in curves.items():
        x, y = np.array(points).T
        style = _curve_style(name, others)
        axes.plot(x, np.maximum(y, 1e-16), label=name, markersize=6, **style)
        ends.append((x[-1], max(y[-1], 1e-16), name, style["color"]))
    plain_numbers(axes.xaxis)
    return ends


def _curve_style(name: str, others: list[str]) -> dict[str, Any]:
    if name in others:
        i = others.index(name)
        return {
            "color": GREYS[i % len(GREYS)],
            "linestyle": DASHES[i % len(DASHES)],
            "marker": MARKERS[i % len(MARKERS)],
            "linewidth": 1.4,
        }
    cold, compiled = name.endswith(COLD), name.endswith(COMPILED)
    colour = COLOURS[name.removesuffix(COLD).removesuffix(COMPILED)]
    return {
        "color": colour,
        "linestyle": ":" if cold else "--" if compiled else "-",
        "marker": "o",
        "markerfacecolor": "white" if cold else colour,
        "linewidth": 1.6 if cold else 2.4,
    }


def _label(axes: Any, ends: list[tuple]) -> None:
    """Names right of the panel, at the height of the curves' ends but apart from each other."""
    low, high = np.log10(axes.get_ylim())
    heights = np.array([(np.log10(y) - low) / (high - low) for _, y, *_ in ends])
    places = heights.copy()
    order = np.argsort(heights)
    for before, after in pairwise(order):
        places[after] = max(places[after], places[before] + APART)
    places -= max(places.max() - 0.98, 0.0)
    for (x, y, name, colour), place in zip(ends, places, strict=True):
        axes.annotate(
            name,
            xy=(x, y),
            xytext=(1.02, place),
            textcoords="axes fraction",
            color=colour,
            fontsize=11,
            va="center",
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.6, "alpha": 0.6, "shrinkB": 4},
        )
