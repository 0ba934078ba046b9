"""The closing line says how exact an answer is and, where a check fails, what to try."""

import json

import pytest

from dmoc import BoxForce, Fuel, State, TransferProblem, solve, verify
from dmoc.checks.verification import CHECKS
from dmoc.cli.app import main
from dmoc.reports.verdict import REMEDIES, accuracy, verdict_words
from dmoc.scene.problem_file import load_problem


def answered(**numerics):
    solution = solve(load_problem("orbit_raise").make(), **numerics)
    return solution, verify(solution)


def test_an_answer_of_order_2_does_not_seem_exact():
    solution, report = answered(order=2, steps=400)
    miss = report["reference"].value
    assert report.ok and miss > 1e-6
    words = verdict_words(solution, report)
    assert f"right to about {miss:.0e} of its extent, {miss * solution.path.diagonal:.1e} m" in words
    better = float(words.split("--tol ")[1].split(" ")[0])
    assert 1e-3 * miss < better <= 1e-2 * miss
    finer, checked = answered(tol=better)
    assert accuracy(finer, checked) <= better and "for better" not in verdict_words(finer, checked)


def test_where_controls_switch_a_tolerance_is_named_that_is_less_far():
    ends = State((0, 0), (0, 0)), State((4, 1), (0, 0))
    problem = TransferProblem(1.0, *ends, 6.0, actuator=BoxForce(1.0), objective=Fuel())
    solution = solve(problem, order=2, steps=101)
    report = verify(solution)
    miss, words = report["reference"].value, verdict_words(solution, report)
    better = float(words.split("--tol ")[1].split(" ")[0])
    assert 1e-2 * miss < better <= 1e-1 * miss
    assert solve(problem, tol=better).success


def test_what_fails_names_what_to_try_and_that_helps():
    solution, report = answered(order=2, steps=20)
    words = verdict_words(solution, report)
    assert not report["reference"].ok and "Checks that fail: reference" in words and "--tol 1e-4" in words
    finer, checked = answered(tol=1e-4)
    assert finer.success and checked.ok


def test_every_check_names_what_to_try():
    # Missions have joints, and teams stay together.
    assert REMEDIES.keys() == {*CHECKS, "joints", "together"}


def test_json_has_the_accuracy(capsys):
    with pytest.raises(SystemExit):
        main(["solve", "orbit_raise", "--json"])
    found = json.loads(capsys.readouterr().out)
    assert found["accuracy"] == found["checks"]["reference"]["value"] > 0
