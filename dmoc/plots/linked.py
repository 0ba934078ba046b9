"""Pictures of bodies that links hold: where they go, the links at some times, and the forces in them."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmoc.configurations.of_problem import configuration_of
from dmoc.plots.path import entries_once
from dmoc.plots.style import CHANNEL_COLOURS, CHANNEL_LINES, DARK, PALE, readable, within_steps
from dmoc.results.solution import Solution

# Links are drawn at this many times.
TIMES = 9
# A picture is wider than the paths in it by this part of their extent.
MARGIN = 0.08


def draw_bodies(axes: Any, solution: Solution) -> None:
    """The path of each body, and the links at even times, darker as time goes by."""
    made = solution.path.coordinates
    bodies = list(dict.fromkeys(block.body for block in made.blocks))
    fine = within_steps(solution, solution.path.position)[1]
    size, unit = readable(np.ptp(solution.position, axis=0), "m")
    paths = {body: fine[:, made.of_body(body)[0] & made.places] / size for body in bodies}
    for i, (body, path) in enumerate(paths.items()):
        colour = CHANNEL_COLOURS[i % len(CHANNEL_COLOURS)]
        axes.plot(*path.T, color=colour, linewidth=2.0, label=body or "path", zorder=4)
        for place, marker, name in ((0, "o", "start"), (-1, "*", "goal")):
            style = {"markersize": 8 if marker == "o" else 13, "markerfacecolor": "white", "zorder": 6}
            axes.plot(*path[place, :, None], marker, markeredgecolor=colour, label=name, **style)
    _draw_links(axes, solution, paths, size)
    if solution.dimension == 2:
        axes.set_aspect("equal")
        axes.margins(MARGIN)
    else:
        axes.set_box_aspect(np.ptp(np.vstack(list(paths.values())), axis=0) + 1e-9)
        axes.set_zlabel(f"z [{unit}]")
    axes.set_xlabel(f"x [{unit}]")
    axes.set_ylabel(f"y [{unit}]")
    axes.set_title("Path", loc="left")
    handles, labels = entries_once(axes)
    below = -0.06 if solution.dimension == 3 else -0.11
    axes.legend(handles, labels, ncol=4, loc="upper center", bbox_to_anchor=(0.5, below))


def _draw_links(axes: Any, solution: Solution, paths: dict[str, np.ndarray], size: float) -> None:
    """The links of the problem, if it is there: what they draw of themselves at some of the times."""
    count = len(next(iter(paths.values())))
    few = np.linspace(0, count - 1, TIMES).astype(int)
    places = {body: path[few] * size for body, path in paths.items()}
    for link in solution.problem.links if solution.problem else ():
        for line in link.lines(places):
            for i, piece in enumerate(line):
                shade = 0.15 + 0.85 * i / max(len(line) - 1, 1)
                axes.plot(*(piece / size).T, color=DARK, alpha=shade, linewidth=1.4, label="links", zorder=2)


def draw_reactions(axes: Any, solution: Solution, late: float) -> None:
    """The forces of the links at the nodes."""
    forces = solution.reaction
    assert forces is not None
    size, unit = readable(forces, "N")
    names = reaction_names(solution)
    for i, (name, force) in enumerate(zip(names, forces.T, strict=True)):
        axes.plot(solution.time / late, force / size, label=name, **_look(i))
    axes.axhline(0.0, color=PALE, linewidth=0.8)
    axes.set_ylabel(f"force [{unit}]")
    axes.set_title("Forces of the links")


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
    """The speed of each body at the step ends."""
    made = solution.path.coordinates
    bodies = list(dict.fromkeys(block.body for block in made.blocks))
    speeds = {
        body: np.linalg.norm(solution.velocity[:, made.of_body(body)[1][made.speeds]], axis=1)
        for body in bodies
    }
    size, unit = readable(np.concatenate(list(speeds.values())), "m/s")
    for i, (body, speed) in enumerate(speeds.items()):
        axes.plot(solution.end_times / late, speed / size, label=body or "|v|", **_look(i))
    axes.set_ylabel(f"speed [{unit}]")
    axes.set_title("Speed of each body" if len(speeds) > 1 else "Speed")
