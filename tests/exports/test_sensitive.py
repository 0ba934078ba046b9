"""Worth, covariance and prediction as CasADi functions; unknown constants of effects as arguments."""

import json

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    BallForce,
    KeepOut,
    LinearDrag,
    State,
    TransferProblem,
    UniformGravity,
    Unknown,
    disperse,
    export,
    predict,
    solve,
    worth,
)

PLAIN = [LinearDrag(1.0), UniformGravity((0.0, -0.1))]


def scene(effects=PLAIN, zones=1):
    start, goal = State((0, 0), (0, 0)), State((3, 1), (0, 0))
    zone = [KeepOut((1.5, 0.4), 0.5)] * zones
    return TransferProblem(10.0, start, goal, 10.0, effects=effects, actuator=BallForce(4.0), constraints=zone)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A solution, its functions, and what the exported solver gives for it."""
    solution = solve(scene(), order=4, steps=10)
    folder = tmp_path_factory.mktemp("functions") / "planner"
    export(scene(), folder, order=4, steps=10, guess=solution, c=False)
    functions = {path.stem: ca.Function.load(str(path)) for path in folder.glob("*.casadi")}
    inputs = functions["nominal"]()
    return solution, functions, inputs, functions["solver"](**inputs)


def test_worth_of_the_plan_that_the_solver_gives(made):
    solution, functions, inputs, plan = made
    function = functions["worth"]
    found = function(**{name: plan[name] if name in plan else inputs[name] for name in function.name_in()})
    for name, wanted in worth(solution).items():
        base, _, label = name.partition(".")
        if f"worth_{base}" in found:
            value = float(found[f"worth_{base}"][{"": 0, "x": 0, "y": 1}[label]])
            assert value == pytest.approx(wanted.value, rel=1e-6, abs=1e-7), name
    assert {"worth_mass", "worth_duration", "worth_keep_out_1_radius", "worth_goal_position"} <= found.keys()


def test_the_plan_for_other_numbers(made):
    solution, functions, inputs, _ = made
    function = functions["predict"]
    given = {name: inputs[name] for name in function.name_in()}
    same = function(**given)
    assert pytest.approx(solution.path.position, abs=1e-9) == np.array(same["positions"]).T
    assert pytest.approx(solution.velocity, abs=1e-6) == np.array(same["velocities"]).T
    moved = function(**(given | {"mass": 10.2, "goal_position": [3.0, 1.1]}))
    wanted = predict(solution, mass=10.2, goal_position=(3.0, 1.1))
    assert pytest.approx(wanted.position, abs=1e-12) == np.array(moved["positions"]).T
    assert pytest.approx(wanted.control, abs=1e-12) == np.array(moved["forces"]).T


def test_the_covariance_of_errors_at_the_start(made):
    solution, functions, *_ = made
    found = spread(
        functions["covariance"], solution, np.diag([0.01, 0.02, 0.001, 0.003]) ** 2, np.zeros((2, 2))
    )
    wanted = disperse(solution, start=((0.01, 0.02), (0.001, 0.003)), samples=2).covariance
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-18)


def test_the_covariance_of_forces_that_shake_every_step(made):
    """Against flights of the exported integrator itself with errors drawn anew each step."""
    solution, functions, *_ = made
    sigma, random = 0.02, np.random.default_rng(0)
    found = spread(functions["covariance"], solution, np.zeros((4, 4)), sigma**2 * np.eye(2))[-1]
    step, ends = functions["step"], []
    forces, mesh = solution.path.control, 10.0 / 10
    for _ in range(400):
        q, v = np.zeros(2), np.zeros(2)
        for k in range(10):
            shake = sigma * random.standard_normal(2)
            after = step(
                position=q,
                velocity=v,
                mass=10,
                time=k * mesh,
                time_step=mesh,
                forces=forces[2 * k : 2 * k + 3].T + shake[:, None],
            )
            q, v = (np.array(after[name]).ravel() for name in ("next_position", "next_velocity"))
        ends.append([*q, *v])
    assert np.sqrt(np.diag(found)) == pytest.approx(np.std(ends, axis=0), rel=0.12)


def spread(function, solution, start, force):
    given = {
        "positions": solution.path.position.T,
        "velocities": solution.velocity.T,
        "forces": solution.path.control.T,
        "start_time": 0.0,
        "duration": solution.duration,
        "mass": 10.0,
        "start_covariance": start,
        "force_covariance": force,
    }
    found = function(**{name: given[name] for name in function.name_in()})["covariances"].full()
    return found.reshape(4, -1, 4).transpose(1, 0, 2)


@pytest.mark.parametrize("order, steps", [(2, 20), (4, 10)])
def test_unknown_constants_are_arguments_of_all_functions(order, steps, tmp_path):
    """The solver for another drag, its residual, the integrator and the cost agree with a scene that has it."""
    effects = [LinearDrag(Unknown(1.0)), UniformGravity((0, Unknown(-0.1)))]
    export(scene(effects, zones=0), tmp_path / "planner", order=order, steps=steps, c=False)
    functions = {path.stem: ca.Function.load(str(path)) for path in (tmp_path / "planner").glob("*.casadi")}
    listed = json.loads((tmp_path / "planner" / "manifest.json").read_text())["functions"]["rollout"]["inputs"]
    assert listed[-2]["unit"] == "N s/m" and listed[-1]["unit"] == "m/s^2"
    drag, gravity = "linear_drag_1_coefficient", "uniform_gravity_2_acceleration"
    other = {drag: 1.5, gravity: [0, -0.12]}
    plan = functions["solver"](**(functions["nominal"]() | other))
    wanted = solve(scene([LinearDrag(1.5), UniformGravity((0, -0.12))], zones=0), order=order, steps=steps)
    assert float(plan["largest_residual"]) < 1e-7
    assert float(plan["objective"]) == pytest.approx(wanted.objective, rel=1e-7)
    flown = functions["rollout"](
        position=[0, 0], velocity=[0, 0], mass=10, start_time=0, duration=10, forces=plan["forces"], **other
    )
    assert flown["positions"].full()[:, -1] == pytest.approx([3, 1], abs=1e-6)
    for name in (
        "step",
        "rollout",
        "residual",
        "residual_jacobian",
        "worth",
        "covariance",
        "solver",
        "warm_solver",
    ):
        assert {drag, gravity} <= set(functions[name].name_in()), name
    assert f"worth_{drag}" in functions["worth"].name_out()
