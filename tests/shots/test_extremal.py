"""Least effort by shooting, over so many revolutions that no other guess leads to an answer."""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest

from dmoc import solve, verify
from dmoc.guess.starting import starting_guess
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.mesh import uniform_mesh
from dmoc.shots.extremal import Extremal, first_costate

CASE = runpy.run_path(str(Path(__file__).parents[1] / "cases" / "leo_many.py"))
MU, EARTH = CASE["MU"], CASE["EARTH"]


def edelbaum(problem, climb, turned=0.0):
    """The effort between circles as the revolutions become many: a straight line in speed and sqrt(2) tilt."""
    fast, slow = (math.sqrt(MU / (EARTH + 700e3 + up)) for up in (0.0, climb))
    change = fast**2 + slow**2 - 2 * fast * slow * math.cos(math.sqrt(2) * turned)
    return problem.mass**2 * change / (2 * problem.duration)


def found(problem):
    extremal = Extremal(problem, problem.duration, problem.start.fixed())
    return extremal, first_costate(extremal)


def test_the_path_meets_the_equations_of_motion_and_the_goal():
    problem = CASE["problem"](days=1.0)
    extremal, costate = found(problem)
    fractions = np.linspace(0, 1, 4001)
    position, velocity, force, mass = extremal.along(costate, fractions)
    times = problem.duration * fractions
    pull = Dynamics.of(problem).acceleration(times[None], position.T, velocity.T, mass[None], force.T).full().T
    change = np.gradient(velocity, times, axis=0, edge_order=2)
    # Differences of second order over 270 steps a revolution err by 1e-4 of gravity.
    assert np.abs(change - pull).max() < 2e-4 * np.abs(pull).max()
    assert np.linalg.norm(position[-1]) == pytest.approx(EARTH + 750e3, rel=2e-6)
    speed = math.sqrt(MU / (EARTH + 750e3))
    assert np.linalg.norm(velocity[-1]) == pytest.approx(speed, rel=2e-6)
    assert abs(position[-1] @ velocity[-1]) < 2e-6 * speed * (EARTH + 750e3)


def test_around_an_oblate_body_the_effort_is_not_twice_the_least():
    """A search from a coast of the oblate body itself ends on a path of 18,180 N^2 s, stationary as well."""
    problem = CASE["problem"](days=10.0, climb=500e3)
    extremal, costate = found(problem)
    force = extremal.along(costate, np.linspace(0, 1, 4001))[2]
    effort = 0.5 * problem.duration * np.mean((force**2).sum(axis=1))
    assert effort == pytest.approx(edelbaum(problem, 500e3), rel=0.01)


def test_the_force_keeps_its_limit():
    problem = CASE["problem"](days=1.0, limit=0.19)
    free = found(CASE["problem"](days=1.0))
    limited = found(problem)
    fractions = np.linspace(0, 1, 500)
    largest = [
        np.linalg.norm(one.along(costate, fractions)[2], axis=1).max() for one, costate in (free, limited)
    ]
    assert largest[0] > 0.19 and largest[1] <= 0.19 * (1 + 1e-9)


def test_nothing_is_found_where_the_force_is_too_weak():
    assert found(CASE["problem"](days=1.0, limit=0.05))[1] is None


@pytest.mark.parametrize("hold", [False, True])
def test_the_guess_has_controls_for_each_node_or_each_step(hold):
    problem = CASE["problem"](days=1.0, oblate=False)
    guess = starting_guess(problem, uniform_mesh(300), 6, hold)
    assert guess.control.shape == (300 if hold else 901, 3)
    effort = 0.5 * problem.duration * np.mean((guess.control**2).sum(axis=1))
    assert effort == pytest.approx(edelbaum(problem, 50e3), rel=0.02)


@pytest.mark.parametrize(
    "oblate, turned, any_plane", [(False, 0.0, False), (True, 0.002, False), (True, 0.0, True)]
)
def test_two_days_in_low_orbit_are_solved_at_once(oblate, turned, any_plane):
    """The oblate Earth shifts what a circle is by 6 km, a tenth of the way here."""
    problem = CASE["problem"](oblate=oblate, turned=turned, any_plane=any_plane)
    solution = solve(problem).raise_for_status()
    assert sum(level.iterations for level in solution.ladder) <= 30
    assert verify(solution).ok
    gap = 0.15 if oblate else 0.01
    assert solution.objective == pytest.approx(edelbaum(problem, 50e3, turned), rel=gap)


def test_a_limit_of_the_force_costs_few_iterations_more():
    free = solve(CASE["problem"]()).raise_for_status()
    limited = solve(CASE["problem"](limit=0.12)).raise_for_status()
    assert np.linalg.norm(free.force, axis=1).max() < 0.12
    assert limited.objective == pytest.approx(free.objective, rel=1e-6)
    assert sum(level.iterations for level in limited.ladder) <= 40


@pytest.mark.slow
@pytest.mark.parametrize("oblate, turned, days", [(True, 0.0, 7.0), (False, 0.0, 7.0), (True, 0.05, 10.0)])
def test_a_week_in_low_orbit_is_solved(oblate, turned, days):
    problem = CASE["problem"](days=days, climb=500e3, oblate=oblate, turned=turned)
    solution = solve(problem).raise_for_status()
    assert sum(level.iterations for level in solution.ladder) <= 30
    assert verify(solution).ok
    bound = edelbaum(problem, 500e3, turned)
    assert solution.objective == pytest.approx(bound, rel=0.03 if oblate else 0.005)
