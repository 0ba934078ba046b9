"""Missions from the command line: what is printed, saved and drawn, and with which exit code."""

from __future__ import annotations

import json

import numpy as np
import pytest

from dmoc import Leg, Mission, State, load, solve
from dmoc.cli.app import main
from dmoc.cli.options import CHECK_FAILED, NOT_SOLVED, SOLVED
from dmoc.ipopt.watch import Interrupt

HOHMANN = '''"""From one circular orbit to another by two impulses."""
from dmoc import CircularOrbit, Coast, DeltaV, Impulse, Mission, PointGravity


def problem(radius=2.0, limit=None):
    """
    Parameters
    ----------
    radius : float [m]
        Of the orbit at the goal.
    """
    ends = CircularOrbit(1.0, mu=1.0, center=(0, 0)), CircularOrbit(radius, mu=1.0)
    legs = [Impulse(limit), Coast((1, 60)), Impulse(limit)]
    return Mission(1.0, *ends, legs, [PointGravity(1.0)], objective=DeltaV())
'''
GATES = '''"""Over a gate to rest."""
from dmoc import BallForce, Leg, Mission, State, Via


def problem(limit=30.0, span=0.9, distance=2.0):
    home = Leg((0.1, span), actuator=BallForce(limit), name="home")
    legs = [Leg((0.1, span)), Via((1, 1)), home]
    return Mission(2.0, State((0, 0), (0, 0)), State((distance, 0), (0, 0)), legs, actuator=BallForce(50.0))
'''


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "hohmann.py").write_text(HOHMANN)
    (tmp_path / "gates.py").write_text(GATES)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    return ended.value.code, capsys.readouterr()


def test_a_mission_is_solved_saved_drawn_checked_and_drawn_again(folder, capsys):
    code, said = run(capsys, "solve", "hohmann.py", "--out", "flight.nc", "--plot", "flight.png")
    assert code == SOLVED and "delta v 0.284456" in said.out
    words = " ".join(said.out.split())
    assert "Impulses" in words and "no further impulse would help" in words
    assert (folder / "flight.png").stat().st_size > 1000
    code, said = run(capsys, "check", "flight.nc")
    assert code == SOLVED and "primer" in said.out and "joints" in said.out
    code, said = run(capsys, "plot", "flight.nc", "--out", "again.svg")
    assert code == SOLVED and "not attached" not in (folder / "again.svg").read_text()


def test_the_json_of_a_mission_has_its_legs_impulses_and_primer(folder, capsys):
    code, said = run(capsys, "solve", "hohmann.py", "--json")
    found = json.loads(said.out)
    assert code == SOLVED and found["legs"][0]["name"] == "coast 1"
    assert sum(kick["size"] for kick in found["impulses"]) == pytest.approx(found["objective"], rel=1e-9)
    assert [kick["at"] for kick in found["impulses"]] == ["start", "goal"]
    assert max(found["primer"]["length"]) == pytest.approx(1.0, abs=1e-5)
    assert found["primer"]["time"][-1] == pytest.approx(found["duration"])


@pytest.mark.slow
def test_rows_that_are_not_met_are_told_by_leg_in_units(folder, capsys):
    code, said = run(capsys, "solve", "hohmann.py", "--set", "limit=0.1", "--json")
    found = json.loads(said.out)
    assert code == NOT_SOLVED and not found["success"]
    rows = {row["row"]: row for row in found["worst"]}
    assert {row["unit"] for row in found["worst"]} <= {"N", "m", "m/s", "kg", "s", "-"}
    assert any(name.startswith(("coast 1: ", "start.", "goal.")) for name in rows)


def test_a_violation_is_told_in_the_size_of_its_unit():
    """An iterate whose joint and motion are off by known sizes."""
    legs = [Leg(1.0, name="out"), Leg(1.0, name="back")]
    mission = Mission(2.0, State((0, 0), (0, 0)), State((1e6, 0), (0, 0)), legs)
    solution = solve(mission, order=2, steps=10)
    from dmoc.chains.program import MissionProgram
    from dmoc.ipopt.run import Answer
    from dmoc.missions.answer import worst_rows

    program = MissionProgram.of(mission, mission.stretches, solution.path)
    x = program.pack(solution.path)
    g = program.assembly().constraints(x, program.parameters()).full().ravel()
    name = program.rows["joint 1"]
    place = program.first_row + name.start + name.labels.index("position.y")
    g[place] += 5.0 * name.scales[0, name.labels.index("position.y")]
    lam = np.zeros(len(x)), np.zeros(len(g))
    answer = Answer(x, *lam, g, 0.0, "infeasible", 1, 1, 0.0)
    found = worst_rows(program, answer, solution.path)
    assert [(row, unit) for row, _, unit in found] == [("joint 1.position.y", "m")]
    assert found[0][1] == pytest.approx(5.0)
    # A force of 1 kN too much on one node of the second leg, over its share of the time.
    moved = g - 5.0 * name.scales[0, name.labels.index("position.y")] * (np.arange(len(g)) == place)
    placed = program.legs[1]
    rows = placed.program.rows["dynamics"]
    at = rows.indices[0, 4]
    h = solution.legs[1].duration / 10
    moved[placed.rows + at] += 1000.0 * h / 2.0 * rows.scales[4, 0]
    found = worst_rows(program, Answer(x, *lam, moved, 0.0, "infeasible", 1, 1, 0.0), solution.path)
    assert found[0][0] == "back: dynamics[4].x" and found[0][2] == "N"
    assert found[0][1] == pytest.approx(1000.0)


def test_a_time_limit_ends_a_mission_with_the_last_mesh_that_was_solved(folder, capsys, monkeypatch):
    late = {"after": 2}

    def over(self):
        return self.seconds is not None and len(solved) >= late["after"]

    from dmoc.missions import climb

    solved: list = []
    attempt = climb.Climb.attempt

    def counted(self, *given, **more):
        found = attempt(self, *given, **more)
        solved.append(found)
        return found

    monkeypatch.setattr(climb.Climb, "attempt", counted)
    monkeypatch.setattr(Interrupt, "late", property(over))
    code, said = run(capsys, "solve", "hohmann.py", "--tol", "1e-11", "--time-limit", "60")
    assert code == CHECK_FAILED and "this is the answer on the last mesh that was solved" in " ".join(
        said.out.split()
    )
    assert len(solved) == 3 and solved[-1].answer.status == "stopped"
    late["after"] = 0
    solved.clear()
    code, said = run(capsys, "solve", "hohmann.py", "--time-limit", "60", "--quiet")
    assert "Solved" not in said.out and "Not solved: failed" in said.out


@pytest.mark.parametrize("more", [["--hold"], ["--compiled"], ["--guess", "known.nc"], ["--tol", "1e-6"]])
def test_options_of_a_solve_work_for_missions(folder, capsys, more):
    if "known.nc" in more:
        run(capsys, "solve", "gates.py", "--out", "known.nc")
    code, said = run(capsys, "solve", "gates.py", "--quiet", *more)
    assert code == SOLVED and said.out.count("\n") == 1 and "Every check holds" in said.out


def test_a_guess_from_a_file_is_near(folder, capsys):
    run(capsys, "solve", "gates.py", "--out", "known.nc")
    assert load("known.nc").iterations > 4
    code, said = run(capsys, "solve", "gates.py", "--guess", "known.nc", "--json")
    assert code == SOLVED and json.loads(said.out)["iterations"] <= 4
