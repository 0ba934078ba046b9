"""A time limit ends a solve with the best answer so far, which says so."""

import json

import pytest

from dmoc import BallForce, State, TransferProblem, load, solve
from dmoc.cli.app import main
from dmoc.ipopt import watch as ipopt
from dmoc.scene.problem_file import load_problem
from dmoc.solver.proven import QUESTION
from dmoc.structure.coarse import coarse_answer


class Clock:
    """A clock on which every iteration of Ipopt, and every look at the time, takes a hundredth of a second."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        self.now += 0.01
        return self.now


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    monkeypatch.setattr(ipopt.time, "monotonic", Clock())


def test_the_answer_on_the_last_solved_mesh_is_kept(tmp_path):
    problem = load_problem("two_body_fuel").make()
    whole = solve(problem, tol=1e-4)
    cut = solve(problem, tol=1e-4, time_limit=2.0)
    assert whole.success and not cut.success and cut.optimal and cut.status == "time limit"
    assert cut.objective == pytest.approx(whole.objective, rel=0.05)
    assert sum(level.iterations for level in cut.ladder) < whole.iterations
    assert f"order {cut.order}, {cut.steps} steps" in cut.message and "time limit of 2 s" in cut.message
    cut.save(tmp_path / "cut.nc")
    assert load(tmp_path / "cut.nc").status == "time limit"


def test_nothing_solved_in_time_is_a_failure():
    solution = solve(load_problem("two_body_fuel").make(), time_limit=0.03)
    assert not solution.success and not solution.optimal
    assert "before any mesh was solved: give more time" in solution.message


def test_time_that_is_enough_changes_nothing():
    solution = solve(load_problem("orbit_raise").make(), time_limit=1000.0)
    assert solution.success and solution.warnings == ()


@pytest.mark.slow
def test_the_search_for_a_cause_ends_in_time():
    problem = load_problem("free_flyer").make(duration=10.0)
    whole = solve(problem)
    asked = [level.iterations for level in whole.ladder if level.question]
    tried = [level.iterations for level in whole.ladder if not level.question]
    cut = solve(problem, time_limit=0.01 * (tried[0] + 0.5 * asked[0]))
    assert "time limit" in cut.message and cut.iterations < sum(tried[:1]) + sum(asked[:1])


def test_what_is_not_proven_in_time_is_neither_named_nor_tried_on():
    still = (0.0, 0.0)
    problem = TransferProblem(1.0, State(still, still), State((4.0, 1.0), still), 4.0, actuator=BallForce(0.5))
    whole = solve(problem, steps=40)
    before = sum(level.iterations + 2 for level in whole.ladder if level.question != QUESTION)
    proofs = sum(level.question == QUESTION for level in whole.ladder)
    cut = solve(problem, steps=40, time_limit=0.01 * before)
    assert not whole.success and "force limit" in whole.message and proofs > 1
    assert "the time limit" in cut.message and "force limit" not in cut.message
    assert sum(level.question == QUESTION for level in cut.ladder) < proofs


def test_a_mission_of_many_steps_is_solved_on_few_first():
    """From a guess an iteration on 2,000 steps took four minutes, in which no clock is looked at."""
    solution = solve(load_problem("two_stage_ascent").make(), steps=200)
    assert solution.success
    assert [level.steps for level in solution.ladder] == [200, 400]


@pytest.mark.parametrize("limit, code", [("0.03", 3), ("2", 4)])
def test_the_exit_code_tells(limit, code, capsys):
    with pytest.raises(SystemExit) as done:
        main(["solve", "two_body_fuel", "--tol", "1e-4", "--time-limit", limit, "--json"])
    assert done.value.code == code
    assert json.loads(capsys.readouterr().out)["success"] is False


@pytest.mark.parametrize("problem", ["gates", "three_robots", "delivery"])
def test_a_mission_or_team_without_an_answer_in_time_has_failed_and_was_not_interrupted(problem):
    solution = solve(load_problem(problem).make(), time_limit=0.03)
    assert solution.status == "failed" and "before any mesh was solved: give more time" in solution.message


def test_without_legs_in_time_the_coarse_answer_is_kept():
    problem = load_problem("two_body_fuel").make()
    coarse = coarse_answer(problem, None, None)
    cut = solve(problem, structure=True, time_limit=0.01 * (coarse.iterations + 15))
    assert cut.status == "time limit" and cut.order == 4 and not hasattr(cut, "legs")
    assert cut.objective == pytest.approx(coarse.objective, rel=1e-2)


def test_the_limits_of_one_solve_count_together():
    with ipopt.one_clock():
        first = ipopt.Interrupt(0.05)
        for _ in range(10):
            first.seen  # noqa: B018 - a look at the clock
        assert ipopt.Interrupt(0.05).late and not ipopt.Interrupt(5.0).late
    assert not ipopt.Interrupt(0.05).late


@pytest.mark.parametrize("bad", ["0", "-1", "nan"])
def test_a_limit_without_meaning_is_refused(bad, capsys):
    with pytest.raises(SystemExit) as done:
        main(["solve", "two_body_fuel", "--time-limit", bad])
    assert done.value.code == 2 and "time_limit" in capsys.readouterr().err
