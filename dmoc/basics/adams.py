"""Motion followed with an error estimate, by Sundials as CasADi brings it."""

from __future__ import annotations

import casadi as ca
import numpy as np


def adams(motion: dict[str, ca.SX], places: np.ndarray, tol: float, most_steps: int) -> ca.Function:
    """Adams' method of variable order for `motion`: its "ode", in "x", "t" and "p", from t = 0 on.

    The states at increasing `places` of t are the columns of "xf". Scale the state to about 1: errors
    are `tol` relative and a thousandth of that absolute. Called, it prints nothing and ends in bounded
    time: with a RuntimeError after `most_steps` from one place to the next, or at a singularity.

    References
    ----------
    A. C. Hindmarsh et al., SUNDIALS, ACM Trans. Math. Softw. 31 (2005).
    """
    settings = {
        "reltol": tol,
        "abstol": 1e-3 * tol,
        "linear_multistep_method": "adams",
        "nonlinear_solver_iteration": "functional",
        "max_num_steps": most_steps,
        # not from the first place: the same steps whatever places are asked for
        "step0": 1e-7,
        "disable_internal_warnings": True,
        "show_eval_warnings": False,
    }
    return ca.integrator("adams", "cvodes", motion, 0.0, places.tolist(), settings)
