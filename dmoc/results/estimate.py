"""The error of an answer: steps integrated again, changes from mesh to mesh, an independent integrator."""

from __future__ import annotations

import numpy as np

from dmoc.basics.numerics import columns
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.flown import flown
from dmoc.motion.lobatto import scheme
from dmoc.motion.march import wrench_of
from dmoc.motion.mesh import node_weights, step_nodes
from dmoc.motion.momenta import end_momenta
from dmoc.motion.path import ACTUATOR_ROWS, DiscretePath
from dmoc.motion.reference import goal_miss
from dmoc.motion.scales import least_extent, path_scales
from dmoc.motion.step import step_map
from dmoc.parts.actuator import told_of
from dmoc.results.facts import Error
from dmoc.results.flown_cost import TINY, unpriced
from dmoc.scene.problem import TransferProblem

# The error is taken to fall by at least this factor [-] from mesh to mesh: the error that is left, the change
# over the factor less 1, would have no bound otherwise.
LEAST_FALL = 1.5
# Of one answer of a smooth problem path and objective are taken to be off by so many times the miss of the goal
# or the sum of the errors of the steps, whichever is larger [-]: of seven problems on seven meshes each they
# were off by 1.3 times that at most.
AT_ONCE = 2.0
# An impulse below this part of what stops the body counts as that [-]: less of it hardly moves the body.
MOVES = 1e-4


def change(
    problem: TransferProblem,
    coarse: tuple[DiscretePath, float],
    fine: tuple[DiscretePath, float],
    parts: np.ndarray,
    least: float = TINY,
) -> tuple[float, float]:
    """Relative change of path and objective from one mesh to the next, at the step ends they share.

    That of an objective below `least`, in its own unit, is over `least`: what costs nothing has no digits.
    """
    shared = np.append(0, np.cumsum(parts)) * (fine[0].order // 2)
    moved = np.abs(fine[0].position[shared] - coarse[0].position[:: coarse[0].order // 2]).max(axis=0)
    stretched = abs(fine[0].duration - coarse[0].duration) / fine[0].duration
    scale = max(abs(fine[1]), least)
    moved = float((moved / path_scales(fine[0], _least(problem)).coordinates).max())
    return max(moved, stretched), abs(fine[1] - coarse[1]) / scale


def estimate(
    problem: TransferProblem,
    dynamics: Dynamics,
    path: DiscretePath,
    objective: float,
    changes: list[tuple[float, float]],
    most: float,
) -> Error:
    """Errors of the last of several meshes, each a refinement of the one before, from the changes between them.

    Where the error falls by a factor f from mesh to mesh, the error that is left is the last change over
    f - 1: f is the fall of the last two changes, at most `most`; where there is only one, at most its root.
    """
    fall = max(changes[-2]) / max(*changes[-1], 1e-300) if len(changes) > 1 else np.sqrt(most)
    moved, cost = (change / (min(max(fall, LEAST_FALL), most) - 1) for change in changes[-1])
    missed = path_scales(path, _least(problem)).share(*goal_miss(dynamics, path, problem.start_time))
    cost += idle_share(dynamics, path) + unpriced(problem, dynamics, path, objective)
    return Error(moved, cost, missed)


def estimate_at_once(
    problem: TransferProblem, dynamics: Dynamics, path: DiscretePath, objective: float
) -> Error:
    """Errors of an answer on one mesh of a problem without limits, by flying it and its steps again."""
    missed = path_scales(path, _least(problem)).share(*goal_miss(dynamics, path, problem.start_time))
    off = AT_ONCE * max(missed, float(local_errors(dynamics, path, problem.start_time).sum()))
    return Error(off, off + unpriced(problem, dynamics, path, objective), missed)


def _least(problem: TransferProblem) -> float:
    return least_extent(problem.mass, problem.inertia)


def idle_share(dynamics: Dynamics, path: DiscretePath) -> float:
    """The part of the impulse that is paid for and not flown [-]: in a step where a control switches.

    Zero where no throttle among the controls stands for |F|: the thrust of nozzles is flown as it is paid for.
    """
    if path.hold or dynamics.actuator.smoothing is None:
        return 0.0
    known = flown(dynamics, path)
    middle = 0.5 * (known.mesh[1:] + known.mesh[:-1])
    switching = known.broken[np.searchsorted(path.mesh, middle) - 1]
    h = np.diff(known.mesh)
    rule, many = scheme(path.order), scheme(8)
    fine = np.einsum("pj,jkn->pkn", rule.values_at(many.points), known.nodes)
    controls = fine.reshape(-1, fine.shape[2])
    # The magnitude of such a force does not hang on the place.
    anywhere = np.repeat(path.position[:1], len(controls), axis=0)
    thrust = np.linalg.norm(wrench_of(dynamics, anywhere, controls), axis=1).reshape(fine.shape[:2])
    paid = told_of(dynamics.actuator, "throttle", controls).reshape(fine.shape[:2])
    total = float(many.weights @ paid @ h)
    # Elsewhere the two differ by the rounding of |F| alone, which is counted by itself.
    idle = float(many.weights @ (paid - thrust) @ (h * switching))
    return abs(idle) / total if total else 0.0


def rounded_share(dynamics: Dynamics, path: DiscretePath) -> float:
    """The part of the impulse that is paid since |F| is rounded at zero, and not flown at any node [-].

    Of an impulse that hardly moves the body, the part of one that does.
    """
    if dynamics.actuator.smoothing is None:
        return 0.0
    weights = path.duration * (np.diff(path.mesh) if path.hold else node_weights(path.mesh, scheme(path.order)))
    anywhere = np.repeat(path.position[:1], len(path.control), axis=0)
    thrust = np.linalg.norm(wrench_of(dynamics, anywhere, path.control), axis=1)
    paid = told_of(dynamics.actuator, "throttle", path.control)
    scales = path_scales(path)
    moving = path.mass[0] * scales.speed if path.coordinates.speeds.any() else 0.0
    return float(weights @ np.maximum(paid - thrust, 0.0) / max(weights @ paid, MOVES * moving, TINY))


def rounding_cost(problem: TransferProblem, path: DiscretePath) -> float:
    """The part of the objective that the rounding of |F| at zero adds, to first order.

    It is the width of the rounding times the derivative of the objective by it.

    The row sqrt(|F|^2 + e^2) = throttle, in units of the largest thrust, has the derivative
    e / sqrt(|F|^2 + e^2) by e, and its multipliers are the derivatives of the objective.
    """
    width, density = problem.actuator.smoothing, path.multipliers.get(ACTUATOR_ROWS)
    if width is None or density is None:
        return 0.0
    weights = np.diff(path.mesh) if path.hold else node_weights(path.mesh, scheme(path.order))
    force = np.linalg.norm(path.control[:, : problem.dimension], axis=1) / problem.actuator.main_limit()
    return float(abs(weights * density[:, 0] @ (width**2 / np.hypot(force, width))))


def local_errors(dynamics: Dynamics, path: DiscretePath, start_time: float) -> np.ndarray:
    """Error of every step by integrating it again with two halves of order 8, over extent and speed [-]."""
    rule, fine = scheme(path.order), scheme(8)
    n, steps = dynamics.positions, len(path.mesh) - 1
    momentum, _ = end_momenta(dynamics, path, start_time)
    scales = path_scales(path)
    states = np.concatenate([path.position[:: rule.degree], momentum], axis=1)
    now = states[:-1]
    at = step_nodes(steps, rule)
    h = path.duration * np.diff(path.mesh)
    origin, step = path.position[0], step_map(dynamics, fine, path.hold)
    for half in (0, 1):
        fractions = 0.5 * (half + fine.points)
        # In memory the controls of one step stand together: the axis changes fastest, then the node, then the
        # step.
        control = path.control.T
        if not path.hold:
            control = np.einsum("ij,jkn->nki", rule.values_at(fractions), path.control[at])
            control = control.reshape(control.shape[0], control.shape[1] * control.shape[2])
        mass = rule.values_at(fractions) @ path.mass[at]
        times = start_time + path.duration * path.mesh[:-1] + 0.5 * half * h
        q, p = (now[:, :n] - origin).T, now[:, n:].T
        moves = columns(step, q, p, mass, control, times, 0.5 * h, origin)
        now = now + np.vstack(moves[:2]).T
    # The spin of a body is judged by its largest along the path.
    spin = np.abs(momentum).max() or 1.0
    momenta = np.where(path.coordinates.speeds, scales.speed, spin)
    gap = np.abs(states[1:] - now) / np.concatenate([scales.coordinates, momenta])
    return np.nan_to_num(gap.max(axis=1), nan=1.0, posinf=1.0)


def left_after(changes: list[float]) -> float:
    """The error left after the last change: as much as it, or less where changes fall fast."""
    last = changes[-1]
    fall = changes[-2] / last if len(changes) > 1 and last > 0 else 0.0
    return last / (fall - 1) if fall > 2 else last
