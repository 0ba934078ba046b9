"""From an accuracy to a mesh: what the error is, where it arises, and the steps that bring it down."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.climb import Climb
from dmoc.guess import starting_guess
from dmoc.lobatto import scheme
from dmoc.mechanics import Dynamics, step_map
from dmoc.mesh import Guess, step_nodes, uniform_mesh
from dmoc.problem import TransferProblem
from dmoc.simulation import end_momenta, reference
from dmoc.solution import Error, Solution
from dmoc.transcription import check_mesh

MOST_NODES = 200_000
TRIAL_ORDER, TRIAL_STEPS = 4, 20


def climb_to_tolerance(
    climb: Climb, tol: float, order: int | None, steps: int | None, hold: bool, guess: Any
) -> Solution:
    """Refine until the estimated error is below a tolerance, on pairs of a mesh and its bisection.

    A trial on a coarse mesh tells whether the controls switch or limits bend the path, and so which
    order pays; then steps move to where the local error is and their number follows from the order.
    """
    problem, trial = climb.problem, order or TRIAL_ORDER
    first = starting_guess(problem, check_mesh(steps or TRIAL_STEPS), trial, hold, guess)
    enough = 2 * climb.least_steps(first)
    if steps is None and enough > TRIAL_STEPS:
        first = starting_guess(problem, check_mesh(enough), trial, hold, guess)
    if not climb.up_to(first, guess):
        return climb.solution(tolerance=tol)
    path = climb.path
    corners = _corners(problem, path, climb.levels[-1].objective)
    order, reason = (order, "as asked for") if order else _best_order(tol, hold, corners)
    mesh = uniform_mesh(max(8, (len(path.mesh) - 1) * trial // order))
    history: list[tuple[int, float]] = []
    while True:
        pair = []
        for ends in (mesh, bisected(mesh)):
            if not climb.solve_on(path.onto(ends, order, hold)):
                return climb.solution(tolerance=tol)
            path = climb.path
            pair.append((path, climb.levels[-1].objective))
        corners = _corners(problem, path, pair[1][1])
        rate = 1.0 if len(corners) else _rate(history, 2 if hold else order)
        error = estimate(problem, climb.dynamics, pair[0], pair[1], rate)
        climb.levels[-1] = replace(climb.levels[-1], error=error.largest)
        history.append((len(mesh) - 1, error.largest))
        if error.largest <= tol or len(path.position) > MOST_NODES or len(history) > 12:
            return climb.solution(tolerance=tol, error=error, reason=_words(path, reason, corners))
        growth = np.clip((2 * error.largest / tol) ** (1 / rate), 1.2, 6.0)
        # where the control or a limit sets in at once, steps there help more than steps everywhere
        wanted = int(np.ceil((len(mesh) - 1) * (1.2 if len(corners) else growth)))
        mesh = next_mesh(path, local_errors(climb.dynamics, path, problem.start_time), wanted, corners)


def _best_order(tol: float, hold: bool, corners: np.ndarray) -> tuple[int, str]:
    """The order that pays, and why."""
    if hold:
        return 2, "held forces are second order whatever the scheme"
    if len(corners):
        return 2, "controls switch or limits set in"
    return next(order for order, loosest in ((4, 1e-3), (6, 1e-5), (8, 0.0)) if tol >= loosest), "smooth"


def _corners(problem: TransferProblem, path: Guess, objective: float) -> np.ndarray:
    """Steps in which a control jumps or a limit sets in or lets go: there higher derivatives jump.

    A limit acts at a node if loosening it by its own size would change the objective by a millionth.
    """
    extent, _ = path_scales(path)
    sizes = {"column:force": problem.actuator.force_limit() or 0.0, "column:position": extent}
    found = [control_jumps(problem, path)]
    for key, density in path.multipliers.items():
        kind, name = key.split(":", 1)
        if kind not in ("node", "control", "step"):
            continue
        acts = np.abs(density).max(axis=1) / len(density) * sizes.get(name, 1.0) > 1e-6 * abs(objective)
        if name == "column:position":
            acts[[0, -1]] = False
        changes = np.flatnonzero(np.diff(acts))
        found.append(changes * (len(path.mesh) - 1) // len(acts))
    return np.unique(np.concatenate(found))


def _rate(history: list[tuple[int, float]], claimed: int) -> float:
    """The order that the last refinement showed, between 1 and the claimed one."""
    if len(history) < 2:
        return float(claimed)
    (few, before), (many, after) = history[-2:]
    seen = math.log(before / max(after, 1e-300)) / math.log(many / few)
    return min(max(seen, 1.0), float(claimed))


def _words(path: Guess, reason: str, corners: np.ndarray) -> str:
    """Such as: order 6, 48 steps: smooth."""
    groups = int(np.count_nonzero(np.diff(corners) > 2)) + 1 if len(corners) else 0
    found = f" at {groups} places, steps gathered there, estimate less reliable" if groups else ""
    return f"order {path.order}, {len(path.mesh) - 1} steps: {reason}{found}"


def bisected(mesh: np.ndarray) -> np.ndarray:
    """The mesh with every step halved."""
    finer = np.empty(2 * len(mesh) - 1)
    finer[::2], finer[1::2] = mesh, 0.5 * (mesh[:-1] + mesh[1:])
    return finer


def estimate(
    problem: TransferProblem,
    dynamics: Dynamics,
    coarse: tuple[Guess, float],
    fine: tuple[Guess, float],
    rate: float,
) -> Error:
    """Errors of `fine`, whose mesh is that of `coarse` bisected; each a path and its objective.

    The schemes are symmetric: the error is C h^rate with rate their order where the solution is smooth.
    """
    extent, speed = path_scales(fine[0])
    shrink = 1 / (2**rate - 1)
    ends = [path.position[:: path.order // 2] for path, _ in (coarse, fine)]
    moved = np.abs(ends[1][::2] - ends[0]).max() / extent
    stretched = abs(fine[0].duration - coarse[0].duration) / fine[0].duration
    scale = max(abs(fine[1]), np.finfo(float).tiny)
    position, velocity = reference(dynamics, fine[0], problem.start_time, fine[0].start_velocity)
    miss = np.linalg.norm(position - fine[0].position[-1]) / extent
    slip = np.linalg.norm(velocity - fine[0].goal_velocity) / speed
    return Error(
        float(max(moved, stretched) * shrink), abs(fine[1] - coarse[1]) / scale * shrink, float(max(miss, slip))
    )


def path_scales(path: Guess) -> tuple[float, float]:
    """Extent of the path [m] and its mean speed or the speed of its ends if that is more [m/s]."""
    extent = float(np.linalg.norm(np.ptp(path.position, axis=0)))
    ends = max(float(np.linalg.norm(v)) for v in (path.start_velocity, path.goal_velocity))
    extent = extent or ends * path.duration or 1.0
    length = float(np.linalg.norm(np.diff(path.position, axis=0), axis=1).sum())
    return extent, max(length / path.duration, ends) or extent / path.duration


def local_errors(dynamics: Dynamics, path: Guess, start_time: float) -> np.ndarray:
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


def next_mesh(path: Guess, errors: np.ndarray, steps: int, jumps: np.ndarray) -> np.ndarray:
    """A mesh of `steps` steps that spreads the local errors evenly, with more where the control jumps.

    A step's error is C h^(order + 1): steps are placed by equal shares of C^(1/(order + 1)).
    """
    h = np.diff(path.mesh)
    floor = max(errors.max() * 1e-6, 1e-16)
    density = (np.maximum(errors, floor) ** (1 / (path.order + 1))) / h
    # a smooth density: neighbouring steps differ by no more than about half
    for _ in range(3):
        padded = np.pad(density, 1, mode="edge")
        density = np.maximum(density, 0.5 * (padded[:-2] + padded[2:]))
    share = np.concatenate([[0.0], np.cumsum(density * h)])
    mesh = np.interp(np.linspace(0, share[-1], steps + 1), share, path.mesh)
    mesh[0], mesh[-1] = 0.0, 1.0
    return _gathered(mesh, path.mesh, jumps)


def _gathered(mesh: np.ndarray, old: np.ndarray, jumps: np.ndarray) -> np.ndarray:
    """Add step ends where the control jumps: the steps there and next to them cut in four."""
    extra = [mesh]
    for k in jumps:
        low, high = max(k - 1, 0), min(k + 2, len(old) - 1)
        extra.append(np.linspace(old[low], old[high], 4 * (high - low) + 1))
    merged = np.unique(np.concatenate(extra))
    # ends closer than a thousandth of the mean step would add rows and no accuracy
    keep = np.concatenate([[True], np.diff(merged) > 1e-3 / len(merged)])
    keep[-1] = True
    return merged[keep]


def control_jumps(problem: TransferProblem, path: Guess) -> np.ndarray:
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
