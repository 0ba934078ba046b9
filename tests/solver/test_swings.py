"""A free time in which the motion or the goal swings: each swing may hold an optimum, and the best is found.

Least effort without a limit has closed forms in each duration, of which the least one is taken here.
"""

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    BallForce,
    Moving,
    RotatingFrame,
    Spring,
    State,
    TransferProblem,
    UniformGravity,
    solve,
    verify,
)
from dmoc.guess.open_ends import swings

TURNED = np.array([[0.0, -1.0], [1.0, 0.0]])


def between(start, goal, duration):
    """Least effort of 1 kg between ends (place, velocity), nothing acting (Bryson & Ho 1975, section 5.2)."""
    (q0, v0), (q1, v1) = (np.array(end, float) for end in (start, goal))
    w, d = v1 - v0, q1 - q0 - v0 * duration
    return 6 * d @ d / duration**3 - 6 * d @ w / duration**2 + 2 * w @ w / duration


def in_a_turning_frame(duration):
    """From rest to rest in a frame that turns at 1 rad/s, seen from space."""
    turn = np.cos(duration) * np.eye(2) + np.sin(duration) * TURNED
    start, goal = np.array([1.0, 0.0]), turn @ [-0.5, 1.0]
    return between((start, TURNED @ start), (goal, TURNED @ goal), duration)


def to_a_swinging_goal(duration):
    goal = [2 + 1.5 * np.sin(1.3 * duration)], [1.95 * np.cos(1.3 * duration)]
    return between(([0.0], [0.0]), goal, duration)


def to_a_circling_goal(duration):
    sine, cosine = np.sin(1.3 * duration), np.cos(1.3 * duration)
    return between(([0, 0], [0, 0]), ([2 + 1.5 * sine, 1.5 * cosine], [1.95 * cosine, -1.95 * sine]), duration)


def on_a_spring(duration):
    """From (1, 0) to (0, 0.5) on a spring of 1 N/m, by the Gramian in closed form."""
    s, c, T = np.sin(duration), np.cos(duration), duration
    gramian = 0.5 * np.array([[T - s * c, s * s], [s * s, T + s * c]])
    miss = np.array([0.0 - c, 0.5 + s])
    return 0.5 * miss @ np.linalg.solve(gramian, miss)


REST = State((0.0, 0.0), (0.0, 0.0))
SCENES = {
    "turning frame": (
        in_a_turning_frame,
        15.0,
        TransferProblem(
            1.0, State((1, 0), (0, 0)), State((-0.5, 1), (0, 0)), (0.5, 15.0), effects=[RotatingFrame(1.0)]
        ),
    ),
    "swinging goal": (
        to_a_swinging_goal,
        14.0,
        TransferProblem(
            1.0, State((0.0,), (0.0,)), Moving(lambda t: 2 + 1.5 * ca.sin(1.3 * t), "matched"), (0.5, 14.0)
        ),
    ),
    "circling goal": (
        to_a_circling_goal,
        8.0,
        TransferProblem(
            1.0,
            REST,
            Moving(lambda t: ca.vertcat(2 + 1.5 * ca.sin(1.3 * t), 1.5 * ca.cos(1.3 * t)), "matched"),
            (0.5, 8.0),
            actuator=BallForce(3.0),
        ),
    ),
    "spring": (
        on_a_spring,
        12.0,
        TransferProblem(
            1.0,
            State((1.0,), (0.0,)),
            State((0.0,), (0.5,)),
            (1.0, 12.0),
            effects=[Spring(1.0, (0.0,))],
            actuator=BallForce(2.0),
        ),
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_of_all_swings_the_best_is_found(name):
    """The first optimum that was found cost 1.8, 48, 1.0 and 2.3 times as much, every check green."""
    cost, longest, problem = SCENES[name]
    shortest = problem.duration_bounds[0]
    least = min(cost(duration) for duration in np.linspace(shortest, longest, 20000))
    solution = solve(problem).raise_for_status()
    assert solution.objective == pytest.approx(least, rel=2e-3)
    assert verify(solution).ok
    # What was tried is told.
    assert any(level.question for level in solution.ladder)


def test_what_does_not_swing_is_solved_at_once():
    falling = TransferProblem(
        1.0,
        State((0.0, 5.0), (1.0, 0.0)),
        State((3.0, 0.0), (0.0, 0.0)),
        (0.5, 12.0),
        [UniformGravity((0, -1))],
    )
    assert swings(falling) == 0.0
    assert not any(level.question for level in solve(falling).ladder)


def test_swings_of_a_spring_and_of_a_goal_are_counted_in_their_time():
    assert swings(SCENES["spring"][2]) == pytest.approx(1 / (2 * np.pi))
    # Turning points are half a swing apart, and no more than one is lost at the ends.
    assert swings(SCENES["swinging goal"][2]) == pytest.approx(1.3 / (2 * np.pi), abs=0.5 / 13.5)


def test_a_coast_that_costs_nothing_meets_a_tolerance():
    """After half a swing the body is where it is wanted; changes of an effort of 1e-31 are no errors."""
    half = TransferProblem(
        1.0,
        State((1.0,), (0.0,)),
        State((-1.0,), (0.0,)),
        (1.0, 12.0),
        effects=[Spring(1.0, (0.0,))],
        actuator=BallForce(2.0),
    )
    solution = solve(half, tol=1e-5, order=8).raise_for_status()
    assert solution.objective < 1e-20 and len(solution.ladder) < 30
