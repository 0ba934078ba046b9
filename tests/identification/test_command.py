"""`dmoc identify`, as its user sees it."""

import json

import numpy as np
import pytest

from dmoc import Flight
from dmoc.cli.app import main


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main(["identify", *map(str, arguments)])
    return ended.value.code or 0, capsys.readouterr()


ASKED = ["--unknown", "mass=10", "--unknown", "drag=1", "--unknown", "offset", "--noise", "0.001"]


def test_the_flight_that_comes_with_dmoc(capsys, tmp_path, monkeypatch):
    """In an empty folder: its table says what the truth is."""
    monkeypatch.chdir(tmp_path)
    code, told = run(capsys, "free_flyer", *ASKED, "--out", "e.json", "--plot", "e.png")
    assert code == 0 and "301 samples in 30 s, 15 without a position" in told.out
    assert "wrote e.json" in told.out and (tmp_path / "e.png").stat().st_size > 10_000
    found = json.loads((tmp_path / "e.json").read_text())
    truth = {"mass": 18.9715, "linear_drag_1_coefficient": 1.2, "offset.x": 0.05, "offset.y": -0.03}
    for name, value in truth.items():
        one = found["numbers"][name]
        assert abs(one["value"] - value) < 3.5 * one["sigma"], name
    code, told = run(capsys, "free_flyer", *ASKED, "--json")
    again = json.loads(told.out)
    assert code == 0 and again["numbers"] == found["numbers"] and again["success"]


def test_a_scene_says_what_the_body_is(capsys):
    code, told = run(
        capsys,
        *("free_flyer", "--scene", "hovercraft", "--unknown", "mass"),
        *("--unknown", "linear_drag_1_coefficient=1", "--unknown", "offset", "--noise", 0.001, "--json"),
    )
    found = json.loads(told.out)["numbers"]
    assert code == 0 and found["mass"]["value"] == pytest.approx(18.97, abs=0.1)
    assert found["linear_drag_1_coefficient"]["believed"] == 1


def test_a_known_mass_and_a_belief(capsys):
    code, told = run(
        capsys, "free_flyer", "--mass", 18.9715, "--unknown", "drag=1.3,0.1", "--unknown", "offset", "--json"
    )
    found = json.loads(told.out)
    assert code == 0 and "mass" not in found["numbers"] and found["noise_found"]
    assert found["noise"] == pytest.approx(1e-3, rel=0.15)


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["nowhere"], "there is no flight 'nowhere'; give a CSV table, or one of free_flyer, satellite"),
        (["nowhere.csv"], "there is no flight nowhere.csv"),
        (["free_flyer", "--unknown", "colour"], "no number is called 'colour'; there are mass, offset"),
        (["free_flyer", "--unknown", "mass=heavy"], "NAME=VALUE,SIGMA; got 'mass=heavy'"),
        (["free_flyer", "--scene", "hohmann"], "not a mission or a team"),
        (["free_flyer", "--plot", "x.txt"], "x.txt"),
    ],
)
def test_what_cannot_be_read_is_one_line(capsys, arguments, words):
    code, told = run(capsys, *arguments)
    assert code == 2 and told.out == "" and told.err.count("\n") == 1 and words in told.err


def test_a_flight_that_fits_nothing_exits_with_three(capsys, tmp_path):
    """Positions that jump by kilometres, around an attractor that may weigh anything."""
    file = tmp_path / "jump.csv"
    times = np.arange(8.0)
    place = np.array([[1, 0], [0, 1], [-1, 0.1], [0.2, -1], [90, 0], [0, 2], [1, 1], [-5, 0.3]])
    Flight(times, place, np.zeros((8, 2))).save(file)
    code, told = run(
        capsys, file, "--scene", "orbit_raise", "--unknown", "point_gravity_1_mu=5", "--noise", 1e-6
    )
    assert code == 3 and "Failed: the least-squares problem did not converge" in told.out
