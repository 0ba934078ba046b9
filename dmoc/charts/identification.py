"""A picture of what a flight says: path and samples, residuals, intervals, correlations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dmoc.plots.style import AXIS_COLOURS, DARK, PALE, PATH, PUSH, SETTINGS, readable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dmoc.identification.estimate import Estimate

# Residuals are drawn with the lines between which 95 % of a normal distribution lie.
WIDE = 1.96
# Numbers on cells, which are light on a dark page, too.
ON_CELLS = "#111111"


def estimate_figure(found: Estimate) -> Figure:
    """A matplotlib Figure of an estimate."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(SETTINGS):
        page = Figure(figsize=(15, 8.4), layout="constrained")
        (way, left), (spans, alike) = page.subplots(2, 2)
        page.suptitle(f"{found.flight.name.replace('_', ' ')}: what {len(found.flight.times)} samples say")
        _draw_way(way, found)
        _draw_residuals(left, found)
        _draw_intervals(spans, found)
        _draw_correlations(alike, found)
    return page


def _draw_way(axes: Any, found: Estimate) -> None:
    """The samples of the marker and the path of the centre of mass, in the plane of x and y or over time."""
    seen, path, times = found.flight.positions, found.position, found.flight.times
    if found.flight.axes >= 2:
        size, unit = readable(path[:, :2], "m")
        axes.plot(*seen[:, :2].T / size, ".", color=PALE, markersize=4, label="measured, the marker")
        axes.plot(*path[:, :2].T / size, color=PATH, label="estimated, the centre of mass")
        axes.set_aspect("equal", adjustable="datalim")
        axes.set(title="Path", xlabel=f"x [{unit}]", ylabel=f"y [{unit}]")
    elif found.flight.axes == 1:
        axes.plot(times, seen, ".", color=PALE, markersize=4, label="measured")
        axes.plot(times, path, color=PATH, label="estimated")
        axes.set(title="Path", xlabel="time [s]", ylabel="x [m]")
    else:
        for i, name in enumerate(("qs", "qx", "qy", "qz")):
            axes.plot(times, found.flight.attitudes[:, i], color=(*AXIS_COLOURS, DARK)[i - 1], label=name)
        axes.set(title="Measured attitude", xlabel="time [s]", ylabel="quaternion [-]")
    axes.legend()


def _draw_residuals(axes: Any, found: Estimate) -> None:
    """Residuals of the first kind of measurement, over their standard deviation."""
    kind, rows = next(iter(found.residuals.items()))
    for i, column in enumerate(rows.T):
        axes.plot(
            np.arange(len(column)), column, ".", color=AXIS_COLOURS[i % 3], markersize=4, label="xyz"[i % 3]
        )
    for side in (-WIDE, WIDE):
        axes.axhline(side, color=PALE, linestyle=(0, (7, 4)), linewidth=1.4)
    axes.set(title=f"Residuals of the {kind}, over their noise", xlabel="sample", ylabel="[-]")
    # Above the panel: the dots may be anywhere in it.
    axes.legend(ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)


def _draw_intervals(axes: Any, found: Estimate) -> None:
    """Intervals in standard deviations from what was thought, or in parts of the value."""
    lines, spans = found.lines(), found.interval()
    for i, one in enumerate(found.wanted):
        low, high = spans[one.name]
        value = found.values[one.name]
        size = max(abs(value), abs(high - low) if np.isfinite(high - low) else 0.0, 1e-300)
        if np.isfinite(found.sigma[one.name]):
            axes.plot(
                [100 * (low - value) / size, 100 * (high - value) / size], [i, i], color=PUSH, linewidth=5
            )
        axes.plot(0, i, "o", color=DARK)
        _, told, span, unit = lines[i]
        axes.annotate(
            f"{told} {unit}   ({span})", (0, i), (0, 9), textcoords="offset points", ha="center", fontsize=10
        )
    axes.set_yticks(range(len(found.wanted)), _names(found))
    axes.set_ylim(len(found.wanted) - 0.4, -0.8)
    axes.set(title="95 % intervals", xlabel="off the estimate [% of it, or of the interval if that is more]")


def _draw_correlations(axes: Any, found: Estimate) -> None:
    """Correlations, from blue over white to orange, each with its number."""
    from matplotlib.colors import LinearSegmentedColormap

    ramp = LinearSegmentedColormap.from_list("signs", [PATH, "#FFFFFF", PUSH])
    values = found.correlation
    axes.imshow(values, cmap=ramp, vmin=-1, vmax=1, aspect="auto")
    for (i, j), value in np.ndenumerate(values):
        if np.isfinite(value):
            axes.text(j, i, f"{value:.2f}", ha="center", va="center", fontsize=10, color=ON_CELLS)
    names = _names(found)
    axes.set_xticks(range(len(names)), names, rotation=20, ha="right")
    axes.set_yticks(range(len(names)), names)
    axes.grid(False)
    axes.set(title="Correlations")


def _names(found: Estimate) -> list[str]:
    return [name.replace("_coefficient", "").replace("_", " ") for name in found.names]
