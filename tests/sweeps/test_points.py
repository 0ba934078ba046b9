"""Points of a sweep whose paths were kept: guesses and pictures."""

import numpy as np
import pytest

from dmoc import solve, sweep
from dmoc.cli.app import main
from dmoc.scene.problem_file import load_problem
from dmoc.sweeps.points import answer_of, start_from


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A sweep of three durations, and one without paths."""
    folder = tmp_path_factory.mktemp("points")
    numerics = {"order": 4, "steps": 6, "workers": 1}
    sweep("point_to_point", {"duration": [20.0, 24.0, 30.0]}, folder / "map.nc", keep="paths", **numerics)
    sweep("point_to_point", {"duration": [20.0, 24.0]}, folder / "bare.nc", **numerics)
    return folder


def test_a_point_is_the_path_that_was_found_there(kept):
    path = start_from(f"{kept / 'map.nc'}:duration=24.4")
    own = solve(load_problem("point_to_point").make(duration=24.0), order=4, steps=6)
    assert path.duration == pytest.approx(24.0)
    assert path.position == pytest.approx(own.path.position, abs=1e-9)
    by_number = start_from(f"{kept / 'map.nc'}:1")
    assert np.array_equal(by_number.position, path.position)


def test_the_answer_of_a_point_is_found_again_at_once(kept):
    found = answer_of(kept / "map.nc", "duration=30")
    assert found.success and (found.order, found.steps, found.duration) == (4, 6, 30.0)
    assert found.iterations <= 2


def test_a_point_is_drawn_and_is_a_guess_of_a_solve(kept, monkeypatch, capsys):
    monkeypatch.chdir(kept)
    for arguments in (
        ["plot", "map.nc:duration=20"],
        ["solve", "point_to_point", "--guess", "map.nc:0", "--set", "duration=21", "--quiet"],
    ):
        with pytest.raises(SystemExit, match="0"):
            main(arguments)
    assert (kept / "map_duration_20.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    "point, said",
    [
        ("map.nc:3", "points 0 to 2; got 3"),
        ("map.nc:mass=2", "map.nc has duration, got 'mass=2'"),
        ("map.nc:duration=long", "duration must be a number; got 'long'"),
        ("bare.nc:0", "has no paths; sweep again with --keep paths"),
    ],
)
def test_what_is_no_point_is_refused_in_one_line(kept, monkeypatch, capsys, point, said):
    monkeypatch.chdir(kept)
    for arguments in (["plot", point], ["solve", "point_to_point", "--guess", point]):
        with pytest.raises(SystemExit, match="2"):
            main(arguments)
        told = capsys.readouterr().err
        assert said in told and told.count("\n") == 1
