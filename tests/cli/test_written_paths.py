"""What `dmoc simulate` and `dmoc sweep` write for people and programs."""

import csv
import json
import re

import numpy as np
import pytest

from dmoc import simulate, solve
from dmoc.cli.app import main
from dmoc.conversions.marched import marched_columns
from dmoc.reports.as_json import sweep_object
from dmoc.scene.problem_file import load_problem
from dmoc.sweeps.data import sweep_dataset
from dmoc.sweeps.plan import make_plan


@pytest.fixture
def run(capfd, tmp_path, monkeypatch):
    """Run a command line in an empty folder: exit code, stdout, stderr."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        with pytest.raises(SystemExit) as end:
            main([str(argument) for argument in arguments])
        out, err = capfd.readouterr()
        return end.value.code or 0, out, err

    return call


def table(path):
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def test_a_simulation_is_written_drawn_and_told_as_json(run, tmp_path):
    words = ("simulate", "orbit_raise", "--order", 4, "--steps", 50)
    code, out, err = run(*words, "--out", "coast.csv", "--plot", "coast.svg")
    assert code == 0 and not err and "wrote coast.csv" in out and "wrote coast.svg" in out
    marched = simulate(load_problem("orbit_raise").make(), steps=50, order=4)
    found = table(tmp_path / "coast.csv")
    assert (found["time [s]"] == marched.time).all() and (found["energy [J/kg]"] == marched.energy).all()
    assert (found["position y [m]"] == marched.position[:, 1]).all()
    assert (found["velocity x [m/s]"] == marched.velocity[:, 0]).all() and (found["mass [kg]"] == 1.0).all()
    drawn = (tmp_path / "coast.svg").read_text()
    assert "orbit raise: simulated for 12 s, 50 steps" in drawn
    code, out, err = run(*words, "--json")
    told = json.loads(out)
    assert code == 0 and told["final_position"] == marched.position[-1].tolist()
    assert told["energy_change"] == abs(marched.energy - marched.energy[0]).max()
    assert (told["steps"], told["coast"], told["energy_is_kept"]) == (50, True, True)
    assert told["final_mass"] == 1.0
    assert "final_attitude" not in told


def test_the_flight_of_a_mission_is_written_too(run, tmp_path):
    found = solve(load_problem("hohmann").make())
    found.save(tmp_path / "flight.nc", problem_name="hohmann")
    code, out, _ = run(
        "simulate", "hohmann", "--controls", "flight.nc", "--out", "a.csv", "--plot", "a.png", "--json"
    )
    told = json.loads(out)
    assert code == 0 and told["coast"] is False
    assert told["final_position"] == pytest.approx(found.position[-1].tolist(), abs=1e-9)
    assert len(table(tmp_path / "a.csv")["time [s]"]) == told["steps"] + 1
    assert (tmp_path / "a.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    "name", ["point_to_point", "reorientation", "arm_reach", "satellite_slew", "bang_bang"]
)
def test_every_kind_of_body_has_its_columns_and_picture(name, run, tmp_path):
    assert run("simulate", name, "--steps", 4, "--order", 4, "--out", "a.csv", "--plot", "a.svg")[0] == 0
    scene = load_problem(name).make()
    marched = simulate(scene, steps=4, order=4)
    columns = marched_columns(marched, scene)
    written = table(tmp_path / "a.csv")
    assert list(written) == list(columns)
    rows = [marched.position, marched.velocity, marched.attitude, marched.rate, marched.wheel_momentum]
    assert len(columns) == 3 + sum(each.shape[1] for each in rows if each is not None)
    assert (tmp_path / "a.svg").stat().st_size > 10_000


def test_bad_files_are_refused_before_the_march(run, tmp_path):
    for words, told in (
        (("--out", "a.txt"), "must end in .csv"),
        (("--out", "a.csv", "--plot", "a.txt"), "must end in .png"),
        (("--out", "missing/a.csv"), "there is no folder missing"),
    ):
        code, out, err = run("simulate", "orbit_raise", *words)
        assert (code, out) == (2, "") and told in err and err.count("\n") == 1
        assert not list(tmp_path.iterdir())


def values(text, **more):
    plan = make_plan(load_problem("point_to_point"), {"mass": text}, more.get("sample"), "sobol", 0, ())
    return plan.values[0]


def test_values_of_equal_ratio():
    np.testing.assert_allclose(values("1:100:log5"), 10.0 ** np.arange(0, 2.1, 0.5), rtol=1e-14)
    assert values("1:100:log5")[[0, -1]].tolist() == [1.0, 100.0] and values(" 4 : 1 : log3").tolist() == [
        4,
        2,
        1,
    ]
    assert values("1:100:3").tolist() == [1.0, 50.5, 100.0]
    spread = np.log10(values("1:100:log", sample=256))
    assert spread.min() >= 0 and spread.max() <= 2
    assert np.histogram(spread, 4, (0, 2))[0].tolist() == [64] * 4
    assert np.histogram(values("1:100", sample=256), 4, (1, 100))[0].tolist() == [64] * 4


@pytest.mark.parametrize(
    "text, sample, told",
    [
        ("0:100:log5", None, "range with log must be of numbers above 0; got 0 to 100"),
        ("-1:100:log5", None, "numbers above 0"),
        ("1:100:log", None, "'1:100:log' is not of the form start:stop:count"),
        ("1:100:log2.5", None, "whole number of at least 1"),
        ("1:100:logs", None, "not of the form"),
        ("1:log5", None, "not of the form"),
        ("1:100:log5", 8, "not of the form start:stop in a sample"),
        ("0:100:log", 8, "numbers above 0"),
    ],
)
def test_ranges_that_have_no_equal_ratio_are_refused(text, sample, told):
    with pytest.raises(ValueError, match=re.escape(told)):
        values(text, sample=sample)


def test_a_sweep_is_told_as_json(run, tmp_path):
    given = ("sweep", "point_to_point", "--vary", "mass=1:4:log3", "--vary", "duration=20,26", "--workers", 1)
    code, out, err = run(*given, "--steps", 40, "--out", "map.nc", "--json")
    told = json.loads(out)
    assert (code, err) == (0, "") and (told["points"], told["solved"], told["checks_fail"]) == (6, 6, 0)
    assert (told["problem"], told["file"], told["varied"]) == ("point_to_point", "map.nc", ["mass", "duration"])
    assert (told["objective"], told["objective_unit"]) == ("effort", "N^2 s")
    each = [(point["parameters"]["mass"], point["parameters"]["duration"]) for point in told["results"]]
    assert each == [(mass, duration) for mass in (1.0, 2.0, 4.0) for duration in (20.0, 26.0)]
    for (mass, duration), point in zip(each, told["results"], strict=True):
        assert point["duration"] == duration
        assert point["objective"] == pytest.approx(6 * mass**2 * 13**2 / duration**3, rel=1e-2)
        assert point["success"] is True and point["status"] == "solved"


def test_the_points_of_a_sample_are_told_with_their_parameters():
    file = load_problem("point_to_point")
    plan = make_plan(file, {"mass": "1:4:log", "duration": "20:26"}, 3, "sobol", 0, ())
    records = [{"success": i < 2, "checks_hold": i < 1, "objective": float(i)} for i in range(3)]
    told = sweep_object(sweep_dataset(plan, records, {"problem": file.name}), "map.nc")
    assert (told["points"], told["solved"], told["checks_fail"]) == (3, 2, 1)
    for i, point in enumerate(told["results"]):
        assert point["parameters"] == {"mass": plan.values[0][i], "duration": plan.values[1][i]}
        assert point["objective"] == i
