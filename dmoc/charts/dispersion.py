"""A picture of flights with errors: where they go, and how their spread grows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from dmoc.plots.style import AXIS_COLOURS, AXIS_LINES, DARK, FORBIDDEN, PALE, PATH, PUSH, SETTINGS, readable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dmoc.sensitivity.dispersion import Dispersion

# Ellipses hold 95 % of a normal distribution in the plane: they are so many standard deviations wide.
WIDE = float(np.sqrt(-2 * np.log(0.05)))
# Of all step ends these many have an ellipse, and these many flights are drawn as lines.
ELLIPSES, LINES = 9, 60
# Points of an ellipse, and of the curve of a flight.
POINTS, CURVE = 73, 400


def dispersion_figure(found: Dispersion, solution: Any) -> Figure:
    """A matplotlib Figure: flights and 95 % ellipses, the miss of the planned end, spread over time."""
    import matplotlib
    from matplotlib.figure import Figure

    axes = found.position.shape[2]
    with matplotlib.rc_context(SETTINGS):
        page = Figure(figsize=(15, 5.2), layout="constrained")
        way, end, growth = page.subplots(1, 3)
        name = solution.provenance.problem_name.replace("_", " ")
        page.suptitle(f"{name}: {found.samples} flights with errors, seed {found.seed}")
        if axes == 1:
            _draw_line(way, found)
            _draw_states(end, found)
        else:
            _draw_way(way, found, solution)
            _draw_end(end, found)
        _draw_growth(growth, found)
    return page


def _draw_way(axes: Any, found: Dispersion, solution: Any) -> None:
    """Flights in the plane of x and y, with zones that are discs there."""
    size, unit = readable(found.planned[0], "m")
    for shape in solution.problem.constraints:
        if getattr(shape, "radius", None) is not None and len(shape.center) == 2:
            ring = np.array(shape.center) / size + shape.radius / size * _circle()
            axes.fill(*ring.T, color=FORBIDDEN, alpha=0.35, linewidth=0)
    _, some, plan = _between(found)
    for flight in some:
        axes.plot(*flight[:, :2].T / size, color=PALE, linewidth=0.5, alpha=0.5)
    axes.plot(*plan[:, :2].T / size, color=PATH, label="planned")
    for i in np.linspace(0, len(found.time) - 1, ELLIPSES + 1).astype(int)[1:]:
        ring = found.planned[0][i, :2] + _ellipse(found.covariance[i][:2, :2])
        axes.plot(
            *ring.T / size,
            color=PUSH,
            linewidth=1.6,
            label="95 %, linear" if i == len(found.time) - 1 else None,
        )
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(title="Flights", xlabel=f"x [{unit}]", ylabel=f"y [{unit}]")
    axes.legend()


def _draw_end(axes: Any, found: Dispersion) -> None:
    """Where flights end, from where they should."""
    off = found.position[:, -1, :2] - found.planned[0][-1, :2]
    size, unit = readable(off, "m")
    axes.plot(*off.T / size, ".", color=PATH, markersize=3, alpha=0.5, label="flights")
    axes.plot(*_ellipse(found.covariance[-1][:2, :2]).T / size, color=PUSH, label="95 %, linear")
    spread = np.cov(off.T)
    ring = off.mean(axis=0) + _ellipse(spread)
    axes.plot(*ring.T / size, color=DARK, linestyle=(0, (4, 2)), linewidth=1.4, label="95 %, sampled")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(title="Miss of the planned end", xlabel=f"x [{unit}]", ylabel=f"y [{unit}]")
    axes.legend()


def _draw_line(axes: Any, found: Dispersion) -> None:
    """Along a line, flights over time."""
    size, unit = readable(found.planned[0], "m")
    clock, name = readable(found.time, "s")
    times, some, plan = _between(found)
    for flight in some:
        axes.plot(times / clock, flight / size, color=PALE, linewidth=0.5, alpha=0.5)
    axes.plot(times / clock, plan / size, color=PATH, label="planned")
    axes.set(title="Flights", xlabel=f"time [{name}]", ylabel=f"x [{unit}]")
    axes.legend()


def _draw_states(axes: Any, found: Dispersion) -> None:
    """Along a line, position and velocity at the end."""
    off = [
        part[:, -1, 0] - plan[-1, 0]
        for part, plan in zip((found.position, found.velocity), found.planned, strict=True)
    ]
    (size, unit), (pace, speed) = readable(off[0], "m"), readable(off[1], "m/s")
    ring = _ellipse(found.covariance[-1])
    axes.plot(off[0] / size, off[1] / pace, ".", color=PATH, markersize=3, alpha=0.5, label="flights")
    axes.plot(ring[:, 0] / size, ring[:, 1] / pace, color=PUSH, label="95 %, linear")
    axes.set(title="Miss of the planned end", xlabel=f"x [{unit}]", ylabel=f"velocity [{speed}]")
    axes.legend()


def _draw_growth(axes: Any, found: Dispersion) -> None:
    """Standard deviations of the position over time: lines to first order, dots of the flights."""
    n = found.position.shape[2]
    linear, sampled = found.sigma[:, :n], found.sampled_sigma[:, :n]
    size, unit = readable(sampled, "m")
    clock, name = readable(found.time, "s")
    some = np.linspace(0, len(found.time) - 1, min(len(found.time), 17)).astype(int)
    for i in range(n):
        style = {"color": AXIS_COLOURS[i], "linestyle": AXIS_LINES[i]}
        axes.plot(found.time / clock, linear[:, i] / size, label=f"{'xyz'[i]}, linear", **style)
        axes.plot(found.time[some] / clock, sampled[some, i] / size, "o", color=AXIS_COLOURS[i], markersize=4)
    axes.plot([], [], "o", color=PALE, markersize=4, label="of the flights")
    axes.set(
        title="Standard deviation of the position",
        xlabel=f"time [{name}]",
        ylabel=f"standard deviation [{unit}]",
    )
    axes.legend()


def _between(found: Dispersion) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, some flights and the planned one between the step ends, too: cubic from position and velocity."""
    times = np.linspace(found.time[0], found.time[-1], CURVE)
    some = CubicHermiteSpline(found.time, found.position[:LINES], found.velocity[:LINES], axis=1)(times)
    return times, some, CubicHermiteSpline(found.time, *found.planned)(times)


def _circle() -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi, POINTS)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _ellipse(covariance: np.ndarray) -> np.ndarray:
    """The ellipse around zero that holds 95 % of a normal distribution."""
    sizes, ways = np.linalg.eigh(covariance)
    return WIDE * _circle() * np.sqrt(np.maximum(sizes, 0.0)) @ ways.T
