"""Time against expense over all points of a sweep, and helpers for every panel of its figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dmoc.plots.style import PALE, PUSH, plain_numbers, readable
from dmoc.sweeps.data import result
from dmoc.sweeps.plan import ordered

if TYPE_CHECKING:
    from xarray import DataArray, Dataset

# Powers in a unit are written with these raised digits.
SUPERSCRIPTS = {"^2": "\u00b2", "^3": "\u00b3"}
# Values whose largest is more than this many times the smallest are drawn on a logarithmic scale: on a linear
# one the small ones would all lie at the bottom.
WIDE_SPAN = 30.0
# A parameter has a logarithmic axis only if its largest value is more than this many times the smallest [-]: on
# a smaller span both kinds of axes look alike.
FACTOR = 4.0
# The front is drawn in this style, in a panel of its own or on the curve of the objective.
FRONT: dict[str, Any] = {
    "color": PUSH,
    "marker": "o",
    "markersize": 7,
    "fillstyle": "none",
    "linestyle": (0, (2, 2)),
    "label": "front: none is better in both",
}


def draw_front(axes: Any, data: Dataset, names: tuple[str, str]) -> None:
    """Every point that passed its checks by duration and expense, and those that none beats in both."""
    pair = [result(data, name) for name in names]
    known = result(data, "checks_hold").values
    scales = [readable(column.values, unit_of(column)) for column in pair]
    x, y = (column.values[known] / size for column, (size, _) in zip(pair, scales, strict=True))
    best = pareto(x, y)
    other = next((name for name in data.coords if name != "duration" and ordered(data[name].values)), None)
    if other is None:
        axes.plot(x, y, "o", color=PALE, markersize=5, alpha=0.6, label="solved")
    else:
        size = readable(data[other].values, unit_of(data[other]))[0]
        colours = data[other].broadcast_like(pair[0]).transpose(*pair[0].dims).values[known] / size
        norm = "log" if even_in_logs(data[other].values) else "linear"
        dots = axes.scatter(x, y, c=colours, cmap="cividis", norm=norm, s=30)
        axes.figure.colorbar(dots, ax=axes, label=coordinate(data, other)[1])
    axes.plot(x[best], y[best], **FRONT)
    if "duration" in data.coords and even_in_logs(data["duration"].values):
        axes.set_xscale("log")
        plain_numbers(axes.xaxis)
    if wide(y):
        axes.set_yscale("log")
    axes.set_xlabel(f"duration [{pretty(scales[0][1])}]")
    axes.set_ylabel(f"{names[1]} [{pretty(scales[1][1])}]")
    axes.set_title(f"Time against {names[1]}")
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.12))


def pareto(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The points that no other one beats or equals in both, by increasing x; less is better."""
    order = np.lexsort((y, x))
    lowest = np.minimum.accumulate(np.append(np.inf, y[order]))[:-1]
    return order[y[order] < lowest]


def front_axes(data: Dataset) -> tuple[str, str] | None:
    """The names of the results for time and for expense, or None where all points take the same time."""
    known = result(data, "checks_hold").values
    names = "duration", "propellant", "effort"
    durations, burned, effort = (result(data, name).values[known] for name in names)
    if durations.size < 3 or np.ptp(durations) < 1e-6 * durations.max():
        return None
    # Impulses that burn nothing are no effort either.
    return "duration", "propellant" if burned.max() > 0 else "effort" if effort.max() > 0 else "impulse"


def is_front_itself(data: Dataset, names: tuple[str, str]) -> bool:
    """Whether the curve of the objective shows time against expense already."""
    objective, expense = result(data, "objective"), result(data, names[1])
    same = np.allclose(objective, expense, rtol=1e-6, equal_nan=True)
    return bool(same) and objective.ndim == 1 and list(data.coords) == ["duration"]


def coordinate(data: Dataset, name: Any) -> tuple[np.ndarray, str]:
    """The places of a parameter's values on an axis, and the label of the axis."""
    values, unit = data[name].values, unit_of(data[name])
    if not ordered(values):
        return np.arange(float(len(values))), str(name)
    size, shown = readable(values, unit)
    label = str(name).replace("_", " ")
    return values / size, f"{label} [{pretty(shown)}]" if shown not in ("", "1") else label


def along(axis: Any, data: Dataset, name: Any) -> np.ndarray:
    """Label and scale an axis for a parameter; the places of the parameter's values on it."""
    places, label = coordinate(data, name)
    axis.set_label_text(label)
    if even_in_logs(data[name].values):
        axis.axes.set(**{f"{axis.axis_name}scale": "log"})
    if not ordered(data[name].values):
        axis.set_ticks(places, [str(value) for value in data[name].values])
    return places


def even_in_logs(values: np.ndarray) -> bool:
    """Whether values of a parameter are spread rather by equal factors than by equal differences."""
    if not ordered(values) or len(known := np.unique(values)) < 3 or known[0] <= 0:
        return False
    gaps = [np.diff(known), np.diff(np.log(known))]
    uneven = [gap.std() / gap.mean() for gap in gaps]
    return bool(known[-1] > FACTOR * known[0] and uneven[1] < uneven[0])


def wide(values: np.ndarray) -> bool:
    known = values[np.isfinite(values)]
    return bool(known.size and known.min() > 0 and known.max() > WIDE_SPAN * known.min())


def unit_of(array: DataArray) -> str:
    return str(array.attrs.get("units", ""))


def pretty(unit: str) -> str:
    for plain, raised in SUPERSCRIPTS.items():
        unit = unit.replace(plain, raised)
    return unit
