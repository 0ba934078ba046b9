"""Teams of several bodies: closed forms, distances, meetings, one clock, guesses, and what is refused."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import dmoc
from dmoc import (
    Apart,
    Attitude,
    BallForce,
    Check,
    ClohessyWiltshire,
    Effort,
    Engine,
    FinalMass,
    Free,
    Fuel,
    KeepIn,
    KeepOut,
    Leg,
    Meet,
    Mission,
    PointGravity,
    Pose,
    State,
    Team,
    Time,
    Torque,
    TransferProblem,
    Wrench,
    solve,
    verify,
)
from dmoc.motion.mesh import uniform_mesh
from dmoc.scene.problem_file import load_problem
from dmoc.teams.climb import TeamClimb, first_path
from dmoc.teams.cuts import leapt
from dmoc.teams.guess import guessed
from dmoc.teams.optima import team_optima
from dmoc.teams.program import TeamProgram

# Masses [kg], distance [m] and duration [s] of two bodies that meet.
NEAR, FAR, GAP, SPAN = 1.3, 2.7, 3.0, 5.0
# The effort of three_robots by cubic splines through the two places where bodies touch [N^2 s].
THREE = 1.80540487595


def at_rest(*place):
    return State(place, (0.0,) * len(place))


ANYWHERE = Free(), Free()


def meeting(together, duration=SPAN, goals=ANYWHERE, **more):
    starts = at_rest(0, 0), at_rest(GAP, 0)
    bodies = zip((NEAR, FAR), starts, goals, strict=True)
    return Team([TransferProblem(m, start, goal, duration, **more) for m, start, goal in bodies], together)


def ring(count, distance=0.35, duration=10.0, **more):
    """Bodies of 1 kg on a circle of radius 1 that go to the opposite side."""
    places = [(np.cos(a), np.sin(a)) for a in 2 * np.pi * np.arange(count) / count]
    robots = [
        TransferProblem(1.0, at_rest(*place), at_rest(*(-x for x in place)), duration, **more)
        for place in places
    ]
    return Team(robots, [Apart(distance)])


def test_two_bodies_meet_with_the_effort_of_the_closed_form():
    """6 d^2 m1^2 m2^2 / ((m1^2 + m2^2) T^3), split by the squares of the masses; without velocity a quarter."""
    least = 6 * (GAP * NEAR * FAR) ** 2 / ((NEAR**2 + FAR**2) * SPAN**3)
    for order, steps in ((4, 2), (6, 3), (8, 2), (None, None)):
        found = solve(meeting([Meet()]), order=order, steps=steps)
        assert found.objective == pytest.approx(least, rel=1e-13)
        place = found.members[0].position[-1]
        assert place == pytest.approx([GAP * FAR**2 / (NEAR**2 + FAR**2), 0], abs=1e-12)
        assert found.members[1].position[-1] == pytest.approx(place, abs=1e-12)
        assert np.abs([one.path.goal_velocity for one in found.members]).max() < 1e-12
    passing = solve(meeting([Meet(velocity=False)]), order=4, steps=2)
    assert passing.objective == pytest.approx(least / 4, rel=1e-13)
    assert all(check.ok for check in verify(passing).checks)


def test_a_meeting_has_the_order_of_the_scheme():
    spring = [dmoc.Spring(0.4, (0, 0))]
    best = solve(meeting([Meet()], effects=spring), order=8, steps=16).objective
    for order, steps in ((2, (16, 32)), (4, (8, 16)), (6, (4, 8))):
        errors = [
            abs(solve(meeting([Meet()], effects=spring), order=order, steps=n).objective - best) for n in steps
        ]
        assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.3)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_bodies_that_change_sides_pass_on_a_circle_that_keeps_them_apart(count):
    """All are at half time at the radius at which neighbours are apart: n m^2 (24 + 96 R^2) / T^3."""
    team = ring(count)
    found = solve(team)
    radius = 0.35 / (2 * np.sin(np.pi / count))
    assert found.objective == pytest.approx(count * (24 + 96 * radius**2) / 10.0**3, rel=1e-9)
    assert all(check.ok for check in verify(found).checks)
    nearest = min(found.distance(a, b).min() for i, a in enumerate(team.names) for b in team.names[i + 1 :])
    assert nearest == pytest.approx(0.35, rel=1e-7)


def test_multipliers_of_a_distance_say_what_a_metre_of_it_costs():
    """J of two that change sides is 2 m^2 (24 + 24 D^2) / T^3; the rows are |d|^2 / D^2 >= 1."""
    found = solve(ring(2, 0.4))
    ((_, values),) = found.densities.items()
    total = float((values[:, 0] * found.path.weights).sum())
    assert -2 * total / 0.4 == pytest.approx(96 * 0.4 / 10.0**3, rel=1e-6)
    # For each body the costate of least effort is -m F.
    for one in found.members:
        assert one.costate == pytest.approx(-one.force, abs=1e-7 * np.abs(one.force).max())


def test_bodies_pass_in_space_too():
    places = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) / 3**0.5
    robots = [TransferProblem(1.0, at_rest(*p), at_rest(*(-p)), 10.0) for p in places]
    found = solve(Team(robots, [Apart(0.35)])).raise_for_status()
    assert all(check.ok for check in verify(found).checks)
    # Never cheaper than straight lines, and by no more than a tenth dearer than the ring in a plane.
    assert 0.096 < found.objective < 1.1 * 4 * (24 + 48 * 0.35**2) / 10.0**3


def test_three_robots_have_the_optimum_of_splines_through_the_touches():
    team = load_problem("three_robots").make()
    default = solve(team)
    assert default.objective == pytest.approx(THREE, rel=2e-5)
    assert all(check.ok for check in verify(default).checks)
    fine = solve(team, tol=1e-7)
    assert fine.success and fine.objective == pytest.approx(THREE, rel=1e-7)
    assert abs(fine.objective / THREE - 1) < fine.error.objective
    touched = (
        fine.time[fine.distance("east", "north").argmin()],
        fine.time[fine.distance("west", "north").argmin()],
    )
    assert touched == pytest.approx((13.885026, 16.114974), abs=2e-3)


def test_no_other_way_round_costs_three_robots_less():
    found = team_optima(load_problem("three_robots").make(), 8)
    assert sum(len(one.starts) for one in found) == 8
    assert found[0].objective == pytest.approx(1.8043, abs=1e-3)
    assert [round(one.objective, 2) for one in found if one.objective > 1.9] == [2.1] * 4 + [2.84] * 2
    assert any("default" in one.starts for one in found[:2])


def test_alike_bodies_and_pairs_share_their_formulas():
    team = ring(4)
    program = TeamProgram.of(team, team.stretches, first_path(team, 4, 6, False))
    kernels = [block.kernel for block in program.blocks]
    assert len(kernels) == 4 * 3 + 6 and len(set(map(id, kernels))) == 4


def test_unknowns_of_one_body_touch_no_rows_of_another_but_those_between():
    """The Jacobian is that of the bodies beside each other, with a few rows below."""
    team = ring(3)
    program = TeamProgram.of(team, team.stretches, first_path(team, 4, 6, False))
    pattern = program.assembly().jacobian.sparsity_out(1)
    rows, columns = (np.array(part) for part in pattern.get_triplet())
    ends = [leg.columns for leg in program.legs[1:]] + [program.sizes[0]]
    begins = [leg.rows for leg in program.legs[1:]] + [program.first_row]
    of_body = np.searchsorted(ends, columns, side="right"), np.searchsorted(begins, rows, side="right")
    own = rows < program.first_row
    assert (of_body[0][own] == of_body[1][own]).all() and (~own).any()


def test_all_bodies_arrive_in_the_same_least_time():
    """Two of limited force F that meet: T = 2 (d / (F / m1 + F / m2))^(1/2), twice in the sum."""
    team = meeting([Meet()], (0.5, 50.0), actuator=BallForce(0.7), objective=Time())
    found = solve(team, tol=1e-5)
    assert found.members[0].duration == pytest.approx(found.members[1].duration, rel=1e-12)
    assert found.duration == pytest.approx(2 * np.sqrt(GAP / (0.7 / NEAR + 0.7 / FAR)), rel=1e-4)
    assert found.objective == pytest.approx(2 * found.duration, rel=1e-9)
    assert all(check.ok for check in verify(found).checks)


def test_a_free_duration_may_end_on_its_limit():
    found = solve(meeting([Meet()], (2.0, 3.0)))
    assert found.duration == pytest.approx(3.0, rel=1e-5) and "ends on its longest" in found.warnings[0]


@pytest.mark.parametrize("goals", [(Free(), Free()), (Free(), at_rest(1.0, 1.0))])
def test_satellites_meet_in_orbit(goals):
    near = [ClohessyWiltshire(0.3)]
    start = first_path(meeting([Meet()], 20.0, goals, effects=near), None, None, False)
    aim = [GAP / 2, 0.0] if goals[1] == Free() else [1.0, 1.0]
    assert all(leg.place[-1] == pytest.approx(aim) for leg in start.legs)
    found = solve(meeting([Meet()], 20.0, goals, effects=near)).raise_for_status()
    report = verify(found)
    assert all(check.ok for check in report.checks) and report["together"].value < 1e-9
    if goals[1] != Free():
        assert found.members[0].position[-1] == pytest.approx([1.0, 1.0], abs=1e-9)


def test_three_meet_in_one_place():
    """All end at the middle of their starts, weighted by the squares of their masses."""
    places, masses = np.array([(0.0, 0.0), (3.0, 0.0), (0.0, 3.0)]), np.array([1.0, 2.0, 1.5])
    bodies = [TransferProblem(m, at_rest(*p), Free(), 5.0) for m, p in zip(masses, places, strict=True)]
    found = solve(Team(bodies, [Meet()]), order=4, steps=2)
    middle = (masses[:, None] ** 2 * places).sum(axis=0) / (masses**2).sum()
    assert all(one.position[-1] == pytest.approx(middle, abs=1e-9) for one in found.members)
    assert verify(found).ok


def test_some_of_a_team_meet_while_others_keep_away():
    bodies = [TransferProblem(1.0, at_rest(x, 0), Free(), 5.0) for x in (0.0, 2.0)]
    bodies.append(TransferProblem(1.0, at_rest(1, -1), at_rest(1, 1), 5.0))
    names = "left", "right", "third"
    parts = [Meet(between=names[:2]), Apart(0.8, between=("left", "third")), Apart(0.8, between=names[1:])]
    found = solve(Team(bodies, parts, names)).raise_for_status()
    assert all(check.ok for check in verify(found).checks)
    assert found.distance("left", "right")[-1] < 1e-9
    assert min(found.distance(name, "third").min() for name in names[:2]) == pytest.approx(0.8, abs=1e-6)


def test_bodies_of_other_kinds_are_a_team():
    """One that turns and one that does not, and an engine that burns with one that does not limit its force."""
    turning = TransferProblem(
        3.0,
        Pose((0, 0, 0), (0, 0, 0), (1, 0, 0, 0), (0, 0, 0)),
        Attitude((0.5**0.5, 0, 0, 0.5**0.5), (0, 0, 0)),
        10.0,
        inertia=(0.2, 0.3, 0.25),
        actuator=Wrench(),
    )
    found = solve(Team([turning, TransferProblem(1.0, at_rest(2, 0, 0), Free(), 10.0)], [Meet()]))
    report = verify(found)
    assert found.success and all(check.ok for check in report.checks) and "body 1" in report["constraint"].note
    burning = [
        TransferProblem(
            10.0, at_rest(-x, 0), at_rest(x, 0), 30.0, actuator=Engine(0.2, 200.0), objective=Fuel()
        )
        for x in (1.0, -1.0)
    ]
    found = solve(Team(burning, [Apart(0.4)]))
    assert found.success and all(check.ok for check in verify(found).checks) and found.final_mass < 20.0


@pytest.mark.parametrize("hold", [False, True])
def test_zones_of_one_body_and_held_forces(hold):
    team = ring(2, 0.4)
    first = replace(team.members[0], constraints=[KeepOut((0.3, -0.15), 0.3)])
    found = solve(Team([first, team.members[1]], [Apart(0.4)]), hold=hold)
    assert found.success and all(check.ok for check in verify(found).checks)
    gone = np.linalg.norm(found.members[0].position - (0.3, -0.15), axis=1).min()
    assert gone == pytest.approx(0.3, rel=1e-5)


def test_guesses_are_bent_to_one_side_since_head_on_no_side_is_nearer():
    """Without the bend every iterate keeps to the line until rounding errors break the tie."""
    team = Team([ONE, TWO], [Apart(0.4)])
    straight = guessed(team, (uniform_mesh(12), 4, False), bent=False)
    bent = guessed(team, (uniform_mesh(12), 4, False))
    sides = [leg.place[12, 1] for leg in bent.legs]
    assert sides[0] < -0.2 and sides[1] > 0.2
    assert np.abs(np.linalg.norm(bent.legs[0].place - bent.legs[1].place, axis=1)).min() > 0.4
    found = [solve(team, guess=start, steps=12) for start in (straight, bent)]
    assert found[1].success and 5 * found[1].iterations < found[0].iterations
    others = [guessed(team, (uniform_mesh(12), 4, False), sides=sides) for sides in ((1,), (-1,))]
    assert np.array_equal(others[0].legs[0].place, bent.legs[0].place)
    assert others[1].legs[0].place[12] == pytest.approx(-sides[0] * np.array([0, 1]), abs=1e-12)


@pytest.mark.parametrize("duration, objective", [(10.0, Effort()), ((5.0, 20.0), Time())])
def test_where_lines_fail_the_bodies_begin_with_paths_of_their_own(duration, objective):
    """An attempt that was given up is followed by one from what each body would do by itself."""
    more = {"duration": duration, "objective": objective, "actuator": BallForce(0.1)}
    team = Team([replace(one, **more) for one in (ONE, TWO)], [Apart(0.4)])
    climb = TeamClimb(team, None, None, False, None)
    path = first_path(team, None, 12, False)
    with climb.interrupt:
        failed = climb.attempt(path, most=1)
        found = climb.otherwise(failed, path)
    assert not failed.solved and found.solved
    assert found.level.objective == pytest.approx(solve(team, steps=12).objective, rel=1e-6)


def test_every_kind_of_guess():
    team = ring(2, 0.4)
    known = solve(team)
    other = [lambda t: (1 - 0.2 * t, -0.02 * t * (10 - t)), lambda t: (-1 + 0.2 * t, 0.02 * t * (10 - t))]
    for guess in (known, known.path, other, [None, other[1]]):
        assert solve(team, guess=guess).objective == pytest.approx(known.objective, rel=1e-9)
    again = solve(team, guess=known)
    assert again.ladder[0].iterations <= 4 < known.ladder[0].iterations
    assert solve(team, guess=known, order=6, steps=16).order == 6
    assert solve(replace(team, guess=known)).ladder[0].iterations <= 4


def test_steps_are_given_or_a_mesh_for_all():
    found = solve(ring(2), mesh=[0, 0.2, 0.5, 0.8, 1], order=4)
    assert [list(one.path.mesh) for one in found.members] == [[0, 0.2, 0.5, 0.8, 1]] * 2
    assert solve(ring(2), steps=8, order=2).steps == 8


def test_bodies_that_leap_through_each_other_between_nodes_are_seen_and_kept_apart():
    """On eight steps of order 2 two that cross at a right angle need not be near at any node."""
    bodies = [
        TransferProblem(1.0, at_rest(-1, 0), at_rest(1, 0), 10.0),
        TransferProblem(1.0, at_rest(0, -1), at_rest(0, 1), 10.0),
    ]
    team = Team(bodies, [Apart(0.2)])
    coarse = solve(team, order=2, steps=5)
    assert not coarse.success and not (seen := verify(coarse)["together"]).ok and "between nodes" in seen.note
    assert coarse.status == "infeasible" and "between nodes is broken by" in coarse.message
    good = solve(team)
    assert good.success and verify(good)["together"].ok


def test_steps_in_which_bodies_leap_through_each_other_are_cut():
    """Two that cross at a right angle, nearest half way between two nodes that are as far as they may be."""
    step = 0.05
    bodies = [
        TransferProblem(1.0, at_rest(-1, 0), at_rest(1, 0), 10.0),
        TransferProblem(1.0, at_rest(step, -1), at_rest(step, 1), 10.0),
    ]
    team = Team(bodies, [Apart(0.99 * step)])
    climb = TeamClimb(team, None, None, False, None)
    with climb.interrupt:
        through = climb.attempt(guessed(team, (uniform_mesh(30), 4, False), bent=False))
        assert through.solved and list(leapt(team, through.path)) == [15]
        found = climb.unleapt(through)
    assert found.solved and not len(leapt(team, found.path)) and len(found.path.mesh) > 31
    assert verify(solve(team))["together"].ok


def test_steps_in_which_a_body_leaps_a_zone_of_its_own_are_cut():
    zone = KeepOut((0.025, 0.0), 0.024)
    team = Team([replace(TWO, constraints=[zone]), replace(ONE, start=at_rest(1, 1), goal=at_rest(-1, 1))])
    assert not verify(solve(team, order=4, steps=30))["bounds"].ok
    found = solve(team)
    assert found.success and verify(found).ok


def test_where_bodies_leap_head_on_they_are_sought_on_other_sides():
    """On an odd number of steps of order 2 no node is in the middle, where straight lines meet."""
    team = Team([ONE, TWO], [Apart(0.1)])
    straight = guessed(team, (uniform_mesh(15), 2, False), bent=False)
    through = solve(team, guess=straight, order=2, steps=15)
    assert not through.success and not verify(through)["together"].ok
    found = solve(team, guess=straight)
    assert found.success and verify(found)["together"].ok and not found.warnings


def test_multipliers_of_a_distance_go_along_to_another_mesh():
    path = solve(ring(2, 0.4), steps=12).path
    finer = path.onto([(uniform_mesh(24), 4)])
    ((name, coarse),) = path.densities.items()
    sums = [
        float((values[:, 0] * on.weights).sum())
        for values, on in ((coarse, path), (finer.densities[name], finer))
    ]
    # The weights of nodes differ within a step, so that a peak at one node is kept in its size alone.
    assert sums[0] < 0 and 0.5 < sums[1] / sums[0] < 2


def test_rows_whose_unknowns_are_all_fixed_are_not_asked_for():
    """At starts and goals that are given no unknown is left, nor where both goals fix one velocity."""
    team = ring(3)
    program = TeamProgram.of(team, team.stretches, first_path(team, 4, 6, False))
    for group in program.rows.groups:
        low = group.of(program.row_bounds[0])[:, 0]
        assert list(low[[0, -1]]) == [-np.inf] * 2 and (low[1:-1] == 1.0).all()
    stopping = meeting([Meet()], goals=(State((None, None), (0, 0)), State((None, None), (0, 0))))
    program = TeamProgram.of(stopping, stopping.stretches, first_path(stopping, 4, 6, False))
    assert list(program.row_bounds[0]) == [0.0, 0.0, -np.inf, -np.inf]
    least = 6 * (GAP * NEAR * FAR) ** 2 / ((NEAR**2 + FAR**2) * SPAN**3)
    assert solve(stopping, steps=2).objective == pytest.approx(least, rel=1e-13)


def test_a_failure_names_the_bodies_and_the_distance_that_would_do():
    failed = solve(ring(2, 0.4, actuator=BallForce(0.07)))
    assert failed.status == "infeasible" and "body 1" in failed.message
    assert "m (you gave 0.4 m) between body 1 and body 2" in failed.message
    assert failed.worst and "body" in failed.worst[0][0]


def test_what_a_distance_lacks_is_told_in_metres():
    team = Team([ONE, TWO], [Apart(0.4)])
    straight = guessed(team, (uniform_mesh(12), 4, False), bent=False)
    stopped = solve(team, guess=straight, steps=12, options={"ipopt.max_iter": 0})
    ((lacks, unit),) = [row[1:] for row in stopped.worst if row[0] == "apart body 1 and body 2[12].distance"]
    assert unit == "m" and lacks == pytest.approx(0.4, rel=1e-6)


def test_a_solution_is_saved_to_the_last_bit(tmp_path):
    team = ring(2, 0.4)
    found = solve(team)
    found.save(tmp_path / "team.nc")
    read = dmoc.load(tmp_path / "team.nc")
    assert isinstance(read, dmoc.TeamSolution) and read.names == found.names
    assert read.objective == found.objective and read.ladder == found.ladder
    for old, new in zip(found.members, read.members, strict=True):
        assert np.array_equal(old.position, new.position) and np.array_equal(old.costate, new.costate)
    assert all(np.array_equal(found.densities[name], read.densities[name]) for name in found.densities)
    with pytest.raises(ValueError, match="does not hold its team 'team'"):
        verify(read)
    report = verify(read, team)
    assert [check.value for check in report.checks] == [check.value for check in verify(found).checks]
    with pytest.raises(ValueError, match="is of body 1, body 2, body 3"):
        read.attach(ring(3))
    damaged = bytearray((tmp_path / "team.nc").read_bytes())
    damaged[len(damaged) // 2] ^= 1
    (tmp_path / "team.nc").write_bytes(damaged)
    with pytest.raises(ValueError, match="its checksum does not hold"):
        dmoc.load(tmp_path / "team.nc")


ONE = TransferProblem(1.0, at_rest(1, 0), at_rest(-1, 0), 10.0)
TWO = replace(ONE, start=at_rest(-1, 0), goal=at_rest(1, 0))
ON_A_LINE = [TransferProblem(1.0, at_rest(x), at_rest(-x), 10.0) for x in (-1.0, 1.0)]
SPUN = TransferProblem(
    1.0,
    Attitude((1, 0, 0, 0), (0, 0, 0)),
    Attitude((0, 1, 0, 0), (0, 0, 0)),
    9.0,
    inertia=(1, 1, 1),
    actuator=Torque(),
)


def twin(evidence):
    return Check.of("together", 0.0, 1.0, "-")


REFUSED = {
    "two or more transfers": lambda: Team([ONE]),
    r"members\[1\] must be a dmoc.TransferProblem": lambda: Team([ONE, 3]),
    r"members\[0\] has an attitude alone": lambda: Team([SPUN, SPUN]),
    "a sequence of dmoc.Apart and Meet": lambda: Team([ONE, TWO], [3]),
    "names must be 2 words": lambda: Team([ONE, TWO], names=("a", "a")),
    "the same duration": lambda: Team([ONE, replace(TWO, duration=9.0)]),
    "the same start_time": lambda: Team([ONE, replace(TWO, start_time=9.0)]),
    "the same dimension": lambda: Team([ONE, replace(ONE, start=at_rest(0, 0, 0), goal=at_rest(0, 0, 1))]),
    "the same objective's unit": lambda: Team(
        [ONE, replace(TWO, actuator=Engine(1.0, 100.0), objective=FinalMass())]
    ),
    "no body is called 'x'": lambda: Team([ONE, TWO], [Apart(0.1, between=("x", "body 1"))]),
    "start 2 m apart, but are to keep 3 m": lambda: Team([ONE, TWO], [Apart(3.0)]),
    "pass through each other on a line": lambda: Team(ON_A_LINE, [Apart(0.1)]),
    "are to meet, but their goals are fixed": lambda: Team([ONE, TWO], [Meet()]),
    "are to meet, but also to keep": lambda: Team([replace(ONE, goal=Free()), TWO], [Meet(), Apart(0.1)]),
    "two or more bodies, each once": lambda: Meet(between=("a", "a")),
    "the names of bodies": lambda: Apart(1.0, between=3),
    "distance must be greater than 0": lambda: Apart(0.0),
    "velocity must be True or False": lambda: Meet(velocity=1),
    "guess of a team": lambda: solve(Team([ONE, TWO]), guess=[None]),
    "guess is of 2 bodies, and the team has 3": lambda: solve(
        Team([ONE, TWO, ONE]), guess=solve(Team([ONE, TWO]), steps=2)
    ),
    "structure and impulses": lambda: solve(Team([ONE, TWO]), structure=True),
    "use dmoc.simulate_team": lambda: dmoc.simulate(Team([ONE, TWO])),
    "team must be a dmoc.Team": lambda: dmoc.simulate_team(ONE),
    "solution must be a TeamSolution; got 3": lambda: dmoc.simulate_team(Team([ONE, TWO]), 3),
    "solution must be a TeamSolution; got .Solution": lambda: dmoc.simulate_team(
        Team([ONE, TWO]), [solve(ONE, steps=2)]
    ),
    "team 'team' is of body 1, body 2, the solution of": lambda: dmoc.simulate_team(
        Team([ONE, TWO]), solve(Team([ONE, TWO], names=("a", "b")), steps=2)
    ),
    "hold must be True or False; got 3": lambda: dmoc.simulate_team(Team([ONE, TWO]), hold=3),
    "guess must be a function of time": lambda: dmoc.export(Team([ONE, TWO]), "nowhere", guess=["x", "y"]),
    "a check of a name that is taken": lambda: verify(solve(Team([ONE, TWO]), steps=2), more=[twin]),
    "no body is called 'x'; there": lambda: solve(Team([ONE, TWO]), steps=2).of("x"),
}


@pytest.mark.parametrize("said", REFUSED)
def test_what_has_no_meaning_is_refused_in_one_line(said):
    with pytest.raises(ValueError, match=said) as refused:
        REFUSED[said]()
    assert "\n" not in str(refused.value)


def test_a_mission_of_one_leg_is_the_transfer_that_it_is():
    alone = Mission(1.0, ONE.start, ONE.goal, [Leg(10.0)])
    assert Team([alone, TWO]).members == Team([ONE, TWO]).members


def test_members_are_called_by_the_names_of_their_problems():
    called = Team([replace(ONE, name="a"), replace(TWO, name="b")])
    assert called.names == ("a", "b")
    assert Team([replace(ONE, name="a"), TWO]).names == ("body 1", "body 2")
    assert Team([ONE, TWO], names=("c", "d")).names == ("c", "d")


def test_orbits_take_as_many_steps_as_their_revolutions_need():
    def circling(radius, angle):
        place = radius * np.cos(angle), radius * np.sin(angle)
        speed = -np.sin(angle) / radius**0.5, np.cos(angle) / radius**0.5
        return TransferProblem(
            1.0, State(place, speed), Free(), 14.0, effects=[PointGravity(1.0)], objective=Effort()
        )

    team = Team([circling(1.0, 0.0), circling(1.3, 1.0)], [Meet()])
    start = first_path(team, None, None, False)
    assert len(start.mesh) > 31
    # They meet where the first one coasts, not in the middle of two orbits, which is near the attractor.
    assert [np.linalg.norm(leg.place[-1]) for leg in start.legs] == pytest.approx([1.0, 1.0])
    found = solve(team)
    assert found.success and all(check.ok for check in verify(found).checks)


@pytest.mark.slow
def test_bodies_that_cannot_pass_each_other_are_no_answer():
    """In a corridor 0.4 m wide two bodies are to keep 0.5 m: they leap through each other between nodes."""
    wall = KeepIn((-np.inf, -0.2), (np.inf, 0.2))
    ends = State((0, 0), (0, 0)), State((4, 0), (0, 0))
    there, back = (TransferProblem(1.0, a, b, 6.0, constraints=[wall]) for a, b in (ends, ends[::-1]))
    found = solve(Team([there, back], [Apart(0.5)]), steps=12)
    assert not found.success and found.status == "infeasible"
    said = re.match(r"apart body 1 and body 2 between nodes is broken by (\S+) m", found.message)
    # Side by side they are 0.4 m apart, which is seen at a few places between nodes.
    assert said and float(said[1]) == pytest.approx(0.1, abs=0.005)
