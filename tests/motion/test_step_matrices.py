"""The matrix of a step is the slope of the one-step map, whatever acts, on steps of any length."""

import numpy as np
import pytest

from dmoc import Engine, Fuel, LinearDrag, PointGravity, RotatingFrame, Spring, State, TransferProblem, solve
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import step_nodes
from dmoc.motion.momenta import end_momenta, step_matrices
from dmoc.motion.step import step_map

FROM, TO = State((1, 0.1), (0, 0.9)), State((-0.7, 1.1), (-0.8, -0.3))
ACTS = (PointGravity(1.2), RotatingFrame(0.4), LinearDrag(0.3))
SCENES = {
    "line": TransferProblem(2.0, State(0.3, 0.1), State(1.4, -0.2), 1.7, (LinearDrag(0.3), Spring(0.7, 0.2))),
    "gravity": TransferProblem(2.0, FROM, TO, 1.7, ACTS[:1]),
    "frame, drag": TransferProblem(2.0, FROM, TO, 1.7, ACTS, start_time=0.7),
    "burning": TransferProblem(2.0, FROM, TO, 1.7, ACTS, Engine(9.0, exhaust_velocity=9.0), Fuel()),
}


@pytest.mark.parametrize("hold", [False, True], ids=["nodal", "held"])
@pytest.mark.parametrize("order", [2, 4, 8])
@pytest.mark.parametrize("name", SCENES)
def test_it_is_the_slope_of_the_one_step_map(name, order, hold):
    problem, rule = SCENES[name], scheme(order)
    path = solve(problem, order=order, hold=hold, mesh=(0, 0.1, 0.4, 0.7, 1)).raise_for_status().path
    dynamics, n = Dynamics.of(problem), problem.dimension
    step, momenta = step_map(dynamics, rule, hold), end_momenta(dynamics, path, problem.start_time)[0]
    for k, matrix in enumerate(step_matrices(dynamics, path, problem.start_time)):
        nodes, (begin, end) = step_nodes(4, rule)[:, k], path.duration * path.mesh[k : k + 2]
        controls = path.control[k] if hold else path.control[nodes].T
        given = path.mass[nodes], controls, problem.start_time + begin, end - begin, np.zeros(n)

        def after(state, given=given):
            return (
                state + np.concatenate([part.full() for part in step(state[:n], state[n:], *given)[:2]]).ravel()
            )

        state = np.append(path.position[nodes[0]], momenta[k])
        # differences of order 4: rounding leaves 1e-10
        sides = [
            (after(state + e) - after(state - e), after(state + 2 * e) - after(state - 2 * e))
            for e in 1e-3 * np.eye(2 * n)
        ]
        slopes = np.transpose([(8 * near - far) / 12e-3 for near, far in sides])
        np.testing.assert_allclose(matrix, slopes, rtol=0, atol=1e-7 * np.abs(slopes).max())
