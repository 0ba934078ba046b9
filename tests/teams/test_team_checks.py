"""The verdict on a team can be trusted: every check holds on what is good and fails on what is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dmoc import (
    Apart,
    BallForce,
    Check,
    Drag,
    Free,
    Meet,
    Spring,
    State,
    Team,
    TransferProblem,
    UniformAtmosphere,
    solve,
    verify,
)
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.march import force_of
from dmoc.motion.momenta import end_momenta
from dmoc.motion.path import COSTATE

CHECKS = ["residual", "rollout", "reference", "ledger", "bounds", "stability", "together", "optimality"]


def at_rest(*place):
    return State(place, (0, 0))


@pytest.fixture(scope="module")
def passing():
    """Two that change places through air with forces that come near their limit."""
    air = [Drag(0.1, 1.0, UniformAtmosphere(0.5))]
    robots = [
        TransferProblem(1.0, at_rest(-x, 0), at_rest(x, 0), 10.0, effects=air, actuator=BallForce(0.12))
        for x in (1.0, -1.0)
    ]
    return solve(Team(robots, [Apart(0.4)], ("east", "west"))).raise_for_status()


@pytest.fixture(scope="module")
def meeting():
    bodies = [TransferProblem(m, at_rest(x, 0), Free(), (2.0, 5.0)) for m, x in ((1.0, 0.0), (2.0, 3.0))]
    return solve(Team(bodies, [Meet()])).raise_for_status()


def with_body(solution, index, **changes):
    """A solution in which the path of one body is another one, reported as if the solver had found it."""
    old = solution.members[index]
    path = replace(old.path, **changes)
    dynamics = Dynamics.of(old.problem)
    momentum, velocity = end_momenta(dynamics, path, old.problem.start_time)
    new = replace(old, path=path, momentum=momentum, velocity=velocity, force=force_of(dynamics, path))
    members = tuple(new if i == index else one for i, one in enumerate(solution.members))
    return replace(solution, members=members)


def bumped(values, place, by):
    values = np.array(values, float)
    values[place] += by
    return values


def failing(solution, problem=None):
    return [check.name for check in verify(solution, problem).checks if not check.ok]


@pytest.mark.parametrize("name", ["passing", "meeting"])
def test_every_check_holds_on_what_is_good(name, request):
    report = verify(request.getfixturevalue(name))
    assert [check.name for check in report.checks] == CHECKS and report.ok


def test_a_path_that_is_not_the_control_s_fails_and_its_body_is_named(passing):
    path = passing.members[1].path
    off = with_body(passing, 1, position=bumped(path.position, (20, 1), 1e-4))
    assert {"residual", "rollout"} <= set(failing(off))
    assert verify(off)["residual"].note.startswith("west:")
    other = with_body(passing, 0, position=bumped(passing.members[0].path.position, (20, 1), 1e-4))
    assert verify(other)["residual"].note.startswith("east:")


def test_a_control_that_is_too_strong_fails_and_its_body_is_named(passing):
    control = 1.2 * passing.members[0].path.control
    off = with_body(passing, 0, control=control)
    found = failing(off)
    assert {"residual", "reference", "bounds", "ledger"} <= set(found)
    assert verify(off)["bounds"].note.startswith("east:")


def test_an_untrue_velocity_mass_or_cost_fails(passing):
    first = passing.members[0]
    told = replace(first, velocity=bumped(first.velocity, (3, 0), 1e-4))
    assert failing(replace(passing, members=(told, passing.members[1]))) == ["ledger"]
    assert failing(replace(passing, objective=1.001 * passing.objective)) == ["optimality"]
    heavier = with_body(passing, 0, mass=1.001 * first.path.mass)
    assert {"ledger", "residual"} <= set(failing(heavier))


def test_a_goal_that_is_missed_fails(passing):
    team = passing.problem
    other = replace(team.members[0], goal=State((1.001, 0), (0, 0)))
    report = verify(passing, replace(team, members=(other, team.members[1])))
    assert not report["bounds"].ok and "goal position" in report["bounds"].note


def test_a_distance_that_is_not_kept_fails_at_nodes(passing):
    team = passing.problem
    assert failing(passing, replace(team, together=(Apart(0.4 * (1 + 1e-5)),))) != []
    report = verify(passing, replace(team, together=(Apart(0.5),)))
    assert not report["together"].ok and report["together"].note == "worst: apart east and west at nodes"
    assert report["together"].value == pytest.approx(0.1, rel=1e-3)


def test_a_distance_that_is_not_kept_between_nodes_fails():
    """Two that cross at a right angle, which at the nodes of a coarse mesh are far from each other."""
    bodies = [
        TransferProblem(1.0, at_rest(-1, 0), at_rest(1, 0), 10.0),
        TransferProblem(1.0, at_rest(0, -1), at_rest(0, 1), 10.0),
    ]
    report = verify(solve(Team(bodies, [Apart(0.2)]), order=2, steps=5))
    assert not report["together"].ok and report["together"].note.endswith("between nodes")
    assert report["together"].value > 0.05


@pytest.mark.parametrize(
    "changes, row",
    [
        ({"position": -1}, "position"),
        ({"goal_velocity": 0}, "velocity"),
    ],
)
def test_bodies_that_do_not_meet_fail(meeting, changes, row):
    ((name, place),) = changes.items()
    values = getattr(meeting.members[1].path, name)
    off = with_body(meeting, 1, **{name: bumped(values, place, 1e-4)})
    report = verify(off)
    assert not report["together"].ok and row in report["together"].note


def test_bodies_that_do_not_last_equally_long_or_too_long_fail(meeting):
    off = with_body(meeting, 1, duration=1.001 * meeting.duration)
    assert verify(off)["together"].note == "worst: common duration" and not verify(off)["together"].ok
    both = with_body(with_body(meeting, 0, duration=5.1), 1, duration=5.1)
    assert not verify(both)["bounds"].ok


def test_multipliers_that_are_not_those_of_the_optimum_fail(passing, meeting):
    (name,) = passing.densities
    for factor in (0.0, -1.0, 1.01):
        changed = replace(passing, densities={name: factor * passing.densities[name]})
        assert failing(changed) == ["optimality"]
    # One that pushes where the bodies are far from each other.
    pushed = bumped(passing.densities[name], (3, 0), -1e-2)
    assert "optimality" in failing(replace(passing, densities={name: pushed}))
    forces = {key: 1.01 * value for key, value in meeting.forces.items()}
    assert failing(replace(meeting, forces=forces)) == ["optimality"]
    member = meeting.members[0]
    held = member.path.multipliers | {COSTATE: 1.01 * member.path.multipliers[COSTATE]}
    assert "optimality" in failing(with_body(meeting, 0, multipliers=held))


def test_a_step_on_which_one_body_is_not_stable_fails_and_the_body_is_named():
    """A stiff spring on steps of h omega = 2.4 at order 2; the other body's is soft."""
    springs = ((1.0, 0.0), (60.0, 3.0))
    bodies = [
        TransferProblem(1.0, at_rest(x, 0), Free(), 5.0, effects=[Spring(stiff, (0, 0))])
        for stiff, x in springs
    ]
    report = verify(solve(Team(bodies, [Meet()]), order=2, steps=16))
    assert not report["stability"].ok and report["stability"].note.startswith("body 2: h omega = 2.4")


def test_a_check_of_one_s_own_is_told_of_the_worst_body(passing):
    def speed(evidence):
        name = evidence.solution.provenance.problem_name
        return Check.of("fast", 2.0 if name == "west" else 1.0, 9.0, "m/s")

    report = verify(passing, more=[speed])
    assert report["fast"].ok and report["fast"].note == "west" and report.checks[-1].name == "fast"


def test_a_number_that_is_not_finite_fails(passing):
    path = passing.members[0].path
    report = verify(with_body(passing, 0, position=bumped(path.position, (4, 0), np.nan)))
    assert not report.ok and "not a finite number" in report.checks[0].note
