"""Teams from the command line: what is printed, saved and drawn, with which exit code, and what is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest

from dmoc import Apart, Meet, State, Team, TransferProblem, load, solve, verify
from dmoc.cli.app import main
from dmoc.cli.options import BAD_INPUT, CHECK_FAILED, NOT_SOLVED, SOLVED
from dmoc.legs.ends import Free
from dmoc.plots.page import figure
from dmoc.plots.team import BODY_COLOURS
from dmoc.sweeps.data import read_sweep
from dmoc.sweeps.worker import pack, unpack

SWAP = '''"""Two robots change places."""
from dmoc import Apart, BallForce, FreeForce, State, Team, TransferProblem


def problem(distance=0.4, limit=None):
    """
    Parameters
    ----------
    distance : float [m]
        Least distance.
    """
    actuator = FreeForce() if limit is None else BallForce(limit)
    robots = [
        TransferProblem(1.0, State((-x, 0), (0, 0)), State((x, 0), (0, 0)), 10.0, actuator=actuator, name=name)
        for x, name in ((1.0, "red"), (-1.0, "green"))
    ]
    return Team(robots, [Apart(distance)])
'''
LEAST = 2 * (24 + 24 * 0.4**2) / 10.0**3


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "swap.py").write_text(SWAP)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    return ended.value.code, capsys.readouterr()


def test_a_team_is_solved_saved_drawn_checked_and_drawn_again(folder, capsys):
    code, said = run(capsys, "solve", "swap.py", "--out", "flight.nc", "--plot", "flight.png")
    assert code == SOLVED and f"effort {LEAST:.6g}" in said.out and "Every check holds" in said.out
    words = " ".join(said.out.split())
    assert "red, green 0.4 5 s" in words and "together" in words
    assert (folder / "flight.png").stat().st_size > 1000
    code, said = run(capsys, "check", "flight.nc")
    assert code == SOLVED and "together" in said.out
    code, said = run(capsys, "plot", "flight.nc", "--out", "again.svg")
    assert code == SOLVED and "not attached" not in (folder / "again.svg").read_text()
    code, said = run(capsys, "solve", "swap.py", "--guess", "flight.nc", "--quiet")
    assert code == SOLVED
    with pytest.raises(ValueError, match=r"must be a dmoc\.Team"):
        load("flight.nc").attach(3)


def test_a_file_is_checked_against_another_distance(folder, capsys):
    run(capsys, "solve", "swap.py", "--out", "flight.nc", "--quiet")
    (folder / "wider.py").write_text(
        SWAP.replace("distance=0.4", "distance=0.5").replace("Apart(distance)", "Apart(0.5)")
    )
    code, said = run(capsys, "check", "flight.nc", "--problem", "wider.py")
    assert code == CHECK_FAILED and "Checks that fail: together" in " ".join(said.out.split())


def test_the_json_of_a_team_has_its_bodies_and_their_distances(folder, capsys):
    code, said = run(capsys, "solve", "swap.py", "--json")
    found = json.loads(said.out)
    assert code == SOLVED and [body["name"] for body in found["bodies"]] == ["red", "green"]
    assert sum(body["cost"] for body in found["bodies"]) == pytest.approx(found["objective"], rel=1e-12)
    (pair,) = found["distances"]
    assert pair["between"] == ["red", "green"] and pair["least"] == pytest.approx(0.4) and pair["at"] == 5.0
    assert found["nodes"] == 2 * found["steps"] + 1
    assert found["checks"]["together"]["ok"] and "legs" not in found


def test_a_scene_is_shown_body_by_body(folder, capsys):
    code, said = run(capsys, "show", "swap.py")
    assert code == SOLVED and "red" in said.out and "all bodies keep 0.4 m apart" in said.out
    assert "Least distance." in said.out


def test_a_failure_names_bodies_and_distance(folder, capsys):
    code, said = run(capsys, "solve", "swap.py", "--set", "limit=0.07", "--json")
    found = json.loads(said.out)
    assert code == NOT_SOLVED and "between red and green" in found["message"] and "in red" in found["message"]
    assert found["worst"][0]["row"].startswith(("red", "green", "apart red and green"))


def test_every_body_of_a_team_is_simulated(folder, capsys):
    run(capsys, "solve", "swap.py", "--steps", "10", "--out", "flight.nc")
    code, said = run(capsys, "simulate", "swap.py", "--controls", "flight.nc", "--out", "marched.csv", "--json")
    found = json.loads(said.out)["bodies"]
    assert code == 0 and list(found) == ["red", "green"]
    team = load("flight.nc")
    for name, one in found.items():
        assert one["final_position"] == pytest.approx(team.of(name).position[-1], abs=1e-8)
        assert (folder / f"marched_{name}.csv").read_text().startswith("time [s]")
    code, said = run(capsys, "simulate", "swap.py")
    assert code == 0 and said.out.index("red:") < said.out.index("green:")


@pytest.mark.parametrize(
    "arguments, said",
    [
        (("export", "swap.py", "planner", "--order", "3"), "order must be one of 2, 4, 6, 8"),
        (("effects", "swap.py"), "is a team of bodies"),
        (("study", "swap.py"), "is a team of bodies"),
        (("solve", "swap.py", "--structure"), "a dmoc.Team has neither"),
        (("solve", "swap.py", "--impulses", "auto"), "a dmoc.Team has neither"),
        (("solve", "swap.py", "--set", "distance=3"), "start 2 m apart, but are to keep 3 m"),
    ],
)
def test_what_a_team_cannot_is_refused_in_one_line(folder, capsys, arguments, said):
    code, told = run(capsys, *arguments)
    assert code == BAD_INPUT and said in told.err and told.err.count("\n") == 1


def test_several_starts_pass_on_other_sides(folder, capsys):
    code, said = run(capsys, "solve", "swap.py", "--starts", "3")
    words = " ".join(said.out.split())
    assert code == SOLVED and "default" in words and "sides -" in words


def test_a_sweep_goes_from_point_to_point(folder, capsys):
    code, _ = run(capsys, "sweep", "swap.py", "--vary", "distance=0.3,0.4", "--out", "map.nc", "--workers", "1")
    data = read_sweep(folder / "map.nc")
    assert code == SOLVED
    assert data.objective.values == pytest.approx([2 * (24 + 24 * d**2) / 1000 for d in (0.3, 0.4)], rel=1e-6)
    # The efforts of both bodies are counted.
    assert data.effort.values == pytest.approx(data.objective.values, rel=1e-9)


def test_a_path_of_a_team_is_packed_to_the_last_bit():
    path = solve(swap(), steps=6).path
    back = unpack(pack(path))
    assert back.begins == path.begins and back.warm
    assert all(
        np.array_equal(old.position, new.position) for old, new in zip(path.legs, back.legs, strict=True)
    )
    assert all(np.array_equal(path.densities[name], back.densities[name]) for name in path.densities)


def swap(axes=2):
    still = (0,) * axes
    robots = [
        TransferProblem(1.0, State((-x, *still[1:]), still), State((x, *still[1:]), still), 10.0)
        for x in (1.0, -1.0)
    ]
    return Team(robots, [Apart(0.4)])


@pytest.mark.parametrize("axes", [2, 3])
def test_the_page_shows_every_body_in_its_colour_and_the_distance_against_its_limit(axes):
    found = solve(swap(axes), steps=12)
    page = figure(found, verify(found))
    path, forces, speeds, distances = page.axes
    named = {line.get_label(): line.get_color() for line in path.lines}
    assert [named[name] for name in found.names] == list(BODY_COLOURS[:2])
    assert (
        "Paths" in path.get_title(loc="left")
        and "hold" in page.texts[-1].get_text() + page._supxlabel.get_text()
    )
    # Where all bodies are at equal times is marked by numbers.
    assert sorted(text.get_text() for text in path.texts) == sorted(["1", "2", "3", "4", "5"] * 2)
    curves = {line.get_label(): line for line in distances.lines}
    assert min(curves["body 1, body 2"].get_ydata()) == pytest.approx(0.4, abs=1e-3)
    assert set(curves["to be kept"].get_ydata()) == {0.4}
    assert forces.get_title(loc="left").startswith("Forces") and speeds.get_ylabel().startswith("speeds")


def test_a_page_on_a_line_and_of_a_failed_solve():
    bodies = [TransferProblem(m, State((x,), (0,)), Free(), 5.0) for m, x in ((1.0, 0.0), (2.0, 3.0))]
    line = figure(solve(Team(bodies, [Meet()]), steps=4))
    assert line.axes[0].get_title(loc="left") == "Positions" or line.axes[0].get_title() == "Positions"
    failed = figure(solve(swap(), options={"ipopt.max_iter": 1}, steps=6))
    assert "NOT SOLVED" in failed.get_suptitle()
