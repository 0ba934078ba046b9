"""What is exported of bodies that turn is dmoc's own, has no argument without a meaning, and works alone."""

import json
import shutil
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    Attitude,
    Pose,
    Thrusters,
    Torque,
    TransferProblem,
    UniformGravity,
    Wrench,
    export,
    rotation,
    simulate,
    solve,
    transcribe,
    verify,
)
from dmoc.exports.export import functions_of
from dmoc.planners.planner import Planner, nominal, solver

INERTIA = (1.0, 2.0, 2.8)
TURNED = rotation((1, 1, 1), 120)
SLEW = TransferProblem(
    1.0, Attitude((1, 0, 0, 0)), Attitude(TURNED), 5.0, inertia=INERTIA, actuator=Torque(), start_time=0.5
)
# Twelve thrusters in pairs of opposite directions, each at half a metre beside an axis and along another.
PLACES = np.array(
    [
        *[(0.5, 0.5, 0), (0.5, -0.5, 0), (-0.5, 0.5, 0), (-0.5, -0.5, 0)],
        *[(0, 0.5, 0.5), (0, 0.5, -0.5), (0, -0.5, 0.5), (0, -0.5, -0.5)],
        *[(0.5, 0, 0.5), (-0.5, 0, 0.5), (0.5, 0, -0.5), (-0.5, 0, -0.5)],
    ]
)
WAYS = np.repeat([(-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1)], 2, axis=0)
GOAL = Pose((2, 1, -1), attitude=rotation((0.2, 0.5, -0.8), np.degrees(1.5)))
FLYER = TransferProblem(3.0, Pose((0, 0, 0)), GOAL, 6.0, inertia=INERTIA, actuator=Thrusters(PLACES, WAYS, 1.0))
BURNING = replace(
    FLYER,
    actuator=Thrusters(PLACES, WAYS, 1.0, specific_impulse=5.0),
    effects=[UniformGravity((0, 0, -0.01))],
    start=Pose((0, 0, 0), (0.1, 0, 0), rate=(0.1, -0.2, 0.05)),
)
# problem, order, steps, hold
CASES = {"slew": (SLEW, 4, 8, False), "flyer": (FLYER, 2, 16, True), "burning": (BURNING, 4, 6, False)}
PLAIN = ("step", "rollout", "residual", "residual_jacobian", "cost")

# Runs where dmoc is not to be had: a folder and inputs in, outputs out.
ALONE = """
import json, sys
sys.modules["dmoc"] = None
import casadi as ca, numpy as np
for name, file, given in json.load(sys.stdin):
    f = ca.Function.load(file) if file.endswith(".casadi") else ca.external(name, file)
    found = f(**{key: np.array(value) for key, value in given.items()})
    print(json.dumps({key: np.array(ca.densify(value)).tolist() for key, value in found.items()}))
"""


def split(columns):
    """The part of a place, if there is one, and that of an attitude."""
    columns = np.array(columns)
    return (columns[:3], columns[3:]) if len(columns) > 4 else (columns,)


@pytest.fixture(scope="module", params=CASES)
def case(request, tmp_path_factory):
    """A problem, its functions, a solution and a path that rolls out under controls drawn at random."""
    problem, order, steps, hold = CASES[request.param]
    planner = Planner.of(problem, order, steps, hold)
    exported = {one.function.name(): one for one in functions_of(planner)}
    made = {name: one.function for name, one in exported.items()}
    forces = 0.3 * np.random.default_rng(2).uniform(0, 1, made["rollout"].size_in("forces"))
    start = dict(zip(planner.scene.names("place"), split(problem.start.fixed()[0]), strict=True))
    start |= dict(zip(planner.scene.names("speed"), split(problem.start.fixed()[1]), strict=True))
    times = {"mass": problem.mass, "start_time": problem.start_time, "duration": problem.duration}
    if problem.actuator.burns:
        times["actuator_exhaust_velocity"] = problem.actuator.exhaust_velocity
    path = made["rollout"](**start, **times, forces=forces)
    folder = tmp_path_factory.mktemp("export") / request.param
    export(problem, folder, order, steps, hold)
    settings = {"order": order, "steps": steps, "hold": hold}
    return SimpleNamespace(
        problem=problem, planner=planner, exported=exported, made=made, settings=settings, folder=folder,
        start=start, times=times, forces=forces, path=path,
    )  # fmt: skip


def of_path(case, path, forces):
    """Arguments of residual and cost, of a path as rollout gives it."""
    given = case.times | dict(path) | {"forces": forces}
    for speed, speeds in (("velocity", "velocities"), ("rate", "rates")):
        if speeds in path:
            given |= {f"start_{speed}": path[speeds][:, 0], f"goal_{speed}": path[speeds][:, -1]}
    return {name: given[name] for name in case.made["residual"].name_in()}


def of_solution(case, solution):
    """Arguments of residual and cost, of a solution."""
    path, scene = solution.path, case.planner.scene
    given = case.times | {"forces": path.control.T, "masses": path.mass[None]}
    for kind, prefix, rows in (
        ("places", "", path.position.T),
        ("speed", "start_", path.start_velocity),
        ("speed", "goal_", path.goal_velocity),
    ):
        given |= dict(zip(scene.names(kind, prefix), split(rows), strict=True))
    return {name: given[name] for name in case.made["residual"].name_in()}


def largest(rows):
    return {name: np.abs(np.array(value)).max() for name, value in rows.items()}


def inputs(case):
    """Inputs of all functions that are no solver."""
    path = of_path(case, case.path, case.forces)
    step = case.start | case.times | {"time": 0.5, "time_step": case.problem.duration / case.settings["steps"]}
    step["forces"] = case.forces[:, : case.made["step"].size2_in("forces")]
    rollout = case.start | case.times | {"forces": case.forces}
    given = dict(zip(PLAIN, (step, rollout, path, path, path), strict=True))
    return {name: {arg: given[name][arg] for arg in case.made[name].name_in()} for name in PLAIN}


# dmoc's own


def test_the_rollout_is_the_simulation(case):
    settings = {name: case.settings[name] for name in ("steps", "order", "hold")}
    flown = simulate(case.problem, case.forces.T, **settings)
    ends = slice(None, None, case.settings["order"] // 2)
    np.testing.assert_allclose(np.array(case.path["attitudes"])[:, ends].T, flown.attitude, atol=1e-12)
    np.testing.assert_allclose(np.array(case.path["rates"]).T, flown.rate, atol=1e-12)
    if "positions" in case.path:
        np.testing.assert_allclose(np.array(case.path["positions"])[:, ends].T, flown.position, atol=1e-12)
        np.testing.assert_allclose(np.array(case.path["velocities"]).T, flown.velocity, atol=1e-12)
    if "masses" in case.path:
        np.testing.assert_allclose(np.array(case.path["masses"])[0, ends], flown.mass, atol=1e-12)


def test_steps_one_after_the_other_are_the_rollout(case):
    steps, degree = case.settings["steps"], case.settings["order"] // 2
    state, h = dict(case.start), case.problem.duration / steps
    numbers = {name: value for name, value in case.times.items() if name.startswith(("mass", "actuator"))}
    for k in range(steps):
        own = (
            case.forces[:, [k]] if case.settings["hold"] else case.forces[:, degree * k : degree * (k + 1) + 1]
        )
        time = case.problem.start_time + k * h
        found = case.made["step"](**(numbers | state), time=time, time_step=h, forces=own)
        state = {name.removeprefix("next_"): value for name, value in found.items()}
    for name, path in (("attitude", "attitudes"), ("rate", "rates"), ("position", "positions")):
        if name in state:
            last = np.array(case.path[path])[:, -1:]
            np.testing.assert_allclose(np.array(state[name]), last, atol=1e-12)


def test_a_rolled_out_path_has_no_residual(case):
    given = of_path(case, case.path, case.forces)
    assert max(largest(case.made["residual"](**given)).values()) < 1e-11
    off = largest(case.made["residual"](**(given | {"forces": 1.001 * case.forces})))
    assert off.pop("residual_norm") < 1e-11 and min(off.values()) > 1e-5
    longer = largest(case.made["residual"](**(given | {"attitudes": 1.001 * given["attitudes"]})))
    assert longer["residual_norm"] == pytest.approx(1.001**2 - 1, rel=1e-9)


def test_the_residual_is_what_verify_measures_and_the_cost_what_solve_reports(case):
    solution = solve(case.problem, **case.settings)
    given = of_solution(case, solution)
    assert max(largest(case.made["residual"](**given)).values()) < 1e-8
    assert float(case.made["cost"](**given)["cost"]) == pytest.approx(solution.objective, rel=1e-10)
    bend = 1e-4 * np.sin(np.outer(solution.path.fractions, np.arange(1, solution.path.position.shape[1] + 1)))
    bent = replace(solution, path=replace(solution.path, position=solution.path.position + bend))
    found, report = largest(case.made["residual"](**of_solution(case, bent))), verify(bent)
    name = {"N": "residual", "N m": "residual_torque"}[report["residual"].unit]
    assert found[name] == pytest.approx(report["residual"].value, rel=1e-9) and found[name] > 1e-4
    assert found["residual_norm"] == pytest.approx(report["constraint"].value, rel=1e-9)


def test_the_jacobian_is_the_residuals(case):
    given, f = of_path(case, case.path, case.forces), case.made["residual"]
    jacobian, noise = case.made["residual_jacobian"](**given), np.random.default_rng(4)
    prefixes = {"residual": "", "residual_torque": "torque_", "residual_norm": "norm_"}
    for name, value in given.items():
        value = np.array(value, float)
        by = 1e-6 * noise.normal(size=value.shape)
        up, down = (f(**(given | {name: value + side * by})) for side in (1, -1))
        for part in f.name_out():
            expected = 0.5 * np.array(up[part] - down[part]).ravel(order="F")
            slope = jacobian.get(f"{prefixes[part]}by_{name}")
            found = 0 if slope is None else np.array(slope @ ca.vec(ca.DM(by))).ravel()
            np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max() + 1e-12)


# the solver


def test_the_solver_finds_what_solve_finds(case):
    inputs = case.made["nominal"]()
    plan = case.made["solver"](**inputs)
    assert case.made["solver"].stats()["success"]
    found = transcribe(case.problem, **case.settings).solve()
    assert float(plan["objective"]) == pytest.approx(found.objective, rel=1e-9)
    attitudes = split(found.path.position.T)[-1]
    np.testing.assert_allclose(np.array(plan["attitudes"]), attitudes, atol=1e-7)
    np.testing.assert_allclose(np.array(plan["rates"]).T, found.rate, atol=1e-7)
    np.testing.assert_allclose(np.array(plan["reactions"]).T, found.path.reaction, atol=1e-6)
    worst = [name for name in plan if name.startswith("largest_residual") or name == "violation"]
    assert max(float(plan[name]) for name in worst) < 1e-8
    assert float(plan["largest_turn"]) == pytest.approx(found.path.largest_turn, abs=1e-7)


def test_the_least_effort_of_the_turn_is_that_of_indirect_shooting():
    planner = Planner.of(SLEW, 8, 12, False)
    plan = solver(planner, None, warm=False).function(**nominal(planner).function())
    assert float(plan["objective"]) == pytest.approx(0.753733560549, abs=2e-11)


def test_either_sign_of_an_attitude_is_the_same_attitude(case):
    """Whoever measures an attitude may give q or -q, and not of length 1 to the last digit."""
    inputs, solver = case.made["nominal"](), case.made["solver"]
    plan = solver(**inputs)
    flipped = {name: -1.0001 * inputs[name] for name in ("start_attitude", "goal_attitude")}
    for name, value in flipped.items():
        again = solver(**(inputs | {name: value}))
        assert float(again["objective"]) == pytest.approx(float(plan["objective"]), rel=1e-9)
        assert float(again["largest_turn"]) < np.pi / 2


def test_a_warm_start_goes_on_from_a_plan(case):
    inputs, cold, warm = (case.made[name] for name in ("nominal", "solver", "warm_solver"))
    inputs = inputs()
    plan = cold(**inputs)
    back = inputs | {f"guess_{name}": x for name, x in plan.items() if f"guess_{name}" in inputs}
    assert {"guess_reactions", "guess_multipliers_dynamics_attitude"} <= back.keys()
    warm(**back)
    assert warm.stats()["iter_count"] <= 2 < cold.stats()["iter_count"]
    moved = {"start_rate": inputs["start_rate"] + 0.005, "start_attitude": rotation((1, 2, 3), 1.0)}
    again, other = warm(**(back | moved)), cold(**(inputs | moved))
    assert warm.stats()["success"] and cold.stats()["success"]
    assert float(again["objective"]) == pytest.approx(float(other["objective"]), rel=1e-6)
    assert warm.stats()["iter_count"] <= cold.stats()["iter_count"]
    assert abs(float(again["objective"]) / float(plan["objective"]) - 1) > 1e-4


def test_a_solver_that_does_nothing_gives_back_its_guess(case):
    idle = solver(case.planner, {"ipopt.max_iter": 0}, warm=True).function
    given = case.made["nominal"]()
    plan = case.made["solver"](**given)
    back = given | {f"guess_{name}": x for name, x in plan.items() if f"guess_{name}" in given}
    again = idle(**back)
    # Ipopt keeps multipliers of bounds away from zero, so those of rows alone come back
    rows = [name for name in plan if name.startswith("multipliers_dynamics")]
    for name in [*case.planner.plan_names, *rows]:
        np.testing.assert_allclose(np.array(again[name]), np.array(plan[name]), atol=1e-7, err_msg=name)


def test_less_mass_at_the_start_has_less_inertia():
    """Where propellant burns the inertia is in proportion to the mass, so a plan under way needs its own."""
    planner = Planner.of(BURNING, 2, 10, False)
    inputs, cold = nominal(planner).function(), solver(planner, None, warm=False).function
    heavy, light = (float(cold(**(inputs | {"mass": mass}))["objective"]) for mass in (3.0, 2.0))
    assert light == pytest.approx(heavy * (2 / 3) ** 2, rel=0.2)


def test_limits_have_the_names_that_they_are_given_by():
    pusher = replace(FLYER, actuator=Wrench(1.0, (0.5, 0.4, 0.3)))
    planner = Planner.of(pusher, 2, 10, False)
    exported = solver(planner, None, warm=False)
    units = {name: exported.term(name).unit for name in exported.function.name_in()}
    assert (units["actuator_force_limit"], units["actuator_torque_limit"]) == ("N", "N m")
    assert units["guess_forces"] == "N, N m"
    plan = exported.function(**(nominal(planner).function() | {"actuator_torque_limit": (0.2, 0.2, 0.2)}))
    assert np.abs(np.array(plan["forces"])[3:]).max() == pytest.approx(0.2, rel=1e-6)


# the files


def test_an_attitude_alone_has_no_argument_of_a_place(case):
    for one in case.exported.values():
        f = one.function
        names = [*f.name_in(), *f.name_out()]
        assert all(one.term(name).words for name in names)
        if case.problem is SLEW:
            assert not [name for name in names if "position" in name or "velocit" in name]
            assert not {one.term(name).unit for name in names} & {"m", "m/s", "N"}


def test_what_the_folder_says_of_its_solver_is_right(case):
    """The lines of Python in the README run as they stand there."""
    text = (case.folder / "README.md").read_text()
    shown = text.split("Python, with CasADi alone:")[1].split("The solver always")[0]
    lines = "\n".join(line.removeprefix("    ") for line in shown.splitlines())
    run = [sys.executable, "-c", lines]
    done = subprocess.run(run, cwd=case.folder, capture_output=True, text=True, check=True)
    objective, worst, violation, status = done.stdout.splitlines()[-1].split()
    assert status == "Solve_Succeeded" and max(float(worst), float(violation)) < 1e-8 and float(objective) > 0


def test_files_and_c_code_give_the_same_where_there_is_no_dmoc(case, tmp_path):
    if (compiler := shutil.which("cc")) is None:
        pytest.skip("no C compiler")
    library, given = tmp_path / "functions.so", inputs(case)
    flags = ["-std=c99", "-Wall", "-Werror", "-O0", "-shared", "-fPIC"]
    subprocess.run([compiler, *flags, case.folder / "c" / "functions.c", "-lm", "-o", library], check=True)
    files = [(name, str(case.folder / f"{name}.casadi")) for name in PLAIN]
    jobs = files + [(name, str(library)) for name in PLAIN[:3]]
    plain = {
        name: {arg: np.array(x).tolist() for arg, x in arguments.items()} for name, arguments in given.items()
    }
    jobs = [(name, file, plain[name]) for name, file in jobs]
    solve = {name: np.array(x).tolist() for name, x in case.made["nominal"]().items()}
    assert np.isfinite(np.concatenate([np.ravel(x) for x in solve.values()])).all()
    jobs.append(("solver", str(case.folder / "solver.casadi"), solve))
    command = [sys.executable, "-I", "-c", ALONE]
    done = subprocess.run(command, input=json.dumps(jobs), capture_output=True, text=True, check=True)
    lines = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    for (name, _, arguments), found in zip(jobs, lines, strict=True):
        expected = case.made[name](**{key: np.array(x) for key, x in arguments.items()})
        assert found.keys() == expected.keys()
        within = 1e-9 if name == "solver" else 1e-12
        for key, value in expected.items():
            size = 1 + np.abs(np.array(value)).max()
            np.testing.assert_allclose(found[key], np.array(ca.densify(value)), atol=within * size, err_msg=key)


def test_the_example_in_c_prints_where_the_path_ends(case, tmp_path):
    if (compiler := shutil.which("cc")) is None:
        pytest.skip("no C compiler")
    sources = [case.folder / "c" / name for name in ("main.c", "functions.c")]
    program = tmp_path / "example"
    flags = ["-std=c99", "-Wall", "-Werror", "-O0"]
    subprocess.run([compiler, *flags, *sources, "-lm", "-o", program], check=True)
    lines = subprocess.run([program], capture_output=True, text=True, check=True).stdout.splitlines()
    told = {line.split(":")[0]: np.array(line.split(":")[1].split(), float) for line in lines}
    pushed = (case.folder / "c" / "main.c").read_text().split("push[DMOC_CONTROLS] = {")[1].split("}")[0]
    force = np.array([float(x) for x in pushed.split(",")])
    path = case.made["rollout"](
        **case.start, **case.times, forces=np.tile(force[:, None], case.forces.shape[1])
    )
    label = f"attitude after {case.problem.duration:g} s [-]"
    np.testing.assert_allclose(told[label], np.array(path["attitudes"])[:, -1], atol=1e-12)
    np.testing.assert_allclose(told["rate [rad/s]"], np.array(path["rates"])[:, -1], atol=1e-12)
    assert np.any(force) and all(value[0] < 1e-11 for name, value in told.items() if "largest" in name)
    assert ("velocity [m/s]" in told) == (case.problem is not SLEW)
