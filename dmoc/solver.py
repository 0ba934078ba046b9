"""Ipopt, from a coarse mesh to the one asked for, and what its answer means."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.guess import starting_guess
from dmoc.lobatto import scheme
from dmoc.mesh import Guess, node_weights, uniform_mesh
from dmoc.problem import TransferProblem
from dmoc.simulate import end_momenta
from dmoc.solution import Level, Provenance, Solution
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
STATUS = {
    "Solve_Succeeded": "solved",
    "Solved_To_Acceptable_Level": "solved",
    "Infeasible_Problem_Detected": "infeasible",
    "Maximum_Iterations_Exceeded": "iteration limit",
    "Maximum_CpuTime_Exceeded": "iteration limit",
    "Maximum_WallTime_Exceeded": "iteration limit",
    "Invalid_Number_Detected": "invalid number",
    "Restoration_Failed": "restoration failed",
    "Diverging_Iterates": "diverging",
    "User_Requested_Stop": "stopped",
}

Progress = Callable[[int, int, int, float, str, float], bool | None]


@dataclass(frozen=True)
class Answer:
    """What one run of Ipopt on one mesh gave, scaled."""

    x: np.ndarray
    lam_x: np.ndarray
    lam_g: np.ndarray
    g: np.ndarray
    objective: float
    status: str
    iterations: int
    seconds: float


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
    known = starting_guess(problem, final, order, hold, guess)
    meshes = [final] if known.multipliers else _ladder(problem, final, order, known)
    if len(meshes) > 1:
        known = starting_guess(problem, meshes[0], order, hold, guess)
    levels: list[Level] = []
    for ends in meshes:
        begun = time.perf_counter()
        known = known.onto(ends, order, hold)
        nlp = transcribe_onto(problem, known, units_of(problem, known))
        solver = make_solver(nlp, options, warm=bool(known.multipliers), progress=progress)
        built = time.perf_counter() - begun
        answer = run(solver, nlp, problem, known)
        objective = answer.objective * nlp.units.cost
        levels.append(
            Level(order, len(ends) - 1, answer.iterations, objective, built, answer.seconds, answer.status)
        )
        if answer.status != "solved":
            break
        known = path_of(nlp, problem, answer)
    return solution_of(nlp, problem, answer, tuple(levels), options)


def _ladder(problem: TransferProblem, final: np.ndarray, order: int, guess: Guess) -> list[np.ndarray]:
    """Meshes from coarse to the final one, each about four times finer than the one before."""
    least = max(COARSEST_NODES // (order // 2), 2)
    counts = [len(final) - 1]
    while counts[-1] > 2 * least:
        counts.append(max(least, -(-counts[-1] // FINER)))
    places = np.linspace(0.0, 1.0, len(final))
    return [
        final if n == len(final) - 1 else np.interp(uniform_mesh(n), places, final) for n in reversed(counts)
    ]


def make_solver(
    nlp: NLP, options: dict[str, Any] | None = None, warm: bool = False, progress: Progress | None = None
) -> ca.Function:
    """The CasADi `nlpsol` Function of an NLP, with its exact derivatives."""
    parts = nlp.assembly
    floor = 4e-15 * len(nlp.mesh)
    tolerance = max(min(1e-10, 1e-8 / len(nlp.mesh)), floor)
    settings: dict[str, Any] = {
        "jac_g": parts.jacobian,
        "hess_lag": parts.hessian,
        "grad_f": parts.gradient,
        "no_nlp_grad": True,
        "calc_lam_p": False,
        "print_time": False,
        "error_on_fail": False,
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.linear_solver": "mumps",
        "ipopt.nlp_scaling_method": "none",
        "ipopt.bound_relax_factor": 0.0,
        "ipopt.tol": tolerance,
        "ipopt.constr_viol_tol": 1e-6,
        "ipopt.acceptable_iter": 0,
        "ipopt.max_iter": 1000,
    }
    if warm:
        settings |= {
            "ipopt.warm_start_init_point": "yes",
            "ipopt.mu_init": 1e-6,
            "ipopt.warm_start_bound_push": 1e-8,
            "ipopt.warm_start_bound_frac": 1e-8,
            "ipopt.warm_start_slack_bound_push": 1e-8,
            "ipopt.warm_start_slack_bound_frac": 1e-8,
            "ipopt.warm_start_mult_bound_push": 1e-8,
        }
    if progress is not None:
        settings["iteration_callback"] = _Watch(nlp, progress)
    settings |= options or {}
    return ca.nlpsol("solver", "ipopt", {"x": parts.x, "p": parts.p, "f": parts.f, "g": parts.g}, settings)


def run(solver: ca.Function, nlp: NLP, problem: TransferProblem, guess: Guess) -> Answer:
    """Solve an NLP for a problem it accepts, from a guess on its mesh."""
    lbx, ubx, lbg, ubg = nlp.bounds(problem)
    x0 = np.clip(nlp.pack(guess), lbx, ubx)
    lam_x, lam_g = _scaled_multipliers(nlp, guess)
    begun = time.perf_counter()
    result = solver(
        x0=x0, p=nlp.parameters(problem), lbx=lbx, ubx=ubx, lbg=lbg, ubg=ubg, lam_x0=lam_x, lam_g0=lam_g
    )
    seconds = time.perf_counter() - begun
    stats = solver.stats()
    x, lam_x, lam_g, g = (np.array(result[key]).ravel() for key in ("x", "lam_x", "lam_g", "g"))
    status = STATUS.get(stats["return_status"], "failed")
    return Answer(x, lam_x, lam_g, g, float(result["f"]), status, int(stats["iter_count"]), seconds)


def path_of(nlp: NLP, problem: TransferProblem, answer: Answer) -> Guess:
    """SI path and multipliers of an answer."""
    multipliers = {}
    for key, group, values, scale in _multiplier_groups(nlp, answer.lam_x, answer.lam_g):
        multipliers[key] = group.of(values) * nlp.units.cost * scale
    return replace(nlp.unpack(answer.x, problem), multipliers=multipliers)


def _scaled_multipliers(nlp: NLP, guess: Guess) -> tuple[np.ndarray, np.ndarray]:
    lam_x, lam_g = np.zeros(nlp.columns.size), np.zeros(nlp.rows.size)
    for key, group, values, scale in _multiplier_groups(nlp, lam_x, lam_g):
        if key in guess.multipliers:
            values[group.start : group.stop] = (guess.multipliers[key] / (nlp.units.cost * scale)).ravel()
    return lam_x, lam_g


def _multiplier_groups(nlp: NLP, lam_x: np.ndarray, lam_g: np.ndarray):
    """(key, group, scaled vector, scale to SI densities) of each group; see `Guess.multipliers`."""
    weights = {"node": node_weights(nlp.mesh, nlp.scheme), "step": np.diff(nlp.mesh)}
    weights["control"] = weights["step" if nlp.hold else "node"]
    for layout, side, values, inverse in (
        (nlp.columns, "column", lam_x, True),
        (nlp.rows, "row", lam_g, False),
    ):
        for group in layout.groups:
            scale = np.broadcast_to(np.asarray(group.scale, float), (group.count,))[:, None]
            density = weights.get(group.kind, np.ones(group.count))[:, None]
            yield (
                f"{group.kind}:{side}:{group.name}",
                group,
                values,
                (1 / scale if inverse else scale) / density,
            )


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
        _stationarity(nlp, problem, answer),
        () if success else worst_rows(nlp, problem, answer.x, answer.g),
        provenance=Provenance.of(problem, options),
    )


def worst_rows(nlp: NLP, problem: TransferProblem, x, g, count: int = 10) -> tuple[tuple[str, float], ...]:
    """The most violated rows and bounds by name, with their scaled violation, worst first."""
    lbx, ubx, lbg, ubg = nlp.bounds(problem)
    excess = [
        np.nan_to_num(np.maximum(low - value, value - high), nan=np.inf)
        for value, low, high in ((np.ravel(g), lbg, ubg), (np.ravel(x), lbx, ubx))
    ]
    both = np.concatenate(excess)
    worst = np.argsort(-both)[:count]
    names = [
        nlp.rows.name_of(i) if i < nlp.rows.size else nlp.columns.name_of(i - nlp.rows.size) for i in worst
    ]
    return tuple((name, float(both[i])) for name, i in zip(names, worst, strict=True) if both[i] > 0)


def _stationarity(nlp: NLP, problem: TransferProblem, answer: Answer) -> float:
    """Largest entry of the scaled gradient of the Lagrangian, over the unknowns that are not fixed."""
    p = nlp.parameters(problem)
    slope = np.array(nlp.assembly.gradient(answer.x, p)[1]).ravel()
    jacobian = nlp.assembly.jacobian(answer.x, p)[1].sparse()
    lbx, ubx, _, _ = nlp.bounds(problem)
    free = lbx < ubx
    return float(np.abs(slope + jacobian.T @ answer.lam_g + answer.lam_x)[free].max(initial=0.0))


class _Watch(ca.Callback):
    """Tells `progress` about every iteration."""

    def __init__(self, nlp: NLP, progress: Progress):
        ca.Callback.__init__(self)
        self.nlp, self.progress, self.iteration = nlp, progress, 0
        self.bounds = nlp.bounds(nlp.problem)
        self.construct("watch", {})

    def get_n_in(self):
        return ca.nlpsol_n_out()

    def get_n_out(self):
        return 1

    def get_name_in(self, i):
        return ca.nlpsol_out(i)

    def get_sparsity_in(self, i):
        sizes = {"f": 1, "x": self.nlp.columns.size, "lam_x": self.nlp.columns.size}
        sizes |= {"g": self.nlp.rows.size, "lam_g": self.nlp.rows.size, "lam_p": self.nlp.assembly.p.numel()}
        return ca.Sparsity.dense(sizes[ca.nlpsol_out(i)])

    def eval(self, arguments):
        at = dict(zip(ca.nlpsol_out(), arguments, strict=True))
        worst = worst_rows(self.nlp, self.nlp.problem, at["x"], at["g"], count=1) or (("", 0.0),)
        objective = float(at["f"]) * self.nlp.units.cost
        steps = len(self.nlp.mesh) - 1
        stop = self.progress(self.nlp.scheme.order, steps, self.iteration, objective, *worst[0])
        self.iteration += 1
        return [1 if stop else 0]
