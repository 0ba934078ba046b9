"""The exported solver answers for other numbers, from a former plan, and says what its answer is worth."""

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    BallForce,
    BoxForce,
    CircularOrbit,
    Fuel,
    KeepIn,
    KeepOut,
    LinearDrag,
    Moving,
    Nozzles,
    PointGravity,
    RotatingFrame,
    SpeedLimit,
    Spring,
    State,
    Time,
    TransferProblem,
    solve,
    transcribe,
    verify,
)
from dmoc.planners.planner import Planner, nominal, solver

STEPS = 20
REST = State((0, 0), (0, 0))
FLYER = TransferProblem(
    10.0,
    REST,
    State((4, 0.3), (0, 0)),
    20.0,
    actuator=BoxForce(0.8),
    constraints=[KeepOut((2.0, -0.3), 0.7), SpeedLimit(0.6)],
)
ORBIT = CircularOrbit(1.2, 1.0, center=(0, 0))
# a problem, other numbers for its solver, and the problem that states those
OTHERS = {
    "obstacle, limits, mass, times": (
        FLYER,
        {
            "actuator_limit": 1.0,
            "keep_out_1_center": (2.1, -0.25),
            "keep_out_1_radius": 0.6,
            "speed_limit_2_limit": 0.5,
            "mass": 11.0,
            "duration": 18.0,
            "start_position": (0.1, -0.1),
            "start_velocity": (0.05, 0.02),
        },
        replace(
            FLYER,
            mass=11.0,
            start=State((0.1, -0.1), (0.05, 0.02)),
            duration=18.0,
            actuator=BoxForce(1.0),
            constraints=[KeepOut((2.1, -0.25), 0.6), SpeedLimit(0.5)],
        ),
    ),
    "entries left free, effects that look at velocity": (
        TransferProblem(
            2, REST, State((1, None), (None, 0.3)), 5, effects=[LinearDrag(0.2), RotatingFrame(0.1)]
        ),
        {"goal_position": (2, 99.0), "goal_velocity": (77.0, -0.1), "mass": 3, "duration": 6},
        TransferProblem(
            3, REST, State((2, None), (None, -0.1)), 6, effects=[LinearDrag(0.2), RotatingFrame(0.1)]
        ),
    ),
    "box": (
        TransferProblem(2, REST, State((1, 1), (0.6, 0)), 5, constraints=[KeepIn((-1, -1), (2, np.inf))]),
        {"keep_in_1_lower": (-0.05, -1), "goal_velocity": (0.9, 0)},
        TransferProblem(2, REST, State((1, 1), (0.9, 0)), 5, constraints=[KeepIn((-0.05, -1), (2, np.inf))]),
    ),
    "metered thrust": (
        TransferProblem(10, REST, State((1, 1), (0, 0)), 40, actuator=BallForce(0.05), objective=Fuel()),
        {"actuator_max_thrust": 0.06},
        TransferProblem(10, REST, State((1, 1), (0, 0)), 40, actuator=BallForce(0.06), objective=Fuel()),
    ),
    "free duration": (
        TransferProblem(
            2,
            REST,
            State((1, 0.5), (0, 0)),
            (1, 20),
            actuator=Nozzles(np.vstack([np.eye(2), -np.eye(2)]), 1.0),
            objective=Time(),
        ),
        {"actuator_max_thrust": (1, 1, 2, 1), "durations": (0.5, 30)},
        TransferProblem(
            2,
            REST,
            State((1, 0.5), (0, 0)),
            (0.5, 30),
            actuator=Nozzles(np.vstack([np.eye(2), -np.eye(2)]), (1, 1, 2, 1)),
            objective=Time(),
        ),
    ),
    "orbit": (
        TransferProblem(1, State((1, 0), (0, 1)), ORBIT, 4, effects=[PointGravity(1.0)]),
        {"goal_radius": 1.25, "mass": 2.0},
        TransferProblem(2, State((1, 0), (0, 1)), replace(ORBIT, radius=1.25), 4, effects=[PointGravity(1.0)]),
    ),
}


def made(problem, hold=True, order=2, options=None):
    """The problem's own inputs, the cold and the warm solver."""
    planner = Planner.of(problem, order, STEPS, hold)
    solvers = [solver(planner, options, warm).function for warm in (False, True)]
    return nominal(planner).function(), *solvers


def handed_back(inputs, plan):
    return inputs | {f"guess_{name}": value for name, value in plan.items() if f"guess_{name}" in inputs}


@pytest.mark.parametrize("name", OTHERS)
def test_other_numbers_give_what_solving_that_problem_gives(name):
    problem, numbers, other = OTHERS[name]
    inputs, cold, _ = made(problem)
    assert numbers.keys() <= inputs.keys()
    for given, stated in ((inputs, problem), (inputs | numbers, other)):
        # One run on one mesh, as the exported solver makes it: `solve` would leave a path that leaps a zone.
        plan, solution = cold(**given), transcribe(stated, steps=STEPS, hold=True).solve()
        assert cold.stats()["success"] and solution.success
        assert float(plan["objective"]) == pytest.approx(solution.objective, rel=1e-6)
        assert float(plan["violation"]) < 1e-8 and float(plan["largest_residual"]) < 1e-8
    assert abs(float(plan["objective"]) / float(cold(**inputs)["objective"]) - 1) > 1e-3, (
        "numbers that do nothing"
    )


def test_a_moving_goal_is_met_at_another_time():
    def target(t):
        return ca.vertcat(1 + 0.1 * t, ca.sin(t))

    problem = TransferProblem(2, REST, Moving(target), 5)
    inputs, cold, _ = made(problem, hold=False, order=4)
    plan = cold(**(inputs | {"start_time": 2.0}))
    solution = solve(replace(problem, start_time=2.0), steps=STEPS, order=4)
    np.testing.assert_allclose(np.array(plan["positions"])[:, -1], (1.7, np.sin(7.0)), atol=1e-9)
    np.testing.assert_allclose(np.array(plan["positions"]).T, solution.position, atol=1e-8)
    np.testing.assert_allclose(np.array(plan["velocities"]).T, solution.velocity, atol=1e-8)
    np.testing.assert_allclose(np.array(plan["forces"]).T, solution.path.control, atol=1e-8)
    np.testing.assert_allclose(np.array(plan["multipliers_dynamics"]).T, solution.costate, atol=1e-7)


def test_a_warm_start_from_its_own_plan_takes_next_to_no_iterations():
    inputs, cold, warm = made(FLYER)
    plan = cold(**inputs)
    again = warm(**handed_back(inputs, plan))
    few = warm.stats()["iter_count"]
    assert few <= 2 < cold.stats()["iter_count"]
    assert float(again["objective"]) == pytest.approx(float(plan["objective"]), rel=1e-8)
    without = {name: 0 if "multipliers" in name else value for name, value in handed_back(inputs, plan).items()}
    warm(**without)
    assert warm.stats()["iter_count"] > few, "the multipliers must matter"


def test_the_status_is_there_after_loading(tmp_path):
    inputs, cold, _ = made(FLYER)
    cold.save(str(tmp_path / "solver.casadi"))
    loaded = ca.Function.load(str(tmp_path / "solver.casadi"))
    loaded(**inputs)
    assert loaded.stats()["return_status"] == "Solve_Succeeded"


def test_a_plan_that_is_none_shows_in_its_outputs():
    inputs, cold, _ = made(FLYER)
    plan = cold(**(inputs | {"duration": 5.0}))
    assert not cold.stats()["success"]
    assert float(plan["violation"]) > 1e-3
    plan = cold(**(inputs | {"mass": np.nan}))
    assert float(plan["violation"]) == np.inf or float(plan["largest_residual"]) == np.inf


@pytest.mark.parametrize("name", ["obstacle, limits, mass, times", "orbit"])
@pytest.mark.parametrize("order", [2, 4])
def test_a_plan_that_fails_shows_where_as_the_solution_itself_does(name, order):
    problem, options = OTHERS[name][0], {"ipopt.max_iter": 1}
    inputs, cold, _ = made(problem, hold=False, order=order, options=options)
    plan = {name: np.array(value) for name, value in cold(**inputs).items()}
    solution = solve(problem, order=order, steps=STEPS, options=options)
    check = next(check for check in verify(solution).checks if check.name == "residual")
    node, axis = re.fullmatch(r"at dynamics\[(\d+)\]\.([xy])", check.note).groups()
    assert abs(plan["residual"]["xy".index(axis), int(node)]) == pytest.approx(check.value, rel=1e-6)
    assert np.abs(plan["residual"]).max() == pytest.approx(check.value, rel=1e-6) and check.value > 1e-4
    assert plan["largest_residual"] == pytest.approx(check.value, rel=1e-6)
    beyond = {name: value for name, value in plan.items() if name.startswith("violations_")}
    worst = max(beyond, key=lambda name: beyond[name].max())
    assert beyond[worst].max() == plan["violation"] > 1e-4
    row = re.match(r"(?P<group>.+?)(\[(?P<index>\d+)\])?(\.[a-z]+)?$", solution.worst[0][0])
    assert worst == f"violations_{row['group'].replace('.', '_')}"
    assert beyond[worst].shape == plan[worst.replace("violations", "multipliers")].shape
    assert beyond[worst].max(0).argmax() == int(row["index"] or 0)


def test_options_reach_ipopt_and_a_plan_can_be_flown_before_it_is_the_best():
    inputs, cold, _ = made(FLYER, options={"ipopt.max_iter": 4})
    plan = cold(**inputs)
    assert cold.stats()["return_status"] == "Maximum_Iterations_Exceeded"
    assert float(plan["violation"]) < 1e-6 and float(plan["largest_residual"]) < 1e-6


def test_two_boxes_on_one_axis_are_no_inputs():
    """The bound is the tighter of the two, which is not affine in either: both stay as stated."""
    boxes = [KeepIn((-0.1, -1), (2, 2)), KeepIn((-0.2, -0.2), (3, 1.5))]
    inputs, _, _ = made(TransferProblem(2, REST, State((1, 1), (0, 0)), 5, constraints=boxes))
    assert not any("keep_in" in name for name in inputs)
    assert {"start_position", "mass", "duration"} <= inputs.keys()


def test_from_a_solution_the_warm_solver_goes_on_at_once():
    solution = solve(FLYER, steps=STEPS, hold=True)
    planner = Planner.of(FLYER, 2, STEPS, True, guess=solution)
    warm = solver(planner, None, warm=True).function
    plan = warm(**nominal(planner).function())
    assert warm.stats()["iter_count"] <= 3
    assert float(plan["objective"]) == pytest.approx(solution.objective, rel=1e-8)


def test_a_mesh_beyond_the_stability_limit_is_refused():
    spring = TransferProblem(1, REST, State((1, 0), (0, 0)), 100, effects=[Spring(4.0, (0, 0))])
    with pytest.raises(ValueError, match="steps"):
        Planner.of(spring, 2, STEPS, True)


@pytest.mark.slow
def test_the_closed_loop_keeps_clear_and_arrives():
    script = Path(__file__).parents[2] / "scripts" / "closed_loop.py"
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True)
    assert "39 plans, 0 of them refused" in done.stdout
    clearance, miss = re.search(r"again: +clearance ([\d.]+) mm, miss ([\d.]+) mm", done.stdout).groups()
    assert float(clearance) > 20 and float(miss) < 20
