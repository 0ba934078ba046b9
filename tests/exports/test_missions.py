"""Exported missions: the solver answers as `solve` does, rows show what does not meet, legs step as flown."""

import json
import subprocess

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    CircularOrbit,
    Coast,
    DeltaV,
    Drop,
    Engine,
    Impulse,
    KeepOut,
    Leg,
    LinearDrag,
    Mission,
    Moving,
    PointGravity,
    Pose,
    State,
    UniformGravity,
    Unknown,
    Via,
    Wrench,
    export,
    rotation,
    solve,
)
from dmoc.planners.mission import MissionPlanner, identifiers
from dmoc.planners.whole import mission_functions


def rocket(mass=10.0, first=4.0, goal=(30.0, 40.0), thrust=20.0):
    """Two stages with a drop and an impulse that burns, so that every event changes the mass."""
    lower, upper = Engine(thrust, exhaust_velocity=50.0), Engine(20.0, exhaust_velocity=50.0)
    return Mission(
        mass=mass,
        start=State((0.0, 0.0), (0.0, 0.0)),
        goal=State(goal, (0.0, 0.0)),
        legs=[
            Leg(first, actuator=lower, name="lower stage"),
            Drop(1.0),
            Leg(4.0),
            Impulse(exhaust_velocity=60.0),
        ],
        effects=[UniformGravity((0.0, -0.5))],
        actuator=upper,
        objective=DeltaV(),
    )


def comet():
    """A fall past an attractor, whose steps are unequal, between two impulses."""
    ends = State((1.0, 0.0), (0.0, 0.3)), State((-0.1, 0.05), None)
    return Mission(1.0, *ends, [Impulse(), Coast(1.5)], [PointGravity(1.0)], objective=DeltaV())


def planets(departure=0.0, flight=3.4, mass=1.0):
    def here(t):
        return [ca.cos(t), ca.sin(t)]

    def there(t):
        return [1.5 * ca.cos(0.54 * t + 1.2), 1.5 * ca.sin(0.54 * t + 1.2)]

    legs = [Impulse(), Coast(flight), Impulse()]
    ends = Moving(here), Moving(there)
    return Mission(mass, *ends, legs, [PointGravity(1.0)], objective=DeltaV(), start_time=departure)


def gates(duration=2.0, radius=0.3):
    """Legs of free durations that add up, with a zone."""
    legs = [
        Leg((0.1, 1.9)),
        Via((1, 1)),
        Leg((0.1, 1.9), constraints=[KeepOut((1.2, 0.4), radius)], name="home"),
    ]
    return Mission(1.0, State((0, 0), (0, 0)), State((2, 0), (0, 0)), legs, duration=duration)


def through_air(drag=0.3, duration=3.0):
    """Whose drag is not known well."""
    legs = [Leg(duration), Via((2, 1)), Leg(3.0)]
    return Mission(2.0, State((0, 0), (0, 0)), State((4, 1), (0, 0)), legs, [LinearDrag(Unknown(drag))])


def circles(radius=2.0):
    ends = CircularOrbit(1.0, mu=1.0, center=(0, 0)), CircularOrbit(radius, mu=1.0)
    return Mission(1.0, *ends, [Impulse(), Coast((1, 60)), Impulse()], [PointGravity(1.0)], objective=DeltaV())


MADE: dict = {}


def made(make):
    """A solution, its planner, the functions by name and the inputs that the mission states."""
    if make not in MADE:
        found = solve(make())
        planner = MissionPlanner.of(found.problem, None, None, False, found)
        functions = {one.function.name(): one.function for one in mission_functions(planner)}
        MADE[make] = found, planner, functions, functions["nominal"]()
    return MADE[make]


def planned(make):
    """What `residual` and `cost` take, from the mission's solution."""
    _, _, functions, inputs = made(make)
    given = {name.removeprefix("guess_"): value for name, value in inputs.items()}
    return {name: given[name] for name in functions["residual"].name_in()}


@pytest.mark.parametrize("make", [rocket, comet, planets, gates])
def test_the_exported_solver_gives_the_answer_of_solve(make):
    found, planner, functions, inputs = made(make)
    plan = functions["warm_solver"](**inputs)
    assert functions["warm_solver"].stats()["return_status"] == "Solve_Succeeded"
    assert float(plan["objective"]) == pytest.approx(found.objective, rel=1e-12)
    assert float(plan["violation"]) < 1e-10
    for name, leg in zip(planner.names, found.legs, strict=True):
        np.testing.assert_allclose(np.array(plan[f"{name}_positions"]).T, leg.position, atol=1e-7)
    given = {name.removeprefix("guess_"): value for name, value in inputs.items()}
    cost = functions["cost"](**{name: given[name] for name in functions["cost"].name_in()})["cost"]
    assert float(cost) == pytest.approx(found.objective, rel=1e-12)


@pytest.mark.parametrize(
    ("make", "numbers", "other"),
    [
        (
            rocket,
            {
                "mass": 11.0,
                "lower_stage_duration": 4.5,
                "goal_position": (31.0, 39.0),
                "lower_stage_actuator_max_thrust": 21.0,
            },
            rocket(11.0, 4.5, (31.0, 39.0), 21.0),
        ),
        (planets, {"start_time": 0.3, "coast_1_duration": 3.1, "mass": 2.0}, planets(0.3, 3.1, 2.0)),
        (gates, {"duration": 2.2, "home_keep_out_1_radius": 0.35}, gates(2.2, 0.35)),
        (circles, {"goal_radius": 2.2}, circles(2.2)),
        (through_air, {"linear_drag_1_coefficient": 0.4}, through_air(0.4)),
    ],
)
def test_the_exported_solver_answers_for_other_numbers(make, numbers, other):
    _, _, functions, inputs = made(make)
    plan = functions["solver"](**inputs | numbers)
    # Between two circles the place of the start is free, so that Ipopt wanders until nothing changes any more.
    assert functions["solver"].stats()["return_status"] in ("Solve_Succeeded", "Solved_To_Acceptable_Level")
    assert float(plan["violation"]) < 1e-9
    exact = solve(other, guess=made(make)[0])
    assert float(plan["objective"]) == pytest.approx(exact.objective, rel=1e-8)
    assert float(plan["objective"]) != pytest.approx(made(make)[0].objective, rel=1e-4)


@pytest.mark.parametrize("make", [rocket, comet, gates])
def test_the_residual_is_zero_at_the_answer(make):
    found = made(make)[2]["residual"](**planned(make))
    assert max(float(ca.mmax(ca.fabs(rows))) for rows in found.values()) < 1e-9


def test_rows_of_a_joint_show_what_is_disturbed_there():
    given, residual = planned(rocket), made(rocket)[2]["residual"]
    names = [row.split(":")[-1] for row in made(rocket)[1].program.rows["joint 1"].labels]
    for argument, by, row in (
        ("leg_2_start_time", 1e-3, "time"),
        ("leg_2_start_velocity", (1e-3, 0), "velocity.x"),
        ("leg_2_masses", np.append(1e-3, np.zeros(given["leg_2_masses"].numel() - 1))[None], "mass"),
    ):
        off = residual(**given | {argument: given[argument] + by})
        rows = np.array(off["joint_1_rows"]).ravel()
        assert rows[names.index(row)] == pytest.approx(1e-3, rel=1e-6), argument
        assert float(off["violation"]) > 1e-6
    # What happens behind the goal is a row of the goal.
    off = residual(**given | {"goal_impulse_1": given["goal_impulse_1"] + ca.DM((0, 1e-3))})
    assert np.abs(np.array(off["goal_rows"])).max() == pytest.approx(1e-3, rel=1e-6)


@pytest.mark.parametrize(("make", "name"), [(gates, "home"), (rocket, "lower_stage")])
def test_a_force_that_is_missing_shows_as_itself(make, name):
    """In newtons, in a leg of a free duration and in one of a fixed one that loses mass."""
    given, residual = planned(make), made(make)[2]["residual"]
    more = np.zeros(given[f"{name}_forces"].shape)
    more[1] = 0.25
    changed = {f"{name}_forces": given[f"{name}_forces"] + more}
    off = np.array(residual(**given | changed)[f"{name}_dynamics"])
    np.testing.assert_allclose(off, more[:2], atol=1e-8)


@pytest.mark.parametrize("make", [rocket, comet])
def test_a_leg_steps_and_rolls_out_as_it_flies(make):
    found, planner, functions, _ = made(make)
    for name, leg in zip(planner.names, found.legs, strict=True):
        degree, path, given = leg.order // 2, leg.path, {}
        step, rollout = functions[f"step_{name}"], functions[f"rollout_{name}"]
        if "actuator_exhaust_velocity" in step.name_in():
            given["actuator_exhaust_velocity"] = 50.0
        state = {"position": leg.position[0], "velocity": leg.velocity[0], "mass": path.mass[0]}
        whole = rollout(**state, start_time=leg.time[0], duration=leg.duration, forces=path.control.T, **given)
        np.testing.assert_allclose(np.array(whole["positions"]).T, leg.position, atol=1e-9)
        np.testing.assert_allclose(np.array(whole["velocities"]).T, leg.velocity, atol=1e-9)
        for k, (begin, length) in enumerate(zip(path.mesh[:-1], np.diff(path.mesh), strict=True)):
            forces = path.control[k * degree : (k + 1) * degree + 1].T
            times = {"time": leg.time[0] + begin * leg.duration, "time_step": length * leg.duration}
            after = step(**state, **times, forces=forces, **given)
            state = {part: after.get(f"next_{part}", state[part]) for part in state}
        np.testing.assert_allclose(np.array(state["position"]).ravel(), leg.position[-1], atol=1e-9)
        assert float(state["mass"]) == pytest.approx(path.mass[-1])
    if make is comet:
        assert planner.scenes[0].mesh, "the steps of this one are unequal"


def test_files_and_c_code_of_a_mission_are_its_functions(tmp_path):
    found = made(rocket)[0]
    files = export(rocket(), tmp_path / "out", guess=found)
    manifest = json.loads(files[0].read_text())
    assert manifest["legs"].keys() == {"lower_stage", "leg_2"}
    listed = manifest["functions"]["residual"]
    assert {one["name"]: one["unit"] for one in listed["inputs"]}["goal_impulse_1"] == "m/s"
    assert (
        "lower stage: " in next(one for one in listed["inputs"] if one["name"] == "lower_stage_forces")["words"]
    )
    for name, entry in manifest["functions"].items():
        function = ca.Function.load(str(tmp_path / "out" / entry["file"]))
        assert function.name_in() == [one["name"] for one in entry["inputs"]], name
        assert all(one["unit"] and one["words"] for one in entry["inputs"] + entry["outputs"] if one["name"])
    folder = tmp_path / "out" / "c"
    assert "goal_impulse_1 (2 x 1) [m/s]" in (folder / "mission.h").read_text()
    command = ["cc", "-O0", "-shared", "-fPIC", "functions.c", "-lm", "-o", "f.so"]
    subprocess.run(command, cwd=folder, check=True)
    for name in ("residual", "rollout_leg_2"):
        in_c, function = ca.external(name, str(folder / "f.so")), made(rocket)[2][name]
        given = [
            ca.DM(np.random.default_rng(1).uniform(1, 2, function.size_in(i))) for i in range(function.n_in())
        ]
        for one, other in zip(in_c.call(given), function.call(given), strict=True):
            np.testing.assert_allclose(np.array(one), np.array(other), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"order": 3}, "order must be one of 2, 4, 6, 8"),
        ({"steps": 1}, "steps must be a whole number of at least 2"),
        ({"options": 3}, "options must be a dict"),
        ({"guess": "path"}, "guess must be a function of the time"),
        ({"guess": rocket}, "has 1 and its guess 2 legs; export the mission that the guess solves"),
    ],
)
def test_what_has_no_meaning_is_refused_in_one_line(given, words, tmp_path):
    if "guess" in given and callable(given["guess"]):
        given = {"guess": made(rocket)[0]}
    with pytest.raises(ValueError, match=words) as told:
        export(comet(), tmp_path / "out", **given)
    assert "\n" not in str(told.value) and not (tmp_path / "out").exists()


def test_legs_whose_names_cannot_be_names_are_numbered():
    assert identifiers(("Burn 1", "burn-1", "Ω", "start burn", "7 up", "coast 4")) == (
        "leg_1",
        "leg_2",
        "leg_3",
        "leg_4",
        "leg_5",
        "coast_4",
    )


def test_a_leg_of_a_body_that_turns_rolls_out_with_its_attitude():
    ends = Pose((0, 0, 0)), Pose((2, 1, 0), attitude=rotation((0, 1, 1), degrees=100))
    legs = [Leg(2.4), Leg((2.0, 4.0))]
    turning = Mission(10.0, *ends, legs, actuator=Wrench(5.0, 5.0), inertia=(1.0, 2.0, 2.5), duration=6.0)
    found = solve(turning, order=4, steps=6)
    planner = MissionPlanner.of(turning, None, None, False, found)
    functions = {one.function.name(): one.function for one in mission_functions(planner)}
    plan = functions["warm_solver"](**functions["nominal"]())
    assert float(plan["objective"]) == pytest.approx(found.objective, rel=1e-12)
    assert float(plan["largest_residual"]) < 1e-9 and plan["leg_2_dynamics_attitude"].shape == (4, 13)
    leg, velocity = found.legs[1], found.legs[1].path.start_velocity
    state = {"position": leg.position[0], "attitude": leg.attitude[0], "mass": 10.0}
    state |= {"velocity": velocity[:3], "rate": velocity[3:], "forces": leg.path.control.T}
    flown = functions["rollout_leg_2"](**state, start_time=leg.time[0], duration=leg.duration)
    np.testing.assert_allclose(np.array(flown["attitudes"]).T, leg.attitude, atol=1e-10)
