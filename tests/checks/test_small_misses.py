"""Misses that are small beside the wrong scale are seen beside the right one."""

from dataclasses import replace

import numpy as np
import pytest

from dmoc import Attitude, BallForce, Effort, State, Torque, TransferProblem, rotation, solve, verify
from dmoc.checks.optimality import idle
from dmoc.nlp.layout import Layout


@pytest.mark.parametrize("duration", [0.01, 1000.0])
def test_a_rate_at_the_goal_is_judged_by_the_rates_along_the_path(duration):
    """A part of 1e-7 of the rate, whether that is 200 rad/s or 0.002 rad/s."""
    ends = Attitude((1, 0, 0, 0)), Attitude(rotation((0, 0, 1), 60))
    found = solve(TransferProblem(1.0, *ends, duration, inertia=(1, 2, 3), actuator=Torque()), steps=20)
    assert verify(found)["bounds"].ok
    goal = found.path.goal_velocity + 1e-7 * np.abs(found.rate).max()
    broken = replace(found, path=replace(found.path, goal_velocity=goal))
    assert not verify(broken)["bounds"].ok


def test_a_multiplier_away_from_its_limit_counts_by_the_time_of_its_node():
    """As a density: the same product at a node of half the time is twice as much."""
    layout = Layout().add("force", "node", ["x"], 4, np.ones((4, 1)))
    at, low, high = np.zeros(4), -np.ones(4), np.ones(4)
    parts = np.array([0.1, 0.4, 0.4, 0.1])
    multipliers = np.array([0.0, 0.02, 0.0, 0.0])
    assert idle(layout, multipliers, at, low, high, weights={"node": parts}) == pytest.approx(0.02 / 0.4)


@pytest.mark.parametrize(
    ("duration", "limit"), [(999.995, "longest"), (999.9, None), (0.1, "shortest"), (0.1001, None)]
)
def test_a_duration_sits_on_a_limit_within_a_small_part_of_itself(duration, limit):
    """The barrier leaves some 1e-6 of it; a limit of 0.1 s is no part of one of 1000 s."""
    ends = State((0, 0), (0, 0)), State((2, 0), (0, 0))
    scene = TransferProblem(1.0, *ends, (0.1, 1000.0), actuator=BallForce(1.0), objective=Effort())
    assert scene.limit_of_duration(duration) == limit
