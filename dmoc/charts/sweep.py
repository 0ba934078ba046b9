"""Pictures of a sweep: a curve, a map or a cloud of its objective, and the front of time against expense."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

import numpy as np

from dmoc.charts.front import (
    FRONT,
    along,
    draw_front,
    front_axes,
    is_front_itself,
    pareto,
    pretty,
    unit_of,
    wide,
)
from dmoc.charts.study import save_page
from dmoc.plots.style import DARK, FORBIDDEN, PALE, PATH, PUSH, SETTINGS, WARNING, plain_numbers, readable
from dmoc.sweeps.data import result

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from xarray import DataArray, Dataset

# A map has this many contour lines.
LEVELS = 8
# Contours bear numbers on maps of at least this many cells each way: on fewer the numbers stand on one another.
LABELLED = 12
# Lines on a map are white, on a dark page too, where white itself is turned dark.
ON_MAP = "#fefefe"


def save_sweep(data: Dataset, path: str | os.PathLike, dark: bool = False) -> None:
    """Draw the result of a sweep into a file, whole or not at all.

    Parameters
    ----------
    data : xarray.Dataset
        From `dmoc.sweep`, or read from its file.
    path : path
        Ends in .png, .pdf or .svg, which decides the format.
    dark : bool
        On a dark background.
    """
    save_page(sweep_figure(data), path, dark=dark)


def sweep_figure(data: Dataset) -> Figure:
    """A matplotlib Figure of a sweep.

    A sweep of one parameter is a curve. Two parameters are a map with contours, where failed points are
    hatched; more are a map of the best over the further dimensions. A sample is a cloud. Where durations
    differ, a second panel has every point by its duration and its expense, and the front of those that no
    other beats in both.
    """
    import matplotlib
    from matplotlib.figure import Figure

    objective = result(data, "objective")
    sampled = objective.dims[0] not in data.indexes
    if sampled and len(data.coords) == 1:
        # A sample of one parameter is drawn as a curve, in the order of its values.
        name = next(iter(data.coords))
        data, sampled = data.swap_dims({objective.dims[0]: name}).sortby(name), False
        objective = result(data, "objective")
    front = front_axes(data)
    alone = front is None or is_front_itself(data, front)
    with matplotlib.rc_context(SETTINGS):
        page = Figure(figsize=(9.0, 6.2) if alone else (13.33, 6.2), layout="constrained")
        panels = page.subplots(1, 1 if alone else 2, squeeze=False)[0]
        if sampled:
            _draw_cloud(panels[0], data, list(data.coords))
        elif objective.ndim == 1:
            _draw_curve(panels[0], data, front is not None and alone)
        else:
            _draw_map(panels[0], data)
        if front and not alone:
            draw_front(panels[1], data, front)
        for axis in (panels[0].xaxis, panels[0].yaxis)[: 2 if sampled or objective.ndim > 1 else 1]:
            if axis.get_scale() == "log":
                plain_numbers(axis)
        page.suptitle(_sweep_headline(data), fontsize=16, color=DARK)
        words, good = _sweep_footnote(data)
        page.supxlabel(words, fontsize=11, color=DARK if good else WARNING)
    return page


def _draw_curve(axes: Any, data: Dataset, front: bool) -> None:
    """The objective over the only parameter; points that failed are marked on the axis."""
    objective, solved = result(data, "objective"), result(data, "success").values
    place = along(axes.xaxis, data, objective.dims[0])
    size, unit = readable(objective.values, unit_of(objective))
    values = objective.values / size
    doubtful = solved & ~result(data, "checks_hold").values
    axes.plot(place, values, color=PATH, marker="o", markersize=4, label="solved")
    if doubtful.any():
        axes.plot(
            place[doubtful],
            values[doubtful],
            "o",
            color=PUSH,
            markersize=9,
            fillstyle="none",
            label="a check fails",
        )
    if not solved.all():
        floor = np.zeros(int((~solved).sum())) + 0.02
        axes.plot(
            place[~solved],
            floor,
            "x",
            color=WARNING,
            markersize=8,
            label="not solved",
            clip_on=False,
            transform=axes.get_xaxis_transform(),
        )
    if front:
        best = pareto(place, np.where(solved & ~doubtful, values, np.inf))
        axes.plot(place[best], values[best], **FRONT)
    if wide(values):
        axes.set_yscale("log")
    axes.set_ylabel(f"{_kind(objective)} [{pretty(unit)}]")
    axes.set_title(_title(objective))
    if front or doubtful.any() or not solved.all():
        axes.legend(loc="best")


def _draw_map(axes: Any, data: Dataset) -> None:
    """The objective over the first two dimensions; over any others its best."""
    from matplotlib.patheffects import withStroke

    objective, sense = result(data, "objective"), int(result(data, "objective").attrs["sense"])
    across, up = objective.dims[0], objective.dims[1]
    others = objective.dims[2:]
    best = (objective.min(others) if sense > 0 else objective.max(others)) if others else objective
    held = result(data, "checks_hold").any(others).values if others else result(data, "checks_hold").values
    x, y = along(axes.xaxis, data, across), along(axes.yaxis, data, up)
    size, unit = readable(best.values, unit_of(objective))
    values, solved = best.values.T / size, np.isfinite(best.values.T)
    edges = _edges(x, axes.get_xscale()), _edges(y, axes.get_yscale())
    cells = axes.pcolormesh(*edges, values, norm=_norm(values), cmap="viridis")
    if min(values.shape) > 2 and solved.sum() > 8 and np.ptp(values[solved]) > 0:
        lines = axes.contour(x, y, values, levels=_levels(values), colors=ON_MAP, linewidths=0.9)
        for text in axes.clabel(lines, fontsize=9, fmt="%.3g") if min(values.shape) >= LABELLED else ():
            text.set_path_effects([withStroke(linewidth=1.5, foreground=DARK)])
    _hatch(axes, edges, ~solved, "xxx", PALE, "not solved")
    _hatch(axes, edges, solved & ~held.T, "...", WARNING, "a check fails")
    if solved.any():
        row, column = np.unravel_index(np.nanargmin(sense * np.where(solved, values, np.nan)), values.shape)
        axes.plot(x[column], y[row], "*", color=FORBIDDEN, markersize=15, markeredgecolor=ON_MAP, label="best")
        axes.figure.colorbar(cells, ax=axes, label=f"{_kind(objective)} [{pretty(unit)}]")
    axes.grid(False)
    over = f", the best over {' and '.join(map(str, others))}" if others else ""
    axes.set_title(_title(objective) + over)
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.12), ncols=3)


def _draw_cloud(axes: Any, data: Dataset, names: list) -> None:
    """The points of a sample over the first two parameters."""
    objective, solved = result(data, "objective"), result(data, "success").values
    place = along(axes.xaxis, data, names[0])
    size, unit = readable(objective.values, unit_of(objective))
    values, words = objective.values / size, f"{_kind(objective)} [{pretty(unit)}]"
    height = along(axes.yaxis, data, names[1])
    style = {"c": values[solved], "norm": _norm(values), "cmap": "viridis", "s": 45}
    dots = axes.scatter(place[solved], height[solved], **style)
    axes.plot(place[~solved], height[~solved], "x", color=WARNING, label="not solved")
    axes.figure.colorbar(dots, ax=axes, label=words)
    if not solved.all():
        axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.12))
    axes.set_title(_title(objective))


def _hatch(
    axes: Any, edges: tuple[np.ndarray, np.ndarray], where: np.ndarray, hatch: str, colour: str, label: str
) -> None:
    """Cells of a map covered with a pattern that is seen in print too."""
    from matplotlib.collections import PolyCollection

    if not where.any():
        return
    left, low = edges
    corners = [(0, 0), (0, 1), (1, 1), (1, 0)]
    cells = [[(left[i + di], low[j + dj]) for di, dj in corners] for j, i in np.argwhere(where)]
    pattern = PolyCollection(cells, facecolor="none", edgecolor=colour, linewidth=0.0, hatch=hatch, label=label)
    axes.add_collection(pattern, autolim=False)


def _edges(centres: np.ndarray, scale: str) -> np.ndarray:
    """Where the cells around some centres meet, on an axis of this scale."""
    if scale == "log":
        return np.exp(_edges(np.log(centres), "linear"))
    if len(centres) == 1:
        return centres[0] + np.array([-0.5, 0.5])
    between = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate([[2 * centres[0] - between[0]], between, [2 * centres[-1] - between[-1]]])


def _norm(values: np.ndarray) -> Any:
    from matplotlib.colors import LogNorm, Normalize

    known = values[np.isfinite(values)]
    return (LogNorm if wide(values) else Normalize)(*((known.min(), known.max()) if known.size else (0, 1)))


def _levels(values: np.ndarray) -> np.ndarray:
    low, high = np.nanmin(values), np.nanmax(values)
    spread = np.geomspace if wide(values) else np.linspace
    return spread(low, high, LEVELS + 2)[1:-1]


def _kind(objective: DataArray) -> str:
    return str(objective.attrs.get("kind", "objective"))


def _title(objective: DataArray) -> str:
    return f"{'Least' if objective.attrs.get('sense', 1) > 0 else 'Greatest'} {_kind(objective)}"


def _sweep_headline(data: Dataset) -> str:
    fixed = ", ".join(f"{name} {value}" for name, value in json.loads(data.attrs["settings"]).items())
    varied = ", ".join(str(name).replace("_", " ") for name in data.coords)
    name = str(data.attrs["problem"]).replace("_", " ")
    return f"{name} over {varied}" + (f" ({fixed})" if fixed else "")


def _sweep_footnote(data: Dataset) -> tuple[str, bool]:
    """Numbers of points solved and failed in words, and whether all is well."""
    success, held = result(data, "success").values, result(data, "checks_hold").values
    solved, broken = int(success.sum()), int((success & ~held).sum())
    words = f"{success.size} points, {solved} solved"
    statuses, counts = np.unique(result(data, "status").values[~success].astype(str), return_counts=True)
    words += "".join(f", {count} {status}" for status, count in zip(statuses, counts, strict=True))
    words += f"; a check fails at {broken}" if broken else "; every check of these holds" if solved else ""
    return words, solved == success.size and not broken
