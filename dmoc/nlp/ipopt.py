"""One run of Ipopt on one NLP: options, multipliers in and out, and what its status means."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import short
from dmoc.motion.mesh import node_weights
from dmoc.motion.path import DiscretePath
from dmoc.nlp.transcription import NLP
from dmoc.scene.problem import TransferProblem

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
    evaluations: int
    seconds: float


def tolerance(mesh: np.ndarray, degree: int, limited: bool) -> float:
    """Of scaled rows and gradients.

    Rows are momenta: an error of 1e-10 in each is one of 1e-10 N in the force, so finer meshes ask for
    less, down to the rounding of positions over the shortest step. Without limits the last iterations
    converge quadratically: another digit or two cost one of them at most.
    """
    floor = 20 * np.finfo(float).eps * degree / np.diff(mesh).min()
    return float(max(min(1e-10 if limited else 5e-12, 1e-8 / len(mesh)), floor))


def settings_for(nlp: NLP, warm: bool = False, carried: bool = False) -> dict[str, Any]:
    """Options of `nlpsol` and Ipopt, chosen by measurement over all problems.

    `warm` if multipliers are known, `carried` if they and the path come from the answer on a coarser mesh.
    """
    parts = nlp.assembly
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
        "ipopt.tol": tolerance(nlp.mesh, nlp.scheme.degree, nlp.problem.limited),
        "ipopt.constr_viol_tol": 1e-6,
        # where an optimum of nothing leaves a direction open, ten iterations that gain nothing are enough
        "ipopt.acceptable_iter": 10,
        "ipopt.acceptable_tol": 1e-6,
        "ipopt.acceptable_constr_viol_tol": 1e-10,
        "ipopt.acceptable_obj_change_tol": 1e-10,
        "ipopt.max_iter": 1000,
    }
    if nlp.problem.limited:
        # with barrier terms the default matching delays pivots: 8 s instead of 0.15 s an iteration was seen
        settings["ipopt.mumps_permuting_scaling"] = 0
        if len(nlp.mesh) > 1000:
            settings["ipopt.mumps_pivot_order"] = 5
    settings |= _barrier(nlp.problem, warm, carried)
    if warm:
        # interpolated values break the equations: 1e-8 away from a limit the first steps would be cut short.
        # A thousandth takes 1,173 iterations, not 1,309, on the last meshes of eleven problems, 42 variants.
        push = 1e-3 if carried else 1e-8
        pushed = ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mult_bound_push")
        settings |= {"ipopt.warm_start_init_point": "yes", "ipopt.mu_init": 1e-6}
        settings |= {f"ipopt.warm_start_{name}": push for name in pushed}
    return settings


def _barrier(problem: TransferProblem, warm: bool, carried: bool) -> dict[str, Any]:
    """How the barrier falls, where it is not best that it only falls."""
    rounded = problem.actuator.smoothing is not None
    if rounded and problem.objective.metered:
        # with |F| rounded at zero, a barrier that only falls takes 3 to 30 times the iterations
        settings: dict[str, Any] = {"ipopt.mu_strategy": "adaptive", "ipopt.mu_oracle": "probing"}
        # near the optimum full steps can go to and fro, 2,700 of them were seen, for hardly less violation
        return settings | ({"ipopt.gamma_theta": 1e-2} if warm else {})
    if problem.limited and not rounded and warm and not carried:
        # another start or limit: 78 iterations instead of 143 over eleven changes of four problems; from
        # another mesh, or with another rounding of |F|, it would be up to 13 times as many
        return {"ipopt.mu_strategy": "adaptive"}
    return {}


def make_solver(
    nlp: NLP,
    options: dict[str, Any] | None = None,
    warm: bool = False,
    watch: Watch | None = None,
    carried: bool = False,
) -> ca.Function:
    """The CasADi `nlpsol` Function of an NLP, with its exact derivatives; see `settings_for`."""
    parts, settings = nlp.assembly, settings_for(nlp, warm, carried)
    if watch is not None:
        settings["iteration_callback"] = watch
    settings |= options or {}
    try:
        return ca.nlpsol("solver", "ipopt", {"x": parts.x, "p": parts.p, "f": parts.f, "g": parts.g}, settings)
    except RuntimeError as error:
        if not options:
            raise
        raise ValueError(
            f"CasADi or Ipopt refuses one of the options {short(options)}: its name or its value; "
            "names are such as 'ipopt.max_iter'"
        ) from error


def run(solver: ca.Function, nlp: NLP, problem: TransferProblem, guess: DiscretePath) -> Answer:
    """Solve an NLP for a problem it accepts, from a guess on its mesh."""
    lbx, ubx, lbg, ubg = nlp.bounds(problem)
    x0 = np.clip(nlp.pack(guess), lbx, ubx)
    lam_x, lam_g = scaled_multipliers(nlp, guess)
    begun = time.perf_counter()
    result = solver(
        x0=x0, p=nlp.parameters(problem), lbx=lbx, ubx=ubx, lbg=lbg, ubg=ubg, lam_x0=lam_x, lam_g0=lam_g
    )
    seconds = time.perf_counter() - begun
    stats = solver.stats()
    x, lam_x, lam_g, g = (np.array(result[key]).ravel() for key in ("x", "lam_x", "lam_g", "g"))
    status = STATUS.get(stats["return_status"], "failed")
    calls = sum(count for name, count in stats.items() if name.startswith("n_call_nlp"))
    return Answer(x, lam_x, lam_g, g, float(result["f"]), status, int(stats["iter_count"]), calls, seconds)


def path_of(nlp: NLP, problem: TransferProblem, answer: Answer) -> DiscretePath:
    """SI path and multipliers of an answer."""
    multipliers = {}
    for key, group, values, scale in _multiplier_groups(nlp, answer.lam_x, answer.lam_g):
        multipliers[key] = group.of(values) * nlp.units.cost * scale
    return replace(nlp.unpack(answer.x, problem), multipliers=multipliers)


def scaled_multipliers(nlp: NLP, guess: DiscretePath) -> tuple[np.ndarray, np.ndarray]:
    lam_x, lam_g = np.zeros(nlp.columns.size), np.zeros(nlp.rows.size)
    for key, group, values, scale in _multiplier_groups(nlp, lam_x, lam_g):
        if key in guess.multipliers:
            values[group.start : group.stop] = (guess.multipliers[key] / (nlp.units.cost * scale)).ravel()
    return lam_x, lam_g


def _multiplier_groups(nlp: NLP, lam_x: np.ndarray, lam_g: np.ndarray):
    """(key, group, scaled vector, scale to SI densities) of each group; see `DiscretePath.multipliers`."""
    weights = {"node": node_weights(nlp.mesh, nlp.scheme), "step": np.diff(nlp.mesh)}
    weights["control"] = weights["step" if nlp.hold else "node"]
    for layout, side, values, inverse in (
        (nlp.columns, "column", lam_x, True),
        (nlp.rows, "row", lam_g, False),
    ):
        for group in layout.groups:
            scale = group.scales
            density = weights.get(group.kind, np.ones(group.count))[:, None]
            yield (
                f"{group.kind}:{side}:{group.name}",
                group,
                values,
                (1 / scale if inverse else scale) / density,
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


class Interrupt:
    """Ctrl-C as a flag while a solve runs: CasADi would swallow the exception, and the iterate is worth it."""

    def __init__(self) -> None:
        self.seen = False
        self._previous: Any = None

    def __enter__(self) -> Interrupt:
        if threading.current_thread() is threading.main_thread():
            self._previous = signal.signal(signal.SIGINT, self._see)
        return self

    def __exit__(self, *error: Any) -> None:
        if self._previous is not None:
            signal.signal(signal.SIGINT, self._previous)

    def _see(self, *received: Any) -> None:
        self.seen = True


class Watch(ca.Callback):
    """Follows the iterations: tells `progress` about each, and stops when `interrupt` has seen a Ctrl-C.

    CasADi holds no reference to a callback: whoever makes the solver keeps this alive while it runs. It
    would print an exception of `progress` and go on: this stops, and keeps it as `error` to be raised.
    """

    def __init__(self, nlp: NLP, progress: Progress | None, interrupt: Interrupt):
        ca.Callback.__init__(self)
        self.nlp, self.progress, self.interrupt, self.iteration = nlp, progress, interrupt, 0
        self.error: BaseException | None = None
        self.construct("watch", {})

    def get_n_in(self) -> int:
        return ca.nlpsol_n_out()

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, i: int) -> str:
        return ca.nlpsol_out(i)

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        columns, rows = self.nlp.columns.size, self.nlp.rows.size
        sizes = {"f": 1, "x": columns, "lam_x": columns, "g": rows, "lam_g": rows}
        return ca.Sparsity.dense(sizes.get(ca.nlpsol_out(i), self.nlp.assembly.p.numel()))

    def eval(self, arguments: list) -> list:
        try:
            return [int(self._told(arguments))]
        except BaseException as error:
            self.error = error
            return [1]

    def _told(self, arguments: list) -> bool:
        stop = self.interrupt.seen
        if self.progress is not None:
            at = dict(zip(ca.nlpsol_out(), arguments, strict=True))
            x, g = np.array(at["x"]), np.array(at["g"])
            worst = worst_rows(self.nlp, self.nlp.problem, x, g, count=1) or (("", 0.0),)
            objective, steps = self.nlp.objective(float(at["f"])), len(self.nlp.mesh) - 1
            order = self.nlp.scheme.order
            stop |= bool(self.progress(order, steps, self.iteration, objective, *worst[0]))
        self.iteration += 1
        return stop
