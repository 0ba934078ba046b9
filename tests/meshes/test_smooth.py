"""Where nothing switches and no limit sets in, a tolerance takes one mesh of as many steps as it needs."""

from dataclasses import replace

import numpy as np
import pytest

from dmoc import Attitude, Fuel, Torque, TransferProblem, solve, verify
from dmoc.meshes.smooth import FEWEST, MOST, OFF, finer, smooth_path, steps_for
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.mesh import uniform_mesh
from dmoc.motion.stability import steps_to_turn
from dmoc.results.estimate import estimate_at_once
from dmoc.scene.problem_file import load_problem


@pytest.mark.parametrize("tol", [1e-3, 1e-6, 1e-9])
def test_eight_revolutions_take_one_mesh(tol):
    problem = load_problem("geo_raise").make(revolutions=8)
    exact = solve(problem, order=8, steps=300).objective
    found = solve(problem, tol=tol)
    assert len(found.ladder) == 1 and found.error.largest <= tol
    assert abs(found.objective / exact - 1) <= tol
    assert verify(found).ok
    fewer = solve(problem, order=8, steps=int(0.7 * found.steps))
    off = estimate_at_once(problem, Dynamics.of(problem), fewer.path, fewer.objective)
    assert off.largest > tol


@pytest.mark.parametrize("name", ["pendulum", "heavy_top", "arm_reach", "tether"])
def test_without_an_attractor_two_meshes_at_most(name):
    problem = load_problem(name).make()
    exact = solve(problem, order=8, steps=60).objective
    found = solve(problem, tol=1e-7)
    assert len(found.ladder) <= 2 and found.error.largest <= 1e-7
    assert abs(found.objective / exact - 1) <= 1e-7
    # A step more or two bring the error down: nothing is cut in halves.
    assert found.steps < 1.5 * found.ladder[0].steps


def test_steps_follow_a_body_that_spins_though_nothing_drives_it():
    spinning = Attitude((1, 0, 0, 0), (0, 0, 30.0))
    problem = TransferProblem(1.0, spinning, spinning, 5.0, inertia=(1, 1, 1), actuator=Torque())
    path = smooth_path(problem, 0.1)
    assert len(path.mesh) - 1 == steps_to_turn(path) > FEWEST


def test_steps_grow_with_the_eighth_root_of_the_accuracy():
    turned = np.full(100, 100.0)
    assert steps_for(1e-8, turned, OFF) == pytest.approx(10 * steps_for(1.0, turned, OFF), rel=0.02)
    assert steps_for(1e-8, 2 * turned, OFF) == pytest.approx(
        2 ** (9 / 8) * steps_for(1e-8, turned, OFF), rel=0.02
    )


@pytest.mark.parametrize("turned, count", [(0.0, FEWEST), (np.nan, FEWEST), (np.inf, MOST), (1e9, MOST)])
def test_rates_that_say_nothing_lead_to_a_mesh_all_the_same(turned, count):
    assert steps_for(1e-6, np.full(5, turned), OFF) == count


def test_the_next_mesh_is_as_fine_as_the_error_asks_for():
    path = solve(load_problem("orbit_raise").make(), order=8, steps=20).path
    assert len(finer(path, 4e-6, 1e-6)) - 1 == pytest.approx(20 * 10 ** (1 / 8), abs=1)
    assert len(finer(path, np.nan, 1e-6)) - 1 == 80
    graded = replace(path, mesh=uniform_mesh(20) ** 2)
    assert np.diff(finer(graded, 4e-6, 1e-6))[0] < 0.1 * np.diff(finer(graded, 4e-6, 1e-6))[-1]


def test_full_thrust_needs_no_wide_rounding_on_the_way():
    """The largest radius takes all the thrust there is: one wide rounding leads to it, none from an answer."""
    problem = load_problem("earth_mars").make(duration=3.3193)
    own = solve(problem, order=4, steps=16)
    assert [level.question for level in own.ladder] == ["", ""]
    near = replace(own.path, multipliers={})
    assert len(solve(replace(problem, mass=1.01), order=4, steps=16, guess=near).ladder) == 1


def test_burns_and_coasts_are_found_by_wide_roundings_first():
    problem = load_problem("two_body_fuel").make()
    assert isinstance(problem.objective, Fuel)
    assert len(solve(problem, order=4, steps=20).ladder) > 2
