"""An engine of little thrust over many revolutions: about all the time it burns, and little hangs on where."""

import math
import runpy
from dataclasses import replace
from pathlib import Path

import pytest

from dmoc import (
    J2,
    CircularOrbit,
    ConicalShadow,
    Engine,
    Fuel,
    PointGravity,
    RadiationPressure,
    State,
    Time,
    TransferProblem,
    solve,
    verify,
)
from dmoc.guess.starting import guess_duration

CASE = runpy.run_path(str(Path(__file__).parents[1] / "cases" / "leo_week.py"))
EXHAUST = 1600.0 * 9.80665


def velocity_change(solution):
    """What the propellant is worth [m/s]."""
    return EXHAUST * math.log(500.0 / solution.final_mass)


def edelbaum(climb):
    """The difference of the speeds on both circles, which many revolutions need [m/s]."""
    inner, outer = (math.sqrt(CASE["MU"] / (CASE["EARTH"] + 700e3 + up)) for up in (0.0, climb))
    return inner - outer


@pytest.mark.parametrize("oblate, any_plane", [(True, False), (True, True), (False, False)])
def test_least_effort_keeps_the_limit_and_takes_few_iterations(oblate, any_plane):
    problem = CASE["problem"](days=2.0, climb=100e3, fuel=False, oblate=oblate, any_plane=any_plane)
    solution = solve(problem).raise_for_status()
    assert sum(level.iterations for level in solution.ladder) <= 20
    assert verify(solution).ok
    # The oblate Earth shifts what a circle is by 6 km, a sixteenth of the way.
    assert velocity_change(solution) == pytest.approx(edelbaum(100e3), rel=0.08 if oblate else 0.01)


def test_nine_revolutions_of_least_fuel_end_at_the_barrier_at_which_they_begin():
    """Sunlight and shadow as well: below that barrier 105 of 150 iterations led nowhere, and 317 were taken."""
    speed, climb = math.sqrt(CASE["MU"] / 7078137.0), 100e3
    start = State((7078137.0, 0, 0), (0, speed * math.cos(0.9), speed * math.sin(0.9)))
    sunlight = RadiationPressure(12.0, 0.3, (1.496e11, 0.0, 0.0), ConicalShadow(CASE["EARTH"]))
    effects = [PointGravity(CASE["MU"]), J2(CASE["MU"], CASE["EARTH"], 1.08263e-3), sunlight]
    engine = Engine(1.0, specific_impulse=1600.0, dry_mass=300.0)
    goal = CircularOrbit(7078137.0 + climb, mu=CASE["MU"])
    solution = solve(TransferProblem(500.0, start, goal, 51840.0, effects, engine, Fuel())).raise_for_status()
    assert sum(level.iterations for level in solution.ladder) < 100
    assert verify(solution).ok
    # Oblateness moves what a circle is, see above.
    assert velocity_change(solution) == pytest.approx(edelbaum(climb), rel=0.1)


@pytest.mark.slow
def test_least_fuel_of_a_day_is_less_than_that_of_least_effort():
    solution, effort = (solve(CASE["problem"](days=1.0, climb=50e3, fuel=fuel)) for fuel in (True, False))
    assert verify(solution.raise_for_status())["optimality"].ok
    # Circles of the oblate Earth are 6 km apart where they are one without that, an eighth of the way.
    assert 0.88 * edelbaum(50e3) < velocity_change(solution) < velocity_change(effort)


@pytest.mark.slow
def test_least_fuel_of_a_week():
    """The difference of the speeds is 251.8 m/s; a path of least effort burns 7.9780 kg."""
    solution = solve(CASE["problem"]()).raise_for_status()
    assert verify(solution).ok
    assert sum(level.iterations for level in solution.ladder) <= 60
    assert 500.0 - solution.final_mass == pytest.approx(7.9748, abs=5e-4)


def test_a_plane_that_a_coast_turns_by_itself_takes_no_time():
    """A week around the oblate Earth turns the node by 29 degrees, 3.6 km/s, to an orbit of any node."""
    week = CASE["problem"]()
    problem = replace(week, duration=(3.5 * 86400, 14 * 86400), objective=Time())
    # The difference of the speeds, 251.8 m/s, takes 5.8 days at 0.25 N.
    assert guess_duration(problem) == pytest.approx(1.2 * 251.8 / 0.25 * 500.0, rel=0.1)
