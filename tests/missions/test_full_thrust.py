"""Missions along a line whose engines always burn: each thrust can point but one way or the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from dmoc import (
    Drop,
    Engine,
    FinalHeight,
    FinalMass,
    Free,
    Leg,
    Mission,
    State,
    Time,
    TransferProblem,
    UniformGravity,
    solve,
    verify,
)

EXHAUST = 100.0  # m/s


def engine(thrust):
    return Engine(thrust, exhaust_velocity=EXHAUST, min_thrust=thrust)


def climbed(mass, speed, thrust, time):
    """How far a rocket in empty space gets, its speed and its mass: Tsiolkovsky's equation and its integral."""
    flow = thrust / EXHAUST
    left = mass - flow * time
    way = speed * time + EXHAUST * (time - left / flow * np.log(mass / left))
    return way, speed + EXHAUST * np.log(mass / left), left


def test_both_stages_push_upwards_though_the_guess_stands_still():
    legs = [Leg(2.0, actuator=engine(50.0)), Drop(1.0), Leg(2.0, actuator=engine(20.0))]
    mission = Mission(10.0, State((0,), (0,)), Free(), legs, objective=FinalHeight())
    found = solve(mission)
    first, speed, mass = climbed(10.0, 0.0, 50.0, 2.0)
    assert found.objective == pytest.approx(first + climbed(mass - 1.0, speed, 20.0, 2.0)[0], rel=1e-8)
    assert verify(found).ok


def test_a_speed_that_is_asked_for_is_reached_without_a_detour():
    # as in free space, the stage with the shell burns only as long as the other one cannot do without
    legs = [Leg((1.0, 100.0), actuator=engine(20.0)), Drop(1.0), Leg((1.0, 30.0), actuator=engine(10.0))]
    mission = Mission(10.0, State((0,), (0,)), State((None,), (60.0,)), legs, objective=FinalMass())
    found = solve(mission)

    def ended(time):
        _, speed, mass = climbed(10.0, 0.0, 20.0, time)
        return climbed(mass - 1.0, speed, 10.0, 30.0)

    time = brentq(lambda time: ended(time)[1] - 60.0, 1.0, 20.0)
    assert found.legs[0].duration == pytest.approx(time, rel=1e-6)
    assert found.objective == pytest.approx(ended(time)[2], rel=1e-7)


@pytest.mark.parametrize("hold", [False, True])
def test_thrusts_that_point_the_wrong_way_are_turned_round_and_else_told(hold):
    problem = TransferProblem(
        1.0, State((0,), (0,)), Free(), 2.0, actuator=engine(1.0), objective=FinalHeight()
    )
    right = solve(problem, order=4, steps=8, hold=hold)
    assert right.objective == pytest.approx(climbed(1.0, 0.0, 1.0, 2.0)[0], rel=1e-6)
    # at the end alone no force does anything
    assert (right.force[:-1, 0] > 0).all()
    assert verify(right).ok
    path = replace(right.path, control=right.path.control * [-1, 1])
    wrong = replace(right, path=path, force=-right.force)
    check = next(check for check in verify(wrong).checks if check.name == "optimality")
    assert not check.ok
    assert "thrusts along the line point the wrong way" in check.note


def test_a_reversal_between_nodes_is_told_and_is_found_as_two_legs():
    parts = dict(effects=[UniformGravity((-0.3,))], actuator=Engine(1.0, min_thrust=1.0), objective=Time())
    ends = State((0,), (0,)), State((-5,), (0,))
    stuck = solve(TransferProblem(1.0, *ends, (1.0, 20.0), **parts), order=4, steps=10)
    assert "give a Mission with a Leg for each burn" in stuck.message
    found = solve(Mission(1.0, *ends, [Leg((0.1, 20.0)), Leg((0.1, 20.0))], **parts))
    # down with 1.3 m/s^2, then up with 0.7 m/s^2
    assert found.duration == pytest.approx(np.sqrt(2 * 5 * 0.7 / 1.3 / 2.0) * (1 + 1.3 / 0.7), rel=1e-4)
    # The other remedy: an engine that may throttle coasts a moment where it turns.
    other = solve(TransferProblem(1.0, *ends, (1.0, 20.0), **parts | {"actuator": Engine(1.0)}))
    assert other.success and verify(other).ok
    assert other.duration == pytest.approx(found.duration, rel=1e-3)
