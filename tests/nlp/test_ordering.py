"""Large systems are ordered with a look for dense rows: a free duration stands in every row of motion."""

import re

import pytest

from dmoc import PointGravity, State, TransferProblem, solve

TOLD = {"ipopt.mumps_print_level": 2}


@pytest.mark.parametrize("steps", [4000, 8000])
def test_fronts_of_a_free_duration_do_not_grow_with_the_mesh(steps, capfd):
    """The largest block that is eliminated at once; here it has 21 rows, by METIS 35 and more."""
    goal = State((0, 1.2), (-0.91, 0))
    problem = TransferProblem(1.0, State((1, 0), (0, 1)), goal, (6.0, 12.0), [PointGravity(1.0)])
    solve(problem, 2, steps, options=TOLD).raise_for_status()
    fronts = re.findall(r"Maximum front size\s*=\s*(\d+)", capfd.readouterr().out)
    assert fronts and max(map(int, fronts)) <= 25
