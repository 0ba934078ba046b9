"""The verdict on a team of missions fails on what is not right, and files give back what was solved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dmoc import Apart, Check, Meet, load, simulate_team, solve, verify
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.march import force_of
from dmoc.motion.momenta import end_momenta
from dmoc.scene.problem_file import load_problem
from dmoc.sweeps.worker import pack, unpack


@pytest.fixture(scope="module")
def delivery():
    return solve(load_problem("delivery").make(), steps=12).raise_for_status()


def with_leg(solution, body, phase, **changes):
    """A solution in which the path of one leg is another one, reported as if the solver had found it."""
    member = solution.members[body]
    old = member.legs[phase]
    path = replace(old.path, **changes)
    dynamics = Dynamics.of(old.problem)
    momentum, velocity = end_momenta(dynamics, path, old.problem.start_time)
    new = replace(old, path=path, momentum=momentum, velocity=velocity, force=force_of(dynamics, path))
    legs = tuple(new if i == phase else leg for i, leg in enumerate(member.legs))
    members = tuple(replace(one, legs=legs) if i == body else one for i, one in enumerate(solution.members))
    return replace(solution, members=members)


def failing(solution, problem=None):
    return {check.name: check.note for check in verify(solution, problem).checks if not check.ok}


def bumped(values, place, by):
    values = np.array(values, float)
    values[place] += by
    return values


def test_a_path_that_is_not_the_control_s_fails_and_its_leg_is_named(delivery):
    path = delivery.members[1].legs[0].path
    found = failing(with_leg(delivery, 1, 0, position=bumped(path.position, (8, 1), 1e-4)))
    assert {"residual", "rollout"} <= set(found) and found["residual"].startswith("crosser, leg 1, part 1:")


@pytest.mark.parametrize("field", ["position", "start_velocity", "mass"])
def test_a_joint_that_does_not_join_fails_and_its_body_is_named(delivery, field):
    values = getattr(delivery.members[0].legs[1].path, field)
    moved = values + 1e-5 * (np.arange(values.size).reshape(values.shape) < 2)
    found = failing(with_leg(delivery, 0, 1, **{field: 1.001 * values if field == "mass" else moved}))
    assert "joints" in found and "courier: joint 1" in found["joints"]


def test_a_clock_that_is_not_one_fails(delivery):
    longer = 1.001 * delivery.path.durations[0]
    found = failing(with_leg(delivery, 1, 0, duration=longer))
    assert "duration" in found["together"]
    both = with_leg(with_leg(delivery, 1, 0, duration=longer), 0, 0, duration=longer)
    assert "duration of phases 1 to 2" in failing(both)["together"]
    moved = tuple(
        replace(leg, provenance=replace(leg.provenance, start_time=leg.provenance.start_time + 1e-2))
        for leg in delivery.members[1].legs
    )
    later = replace(delivery, members=(delivery.members[0], replace(delivery.members[1], legs=moved)))
    assert "common start" in failing(later)["together"]
    leg = delivery.members[1].legs[1]
    late = replace(leg, provenance=replace(leg.provenance, start_time=leg.provenance.start_time + 1e-3))
    legs = delivery.members[1].legs[0], late
    moved = replace(delivery, members=(delivery.members[0], replace(delivery.members[1], legs=legs)))
    assert "joints" in failing(moved)


def test_a_distance_that_is_not_kept_or_bodies_that_do_not_meet_fail(delivery):
    team = delivery.problem
    found = failing(delivery, replace(team, together=(Apart(1.2),)))
    assert found["together"].startswith("worst: apart courier and crosser at nodes in phase 1")
    open_goals = [replace(one, goal=replace(one.goal, position=(None, None))) for one in team.members]
    found = failing(delivery, replace(team, members=open_goals, together=(Meet(),)))
    assert found["together"].startswith("worst: meet courier and crosser position")


def test_multipliers_and_costs_that_are_not_those_of_the_optimum_fail(delivery):
    (name, *_) = [key for key, values in delivery.densities.items() if np.abs(values).max() > 0]
    for factor in (0.0, -1.0, 1.01):
        changed = delivery.densities | {name: factor * delivery.densities[name]}
        assert set(failing(replace(delivery, densities=changed))) == {"optimality"}
    forces = {key: value + 1e-3 for key, value in delivery.forces.items()}
    assert "optimality" in failing(replace(delivery, forces=forces))
    assert set(failing(replace(delivery, objective=1.001 * delivery.objective))) == {"optimality"}


def test_a_check_of_one_s_own_is_told_of_the_worst_leg(delivery):
    def heavy(evidence):
        return Check.of("heavy", float(evidence.mass.max()), 99.0, "kg")

    report = verify(delivery, more=[heavy])
    assert (
        report["heavy"].ok and report["heavy"].note == "courier, loaded" and report.checks[-1].name == "heavy"
    )


def test_a_file_gives_back_every_bit(delivery, tmp_path):
    delivery.save(tmp_path / "flight.nc")
    back = load(tmp_path / "flight.nc")
    assert back.joints == delivery.joints and back.names == delivery.names and back.problem is None
    for one, other in zip(back.parts, delivery.parts, strict=True):
        assert np.array_equal(one.position, other.position) and one.path.duration == other.path.duration
    assert all(np.array_equal(back.densities[key], values) for key, values in delivery.densities.items())
    again = back.attach(delivery.problem)
    assert [check.value for check in verify(again).checks] == [check.value for check in verify(delivery).checks]
    courier, crosser = delivery.problem.members
    alone = replace(crosser, start=courier.start, goal=courier.goal)
    other = replace(delivery.problem, members=(alone, crosser), names=("courier", "crosser"))
    with pytest.raises(ValueError, match="attach the team that was solved"):
        back.attach(other)


def test_a_path_is_packed_to_the_last_bit(delivery):
    path = delivery.path
    back = unpack(pack(path))
    assert back.begins == path.begins and back.joints == path.joints and back.warm
    assert all(np.array_equal(path.own[name], back.own[name]) for name in path.own)
    pairs = zip(path.legs, back.legs, strict=True)
    assert all(np.array_equal(old.position, new.position) for old, new in pairs)


def test_every_body_is_marched_through_its_joints(delivery):
    flights = simulate_team(delivery.problem, delivery)
    for name, flight in flights.items():
        assert flight.position[-1] == pytest.approx(delivery.of(name).position[-1], abs=1e-9)
        assert flight.mass[-1] == pytest.approx(9.6)
    with pytest.raises(ValueError, match="a mission is simulated with"):
        simulate_team(delivery.problem)
