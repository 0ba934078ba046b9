"""From an accuracy to a mesh: what the error is, where it arises, and the steps that bring it down."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.guess.starting import graded_guess, is_uneven, starting_guess
from dmoc.motion.dynamics import Dynamics, state_symbols
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_weights, step_nodes
from dmoc.motion.momenta import end_momenta
from dmoc.motion.path import DiscretePath
from dmoc.motion.reference import reference
from dmoc.motion.step import step_map
from dmoc.nlp.ipopt import Answer
from dmoc.nlp.transcription import NLP, check_mesh
from dmoc.results.facts import Error
from dmoc.results.solution import Solution
from dmoc.scene.problem import TransferProblem
from dmoc.solver.ladder import Climb

MOST_NODES, MOST_MESHES = 200_000, 14
TRIAL_ORDER, TRIAL_STEPS = 4, 20
# Into how many parts a step is cut where the control jumps, and the shortest step that this makes.
PARTS, SHORTEST = 4, 1e-5
# A control within this share of its span of a limit is at the limit; so many nodes between make an arc.
BETWEEN = 0.05
# More switches than this are not listed.
MOST_SWITCHES = 12
# After so many meshes that do no better, the best one is the answer: steps have come down to rounding.
PATIENCE = 2
# By how much the error falls from mesh to mesh, at least.
LEAST_FALL = 1.5
TINY = float(np.finfo(float).tiny)


def climb_to_tolerance(
    climb: Climb, tol: float, order: int | None, steps: int | None, hold: bool, guess: Any
) -> Solution:
    """Refine until the estimated error is below a tolerance, on meshes that each cut steps of the one before.

    A trial on a coarse mesh tells whether the controls switch or limits set in, and so which order
    pays. All step ends are kept from mesh to mesh: the answer on one is a good start for the next, and
    the change there tells the error.
    """
    problem = climb.problem
    if not climb.up_to(_first(climb, order or TRIAL_ORDER, steps, hold, guess), guess):
        return climb.solution(tolerance=tol)
    path, objective = climb.path, climb.levels[-1].objective
    order, reason = (order, "the order as given") if order else _best_order(problem, path, objective, tol)
    local = not _is_singular(problem, path)
    changes: list[tuple[float, float]] = []
    best: _Found | None = None
    worse = 0
    mesh = _as_many_nodes(path, order)
    longest = np.diff(mesh).max()
    if order != path.order and not climb.solve_on(path.onto(mesh, order, hold)):
        return climb.solution(tolerance=tol)
    while True:
        path, objective = climb.path, climb.levels[-1].objective
        # the error where a control jumps falls with the length of the step there alone, here halved
        parts, most = np.full(len(path.mesh) - 1, 2), 2.0
        if local:
            wanted = max(longest / PARTS ** (len(changes) + 1), SHORTEST)
            errors = local_errors(climb.dynamics, path, problem.start_time)
            corners = _corners(problem, path, objective)
            parts = _parts(path, errors, corners, wanted)
            most = PARTS - 1.0 if len(corners) else 2.0 ** (2 if hold else order)
        if not climb.solve_on(path.onto(_cut(path.mesh, parts), order, hold)):
            if best is None or climb.answer.status == "stopped":
                return climb.solution(tolerance=tol)
            return _settled(climb, tol, best, f"{reason}; a finer mesh was not solved")
        changes.append(_change((path, objective), (climb.path, climb.levels[-1].objective), parts))
        error = estimate(climb, changes, most)
        rounded = rounding_cost(problem, climb.path) / max(abs(climb.levels[-1].objective), TINY)
        # what the rounding of |F| costs counts, but no mesh brings it down
        met = error.largest <= tol
        error = replace(error, objective=error.objective + rounded)
        climb.levels[-1] = replace(climb.levels[-1], error=error.largest)
        found = _Found(climb.nlp, climb.answer, error)
        if best is None or error.largest < best.error.largest:
            best, worse = found, 0
        else:
            worse += 1
        if rounded > tol and (met or len(changes) == MOST_MESHES):
            reason += f"; the rounding of |F| costs {rounded:.1e}, less with a smaller Engine(smoothing)"
        if met or len(climb.path.position) > MOST_NODES or len(changes) == MOST_MESHES:
            return _settled(climb, tol, best, reason)
        if worse == PATIENCE:
            return _settled(climb, tol, best, f"{reason}; finer meshes did no better")


@dataclass(frozen=True)
class _Found:
    """An answer on one mesh, and how far off it is."""

    nlp: NLP
    answer: Answer
    error: Error


def _settled(climb: Climb, tol: float, best: _Found, reason: str) -> Solution:
    """The best answer that was found, which need not be the last one."""
    climb.nlp, climb.answer = best.nlp, best.answer
    return climb.solution(tolerance=tol, error=best.error, reason=_words(climb.problem, climb.path, reason))


def _first(climb: Climb, order: int, steps: int | None, hold: bool, guess: Any) -> DiscretePath:
    """A guess for the trial, with as many steps as the motion along it needs."""
    problem = climb.problem

    def on(count: int) -> DiscretePath:
        first = starting_guess(problem, check_mesh(count), order, hold, guess)
        return graded_guess(problem, count, order, hold, guess) if is_uneven(problem, first) else first

    first = on(steps or TRIAL_STEPS)
    enough = 2 * climb.least_steps(first)
    return on(enough) if steps is None and enough > TRIAL_STEPS else first


def _as_many_nodes(path: DiscretePath, order: int) -> np.ndarray:
    """The mesh of a path for another order, with about as many nodes and at least eight steps."""
    steps = max(8, (len(path.mesh) - 1) * path.order // order)
    places = np.linspace(0.0, 1.0, len(path.mesh))
    return path.mesh if order == path.order else np.interp(np.linspace(0.0, 1.0, steps + 1), places, path.mesh)


def _best_order(problem: TransferProblem, path: DiscretePath, objective: float, tol: float) -> tuple[int, str]:
    """The order that pays, and why."""
    if path.hold:
        return 2, "held forces are second order whatever the scheme"
    if _is_singular(problem, path):
        return 2, "controls stay between their limits where no cost decides on them"
    if len(_corners(problem, path, objective)):
        return 4, "controls switch or limits set in"
    return next(order for order, loosest in ((4, 1e-3), (6, 1e-5), (8, 0.0)) if tol >= loosest), "smooth"


def _is_singular(problem: TransferProblem, path: DiscretePath) -> bool:
    """Whether controls that the cost is linear in stay between their limits for longer than a switch takes.

    On such arcs a control at the inner nodes of a step is not determined, and wanders.
    """
    share = _shares(problem, path)
    between = np.any((share > BETWEEN) & (share < 1 - BETWEEN), axis=1)
    inside = between[1:-1] & between[:-2] & between[2:]
    return bool(inside.sum() > BETWEEN * len(inside))


def switch_times(problem: TransferProblem, path: DiscretePath) -> np.ndarray:
    """When a control that the cost is linear in passes the middle between its limits [s]."""
    fractions = 0.5 * (path.mesh[1:] + path.mesh[:-1]) if path.hold else path.fractions
    above = _shares(problem, path) - 0.5
    node, column = np.nonzero(np.diff(above > 0, axis=0))
    before, after = above[node, column], above[node + 1, column]
    at = fractions[node] + before / (before - after) * (fractions[node + 1] - fractions[node])
    return problem.start_time + path.duration * np.sort(at)


def _shares(problem: TransferProblem, path: DiscretePath) -> np.ndarray:
    """Where controls are between their limits, 0 to 1, one column each; those that the cost is linear in."""
    u = ca.SX.sym("u", path.control.shape[1])
    rate = ca.SX(problem.objective.rate(problem.actuator, *state_symbols(problem.dimension)[:3], u, 1.0))
    lower, upper = (np.asarray(side, float) for side in problem.actuator.bounds(problem.dimension))
    limited = np.isfinite(upper - lower) & (ca.hessian(rate, u)[0].nnz() == 0)
    return (path.control - lower)[:, limited] / (upper - lower)[limited]


def _corners(problem: TransferProblem, path: DiscretePath, objective: float) -> np.ndarray:
    """Steps in which a control jumps or a limit sets in or lets go: there higher derivatives jump.

    A limit acts in a step if loosening it by its own size would change the objective by a millionth.
    A throttle with |F| rounded at zero never quite reaches its lower limit: there only jumps count.
    """
    extent, _ = path_scales(path)
    limit = 0.0 if problem.actuator.smoothing is not None else problem.actuator.force_limit() or 0.0
    sizes = {"column:force": limit, "column:position": extent}
    found, steps = [control_jumps(problem, path)], len(path.mesh) - 1
    for key, density in path.multipliers.items():
        kind, name = key.split(":", 1)
        if kind not in ("node", "control", "step"):
            continue
        share = np.abs(density).max(axis=1) / len(density) * sizes.get(name, 1.0)
        if name == "column:position":
            share[[0, -1]] = 0.0
        if len(share) > steps:
            share = share[step_nodes(steps, scheme(path.order))].max(axis=0)
        # what the barrier leaves beside a limit that acts is no part of it
        acts = (share > 1e-6 * abs(objective)) & (share > 1e-3 * share.max())
        found.append(np.flatnonzero(np.diff(acts)))
    return np.unique(np.concatenate(found))


def _parts(path: DiscretePath, errors: np.ndarray, corners: np.ndarray, shortest: float) -> np.ndarray:
    """Into how many parts to cut each step.

    Two, but for those that together make little of the local errors; at corners as many as lead to the
    shortest step wanted there, since the error falls only with the length of that step.
    """
    parts, order = np.full(len(errors), 2), np.argsort(errors)
    small = np.cumsum(errors[order]) <= 0.5 * 2.0**-path.order * errors.sum()
    parts[order[small]] = 1
    for k in corners:
        near = slice(max(k - 1, 0), k + 2)
        wanted = np.round(np.diff(path.mesh)[near] / shortest).astype(int)
        parts[near] = np.clip(wanted, 1, PARTS)
    parts[np.diff(path.mesh) < 2 * SHORTEST] = 1
    return parts


def _cut(mesh: np.ndarray, parts: np.ndarray) -> np.ndarray:
    pieces = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(mesh[:-1], mesh[1:], parts, strict=True)]
    return np.append(np.concatenate(pieces), mesh[-1])


def _change(
    coarse: tuple[DiscretePath, float], fine: tuple[DiscretePath, float], parts: np.ndarray
) -> tuple[float, float]:
    """Relative change of path and objective from one mesh to the next, at the step ends they share."""
    shared = np.append(0, np.cumsum(parts)) * (fine[0].order // 2)
    moved = np.abs(fine[0].position[shared] - coarse[0].position[:: coarse[0].order // 2]).max()
    stretched = abs(fine[0].duration - coarse[0].duration) / fine[0].duration
    scale = max(abs(fine[1]), TINY)
    return max(float(moved) / path_scales(fine[0])[0], stretched), abs(fine[1] - coarse[1]) / scale


def estimate(climb: Climb, changes: list[tuple[float, float]], most: float) -> Error:
    """Errors of the last of several meshes, each a refinement of the one before, from the changes between them.

    Where the error falls by a factor f from mesh to mesh, what is left is the last change over f - 1:
    f is the fall of the last two changes, at most `most`; where there is only one, at most its root.
    """
    problem, path = climb.problem, climb.path
    fall = max(changes[-2]) / max(*changes[-1], 1e-300) if len(changes) > 1 else np.sqrt(most)
    moved, cost = (change / (min(max(fall, LEAST_FALL), most) - 1) for change in changes[-1])
    extent, speed = path_scales(path)
    position, velocity = reference(climb.dynamics, path, problem.start_time, path.start_velocity)
    miss = np.linalg.norm(position - path.position[-1]) / extent
    slip = np.linalg.norm(velocity - path.goal_velocity) / speed
    return Error(moved, cost, float(max(miss, slip)))


def rounding_cost(problem: TransferProblem, path: DiscretePath) -> float:
    """What the rounding of |F| at zero adds to the objective, to first order: its derivative times itself.

    The row sqrt(|F|^2 + e^2) = throttle, in units of the largest thrust, has the derivative
    e / sqrt(|F|^2 + e^2) by e, and its multipliers are the derivatives of the objective.
    """
    width, density = problem.actuator.smoothing, path.multipliers.get("control:row:actuator")
    if width is None or density is None:
        return 0.0
    weights = np.diff(path.mesh) if path.hold else node_weights(path.mesh, scheme(path.order))
    force = np.linalg.norm(path.control[:, : problem.dimension], axis=1) / problem.actuator.force_limit()
    return float(abs(weights * density[:, 0] @ (width**2 / np.hypot(force, width))))


def path_scales(path: DiscretePath) -> tuple[float, float]:
    """Extent of the path [m] and its mean speed or the speed of its ends if that is more [m/s]."""
    extent = float(np.linalg.norm(np.ptp(path.position, axis=0)))
    ends = max(float(np.linalg.norm(v)) for v in (path.start_velocity, path.goal_velocity))
    extent = extent or ends * path.duration or 1.0
    length = float(np.linalg.norm(np.diff(path.position, axis=0), axis=1).sum())
    return extent, max(length / path.duration, ends) or extent / path.duration


def local_errors(dynamics: Dynamics, path: DiscretePath, start_time: float) -> np.ndarray:
    """Error of every step by integrating it again with two halves of order 8, over extent and speed [-]."""
    rule, fine = scheme(path.order), scheme(8)
    n, steps = dynamics.dimension, len(path.mesh) - 1
    momentum, _ = end_momenta(dynamics, path, start_time)
    extent, speed = path_scales(path)
    states = np.concatenate([path.position[:: rule.degree], momentum], axis=1)
    now = states[:-1]
    at = step_nodes(steps, rule)
    h = path.duration * np.diff(path.mesh)
    origin, march = path.position[0], step_map(dynamics, fine, path.hold).map(steps)
    for half in (0, 1):
        fractions = 0.5 * (half + fine.points)
        # controls of one step stand side by side: axis first, then node, then step
        control = path.control.T
        if not path.hold:
            control = np.einsum("ij,jkn->nki", rule.values_at(fractions), path.control[at])
            control = control.reshape(control.shape[0], -1)
        mass = rule.values_at(fractions) @ path.mass[at]
        times = start_time + path.duration * path.mesh[:-1] + 0.5 * half * h
        q, p = (now[:, :n] - origin).T, now[:, n:].T
        moves = march(q, p, mass, control, times[None], 0.5 * h[None], origin)
        now = now + np.array(np.vstack([np.array(moves[0]), np.array(moves[1])])).T
    gap = np.abs(states[1:] - now) / np.repeat([extent, speed], n)
    return np.nan_to_num(gap.max(axis=1), nan=1.0, posinf=1.0)


def control_jumps(problem: TransferProblem, path: DiscretePath) -> np.ndarray:
    """Steps within which a limited control goes from near one of its limits to near another."""
    lower, upper = (np.asarray(side, float) for side in problem.actuator.bounds(problem.dimension))
    control = path.control
    if problem.actuator.force_limit() is None or len(control) < 3:
        return np.empty(0, int)
    span = np.where(np.isfinite(upper - lower), upper - lower, 2 * (problem.actuator.force_limit() or 1.0))
    ends = control if path.hold else control[:: path.order // 2]
    change = (np.abs(np.diff(ends, axis=0)) / span).max(axis=1)
    # a jump takes one step, or two with a node in its middle; what goes on beyond them is a steep slope
    around = np.pad(change, 2)
    return np.flatnonzero((change > 0.2) & (change > 3 * np.maximum(around[:-4], around[4:])))


def _words(problem: TransferProblem, path: DiscretePath, reason: str) -> str:
    """Such as: order 4, 145 steps: controls switch or limits set in; switches at 0.06, 4.45 s."""
    times = switch_times(problem, path)
    # several within two steps of each other are one burn that this mesh does not resolve
    near = (
        2
        * path.duration
        * np.interp(times - problem.start_time, path.duration * path.mesh[:-1], np.diff(path.mesh))
    )
    groups = np.split(times, np.flatnonzero(np.diff(times) > near[:-1]) + 1)
    words = [f"{g[0]:.5g}" + f" to {g[-1]:.5g}" * (len(g) > 1) for g in groups if len(g)]
    found = f"; switches at {', '.join(words)} s" if 0 < len(words) <= MOST_SWITCHES else ""
    return f"order {path.order}, {len(path.mesh) - 1} steps: {reason}{found}"
