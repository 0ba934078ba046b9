"""A limit that is far above what a transfer takes changes nothing but what the limit forbids.

Pass criterion: the optimum without the limit to 1e-6, and every check holds. With the limit for a unit of
force, one of 1e5 N for a transfer that takes 1e-5 N led to half of the best duration and eight times the least
effort.
"""

from dataclasses import replace

import numpy as np
import pytest

from dmoc import (
    Apart,
    Attitude,
    BallForce,
    BoxForce,
    Fuel,
    Leg,
    Mission,
    State,
    Team,
    Torque,
    TransferProblem,
    UniformGravity,
    Via,
    rotation,
    solve,
    verify,
)
from dmoc.scene.problem_file import load_problem
from dmoc.solver import mended

LONGEST = 1000.0
REST = State((0, 0), (0, 0)), State((2, 0), (0, 0))


def hop(limit):
    """From rest to rest over 2 m; least effort 6 (m L)^2 / T^3."""
    return TransferProblem(1.0, *REST, (1.0, LONGEST), actuator=BallForce(limit))


def turn(limit):
    """From rest to rest about a principal axis."""
    ends = Attitude((1, 0, 0, 0)), Attitude(rotation((0, 1, 0), 60))
    body = {"inertia": (12.0, 15.0, 20.0), "actuator": Torque(limit)}
    return TransferProblem(100.0, *ends, (1.0, LONGEST), **body)


def mission(limit):
    """The same way in two legs of half the longest duration."""
    legs = [Leg((1.0, LONGEST / 2)), Via((1, 0)), Leg((1.0, LONGEST / 2))]
    return Mission(1.0, *REST, legs, actuator=BallForce(limit))


LEAST = {hop: 6 * 2.0**2 / LONGEST**3, turn: 6 * (15.0 * np.pi / 3) ** 2 / LONGEST**3}
LEAST[mission] = LEAST[hop]


@pytest.mark.parametrize("limit", [10.0, 1e5])
@pytest.mark.parametrize("scene", LEAST)
def test_a_free_duration_is_used_to_its_end(scene, limit):
    found = solve(scene(limit)).raise_for_status()
    assert found.objective == pytest.approx(LEAST[scene], rel=1e-4)
    assert found.duration == pytest.approx(LONGEST, rel=1e-6)
    assert any("longest" in told for told in found.warnings)
    assert verify(found).ok


@pytest.mark.parametrize("limit", [1e4, 1e6])
def test_zones_are_passed_as_if_there_were_no_limit(limit):
    flyer = load_problem("free_flyer").make()
    known, found = (solve(replace(flyer, actuator=BallForce(most))) for most in (3.0, limit))
    assert found.objective == pytest.approx(known.objective, rel=1e-6) and verify(found).ok
    assert found.iterations < 1.5 * known.iterations


@pytest.mark.parametrize("limit", [1e6])
def test_bodies_keep_apart_as_if_there_were_no_limit(limit):
    def team(most):
        ways = ((0, 0), (2, 0.1)), ((2, 0), (0, 0.1))
        ends = [[State(place, (0, 0)) for place in way] for way in ways]
        bodies = [TransferProblem(1.0, *pair, 4.0, actuator=BoxForce(most)) for pair in ends]
        return Team(bodies, [Apart(0.5)])

    known, found = solve(team(3.0)), solve(team(limit))
    assert found.objective == pytest.approx(known.objective, rel=1e-6) and verify(found).ok


def test_a_limit_that_a_body_needs_to_hover_is_not_far_above():
    hover = TransferProblem(1.0, *REST, 400.0, [UniformGravity((0, -9.81))], actuator=BallForce(20.0))
    found = solve(hover)
    assert verify(found).ok and found.iterations < 20


def least_fuel(limit):
    """Two impulses of m L / T are the least; the rounding of |F|, a part of the limit, cost a third more."""
    return TransferProblem(1.0, *REST, 4.0, actuator=BallForce(limit), objective=Fuel())


def test_fuel_does_not_pay_for_a_thrust_that_is_never_used():
    found = solve(least_fuel(1e4))
    assert verify(found).ok and found.objective == pytest.approx(1.0, rel=5e-3)


def test_the_ledger_tells_what_is_paid_for_the_rounding_alone(monkeypatch):
    monkeypatch.setattr(mended, "MOST_SHARPER", 0)
    wide = solve(least_fuel(1e4))
    assert wide.objective > 1.2 and not verify(wide)["ledger"].ok


def test_half_of_the_best_duration_is_no_optimum_whatever_the_limit():
    half = solve(replace(hop(1e5), duration=LONGEST / 2))
    claimed = replace(half, problem=hop(1e5))
    assert not verify(claimed)["optimality"].ok
