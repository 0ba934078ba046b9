"""Panels of a body that turns: its axes on a sphere or along the path, its controls, rates and angle to go."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dmoc.basics.quaternions import angle_between, normalised, rotated
from dmoc.plots.style import (
    AXIS_COLOURS,
    AXIS_LINES,
    CHANNEL_COLOURS,
    CHANNEL_LINES,
    DARK,
    FORBIDDEN,
    LIMIT,
    PALE,
    PATH,
    PUSH,
    flown_control,
    moments,
    readable,
    within_steps,
)
from dmoc.results.solution import Solution

# Body axes are drawn at this many places along a path: more would hide it.
TRIADS = 9
# A body axis along a path is this part of its extent [-].
TRIAD = 0.1
# More channels than this are drawn as a chart of firings, one row a channel: as lines they would cover each
# other.
MOST_LINES = 6
# The parallels and meridians of the sphere are this far apart [degrees].
GRATICULE = 30
# Circles on the sphere have this many points.
ROUND = 181


def draw_sphere(axes: Any, solution: Solution) -> None:
    """Where the body axes point on the way, on the unit sphere in space, with the cones of the constraints."""
    for line in globe_lines():
        axes.plot(*line.T, color=PALE, linewidth=0.7, alpha=0.45, zorder=1)
    attitude = normalised(within_steps(solution, solution.path.attitudes[0])[1])
    for i, name in enumerate("xyz"):
        along = rotated(attitude, np.broadcast_to(np.eye(3)[i], (len(attitude), 3)))
        axes.plot(*along.T, color=AXIS_COLOURS[i], linewidth=2.2, label=f"body {name}", zorder=4)
        axes.plot(
            *along[0], "o", markersize=8, markerfacecolor="white", markeredgecolor=AXIS_COLOURS[i], zorder=5
        )
        axes.plot(
            *along[-1], "*", markersize=14, markerfacecolor="white", markeredgecolor=AXIS_COLOURS[i], zorder=5
        )
    for constraint in solution.problem.constraints if solution.problem else ():
        _draw_cone(axes, solution, constraint, attitude)
    axes.plot([], [], "o", color=DARK, markerfacecolor="white", label="start")
    axes.plot([], [], "*", color=DARK, markerfacecolor="white", markersize=12, label="goal")
    axes.set(xlabel="x", ylabel="y", zlabel="z", xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_ticks([-1, 0, 1])
    axes.set_title("Directions of the body axes", loc="left")
    axes.set_box_aspect((1, 1, 1), zoom=0.95)
    axes.computed_zorder = False
    axes.view_init(elev=25, azim=35)
    axes.legend(ncol=3, loc="upper center", bbox_to_anchor=(0.5, -0.03))


def globe_lines() -> list[np.ndarray]:
    """Parallels and meridians of the unit sphere, shape (points, 3) each."""
    turn, level = np.radians(np.linspace(0, 360, ROUND)), np.zeros(ROUND)
    rings = [
        (np.cos(height) * np.cos(turn), np.cos(height) * np.sin(turn), level + np.sin(height))
        for height in np.radians(np.arange(-90 + GRATICULE, 90, GRATICULE))
    ]
    rings += [
        (np.cos(turn) * np.cos(east), np.cos(turn) * np.sin(east), np.sin(turn))
        for east in np.radians(np.arange(0, 180, GRATICULE))
    ]
    return [np.stack(ring, axis=1) for ring in rings]


def _draw_cone(axes: Any, solution: Solution, constraint: Any, attitude: np.ndarray) -> None:
    """The circle that a pointing limit draws on the sphere, and the way of the axis that it is about."""
    circle = constraint.on_sphere(np.array([solution.time[0], solution.time[-1]]), ROUND)
    if circle is None:
        return
    kept_out, rings = circle
    name = "pointing keep-out" if kept_out else "pointing keep-in"
    for ring in rings:
        axes.plot(*ring.T, color=FORBIDDEN, linestyle="-" if kept_out else "--", label=name, zorder=3)
    axis = np.broadcast_to(np.asarray(constraint.axis, float), (len(attitude), 3))
    if np.abs(np.asarray(constraint.axis)).max() < 1 - 1e-9:
        axes.plot(*rotated(attitude, axis).T, color=PUSH, label="axis of the limit", zorder=4)


def draw_triads(axes: Any, solution: Solution, size: float) -> None:
    """The body axes at a few places along the path, in a panel whose unit is `size` [m]."""
    few = np.unique(np.linspace(0, len(solution.position) - 1, TRIADS).round().astype(int))
    places, attitude = solution.position[few] / size, solution.path.attitudes[0][few]
    length = TRIAD * max(float(np.linalg.norm(np.ptp(places, axis=0))), 1e-12)
    for i, name in enumerate("xyz"):
        arms = length * rotated(attitude, np.broadcast_to(np.eye(3)[i], (len(few), 3)))
        for place, arm in zip(places, arms, strict=True):
            line = np.stack([place, place + arm])
            axes.plot(*line.T, color=AXIS_COLOURS[i], linewidth=2.0, zorder=5, label=f"body {name}")


def paths_of_points(solution: Solution) -> dict[str, np.ndarray]:
    """The paths of points of the body that have limits of their own [m], by the label of each."""
    limits = solution.problem.constraints if solution.problem else ()
    points = {(one.on, tuple(one.point)): one for one in limits if one.point is not None}
    if not points:
        return {}
    made, fine = solution.path.coordinates, within_steps(solution, solution.path.position)[1].copy()
    for at in made.quaternions:
        fine[:, at] = normalised(fine[:, at])
    still = np.zeros((len(fine), made.motions.size))
    return {
        f"path of point ({', '.join(f'{x:g}' for x in point)}) m{one.of_body}": one.seen_of(made, fine, still)[
            0
        ]
        for (_, point), one in sorted(points.items(), key=lambda known: known[0])
    }


def control_panels(solution: Solution) -> list[tuple[str, list[int]]]:
    """The channels of the actuator that share a panel: unit and places."""
    units = solution.provenance.control_units
    return [(unit, [i for i, one in enumerate(units) if one == unit]) for unit in dict.fromkeys(units)]


def draw_controls(axes: Any, solution: Solution, late: float, panel: tuple[str, list[int]]) -> None:
    """The controls of one unit over time, with their limits; firings of many thrusters one row each."""
    unit, channels = panel
    times, control = flown_control(solution)
    control = control[:, channels]
    labels = [solution.provenance.control_labels[i] for i in channels]
    if len(channels) > MOST_LINES:
        _draw_firings(axes, times / late, control, unit)
        return
    size, shown = readable(control, unit) if unit in ("N", "N m") else (1.0, unit)
    for i, (name, values) in enumerate(zip(labels, control.T, strict=True)):
        axes.plot(times / late, values / size, label=name, **_channel(i))
    actuator = solution.problem.actuator if solution.problem else None
    if actuator is not None:
        sides = np.array([np.asarray(side, float)[channels] for side in actuator.bounds(3)])
        largest = np.abs(control).max(initial=0.0)
        for level, words in limits_told(sides, labels):
            if abs(level) <= 4 * largest:
                axes.axhline(level / size, label=words, **LIMIT)
        if unit == "N m" and not np.isfinite(sides).any() and (limit := actuator.torque_limit()) is not None:
            # The limit is one of the magnitude.
            total = np.linalg.norm(control, axis=1) / size
            axes.plot(times / late, total, color=DARK, linestyle=(0, (1, 1)), label="magnitude")
            axes.axhline(limit / size, label="limit", **LIMIT)
    name = "torque" if unit == "N m" else "force"
    axes.set_ylabel(f"{name} [{shown}]")
    axes.set_title(f"{name.capitalize()} of the actuator" + (", held over each step" if solution.hold else ""))


def limits_told(sides: np.ndarray, names: Sequence[str]) -> list[tuple[float, str]]:
    """Each finite limit of several curves once, with the names of those that it is for unless it is for all.

    `sides` are the lower and the upper limits, shape (2, curves).
    """
    found = []
    for level in np.unique(sides[np.isfinite(sides)]):
        ours = [name for name, pair in zip(names, sides.T, strict=True) if level in pair]
        words = "limit" if len(ours) == len(names) else f"limit of {', '.join(ours)}"
        found.append((float(level), words))
    return found


def _draw_firings(axes: Any, times: np.ndarray, control: np.ndarray, unit: str) -> None:
    """One row a thruster, as dark as it fires."""
    most = float(np.abs(control).max(initial=0.0)) or 1.0
    for row, values in enumerate(control.T):
        axes.fill_between(
            times, row + 0.5, row + 0.5 + 0.9 * values / most, color=PUSH, linewidth=0, label="thrust of each"
        )
    axes.set_ylim(0.2, len(control.T) + 0.6)
    axes.set_yticks(np.arange(1, len(control.T) + 1, max(1, len(control.T) // 6)))
    axes.set_ylabel("thruster")
    axes.set_title(f"Firings, up to {most:.3g} {unit}")


def draw_rates(axes: Any, solution: Solution, late: float) -> None:
    """Angular rates in body axes, and their limit."""
    drawn = moments(solution)
    times, rates = drawn.time / late, drawn.rate
    assert rates is not None
    size, unit = (1.0, "rad/s") if np.abs(rates).max(initial=0.0) > 1e-2 else (1e-3, "mrad/s")
    for i, name in enumerate("xyz"):
        style = {"color": AXIS_COLOURS[i], "linestyle": AXIS_LINES[i], "linewidth": 1.8}
        axes.plot(times, rates[:, i] / size, label=f"$\\omega_{name}$", **style)
    axes.plot(
        times, np.linalg.norm(rates, axis=1) / size, color=DARK, linestyle=(0, (1, 1)), label="$|\\omega|$"
    )
    for constraint in solution.problem.constraints if solution.problem else ():
        if constraint.unit == "rad/s" and (limit := constraint.largest_speed()) is not None:
            axes.axhline(limit / size, label="limit", **LIMIT)
    axes.set_ylabel(f"rate [{unit}]")
    axes.set_title("Rates about the body axes")


def draw_wheels(axes: Any, solution: Solution, late: float) -> None:
    """Angular momenta of reaction wheels, and the most that they store."""
    drawn = moments(solution)
    held = drawn.wheel_momentum
    assert held is not None
    for i, values in enumerate(held.T):
        axes.plot(drawn.time / late, values, label=f"wheel{i + 1}", **_channel(i))
    largest = float(np.abs(held).max(initial=0.0))
    for constraint in solution.problem.constraints if solution.problem else ():
        if constraint.unit == "N m s" and (limit := constraint.largest_speed() or 0.0) <= 4 * largest:
            for side in (limit, -limit):
                axes.axhline(side, label="limit", **LIMIT)
    axes.set_ylabel("h [N m s]")
    axes.set_title("What the wheels store")


def _channel(index: int) -> dict[str, Any]:
    """The look of one curve of several that are no axes."""
    place = index % len(CHANNEL_COLOURS)
    return {"color": CHANNEL_COLOURS[place], "linestyle": CHANNEL_LINES[place], "linewidth": 1.8}


def draw_angle(axes: Any, solution: Solution, late: float) -> None:
    """The angle that is left to turn to the attitude at the goal."""
    times, attitude = within_steps(solution, solution.path.attitudes[0])
    left = np.degrees(angle_between(normalised(attitude), attitude[-1:]))
    axes.plot(times / late, left, color=PATH, label="to go")
    axes.set_ylim(bottom=0)
    axes.set_ylabel("angle [degrees]")
    axes.set_title("Angle to the last attitude")
