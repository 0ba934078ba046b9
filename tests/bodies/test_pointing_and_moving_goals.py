"""Signs and sizes of what turns a body: cones in degrees, thrusters on arms, goals that move."""

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    Attitude,
    Moving,
    PointingKeepIn,
    PointingKeepOut,
    Thrusters,
    Torque,
    TransferProblem,
    rotation,
    solve,
)

REST = Attitude((1, 0, 0, 0))


@pytest.mark.parametrize("turned", [0.0, 50.0, 130.0])
def test_the_excess_of_a_cone_is_an_angle(turned):
    q, w = np.array([rotation((0, 0, 1), turned)]), np.zeros((1, 3))
    inside, outside = (cone((1, 0, 0), (1, 0, 0), 60) for cone in (PointingKeepIn, PointingKeepOut))
    assert inside.excess(q, w) == pytest.approx([max(0.0, turned - 60)], abs=1e-9)
    assert outside.excess(q, w) == pytest.approx([max(0.0, 60 - turned)], abs=1e-9)


def test_a_goal_outside_a_cone_to_stay_in_is_refused():
    goal, cone = Attitude(rotation((0, 0, 1), 50)), PointingKeepIn((1, 0, 0), (1, 0, 0), 20)
    with pytest.raises(ValueError, match=r"goal breaks PointingKeepIn .* by 30 degrees"):
        TransferProblem(1.0, REST, goal, 4.0, inertia=(1, 2, 2.5), actuator=Torque(), constraints=[cone])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_goal_that_moves_is_reached_the_shorter_way_whatever_its_sign(sign):
    """It is 60 degrees away and turns on to 80 while it is reached."""

    def attitude(t):
        half = (60 + 5 * t) * np.pi / 360
        return sign * ca.vertcat(ca.cos(half), 0, 0, ca.sin(half))

    goal = Moving(None, attitude=attitude)
    found = solve(
        TransferProblem(1.0, REST, goal, 4.0, inertia=(1, 2, 2.5), actuator=Torque()), order=4, steps=12
    )
    assert found.success and np.degrees(found.path.turn) == pytest.approx(80, abs=1)


@pytest.mark.parametrize(
    ("place", "way", "torque"),
    [((2, 0, 0), (0, 1, 0), (0, 0, 6)), ((0, 0, 1), (1, 0, 0), (0, 3, 0)), ((0, 2, 0), (0, 0, -1), (-6, 0, 0))],
)
def test_a_thruster_turns_the_body_as_its_arm_says(place, way, torque):
    """r x F with F = 3 N: one in front that pushes to the left turns the body to the left."""
    force, turning = Thrusters([place], [way], 5.0).wrench(ca.DM.eye(3), ca.DM([3.0]))
    assert force.full().ravel() == pytest.approx(3 * np.array(way))
    assert turning.full().ravel() == pytest.approx(torque)
