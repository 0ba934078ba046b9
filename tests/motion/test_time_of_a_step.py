"""Where forces depend on the time, each step has its own; and what has no number has no growth."""

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pytest

from dmoc import Conservative, Pose, State, TransferProblem, UniformGravity, simulate, solve
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.momenta import end_momenta, legendre_momenta, step_matrices
from dmoc.motion.stability import flow_matrices, growth_along


@dataclass(frozen=True)
class Tide(Conservative):
    """A spring whose stiffness grows with the time."""

    def lagrangian(self, t, q, v, m):
        return -0.5 * t * ca.dot(q, q)


def tide():
    ends = State((1.0, 0.0), (0.0, 0.1)), State((0.0, 1.0), (0.0, 0.0))
    problem = TransferProblem(1.0, *ends, 3.0, effects=[Tide()], start_time=0.5)
    found = solve(problem, order=4, mesh=(0, 0.1, 0.4, 0.7, 1)).raise_for_status()
    return Dynamics.of(problem), found.path, problem.start_time


def test_the_momenta_of_a_step_are_those_of_that_step_alone_at_its_own_time():
    dynamics, path, begun = tide()
    whole = legendre_momenta(dynamics, path, begun)
    for k in range(4):
        begin, end = path.duration * path.mesh[k : k + 2]
        nodes = slice(2 * k, 2 * k + 3)
        mine = replace(
            path,
            mesh=np.array([0.0, 1.0]),
            duration=end - begin,
            position=path.position[nodes],
            control=path.control[nodes],
            mass=path.mass[nodes],
        )
        alone = legendre_momenta(dynamics, mine, begun + begin)
        np.testing.assert_allclose(whole[:, k], alone[:, 0], rtol=0, atol=1e-12)


def test_the_exact_flow_is_taken_at_the_time_of_each_step_end():
    """q'' = -t q: the lower left block is -t."""
    dynamics, path, begun = tide()
    velocity = end_momenta(dynamics, path, begun)[1]
    flow = flow_matrices(dynamics, path, begun, velocity)
    times = begun + path.duration * path.mesh
    np.testing.assert_allclose(flow[:, 2:, :2], -times[:, None, None] * np.eye(2), rtol=1e-12, atol=1e-14)
    assert not dynamics.linearised[1]


def test_errors_grow_without_limit_where_a_step_has_no_matrix():
    dynamics, path, begun = tide()
    velocity, matrices = end_momenta(dynamics, path, begun)[1], step_matrices(dynamics, path, begun)
    assert growth_along(dynamics, path, begun, velocity, matrices).ok
    matrices[2] = np.inf
    growth = growth_along(dynamics, path, begun, velocity, matrices)
    assert np.isinf(growth.value) and not growth.ok


@pytest.mark.parametrize("order", [2, 8])
def test_a_body_whose_speed_is_what_gravity_adds_in_a_step_flies_its_parabola(order):
    """The size by which the unknowns of a step are divided is the sum of both, and is not their difference."""
    steps, duration, speed = 8, 4.0, 2.0
    pull = speed * steps / duration
    problem = TransferProblem(
        1.0,
        Pose((0, 0, 0), (speed, 0, 0)),
        Pose((0, 0, 0)),
        duration,
        inertia=(1, 2, 3),
        effects=[UniformGravity((0, 0, -pull))],
    )
    flown = simulate(problem, steps=steps, order=order)
    along = np.outer(flown.time, (speed, 0, 0)) - 0.5 * np.outer(flown.time**2, (0, 0, pull))
    np.testing.assert_allclose(flown.position, along, rtol=0, atol=1e-9)
