"""The page of a team: the paths of its bodies, where they are at equal times, forces, speeds and distances."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dmoc.plots.lanes import LEG_LINES
from dmoc.plots.mission import scenery
from dmoc.plots.path import extent_of, frame, legend, lies_wide, mark_burns, pushes, scale_of, scaled_arrows
from dmoc.plots.sheet import arrange, entitle, new_page, new_panels, shade_burns
from dmoc.plots.style import DARK, LIMIT, PALE, flown_force, readable, speeds, within_steps
from dmoc.plots.surroundings import draw_scene
from dmoc.surroundings.view import view_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dmoc.checks.verification import Report
    from dmoc.teams.solution import TeamSolution

# Bodies have these colours in turn, none of which is that of zones; then the next kind of line.
BODY_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#E69F00", "#56B4E9")
# Where all bodies are is marked at so many equal times between start and goal.
MOMENTS = 5
# A legend has room for so many pairs; more are drawn in grey, and the nearest of all in a colour.
MOST_PAIRS = 6
# Distances that grow much larger are drawn up to so many times what is to be kept, or the least of all [-].
FAR = 4.0


def team_page(solution: TeamSolution, report: Report | None = None) -> Figure:
    """A matplotlib Figure of a team, whose settings are those of the caller."""
    page = new_page(solution.dimension)
    around: Any = scenery(solution)  # type: ignore[arg-type]
    view = view_of(around, solution.position) if solution.dimension > 1 else None
    wide = view is not None and lies_wide(view)
    path, panels = new_panels(page, solution.dimension, wide, len(LANES))
    if view is not None:
        _draw_paths(path, solution, (around, view), wide)
    else:
        draw_lines(path, solution)
    size, unit = readable(solution.time, "s")
    for panel, draw in zip(panels, LANES, strict=True):
        draw(panel, solution, size)
        for one in solution.parts:
            shade_burns(panel, one, size)
        for time in joint_times(solution):
            panel.axvline(time / size, color=PALE, linewidth=0.9, linestyle=(0, (2, 2)), zorder=0.8)
    arrange(page, panels, wide, unit)
    entitle(page, solution, report, size, unit)
    return page


def styles(names: Sequence[str]) -> list[dict[str, Any]]:
    """The colour and the line of each body."""
    found = []
    for i in range(len(names)):
        turn, place = divmod(i, len(BODY_COLOURS))
        found.append({"color": BODY_COLOURS[place], "linestyle": LEG_LINES[turn % len(LEG_LINES)]})
    return found


def drawn(solution: TeamSolution) -> Iterator[tuple[str, Any, dict[str, Any]]]:
    """Each part of each body with its label and its look; the legs of a body have one label."""
    for name, one, style in zip(solution.names, solution.members, styles(solution.names), strict=True):
        for i, part in enumerate(one.parts):
            yield "_leg" if i else name, part, style


def joint_times(solution: TeamSolution) -> list[float]:
    """When a leg of some body begins that is not its first [s]."""
    return [leg.provenance.start_time for leg in solution.members[0].parts[1:]]


def _draw_paths(axes: Any, solution: TeamSolution, scenery: tuple[Any, Any], beside: bool) -> None:
    """The paths, each in its colour, with forces and marks where all bodies are at equal times."""
    around, view = scenery
    size, unit = scale_of(solution.position, *view)
    view = view[0] / size, view[1] / size
    proxies = draw_scene(axes, around, view, size)
    extent = extent_of(solution.position)
    moments = np.linspace(0.0, 1.0, MOMENTS + 2)
    for one, style in zip(solution.members, styles(solution.names), strict=True):
        _mark(axes, _at(one, moments) / size, style["color"])
        if len(joints := _joints(one)):
            # The corners show behind the number of a moment.
            look = {"linestyle": "none", "marker": "D", "markersize": 12, "zorder": 5.9}
            look |= {"markerfacecolor": "white", "markeredgecolor": style["color"]}
            axes.plot(*joints.T / size, label="joint", **look)
    for name, one, style in drawn(solution):
        curve = within_steps(one, one.position)[1] / size
        mark_burns(axes, one, one.position.T / size)
        axes.plot(*curve.T, label=name, zorder=4.5, **style)
        tails, arrows, _ = scaled_arrows(*pushes(one), extent)
        _arrows(axes, tails / size, arrows / size, style["color"])
        if solution.dimension == 3:
            floor = np.full(len(curve), view[0][2])
            axes.plot(curve[:, 0], curve[:, 1], floor, color=PALE, linewidth=1.2, label="_projection", zorder=0)
    if solution.dimension == 3:
        axes.computed_zorder = False
    frame(axes, view, unit)
    axes.set_title("Paths; marks at equal times, arrows are forces", loc="left")
    legend(axes, proxies, beside)


def _at(one: Any, fractions: np.ndarray) -> np.ndarray:
    """Places of a body at fractions of the duration [m], near enough for a mark."""
    parts = [within_steps(part, part.position) for part in one.parts]
    times, curve = (np.concatenate(side) for side in zip(*parts, strict=True))
    at = one.time[0] + fractions * one.duration
    return np.stack([np.interp(at, times, column) for column in curve.T], axis=1)


def _joints(one: Any) -> np.ndarray:
    """Places where something happens to a body on its way, shape (joints, axes) [m]."""
    joints = getattr(one.problem, "joints", ())
    places = [one.parts[joint.right].position[0] for joint in joints[1:-1] if joint.events]
    return np.array(places).reshape(-1, one.position.shape[1])


def _mark(axes: Any, places: np.ndarray, colour: str) -> None:
    """A circle at the start, a star at the goal, and the number of each equal time between them."""
    style = {"linestyle": "none", "markerfacecolor": "white", "markeredgecolor": colour, "zorder": 6}
    axes.plot(*places[:1].T, marker="o", markersize=10, label="_start", **style)
    axes.plot(*places[-1:].T, marker="*", markersize=17, label="_goal", **style)
    axes.plot(*places[1:-1].T, marker="o", markersize=13, label="_moments", **style)
    for i, place in enumerate(places[1:-1]):
        words = {"ha": "center", "va": "center", "fontsize": 8, "color": DARK, "zorder": 7, "clip_on": True}
        axes.text(*place, str(i + 1), **words)


def _arrows(axes: Any, tails: np.ndarray, arrows: np.ndarray, colour: str) -> None:
    if not len(tails):
        return
    style: dict[str, Any] = {"arrow_length_ratio": 0.3, "linewidth": 1.2}
    if tails.shape[1] == 2:
        style = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "units": "inches", "width": 0.02}
    axes.quiver(*tails.T, *arrows.T, color=colour, alpha=0.6, zorder=4, **style).set_gid("force")


def draw_lines(axes: Any, solution: TeamSolution) -> None:
    """Positions against time in one dimension."""
    (late, late_unit), (size, unit) = readable(solution.time, "s"), readable(solution.position, "m")
    for name, one, style in drawn(solution):
        times, path = within_steps(one, one.position)
        axes.plot(times / late, path[:, 0] / size, label=name, **style)
    axes.set(xlabel=f"time [{late_unit}]", ylabel=f"x [{unit}]")
    axes.set_title("Positions")
    legend(axes, [])


def _draw_forces(axes: Any, solution: TeamSolution, late: float) -> None:
    """The magnitude of the force on each body, and its limit where it comes near it."""
    size, unit = readable(np.concatenate([one.force.ravel() for one in solution.parts]), "N")
    for name, one, style in drawn(solution):
        times, force = flown_force(one)
        if one.hold:
            times, force = np.repeat(one.end_times, 2)[1:-1], np.repeat(one.force, 2, axis=0)
        strength = np.linalg.norm(force, axis=1)
        axes.plot(times / late, strength / size, label=name, **style)
        limit = None if one.problem is None else one.problem.actuator.force_limit()
        if limit is not None and limit < 2 * strength.max():
            axes.axhline(limit / size, **LIMIT | {"color": style["color"]})
    axes.set_ylim(bottom=0)
    axes.set_ylabel(f"|F| [{unit}]")
    axes.set_title("Forces of the actuators")


def _draw_speeds(axes: Any, solution: TeamSolution, late: float) -> None:
    curves = [(*speeds(one), style) for _, one, style in drawn(solution)]
    size, unit = readable(np.concatenate([speed for _, speed, _ in curves]), "m/s")
    for times, speed, style in curves:
        axes.plot(times / late, speed / size, label="_body", **style)
    name = "velocities" if solution.dimension == 1 else "speeds"
    axes.set_ylabel(f"{name} [{unit}]")
    axes.set_title(name.capitalize())


def _draw_distances(axes: Any, solution: TeamSolution, late: float) -> None:
    """The distance of each two bodies, and what they are to keep."""
    names = solution.names
    every = [(i, k) for i in range(len(names)) for k in range(i + 1, len(names))]
    curves = []
    for i, k in every:
        pairs = zip(solution.members[i].parts, solution.members[k].parts, strict=True)
        parts = [within_steps(one, other.position - one.position) for one, other in pairs]
        times, within = (np.concatenate(side) for side in zip(*parts, strict=True))
        curves.append((times, np.linalg.norm(within, axis=1)))
    kept = {}
    if solution.problem is not None:
        kept = {(a, b): part.distance_kept for part, a, b in solution.problem.pairs() if part.distance_kept}
    size, unit = readable(np.concatenate([distance for _, distance in curves]), "m")
    colours = styles(names)
    for (i, k), (times, distance) in zip(every, curves, strict=True):
        label = f"{names[i]}, {names[k]}" if len(every) <= MOST_PAIRS else "_pair"
        # A line of the colours of both bodies.
        style = {"color": colours[i]["color"], "gapcolor": colours[k]["color"], "linestyle": (0, (4, 4))}
        axes.plot(times / late, distance / size, label=label, **style)
    for least in sorted(set(kept.values())):
        axes.axhline(least / size, label="to be kept", **LIMIT)
    most = 1.05 * max(float(distance.max()) for _, distance in curves)
    if kept:
        nearest = min(float(distance.min()) for _, distance in curves)
        top = FAR * max(*kept.values(), nearest)
        most = top if most > FAR / 2 * top else most
    axes.set_ylim(0.0, (most or 1.0) / size)
    axes.set_ylabel(f"distance [{unit}]")
    axes.set_title("Distance of each two bodies")


# What is drawn over time of a team.
LANES = (_draw_forces, _draw_speeds, _draw_distances)
