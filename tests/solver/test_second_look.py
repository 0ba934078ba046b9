"""In a fixed time around an attractor, an answer of other revolutions that costs far less is found."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from dmoc import BallForce, PointGravity, State, TransferProblem, solve, verify
from dmoc.scene.problem_file import load_problem
from dmoc.solver.ladder import Ladder
from dmoc.solver.starts import local_optima

FAILED = SimpleNamespace(status="iteration limit")
SLOW = Path(__file__).parents[1] / "cases" / "eccentric_slow.py"


def sooner(actuator=None):
    """From one eccentric orbit to another in half a period: the default guess goes the long way round."""
    start = State((1.4343556944680529, -0.16307472430321306), (0.01685852621095273, 0.7817077506963218))
    goal = State((0.7235357147863406, -1.2487382409686097), (0.4526628519458991, 0.6233734569901064))
    more = {} if actuator is None else {"actuator": actuator}
    return TransferProblem(1.0, start, goal, 4.284772420510383, effects=[PointGravity(1.0)], **more)


def questions(solution):
    return [level.question for level in solution.ladder if level.question]


@pytest.mark.parametrize("order", [2, 8])
def test_what_another_mesh_finds_is_found_on_every_mesh(order):
    """Refined to 1e-8 it costs 0.016439377; orders 2, 6 and 8 alone end in an optimum of 0.0439508."""
    solution = solve(load_problem(SLOW).make(), order=order).raise_for_status()
    assert solution.objective == pytest.approx(0.0164394, rel=1e-3)
    assert solution.warnings[0].startswith("the first answer cost 0.04")
    assert verify(solution).ok


@pytest.mark.parametrize("numerics", [{}, {"hold": True}])
def test_a_revolution_less_costs_a_fifth(numerics):
    """The default guess leads, in eight iterations, to 1.5638 N^2 s."""
    solution = solve(sooner(), **numerics).raise_for_status()
    assert solution.objective == pytest.approx(0.302827, rel=1e-3)
    assert verify(solution).ok
    told = [*solution.warnings, solution.reason]
    assert any("the first answer cost 1.56 N^2 s" in words for words in told)


def test_a_tolerance_is_met_by_the_cheaper_one():
    """The first answer, on eight steps, costs less than any path: it is solved again on more of them."""
    solution = solve(sooner(), tol=1e-5).raise_for_status()
    assert questions(solution) and solution.objective == pytest.approx(0.302827, rel=1e-5)
    assert verify(solution).ok


def test_with_a_limit_of_the_force_too():
    solution = solve(sooner(BallForce(1.0))).raise_for_status()
    assert solution.objective == pytest.approx(0.302827, rel=1e-3)


@pytest.mark.parametrize("name", ["orbit_raise", "two_body_fuel", "geo_raise"])
def test_where_the_orbit_alone_takes_the_effort_nothing_is_tried(name):
    assert questions(solve(load_problem(name).make())) == []


@pytest.mark.parametrize("given", ["mesh", "guess"])
def test_what_the_user_gives_is_kept(given):
    assert "least effort at order 6" in questions(solve(sooner()))
    mesh = [i / 100 for i in range(101)]
    own = solve(sooner(), mesh=mesh)
    found = own if given == "mesh" else solve(sooner(), guess=own)
    assert found.objective == pytest.approx(1.5638, rel=1e-2) and questions(found) == []


def test_the_starts_that_are_named_for_a_way_that_is_missed_find_it(monkeypatch):
    """The other way is known from its least effort, and leads nowhere on the mesh of the answer."""
    with monkeypatch.context() as patch:
        patch.setattr(Ladder, "refine_on", lambda ladder, *given: replace(ladder.rungs[-1], answer=FAILED))
        missed = solve(sooner())
    assert missed.objective == pytest.approx(1.5638, rel=1e-2)
    cost, starts = re.search(
        "may cost less, about (.*) N.2 s, .* try --starts ([0-9]+)", missed.warnings[-1]
    ).groups()
    best = local_optima(sooner(), int(starts))[0]
    found = solve(sooner(), guess=best.path).raise_for_status()
    assert found.objective == pytest.approx(float(cost), rel=1e-2) and verify(found).ok
