"""An option that a message names is followed, and then every check holds."""

import re

import numpy as np
import pytest

from dmoc import Attitude, BallForce, KeepIn, KeepOut, State, TransferProblem, Wheels, rotation, solve, verify
from dmoc.reports.verdict import verdict_words
from dmoc.scene.problem_file import load_problem

SLOW = pytest.mark.slow


def made(name):
    return load_problem(name).make()


def hop(force, **more):
    still = (0.0, 0.0)
    ends = State(still, still), State((4.0, 0.0), still)
    return TransferProblem(1.0, *ends, 5.0, actuator=BallForce(force), **more)


def past_a_disc():
    return hop(2.0, constraints=[KeepIn((-1, -0.2), (5, 1.2)), KeepOut((2, 0.5), 0.65)])


def turned_by_wheels():
    """With hardly more torque than is needed, so that the control flown has another price on few steps."""
    ends = Attitude((1, 0, 0, 0)), Attitude(rotation((0, 0, 1), 60))
    wheels = Wheels(np.eye(3).tolist(), 0.6219, None)
    return TransferProblem(1.0, *ends, 4.0, inertia=(1.0, 2.0, 2.8), actuator=wheels)


# Scenes of which a check fails on so many steps.
RED = {
    "orbit": (lambda: made("orbit_raise"), 60),
    "passage": (past_a_disc, 6),
    "wheels": (turned_by_wheels, 24),
}
# What is named then, as arguments of a solve.
FINER = {
    "more steps": lambda steps: {"steps": 8 * steps},
    "a higher order": lambda steps: {"steps": steps, "order": 8},
    "--tol 1e-4": lambda steps: {"tol": 1e-4},
}


@pytest.mark.parametrize("way", FINER)
@pytest.mark.parametrize("name", [*list(RED)[:2], pytest.param("wheels", marks=SLOW)])
def test_what_is_named_where_a_check_fails_mends_it(name, way):
    make, steps = RED[name]
    red = solve(make(), steps=steps)
    told = verdict_words(red, verify(red))
    assert "Checks that fail" in told and way in told
    found = solve(make(), **FINER[way](steps))
    assert found.success and verify(found).ok


# Problems whose answers on their usual mesh may be better, by the tolerance that is named.
BETTER = ["orbit_raise", "free_flyer", "hovercraft", "point_to_point"]
LONGER = ["acrobot", "goddard", "two_body_fuel", "astrobee", "hanging_chain", "leo_raise", "dionysus"]


@pytest.mark.parametrize("name", [*BETTER[:1], *(pytest.param(one, marks=SLOW) for one in BETTER[1:] + LONGER)])
def test_the_tolerance_that_is_named_for_better_is_met(name):
    first = solve(made(name))
    report = verify(first)
    named = re.search(r"--tol (\S+) for better", verdict_words(first, report))
    if named is None:
        assert report["reference"].value < 1e-6
        return
    found = solve(made(name), tol=float(named[1])).raise_for_status()
    assert found.error.largest <= float(named[1]) and verify(found).ok


@SLOW
@pytest.mark.parametrize("name", ["leo_raise", "two_body_fuel"])
def test_where_controls_switch_the_tolerance_that_is_named_takes_few_times_the_work(name):
    """Work is iterations times steps; one that is a hundred times better takes thirty times as much or more."""
    first = solve(made(name))
    named = re.search(r"--tol (\S+) for better", verdict_words(first, verify(first)))
    found = solve(made(name), tol=float(named[1]))
    work = [sum(level.iterations * level.steps for level in one.ladder) for one in (first, found)]
    assert found.success and work[1] < 10 * work[0]


def stopped_by(**limits):
    failed = solve(hop(3.0), steps=40, **limits)
    assert not failed.success
    return failed.message


def test_a_limit_of_the_users_own_is_what_is_named_first():
    assert "{'ipopt.max_iter': 2} ended it: give more" in stopped_by(options={"ipopt.max_iter": 2})
    assert solve(hop(3.0), steps=40, options={"ipopt.max_iter": 100}).success
    assert "time limit of 1e-06 s ended it" in stopped_by(time_limit=1e-6)
    assert "give more time" in stopped_by(time_limit=1e-6)
    assert solve(hop(3.0), steps=40, time_limit=60.0).success
