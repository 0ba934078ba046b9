"""By what the checks judge: their limits grow with the scene as they say."""

import pytest

from dmoc import State, TransferProblem, UniformGravity, solve, verify
from dmoc.checks.evidence import Evidence


@pytest.mark.parametrize("mass", [1.0, 3.0])
@pytest.mark.parametrize("speed", [2.0, 20.0])
def test_the_residual_of_a_coast_is_judged_by_the_force_that_would_stop_it(speed, mass):
    """A millionth of a thousandth of m v / T, where no force acts and none has a limit."""
    duration = 4.0
    problem = TransferProblem(mass, State((0.0,), (speed,)), State((speed * duration,), (speed,)), duration)
    check = verify(solve(problem, steps=4))["residual"]
    assert check.ok and check.limit == pytest.approx(1e-9 * mass * speed / duration, rel=1e-3)


@pytest.mark.parametrize("duration", [0.5, 8.0])
def test_a_body_that_hovers_is_judged_by_the_way_that_its_forces_could_move_it(duration):
    """A billionth of a T^2 in place of the extent of its path, which is nothing."""
    still = State((0.0, 0.0), (0.0, 0.0))
    problem = TransferProblem(1.0, still, still, duration, effects=[UniformGravity((0, -9.81))])
    assert Evidence(solve(problem, steps=4)).extent == pytest.approx(1e-9 * 9.81 * duration**2, rel=1e-6)
