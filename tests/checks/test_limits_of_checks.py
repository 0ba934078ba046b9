"""By what the checks judge: their limits grow with the scene as they say."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    Attitude,
    BallForce,
    Engine,
    Moving,
    State,
    Torque,
    TransferProblem,
    UniformGravity,
    rotation,
    solve,
    verify,
)
from dmoc.checks.balances import balance
from dmoc.checks.evidence import Evidence
from dmoc.checks.limits import excesses


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


def test_of_what_is_no_number_nothing_is_allowed():
    found = solve(TransferProblem(1.0, State((0.0,), (0.0,)), State((1.0,), (0.0,)), 2.0), steps=4)
    position = found.path.position.copy()
    position[2] = np.nan
    report = verify(replace(found, path=replace(found.path, position=position)))
    assert all((check.ok, check.limit) == (False, 0.0) and np.isinf(check.value) for check in report.checks)


def test_a_condition_at_the_goal_may_be_missed_by_a_millionth_of_the_path():
    """In metres of its extent, in metres per second of its speed."""

    def target(t):
        return ca.vertcat(300 + 5 * t, 400)

    start, actuator = State((0.0, 0.0), (0.0, 0.0)), BallForce(500.0)
    evidence = Evidence(solve(TransferProblem(1.0, start, Moving(target), 4.0, actuator=actuator), steps=8))
    allowed = {one.name: one.allowed for one in excesses(evidence)}
    assert allowed["goal position.x"] == pytest.approx(1e-6 * evidence.extent)
    assert allowed["goal velocity.y"] == pytest.approx(1e-6 * evidence.speed)


def test_the_dry_mass_is_judged_by_what_is_missing_of_it():
    engine = Engine(5.0, exhaust_velocity=30.0, dry_mass=0.5)
    ends = State((0.0,), (0.0,)), State((1.0,), (0.0,))
    found = solve(TransferProblem(1.0, *ends, 3.0, actuator=engine), steps=10)
    (dry,) = [one for one in excesses(Evidence(found)) if one.name == "dry mass"]
    assert dry.value == 0
    mass = found.path.mass.copy()
    mass[-1] = 0.45
    spent = replace(found, path=replace(found.path, mass=mass))
    (dry,) = [one for one in excesses(Evidence(spent)) if one.name == "dry mass"]
    assert dry.value == pytest.approx(0.05) and dry.value > dry.allowed


def test_far_from_the_origin_rounding_is_allowed_for():
    """Ten rounding errors of the position, over the square of the step, make a force."""
    far, steps, duration = 1e9, 100, 1.0
    ends = State((far,), (1.0,)), State((far + 1.0,), (1.0,))
    check = verify(solve(TransferProblem(1.0, *ends, duration), steps=steps))["residual"]
    assert check.limit == pytest.approx(10 * np.finfo(float).eps * far * (steps / duration) ** 2, rel=1e-3)


def test_a_torque_that_the_angular_momentum_does_not_show_breaks_its_balance():
    ends = Attitude((1, 0, 0, 0)), Attitude(rotation((1, 2, 1), 90))
    found = solve(TransferProblem(1.0, *ends, 4.0, inertia=(1, 2, 2.5), actuator=Torque()), order=4, steps=10)
    assert balance(Evidence(found))[0] < 1e-10
    control = found.path.control.copy()
    control[7] += 1e-4
    assert balance(Evidence(replace(found, path=replace(found.path, control=control))))[0] > 1e-6


def floored(time):
    """A hop far from the origin, where the rounding of positions sets the limit of the rollout."""
    far, speed = 1e8, 1.0 / time
    ends = State((far, 0.0), (0.1 * speed, 0.0)), State((far + 4.0, 1.0), (0.0, 0.0))
    pull = UniformGravity((0.0, -0.3 / time**2))
    return solve(TransferProblem(2.0, *ends, 4.0 * time, effects=[pull]), mesh=(0, 0.2, 0.5, 1))


def test_the_limit_of_the_rollout_is_the_same_in_any_unit_of_time():
    """It is a part of the path: rounding over its extent, and over the time of a step over its speed."""
    checks = [verify(solution)["rollout"] for solution in map(floored, (1e-4, 1.0, 1e4))]
    assert all(check.ok for check in checks)
    np.testing.assert_allclose([check.limit for check in checks], checks[1].limit, rtol=1e-3)


def test_the_limit_of_the_rollout_knows_how_short_steps_are_and_how_large_the_path():
    """The rounding of a place over the extent, and over the shortest time between nodes, over the speed."""
    solution = floored(1.0)
    evidence = Evidence(solution)
    assert evidence.shortest == pytest.approx(0.2 * 4.0)
    # What the path amplifies, and turning by the acceleration, adds less than a fifth.
    rounding = evidence.rounding * (1 / evidence.extent + 1 / (0.8 * evidence.speed))
    assert verify(solution)["rollout"].limit == pytest.approx(rounding, rel=0.2)
