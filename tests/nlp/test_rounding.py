"""Where Ipopt's steps have become as small as rounding, an answer is one whose rows hold up to rounding."""

import pytest

from dmoc.ipopt.run import SETTLED, _is_settled

HOLDS = {"inf_pr": [1.0, 3e-10], "inf_du": [1.0, 4e-16], "mu": [1e-6, 5e-13]}


def test_rows_that_hold_up_to_rounding_are_an_answer():
    assert _is_settled(HOLDS, 1e-9)
    assert not _is_settled(HOLDS, 1e-10)


@pytest.mark.parametrize("name", ["inf_du", "mu"])
def test_what_is_no_optimum_is_none(name):
    assert not _is_settled(HOLDS | {name: [0.0, 2 * SETTLED]}, 1e-9)
