"""Functions of bodies on links, taken away and used without the package's own solve."""

import json
import subprocess
import sys

import casadi as ca
import numpy as np
import pytest

from dmoc import export, simulate, solve
from dmoc.assembly.compiled import compiler
from dmoc.scene.problem_file import load_problem


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    folder = tmp_path_factory.mktemp("arm") / "functions"
    problem = load_problem("arm_reach").make()
    export(problem, folder, order=4, steps=20, c=False)
    return problem, lambda name: ca.Function.load(str(folder / f"{name}.casadi"))


def test_the_solver_finds_the_same_and_takes_other_ends(arm):
    _, take = arm
    solver, nominal = take("solver"), take("nominal")
    given = {name: value for name, value in nominal.call({}).items() if name in solver.name_in()}
    for angles in ((1.2, 2.0), (1.0, 1.5)):
        other = load_problem("arm_reach").make(upper=angles[0], lower=angles[1])
        for name in ("elbow", "hand"):
            state = dict(zip(other.goal.names, other.goal.states, strict=True))[name]
            given[f"goal_{name}_position"] = ca.DM(state.position)
        plan, found = solver.call(given), solve(other, order=4, steps=20)
        assert float(plan["objective"]) == pytest.approx(found.objective, rel=1e-6)
        np.testing.assert_allclose(plan["positions"].full().T, found.position, atol=1e-6)
        np.testing.assert_allclose(plan["reactions"].full().T, found.path.reaction, atol=1e-4)
        assert float(plan["largest_residual"]) < 1e-8 and float(plan["largest_residual_links"]) < 1e-9
        assert 0 < float(plan["largest_turn"]) < np.pi / 2


def test_step_and_residual_are_those_of_a_simulation(arm):
    problem, take = arm
    push = 0.3 * np.random.default_rng(2).normal(size=(41, 2))
    flight = simulate(problem, push, 20, 4)
    step, residual = take("step"), take("residual")
    first = step(
        position=flight.position[0],
        velocity=flight.velocity[0],
        mass=problem.mass,
        time=0.0,
        time_step=problem.duration / 20,
        forces=push[:3].T,
    )
    np.testing.assert_allclose(first["next_position"].full().ravel(), flight.position[1], atol=1e-13)
    np.testing.assert_allclose(first["next_velocity"].full().ravel(), flight.velocity[1], atol=1e-12)
    found = solve(problem, order=4, steps=20)
    given = {
        "positions": found.position.T,
        "start_velocity": found.velocity[0],
        "goal_velocity": found.velocity[-1],
        "forces": found.path.control.T,
        "mass": problem.mass,
        "start_time": 0.0,
        "duration": problem.duration,
    }
    left = residual.call(given)
    assert np.abs(left["residual"].full()).max() < 1e-8
    given["positions"] = given["positions"] + 1e-3
    assert np.abs(residual.call(given)["residual_links"].full()).max() > 1e-4


def test_bodies_on_joints_leave_the_package_as_they_are_solved(tmp_path):
    problem = load_problem("arm_in_space").make()
    export(problem, tmp_path / "functions", order=4, steps=20, c=False)
    take = {
        name: ca.Function.load(str(tmp_path / f"functions/{name}.casadi"))
        for name in ("solver", "nominal", "step")
    }
    given = {
        name: value for name, value in take["nominal"].call({}).items() if name in take["solver"].name_in()
    }
    plan, found = take["solver"].call(given), solve(problem, order=4, steps=20)
    assert float(plan["objective"]) == pytest.approx(found.objective, rel=1e-9)
    np.testing.assert_allclose(plan["positions"].full().T, found.position, atol=1e-9)
    np.testing.assert_allclose(plan["attitudes"].full().T, found.attitude, atol=1e-9)
    # Where the joints are at the goal is an argument.
    other = load_problem("arm_in_space").make(shoulder_angle=0.7, elbow_angle=-1.0)
    changed = given | {"goal_upper_value": 0.7, "goal_fore_value": -1.0}
    wanted = solve(other, order=4, steps=20).objective
    assert float(take["solver"].call(changed)["objective"]) == pytest.approx(wanted, rel=1e-8)
    manifest = json.loads((tmp_path / "functions/manifest.json").read_text())["functions"]["solver"]
    told = {one["name"]: one["unit"] for one in manifest["inputs"] + manifest["outputs"]}
    assert (told["goal_fore_value"], told["goal_fore_rate"]) == ("rad", "rad/s")
    assert (told["largest_residual_links"], told["reactions"]) == ("m, rad", "m^2/s^2, m/s^2")
    norms = plan["residual_norm"].full()
    assert norms.shape == (3, 41) and float(plan["largest_residual_norm"]) == np.abs(norms).max() < 1e-12
    # The forearm turns further from node to node than the direction of any link.
    assert float(plan["largest_turn"]) == pytest.approx(found.path.largest_turn, rel=1e-9)
    push = 0.01 * np.random.default_rng(2).normal(size=(41, 2))
    flight = simulate(problem, push, 20, 4)
    first = take["step"](
        position=flight.position[0],
        attitude=flight.attitude[0],
        velocity=flight.velocity[0],
        rate=flight.rate[0],
        mass=problem.mass,
        time=0.0,
        time_step=problem.duration / 20,
        forces=push[:3].T,
    )
    for name, rows in (("position", flight.position), ("attitude", flight.attitude), ("rate", flight.rate)):
        np.testing.assert_allclose(first[f"next_{name}"].full().ravel(), rows[1], atol=1e-12)


# Runs where dmoc is not to be had: a library of C code and inputs in, outputs out.
ALONE = """
import json, sys
sys.modules["dmoc"] = None
import casadi as ca, numpy as np
for name, file, given in json.load(sys.stdin):
    found = ca.external(name, file)(**{key: np.array(value) for key, value in given.items()})
    print(json.dumps({key: np.array(ca.densify(value)).tolist() for key, value in found.items()}))
"""


@pytest.mark.skipif(compiler() is None, reason="needs a C compiler")
@pytest.mark.parametrize("name", ["arm_in_space", "cart_pole"])
def test_c_code_of_joints_and_of_rods_gives_the_same_where_there_is_no_dmoc(name, tmp_path):
    problem, steps = load_problem(name).make(), 20
    export(problem, tmp_path / "out", order=4, steps=steps)
    sources, library = tmp_path / "out/c/functions.c", tmp_path / "functions.so"
    flags = ["-std=c99", "-Wall", "-Werror", "-O0", "-shared", "-fPIC"]
    subprocess.run([compiler(), *flags, sources, "-lm", "-o", library], check=True)
    made = {
        each: ca.Function.load(str(tmp_path / f"out/{each}.casadi")) for each in ("step", "rollout", "residual")
    }
    push = 0.1 * np.random.default_rng(4).normal(size=(problem.controls, 2 * steps + 1))
    flight = simulate(problem, push.T, steps, 4)
    parts = {name: getattr(flight, name) for name in ("position", "attitude", "velocity", "rate")}
    state = {name: rows[0] for name, rows in parts.items() if rows is not None}
    times = {"duration": problem.duration_bounds[1], "start_time": 0.0}
    rolled = {**state, "mass": problem.mass, **times, "forces": push}
    flown = made["rollout"](**rolled)
    jobs = {
        "step": {**state, "mass": problem.mass, "time": 0.0, "time_step": 0.05, "forces": push[:, :3]},
        "rollout": rolled,
        "residual": {
            **{part: flown[part] for part in ("positions", "attitudes") if part in flown},
            **{
                f"{end}_{part}": state[part]
                for end in ("start", "goal")
                for part in ("velocity", "rate")
                if part in state
            },
            "forces": push,
            "mass": problem.mass,
            **times,
        },
    }
    plain = [
        (each, str(library), {key: np.array(value).tolist() for key, value in given.items()})
        for each, given in jobs.items()
    ]
    command = [sys.executable, "-I", "-c", ALONE]
    done = subprocess.run(command, input=json.dumps(plain), capture_output=True, text=True, check=True)
    for (each, given), line in zip(jobs.items(), done.stdout.splitlines(), strict=True):
        expected, found = made[each](**given), json.loads(line)
        assert found.keys() == expected.keys()
        for key, value in expected.items():
            value = np.array(ca.densify(value))
            assert np.isfinite(value).all()
            np.testing.assert_allclose(found[key], value, atol=1e-12 * (1 + np.abs(value).max()), err_msg=key)
    assert np.abs(np.array(flown["positions"])[:, -1] - np.array(flown["positions"])[:, 0]).max() > 1e-4
