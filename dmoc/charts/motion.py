"""A picture of a path that was marched forward: where it goes, how fast, and its energy."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from dmoc.basics.digits import lasting
from dmoc.charts.study import save_page
from dmoc.conversions.marched import marched_columns
from dmoc.plots.path import frame, legend, mark_ends, scale_of
from dmoc.plots.sheet import arrange, new_page, new_panels
from dmoc.plots.style import DARK, PATH, SETTINGS, readable
from dmoc.plots.surroundings import colour_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dmoc.motion.march import Trajectory

# Colours of several bodies, or of several numbers in a panel.
COLOURS = (PATH, "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", DARK)
# Space around a path [-] of its extent.
MARGIN = 0.05


def save_motion(trajectory: Trajectory, problem: Any, path: str | os.PathLike, dark: bool = False) -> None:
    """Draw a simulation into a .png, .pdf or .svg, whole or not at all."""
    save_page(motion_figure(trajectory, problem), path, dark=dark)


def motion_figure(trajectory: Trajectory, problem: Any) -> Figure:
    """A matplotlib Figure: the paths of the bodies, their speeds or rates, and the change of the energy.

    In place of paths with one axis or none there are positions or attitudes over time.
    """
    import matplotlib

    columns = marched_columns(trajectory, problem)
    places, speeds = (_bodies(columns, name) for name in ("position", "velocity"))
    dimension = min((rows.shape[1] for rows in places.values()), default=0)
    late, unit = readable(trajectory.time, "s")
    with matplotlib.rc_context(SETTINGS):
        page = new_page(dimension)
        main, panels = new_panels(page, dimension, False, 2)
        if dimension > 1:
            _draw_paths(main, places, problem)
        else:
            name, shown = ("x [m]", places) if dimension else ("quaternion [-]", _bodies(columns, "attitude"))
            _draw_lines(main, trajectory.time / late, shown, name)
            main.set_xlabel(f"time [{unit}]")
        if speeds:
            rows = {body: np.linalg.norm(each, axis=1)[:, None] for body, each in speeds.items()}
            _draw_sizes(panels[0], trajectory.time / late, rows, "speed", "m/s")
        else:
            _draw_sizes(panels[0], trajectory.time / late, _bodies(columns, "rate"), "rate", "rad/s")
        change = {"": (trajectory.energy - trajectory.energy[0])[:, None]}
        _draw_sizes(panels[1], trajectory.time / late, change, "change of energy", "J/kg")
        arrange(page, panels, False, unit)
        name = problem.name.replace("_", " ")
        span = lasting(trajectory.time[-1] - trajectory.time[0], 6)
        page.suptitle(
            f"{name}: simulated for {span}, {len(trajectory.time) - 1} steps", fontsize=16, color=DARK
        )
    return page


def _bodies(columns: dict[str, np.ndarray], name: str) -> dict[str, np.ndarray]:
    """The columns of a name by body, an only body without a name."""
    found: dict[str, list[np.ndarray]] = {}
    for column, values in columns.items():
        if column.startswith(f"{name} "):
            label = column.removeprefix(f"{name} ").split(" [")[0]
            found.setdefault(label.rpartition(".")[0], []).append(values)
    return {body: np.stack(values, axis=1) for body, values in found.items()}


def _draw_paths(axes: Any, places: dict[str, np.ndarray], problem: Any) -> None:
    every = np.concatenate(list(places.values()))
    dimension = every.shape[1]
    sources = getattr(problem, "stretches", (problem,))[0].attraction.sources
    centers = [source.place(dimension) for source in sources]
    reach = np.ptp(every, axis=0).max() or 1.0
    near = [at for at in centers if (np.abs(at - np.clip(at, every.min(0), every.max(0))) < reach).all()]
    shown = np.concatenate([every, *[at[None] for at in near]])
    low, high = shown.min(axis=0) - MARGIN * reach, shown.max(axis=0) + MARGIN * reach
    size, unit = scale_of(every, low, high)
    for i, (body, rows) in enumerate(places.items()):
        axes.plot(*rows.T / size, color=COLOURS[i % len(COLOURS)], label=body or "path", zorder=3)
        mark_ends(axes, rows[:1].T / size, rows[-1:].T / size)
    for line in axes.lines:
        if line.get_label() == "goal":
            line.set_label("end")
    for source, at in zip(sources, centers, strict=True):
        if any(at is other for other in near):
            style = {"linestyle": "none", "marker": "o", "markersize": 13, "markeredgecolor": DARK}
            axes.plot(*(at[:, None] / size), markerfacecolor=colour_of(source), label="attractor", **style)
    frame(axes, (low / size, high / size), unit)
    legend(axes, [])


def _draw_lines(axes: Any, times: np.ndarray, rows: dict[str, np.ndarray], name: str) -> None:
    """Numbers of each body over time."""
    count = 0
    for body, values in rows.items():
        for column in values.T:
            which = f" {'sxyz'[count % 4]}" if values.shape[1] == 4 else ""
            label = f"{body}{which}".strip() or "path"
            axes.plot(times, column, color=COLOURS[count % len(COLOURS)], label=label)
            count += 1
    axes.set_ylabel(name)
    axes.set_title(name.split(" [")[0].replace("x", "Position").capitalize(), loc="left")
    legend(axes, [])


def _draw_sizes(axes: Any, times: np.ndarray, rows: dict[str, np.ndarray], name: str, unit: str) -> None:
    size, shown = readable(np.concatenate([values.ravel() for values in rows.values()]), unit)
    count = 0
    for body, values in rows.items():
        for i, column in enumerate(values.T):
            # a line alone needs no name in the legend
            label = f"{body} {'xyz'[i]}".strip() if values.shape[1] == 3 else body or "_alone"
            axes.plot(times, column / size, color=COLOURS[count % len(COLOURS)], label=label)
            count += 1
    axes.set_ylabel(f"{name} [{shown}]")
    axes.set_title(name.capitalize())
