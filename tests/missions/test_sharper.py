"""With far more thrust than it needs a mission, or a team, pays for what moves it and not for rounding |F|."""

import math

import pytest

from dmoc import Apart, Engine, Fuel, Leg, Mission, State, Team, TransferProblem, Via, load, solve, verify

EXHAUST = 100.0


def on_two_legs(thrust):
    """From rest to rest past a place, in free space."""
    return Mission(
        1.0,
        State((0, 0), (0, 0)),
        State((1, 0.5), (0, 0)),
        [Leg(duration=2.0), Via((0.4, 0.3)), Leg(duration=2.0)],
        actuator=Engine(thrust, exhaust_velocity=EXHAUST, dry_mass=0.1),
        objective=Fuel(),
    )


def least_fuel():
    """That of impulses [kg]: both speeds are given by the places and times."""
    first, second = (0.2, 0.15), (0.3, 0.1)
    change = math.hypot(*first) + math.dist(first, second) + math.hypot(*second)
    return -math.expm1(-change / EXHAUST)


@pytest.mark.parametrize("thrust", [100.0, 1000.0])
def test_a_thrust_far_above_the_need_is_not_paid_for(thrust, tmp_path):
    solution = solve(on_two_legs(thrust), order=4, steps=30).raise_for_status()
    assert verify(solution).ok
    assert solution.objective == pytest.approx(least_fuel(), rel=2e-3)
    solution.save(tmp_path / "found.nc")
    assert verify(load(tmp_path / "found.nc").attach(on_two_legs(thrust))).ok


def test_where_little_is_paid_nothing_is_solved_again():
    solution = solve(on_two_legs(1.0), order=4, steps=30).raise_for_status()
    assert {leg.problem.actuator.smoothing for leg in solution.legs} == {Engine(1.0).smoothing}


def on_one(thrust, height=-2):
    """From rest to rest over 1 m, which takes impulses of 0.25 m/s at least."""
    ends = State((0, height), (0, 0)), State((1, height), (0, 0))
    engine = Engine(thrust, exhaust_velocity=EXHAUST, dry_mass=0.1)
    return TransferProblem(1.0, *ends, 4.0, actuator=engine, objective=Fuel())


@pytest.mark.parametrize("legs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_nor_is_it_paid_for_by_a_team(legs, tmp_path):
    alone = -math.expm1(-0.5 / EXHAUST)
    first, least = (on_one(1000.0, 0), alone) if legs == 1 else (on_two_legs(1000.0), least_fuel())
    team = Team([first, on_one(1000.0)], [Apart(0.1)])
    solution = solve(team, order=4, steps=30).raise_for_status()
    assert verify(solution).ok
    assert solution.objective == pytest.approx(least + alone, rel=2e-3)
    solution.save(tmp_path / "found.nc")
    assert verify(load(tmp_path / "found.nc").attach(team)).ok
