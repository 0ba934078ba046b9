"""A target that moves is met at a time and place of the optimisation's choosing."""

import math

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from dmoc import (
    BallForce,
    BoxForce,
    ClohessyWiltshire,
    Effort,
    Moving,
    PointGravity,
    State,
    Time,
    TransferProblem,
    solve,
)
from dmoc.checks.verification import verify


def line(place, speed):
    return lambda t: [p + s * t for p, s in zip(place, speed, strict=True)]


def test_least_time_to_a_cart_that_drives_away():
    """Seen from the cart: from -d at speed -w to rest, T = w + 2 sqrt(w^2/2 + d) with unit mass and force."""
    problem = TransferProblem(
        1.0, State([0], [0]), Moving(line([1.0], [0.5])), (0.1, 20), actuator=BoxForce(1.0), objective=Time()
    )
    solution = solve(problem, steps=400).raise_for_status()
    assert solution.objective == pytest.approx(0.5 + 2 * math.sqrt(0.125 + 1), rel=1e-4)
    assert solution.position[-1, 0] == pytest.approx(1 + 0.5 * solution.duration, rel=1e-10)
    assert solution.path.goal_velocity[0] == pytest.approx(0.5, rel=1e-10)


@pytest.mark.parametrize("velocity", ["matched", None])
def test_time_and_effort_to_a_moving_point_in_space(velocity):
    """Seen from the target the motion is free: x = -d, v = -w, and the least effort is known for every T."""
    place, speed = np.array([3.0, -1.0, 2.0]), np.array([0.2, 0.5, -0.3])

    def cost(duration):
        lead = place + speed * duration
        if velocity is None:
            return duration + 1.5 * lead @ lead / duration**3
        rest = 6 * lead @ lead / duration**3 - 6 * lead @ speed / duration**2 + 2 * speed @ speed / duration
        return duration + rest

    best = minimize_scalar(cost, bounds=(0.5, 20), method="bounded", options={"xatol": 1e-10})
    problem = TransferProblem(
        1.0,
        State((0, 0, 0), (0, 0, 0)),
        Moving(line(place, speed), velocity),
        (0.1, 50.0),
        objective=Time() + Effort(),
    )
    solution = solve(problem, order=6, steps=4).raise_for_status()
    assert solution.objective == pytest.approx(best.fun, rel=1e-9)
    assert solution.duration == pytest.approx(best.x, rel=1e-5)


def test_a_point_that_stands_still_is_a_state():
    effects = [ClohessyWiltshire(0.0011)]
    start = State((100.0, -50.0, 20.0), (0, 0, 0))
    goals = (State((5.0, 0, 0), (0, 0, 0)), Moving(lambda t: [5.0, 0.0, 0.0]))
    still, moving = (
        solve(TransferProblem(10.0, start, goal, 900.0, effects=effects), steps=50).raise_for_status()
        for goal in goals
    )
    assert moving.objective == pytest.approx(still.objective, rel=1e-9)
    np.testing.assert_allclose(moving.position, still.position, rtol=0, atol=1e-6)


def test_a_start_may_move_too():
    """At the start time, which is given."""
    problem = TransferProblem(1.0, Moving(line([1.0], [2.0])), State([4.0], [0.0]), 3.0, start_time=1.0)
    solution = solve(problem, steps=20).raise_for_status()
    assert solution.position[0, 0] == pytest.approx(3.0, rel=1e-10)
    assert solution.path.start_velocity[0] == pytest.approx(2.0, rel=1e-10)


@pytest.mark.parametrize("phase", [0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
def test_rendezvous_with_a_circling_target_in_the_least_time(phase):
    """The body arrives on the target, at full thrust all the way, from the default guess."""
    rate = 1.5**-1.5
    target = Moving(lambda t: [1.5 * ca.cos(rate * t + phase), 1.5 * ca.sin(rate * t + phase)])
    problem = TransferProblem(
        1.0,
        State((1, 0), (0, 1)),
        target,
        (1.0, 20.0),
        effects=[PointGravity(1.0)],
        actuator=BallForce(0.1),
        objective=Time(),
    )
    solution = solve(problem, steps=400).raise_for_status()
    place, speed = target.estimate(solution.duration)
    np.testing.assert_allclose(solution.position[-1], place, rtol=0, atol=1e-8)
    np.testing.assert_allclose(solution.path.goal_velocity, speed, rtol=0, atol=1e-8)
    full = np.linalg.norm(solution.force, axis=1) > 0.0999
    assert solution.duration < 10, "one revolution more takes 15.8 s where 6.23 s is enough"
    assert full.mean() > 0.98, "the thrust may turn round in a node or two, and is full elsewhere"
    report = verify(solution)
    assert report["reference"].ok and report["optimality"].ok


def test_kilometres_take_the_same_iterations():
    def fly(unit):
        place, speed = np.array([3e4, -1e4]) * unit, np.array([20.0, 50.0]) * unit
        goal, limit = Moving(line(place, speed)), BoxForce(2.0 * unit)
        problem = TransferProblem(1.0, State((0, 0), (0, 0)), goal, 300.0, actuator=limit)
        return solve(problem, steps=100).raise_for_status()

    metres, kilometres = fly(1.0), fly(1e-3)
    assert metres.iterations == kilometres.iterations
    assert kilometres.objective == pytest.approx(1e-6 * metres.objective, rel=1e-8)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: Moving((1, 2)), "State"),
        (lambda: Moving(lambda t: [t], velocity=(1, 2)), "matched"),
        (lambda: Moving(lambda t: [t, t], velocity=lambda t: [t]), "same"),
        (lambda: Moving(lambda t: [t, t, t, t]), "1 to 3"),
    ],
)
def test_motions_without_a_meaning_are_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()
