"""A picture of numerical stability: long runs, rounding, and steps at the edge."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dmoc.charts.study import COLOURS, DASHES, MARKERS
from dmoc.plots.style import DARK, PALE, SETTINGS, WARNING, plain_numbers
from dmoc.studies.drift import Drift
from dmoc.studies.rounding import FORMS, Amplification, RoundOff

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Other methods are black, grey and pink, apart from the colours of the orders.
OTHERS = {"RK4": "#222222", "DOP853": "#808080", "DOP853, adaptive": "#CC79A7"}
# The relative rounding error of one addition [-] sets the height of the line of a random walk.
EPS = float(np.finfo(float).eps)
# The edges of stability are drawn up to this amplification a step [-].
HIGHEST = 1.6


def stability_figure(
    runs: Sequence[tuple[str, Sequence[Drift]]], rounding: Sequence[RoundOff], edges: Sequence[Amplification]
) -> Figure:
    """A matplotlib Figure: errors over revolutions and against time, rounding, growth beyond the limits.

    Parameters
    ----------
    runs : sequence of (name, rows)
        Of each orbit, from `drift`; the first one is also drawn over the revolutions.
    rounding, edges
        From `round_off` and `growth`.
    """
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(SETTINGS | {"font.size": 11, "axes.titlesize": 12, "axes.labelsize": 11}):
        page = Figure(figsize=(13.33, 7.5), layout="constrained")
        upper, lower = np.asarray(page.subfigures(2, 1))
        first, *panels = upper.subplots(1, 1 + len(runs))
        turning, rounds, growing = lower.subplots(1, 3)
        (name, rows), length = runs[0], runs[0][1][0].revolutions
        _draw_history(first, rows, 1, f"Energy error, {name}")
        _draw_history(turning, rows, 2, f"Angular momentum error, {name}")
        for axes, (orbit, found) in zip(panels, runs, strict=True):
            _draw_cost(axes, found, f"Energy error after {length:g} revolutions, {orbit}")
        _draw_rounding(rounds, rounding)
        _draw_growth(growing, edges)
        handles, labels = panels[0].get_legend_handles_labels()
        page.legend(handles, labels, loc="outside upper center", ncols=len(labels), fontsize=12)
    return page


def _style(method: str) -> dict[str, Any]:
    if method in COLOURS:
        return {"color": COLOURS[method], "linewidth": 2.4}
    i = list(OTHERS).index(method)
    return {"color": OTHERS[method], "linestyle": DASHES[i], "linewidth": 1.6}


def _draw_history(axes: Any, rows: Sequence[Drift], which: int, title: str) -> None:
    """An error over the revolutions, for the middle mesh of every method."""
    for method in dict.fromkeys(row.method for row in rows):
        meshes = [row for row in rows if row.method == method]
        row = meshes[len(meshes) // 2]
        axes.loglog(row.history[0], np.maximum(row.history[which], 1e-17), **_style(method))
    axes.set_title(title)
    axes.set_xlabel("revolutions")
    plain_numbers(axes.xaxis)


def _draw_cost(axes: Any, rows: Sequence[Drift], title: str) -> None:
    for i, method in enumerate(dict.fromkeys(row.method for row in rows)):
        meshes = [row for row in rows if row.method == method]
        times, errors = [1e6 * row.seconds for row in meshes], [row.energy_error for row in meshes]
        mark = "o" if method in COLOURS else MARKERS[i]
        axes.loglog(times, errors, label=method, marker=mark, markersize=5, **_style(method))
    axes.set_title(title)
    axes.set_xlabel("time a revolution [\u00b5s]")
    plain_numbers(axes.xaxis)


def _draw_rounding(axes: Any, rounding: Sequence[RoundOff]) -> None:
    steps = rounding[0].steps
    for row, colour in zip(rounding, (WARNING, COLOURS["order 2"], COLOURS["order 6"]), strict=True):
        words = r"$x_{k+1} = 2x_k - x_{k-1} + h^2 a_k$" if row.form == FORMS[0] else row.form
        axes.loglog(steps, row.momentum_error, color=colour, linewidth=2.2, label=words)
    # Independent rounding errors add up like a random walk, by the root of their number.
    axes.loglog(steps, EPS * np.sqrt(steps), color=PALE, linestyle=":", linewidth=1.4, label="random walk")
    # The curves leave room for the legend above them.
    axes.set_ylim(top=200 * rounding[0].momentum_error[-1])
    axes.legend(loc="upper left", fontsize=10)
    axes.set_title("Rounding alone: angular momentum error")
    axes.set_xlabel("steps")


def _draw_growth(axes: Any, edges: Sequence[Amplification]) -> None:
    for row in edges:
        axes.plot(row.reach, row.growth, **_style(row.method))
    limits = [(row.method, row.gaps[0][0]) for row in edges if row.method in COLOURS]
    place: dict[str, Any] = {"xycoords": "axes fraction", "fontsize": 10, "ha": "right"}
    axes.annotate("stable up to", (0.98, 0.3), color=DARK, **place)
    for i, (method, limit) in enumerate(limits):
        axes.plot([limit], [1.0], marker="v", color=COLOURS[method], markersize=8, zorder=5)
        words = f"{method}: {limit:.2f}"
        axes.annotate(words, (0.98, 0.24 - 0.06 * i), color=COLOURS[method], **place)
    axes.set_ylim(0.3, HIGHEST)
    axes.set_xlim(0.0, float(edges[0].reach[-1]))
    axes.set_title("Amplification of an oscillation in one step")
    axes.set_xlabel("h \u00d7 rate of the oscillation")
