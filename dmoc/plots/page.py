"""Pictures of a solution: the path, the force, the speed and the energy, on one page."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from dmoc.basics.arguments import of_kind
from dmoc.basics.files import as_path, whole_file
from dmoc.plots.ledger import draw_ledger
from dmoc.plots.linked import (
    draw_bodies,
    draw_joints,
    draw_reactions,
    draw_speeds,
    joint_units,
    reaction_units,
)
from dmoc.plots.path import draw_path, is_wide
from dmoc.plots.sheet import arrange, darkened, entitle, new_page, new_panels, shade_burns
from dmoc.plots.style import (
    AXIS_COLOURS,
    AXIS_LINES,
    DARK,
    LIMIT,
    PATH,
    SETTINGS,
    flown_force,
    readable,
    speeds,
)
from dmoc.plots.turning import (
    control_panels,
    draw_angle,
    draw_controls,
    draw_rates,
    draw_sphere,
    draw_wheels,
    limits_told,
)
from dmoc.results.solution import Solution

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dmoc.checks.verification import Report
    from dmoc.missions.solution import MissionSolution
    from dmoc.teams.solution import TeamSolution

# A figure can be written in these formats, which the end of the file's name decides.
SUFFIXES = (".png", ".pdf", ".svg")
# A limit of more than this many times the largest force is told in the legend alone: its line would flatten the
# curves.
FAR = 6.0


def save_figure(
    solution: Solution | MissionSolution | TeamSolution,
    path: str | os.PathLike,
    report: Report | None = None,
    dpi: float = 150,
    dark: bool = False,
) -> None:
    """Draw a solution into a file, whole or not at all.

    Parameters
    ----------
    solution : Solution, MissionSolution or TeamSolution
    path : path
        Ends in .png, .pdf or .svg, which decides the format.
    report : Report, optional
        Checks whose outcome is written below the panels.
    dpi : float
        Dots per inch of a .png; the page is 13.33 inches wide.
    dark : bool
        On a dark background.

    Raises
    ------
    ValueError
        If the suffix is another one or the folder does not exist.
    """
    if not (hasattr(solution, "impulses") or hasattr(solution, "members")):
        of_kind("solution", solution, Solution)
    if as_path(path).suffix.lower() not in SUFFIXES:
        raise ValueError(f"cannot draw into {path}: the file must end in {', '.join(SUFFIXES)}")
    page = darkened(figure(solution, report), dark)
    with whole_file(path) as temporary:
        page.savefig(temporary, dpi=dpi)


def figure(solution: Any, report: Report | None = None) -> Figure:
    """A matplotlib Figure of a solution: path, force, speed, and energy or momentum.

    Zones, attractors and limits are drawn where the solution holds its problem.

    Parameters
    ----------
    solution : Solution, MissionSolution or TeamSolution
    report : Report, optional
        Checks whose outcome is written below the panels.
    """
    import matplotlib

    with matplotlib.rc_context(SETTINGS):
        if hasattr(solution, "impulses"):
            # What draws missions is loaded for them alone.
            from dmoc.plots.mission import mission_page

            return mission_page(solution, report)
        if hasattr(solution, "members"):
            from dmoc.plots.team import team_page

            return team_page(solution, report)
        page = new_page(solution.dimension)
        turns = bool(solution.path.attitudes)
        held = solution.reaction is not None
        wide = not held and is_wide(solution)
        drawn = panels_of(solution)
        path, panels = new_panels(page, 3 if turns else solution.dimension, wide, len(drawn))
        left = draw_bodies if held else draw_path if solution.dimension else draw_sphere
        left(path, solution, **({"beside": True} if wide else {}))
        size, unit = readable(solution.end_times, "s")
        for panel, draw in zip(panels, drawn, strict=True):
            draw(panel, solution, size)
            shade_burns(panel, solution, size)
        arrange(page, panels, wide, unit)
        entitle(page, solution, report, size, unit)
    return page


def panels_of(solution: Solution) -> Sequence[Any]:
    """What is drawn over time of a transfer: functions of a panel, the solution and the unit of time [s]."""
    if solution.reaction is not None:
        return _linked_panels(solution)
    return _turning_panels(solution) if solution.path.attitudes else PANELS


def _turning_panels(solution: Solution) -> list[Any]:
    """What is drawn over time of a body that turns: its controls by their units, rates and the angle to go."""
    controls = [partial(draw_controls, panel=panel) for panel in control_panels(solution)]
    stored = [] if solution.wheel_momentum is None else [draw_wheels]
    return [*controls, *stored, draw_rates, draw_angle]


def _linked_panels(solution: Solution) -> list[Any]:
    """What is drawn over time of linked bodies: controls, joints or speeds, and what the links exert."""
    controls = [partial(draw_controls, panel=panel) for panel in control_panels(solution)]
    joints: list[Any] = [partial(draw_joints, unit=unit) for unit in joint_units(solution)]
    exerted = [partial(draw_reactions, unit=unit) for unit in reaction_units(solution)]
    return [*controls, *(joints or [draw_speeds]), *exerted]


def _draw_force(axes: Any, solution: Solution, late: float) -> None:
    size, unit = readable(solution.force, "N")
    times, force = solution.end_times, solution.force
    if not solution.hold:
        times, force = flown_force(solution)
    curves = [
        (f"$F_{axis}$", force[:, i], AXIS_COLOURS[i], AXIS_LINES[i])
        for i, axis in enumerate("xyz"[: solution.dimension])
    ]
    if solution.dimension > 1:
        curves.append(("$|F|$", np.linalg.norm(force, axis=1), DARK, (0, (1, 1))))
    for name, values, colour, line in curves:
        style = {"color": colour, "linestyle": line, "label": name, "linewidth": 1.8}
        if solution.hold:
            axes.stairs(values / size, times / late, baseline=None, **style)
        else:
            axes.plot(times / late, values / size, **style)
    _draw_force_limits(axes, solution, size, unit)
    axes.set_ylabel(f"force [{unit}]")
    axes.set_title("Force of the actuator" + (", held over each step" if solution.hold else ""))


def _draw_force_limits(axes: Any, solution: Solution, size: float, unit: str) -> None:
    if solution.problem is None:
        return
    actuator, n = solution.problem.actuator, solution.dimension
    along_axes = actuator.labels(n)[:n] == tuple("xyz"[:n])
    levels = [(actuator.force_limit() or np.inf, "limit" if along_axes else actuator.limit_label)]
    sides = np.array([np.asarray(side, float)[:n] for side in actuator.bounds(n)])
    if along_axes and np.isfinite(sides).any():
        each = "limit" if n == 1 else "limit of\na component"
        known = limits_told(sides, [f"$F_{axis}$" for axis in "xyz"[:n]])
        levels = [(level, each if told == "limit" else told) for level, told in known]
    largest = np.abs(solution.force).max(initial=0.0)
    for level, words in (known for known in levels if np.isfinite(known[0])):
        if abs(level) < FAR * largest:
            axes.axhline(level / size, label=words, **LIMIT)
        else:
            axes.plot([], [], label=f"{words}\n{abs(level) / size:.3g} {unit}", **LIMIT)


def draw_speed(axes: Any, solution: Solution, late: float) -> None:
    times, speed = speeds(solution)
    size, unit = readable(speed, "m/s")
    name = "velocity" if solution.dimension == 1 else "speed"
    axes.plot(times / late, speed / size, color=PATH, label=name)
    known = speed[np.isfinite(speed)]
    least, most = known.min(initial=np.inf), known.max(initial=0.0)
    # Rest is no way back, whatever the sign of its rounding error.
    back = least < -1e-6 * np.abs(known).max(initial=0.0)
    limits = solution.problem.constraints if solution.problem else ()
    # The speed is that of the centre of mass.
    for constraint in [one for one in limits if not one.turns_body and one.point is None and not one.on]:
        if (limit := constraint.largest_speed()) is not None:
            for side in (limit, -limit) if back else (limit,):
                axes.axhline(side / size, label="limit", **LIMIT)
    if not back and least < 0.5 * most:
        # A speed that never falls by half is drawn without the zero, so that its small changes can be seen.
        axes.set_ylim(bottom=0)
    axes.set_ylabel(f"{name} [{unit}]")
    axes.set_title(name.capitalize())


# What is drawn over time of a point mass.
PANELS = (_draw_force, draw_speed, draw_ledger)
