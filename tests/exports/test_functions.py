"""Exported functions are dmoc's own: its integrator, its residual as a force, its objective."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from dmoc import LinearDrag, RotatingFrame, State, TransferProblem, UniformGravity, simulate, solve, verify
from dmoc.exports.export import functions_of
from dmoc.planners.planner import Planner

TURNING = TransferProblem(
    2.0,
    State((0, 0), (0, 0)),
    State((1, None), (None, 0.3)),
    5.0,
    effects=[LinearDrag(0.2), RotatingFrame(0.1), UniformGravity((0, -1))],
    start_time=0.5,
)
TIMES = {"mass": 2.0, "start_time": 0.5, "duration": 5.0}


def functions(problem, order, steps, hold):
    planner = Planner.of(problem, order, steps, hold)
    return {e.function.name(): e.function for e in functions_of(planner)}


@pytest.fixture(scope="module")
def made():
    return functions(TURNING, 4, 10, False)


def test_the_rollout_is_the_simulation(made):
    forces = np.random.default_rng(2).normal(size=(2, 21))
    state = {"position": (0.3, -0.2), "velocity": (0.1, 0.4)}
    found = made["rollout"](**state, **TIMES, forces=forces)
    path = simulate(replace(TURNING, start=State(*state.values())), forces.T, steps=10, order=4)
    np.testing.assert_allclose(np.array(found["positions"])[:, ::2].T, path.position, atol=1e-13)
    np.testing.assert_allclose(np.array(found["velocities"]).T, path.velocity, atol=1e-13)


def test_steps_one_after_the_other_are_the_rollout(made):
    forces = np.random.default_rng(2).normal(size=(2, 21))
    q, v = (0.3, -0.2), (0.1, 0.4)
    found = made["rollout"](q, v, *TIMES.values(), forces)
    for k in range(10):
        q, v = made["step"](q, v, 2.0, 0.5 + 0.5 * k, 0.5, forces[:, 2 * k : 2 * k + 3])
    np.testing.assert_allclose(np.array(q), np.array(found[0])[:, -1:], atol=1e-12)
    np.testing.assert_allclose(np.array(v), np.array(found[1])[:, -1:], atol=1e-12)


def test_a_rolled_out_path_has_no_residual(made):
    forces = np.random.default_rng(2).normal(size=(2, 21))
    q, v = made["rollout"]((0.3, -0.2), (0.1, 0.4), *TIMES.values(), forces)
    found = np.array(made["residual"](q, v[:, 0], v[:, -1], forces, *TIMES.values()))
    assert np.abs(found).max() < 1e-11
    off = np.array(made["residual"](q, v[:, 0], v[:, -1], 1.001 * forces, *TIMES.values()))
    assert np.abs(off).max() > 1e-4


def test_the_residual_is_equation_16_as_a_force():
    """Held forces on a free body: force minus mass times acceleration; at both ends over half a step."""
    m, h, steps = 18.9715, 0.5, 6
    free = TransferProblem(m, State((0, 0), (0, 0)), State((1, 1), (0, 0)), h * steps)
    noise = np.random.default_rng(3)
    q, g, v0, vn = noise.normal(size=(2, steps + 1)), noise.normal(size=(2, steps)), (0.2, 0.1), (-0.3, 0.5)
    found = np.array(functions(free, 2, steps, True)["residual"](q, v0, vn, g, m, 0.0, h * steps))
    slopes = np.diff(q) / h
    expected = 0.5 * (g[:, 1:] + g[:, :-1]) - m * np.diff(slopes) / h
    np.testing.assert_allclose(found[:, 1:-1], expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found[:, 0], g[:, 0] - 2 * m / h * (slopes[:, 0] - v0), rtol=1e-12)
    np.testing.assert_allclose(found[:, -1], g[:, -1] - 2 * m / h * (vn - slopes[:, -1]), rtol=1e-12)


def test_the_residual_is_what_verify_measures_and_the_cost_what_solve_reports(made):
    solution = solve(TURNING, order=4, steps=10)
    bend = 1e-4 * np.sin(solution.time)[:, None]
    bent = replace(solution, path=replace(solution.path, position=solution.position + bend))
    path = bent.path
    given = path.position.T, path.start_velocity, path.goal_velocity, path.control.T, *TIMES.values()
    largest = np.abs(np.array(made["residual"](*given))).max()
    assert largest == pytest.approx(verify(bent)["residual"].value, rel=1e-9) and largest > 1e-4
    assert float(made["cost"](*given)) == pytest.approx(solution.objective, rel=1e-12)


def test_the_jacobian_is_the_residuals(made):
    noise, f = np.random.default_rng(4), made["residual"]
    given = {name: noise.uniform(1, 2, f.size_in(name)) for name in f.name_in()}
    jacobian = made["residual_jacobian"](**given)
    for name, value in given.items():
        by = 1e-6 * noise.normal(size=value.shape)
        up, down = (np.array(f(**(given | {name: value + side * by}))["residual"]) for side in (1, -1))
        slope = np.array(jacobian[f"by_{name}"] @ ca.vec(ca.DM(by))).ravel()
        expected = 0.5 * (up - down).ravel(order="F")
        np.testing.assert_allclose(
            slope, expected, atol=1e-6 * np.abs(expected).max() + 1e-12 * np.abs(up).max()
        )
