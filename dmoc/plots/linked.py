"""Pictures of bodies that links hold: where they go, the links at some times, and the forces in them."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmoc.basics.quaternions import normalised
from dmoc.configurations.of_problem import configuration_of
from dmoc.links.along import states_of
from dmoc.links.joint import room
from dmoc.plots.path import entries_once
from dmoc.plots.style import CHANNEL_COLOURS, CHANNEL_LINES, DARK, LIMIT, PALE, moments, readable, within_steps
from dmoc.plots.surroundings import draw_scene
from dmoc.plots.turning import paths_of_points
from dmoc.results.solution import Solution
from dmoc.surroundings.view import view_of

# Links are drawn at this many times.
TIMES = 9
# A picture is wider than the paths in it by this part of their extent.
MARGIN = 0.08
# Labels of the axes in space are this far from the axes [points].
LABELS_OFF = 14
# With a label of more letters than this a row of the legend has three entries.
LONG_LABEL = 20
# Of more reactions than this the magnitudes are drawn, one curve a link.
MOST_CURVES = 4


def draw_bodies(axes: Any, solution: Solution) -> None:
    """The path of each body, and the links at even times, darker as time goes by."""
    made = solution.path.coordinates
    bodies = list(dict.fromkeys(block.body for block in made.blocks))
    fine = _fine(solution)[1]
    size, unit = readable(np.ptp(solution.position, axis=0), "m")
    paths = {body: fine[:, made.of_body(body)[0] & made.places] / size for body in bodies}
    for i, (body, path) in enumerate(paths.items()):
        colour = CHANNEL_COLOURS[i % len(CHANNEL_COLOURS)]
        axes.plot(*path.T, color=colour, linewidth=2.0, label=body or "path", zorder=4)
        for place, marker, name in ((0, "o", "_start"), (-1, "*", "_goal")):
            style = {"markersize": 8 if marker == "o" else 13, "markerfacecolor": "white", "zorder": 6}
            axes.plot(*path[place, :, None], marker, markeredgecolor=colour, label=name, **style)
    shown = [*paths.values(), *_draw_links(axes, solution, fine, size)]
    for label, swept in paths_of_points(solution).items():
        axes.plot(*swept.T / size, color=DARK, linestyle="--", linewidth=1.5, label=label, zorder=3)
        shown.append(swept / size)
    view = view_of(solution, size * np.vstack([piece.reshape(-1, solution.dimension) for piece in shown]))
    proxies = [*_ends(), *draw_scene(axes, solution, (view[0] / size, view[1] / size), size)]
    if solution.dimension == 2:
        axes.dataLim.set_points(np.array(view) / size)
        axes.set_aspect("equal", adjustable="datalim")
        axes.margins(0)
    else:
        _set_box(axes, np.array(view) / size)
        axes.set_zlabel(f"z [{unit}]", labelpad=LABELS_OFF)
    # In space labels are kept off the numbers of an axis that is seen slantwise.
    off = LABELS_OFF if solution.dimension == 3 else None
    axes.set_xlabel(f"x [{unit}]", labelpad=off)
    axes.set_ylabel(f"y [{unit}]", labelpad=off)
    axes.set_title("Path", loc="left")
    handles, labels = entries_once(axes, proxies)
    below = -0.06 if solution.dimension == 3 else -0.11
    columns = 3 if max(map(len, labels)) > LONG_LABEL else 4
    axes.legend(handles, labels, ncol=columns, loc="upper center", bbox_to_anchor=(0.5, below))


def _ends() -> list[Any]:
    """Entries of the legend for the starts and goals of all bodies, whose colours they have in the picture."""
    from matplotlib.lines import Line2D

    style: dict[str, Any] = {"linestyle": "none", "markerfacecolor": "white", "markeredgecolor": DARK}
    marks = ("o", 8, "start"), ("*", 13, "goal")
    return [Line2D([], [], marker=mark, markersize=size, label=name, **style) for mark, size, name in marks]


def _fine(solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and coordinates close enough to draw; attitudes are unit quaternions."""
    times, fine = within_steps(solution, solution.path.position)
    fine = fine.copy()
    for at in solution.path.coordinates.quaternions:
        fine[:, at] = normalised(fine[:, at])
    return times, fine


def _draw_links(axes: Any, solution: Solution, fine: np.ndarray, size: float) -> list[np.ndarray]:
    """The links of the problem, if it is there: what they draw of themselves at some of the times."""
    if solution.problem is None:
        return []
    few = np.linspace(0, len(fine) - 1, TIMES).astype(int)
    at, drawn = states_of(solution.path.coordinates, fine[few]), []
    for link in solution.problem.links:
        for line in link.lines(at):
            for i, piece in enumerate(line):
                shade = 0.15 + 0.85 * i / max(len(line) - 1, 1)
                axes.plot(*(piece / size).T, color=DARK, alpha=shade, linewidth=1.4, label="links", zorder=2)
                drawn.append(piece / size)
    return drawn


def _set_box(axes: Any, points: np.ndarray) -> None:
    """Equal scales in space, in a box that is nowhere thinner than a fifth of its longest side."""
    from matplotlib.ticker import MaxNLocator

    low, high = points.min(axis=0), points.max(axis=0)
    middle, side = 0.5 * (low + high), (high - low) * (1 + MARGIN)
    side = np.maximum(side, 0.2 * side.max())
    axes.set(
        **{f"{axis}lim": (middle[i] - side[i] / 2, middle[i] + side[i] / 2) for i, axis in enumerate("xyz")}
    )
    for axis, span in zip((axes.xaxis, axes.yaxis, axes.zaxis), side, strict=True):
        # A short side has room for few numbers.
        axis.set_major_locator(MaxNLocator(2 + round(4 * span / side.max())))
    axes.set_box_aspect(side)


def joint_units(solution: Solution) -> list[str]:
    """The units of the joints that one number says where they are."""
    joints = _joints(solution)
    return list(dict.fromkeys(joint.coordinate_units[0] for joint in joints))


def _joints(solution: Solution) -> list[Any]:
    links = solution.problem.links if solution.problem else ()
    return [link for link in links if link.shown]


def draw_joints(axes: Any, solution: Solution, late: float, unit: str) -> None:
    """The angles of hinges or the ways of slides, and their limits."""
    times, fine = _fine(solution)
    at = states_of(solution.path.coordinates, fine)
    ours = [joint for joint in _joints(solution) if joint.coordinate_units[0] == unit]
    values = [
        joint.measured(at[joint.to] if joint.to else room(len(times)), at[joint.on])[:, 0] for joint in ours
    ]
    size, shown = (np.pi / 180, "degrees") if unit == "rad" else readable(np.array(values), unit)
    for i, (joint, value) in enumerate(zip(ours, values, strict=True)):
        axes.plot(times / late, value / size, label=joint.name, **_look(i))
    for limit in solution.require_problem().constraints:
        for side in limit.stops if limit.unit == unit else ():
            axes.axhline(side / size, label="limit", **LIMIT)
    kind = "angle" if unit == "rad" else "way"
    axes.set_ylabel(f"{kind} [{shown}]")
    axes.set_title("Angles of the hinges" if unit == "rad" else "Ways of the slides")


def reaction_units(solution: Solution) -> list[str]:
    """The units of what links exert: forces, and torques of those that keep an angle."""
    return list(dict.fromkeys(_reaction_units(solution)))


def _reaction_units(solution: Solution) -> list[str]:
    forces = solution.reaction
    assert forces is not None
    if solution.problem is None:
        return ["N"] * forces.shape[1]
    units = [unit for link in configuration_of(solution.problem).link_units for unit in link]
    return ["N m" if unit == "rad" else "N" for unit in units]


def draw_reactions(axes: Any, solution: Solution, late: float, unit: str = "N") -> None:
    """The forces, or the torques, of the links at the nodes; of more than a few the magnitude of each link."""
    forces = solution.reaction
    assert forces is not None
    ours = [i for i, one in enumerate(_reaction_units(solution)) if one == unit]
    names, values = reaction_names(solution), forces
    curves = {names[i]: values[:, i] for i in ours}
    if len(curves) > MOST_CURVES:
        owners = [names[i].partition(",")[0] for i in ours]
        curves = {
            owner: np.linalg.norm(
                values[:, [i for i, mine in zip(ours, owners, strict=True) if mine == owner]], axis=1
            )
            for owner in dict.fromkeys(owners)
        }
    size, shown = readable(np.array(list(curves.values())), unit)
    for i, (name, force) in enumerate(curves.items()):
        axes.plot(solution.time / late, force / size, label=name, **_look(i))
    axes.axhline(0.0, color=PALE, linewidth=0.8)
    kind = "force" if unit == "N" else "torque"
    axes.set_ylabel(f"{kind} [{shown}]")
    axes.set_title(f"{kind.capitalize()}s of the links")


def _look(index: int) -> dict[str, Any]:
    """The look of one curve of several."""
    place = index % len(CHANNEL_COLOURS)
    return {"color": CHANNEL_COLOURS[place], "linestyle": CHANNEL_LINES[place], "linewidth": 1.8}


def reaction_names(solution: Solution) -> list[str]:
    """A name for each force of a link."""
    problem, forces = solution.problem, solution.reaction
    assert forces is not None
    if problem is None:
        return [f"link equation {i + 1}" for i in range(forces.shape[1])]
    found = []
    for link, units in zip(problem.links, configuration_of(problem).link_units, strict=True):
        name = type(link).__name__.lower() + f" of {link.holds[-1]}" * bool(link.holds[-1])
        found += [name if len(units) == 1 else f"{name}, {i + 1}" for i in range(len(units))]
    return found


def draw_speeds(axes: Any, solution: Solution, late: float) -> None:
    """The speed of each body."""
    made = solution.path.coordinates
    bodies = list(dict.fromkeys(block.body for block in made.blocks))
    drawn = moments(solution)
    speeds = {body: np.linalg.norm(drawn.of(body)[1], axis=1) for body in bodies}
    size, unit = readable(np.concatenate(list(speeds.values())), "m/s")
    for i, (body, speed) in enumerate(speeds.items()):
        axes.plot(drawn.time / late, speed / size, label=body or "|v|", **_look(i))
    axes.set_ylabel(f"speed [{unit}]")
    axes.set_title("Speed of each body" if len(speeds) > 1 else "Speed")
