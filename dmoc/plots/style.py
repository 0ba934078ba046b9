"""Helpers that all panels of a figure share: colours, units that read well, curves between the nodes."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmoc.basics.digits import GREAT, UNITS
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.flown import flown
from dmoc.motion.lobatto import scheme
from dmoc.motion.march import wrench_of
from dmoc.motion.mesh import step_nodes
from dmoc.results.moments import Moment, sampled
from dmoc.results.solution import Solution

# Colours are those of Okabe and Ito's palette, which stay apart under the common kinds of colour blindness.
# The curves of x, y and z have these colours.
AXIS_COLOURS = ("#0072B2", "#D55E00", "#009E73")
# The curves of x, y and z have these lines, which stay apart without colour, too.
AXIS_LINES = ("-", (0, (5, 2)), (0, (4, 1.5, 1, 1.5)))
# The curves of a few thrusters or wheels have these colours, and these lines.
CHANNEL_COLOURS = (*AXIS_COLOURS, "#CC79A7", "#E69F00", "#56B4E9")
CHANNEL_LINES = (*AXIS_LINES, (0, (1, 1)), (0, (7, 2)), (0, (7, 2, 1, 2, 1, 2)))
# Texts, edges and magnitudes are of this dark grey.
DARK = "#222222"
# Lines in the background, such as limits, are of this pale grey.
PALE = "#808080"
# The path and its speed are blue.
PATH = "#0072B2"
# The force and the times when an engine is on are orange.
PUSH = "#E69F00"
# Zones that are forbidden, and the walls of those to stay in, are pink.
FORBIDDEN = "#CC79A7"
# Attractors are yellow, as the Sun is ...
ATTRACTOR = "#F0E442"
# ... except these, told by their gravitational parameter [m^3/s^2], or in the three-body problem by their part
# of it [-]: the Earth is sky blue, the Moon a pale grey, Mars red.
BODIES = {
    3.986004e14: "#56B4E9",
    4.902800e12: "#BBBBBB",
    4.282837e13: "#D55E00",
    0.98785: "#56B4E9",
    0.01215: "#BBBBBB",
}
# A parameter is one of these if it is no more than this part off [-]: published values differ by far less.
ALIKE = 1e-3
# Words and marks of a failure are of this dark red.
WARNING = "#B03A00"

# All figures have these settings of matplotlib: letters large enough for a page on a screen, few lines around
# it.
SETTINGS: Any = {
    "text.usetex": False,
    "font.family": "sans-serif",
    "font.size": 12,
    "axes.titlesize": 13,
    "axes.titlelocation": "left",
    "axes.labelsize": 12,
    "xtick.labelsize": 11,
    "ytick.labelsize": 11,
    "legend.fontsize": 11,
    "legend.frameon": False,
    "lines.linewidth": 1.8,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.use_mathtext": True,
    "axes.formatter.limits": (-3, 5),
    # Numbers on an axis are those of the curve, not what is left of them beside a number at its end.
    "axes.formatter.useoffset": False,
}

# A curve has about this many points in all ...
POINTS = 600
# ... and no more than this many in one step.
MOST_WITHIN = 30
# Limits are drawn in this style, dashed and behind the curves.
LIMIT: dict[str, Any] = {"color": PALE, "linestyle": (0, (7, 4)), "linewidth": 1.4, "zorder": 0.9}


def readable(values: Any, unit: str) -> tuple[float, str]:
    """(size of the unit to draw in, its name) for values given in SI."""
    largest = float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))
    choices = (*GREAT.get(unit, ()), *UNITS.get(unit, ())) if largest else ()
    return next(((size, name) for least, size, name in choices if largest >= least), (1.0, unit))


def within_steps(solution: Solution, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and values along the polynomial of every step, from values at the nodes.

    At order 2 these are straight lines from node to node, and the nodes are enough.
    """
    rule = scheme(solution.order)
    if rule.degree == 1:
        return solution.time, values
    fractions = np.linspace(0.0, 1.0, int(np.clip(POINTS // solution.steps, 2 * rule.degree, MOST_WITHIN)))
    nodes = values[step_nodes(solution.steps, rule)]
    fine = np.einsum("pj,jkn->kpn", rule.values_at(fractions), nodes)
    return _times(solution, fractions), fine.reshape(-1, values.shape[1])


def flown_force(solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and force [N] of the control that is flown, close enough to draw.

    Without the problem, whose limits decide what is flown, along the polynomials of the steps.
    """
    rule = scheme(solution.order)
    if rule.degree == 1 or solution.problem is None:
        return within_steps(solution, solution.force)
    times, control = flown_control(solution)
    # The force of a point mass does not hang on its place.
    anywhere = np.repeat(solution.path.position[:1], len(control), axis=0)
    return times, wrench_of(Dynamics.of(solution.problem), anywhere, control)


def flown_control(solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and controls that are flown, close enough to draw; held ones as steps."""
    rule = scheme(solution.order)
    if solution.hold:
        ends = np.repeat(solution.end_times, 2)[1:-1]
        return ends, np.repeat(solution.path.control, 2, axis=0)
    if rule.degree == 1 or solution.problem is None:
        return within_steps(solution, solution.path.control)
    count = int(np.clip(POINTS // solution.steps, 2 * rule.degree, MOST_WITHIN))
    fractions, control = flown(Dynamics.of(solution.problem), solution.path).sampled(count)
    return solution.provenance.start_time + solution.duration * fractions, control


def moments(solution: Solution) -> Moment:
    """The answer at the step ends and, above order 2, at times between them close enough to draw."""
    within = 1 if scheme(solution.order).degree == 1 else int(np.clip(POINTS // solution.steps, 1, MOST_WITHIN))
    times = _times(solution, np.arange(within) / within)
    return sampled(solution, np.append(times, solution.end_times[-1]))


def speeds(solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and speeds [m/s], close enough to draw; on a line with their sign, forward or back."""
    drawn = moments(solution)
    alone = drawn.velocity.shape[1] == 1
    return drawn.time, drawn.velocity[:, 0] if alone else np.linalg.norm(drawn.velocity, axis=1)


def _times(solution: Solution, fractions: np.ndarray) -> np.ndarray:
    """Times of the same fractions of every step [s]."""
    ends = solution.end_times
    return (ends[:-1, None] + np.diff(ends)[:, None] * fractions).ravel()


def plain_numbers(axis: Any) -> None:
    """Numbers such as 20 on a logarithmic axis, at 1, 2 and 5 of every decade if there is room, else at 1."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axis.get_data_interval()
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 100 * low else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
