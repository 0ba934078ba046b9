"""Several starts find the optima that one misses."""

import numpy as np
import pytest

from dmoc import solve
from dmoc.scene.problem_file import load_problem
from dmoc.solver.starts import local_optima


def test_the_free_flyer_has_a_better_path_on_the_other_side():
    problem = load_problem("free_flyer").make()
    found = local_optima(problem, 6)
    objectives = [optimum.objective for optimum in found]
    assert objectives == sorted(objectives) and len(found) >= 2
    assert solve(problem).objective == pytest.approx(0.86242, rel=2e-4)
    assert solve(problem, guess=found[0].path).objective == pytest.approx(0.83690, rel=2e-4)
    assert sum(len(optimum.starts) for optimum in found) == 6


def test_other_revolutions_are_other_optima():
    found = local_optima(load_problem("orbit_raise").make(), 3)
    assert len(found) >= 2
    assert found[0].objective < 1.7e-3  # on the coarse mesh 0.35 % above the optimum of 1.69032e-3
    assert found[-1].objective > 50 * found[0].objective


def test_the_same_starts_are_drawn_every_time():
    problem = load_problem("point_to_point").make()
    first, second = (local_optima(problem, 4) for _ in range(2))
    assert [len(first), len(second)] == [1, 1]
    assert np.array_equal(first[0].path.position, second[0].path.position)
