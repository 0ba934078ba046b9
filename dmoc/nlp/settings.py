"""Options of Ipopt for a problem on a mesh, chosen by measurement over all problems."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmoc.scene.problem import TransferProblem


def tolerance(mesh: np.ndarray, degree: int, limited: bool) -> float:
    """Of scaled rows and gradients.

    Rows are momenta: an error of 1e-10 in each is one of 1e-10 N in the force, so finer meshes ask for
    less, down to the rounding of positions over the shortest step. Without limits the last iterations
    converge quadratically: another digit or two cost one of them at most.
    """
    floor = 20 * np.finfo(float).eps * degree / np.diff(mesh).min()
    return float(max(min(1e-10 if limited else 5e-12, 1e-8 / len(mesh)), floor))


def settings_for(
    problem: TransferProblem, mesh: np.ndarray, degree: int, warm: bool = False, carried: bool = False
) -> dict[str, Any]:
    """Options of Ipopt for a problem on a mesh.

    `warm` if multipliers are known, `carried` if they and the path come from the answer on a coarser mesh.
    """
    settings: dict[str, Any] = {
        "ipopt.bound_relax_factor": 0.0,
        "ipopt.tol": tolerance(mesh, degree, problem.limited),
        "ipopt.constr_viol_tol": 1e-6,
        # Some optima leave a direction open, along which Ipopt would go on: ten iterations without gain end it.
        "ipopt.acceptable_iter": 10,
        "ipopt.acceptable_tol": 1e-6,
        "ipopt.acceptable_constr_viol_tol": 1e-10,
        "ipopt.acceptable_obj_change_tol": 1e-10,
        "ipopt.max_iter": 1000,
    }
    if problem.limited:
        # with barrier terms the default matching delays pivots: 8 s instead of 0.15 s an iteration was seen
        settings["ipopt.mumps_permuting_scaling"] = 0
        if len(mesh) > 1000:
            settings["ipopt.mumps_pivot_order"] = 5
    settings |= _barrier(problem, warm, carried)
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
