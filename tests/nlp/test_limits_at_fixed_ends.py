"""At an end that is fixed no unknown is left to meet a limit, so its rows are free there, and there alone."""

import numpy as np
import pytest

from dmoc import Attitude, BallForce, KeepOut, State, Torque, TransferProblem, rotation, transcribe


@pytest.mark.parametrize("free", [None, "start", "goal"])
def test_a_zone_holds_everywhere_but_at_fixed_ends(free):
    ends = {"start": State((0, 0), (0, 0)), "goal": State((4, 0), (0, 0))}
    if free:
        ends[free] = State((ends[free].position[0], None), (0, 0))
    problem = TransferProblem(
        1.0, ends["start"], ends["goal"], 3.0, actuator=BallForce(5.0), constraints=[KeepOut((2, 0.3), 0.5)]
    )
    nlp = transcribe(problem, 8)
    (group,) = [one for one in nlp.rows.groups if one.owner and one.owner.field == "constraints"]
    held = np.isfinite(nlp.bounds(problem)[2][group.indices[0]])
    assert held.tolist() == [free == "start", *[True] * 7, free == "goal"]


def test_the_length_of_a_quaternion_is_asked_for_everywhere_but_at_fixed_ends():
    start, goal = Attitude((1, 0, 0, 0)), Attitude(rotation((0, 0, 1), 40))
    for last, asked in ((goal, False), (Attitude(None), True)):
        problem = TransferProblem(1.0, start, last, 2.0, inertia=(1, 2, 2.5), actuator=Torque())
        nlp = transcribe(problem, 6, 4)
        low, high = (side[nlp.rows["constraint"].indices[0]] for side in nlp.bounds(problem)[2:])
        assert np.isfinite(low).tolist() == [False, *[True] * 11, asked]
        assert (low[1:-1] == high[1:-1]).all()
