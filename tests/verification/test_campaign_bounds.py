"""The proven bounds of scripts/campaign/bounds.py against closed forms, and the search for cheaper answers."""

import math
import runpy
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dmoc

SCRIPTS = Path(dmoc.__file__).parents[1] / "scripts"


@pytest.fixture(scope="module")
def campaign():
    sys.path.insert(0, str(SCRIPTS))
    yield runpy.run_path(str(SCRIPTS / "campaign.py"))
    sys.path.remove(str(SCRIPTS))


def rest_to_rest(distance, n=1):
    still = np.zeros(n)
    return still, still, distance * np.eye(n)[0], still


def test_without_a_limit_the_bound_is_the_least_effort_of_a_double_integrator(campaign):
    from campaign import bounds, physics

    value, sharp = bounds.dual(
        physics.nothing(2), physics.Push("free", 2), 2.0, rest_to_rest(3.0, 2), 5.0, "effort"
    )
    assert sharp
    assert value == pytest.approx(6 * (2.0 * 3.0) ** 2 / 5.0**3, rel=1e-9)


@pytest.mark.parametrize("kind", ["ball", "box"])
def test_just_enough_force_costs_the_effort_of_pushing_all_the_time(campaign, kind):
    from campaign import bounds, physics

    mass, way, T = 2.0, 3.0, 5.0
    need = 4 * mass * way / T**2
    push = physics.Push(kind, 1, need * 1.000001)
    value, _ = bounds.dual(physics.nothing(1), push, mass, rest_to_rest(way), T, "effort")
    assert value == pytest.approx(0.5 * need**2 * T, rel=2e-3)


def test_least_fuel_is_two_burns_and_a_coast(campaign):
    from campaign import bounds, physics

    mass, way, T, limit = 2.0, 3.0, 5.0, 2.0
    # d = F / m tau (T - tau)
    burn = T / 2 - math.sqrt(T**2 / 4 - mass * way / limit)
    push = physics.Push("engine", 1, limit, metered=True)
    value, sharp = bounds.dual(physics.nothing(1), push, mass, rest_to_rest(way), T, "fuel")
    assert sharp
    assert value == pytest.approx(2 * limit * burn, rel=1e-5)


def test_in_a_turning_frame_the_bound_is_that_of_the_frame_that_stands(campaign):
    """The same flight, seen from a frame that turns, costs the same."""
    from campaign import bounds, physics

    rate, T, mass = 0.7, 3.0, 1.5
    q0, v0, q1, v1 = np.array([1.0, 0.5]), np.array([0.2, -0.1]), np.array([-0.3, 2.0]), np.array([0.0, 0.4])
    angle = rate * T
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    spin = rate * np.array([[0.0, -1.0], [1.0, 0.0]])
    standing = (q0, v0 + spin @ q0, turn @ q1, turn @ (v1 + spin @ q1))
    push = physics.Push("engine", 2, 6.0, metered=True)
    for cost in ("effort", "fuel"):
        turning = bounds.dual(physics.turning(rate, 2), push, mass, (q0, v0, q1, v1), T, cost)
        inertial = bounds.dual(physics.nothing(2), push, mass, standing, T, cost)
        assert turning[0] == pytest.approx(inertial[0], rel=1e-6)


def test_a_free_end_costs_no_more_than_the_best_place_for_it(campaign):
    from campaign import bounds, physics

    push = physics.Push("free", 1)
    still, open_velocity = np.zeros(1), np.array([np.nan])
    value, _ = bounds.dual(
        physics.nothing(1), push, 1.0, (still, still, np.ones(1), open_velocity), 2.0, "effort"
    )
    # 3 m^2 d^2 / (2 T^3)
    assert value == pytest.approx(1.5 / 8, rel=1e-9)


def test_least_time_is_two_pushes_and_knows_of_gravity(campaign):
    from campaign import bounds, physics

    push, mass, way = physics.Push("ball", 1, 3.0), 2.0, 5.0
    assert bounds.quickest(push, mass, np.zeros(1), rest_to_rest(way)) == (
        pytest.approx(2 * math.sqrt(mass * way / 3.0)),
        True,
    )
    # Up against gravity at a net 0.5, then 2.5 m/s^2 down: w^2 (1/2a + 1/2b) = d.
    top = math.sqrt(way / (1 / (2 * 0.5) + 1 / (2 * 2.5)))
    time, _ = bounds.quickest(push, mass, np.array([-1.0]), rest_to_rest(way))
    assert time == pytest.approx(top / 0.5 + top / 2.5)


def test_the_judge_sees_an_answer_dearer_than_the_proven_optimum(campaign):
    from campaign.bounds import SHARP, sharpened

    made = (sharpened(campaign["make"]("free space", seed)) for seed in range(50))
    scene = next(scene for scene in made if scene.truth.dear == SHARP)
    solution = dmoc.solve(scene.problem, order=4, steps=100)
    assert campaign["faults"](scene.truth, solution, None) == []
    cheaper = replace(scene.truth, known=solution.objective / (SHARP + 0.01), least=np.nan)
    assert any("a known path" in one for one in campaign["faults"](cheaper, solution, None))


def test_a_cheaper_answer_is_found_from_elsewhere(campaign):
    """Around an attractor the wrong way costs several times as much."""
    from campaign import making, physics, rivals

    world, push, T = physics.attractor(1.0), physics.Push("free", 2), 2 * np.pi
    start, goal = (np.array([1.0, 0.0]), np.array([0.0, 1.0])), (np.array([1.1, 0.0]), np.array([0.0, 0.95]))
    found = making.Journey(start, goal, T, np.zeros((1, 2)), 1.0, {})
    scene = making.scene(np.random.default_rng(0), world, push, 1.0, found, options={"order": 6})
    good = dmoc.solve(scene.problem, order=6)

    def backwards(t):
        return [1.05 * np.cos(t), -1.05 * np.sin(t)]

    bad = dmoc.solve(scene.problem, order=6, guess=backwards)
    assert bad.success
    assert bad.objective > 2 * good.objective
    assert rivals.cheapest(scene, bad) == pytest.approx(bad.objective / good.objective, rel=1e-3)
    assert rivals.cheapest(scene, good) == 1.0
