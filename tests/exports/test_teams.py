"""Exported teams: the solver answers as `solve` does, for other numbers too, and bodies step as flown."""

from __future__ import annotations

import json
import subprocess
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from dmoc import Apart, BallForce, Engine, Free, Fuel, Meet, State, Team, TransferProblem, export, solve
from dmoc.planners.team import TeamPlanner
from dmoc.planners.whole import mission_functions


def meeting(light=1.0):
    """Two bodies that meet at rest in the middle of their masses."""
    bodies = [
        TransferProblem(mass, State((x, 0), (0, 0)), Free(), duration=5.0)
        for mass, x in ((light, 0.0), (2.0, 3.0))
    ]
    return Team(bodies, [Meet()], names=("light", "heavy"))


def passing():
    """Two bodies with limits that change places head-on, in a free time."""
    bodies = [
        TransferProblem(1.0, State((x, 0), (0, 0)), State((-x, 0), (0, 0)), (2.0, 6.0), actuator=BallForce(3.0))
        for x in (-1.0, 1.0)
    ]
    return Team(bodies, [Apart(0.5)])


def rockets():
    bodies = [
        TransferProblem(
            1.0,
            State((x, 0), (0, 0)),
            Free(),
            (4.0, 6.0),
            actuator=Engine(2.0, exhaust_velocity=20.0),
            objective=Fuel(),
        )
        for x in (0.0, 3.0)
    ]
    return Team(bodies, [Meet()])


def functions_of(team, found):
    planner = TeamPlanner.of(team, None, None, False, found)
    return planner, {one.function.name(): one.function for one in mission_functions(planner)}


@pytest.mark.parametrize("make", [meeting, passing, rockets])
def test_the_exported_solver_gives_the_answer_of_solve(make):
    found = solve(make(), order=4, steps=20)
    planner, functions = functions_of(make(), found)
    inputs = functions["nominal"]()
    plan = functions["warm_solver"](**inputs)
    assert functions["warm_solver"].stats()["return_status"] == "Solve_Succeeded"
    # A duration at its limit is within the last barrier parameter of it.
    assert float(plan["objective"]) == pytest.approx(found.objective, rel=1e-8)
    assert float(plan["violation"]) < 1e-10 and float(plan["largest_residual"]) < 1e-8
    given = {name.removeprefix("guess_"): value for name, value in inputs.items()}
    cost = functions["cost"](**{name: given[name] for name in functions["cost"].name_in()})["cost"]
    assert float(cost) == pytest.approx(found.objective, rel=1e-12)
    for name, body in zip(planner.names, found.members, strict=True):
        np.testing.assert_allclose(np.array(plan[f"{name}_positions"]).T, body.position, atol=1e-6)
        flown = functions[f"rollout_{name}"](
            position=body.position[0],
            velocity=body.velocity[0],
            mass=body.path.mass[0],
            start_time=0.0,
            duration=found.duration,
            forces=body.path.control.T,
            **({"actuator_exhaust_velocity": 20.0} if make is rockets else {}),
        )
        np.testing.assert_allclose(np.array(flown["positions"]).T, body.position, atol=1e-9)


def test_other_numbers_give_the_answer_of_the_team_that_has_them():
    _, functions = functions_of(meeting(), solve(meeting()))
    inputs = functions["nominal"]() | {"light_mass": 1.5, "heavy_start_position": (3.0, 1.0), "duration": 4.0}
    plan = functions["solver"](**inputs)
    light, heavy = meeting(1.5).members
    moved = replace(heavy, start=State((3, 1), (0, 0)), duration=4.0)
    other = solve(Team([replace(light, duration=4.0), moved], [Meet()]))
    assert float(plan["objective"]) == pytest.approx(other.objective, rel=1e-10)


def test_bodies_that_come_too_near_are_seen_in_the_residual():
    team = passing()
    found = solve(team, order=4, steps=20)
    _, functions = functions_of(team, found)
    inputs = {name.removeprefix("guess_"): value for name, value in functions["nominal"]().items()}
    given = {name: inputs[name] for name in functions["residual"].name_in()}
    assert float(functions["residual"](**given)["violation"]) < 1e-9
    given["body_2_positions"] = given["body_1_positions"]
    assert float(ca.mmax(ca.fabs(functions["residual"](**given)["apart_body_1_and_body_2_rows"]))) > 0.9


def test_files_and_c_code_of_a_team_are_its_functions(tmp_path):
    team = meeting()
    files = export(team, tmp_path / "out", order=4, steps=6)
    manifest = json.loads(files[0].read_text())
    assert manifest["bodies"].keys() == {"light", "heavy"} and "legs" not in manifest
    for name, entry in manifest["functions"].items():
        function = ca.Function.load(str(tmp_path / "out" / entry["file"]))
        assert function.name_in() == [one["name"] for one in entry["inputs"]], name
        assert all(one["unit"] and one["words"] for one in entry["inputs"] + entry["outputs"] if one["name"])
    folder = tmp_path / "out" / "c"
    assert "rollout_heavy" in (folder / "team.h").read_text()
    assert "`light`, `heavy`" in (tmp_path / "out" / "README.md").read_text()
    # Newer compilers refuse what older ones warn of.
    strict = ["cc", "-O0", "-Werror", "-shared", "-fPIC", "functions.c", "-lm", "-o", "f.so"]
    subprocess.run(strict, cwd=folder, check=True)
    function, in_c = (
        ca.Function.load(str(tmp_path / "out" / "residual.casadi")),
        ca.external("residual", str(folder / "f.so")),
    )
    given = [ca.DM(np.random.default_rng(1).uniform(1, 2, function.size_in(i))) for i in range(function.n_in())]
    for one, other in zip(in_c.call(given), function.call(given), strict=True):
        np.testing.assert_allclose(np.array(one), np.array(other), rtol=1e-9, atol=1e-9)
