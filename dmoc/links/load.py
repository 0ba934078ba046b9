"""What links carry: forces in them to begin with, where a guess knows the path alone."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from dmoc.motion.dynamics import Dynamics
from dmoc.motion.path import DiscretePath


def resting_load(problem: Any, path: DiscretePath) -> np.ndarray:
    """Forces of the constraint g(q) = 0 per unit mass that hold the bodies at rest along a path.

    At each node the load of the effects is shared, by least squares, between these and the actuator. Without
    them the first steps of Ipopt let bodies that hang on rods fall, and lead to swings among other optima.

    Returns
    -------
    array, shape (nodes, conditions)
    """
    dynamics = Dynamics.of(problem)
    body, nodes = dynamics.configuration, len(path.position)
    t, q, still = ca.SX.sym("t"), ca.SX.sym("q", body.size), ca.DM.zeros(body.size)
    reaction, u = ca.SX.sym("reaction", body.conditions), ca.SX.sym("u", problem.controls)
    slope, _, push = dynamics.point(t, q, still, problem.mass)
    held = ca.jacobian(body.pull(q, reaction), reaction)
    driven = ca.jacobian(body.driven(problem.actuator, q, u, problem.mass), u)
    # Where the actuator is not linear in its controls it carries what it does near none.
    carried = ca.substitute(ca.horzcat(held, -driven), u, ca.DM.zeros(u.shape))
    load = ca.Function("load", [t, q], [ca.densify(carried), ca.densify(ca.SX(slope + push))])
    times = problem.start_time + path.duration * path.fractions
    bars, loads = (np.array(part) for part in load.map(nodes)(times[None], path.position.T))
    bars = bars.reshape(body.size, nodes, -1).transpose(1, 0, 2)
    shares = np.einsum("kij,jk->ki", np.linalg.pinv(np.nan_to_num(bars)), np.nan_to_num(loads))
    return shares[:, : body.conditions]
