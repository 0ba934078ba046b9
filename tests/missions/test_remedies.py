"""A mission that cannot be met: which leg or impulse is to blame, and what would be enough."""

from __future__ import annotations

import re

import pytest

from dmoc import BallForce, CircularOrbit, Coast, DeltaV, Impulse, Leg, Mission, PointGravity, State, Via, solve

# The larger one of the two impulses of Hohmann's transfer from radius 1 to radius 2 with mu = 1.
LARGER = (2 * 2 / 3) ** 0.5 - 1


def gates(limit):
    """From rest over a gate to rest; the second leg has a limit of its own."""
    home = Leg((0.1, 1.1), actuator=BallForce(limit), name="home")
    legs = [Leg((0.1, 1.1)), Via((1, 1)), home]
    ends = State((0, 0), (0, 0)), State((2, 0), (0, 0))
    return Mission(1.0, *ends, legs, duration=1.2, actuator=BallForce(30.0))


def hohmann(limit):
    ends = CircularOrbit(1.0, mu=1.0, center=(0, 0)), CircularOrbit(2.0, mu=1.0)
    legs = [Impulse(limit), Coast((1, 60)), Impulse(limit)]
    return Mission(1.0, *ends, legs, [PointGravity(1.0)], objective=DeltaV())


@pytest.mark.slow
def test_the_force_limit_of_a_leg_is_named_with_one_that_is_enough():
    failed = solve(gates(3.0))
    assert not failed.success and failed.worst
    said = re.search(r"a force limit of ([\d.]+) N \(you gave 3 N\) in home", failed.message)
    assert said, failed.message
    needed = float(said[1])
    assert solve(gates(1.003 * needed)).success
    assert not solve(gates(0.97 * needed)).success


def test_the_limit_of_an_impulse_is_named_with_one_that_is_enough():
    failed = solve(hohmann(0.15))
    said = re.search(r"an impulse of ([\d.]+) m/s at the start \(you gave 0.15 m/s\)", failed.message)
    assert said, failed.message
    assert float(said[1]) == pytest.approx(LARGER, rel=2e-3) and float(said[1]) > LARGER


def test_rows_that_contradict_each_other_are_named_by_joint():
    legs = [Leg(1.0), Via((1, 1)), Via((1, 2)), Leg(1.0)]
    failed = solve(Mission(1.0, State((0, 0), (0, 0)), State((2, 0), (0, 0)), legs))
    assert not failed.success
    assert "cannot be met together: joint 1.via" in failed.message


@pytest.mark.slow
def test_what_was_asked_stands_in_the_ladder():
    failed = solve(gates(3.0))
    assert [level.question for level in failed.ladder if level.question]
    assert all(level.status for level in failed.ladder)
