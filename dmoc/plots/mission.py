"""The page of a mission: its path leg by leg, and over time forces or the primer vector, speed and mass."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from dmoc.answers.ways import ends_of
from dmoc.plots.lanes import lanes_of, looks_of
from dmoc.plots.path import (
    ARROWS,
    FORCE,
    PROJECTION,
    draw_arrows,
    extent_of,
    frame,
    legend,
    lies_wide,
    mark_burns,
    mark_ends,
    pushes,
    scale_of,
    scaled_arrows,
)
from dmoc.plots.sheet import arrange, entitle, new_page, new_panels, shade_burns
from dmoc.plots.style import DARK, PALE, PUSH, readable, within_steps
from dmoc.plots.surroundings import draw_scene
from dmoc.plots.turning import draw_sphere, draw_triads
from dmoc.scene.attraction import Attraction
from dmoc.surroundings.view import view_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dmoc.checks.verification import Report
    from dmoc.missions.solution import MissionSolution

# The name, unit and colour of the arrows of impulses.
IMPULSE = ("impulse", "m/s", DARK)
# The arrow of an impulse is at least this part of the longest one, unless the impulse is none: less than that
# part of the largest one [-].
SHORTEST, NOTHING = 0.4, 1e-3
# Arrows are forces per mass where less than this part of the mass is left [-].
MUCH_LOST = 0.5


def mission_page(solution: MissionSolution, report: Report | None = None) -> Figure:
    """A matplotlib Figure of a mission, whose settings are those of the caller."""
    page = new_page(solution.dimension or 3)
    lanes = lanes_of(solution)
    view = _view(solution) if solution.dimension > 1 else None
    wide = view is not None and lies_wide(view)
    path, panels = new_panels(page, solution.dimension or 3, wide, len(lanes))
    if view is not None:
        _draw_path(path, solution, view, wide)
    elif solution.dimension:
        draw_line(path, solution)
    else:
        for leg in solution.legs:
            draw_sphere(path, leg)
    size, unit = readable(solution.time, "s")
    for panel, draw in zip(panels, lanes, strict=True):
        draw(panel, solution, size)
        for leg in solution.legs:
            shade_burns(panel, leg, size)
        for time in _joint_times(solution):
            panel.axvline(time / size, color=PALE, linewidth=0.9, linestyle=(0, (2, 2)), zorder=0.8)
    arrange(page, panels, wide, unit)
    spare = 0.03 * np.ptp(solution.time)
    panels[0].set_xlim((solution.time[0] - spare) / size, (solution.time[-1] + spare) / size)
    entitle(page, solution, report, size, unit)
    return page


def _joint_times(solution: MissionSolution) -> list[float]:
    """When a leg begins that is not the first [s]."""
    return [leg.provenance.start_time for leg in solution.legs[1:]]


def scenery(solution: MissionSolution) -> Any:
    """What lies around the path: the effects and constraints of all legs, each once, as of one transfer."""
    around: Any = None
    if solution.problem is not None:
        stretches: Any = [part.problem for part in solution.parts]
        effects = _once(effect for leg in stretches for effect in leg.effects)
        around = SimpleNamespace(
            effects=effects,
            constraints=_once(one for leg in stretches for one in leg.constraints),
            links=_once(one for leg in stretches for one in leg.links),
            attraction=Attraction.of(effects, solution.dimension),
            ends=ends_of(solution),
        )
    known = {name: getattr(solution, name) for name in ("dimension", "position", "time")}
    return SimpleNamespace(problem=around, **known)


def _once(parts: Any) -> list[Any]:
    found: list[Any] = []
    for part in parts:
        if part not in found:
            found.append(part)
    return found


def _forces(solution: MissionSolution) -> tuple[Any, tuple[str, str, str]]:
    """Arrows of the forces of all legs, evenly along the path, as of `scaled_arrows`; and what they are.

    Where much of the mass is lost they are forces per mass: the last stage of a rocket pushes least of all.
    """
    masses = solution.path.mass
    light = masses.min() < MUCH_LOST * masses.max()
    found = []
    for leg in solution.legs:
        if np.abs(leg.force).max(initial=0.0) > 0:
            places, force = pushes(leg)
            held = np.interp(np.linspace(0, 1, len(places)), leg.path.fractions, leg.path.mass)
            found.append((places, force / held[:, None] if light else force))
    of = ("force per mass", "m/s\u00b2", PUSH) if light else FORCE
    if not found:
        empty = np.empty((0, solution.dimension))
        return (empty, empty, 0.0), of
    places, force = (np.concatenate(side) for side in zip(*found, strict=True))
    gone, whole = _lengths(places), _lengths(solution.position)[-1]
    # A short burn gets few arrows: more would stand on one another.
    most = int(np.ceil(ARROWS * gone[-1] / (whole or 1.0))) + 1
    even = np.unique(np.searchsorted(gone, np.linspace(0, gone[-1], most)).clip(0, len(gone) - 1))
    return scaled_arrows(places[even], force[even], extent_of(solution.position), most), of


def _lengths(places: np.ndarray) -> np.ndarray:
    """The length of the way to each of some places [m]."""
    return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1)))


def _kicks(solution: MissionSolution) -> tuple[np.ndarray, np.ndarray, float]:
    """Arrows of the impulses, as of `scaled_arrows`."""
    axes = solution.dimension
    places = np.array([kick.position for kick in solution.impulses]).reshape(-1, axes)
    changes = np.array([kick.change for kick in solution.impulses]).reshape(-1, axes)
    sizes = np.linalg.norm(changes, axis=1)
    longest = sizes.max(initial=0.0)
    # An arrow that is shorter would be hidden by the mark of its joint.
    shown = np.where(sizes > NOTHING * longest, np.maximum(sizes, SHORTEST * longest), sizes)
    changes = changes * (shown / np.where(sizes > 0, sizes, 1.0))[:, None]
    return scaled_arrows(places, changes, 1.5 * extent_of(solution.position), max(len(places), 1))


def _view(solution: MissionSolution) -> Any:
    drawn = [tails + arrows for tails, arrows, _ in (_forces(solution)[0], _kicks(solution))]
    return view_of(scenery(solution), np.concatenate([solution.position, *drawn]))


def _draw_path(axes: Any, solution: MissionSolution, view: Any, beside: bool) -> None:
    """The path of each leg with joints, forces, impulses and what lies around it."""
    size, unit = scale_of(solution.position, *view)
    view = view[0] / size, view[1] / size
    proxies = draw_scene(axes, scenery(solution), view, size)
    curves = [within_steps(leg, leg.position)[1] / size for leg in solution.legs]
    for leg, look, curve in zip(solution.legs, looks_of(solution.legs), curves, strict=True):
        mark_burns(axes, leg, leg.position.T / size)
        axes.plot(*curve.T, zorder=4.5, **look.style)
        if leg.path.attitudes:
            draw_triads(axes, leg, size)
        if solution.dimension == 3:
            floor = np.full(len(curve), view[0][2])
            axes.plot(curve[:, 0], curve[:, 1], floor, color=PALE, linewidth=1.2, label=PROJECTION, zorder=0)
    _mark_joints(axes, np.array([curve[0] for curve in curves[1:]]).reshape(-1, solution.dimension))
    (tails, arrows, longest), of = _forces(solution)
    proxies += draw_arrows(axes, tails / size, arrows / size, longest, of)
    tails, arrows, longest = _kicks(solution)
    proxies += draw_arrows(axes, tails / size, arrows / size, longest, IMPULSE)
    mark_ends(axes, curves[0][:1].T, curves[-1][-1:].T)
    if solution.dimension == 3:
        # The order is given, since matplotlib would hide the path behind surfaces that it passes in front of.
        axes.computed_zorder = False
    frame(axes, view, unit)
    legend(axes, proxies, beside)


def _mark_joints(axes: Any, places: np.ndarray) -> None:
    style = {"linestyle": "none", "markerfacecolor": "white", "markeredgecolor": DARK, "zorder": 5}
    if len(places):
        axes.plot(*places.T, marker="D", markersize=7, label="joint", **style)


def draw_line(axes: Any, solution: MissionSolution) -> None:
    """Position against time in one dimension."""
    (late, late_unit), (size, unit) = readable(solution.time, "s"), readable(solution.position, "m")
    joints = []
    for leg, look in zip(solution.legs, looks_of(solution.legs), strict=True):
        times, path = within_steps(leg, leg.position)
        mark_burns(axes, leg, np.array([leg.time / late, leg.position[:, 0] / size]))
        axes.plot(times / late, path[:, 0] / size, **look.style)
        joints.append((times[0] / late, path[0, 0] / size))
    _mark_joints(axes, np.array(joints[1:]).reshape(-1, 2))
    for kick in solution.impulses:
        place = kick.time / late, kick.position[0] / size
        mark = "^" if kick.change[0] > 0 else "v"
        axes.plot(*place, mark, color=DARK, markersize=15, label="impulse", zorder=4)
    ends = solution.legs[0], solution.legs[-1]
    start, goal = (
        (leg.time[at] / late, leg.position[at] / size) for leg, at in zip(ends, (0, -1), strict=True)
    )
    mark_ends(axes, start, goal)
    axes.set(xlabel=f"time [{late_unit}]", ylabel=f"x [{unit}]")
    axes.set_title("Position")
    legend(axes, [])
