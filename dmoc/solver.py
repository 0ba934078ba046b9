"""Ipopt, from a coarse mesh to the one asked for, and what its answer means."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.guess import starting_guess
from dmoc.ipopt import Answer, Progress, make_solver, path_of, run, scaled_multipliers, worst_rows
from dmoc.lobatto import scheme
from dmoc.mechanics import Dynamics
from dmoc.mesh import Guess, uniform_mesh
from dmoc.problem import TransferProblem
from dmoc.simulate import end_momenta
from dmoc.solution import Level, Provenance, Solution
from dmoc.stability import flow_matrices, refuse_unstable
from dmoc.transcription import NLP, check_mesh, transcribe_onto, units_of

DEFAULT_STEPS = {2: 400, 4: 100, 6: 50, 8: 32}
COARSEST_NODES = 100
FINER = 4

# What to try, in words, for each way Ipopt can end.
ADVICE = {
    "infeasible": "no path near the guess meets every row; relax the duration, the force limit or a zone, "
    "or try another guess (this is a local verdict)",
    "iteration limit": "raise options={'ipopt.max_iter': ...}, use fewer steps first, or give a better guess",
    "invalid number": "the guess or an iterate met an undefined value (a distance of 0, say): change the guess",
    "restoration failed": "look for contradictory or repeated conditions, then try another guess",
    "diverging": "the objective has no lower bound here; limit the force or the duration",
    "stopped": "interrupted; the best iterate is kept",
    "failed": "try another guess, another number of steps, or hold=True",
}


def solve(
    problem: TransferProblem,
    order: int | None = None,
    steps: int | None = None,
    hold: bool = False,
    mesh: Any = None,
    guess: Any = None,
    options: dict[str, Any] | None = None,
    progress: Progress | None = None,
) -> Solution:
    """Solve a transfer problem, coarse to fine.

    Parameters
    ----------
    problem : TransferProblem
    order : int
        2 (the default, equation (16)), 4, 6 or 8.
    steps : int
        Steps of the last mesh; if not given 400, 100, 50, 32 at orders 2, 4, 6, 8. Or `mesh`: the
        step ends as increasing fractions 0..1.
    hold : bool
        Forces constant over each step.
    guess
        Overrides the problem's own guess: function of time, (times, positions), or a Solution.
    options : dict
        CasADi `nlpsol` options, for example {"ipopt.max_iter": 50}.
    progress : callable
        Called every iteration with (order, steps, iteration, objective, row, violation): the worst
        violated row by name and its scaled size. Return True to stop.

    Returns
    -------
    Solution
        Whether it succeeded or not; `raise_for_status()` raises if not.

    Raises
    ------
    ValueError
        If an argument has no meaning for this problem.
    """
    order = 2 if order is None else order
    scheme(order)
    if mesh is None and steps is None:
        steps = DEFAULT_STEPS[order]
    final = check_mesh(steps, mesh)
    first = starting_guess(problem, final, order, hold, guess)
    dynamics = Dynamics(problem.dimension, problem.effects, problem.actuator)
    refuse_unstable(dynamics, first, problem.start_time, problem.duration_bounds[0])
    meshes = [final] if first.multipliers else _ladder(dynamics, problem, first)
    climb = _Climb(problem, options, progress)
    known = first
    for ends, at in _stages(problem, meshes):
        climb.problem = at
        solved = climb.solve_on(known.onto(ends, order, hold))
        if not solved and not first.multipliers:
            # a coarse mesh may have no path where a finer one does: go on from the first guess
            known = replace(first.onto(ends, order, hold), duration=climb.another_duration(first.duration))
            solved = known.duration != first.duration and climb.solve_on(known)
        known = climb.path if solved else first
        if climb.answer.status == "stopped":
            break
    return solution_of(climb.nlp, problem, climb.answer, tuple(climb.levels), options)


def _stages(problem: TransferProblem, meshes: list[np.ndarray]) -> list[tuple[np.ndarray, TransferProblem]]:
    """The meshes, each with its problem: where |F| is rounded at zero, more so on coarse meshes."""
    final = problem.actuator.smoothing
    if final is None:
        return [(mesh, problem) for mesh in meshes]
    count = max(int(np.ceil(np.log10(1e-2 / final))), 0)
    widths = [1e-2 * 0.1**i for i in range(count)] + [final]
    repeated = [meshes[0]] * (len(widths) - len(meshes)) + meshes
    widths = widths + [final] * (len(meshes) - len(widths))

    engine: Any = problem.actuator
    rounded = [replace(problem, actuator=replace(engine, smoothing=width)) for width in widths]
    return list(zip(repeated, rounded, strict=True))


class _Climb:
    """The way up the ladder: the last NLP, its answer, and every level so far."""

    def __init__(self, problem: TransferProblem, options: dict[str, Any] | None, progress: Progress | None):
        self.problem, self.options, self.progress = problem, options, progress
        self.levels: list[Level] = []
        self.nlp: NLP
        self.answer: Answer

    @property
    def path(self) -> Guess:
        return path_of(self.nlp, self.problem, self.answer)

    def solve_on(self, guess: Guess) -> bool:
        """Solve on the mesh of a guess; a warm start that fails is tried again cold."""
        if self._attempt(guess):
            return True
        return bool(guess.multipliers) and self._attempt(replace(guess, multipliers={}))

    def _attempt(self, guess: Guess) -> bool:
        begun = time.perf_counter()
        self.nlp = transcribe_onto(self.problem, guess, units_of(self.problem, guess))
        solver = make_solver(self.nlp, self.options, bool(guess.multipliers), self.progress)
        built = time.perf_counter() - begun
        answer = self.answer = run(solver, self.nlp, self.problem, guess)
        objective = answer.objective * self.nlp.units.cost
        steps = len(guess.mesh) - 1
        self.levels.append(
            Level(guess.order, steps, answer.iterations, objective, built, answer.seconds, answer.status)
        )
        return answer.status in ("solved", "stopped")

    def another_duration(self, tried: float) -> float:
        """A free duration to start from where `tried` led nowhere: the longest, within ten times of it."""
        return float(min(self.problem.duration_bounds[1], 10 * tried))


def _ladder(dynamics: Dynamics, problem: TransferProblem, guess: Guess) -> list[np.ndarray]:
    """Meshes from coarse to the final one, each about four times finer than the one before.

    The coarsest has 100 nodes or as many as keep h omega below 1 on the guess: a mesh that cannot
    follow the motion has optima of its own.
    """
    final, degree = guess.mesh, guess.order // 2
    sample = guess.onto(uniform_mesh(min(100, len(final) - 1)), 2, guess.hold)
    slopes = np.gradient(sample.position, sample.duration * sample.fractions, axis=0)
    rates = np.linalg.eigvals(flow_matrices(dynamics, sample, problem.start_time, slopes)[0])
    least = max(COARSEST_NODES // degree, 2, int(guess.duration * np.abs(rates).max()))
    counts = [len(final) - 1]
    while counts[-1] > 2 * least:
        counts.append(max(least, -(-counts[-1] // FINER)))
    places = np.linspace(0.0, 1.0, len(final))
    coarser = [np.interp(uniform_mesh(count), places, final) for count in reversed(counts[1:])]
    return [*coarser, final]


def solution_of(
    nlp: NLP,
    problem: TransferProblem,
    answer: Answer,
    ladder: tuple[Level, ...],
    options: dict[str, Any] | None = None,
) -> Solution:
    """A Solution from what Ipopt gave on the last mesh."""
    path = path_of(nlp, problem, answer)
    n = problem.dimension
    controls = ca.SX.sym("u", problem.actuator.size(n))
    force = ca.Function("force", [controls], [problem.actuator.force(controls)])
    momentum, velocity = end_momenta(nlp.dynamics, path, problem.start_time)
    success = answer.status == "solved"
    return Solution(
        problem,
        path,
        velocity,
        momentum,
        np.array(force(path.control.T)).T.reshape(-1, n),
        answer.objective * nlp.units.cost,
        success,
        answer.status,
        "a local optimum" if success else ADVICE[answer.status],
        ladder,
        0.0,
        () if success else worst_rows(nlp, problem, answer.x, answer.g),
        provenance=Provenance.of(problem, options),
    )


def stationarity(problem: TransferProblem, path: Guess) -> float:
    """Largest entry of the scaled gradient of the Lagrangian, over the unknowns that are not fixed [-]."""
    nlp = transcribe_onto(problem, path, units_of(problem, path))
    x, p = nlp.pack(path), nlp.parameters(problem)
    lam_x, lam_g = scaled_multipliers(nlp, path)
    slope = np.array(nlp.assembly.gradient(x, p)[1]).ravel()
    jacobian = nlp.assembly.jacobian(x, p)[1].sparse()
    lbx, ubx, _, _ = nlp.bounds(problem)
    return float(np.abs(slope + jacobian.T @ lam_g + lam_x)[lbx < ubx].max(initial=0.0))
