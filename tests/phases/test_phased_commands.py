"""Teams of missions from the command line: what is printed, saved and drawn, and what is refused."""

from __future__ import annotations

import json

import pytest

from dmoc import solve, verify
from dmoc.cli.app import main
from dmoc.cli.options import BAD_INPUT, SOLVED
from dmoc.films.frames import scene_of
from dmoc.phases.climb import team_optima
from dmoc.plots.page import figure
from dmoc.scene.problem_file import load_problem
from dmoc.sweeps.data import read_sweep


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    return ended.value.code, capsys.readouterr()


def test_it_is_solved_saved_checked_converted_and_shown(folder, capsys):
    code, said = run(capsys, "solve", "delivery", "--steps", "12", "--out", "flight.nc")
    words = " ".join(said.out.split())
    assert code == SOLVED and "Every check holds" in words and "Phases" in words
    assert "loaded leg 1, part 1" in words and "empty leg 1, part 2" in words
    code, said = run(capsys, "check", "flight.nc", "--json")
    found = json.loads(said.out)
    assert code == SOLVED and found["checks"]["joints"]["ok"] and found["checks"]["together"]["ok"]
    assert [leg["name"] for leg in found["bodies"][0]["legs"]] == ["loaded", "empty"]
    code, said = run(capsys, "convert", "flight.nc", "--to", "csv")
    assert code == SOLVED and "courier, loaded" in (folder / "flight.csv").read_text()
    code, said = run(capsys, "show", "delivery")
    assert code == SOLVED and "9.6 kg are left behind" in said.out and "all bodies keep 1 m apart" in said.out
    code, said = run(capsys, "simulate", "delivery", "--controls", "flight.nc", "--json")
    assert json.loads(said.out)["bodies"]["courier"]["final_mass"] == pytest.approx(9.6)


@pytest.mark.parametrize(
    "arguments, said",
    [
        (("effects", "delivery"), "is a team of bodies"),
        (("solve", "delivery", "--impulses", "auto"), "a dmoc.Team has neither"),
        (("solve", "delivery", "--set", "distance=9"), "but are to keep 9 m"),
        (("solve", "delivery", "--set", "load=-1"), "Drop: mass"),
    ],
)
def test_what_it_cannot_is_refused_in_one_line(folder, capsys, arguments, said):
    code, told = run(capsys, *arguments)
    assert code == BAD_INPUT and said in told.err and told.err.count("\n") == 1


def test_the_page_and_the_film_show_the_joint_and_both_bodies():
    found = solve(load_problem("delivery").make(), steps=8)
    page = figure(found, verify(found))
    path, forces, *_ = page.axes
    (joint,) = [line for line in path.lines if line.get_label() == "joint"]
    assert joint.get_xydata()[0] == pytest.approx([1.0, 0.5])
    begin = found.members[0].legs[1].provenance.start_time
    assert any(list(line.get_xdata()) == [begin, begin] for line in forces.lines)
    scene = scene_of(found, 11)
    assert scene.names == ["courier", "crosser"] and [place.shape for place in scene.places] == [(11, 2)] * 2
    assert scene.joints[0] == pytest.approx([1.0, 0.5])


@pytest.mark.slow
def test_several_starts_pass_on_other_sides_and_a_sweep_goes_from_point_to_point(folder, capsys):
    found = team_optima(load_problem("delivery").make(), 2)
    assert [round(one.objective, 2) for one in found] == [1.56, 1.7] and found[1].starts == ("sides -",)
    code, _ = run(
        capsys,
        "sweep",
        "delivery",
        "--vary",
        "distance=0.9,1.0",
        "--steps",
        "16",
        "--workers",
        "1",
        "--out",
        "map.nc",
    )
    data = read_sweep(folder / "map.nc")
    assert code == SOLVED
    assert data.effort.values == pytest.approx(data.objective.values, rel=1e-9)
