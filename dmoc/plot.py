"""Pictures of a solution: the path, the force, the speed and the energy, on one page."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dmoc.constraints import SpeedLimit
from dmoc.effects.base import Force
from dmoc.engines import Nozzles
from dmoc.files import whole_file
from dmoc.lobatto import scheme
from dmoc.mechanics import Dynamics
from dmoc.mesh import step_nodes
from dmoc.objectives import Objective, Time
from dmoc.plot_path import draw_path, entries_once
from dmoc.plot_style import (
    AXIS_COLOURS,
    AXIS_LINES,
    DARK,
    PALE,
    PATH,
    PUSH,
    SETTINGS,
    WARNING,
    readable,
    speeds,
    within_steps,
)
from dmoc.solution import Solution

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dmoc.verification import Report

SUFFIXES = (".png", ".pdf", ".svg")
SQUARED = "\u00b2"
LIMIT: dict[str, Any] = {"color": PALE, "linestyle": (0, (7, 4)), "linewidth": 1.4, "zorder": 0.9}


def save_figure(
    solution: Solution, path: str | os.PathLike, report: Report | None = None, dpi: float = 150
) -> None:
    """Draw a solution into a file, whole or not at all.

    Parameters
    ----------
    solution : Solution
    path : path
        Ends in .png, .pdf or .svg, which decides the format.
    report : Report, optional
        Checks whose outcome is written below the panels.
    dpi : float
        Dots per inch of a .png; the page is 13.33 inches wide.

    Raises
    ------
    ValueError
        If the suffix is another one or the folder does not exist.
    """
    if Path(path).suffix.lower() not in SUFFIXES:
        raise ValueError(f"cannot draw into {path}: the file must end in {', '.join(SUFFIXES)}")
    page = figure(solution, report)
    with whole_file(path) as temporary:
        page.savefig(temporary, dpi=dpi)


def figure(solution: Solution, report: Report | None = None) -> Figure:
    """A matplotlib Figure of a solution: path, force, speed, and energy or momentum.

    Zones, attractors and limits are drawn where the solution holds its problem.

    Parameters
    ----------
    solution : Solution
    report : Report, optional
        Checks whose outcome is written below the panels.
    """
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(SETTINGS):
        page = Figure(figsize=(13.33, 7.5))
        # the layout does not see the label of the z axis
        page.set_layout_engine(
            "constrained", w_pad=0.08, h_pad=0.06, wspace=0.1 if solution.dimension == 3 else 0.02
        )
        grid = page.add_gridspec(3, 2, width_ratios=(1.15, 1.0))
        draw_path(page.add_subplot(grid[:, 0], projection="3d" if solution.dimension == 3 else None), solution)
        panels = [page.add_subplot(grid[row, 1]) for row in range(3)]
        size, unit = readable(solution.end_times, "s")
        for panel, draw in zip(panels, (_draw_force, _draw_speed, _draw_ledger), strict=True):
            draw(panel, solution, size)
            panel.legend(*entries_once(panel), loc="upper left", bbox_to_anchor=(1.01, 1.05), borderaxespad=0.0)
            panel.sharex(panels[0])
            panel.tick_params(labelbottom=panel is panels[-1])
        panels[-1].set_xlabel(f"time [{unit}]")
        page.align_ylabels(panels)
        page.suptitle(_headline(solution), fontsize=16, color=DARK if solution.success else WARNING)
        words, good = _footnote(solution, report)
        page.supxlabel(words, fontsize=11, color=DARK if good else WARNING)
    return page


def _draw_force(axes: Any, solution: Solution, late: float) -> None:
    size, unit = readable(solution.force, "N")
    times, force = solution.end_times, solution.force
    if not solution.hold:
        times, force = within_steps(solution, force)
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
    _draw_force_limits(axes, solution, size)
    axes.set_ylabel(f"force [{unit}]")
    axes.set_title("Force of the actuator" + (", held over each step" if solution.hold else ""))


def _draw_force_limits(axes: Any, solution: Solution, size: float) -> None:
    if solution.problem is None:
        return
    actuator, n = solution.problem.actuator, solution.dimension
    levels, words = np.array([actuator.force_limit() or np.inf]), "limit"
    if actuator.labels(n)[:n] == tuple("xyz"[:n]):
        sides = np.unique(np.concatenate([side[:n] for side in actuator.bounds(n)]))
        if np.isfinite(sides).any():
            levels, words = sides, "limit" if n == 1 else "limit of\na component"
    elif isinstance(actuator, Nozzles):
        words = "limit of\na nozzle"
    for level in levels[np.isfinite(levels)]:
        axes.axhline(level / size, label=words, **LIMIT)


def _draw_speed(axes: Any, solution: Solution, late: float) -> None:
    times, speed = speeds(solution)
    size, unit = readable(speed, "m/s")
    axes.plot(times / late, speed / size, color=PATH, label="speed")
    for limit in solution.problem.constraints if solution.problem else ():
        if isinstance(limit, SpeedLimit):
            axes.axhline(limit.limit / size, label="limit", **LIMIT)
    axes.set_ylim(bottom=0)
    axes.set_ylabel(f"speed [{unit}]")
    axes.set_title("Speed")


def _draw_ledger(axes: Any, solution: Solution, late: float) -> None:
    """Energy where it is kept, else momentum: what the body gained, and what it was given."""
    book = _energy(solution)
    if book is None:
        _draw_momentum(axes, solution, late)
        return
    gained, given = book
    total = sum(given.values())
    size, unit = readable(np.append(gained, total), "J")
    ends = solution.end_times / late
    axes.plot(ends, gained / size, color=PATH, linewidth=6, alpha=0.35, label="energy\ngained")
    styles = ((PUSH, "--"), (AXIS_COLOURS[2], "-."))
    for (name, work), (colour, line) in zip(given.items(), styles, strict=False):
        axes.plot(ends, work / size, color=colour, linestyle=line, label=name)
    if len(given) > 1:
        axes.plot(ends, total / size, color=DARK, linestyle=":", label="sum of work")
    gap = np.abs(gained - total).max() / size
    axes.set_ylabel(f"energy [{unit}]")
    axes.set_title(f"Energy gained and work done (gap {gap:.1g} {unit})")


def _energy(solution: Solution) -> tuple[np.ndarray, dict[str, np.ndarray]] | None:
    """Energy gained since the start and the works done on the body, at the step ends [J].

    None where the energy is not to be balanced: it depends on time, mass is lost, or the problem is
    not at hand. The works are sums with the scheme's own weights, so the gap is of its order.
    """
    problem, path = solution.problem, solution.path
    if problem is None or np.ptp(path.mass) > 0:
        return None
    dynamics = Dynamics(problem.dimension, problem.effects, problem.actuator)
    if dynamics.depends_on_time:
        return None
    rule, mass = scheme(solution.order), path.mass[0]
    ends = slice(None, None, rule.degree)
    state = (solution.end_times[None], path.position[ends].T, solution.velocity.T, path.mass[ends][None])
    energy = mass * np.array(dynamics.energy(*state)).ravel()
    at = step_nodes(solution.steps, rule)
    force = (
        np.broadcast_to(solution.force, (len(at), *solution.force.shape)) if path.hold else solution.force[at]
    )
    works = {"work of\nthe force": _work(solution, force)}
    if any(isinstance(effect, Force) for effect in problem.effects):
        times, mass_at, v = solution.time[at], path.mass[at], _step_velocities(solution)
        flat = (times.reshape(1, -1), path.position[at].reshape(-1, problem.dimension).T)
        push = dynamics.point(*flat, v.reshape(-1, problem.dimension).T, mass_at.reshape(1, -1))[2]
        works["work of\nthe effects"] = _work(solution, mass * np.array(push).T.reshape(v.shape))
    return energy - energy[0], works


def _work(solution: Solution, force: np.ndarray) -> np.ndarray:
    """Work since the start at the step ends [J] of forces at the nodes of every step [N]."""
    rule = scheme(solution.order)
    power = np.sum(force * _step_velocities(solution), axis=2)
    return np.append(0.0, np.cumsum(np.diff(solution.end_times) * (rule.weights @ power)))


def _step_velocities(solution: Solution) -> np.ndarray:
    """Velocities of every step at its nodes [m/s], shape (s+1, steps, axes)."""
    rule = scheme(solution.order)
    nodes = solution.position[step_nodes(solution.steps, rule)]
    h = np.diff(solution.end_times)[:, None]
    return np.einsum("ij,jkn->ikn", rule.derivative, nodes - nodes[0]) / h


def _draw_momentum(axes: Any, solution: Solution, late: float) -> None:
    rule, path = scheme(solution.order), solution.path
    at = step_nodes(solution.steps, rule)
    force = (
        np.broadcast_to(solution.force, (len(at), *solution.force.shape)) if path.hold else solution.force[at]
    )
    pushes = np.einsum("j,jkn->kn", rule.weights, force / path.mass[at][:, :, None])
    given = np.cumsum(np.diff(solution.end_times)[:, None] * pushes, axis=0)
    given = np.concatenate([np.zeros((1, solution.dimension)), given])
    gained = solution.momentum - solution.momentum[0]
    size, unit = readable(np.concatenate([gained, given]), "m/s")
    for i, axis in enumerate("xyz"[: solution.dimension]):
        ends, colour = solution.end_times / late, AXIS_COLOURS[i]
        axes.plot(ends, gained[:, i] / size, color=colour, linewidth=6, alpha=0.35, label=f"{axis} gained")
        axes.plot(ends, given[:, i] / size, color=colour, linestyle=AXIS_LINES[i], label=f"{axis} from force")
    axes.set_ylabel(f"p / m [{unit}]")
    axes.set_title("Momentum per mass gained, and from the force")


def _headline(solution: Solution) -> str:
    about, problem = solution.provenance, solution.problem
    name = "" if about.problem_name == "problem" else about.problem_name.replace("_", " ") + ": "
    if not solution.success:
        return f"{name}NOT SOLVED ({solution.status}), the last iterate"
    kind = "objective" if problem is None else _wanted(problem.objective)
    words = f"{name}{kind} {solution.objective:.6g} {about.objective_unit.replace('^2', SQUARED)}"
    if not problem or not isinstance(problem.objective, Time):
        words += f", duration {solution.duration:.6g} s"
    return words + (f", final mass {solution.final_mass:.6g} kg" if np.ptp(solution.path.mass) > 0 else "")


def _wanted(objective: Objective) -> str:
    """Such as `least effort` or `greatest final mass`."""
    name = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", type(objective).__name__).lower()
    return f"{'least' if objective.sense > 0 else 'greatest'} {name}"


def _footnote(solution: Solution, report: Report | None) -> tuple[str, bool]:
    """One line on numerics and checks, and whether all is well."""
    spent = solution.build_s + solution.solve_s
    mesh = f"order {solution.order}, {solution.steps} steps, {solution.iterations} iterations, {spent:.2g} s"
    scene = "" if solution.problem else "; problem not attached: zones and limits are not shown"
    if report is None:
        return mesh + scene, True
    failed = [check.name for check in report.checks if not check.ok]
    words = f"checks failed: {', '.join(failed)}" if failed else f"all {len(report.checks)} checks hold"
    return f"{mesh}; {words}{scene}", not failed
