"""Free time around an attractor: the number of revolutions is tried, not guessed."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from dmoc import (
    BallForce,
    CircularOrbit,
    Engine,
    Fuel,
    Orbit,
    PointGravity,
    State,
    TransferProblem,
    solve,
    verify,
)
from dmoc.cli.app import main
from dmoc.scene.problem_file import load_problem

CASE = Path(__file__).parents[1] / "cases" / "circular_rendezvous.py"
MU, RADIUS, MASS, AHEAD = 3.986004418e14, 12e6, 100.0, 0.35


def rendezvous(**settings):
    return load_problem(CASE).make(**settings)


def phasing(revolutions):
    """Impulse [N s] of two equal burns, off a circle for so many revolutions and back (Vallado, 2013, 6.6)."""
    period = 2 * math.pi * math.sqrt(RADIUS**3 / MU) * (1 - AHEAD / (2 * math.pi * revolutions))
    axis = (MU * (period / (2 * math.pi)) ** 2) ** (1 / 3)
    return 2 * MASS * abs(math.sqrt(MU * (2 / RADIUS - 1 / axis)) - math.sqrt(MU / RADIUS))


def test_two_revolutions_are_found_where_one_is_shorter():
    solution = solve(rendezvous()).raise_for_status()
    assert phasing(2) == pytest.approx(11009, abs=3)
    assert solution.objective == pytest.approx(phasing(2), rel=1e-3)
    assert verify(solution).ok


@pytest.mark.parametrize("eccentricity", [0.0, pytest.param(0.3, marks=pytest.mark.slow)])
def test_a_wider_interval_never_costs_more(eccentricity):
    intervals = [(10e3, 14e3), (10e3, 26e3), (5e3, 40e3)]
    costs = []
    for shortest, longest in intervals:
        solution = solve(rendezvous(shortest=shortest, longest=longest, eccentricity=eccentricity))
        costs.append(solution.raise_for_status().objective)
        assert verify(solution).ok
    assert np.all(np.diff(costs) < 0)


@pytest.mark.slow
def test_a_tolerance_begins_from_the_same_answer():
    solution = solve(rendezvous(), tol=1e-3).raise_for_status()
    assert solution.objective == pytest.approx(phasing(2), rel=1e-3)


def test_the_ladder_says_what_was_tried_and_what_it_cost():
    ladder = solve(rendezvous()).ladder
    asked = [level.question for level in ladder]
    expected = ["10000 s", "4.25926 h", "5.74074 h", "7.22222 h"]
    assert asked[:4] == [f"least effort in {time}" for time in expected]
    assert not any(asked[4:]) and all(level.iterations for level in ladder)


def test_a_fixed_duration_asks_nothing():
    fixed = load_problem("orbit_raise").make()
    assert not any(level.question for level in solve(fixed).ladder)


@pytest.mark.slow
def test_an_orbit_as_the_goal_is_tried_too():
    """From radius 1 to 3 by two burns: impulses (Hohmann) take 0.3938, gravity losses a little more."""
    problem = TransferProblem(
        1.0,
        State((1, 0), (0, 1)),
        CircularOrbit(3.0, 1.0),
        (3.0, 12.0),
        effects=[PointGravity(1.0)],
        actuator=Engine(0.2, exhaust_velocity=1.5, dry_mass=0.3),
        objective=Fuel(),
    )
    solution = solve(problem).raise_for_status()
    assert any(level.question for level in solution.ladder)
    spent = -1.5 * math.log(solution.final_mass)
    assert 0.3938 < spent < 1.03 * 0.3938
    assert verify(solution).ok


def test_a_tolerance_to_an_orbit_as_a_whole_ends_at_the_cheap_optimum():
    """From the guess alone it costs 0.0937, with every check green."""
    problem = TransferProblem(
        1.0,
        State((-0.4008871772869974, -0.9161274316856054), (0.9452918339789206, -0.41364919543890216)),
        Orbit(1.0, a=1.1099314775511324, e=0.05168360699499817, center=(0.0, 0.0)),
        (5.330134846430954, 13.48064081498765),
        effects=[PointGravity(1.0)],
    )
    solution = solve(problem, tol=1e-5).raise_for_status()
    assert verify(solution).ok
    assert solution.objective == pytest.approx(1.36406e-5, rel=1e-4)


@pytest.mark.slow
def test_a_limit_of_force_that_no_duration_meets_is_explained():
    problem = TransferProblem(
        1.0,
        State((1, 0), (0, 1)),
        State((-1, 0), (0, -1.4)),
        (1.0, 6.0),
        effects=[PointGravity(1.0)],
        actuator=BallForce(0.01),
    )
    solution = solve(problem)
    assert not solution.success and "the transfer needs a force limit of" in solution.message


def test_a_duration_on_its_limit_is_told(capsys):
    assert solve(rendezvous()).warnings == (
        "the duration ends on its longest limit of 7.22222 h: a longer one may cost less",
    )
    with pytest.raises(SystemExit):
        main(["solve", str(CASE), "--quiet"])
    assert "Note that the duration ends on its longest limit of 7.22222 h" in " ".join(
        capsys.readouterr().out.split()
    )
    with pytest.raises(SystemExit):
        main(["solve", str(CASE), "--json"])
    assert "longest limit of 7.22222 h" in json.loads(capsys.readouterr().out)["warnings"][0]
