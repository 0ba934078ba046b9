"""Where Ipopt's steps have become as small as rounding, an answer is one whose rows hold up to rounding."""

import pytest

from dmoc import BallForce, State, TransferProblem, transcribe
from dmoc.ipopt.options import rounding
from dmoc.ipopt.run import SETTLED, _is_settled
from dmoc.nlp.units import LEAST_SHARE

HOLDS = {"inf_pr": [1.0, 3e-10], "inf_du": [1.0, 4e-16], "mu": [1e-6, 5e-13]}


def test_rows_that_hold_up_to_rounding_are_an_answer():
    assert _is_settled(HOLDS, 1e-9)
    assert not _is_settled(HOLDS, 1e-10)


@pytest.mark.parametrize("name", ["inf_du", "mu"])
def test_what_is_no_optimum_is_none(name):
    assert not _is_settled(HOLDS | {name: [0.0, 2 * SETTLED]}, 1e-9)


def test_it_is_larger_where_forces_are_small_beside_the_motion_in_any_unit_of_time():
    """The unit of force is a limit, but no less than a share of what moves the body over its path."""
    found = []
    for time in (1e-4, 1.0, 1e4):
        ends = State((0, 0), (1 / time, 0)), State((1000, 0.1), (1 / time, 0))
        scene = TransferProblem(2.0, *ends, 1000 * time, actuator=BallForce(1e-6 / time**2))
        program = transcribe(scene, 20)
        found.append(program._rounding / rounding(program.mesh, program.scheme.degree))
    assert found == pytest.approx(3 * [1 / LEAST_SHARE])
