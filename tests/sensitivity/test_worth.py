"""What numbers are worth, against solving again; ranges against closed forms; paths for changed numbers."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import dmoc
from dmoc import BallForce, BoxForce, KeepOut, State, TransferProblem, predict, rotation, solve, worth
from dmoc.cli.app import main
from dmoc.results.solution import SolveError
from dmoc.scene.problem_file import load_problem


def made(name, **settings):
    problem = load_problem(name).make(**settings)
    return getattr(problem, "alone", None) or problem


def of_field(field):
    return lambda problem, value: replace(problem, **{field: value})


def of_part(owner, field, place=None):
    """Changes a number of a part, or one entry of a column of numbers."""

    def changed(problem, value):
        part = getattr(problem, owner)
        if place is not None:
            value = tuple(value if i == place else x for i, x in enumerate(getattr(part, field)))
        return replace(problem, **{owner: replace(part, **{field: value})})

    return changed


def of_all(field):
    return lambda team, value: replace(
        team, members=[replace(member, **{field: value}) for member in team.members]
    )


def of_member(index, field):
    def changed(team, value):
        members = list(team.members)
        members[index] = replace(members[index], **{field: value})
        return replace(team, members=members)

    return changed


def of_zone(index, field, place=None):
    def changed(problem, value):
        zones = list(problem.constraints)
        if place is not None:
            value = tuple(value if i == place else x for i, x in enumerate(getattr(zones[index], field)))
        zones[index] = replace(zones[index], **{field: value})
        return replace(problem, constraints=zones)

    return changed


def turned(problem, angle):
    """The goal turned about the third axis of the body."""
    w, x, y, z = problem.goal.quaternion
    cos, sin = np.cos(angle / 2), np.sin(angle / 2)
    q = (w * cos - z * sin, x * cos + y * sin, y * cos - x * sin, z * cos + w * sin)
    return replace(problem, goal=replace(problem.goal, quaternion=q))


# A scene, what solves it, and for each number how it is changed and by how much.
SCENES = {
    "orbit_raise": (
        {"order": 8, "steps": 16},
        {
            "duration": (of_field("duration"), 2e-3),
            "mass": (of_field("mass"), 1e-3),
            "goal_position.x": (of_part("goal", "position", 0), 2e-4),
            "start_velocity.y": (of_part("start", "velocity", 1), 1e-4),
        },
    ),
    "free_flyer": (
        {"order": 2, "steps": 60},
        {
            "duration": (of_field("duration"), 1e-2),
            "mass": (of_field("mass"), 1e-2),
            "keep_out_1_radius": (of_zone(0, "radius"), 1e-4),
            "keep_out_2_center.z": (of_zone(1, "center", 2), 1e-4),
        },
    ),
    "rendezvous": (
        {"order": 4, "steps": 20},
        {"duration": (of_field("duration"), 1.0), "start_position.x": (of_part("start", "position", 0), 0.1)},
    ),
    "lunar_landing": (
        {"order": 2, "steps": 100},
        {
            "mass": (of_field("mass"), 1e-5),
            "actuator_max_thrust": (of_part("actuator", "max_thrust"), 1e-4),
        },
    ),
    "reorientation": (
        {"order": 4, "steps": 20},
        {"duration": (of_field("duration"), 1e-3), "goal_attitude.about_z": (turned, 1e-3)},
    ),
    "gates": ({}, {"duration": (of_field("duration"), 1e-2), "mass": (of_field("mass"), 1e-3)}),
    "two_stage_ascent": ({}, {"mass": (of_field("mass"), 1.0)}),
    "three_robots": (
        {"order": 2, "steps": 30},
        {"duration": (of_all("duration"), 1e-2), "north_mass": (of_member(2, "mass"), 1e-2)},
    ),
}


@pytest.mark.parametrize("scene", SCENES)
def test_worth_is_the_central_difference_of_two_solves(scene):
    how, numbers = SCENES[scene]
    problem = made(scene)
    answer = solve(problem, **how).raise_for_status()
    found = worth(answer)
    for name, (changed, by) in numbers.items():
        at = found[name].number
        sides = [
            solve(changed(problem, at + side), guess=answer, **how).raise_for_status().objective
            for side in (by, -by)
        ]
        assert found[name].value == pytest.approx((sides[0] - sides[1]) / (2 * by), rel=2e-6), name


def test_worth_of_the_documented_scene():
    """Figures of other code, to the seven digits of one of them."""
    found = worth(solve(made("orbit_raise"), order=8, steps=32))
    known = {"duration": -6.0554945e-4, "mass": 3.38064579e-3, "goal_position.x": -1.382073e-2}
    assert {name: found[name].value for name in known} == pytest.approx(known, rel=4e-7)
    assert (found["duration"].unit, found["goal_velocity.x"].unit) == ("N^2 s/s", "N^2 s/(m/s)")
    assert found["start_time"].value == 0


ALONG = {"start": State([0], [0]), "goal": State([1], [0]), "mass": 1.0, "duration": 2.0}


def along(limit):
    """From rest to rest on a line with a limited force; without the limit its largest force is 1.5 N."""
    return solve(TransferProblem(actuator=BoxForce(limit), **ALONG), steps=20).raise_for_status()


def test_a_limit_that_does_not_act_is_worth_nothing_until_it_does():
    answer = along(2.0)
    limit = worth(answer)["actuator_limit"]
    largest = np.abs(answer.path.control).max()
    assert limit.value == pytest.approx(0, abs=1e-7)
    assert limit.range == (pytest.approx(largest, rel=1e-6), np.inf)


def test_the_range_of_a_limit_that_acts_ends_where_another_node_meets_it():
    """The problem is quadratic: up to there the path is linear in the limit, and the prediction exact."""
    answer = along(1.3)
    limit = worth(answer)["actuator_limit"]
    low, high = limit.range
    acting = [
        int(np.sum(np.abs(np.abs(along(value).path.control) - value) < 1e-6))
        for value in (low - 1e-3, low + 1e-3, 1.3, high - 1e-3, high + 1e-3)
    ]
    assert acting[1] == acting[2] == acting[3] and acting[0] > acting[2] > acting[4]
    near = predict(answer, actuator_limit=low + 1e-3)
    assert near.control == pytest.approx(along(low + 1e-3).path.control, abs=1e-6)


def test_a_change_that_leads_far_beyond_a_limit_is_refused():
    """A hundred times the mass takes a hundred times the force, which the limit does not let."""
    answer = along(1.3)
    assert predict(answer, mass=1.05).mass[0] == 1.05
    with pytest.raises(ValueError, match="mass=100 is too far from the answer"):
        predict(answer, mass=100)


def test_a_free_duration_is_worth_something_where_its_end_acts():
    """At unit force the least time over 1 m is 2 s; where 1.8 s is the most, there is none."""
    problem = TransferProblem(**(ALONG | {"duration": (1.0, 3.0)}), actuator=BoxForce(3.0))
    found = worth(solve(problem, steps=20))
    # J = 6 / T^3 at least on this mesh too: dJ/dT = -3 J / T
    most = found["durations.most"]
    assert most.value == pytest.approx(-3 * solve(problem, steps=20).objective / 3.0, rel=1e-4)
    assert found["durations.least"].value == pytest.approx(0, abs=1e-6)


def test_the_range_of_legs_reaches_to_where_one_ends():
    """The burns of the coarse answer are legs; with a little more time its path changes as predicted."""
    answer = solve(made("two_body_fuel"), order=4, steps=60, structure=True).raise_for_status()
    duration = worth(answer)["duration"]
    low, high = duration.range
    assert 10.5 < low < 10.95 and 11.05 < high < 11.5
    near = predict(answer, duration=11.05)
    again = solve(replace(answer.problem, duration=11.05), guess=near).raise_for_status()
    assert (again.objective - answer.objective) / 0.05 == pytest.approx(duration.value, rel=0.02)
    lasts = [
        np.array([leg.duration for leg in legs]) for legs in (answer.path.legs, near.legs, again.path.legs)
    ]
    assert np.abs(lasts[1] - lasts[2]).max() < 0.2 * np.abs(lasts[0] - lasts[2]).max()


def test_directions_change_without_their_length():
    found = worth(solve(made("formation"), order=2, steps=40))
    assert found["approach_cone_1_axis.y"].value == pytest.approx(0, abs=1e-8)
    assert abs(found["approach_cone_1_axis.x"].value) > 1


def test_a_degenerate_answer_has_no_range_and_no_prediction():
    """Both orbits are left and met anywhere: the whole transfer may be turned."""
    answer = solve(made("hohmann"))
    found = worth(answer)
    # Independent of the range: 1 m/s of the orbit at radius r is worth as the closed form says.
    closed = lambda r: (np.sqrt(2 * r / (1 + r)) - 1) + np.sqrt(1 / r) * (1 - np.sqrt(2 / (1 + r)))  # noqa: E731
    slope = (closed(2.001) - closed(1.999)) / 0.002
    assert found["goal_radius"].value == pytest.approx(slope, rel=1e-4)
    assert found["goal_radius"].range is None
    with pytest.raises(ValueError, match="the answer is degenerate: another path"):
        predict(answer, goal_radius=2.1)


def test_linked_bodies_leave_their_ends_out():
    found = worth(solve(made("pendulum")))
    assert "duration" in found or "durations.least" in found
    assert not [name for name in found if name.startswith(("start_position", "goal_position"))]


def test_half_the_change_has_a_quarter_of_the_error():
    problem = made("orbit_raise")
    numerics = {"order": 8, "steps": 16}
    answer = solve(problem, **numerics)

    def error(part):
        mass, duration, goal = 1 + part, 12 + 5 * part, (-1.5 + part / 2, part / 3)
        near = predict(answer, mass=mass, duration=duration, goal_position=goal)
        assert near.duration == duration and set(near.mass) == {mass}
        assert near.position[-1] == pytest.approx(goal, abs=1e-15)
        changed = replace(problem, mass=mass, duration=duration, goal=replace(problem.goal, position=goal))
        warm, better = (solve(changed, guess=guess, **numerics) for guess in (answer, near))
        assert better.iterations < warm.iterations
        return np.array(
            [np.abs(near.position - warm.position).max(), np.abs(near.control - warm.path.control).max()]
        )

    assert error(0.04) / error(0.02) == pytest.approx([4, 4], rel=0.05)


def test_predictions_of_bodies_and_missions():
    """An attitude stays a unit quaternion whatever its sign; the legs of a mission last as they should."""
    answer = solve(made("reorientation"), order=4, steps=20)
    wanted = rotation((1, 1, 1), 121.0)
    near = predict(answer, goal_attitude=tuple(-x for x in wanted))
    again = solve(made("reorientation", degrees=121.0), order=4, steps=20, guess=answer)
    moved = np.abs(answer.path.control - again.path.control).max()
    assert np.abs(near.control - again.path.control).max() < 0.02 * moved
    assert np.linalg.norm(near.position, axis=1) == pytest.approx(np.ones(len(near.position)), abs=1e-14)
    team = made("three_robots")
    answer = solve(team, order=2, steps=30)
    near = predict(answer, duration=30.5, north_mass=14.1)
    assert [leg.duration for leg in near.legs] == [30.5] * 3 and set(near.legs[2].mass) == {14.1}
    changed = of_member(2, "mass")(of_all("duration")(team, 30.5), 14.1)
    again = solve(changed, order=2, steps=30, guess=answer)
    sizes = [np.concatenate([leg.control for leg in path.legs]) for path in (answer.path, near, again.path)]
    assert np.abs(sizes[1] - sizes[2]).max() < 0.1 * np.abs(sizes[0] - sizes[2]).max()
    mission = made("gates")
    answer = solve(mission)
    near = predict(answer, duration=31.0)
    again = solve(replace(mission, duration=31.0), guess=answer)
    assert sum(leg.duration for leg in near.legs) == pytest.approx(31.0, abs=1e-10)
    sizes = [np.concatenate([leg.control for leg in path.legs]) for path in (answer.path, near, again.path)]
    assert np.abs(sizes[1] - sizes[2]).max() < 0.1 * np.abs(sizes[0] - sizes[2]).max()


def test_bad_input():
    problem = TransferProblem(actuator=BallForce(2.0), **ALONG)
    answer = solve(problem, steps=4)
    for changes, words in (
        ({}, "give a number another value: start_position"),
        ({"weight": 1.0}, "no number is called 'weight'; there are start_position"),
        ({"mass": -1.0}, r"mass must be greater than 0 \[kg\]"),
        ({"goal_position": (1, 2)}, r"goal_position has 1 entries; got \(1, 2\)"),
        ({"duration": np.nan}, r"duration must be a finite number \[s\]"),
    ):
        with pytest.raises(ValueError, match=words):
            predict(answer, **changes)
    with pytest.raises(ValueError, match="solution must be a"):
        worth(problem)
    with pytest.raises(ValueError, match="attach"):
        worth(replace(answer, problem=None))
    failed = solve(replace(problem, actuator=BallForce(0.5)), steps=4)
    with pytest.raises(SolveError):
        failed.raise_for_status()
    with pytest.raises(ValueError, match="only an optimum"):
        worth(failed)


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main([str(one) for one in arguments])
    return ended.value.code, capsys.readouterr()


def test_the_commands_say_what_numbers_are_worth(capsys, tmp_path):
    file = tmp_path / "flight.nc"
    code, told = run(capsys, "solve", "orbit_raise", "--order", "8", "--worth", "--out", file)
    assert code == 0
    assert "Worth nothing here: start_time." in told.out
    assert "duration: 0.1 s more saves 6.06e-05 N^2 s (3.6 %)" in told.out
    assert "mass at the start: 0.01 kg less saves 3.38e-05 N^2 s (2 %)" in told.out
    assert "position of the goal, x: +0.02 m saves" in told.out
    assert "A scene turned about (0, 0) m is the same" in told.out
    code, told = run(capsys, "check", file, "--worth", "--json")
    found = json.loads(told.out)["worth"]
    (kept,) = json.loads(told.out)["symmetries"]
    assert kept["drift"] < 1e-9 and kept["unit"] == "N^2 s/rad"
    assert code == 0 and found["duration"]["value"] == pytest.approx(-6.0554945e-4, rel=1e-7)
    assert found["duration"]["range"] == [None, None] and found["mass"]["unit"] == "N^2 s/kg"
    assert found["mass"]["number"] == 1 and found["mass"]["number_unit"] == "kg"
    code, told = run(capsys, "check", file, "--json")
    assert "worth" not in json.loads(told.out)


def test_moving_a_whole_scene_along_is_worth_nothing():
    """Without effects only distances count; a wider zone costs more."""
    zone = KeepOut((0, 0), 1.0)
    problem = TransferProblem(
        mass=1.0, start=State((-3, 0.2), (0, 0)), goal=State((3, 0.2), (0, 0)), duration=6.0, constraints=[zone]
    )
    found = worth(solve(problem, order=4, steps=20))
    assert found["keep_out_1_radius"].value > 0.01
    for axis in "xy":
        parts = [
            found[f"{one}.{axis}"].value for one in ("start_position", "goal_position", "keep_out_1_center")
        ]
        assert max(map(abs, parts)) > 0.01 and sum(parts) == pytest.approx(0, abs=1e-7)
    assert dmoc.Worth is type(found["mass"])
