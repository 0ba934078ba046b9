"""A study measures what it says: true errors, nothing beyond what was measured, drift where there is drift."""

import csv
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dmoc import PointGravity, Spring, State, TransferProblem, solve
from dmoc.basics.memory import remembered
from dmoc.charts.study import save_study
from dmoc.cli.app import main
from dmoc.reports.study import observed_orders
from dmoc.scene.problem_file import load_problem
from dmoc.studies.accuracy import Trial, best_known, frontier, time_to_reach, work_precision
from dmoc.studies.drift import drift, kepler

ALTERNATIVES = Path(__file__).parents[2] / "scripts" / "alternatives.py"
RENDEZVOUS = 1.048842323e-3


def trial(method, error, seconds, status="solved"):
    return Trial(method, 2, 10, 11, 1.0, error, error, 5, 30, 0.25 * seconds, 0.75 * seconds, True, status)


# --- accuracy against time --------------------------------------------------------------------------------


def test_rows_are_the_solves_themselves():
    problem = load_problem("rendezvous").make()
    rows = work_precision(problem, (2, 4), (20, 40), repeats=1, reference=RENDEZVOUS)
    assert [(row.method, row.steps) for row in rows] == [
        ("order 2", 20),
        ("order 2", 40),
        ("order 4", 20),
        ("order 4", 40),
    ]
    for row in rows:
        same = solve(problem, order=row.order, steps=row.steps)
        assert (row.objective, row.iterations, row.nodes) == (
            same.objective,
            same.iterations,
            len(same.path.control),
        )
        assert row.error == pytest.approx(abs(same.objective / RENDEZVOUS - 1))
        assert row.build_s > 0 and row.solve_s > 0 and row.calls >= 5 * row.iterations


def test_error_and_missed_goal_fall_with_the_order_of_the_scheme():
    rows = work_precision(load_problem("orbit_raise").make(), (2, 4, 6, 8), (32, 64), repeats=1)
    for order in (4, 6, 8):
        coarse, fine = (row for row in rows if row.order == order)
        for quantity in ("error", "path_error"):
            shrink = math.log2(getattr(coarse, quantity) / getattr(fine, quantity))
            assert shrink > order - 0.6 or getattr(fine, quantity) < 3e-10


def test_the_reference_is_known_better_than_what_is_judged_by_it():
    value, doubt = best_known(load_problem("rendezvous").make())
    assert value == pytest.approx(RENDEZVOUS, rel=1e-9) and doubt < 1e-9


@pytest.mark.slow
def test_an_error_below_the_doubt_of_the_reference_is_not_claimed():
    rows = work_precision(load_problem("drone_hop").make(), (8,), (100, 200), repeats=1)
    _, doubt = best_known(load_problem("drone_hop").make())
    assert all(row.error >= doubt for row in rows)


def test_cold_solves_stand_beside_those_from_coarse_meshes():
    warm, cold = work_precision(load_problem("orbit_raise").make(), (2,), (400,), repeats=1, cold=True)
    assert (warm.coarse_to_fine, cold.coarse_to_fine) == (True, False)
    assert cold.method == "order 2, cold" and cold.objective == pytest.approx(warm.objective, rel=1e-8)


@pytest.mark.parametrize("solved_before", [False, True])
def test_a_solve_is_timed_as_the_first_of_its_scene_or_as_another_one(solved_before):
    marks = []
    given = load_problem("orbit_raise").make(), (2,), (20,), 2, (), 1.0
    told = {"progress": lambda words: marks.append(remembered(object, "a mark"))}
    work_precision(*given, **told, solved_before=solved_before)
    # before each solve all is forgotten, or one more comes first that is not timed
    assert len(marks) == (3 if solved_before else 2)
    assert len(set(map(id, marks))) == (1 if solved_before else 2)


def test_a_mesh_beyond_the_limit_of_stability_is_a_row_too():
    problem = TransferProblem(1.0, State([0], [0]), State([1], [0]), 10.0, effects=[Spring(100.0, (0,))])
    coarse, fine = work_precision(problem, (2,), (20, 400), repeats=1)
    assert coarse.status.startswith("refused") and math.isnan(coarse.error)
    assert fine.status == "solved"
    assert frontier([coarse, fine]) == [fine]


@pytest.mark.parametrize(
    "arguments, words",
    [
        ({"orders": (3,)}, "order must be one of"),
        ({"steps": (1,)}, "steps must be"),
        ({"repeats": 0}, "repeats must be"),
        ({"against": {"mine": lambda problem, steps: 3}}, "must return a dmoc.Formulation"),
        ({"against": {"mine": lambda problem, steps: 1 / 0}}, "method 'mine': ZeroDivisionError"),
    ],
)
def test_bad_arguments_are_refused(arguments, words):
    with pytest.raises(ValueError, match=words):
        work_precision(load_problem("point_to_point").make(), reference=1.0, **({"steps": (4,)} | arguments))


# --- time to reach ----------------------------------------------------------------------------------------


def test_time_to_reach_is_interpolated_on_the_frontier():
    rows = [trial("a", 1e-2, 0.1), trial("a", 1e-3, 9.0), trial("a", 1e-6, 0.4)]
    # the slow solve at 1e-3 is not on the frontier; halfway in the logarithm of the error
    (found,) = time_to_reach(rows, (1e-4,)).values()
    assert found == [pytest.approx(0.2)]


def test_the_observed_order_is_the_slope_between_meshes():
    """Of a method that loses a factor of 16 at each halving it is 4; none where there is nothing to compare."""
    errors = {"a": [1.6e-3, 1e-4, 1e-4, None], "b": [1e-5, 2.5e-6]}
    rows = [
        Trial(
            name,
            4,
            10 * 2**i,
            11,
            1.0,
            error or 1.0,
            0.0,
            1,
            1,
            0.1,
            0.1,
            True,
            "solved" if error else "failed",
        )
        for name, known in errors.items()
        for i, error in enumerate(known)
    ]
    assert observed_orders(rows) == [None, pytest.approx(4.0), None, None, None, pytest.approx(2.0)]


def test_time_to_reach_never_extrapolates():
    rows = [trial("a", 1e-4, 0.1), trial("a", 1e-6, 0.4), trial("b", 1e-9, 0.01, status="failed")]
    reached = time_to_reach(rows, (1e-3, 1e-6, 1e-7))
    assert reached["a"] == [pytest.approx(0.1), pytest.approx(0.4), None]
    assert reached["b"] == [None, None, None]


# --- drift ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def drifts():
    methods = {"order 2": (200,), "order 4": (60,), "order 8": (20,), "RK4": (200,), "DOP853": (20,)}
    return {row.method: row for row in drift(kepler(0.3), 300, methods)}


@pytest.mark.parametrize("method", ["order 2", "order 4", "order 8"])
def test_the_schemes_keep_energy_bounded_and_angular_momentum_exact(drifts, method):
    row = drifts[method]
    assert row.momentum_error < 1e-12
    assert row.growth == pytest.approx(1.0, abs=0.1)
    assert row.seconds > 0 and row.revolutions == 300


@pytest.mark.parametrize("method", ["RK4", "DOP853"])
def test_runge_kutta_methods_drift_with_the_number_of_revolutions(drifts, method):
    row = drifts[method]
    assert row.momentum_error > 1e-7
    assert row.growth == pytest.approx(10.0, abs=1.5)


@pytest.mark.parametrize("method, order, counts", [("RK4", 4, (100, 200)), ("DOP853", 8, (20, 30))])
def test_what_drifts_has_its_own_order(method, order, counts):
    coarse, fine = drift(kepler(0.1), 10, {method: counts})
    shrink = math.log(coarse.energy_error / fine.energy_error) / math.log(counts[1] / counts[0])
    # what adds up over many revolutions is of one order more
    assert shrink == pytest.approx(order + 1, abs=0.6)


def test_scipys_own_integrator_keeps_its_tolerance():
    loose, tight = drift(kepler(0.3), 20, {"DOP853, adaptive": (1e-6, 1e-10)})
    assert tight.energy_error < 1e-8 < loose.energy_error < 1e-3 and tight.steps > 2 * loose.steps


def test_a_closer_passage_costs_more():
    errors = [drift(kepler(e), 20, {"order 2": (300,)})[0].energy_error for e in (0.0, 0.3, 0.7)]
    assert errors[0] < 1e-2 * errors[1] and errors[1] < 0.1 * errors[2]
    with pytest.raises(ValueError, match="less than 1"):
        kepler(1.0)


def test_drift_finds_the_period_around_any_attractor_and_asks_where_there_is_none():
    case = kepler(0.3)
    here = np.add(case.start.position, (5, -2)).tolist()
    moved = replace(case, start=State(here, case.start.velocity), effects=(PointGravity(1.0, (5, -2)),))
    (row,) = drift(moved, 50, {"order 4": (60,)})
    assert row.momentum_error < 1e-11 and row.growth == pytest.approx(1.0, abs=0.1)
    free = load_problem("point_to_point").make()
    with pytest.raises(ValueError, match="period"):
        drift(free, 2)
    with pytest.raises(ValueError, match="no method 'Euler'"):
        drift(case, 2, {"Euler": (10,)})


@pytest.mark.slow
def test_a_picture_of_what_was_solved(tmp_path):
    rows = work_precision(
        load_problem("rendezvous").make(), (4, 8), (8, 16), 1, reference=RENDEZVOUS, cold=True
    )
    save_study(rows, tmp_path / "study.pdf", "rendezvous")
    assert (tmp_path / "study.pdf").read_bytes().startswith(b"%PDF")
    with pytest.raises(ValueError, match="must end in"):
        save_study(rows, tmp_path / "study.txt")
    with pytest.raises(ValueError, match="nothing was solved"):
        save_study([replace(rows[0], status="failed")], tmp_path / "study.png")


# --- command line -----------------------------------------------------------------------------------------


def run(capfd, *arguments):
    with pytest.raises(SystemExit) as end:
        main([str(argument) for argument in arguments])
    out, err = capfd.readouterr()
    return end.value.code or 0, out, err


def test_study_prints_tables_and_writes_files(capfd, tmp_path):
    picture, table = tmp_path / "study.png", tmp_path / "study.csv"
    options = ("--orders", "4,8", "--steps", "8,16", "--repeats", 1, "--against", ALTERNATIVES)
    code, out, err = run(capfd, "study", "rendezvous", *options, "--plot", picture, "--csv", table)
    assert (code, err) == (0, "")
    for word in ("order 4", "order 8", "Radau 3", "plain", "1e-9", "missed", "never beyond"):
        assert word in out
    assert picture.read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader(table.open()))
    assert len(rows) == 2 * 2 + 2 * 7 and float(rows[0]["error"]) < 1e-2


def test_study_prints_one_json_object(capfd):
    options = ("--orders", "8", "--steps", "8", "--repeats", 1, "--set", "duration=2000.0", "--json")
    code, out, err = run(capfd, "study", "rendezvous", *options)
    found = json.loads(out)
    assert (code, err, list(found)) == (0, "", ["problem", "trials", "time_to_reach"])
    assert found["trials"][0]["method"] == "order 8" and found["trials"][0]["error"] < 1e-6
    assert list(found["time_to_reach"][0]["seconds"]) == ["1e-3", "1e-5", "1e-7", "1e-9"]


@pytest.mark.parametrize(
    "options, words",
    [
        (("--orders", "two"), "--orders must be whole numbers"),
        (("--steps", "1"), "steps must be"),
        (("--against", "nowhere.py"), "no file nowhere.py"),
        (("--plot", "study.txt"), "must end in"),
        (("--csv", "nowhere/study.csv"), "no folder"),
        (("--csv", "rendezvous.py"), "must end in .csv"),
        (("--reference", "nan"), "reference must be a finite number"),
    ],
)
def test_bad_options_are_one_line(capfd, options, words):
    code, out, err = run(capfd, "study", "rendezvous", *options)
    assert (code, out, err.count("\n")) == (2, "", 1) and words in err


@pytest.mark.parametrize("source, words", [("x = 1", "no dictionary METHODS"), ("1 / 0", "ZeroDivisionError")])
def test_a_file_without_methods_is_refused(capfd, tmp_path, source, words):
    (tmp_path / "mine.py").write_text(source)
    code, out, err = run(capfd, "study", "rendezvous", "--against", tmp_path / "mine.py")
    assert (code, out, err.count("\n")) == (2, "", 1) and words in err
