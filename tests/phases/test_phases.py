"""Teams whose bodies have several legs: closed forms, the order of joints, what holds, what is refused."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from dmoc import (
    Apart,
    BallForce,
    Coast,
    DeltaV,
    Drop,
    Frame,
    Free,
    Impulse,
    Leg,
    Meet,
    Mission,
    Moving,
    PointGravity,
    RotatingFrame,
    Spring,
    State,
    Team,
    TransferProblem,
    Via,
    solve,
    verify,
)
from dmoc.phases.climb import PhasedClimb, first_phases
from dmoc.phases.order import Place
from dmoc.phases.program import PhasedProgram
from dmoc.phases.timetable import Timetable
from dmoc.scene.problem_file import load_problem

LASTS = 10.0


def at_rest(*place):
    return State(place, (0, 0))


def by_way_of(place, height, first=(0.1, 9.9), second=(0.1, 9.9), duration=LASTS, **more):
    """From (0, height) at rest to (2, height) at rest, by way of a place."""
    legs = [Leg(first), Via(place), Leg(second)]
    ends = {"start": at_rest(0, height), "goal": at_rest(2, height)}
    return Mission(mass=1.0, **ends, legs=legs, duration=duration, **more)


def cheapest(place, height):
    """Time and effort of that by cubic splines whose time at the place is the best."""
    knots = np.array([(0, height), place, (2, height)], float)

    def effort(time):
        return spline_effort([0, time, LASTS], [1, 1], knots)

    found = minimize_scalar(effort, bounds=(0.5, LASTS - 0.5), method="bounded", options={"xatol": 1e-10})
    return found.x, found.fun


def spline_effort(times, masses, places):
    """Least effort by way of places at given times, at rest at both ends, with a mass in each gap.

    Between two places the path is a cubic, whose integral of |a|^2 is 4/h (v0^2 + v0 v1 + v1^2) - 12/h^2 d
    (v0 + v1) + 12/h^3 d^2; the velocities at the places inside are the best.
    """
    count = len(times)
    square, line, rest = np.zeros((count, count)), np.zeros((count, len(places[0]))), 0.0
    for k, (h, m) in enumerate(zip(np.diff(times), masses, strict=True)):
        gap, weight = places[k + 1] - places[k], 0.5 * m**2
        square[k : k + 2, k : k + 2] += weight * 4 / h * np.array([[2, 1], [1, 2]])
        line[k : k + 2] -= 12 * weight / h**2 * gap
        rest += 12 * weight / h**3 * gap @ gap
    inner = slice(1, count - 1)
    speeds = -np.linalg.solve(square[inner, inner], line[inner])
    return rest + 0.5 * np.sum(line[inner] * speeds)


@pytest.fixture(scope="module")
def delivery():
    return solve(load_problem("delivery").make()).raise_for_status()


@pytest.mark.parametrize("places", [((1.9, 5.5), (0.3, 1.0)), ((0.3, 5.5), (1.9, 1.0))])
def test_far_from_each_other_each_costs_what_it_costs_alone_in_whatever_order_joints_are(places):
    """The guess has both joints in the middle, and one of the two orders is the wrong one."""
    bodies = [by_way_of(place, height) for place, height in zip(places, (5.0, 0.0), strict=True)]
    team = Team(bodies, [Apart(0.4)])
    alone = [cheapest(place, height) for place, height in zip(places, (5.0, 0.0), strict=True)]
    found = solve(team).raise_for_status()
    assert found.objective == pytest.approx(sum(effort for _, effort in alone), rel=1e-7)
    for one, (time, effort), place in zip(found.members, alone, places, strict=True):
        assert one.objective == pytest.approx(effort, rel=1e-6)
        legs = one.problem.joints
        (met,) = [joint.right for joint in legs if joint.events]
        begin = one.legs[met].provenance.start_time
        assert begin == pytest.approx(time, abs=1e-3)
        assert one.legs[met].position[0] == pytest.approx(place, abs=1e-9)
    assert found.joints[0][0].body == int(alone[1][0] < alone[0][0])
    assert verify(found).ok and not found.warnings


def test_joints_that_would_be_at_one_time_become_one():
    """Both are half way by symmetry: T = 10, 24 d^2 / T^3 each along x and 192 y^2 / T^3 across."""
    found = solve(Team([by_way_of((1, 1), 0), by_way_of((1, 6), 5)], [Apart(0.4)])).raise_for_status()
    assert found.joints == ((Place(0, 1), Place(1, 1)),)
    assert found.objective == pytest.approx(2 * cheapest((1, 1), 0)[1], rel=1e-9)
    assert found.path.durations == pytest.approx([5.0, 5.0], rel=1e-7) and verify(found).ok


@pytest.mark.parametrize("first, phases", [(3.0, [3.0, 2.0, 5.0]), (5.0, [5.0, 5.0])])
def test_stated_durations_cut_the_clock_where_they_say(first, phases):
    one = by_way_of((1, 1), 0, 5.0, 5.0, None)
    other = by_way_of((1, 5.5), 5, first, LASTS - first, None)
    team = Team([one, other], [Apart(0.4)])
    found = solve(team, steps=4).raise_for_status()
    assert found.path.durations == pytest.approx(phases, rel=1e-12) and not team.free_duration
    own = spline_effort([0, first, LASTS], [1, 1], np.array([(0, 5), (1, 5.5), (2, 5)], float))
    assert found.members[1].objective == pytest.approx(own, rel=1e-9)
    assert found.iterations < 12 and verify(found).ok


def test_a_leg_of_several_phases_keeps_the_limits_of_its_duration():
    """The first leg of one body is to last at most 2 s, and the second of the other at least 7 s."""
    late = by_way_of((1.9, 5.5), 5, (0.1, 9.9), (7.0, 9.9))
    found = solve(Team([by_way_of((0.3, 1), 0, (0.1, 2.0)), late], [Apart(0.4)])).raise_for_status()
    assert found.path.durations[0] == pytest.approx(2.0, rel=1e-6)
    assert found.path.durations[:2].sum() == pytest.approx(3.0, rel=1e-6)
    assert len(found.warnings) == 2 and verify(found).ok


def crossing(time, touch, distance=1.0):
    """Effort of the delivery where the place is passed and the distance is touched at given times.

    Without the touch each is a spline; by way of q at that time it costs the quadratic a |q - q*|^2 / 2 more.
    """
    half, lasts, places = 9.6, 30.0, np.array([(-2.0, 0.0), (1.0, 0.5), (2.0, 0.0)])
    ends = np.array([(0.3, -2.0), (0.0, 2.0)])

    def courier(q):
        return spline_effort(
            [0, touch, time, lasts], [2 * half, 2 * half, half], np.insert(places, 1, q, axis=0)
        )

    def crosser(q):
        return spline_effort([0, touch, lasts], [half, half], np.insert(ends, 1, q, axis=0))

    total, best, stiff = 0.0, [], []
    for cost in (courier, crosser):
        here, east, west, north = map(cost, np.array([(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0)]))
        a = east + west - 2 * here
        best.append(np.array([0.5 * (west - east), here + 0.5 * a - north]) / a)
        total, stiff = total + here - 0.5 * a * best[-1] @ best[-1], [*stiff, a]
    near = np.linalg.norm(best[0] - best[1])
    return total + 0.5 * stiff[0] * stiff[1] / sum(stiff) * (distance - near) ** 2


def test_a_delivery_costs_what_splines_through_the_touch_say():
    """The cheapest over the time of the place, of the dearest over that of the touch."""

    def dearest(time):
        how = {"bounds": (15.0, 18.0), "method": "bounded", "options": {"xatol": 1e-7}}
        return -minimize_scalar(lambda touch: -crossing(time, touch), **how).fun

    best = minimize_scalar(dearest, bounds=(19.5, 21.0), method="bounded", options={"xatol": 1e-6})
    found = solve(load_problem("delivery").make(), tol=1e-6).raise_for_status()
    assert found.objective == pytest.approx(best.fun, rel=1e-6)
    assert found.error.objective > abs(found.objective / best.fun - 1)
    assert found.path.durations[0] == pytest.approx(best.x, abs=2e-3)
    assert found.distance("courier", "crosser").min() == pytest.approx(1.0, abs=1e-8)


def test_all_checks_hold_and_the_answer_speaks_of_bodies(delivery):
    report = verify(delivery)
    assert report.ok and [check.name for check in report.checks][-3:] == ["joints", "together", "optimality"]
    assert repr(delivery).startswith("PhasedSolution of 'delivery': effort 1.561")
    assert delivery.final_mass == pytest.approx(19.2) and delivery.of("courier").final_mass == pytest.approx(
        9.6
    )
    moments = delivery.at([1.0, 25.0])
    assert moments["courier"].mass == pytest.approx([19.2, 9.6])
    assert len(delivery.table()) == 2 * len(delivery.time)


def test_two_bodies_help_each_other_to_meet_by_impulses():
    """A coasting body is met as a place that moves is; if both push, it costs less."""
    drawn = {"effects": [PointGravity(1.0)], "objective": DeltaV(), "goal": Free()}
    angle, far = 0.5, 1.2
    towards = np.array([np.cos(angle), np.sin(angle)])
    start = State(far * towards, np.array([-towards[1], towards[0]]) / far**0.5)
    pushed = [Impulse(), Coast((0.5, 4)), Impulse()]
    chaser = Mission(mass=1.0, start=State((1, 0), (0, 1)), legs=pushed, name="chaser", **drawn)
    target = Mission(mass=1.0, start=start, legs=[Coast((0.5, 4))], name="target", **drawn)
    found = solve(Team([chaser, target], [Meet()]), order=6, steps=24).raise_for_status()

    def motion(t):
        import casadi as ca

        turned = angle + t / far**1.5
        return far * ca.vertcat(ca.cos(turned), ca.sin(turned))

    alone = solve(replace(chaser, goal=Moving(motion, velocity="matched")), order=6, steps=24)
    assert found.objective == pytest.approx(alone.objective, rel=1e-6)
    report = verify(found)
    assert report.ok and report["primer"].note.startswith("chaser: another impulse")
    both = solve(Team([chaser, replace(target, legs=pushed)], [Meet()]), order=6, steps=24).raise_for_status()
    assert both.objective < 0.95 * found.objective and verify(both).ok
    # They meet behind their impulses, not before.
    kicks = both.of("target").impulses[-1].change - both.of("chaser").impulses[-1].change
    speeds = [both.of(name).legs[-1].path.goal_velocity for name in ("target", "chaser")]
    assert np.linalg.norm(kicks) > 1e-3 and speeds[0] - speeds[1] + kicks == pytest.approx([0, 0], abs=1e-9)


@pytest.mark.parametrize("order, steps", [(2, (12, 24)), (4, (6, 12)), (6, (2, 4))])
def test_the_order_is_that_of_the_scheme_across_joints_of_others(order, steps):
    """A spring pulls both; their joints are free, and so in no step of the other's by chance."""
    pulled = [Spring(0.3, (1.0, 2.5))]
    team = Team(
        [by_way_of((0.4, 1), 0, effects=pulled), by_way_of((1.7, 4.4), 5, effects=pulled)], [Apart(0.1)]
    )
    best = solve(team, order=8, steps=10)
    found = [solve(team, order=order, steps=count, guess=best) for count in steps]
    errors = [abs(one.objective - best.objective) for one in found]
    assert np.log2(errors[0] / errors[1]) > order - 0.4


def test_unknowns_of_one_body_touch_no_rows_of_another_but_those_between():
    team = load_problem("delivery").make()
    plan, path = first_phases(team, 4, 6, False)
    program = PhasedProgram.of(plan, plan.stretches, path)
    pattern = program.assembly().jacobian.sparsity_out(1)
    rows, columns = (np.array(part) for part in pattern.get_triplet())
    of_row, of_column = (np.full(size, -1) for size in program.sizes[:2][::-1])
    for i, body in enumerate(program.bodies):
        of_row[body.rows], of_column[body.columns] = i, i
    own = of_row[rows] >= 0
    assert (of_row[rows][own] == of_column[columns][own]).all() and (of_column >= 0).all()
    assert len(rows) < 90 * 12 * 2 + 400
    kernels = [block.kernel for block in program.blocks]
    assert len(set(map(id, kernels))) < len(kernels)


def test_nothing_is_asked_for_twice_where_phases_meet():
    """A distance is asked for at the end of a phase, not at the begin of the next.

    The durations of one body have limits, and those of others follow.
    """
    team = load_problem("delivery").make()
    plan, path = first_phases(team, 4, 6, False)
    program = PhasedProgram.of(plan, plan.stretches, path)
    lower, upper, low, _ = program.bounds()
    first, second = (group for group in program.rows.groups if group.kind == "node")
    asked = [np.isfinite(group.of(low[program.first_row :]).ravel()) for group in (first, second)]
    assert asked[0][-1] and not asked[1][0] and asked[1][1:-1].all()
    places = [int(leg.at("duration", 0)[0]) for leg in program.legs]
    assert lower[places[2:]] == pytest.approx(0.5 * lower[places[:2]])
    assert (upper[places[2:]] > upper[places[:2]]).all()


def test_bodies_that_leap_through_each_other_between_nodes_are_seen_and_kept_apart():
    """At a right angle, on three steps of order 2 a phase, they need not be near at any node."""
    one = Mission(mass=1.0, start=at_rest(-1, 0), goal=at_rest(1, 0), legs=[Leg(6.0), Leg(4.0)], name="east")
    other = TransferProblem(1.0, at_rest(0, -1), at_rest(0, 1), LASTS, name="north")
    team = Team([one, other], [Apart(0.2)])
    coarse = solve(team, order=2, steps=3)
    assert coarse.status == "infeasible" and "apart east and north between nodes in phase 1" in coarse.message
    assert not verify(coarse)["together"].ok
    climb = PhasedClimb(coarse.timetable, None, None, False, None)
    finer = climb.cut_at_leaps(coarse.path)
    assert len(finer.mesh[0]) > len(coarse.path.mesh[0]) and len(finer.mesh[1]) == len(coarse.path.mesh[1])
    apart = climb.unleapt(climb.attempt(coarse.path))
    assert apart.solved and climb.cut_at_leaps(apart.path) is None
    assert verify(solve(team).raise_for_status()).ok


def test_an_answer_is_a_guess_and_finer_meshes_keep_it(delivery):
    again = solve(delivery.problem, guess=delivery)
    assert again.ladder[0].iterations <= 4 and again.objective == pytest.approx(delivery.objective, rel=1e-4)
    other = solve(delivery.problem, guess=delivery, order=6, steps=16)
    assert (other.order, other.steps) == (6, 32) and other.success
    moved = replace(delivery.problem, together=(Apart(0.9),))
    assert solve(moved, guess=delivery).objective < delivery.objective
    # A time where legs meet is there twice, but for rounding.
    ways = [(np.append(np.diff(one.time) > 0, True), one) for one in delivery.members]
    times = [(one.time[once], one.position[once]) for once, one in ways]
    assert solve(delivery.problem, guess=times).objective == pytest.approx(delivery.objective, rel=1e-4)


def test_bodies_that_have_no_way_past_each_other_fail_with_their_names():
    weak = {"actuator": BallForce(0.09)}
    one = by_way_of((1, 0.0), 0, 5.0, 5.0, None, **weak)
    other = TransferProblem(1.0, at_rest(1, -1), at_rest(1, 1), LASTS, **weak)
    found = solve(Team([one, other], [Apart(1.2)], ("east", "north")), steps=6)
    assert not found.success and ("east" in found.message or "north" in found.message)
    assert found.worst and all(np.isfinite(size) for _, size, _ in found.worst)


def test_orders_that_durations_do_not_allow_are_known():
    team = Team([by_way_of((1, 1), 0, 5.0, 5.0, None), by_way_of((1, 6), 5, 3.0, 7.0, None)], [Apart(0.4)])
    assert Timetable(team, ((Place(1, 1),), (Place(0, 1),))).possible
    assert not Timetable(team, ((Place(0, 1),), (Place(1, 1),))).possible


def test_an_answer_from_what_each_would_do_alone():
    """An attempt that was given up is followed by one from the own answers of all bodies."""
    team = load_problem("delivery").make()
    plan, path = first_phases(team, 4, 8, False)
    climb = PhasedClimb(plan, None, None, False, None)
    with climb.interrupt:
        failed = climb.attempt(path, most=1)
        found = climb.otherwise(failed, path)
    assert not failed.solved and found.solved


RATE = 0.3
# Where the frame is that turns, from which it is counted.
TURNS = Frame(
    lambda t, q: ca.vertcat(
        ca.cos(RATE * t) * q[0] + ca.sin(RATE * t) * q[1], ca.cos(RATE * t) * q[1] - ca.sin(RATE * t) * q[0]
    ),
    "a frame that turns",
)


def into_turning(start, goal, first=4.0, mass=1.0, frame=TURNS):
    """From rest to a goal that is at rest where nothing turns, or anywhere, in two legs of `LASTS` in all."""
    legs = [Leg(first), Leg(LASTS - first)]
    end = Free() if goal is None else at_rest(*goal)
    if frame is not None:
        legs = [Leg(first), frame, Leg(LASTS - first, effects=[RotatingFrame(RATE)])]
        if goal is not None:
            c, s = np.cos(RATE * LASTS), np.sin(RATE * LASTS)
            x, y = np.array([[c, s], [-s, c]]) @ goal
            end = State((x, y), (RATE * y, -RATE * x))
    return Mission(mass=mass, start=at_rest(*start), goal=end, legs=legs)


def test_bodies_keep_apart_across_a_change_of_frame():
    """Two that count from a turning frame on cost as much as where nothing turns, and are as near."""
    ways = (((0, 0), (4, 0)), ((2, -2), (2, 2.3)))
    still, turned = (
        solve(Team([into_turning(*way, frame=frame) for way in ways], [Apart(1.0)]), 6, 6)
        for frame in (None, TURNS)
    )
    assert verify(turned).ok and turned.success
    np.testing.assert_allclose(turned.objective, still.objective, rtol=1e-5)
    gaps = [
        min(
            np.linalg.norm(np.subtract(*[one.legs[i].position for one in found.members]), axis=1).min()
            for i in range(2)
        )
        for found in (still, turned)
    ]
    np.testing.assert_allclose(gaps, 1.0, rtol=1e-6)


@pytest.mark.parametrize("first", [4.0, 7.0])
def test_bodies_meet_in_the_frame_of_the_end(first):
    """Whenever each of the two began to count in it: the closed form of a meeting where nothing turns."""
    team = Team([into_turning((0, 0), None), into_turning((3, 1), None, first, mass=2.0)], [Meet()])
    found = solve(team)
    assert found.success and verify(found).ok
    gap, mass, other, time = 10.0, 1.0, 2.0, LASTS
    np.testing.assert_allclose(
        found.objective, 6 * gap * (mass * other) ** 2 / ((mass**2 + other**2) * time**3), rtol=1e-5
    )


FREE_AT_FIRST = Mission(
    mass=1.0, start=at_rest(0, 5), goal=at_rest(2, 5), legs=[Leg((1, 9)), TURNS, Leg((1, 9))], duration=LASTS
)
OTHER = TransferProblem(1.0, at_rest(0, 5), at_rest(2, 5), LASTS)


@pytest.mark.parametrize(
    "made, said",
    [
        (
            lambda: Team([into_turning((0, 0), None), OTHER], [Apart(1.0)]),
            "counted in one frame, but .*the same frames",
        ),
        (lambda: Team([into_turning((0, 0), None), OTHER], [Meet()]), "are to meet, .*the same frames"),
        (
            lambda: Team([into_turning((0, 0), None), into_turning((0, 5), None, 6.0)], [Apart(1.0)]),
            "change their frame 2 s apart",
        ),
        (
            lambda: Team([into_turning((0, 0), None), FREE_AT_FIRST], [Apart(1.0)]),
            "a time that is not stated; give the legs before it fixed durations",
        ),
        (lambda: Team([by_way_of((1, 1), 0, duration=8.0), OTHER]), "lasts at least 10 s and .* at most 8 s"),
        (
            lambda: solve(
                Team([by_way_of((1, 1), 0, 4.0, 5.0, None), replace(OTHER, duration=(8.0, 9.5))]), mesh=[0, 1]
            ),
            "a mesh for each phase",
        ),
        (lambda: solve(Team([by_way_of((1, 1), 0), OTHER]), guess=[None]), "2 guesses, one a body"),
        (lambda: solve(Team([by_way_of((1, 1), 0), OTHER]), structure=True), "has neither"),
        (lambda: Team([by_way_of((1, 1), 0), 3]), r"must be a dmoc\.TransferProblem or Mission"),
    ],
)
def test_what_is_no_team_is_refused(made, said):
    with pytest.raises(ValueError, match=said):
        made()


def test_what_is_left_behind_does_not_come_along():
    """A load is carried no longer than it must be, where nothing says where it is set down."""
    legs = [Leg((1, 9)), Drop(1.0), Leg((1, 9))]
    one = Mission(mass=2.0, start=at_rest(-1, 0), goal=at_rest(1, 0), legs=legs, duration=LASTS)
    other = TransferProblem(1.0, at_rest(1, 0), at_rest(-1, 0), LASTS)
    found = solve(Team([one, other], [Apart(0.4)])).raise_for_status()
    assert (
        found.path.durations[0] == pytest.approx(1.0, rel=1e-6) and "ends on its shortest" in found.warnings[0]
    )
    assert verify(found).ok
