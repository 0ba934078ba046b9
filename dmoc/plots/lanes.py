"""What is drawn over time of a mission: forces or the primer vector, speed, mass, each leg in its own look."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dmoc.basics.records import dataclass
from dmoc.checks.primer import worth_of
from dmoc.plots.style import (
    AXIS_COLOURS,
    AXIS_LINES,
    DARK,
    LIMIT,
    flown_force,
    moments,
    readable,
    speeds,
    within_steps,
)

if TYPE_CHECKING:
    from dmoc.missions.solution import MissionSolution
    from dmoc.results.solution import Solution

# Legs have these colours in turn, none of which is that of zones, forces or impulses ...
LEG_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#56B4E9")
# ... and these lines, the next one as soon as the colours begin again.
LEG_LINES = ("-", (0, (5, 2)), (0, (1, 1)))
# Of more legs than this those whose names differ by a number alone share a colour: a legend has no room for
# all.
MOST_NAMED = 6
# Speeds are drawn from zero where they fall below this part of the largest [-].
NEAR_REST = 0.5
# The mass is drawn if it changes by more than this part of it [-]: by less it is kept to rounding.
CHANGED = 1e-9


@dataclass(frozen=True)
class _Look:
    """The name of a leg in the legend, and the look of its curves."""

    label: str
    style: dict[str, Any]


def lanes_of(solution: MissionSolution) -> list[Any]:
    """What is drawn over time."""
    pushed = any(np.abs(leg.force).max(initial=0.0) > 0 for leg in solution.legs)
    turned = any(leg.rate is not None for leg in solution.legs)
    heavy = np.append(np.concatenate([leg.path.mass for leg in solution.legs]), solution.final_mass)
    lanes = [_draw_force] * (pushed and solution.dimension > 0)
    lanes += [_draw_primer] * (bool(solution.impulses) and solution.path.warm)
    lanes += [_draw_speed] * (solution.dimension > 0)
    lanes += [_draw_turning] * turned
    return lanes + [_draw_mass] * bool(np.ptp(heavy) > CHANGED * heavy.max())


def looks_of(legs: Sequence[Solution]) -> list[_Look]:
    """A look for each leg."""
    names = [leg.provenance.problem_name for leg in legs]
    if len(names) > MOST_NAMED:
        names = [name.rstrip("0123456789 ") or name for name in names]
    kinds = list(dict.fromkeys(names))
    found = []
    for name in names:
        turn, place = divmod(kinds.index(name), len(LEG_COLOURS))
        found.append(_Look(name, {"color": LEG_COLOURS[place], "linestyle": LEG_LINES[turn % len(LEG_LINES)]}))
    return found


def _draw_force(axes: Any, solution: MissionSolution, late: float) -> None:
    """The force of every leg that has one, along each axis and its magnitude, and its limits."""
    pushed = [leg for leg in solution.legs if np.abs(leg.force).max(initial=0.0) > 0]
    size, unit = readable(np.concatenate([leg.force for leg in pushed]), "N")
    limits = [None if leg.problem is None else leg.problem.actuator.force_limit() for leg in pushed]
    strengths = [float(np.linalg.norm(leg.force, axis=1).max()) for leg in pushed]
    for leg, limit in zip(pushed, limits, strict=True):
        times, force = flown_force(leg)
        if leg.hold:
            times, force = np.repeat(leg.end_times, 2)[1:-1], np.repeat(leg.force, 2, axis=0)
        for i, axis in enumerate("xyz"[: solution.dimension]):
            style = {"color": AXIS_COLOURS[i], "linestyle": AXIS_LINES[i], "label": f"$F_{axis}$"}
            axes.plot(times / late, force[:, i] / size, **style)
        if solution.dimension > 1:
            total = np.linalg.norm(force, axis=1) / size
            axes.plot(times / late, total, color=DARK, linestyle=(0, (1, 1)), label="$|F|$")
        # A limit that the force comes near in one leg is shown in all legs that have it.
        near = [strength for strength, other in zip(strengths, limits, strict=True) if other == limit]
        if limit is not None and limit < 2 * max(near):
            axes.hlines(limit / size, *leg.end_times[[0, -1]] / late, label="limit", **_flat(LIMIT))
    axes.set_ylabel(f"force [{unit}]")
    axes.set_title("Force of the actuators" + (", held over each step" if pushed[0].hold else ""))


def _flat(style: dict[str, Any]) -> dict[str, Any]:
    """A style of lines for `hlines`."""
    return {{"color": "colors", "linestyle": "linestyles"}.get(name, name): of for name, of in style.items()}


def _draw_primer(axes: Any, solution: MissionSolution, late: float) -> None:
    """The length of the primer vector [-]: impulses stand where it is 1, and above 1 another one would help."""
    worth = None if solution.problem is None else worth_of(solution)
    for leg, look in zip(solution.legs, looks_of(solution.legs), strict=True):
        times, primer = within_steps(leg, leg.costate[:, : solution.dimension])
        axes.plot(times / late, np.linalg.norm(primer, axis=1) / (worth or 1.0), label="_leg", **look.style)
    if worth is not None:
        axes.axhline(1.0, label="above it another\nwould help", **LIMIT)
    times, sizes = solution.primer
    for kick in solution.impulses:
        height = sizes[np.argmin(np.abs(times - kick.time))] / (worth or 1.0)
        axes.plot(kick.time / late, height, "o", color=DARK, markersize=7, label="impulse", zorder=4)
    axes.set_ylim(0.0, 1.1 * max(float(sizes.max()) / (worth or 1.0), 1.0))
    axes.set_ylabel("primer [-]" if worth else f"primer [{solution.provenance.objective_unit} s/m]")
    axes.set_title("Length of the primer vector")


def _draw_speed(axes: Any, solution: MissionSolution, late: float) -> None:
    """The speed of each leg; it jumps at impulses."""
    curves = [speeds(leg) for leg in solution.legs]
    every = np.concatenate([speed[np.isfinite(speed)] for _, speed in curves])
    size, unit = readable(every, "m/s")
    for (times, speed), look in zip(curves, looks_of(solution.legs), strict=True):
        axes.plot(times / late, speed / size, label=look.label, **look.style)
    name = "velocity" if solution.dimension == 1 else "speed"
    if 0 <= every.min(initial=np.inf) < NEAR_REST * every.max(initial=0.0):
        axes.set_ylim(bottom=0)
    axes.set_ylabel(f"{name} [{unit}]")
    axes.set_title(name.capitalize())


def _draw_turning(axes: Any, solution: MissionSolution, late: float) -> None:
    """How fast the body turns."""
    for leg, look in zip(solution.legs, looks_of(solution.legs), strict=True):
        drawn = moments(leg)
        axes.plot(
            drawn.time / late, np.linalg.norm(np.asarray(drawn.rate), axis=1), label=look.label, **look.style
        )
    axes.set_ylim(bottom=0)
    axes.set_ylabel("rate [rad/s]")
    axes.set_title("Rate of turn")


def _draw_mass(axes: Any, solution: MissionSolution, late: float) -> None:
    """The mass, which falls as propellant burns and where a part is dropped."""
    size, unit = readable(solution.legs[0].path.mass, "kg")
    for leg, look in zip(solution.legs, looks_of(solution.legs), strict=True):
        axes.plot(leg.time / late, leg.path.mass / size, label="_leg", **look.style)
    last = solution.legs[-1]
    if solution.final_mass < last.final_mass:
        # What goes away at the goal itself is behind the last leg.
        axes.plot(
            last.time[-1] / late,
            solution.final_mass / size,
            "o",
            color=DARK,
            markersize=7,
            label="behind\nthe goal",
        )
    axes.set_ylim(bottom=0)
    axes.set_ylabel(f"mass [{unit}]")
    axes.set_title("Mass")
