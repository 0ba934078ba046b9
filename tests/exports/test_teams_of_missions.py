"""Exported teams of missions: the solver answers as `solve` does, for other numbers too; and their worth."""

from __future__ import annotations

import json
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    Apart,
    Coast,
    DeltaV,
    Drop,
    Free,
    Impulse,
    Leg,
    Meet,
    Mission,
    PointGravity,
    State,
    Team,
    TransferProblem,
    Via,
    export,
    predict,
    solve,
    worth,
)
from dmoc.planners.phased import PhasedPlanner
from dmoc.planners.whole import mission_functions


def delivery(duration=30.0, start=-2.0, mass=9.6, place=1.0):
    """A courier sets down half of its mass on its way while another body crosses."""
    legs = [Leg(name="loaded"), Via((place, 0.5)), Drop(9.6), Leg(name="empty")]
    ends = {"start": State((start, 0), (0, 0)), "goal": State((2, 0), (0, 0))}
    courier = Mission(mass=19.2, **ends, legs=legs, duration=duration, name="courier")
    ends = State((0.3, -2), (0, 0)), State((0, 2), (0, 0))
    return Team([courier, TransferProblem(mass, *ends, duration, name="crosser")], [Apart(1.0)])


def stated(first=3.0, second=None, begin=0.0):
    """Two bodies by way of places at times that are stated, in three phases, on a clock that begins later."""
    bodies = []
    for height, time, last in ((0.0, 5.0, 5.0), (5.0, first, second or 10.0 - first)):
        legs = [Leg(time), Via((1, height + 1)), Leg(last)]
        ends = {"start": State((0, height), (0, 0)), "goal": State((2, height), (0, 0))}
        bodies.append(Mission(mass=1.0, **ends, legs=legs, start_time=begin))
    return Team(bodies, [Apart(0.4)], names=("low", "high"))


def limited(most=2.0, least=7.0):
    """Two bodies by way of places, one of which is to be passed early and the other late."""
    bodies = []
    for place, height, first, second in (
        ((0.3, 1.0), 0.0, (0.1, most), (0.1, 9.9)),
        ((1.9, 5.5), 5.0, (0.1, 9.9), (least, 9.9)),
    ):
        legs = [Leg(first), Via(place), Leg(second)]
        ends = {"start": State((0, height), (0, 0)), "goal": State((2, height), (0, 0))}
        bodies.append(Mission(mass=1.0, **ends, legs=legs, duration=10.0))
    return Team(bodies, [Apart(0.4)], names=("low", "high"))


def meeting(far=1.2):
    """Two satellites that meet by impulses at both ends of a coast, whose duration and begin are free."""
    drawn = {"effects": [PointGravity(1.0)], "objective": DeltaV(), "goal": Free(), "start_time": (0.0, 1.0)}
    away = far * np.array([np.cos(0.5), np.sin(0.5)])
    speed = np.array([-away[1], away[0]]) / far**1.5
    legs = [Impulse(), Coast((0.5, 4)), Impulse()]
    ends = State((1, 0), (0, 1)), State(tuple(away), tuple(speed))
    bodies = [Mission(mass=1.0, start=end, legs=legs, **drawn) for end in ends]
    return Team(bodies, [Meet()], names=("chaser", "target"))


@pytest.fixture(scope="module")
def answers():
    """The answers of all scenes, and the functions of these."""
    found = {}
    for make in (delivery, stated, limited, meeting):
        solution = solve(make(), order=6, steps=6).raise_for_status()
        planner = PhasedPlanner.of(make(), None, None, False, solution)
        functions = {one.function.name(): one.function for one in mission_functions(planner)}
        found[make] = solution, planner, functions
    return found


@pytest.mark.parametrize("make", [delivery, stated, limited, meeting])
def test_the_exported_solver_gives_the_answer_of_solve(answers, make):
    found, planner, functions = answers[make]
    inputs = functions["nominal"]()
    plan = functions["warm_solver"](**inputs)
    assert functions["warm_solver"].stats()["return_status"] == "Solve_Succeeded"
    assert float(plan["objective"]) == pytest.approx(found.objective, rel=1e-8)
    assert float(plan["violation"]) < 1e-9 and float(plan["largest_residual"]) < 1e-8
    given = {name.removeprefix("guess_"): value for name, value in inputs.items()}
    cost = functions["cost"](**{name: given[name] for name in functions["cost"].name_in()})["cost"]
    assert float(cost) == pytest.approx(found.objective, rel=1e-12)
    legs = [leg for body in found.members for leg in body.legs]
    for name, leg in zip(planner.names, legs, strict=True):
        np.testing.assert_allclose(np.array(plan[f"{name}_positions"]).T, leg.position, atol=1e-5)


@pytest.mark.parametrize(
    ("make", "numbers", "other"),
    [
        (delivery, {"duration": 29.0, "crosser_mass": 9.0}, {"duration": 29.0, "mass": 9.0}),
        (delivery, {"courier_start_position": (-1.9, 0.0)}, {"start": -1.9}),
        (stated, {"start_time": 7.0}, {"begin": 7.0}),
        (limited, {"low_leg_1_durations": (0.1, 2.2)}, {"most": 2.2}),
        (limited, {"high_leg_2_durations": (6.5, 9.9)}, {"least": 6.5}),
    ],
)
def test_other_numbers_give_the_answer_of_the_team_that_has_them(answers, make, numbers, other):
    found, _, functions = answers[make]
    plan = functions["solver"](**(functions["nominal"]() | numbers))
    again = solve(make(**other), order=6, steps=6, guess=found).raise_for_status()
    assert float(plan["objective"]) == pytest.approx(again.objective, rel=1e-7)
    assert found.objective != pytest.approx(again.objective, rel=1e-4) or make is stated


def test_a_duration_that_others_contradict_stays_as_it_is_stated(answers):
    """Legs of 5 and 5 s and of 3 and 7 s end at one time: none of them can change alone."""
    _, planner, _ = answers[stated]
    assert not any("duration" in name for name in planner.numbers.names)
    assert {"low_mass", "high_start_position", "start_time"} <= set(planner.numbers.names)


def test_what_is_disturbed_shows_in_the_rows_of_its_body(answers):
    functions = answers[delivery][2]
    inputs = {name.removeprefix("guess_"): value for name, value in functions["nominal"]().items()}
    given = {name: inputs[name] for name in functions["residual"].name_in()}
    assert float(functions["residual"](**given)["violation"]) < 1e-9
    rows = functions["residual"](**given | {"courier_empty_mass": given["courier_empty_mass"] + 1.0})
    assert float(ca.mmax(ca.fabs(rows["courier_joint_1_rows"]))) == pytest.approx(1.0)
    rows = functions["residual"](
        **given | {"crosser_leg_1_part_2_duration": given["crosser_leg_1_part_2_duration"] + 1.0}
    )
    assert float(rows["common_duration_in_phase_2_rows"]) == pytest.approx(1.0)
    near = {"courier_loaded_positions": given["crosser_leg_1_part_1_positions"]}
    assert float(ca.mmax(ca.fabs(functions["residual"](**given | near)[_apart(functions)]))) > 0.9


def _apart(functions):
    return next(
        name for name in functions["residual"].name_out() if name.startswith("apart") and "phase_1" in name
    )


def test_files_of_a_team_of_missions(tmp_path, answers):
    found, planner, _ = answers[delivery]
    files = export(found.problem, tmp_path / "out", guess=found)
    manifest = json.loads(files[0].read_text())
    assert manifest["legs"].keys() == set(planner.names)
    for name, entry in manifest["functions"].items():
        function = ca.Function.load(str(tmp_path / "out" / entry["file"]))
        assert function.name_in() == [one["name"] for one in entry["inputs"]], name
        assert all(one["unit"] and one["words"] for one in entry["inputs"] + entry["outputs"] if one["name"])
    words = (tmp_path / "out" / "README.md").read_text()
    assert "cut into phases" in words and 'inputs["courier_mass"]' in words
    assert "rollout_courier_empty" in (tmp_path / "out" / "c" / "team.h").read_text()


@pytest.mark.parametrize(
    ("make", "name", "argument", "at"),
    [
        (delivery, "duration", "duration", 30.0),
        (delivery, "courier_start_position.x", "start", -2.0),
        (delivery, "crosser_mass", "mass", 9.6),
        (limited, "low_leg_1_durations.most", "most", 2.0),
        (limited, "high_leg_2_durations.least", "least", 7.0),
    ],
)
def test_worth_is_the_central_difference_of_two_solves(answers, make, name, argument, at):
    found = answers[make][0]
    step = 1e-3
    up, down = (
        solve(make(**{argument: at + way * step}), order=6, steps=6, guess=found).objective for way in (1, -1)
    )
    assert worth(found)[name].value == pytest.approx((up - down) / (2 * step), rel=1e-5)


@pytest.mark.parametrize(
    ("make", "numbers", "other"),
    [
        (delivery, {"duration": 29.99}, {"duration": 29.99}),
        (limited, {"low_leg_1_durations": (0.1, 2.001)}, {"most": 2.001}),
        (stated, {"start_time": 7.0}, {"begin": 7.0}),
    ],
)
def test_a_path_for_other_numbers_is_that_of_another_solve_to_first_order(answers, make, numbers, other):
    found = answers[make][0]
    moved = predict(found, **numbers)
    again = solve(make(**other), order=6, steps=6, guess=found)
    assert moved.begins == pytest.approx(again.path.begins, abs=1e-4)
    for one, leg, before in zip(moved.legs, again.path.legs, found.path.legs, strict=True):
        assert one.duration == pytest.approx(leg.duration, abs=1e-5)
        assert (
            np.abs(one.position - leg.position).max()
            < 0.01 * np.abs(before.position - leg.position).max() + 1e-6
        )


def test_the_duration_of_a_phase_that_is_no_unknown_moves_with_the_whole():
    """One way point is passed at 5 s, and the whole lasts 10 s: the second phase lasts the rest."""
    team = stated(5.0)
    low, high = (
        replace(one, legs=[one.legs[0], one.legs[1], Leg((0.1, 900.0))], duration=10.0) for one in team.members
    )
    found = solve(Team([low, high], [Apart(0.4)]), order=4, steps=4).raise_for_status()
    assert predict(found, duration=11.0).durations == pytest.approx([5.0, 6.0])


def test_a_longer_leg_is_refused_where_no_row_would_hold_the_whole():
    """Legs of at most 4 s never last the 10 s that are the most: no row would hold longer ones."""
    low, high = limited().members
    legs = [replace(part, duration=(0.1, 4.0)) if hasattr(part, "order") else part for part in low.legs]
    members = replace(low, legs=legs, duration=(1.0, 10.0)), replace(high, duration=(1.0, 10.0))
    names = PhasedPlanner.of(Team(members, [Apart(0.4)], names=("low", "high")), 4, 4, False).numbers.names
    assert "low_leg_1_durations" not in names and "high_leg_2_durations" in names
