"""A mission that cannot be met: which leg or impulse is to blame, and what would be enough."""

from __future__ import annotations

import re
from decimal import Decimal

import numpy as np
import pytest

import dmoc
from dmoc import (
    BallForce,
    CircularOrbit,
    Coast,
    DeltaV,
    Drop,
    Free,
    Impulse,
    KeepOut,
    Leg,
    Mission,
    Periodic,
    PointGravity,
    State,
    Via,
    solve,
)
from dmoc.scene.problem_file import load_problem

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
    assert "the via 2 position y at joint 1 is missed by 1 m" in failed.message


@pytest.mark.slow
def test_what_was_asked_stands_in_the_ladder():
    failed = solve(gates(3.0))
    assert [level.question for level in failed.ladder if level.question]
    assert all(level.status for level in failed.ladder)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"sums": None}, "sums must be a sequence"),
        ({"sums": [1]}, "sums: each must be"),
        ({"sums": [(0, 5, 1.0)]}, "there are 2; got 0 and 5"),
        ({"sums": [(1, 0, 1.0)]}, "the first before the last"),
        ({"sums": [(0, 1, -1.0)]}, "sums: duration must be greater than 0"),
        ({"legs": [Leg(1.0), Drop(0.6), Leg(1.0), Drop(0.4)]}, "Drop leaves 1 kg behind in all"),
        ({"start": Periodic(2)}, "start cannot be Periodic"),
    ],
)
def test_what_can_never_be_flown_is_refused_when_the_mission_is_made(change, told):
    parts = dict(mass=1.0, start=Free(2), goal=State((1, 0), (0, 0)), legs=[Leg(1.0), Leg(1.0)])
    with pytest.raises(ValueError, match=re.escape(told)):
        Mission(**(parts | change))


def test_a_duration_is_checked_by_its_leg_and_may_be_any_kind_of_number():
    with pytest.raises(ValueError, match=re.escape("Leg: duration must be greater than 0 [s]; got -1")):
        Leg(-1)
    with pytest.raises(ValueError, match="its shortest must be less than its longest"):
        Leg((2.0, 1.0))
    assert Leg(Decimal("1.5")).duration == 1.5
    assert Leg(np.array([1, 2])).duration == (1.0, 2.0)
    with pytest.raises(ValueError, match="Coast: there is no actuator in a coast"):
        Coast(1.0, actuator=np.array([1, 2]))


def test_a_problem_file_must_not_return_a_class(tmp_path):
    file = tmp_path / "made.py"
    file.write_text("from dmoc import Mission\n\n\ndef problem():\n    return Mission\n")
    with pytest.raises(ValueError, match=r"problem\(\) must return a dmoc\.TransferProblem"):
        load_problem(str(file)).make()


def test_what_a_coast_cannot_meet_is_told_in_plain_words():
    ends = State((0, 0), (1, 0)), State((10, 1), (1, 0))
    failed = solve(Mission(1.0, *ends, [Coast(4.0), Coast(6.0)]))
    assert not failed.success
    assert failed.message.startswith(
        "coast 1 and coast 2 cannot be steered, and not all that is asked can hold"
    )
    assert failed.message.endswith("the position y at the goal is missed by 1 m")


def test_the_zone_in_the_way_of_a_coast_is_named():
    ends = State((0, 0), (1, 0)), State((10, 0), (1, 0))
    legs = [Coast(4.0), Leg(2.0, actuator=BallForce(1.0)), Coast(4.0)]
    failed = solve(Mission(1.0, *ends, legs, constraints=[KeepOut((2, 0.5), 1.0)]))
    said = re.search(r"keep-out 1 of at most ([\d.]+) m radius \(you gave 1 m\) in coast 1", failed.message)
    assert not failed.success and said, failed.message
    assert 0.45 < float(said[1]) <= 0.5


def test_a_closed_coast_around_an_attractor_begins_with_a_circle():
    found = solve(Mission(1.0, Free(2), Periodic(), [Coast(6.0)], [PointGravity(1.0)]))
    assert found.success and dmoc.verify(found).ok
    # Kepler: one revolution, a = (mu (T / 2 pi)^2)^(1/3).
    radius, speed = np.linalg.norm(found.position[0]), np.linalg.norm(found.legs[0].velocity[0])
    assert 1 / (2 / radius - speed**2) == pytest.approx((6.0 / (2 * np.pi)) ** (2 / 3), rel=1e-4)
