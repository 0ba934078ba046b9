"""A start or a goal on the edge of a limit, with a velocity that leads beyond it, is refused in one line."""

import numpy as np
import pytest

from dmoc import (
    Attitude,
    BallTorque,
    Impulse,
    KeepIn,
    KeepOut,
    Leg,
    Mission,
    PointingKeepOut,
    State,
    TransferProblem,
    Via,
    rotation,
)

ROUND = [KeepOut((2, 0), 1.0)]
BOX = [KeepIn((-5, -5), (5, 0))]
FAR = State((4, 0), (0, 0))
ASIDE = [Leg(4.0), Via((2, 1.5)), Leg(4.0)]


def transfer(start, goal, constraints, **more):
    return TransferProblem(1.0, start, goal, 8.0, constraints=constraints, **more)


def mission(start, goal, legs, constraints=ROUND):
    return Mission(1.0, start, goal, legs, constraints=constraints)


def turn(rate):
    """A telescope on the edge of a cone to keep out of, that turns about z at the start [rad/s]."""
    start = Attitude(rotation((0, 0, 1), 30), (0, 0, rate))
    cone = PointingKeepOut((1, 0, 0), (1, 0, 0), 30.0)
    goal = Attitude(rotation((0, 0, 1), 120))
    body = {"actuator": BallTorque(5.0), "inertia": np.eye(3)}
    return TransferProblem(2.0, start, goal, 6.0, constraints=[cone], **body)


REFUSED = {
    "into a zone": lambda: transfer(State((1, 0), (0.5, 0)), FAR, ROUND),
    "slowly and aslant": lambda: transfer(State((1, 0), (1e-3, 1.0)), FAR, ROUND),
    "out of a box": lambda: transfer(State((0, 0), (0, 1)), State((1, -1), (0, 0)), BOX),
    "a cone": lambda: turn(-0.1),
}


@pytest.mark.parametrize("name", ["into a zone", "slowly and aslant", "out of a box", "a cone"])
def test_no_path_goes_on_from_there(name):
    with pytest.raises(
        ValueError, match=r"^start is on the edge of \w+ \(constraint 1\) and goes on beyond it"
    ):
        REFUSED[name]()


def test_a_mission_names_the_leg():
    with pytest.raises(ValueError, match=r"^leg 1: start is on the edge .* or turn its velocity"):
        mission(State((1, 0), (0.5, 0)), FAR, ASIDE)
    with pytest.raises(ValueError, match=r"^leg 2: goal is on the edge .* and comes from beyond it"):
        mission(State((0, 0), (0, 0)), State((3, 0), (0.5, 0)), ASIDE)


def test_a_goal_in_a_zone_counts_by_the_limits_of_its_own_leg():
    """The first leg keeps away from where the last one ends."""
    legs = [Leg(4.0), Via((2, 1.5)), Leg(4.0, constraints=())]
    mission(State((0, 0), (0, 0)), State((2, 0), (0, 0)), legs)
    with pytest.raises(ValueError, match=r"^leg 2: goal breaks KeepOut \(constraint 1\) by 1 m"):
        mission(State((0, 0), (0, 0)), State((2, 0), (0, 0)), ASIDE)


def test_other_states_on_an_edge_are_good():
    transfer(State((1, 0), (-0.5, 0)), FAR, ROUND)
    # Along the edge the path needs a force, but a finite one.
    transfer(State((1, 0), (0, 1.0)), FAR, ROUND)
    transfer(State((1, 0), (0, 0)), FAR, ROUND)
    # A goal is reached from outside, and an impulse turns the velocity at once.
    transfer(State((0, 0), (0, 0)), State((1, 0), (0.5, 0)), ROUND)
    mission(State((1, 0), (0.5, 0)), FAR, [Impulse(limit=2.0), *ASIDE])
    turn(0.1)
