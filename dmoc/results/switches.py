"""Where controls switch and limits set in along a path."""

from __future__ import annotations

import casadi as ca
import numpy as np

from dmoc.basics.digits import time_unit
from dmoc.basics.memory import remembered
from dmoc.configurations.acting import state_symbols
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import step_nodes
from dmoc.motion.path import POSITION_BOUNDS, DiscretePath, Key
from dmoc.motion.scales import path_scales
from dmoc.results.flown_cost import mass_worth
from dmoc.scene.problem import TransferProblem

# The times of switches are listed only if there are no more than this many: a message must stay short.
MOST_SWITCHES = 12
# A control is at a limit if it is within this part of its span from it [-]. If more than the same part of all
# nodes [-] are in arcs between the limits, the path is singular.
BETWEEN = 0.05
# A control can jump only where it changes by more than this part of its span [-] from one step end to the next.
JUMP = 0.2
# A change of a control is a jump only if it is more than this many times the change two steps before and after
# it.
STEEPER = 3
# A limit can act in a step only if loosening it by its own size would change the objective by this part of it
# [-].
ACTS = 1e-6
# A limit can act in a step only if that change is over this part of the largest one [-]: the barrier leaves
# small multipliers where the limit does not act.
BARRIER = 1e-3


def is_singular(problem: TransferProblem, path: DiscretePath) -> bool:
    """Whether controls that the cost is linear in stay between their limits for longer than a switch takes.

    On such arcs a control at the inner nodes of a step is not determined, and wanders.
    """
    share = _shares(problem, path)
    between = np.any((share > BETWEEN) & (share < 1 - BETWEEN), axis=1)
    inside = between[1:-1] & between[:-2] & between[2:]
    return bool(inside.sum() > BETWEEN * len(inside))


def has_linear_controls(problem: TransferProblem) -> bool:
    """Whether the cost is linear in controls that have limits: then many paths may cost the same."""
    return bool(_linear(problem, problem.controls).any())


def burns_unpaid(problem: TransferProblem) -> bool:
    """Whether an engine burns propellant that no cost counts, as in least time."""
    burns = problem.actuator.burns and problem.actuator.smoothing is not None
    paid = problem.objective.metered or mass_worth(problem) != 0.0
    return bool(burns and not paid and has_linear_controls(problem))


def linear_controls(problem: TransferProblem) -> np.ndarray:
    """Which controls the cost is linear in, whether or not each has limits of its own."""

    def found() -> tuple[bool, ...]:
        u = ca.SX.sym("u", problem.controls)
        curved = ca.sum2(ca.hessian(_rate(problem, u), u)[0])
        return tuple(not curved.sparsity().has_nz(i, 0) for i in range(problem.controls))

    parts = problem.actuator, problem.objective, problem.dimension, problem.controls
    return np.array(remembered(found, "linear controls", *parts))


def switch_times(problem: TransferProblem, path: DiscretePath) -> np.ndarray:
    """When a control that the cost is linear in passes the middle between its limits [s]."""
    fractions = 0.5 * (path.mesh[1:] + path.mesh[:-1]) if path.hold else path.fractions
    above = _shares(problem, path) - 0.5
    node, column = np.nonzero(np.diff(above > 0, axis=0))
    before, after = above[node, column], above[node + 1, column]
    at = fractions[node] + before / (before - after) * (fractions[node + 1] - fractions[node])
    return problem.start_time + path.duration * np.sort(at)


def switches_in_words(problem: TransferProblem, path: DiscretePath) -> str:
    """The times of the switches, such as "0.06, 4.45 s"; empty if there are none, or very many.

    Of several within two steps of each other the first and the last: they are one burn that this mesh does not
    resolve.
    """
    times = switch_times(problem, path)
    steps = np.interp(times - problem.start_time, path.duration * path.mesh[:-1], np.diff(path.mesh))
    groups = np.split(times, np.flatnonzero(np.diff(times) > 2 * path.duration * steps[:-1]) + 1)
    size, unit = time_unit(problem.start_time + path.duration)
    words = [f"{g[0] / size:.5g}" + f" to {g[-1] / size:.5g}" * (len(g) > 1) for g in groups if len(g)]
    return f"{', '.join(words)} {unit}" if 0 < len(words) <= MOST_SWITCHES else ""


def control_shares(problem: TransferProblem, control: np.ndarray) -> np.ndarray:
    """Where controls are between their limits, 0 to 1, one column each; those that the cost is linear in."""
    lower, upper = (np.asarray(side, float) for side in problem.actuator.bounds(problem.dimension))
    limited = _linear(problem, control.shape[1])
    return (control - lower)[:, limited] / (upper - lower)[limited]


def _shares(problem: TransferProblem, path: DiscretePath) -> np.ndarray:
    return control_shares(problem, path.control)


def _linear(problem: TransferProblem, size: int) -> np.ndarray:
    """Which controls have limits on both sides and a cost that is linear in them."""
    lower, upper = (np.asarray(side, float) for side in problem.actuator.bounds(problem.dimension))
    limited = np.isfinite(upper - lower)
    if not limited.any():
        return limited

    def is_curved() -> bool:
        u = ca.SX.sym("u", size)
        return ca.hessian(_rate(problem, u), u)[0].nnz() > 0

    parts = problem.actuator, problem.objective, problem.dimension, size
    return limited & (not remembered(is_curved, "curved cost", *parts))


def _rate(problem: TransferProblem, u: ca.SX) -> ca.SX:
    """What the objective integrates, as an expression of the controls."""
    return ca.SX(problem.objective.rate(problem.actuator, *state_symbols(problem.dimension)[:3], u, 1.0))


def corners(problem: TransferProblem, path: DiscretePath, objective: float) -> np.ndarray:
    """Steps in which a control jumps or a limit sets in or lets go: there higher derivatives jump.

    A limit acts in a step if loosening it by its own size would change the objective by a millionth.
    A throttle with |F| rounded at zero never quite reaches its lower limit: there only jumps count.
    """
    limit = 0.0 if problem.actuator.smoothing is not None else problem.actuator.main_limit() or 0.0
    sizes = {Key("control", "column", "force"): limit, POSITION_BOUNDS: path_scales(path).extent}
    found, steps = [control_jumps(problem, path)], len(path.mesh) - 1
    for key, density in path.multipliers.items():
        if key.kind not in ("node", "control", "step"):
            continue
        share = np.abs(density).max(axis=1, initial=0.0) / len(density) * sizes.get(key, 1.0)
        if key == POSITION_BOUNDS:
            # At the ends, bounds hold fixed positions: they are no limits that set in.
            share[[0, -1]] = 0.0
        if len(share) > steps:
            share = share[step_nodes(steps, scheme(path.order))].max(axis=0)
        # The barrier leaves small multipliers at limits that do not act.
        acts = (share > ACTS * abs(objective)) & (share > BARRIER * share.max())
        found.append(np.flatnonzero(np.diff(acts)))
    return np.unique(np.concatenate(found))


def control_jumps(problem: TransferProblem, path: DiscretePath) -> np.ndarray:
    """Steps within which a limited control goes from near one of its limits to near another."""
    lower, upper = (np.asarray(side, float) for side in problem.actuator.bounds(problem.dimension))
    control = path.control
    if problem.actuator.main_limit() is None or len(control) < 3:
        return np.empty(0, int)
    span = np.where(np.isfinite(upper - lower), upper - lower, 2 * (problem.actuator.main_limit() or 1.0))
    ends = control if path.hold else control[:: path.order // 2]
    change = (np.abs(np.diff(ends, axis=0)) / span).max(axis=1)
    # A jump takes one step, or two with a node in its middle; a change that goes on beyond them is a steep
    # slope.
    around = np.pad(change, 2)
    return np.flatnonzero((change > JUMP) & (change > STEEPER * np.maximum(around[:-4], around[4:])))
