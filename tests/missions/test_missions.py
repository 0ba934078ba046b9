"""Missions of several legs: closed forms, joints, files, and one leg as a transfer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dmoc
from dmoc import (
    BallForce,
    Bounce,
    CircularOrbit,
    Coast,
    Condition,
    DeltaV,
    Drop,
    Engine,
    FinalHeight,
    FinalMass,
    Flyby,
    Frame,
    Free,
    Impulse,
    KeepOut,
    Leg,
    LinearDrag,
    Mission,
    Periodic,
    PointGravity,
    Pose,
    State,
    TransferProblem,
    UniformGravity,
    Via,
    Wrench,
    rotation,
    three_body,
)
from dmoc.chains.program import MissionProgram
from dmoc.missions.guess import guessed
from dmoc.motion.mesh import uniform_mesh

# Velocity changes of Hohmann's transfer from radius 1 to radius 2 with mu = 1, and its duration.
HOHMANN = 0.2844570503761732
HALF_PERIOD = np.pi * 1.5**1.5


def hohmann(**more):
    return Mission(
        mass=1.0,
        start=CircularOrbit(1.0, mu=1.0, center=(0, 0)),
        goal=CircularOrbit(2.0, mu=1.0),
        effects=[PointGravity(1.0)],
        legs=[Impulse(), Coast((1, 60)), Impulse()],
        objective=DeltaV(),
        **more,
    )


def gates(free=True):
    """From rest over (1, 1) to rest at (2, 0), with a free force."""
    first, second = ((0.1, 1.9), (0.1, 1.9)) if free else (0.7, 1.3)
    legs = [Leg(first), Via((1, 1)), Leg(second)]
    return Mission(1.0, State((0, 0), (0, 0)), State((2, 0), (0, 0)), legs, duration=2.0)


def rocket(**more):
    """Straight up out of uniform gravity in two stages that burn at full thrust."""
    return Mission(
        mass=10.0,
        start=State((0.0,), (0.0,)),
        goal=State((None,), (None,)) if not more else more["goal"],
        legs=[
            Leg(2.0, actuator=Engine(200.0, exhaust_velocity=50.0, min_thrust=200.0), name="lower stage"),
            Drop(1.0),
            Leg(1.0, actuator=Engine(10.0, exhaust_velocity=60.0, min_thrust=10.0), name="upper stage"),
        ],
        effects=[UniformGravity((-1.0,))],
        objective=DeltaV(),
    )


@pytest.mark.parametrize(("order", "steps"), [(2, (40, 80)), (4, (10, 20)), (6, (6, 12)), (8, (8, 16))])
def test_hohmanns_transfer_has_the_order_of_the_scheme(order, steps):
    coarse, fine = (dmoc.solve(hohmann(), order=order, steps=count) for count in steps)
    errors = [abs(found.objective / HOHMANN - 1) for found in (coarse, fine)]
    assert coarse.success and fine.success
    assert np.log2(errors[0] / errors[1]) > order - 0.3
    assert fine.duration == pytest.approx(HALF_PERIOD, rel=20 * errors[1])


def test_hohmanns_transfer_to_a_tolerance_with_its_certificate():
    found = dmoc.solve(hohmann(), tol=1e-9)
    assert found.success and found.error.largest < 1e-9
    assert found.objective == pytest.approx(HOHMANN, rel=1e-9)
    assert found.velocity_change == pytest.approx(found.objective, rel=1e-12)
    report = dmoc.verify(found)
    assert report.ok
    times, sizes = found.primer
    assert sizes[[0, -1]] == pytest.approx(1.0, abs=1e-9) and sizes.max() < 1 + 1e-9
    assert "no further impulse would help" in report["primer"].note
    assert times[0] == 0.0


@pytest.mark.parametrize("order", [4, 6, 8])
def test_a_way_point_at_a_free_time_is_exact_with_one_polynomial_a_leg(order):
    found = dmoc.solve(gates(), order=order, steps=2)
    # Cubic splines through (1, 1): 15 N^2 s, halfway in time.
    assert found.objective == pytest.approx(15.0, rel=1e-13)
    assert [leg.duration for leg in found.legs] == pytest.approx([1.0, 1.0], abs=1e-9)
    assert dmoc.verify(found).ok


def test_a_way_point_at_a_fixed_time_and_its_multiplier():
    assert dmoc.solve(gates(False), order=4, steps=2).objective == pytest.approx(21.958249454928612, rel=1e-13)
    found = dmoc.solve(gates(), order=4, steps=2)
    names = MissionProgram.of(found.problem, found.problem.stretches, found.path).rows["joint 1"].labels
    # The derivative of the objective by the height of the way point is 24 N^2 s/m.
    place = names.index("via_1.position.y")
    assert abs(found.forces["joint 1"][place]) == pytest.approx(24.0, rel=1e-9)


def test_order_2_across_a_free_time():
    errors = [abs(dmoc.solve(gates(), order=2, steps=n).objective / 15 - 1) for n in (20, 40)]
    assert np.log2(errors[0] / errors[1]) > 1.7


def test_a_leg_may_weigh_its_part_of_the_objective():
    """By way of 1 m after 1 s, 2 s more to the goal: both are cubics in the velocity v at that place."""
    weight, spans = 3.0, (1.0, 2.0)
    speed = sum(w * 6 / h**2 for w, h in zip((weight, 1.0), spans, strict=True)) / sum(
        w * 4 / h for w, h in zip((weight, 1.0), spans, strict=True)
    )
    parts = [0.5 * (4 / h * speed**2 - 12 / h**2 * speed + 12 / h**3) for h in spans]
    legs = [Leg(1.0, objective=weight * dmoc.Effort()), Via((1, 0)), Leg(2.0)]
    mission = Mission(1.0, State((0, 0), (0, 0)), State((2, 0), (0, 0)), legs)
    found = dmoc.solve(mission, order=4, steps=2)
    assert [leg.objective for leg in found.legs] == pytest.approx([weight * parts[0], parts[1]], rel=1e-12)
    assert found.legs[0].velocity[-1][0] == pytest.approx(speed, rel=1e-10) and dmoc.verify(found).ok
    assert mission.alone is None and replace(mission, legs=legs[:1]).alone is None


@pytest.mark.parametrize("own", [dmoc.Time(), dmoc.FinalMass(), "least"])
def test_an_objective_of_a_leg_that_cannot_be_added_is_refused(own):
    with pytest.raises(ValueError, match=r"^leg 1: (its own objective|objective must)"):
        Mission(1.0, State((0, 0), (0, 0)), State((2, 0), (0, 0)), [Leg(1.0, objective=own), Leg(1.0)])


def test_a_stage_is_dropped_with_its_velocity():
    found = dmoc.solve(rocket())
    assert found.success and dmoc.verify(found).ok
    lower, upper = found.legs
    assert lower.path.mass[-1] == pytest.approx(10 - 8, rel=1e-9)
    assert upper.path.mass[0] == pytest.approx(lower.path.mass[-1] - 1, rel=1e-9)
    assert upper.velocity[0] == pytest.approx(lower.velocity[-1])
    # Tsiolkovsky's equation in each leg, less gravity.
    speed = 50 * np.log(10 / 2) - 2.0 + 60 * np.log(1 / (1 - 10 / 60)) - 1.0
    assert upper.velocity[-1] == pytest.approx([speed], rel=1e-4)


@pytest.mark.parametrize("order", [4, 6])
def test_parts_that_may_be_left_behind_at_several_times(order):
    """Between two pushes is an optimum, too, to which order 6 led alone."""
    legs = [Leg((0.5, 6)), Drop(0.305), Leg((0.5, 6)), Drop(0.723), Leg((0.5, 6))]
    ends = State((0, 0), (0, 0)), State((2.215, -0.247), (0, 0))
    limits = {"actuator": BallForce(2.632), "duration": 7.511}
    mission = Mission(4.406, *ends, legs, effects=[LinearDrag(0.477)], **limits)
    found = dmoc.solve(mission, order=order)
    assert found.success and dmoc.verify(found).ok
    assert found.legs[1].duration < 1.5
    assert found.ladder[-1].objective == found.objective
    times = iter((0.5, 4.4, mission.duration - 4.9))
    set_apart = [replace(one, duration=next(times)) if isinstance(one, Leg) else one for one in legs]
    near = dmoc.solve(replace(mission, legs=set_apart), order=order)
    between = dmoc.solve(mission, order=order, guess=near)
    assert between.success and between.legs[1].duration > 3
    assert between.objective > 1.05 * found.objective


def test_impulses_that_burn_follow_tsiolkovskys_equation():
    burning = [Impulse(exhaust_velocity=1.0), Coast((1, 60)), Impulse(exhaust_velocity=1.0)]
    found = dmoc.solve(replace(hohmann(), legs=burning, objective=FinalMass()), tol=1e-8)
    assert found.final_mass == pytest.approx(np.exp(-HOHMANN), rel=1e-7)
    assert found.objective == pytest.approx(found.final_mass, rel=1e-12)
    assert dmoc.verify(found).ok


def test_a_bounce_turns_the_velocity_across_round():
    def thrown(restitution):
        return Mission(
            mass=1.0,
            start=State((0.0, 1.0), (1.0, 0.0)),
            goal=Free(),
            legs=[Coast((0.1, 5.0)), Bounce(lambda q: q[1], restitution), Coast(0.5)],
            effects=[UniformGravity((0.0, -2.0))],
        )

    for restitution in (1.0, 0.5):
        found = dmoc.solve(thrown(restitution), order=4, steps=4)
        before, after = found.legs
        assert found.success and dmoc.verify(found)["joints"].ok
        assert before.duration == pytest.approx(1.0, rel=1e-9)
        assert before.velocity[-1] == pytest.approx([1.0, -2.0], rel=1e-8)
        assert after.velocity[0] == pytest.approx([1.0, 2.0 * restitution], rel=1e-8)


def passed(radius):
    """By a planet at rest at the origin, as high as may be a second later."""
    return Mission(
        mass=1.0,
        start=State((-1, 0), (1, 0)),
        goal=Free(),
        legs=[Coast((0.5, 2.0)), Flyby(lambda t: (0 * t, 0 * t), radius, 1.0), Coast(1.0)],
        objective=FinalHeight(1),
        guess=lambda t: (t - 1, max(0.0, 0.2 * (t - 1))),
    )


@pytest.mark.parametrize("radius", [1.0, 0.5])
def test_a_planet_turns_the_velocity_as_far_as_the_nearest_hyperbola(radius):
    found = dmoc.solve(passed(radius), order=4, steps=4)
    report = dmoc.verify(found)
    assert found.success and report.ok, [check for check in report.checks if not check.ok]
    turn = 2 * np.arcsin(1 / (1 + radius))
    # Beyond a right angle no more is gained.
    assert found.objective == pytest.approx(np.sin(min(turn, np.pi / 2)), rel=1e-8)
    assert np.linalg.norm(found.legs[1].velocity[0]) == pytest.approx(1.0, rel=1e-9)
    assert found.impulses == ()


def test_a_planet_that_moves_gives_speed():
    mission = replace(
        passed(1.0),
        start=State((0, 1), (0, -1)),
        legs=[Coast(1.0), Flyby(lambda t: (t - 1, 0 * t), 0.01, 1.0), Coast(1.0)],
        guess=lambda t: (max(0.0, t - 1), abs(t - 1)),
    )
    found = dmoc.solve(mission, order=4, steps=4)
    assert found.success and dmoc.verify(found).ok
    # Relative to the planet's (1, 0) the velocity (-1, -1) keeps its size, and turns upwards.
    assert found.legs[1].velocity[0] == pytest.approx([1.0, np.sqrt(2)], abs=1e-5)


def test_a_leg_may_count_in_another_frame():
    speed = 0.3
    legs = [Coast(1.0), Frame(lambda t, q: [q[0] - speed * t, q[1]], "one that moves"), Coast(1.0)]
    found = dmoc.solve(Mission(1.0, State((0, 0), (1, 2)), Free(), legs), order=4, steps=2)
    assert found.legs[1].velocity[0] == pytest.approx([1 - speed, 2])
    assert found.legs[1].position[-1] == pytest.approx([2 - 2 * speed, 4])


def test_a_closed_path_around_a_lagrange_point():
    ratio = 0.01215
    start = State((0.8233, None), (0.0, None))
    legs = [Coast((2.0, 4.0), steps=24)]

    def around(time):
        place = 0.8369 - 0.0136 * np.cos(2 * np.pi * time / 2.8)
        return (place, 0.045 * np.sin(2 * np.pi * time / 2.8))

    mission = Mission(1.0, start, Periodic(), legs, effects=three_body(ratio), guess=around)
    found = dmoc.solve(mission)
    assert found.success and dmoc.verify(found).ok
    path = found.legs[0]
    assert path.position[-1] == pytest.approx(path.position[0], abs=1e-9)
    # The velocity that is not asked for again follows from Jacobi's integral, to the error of the scheme.
    assert path.velocity[-1] == pytest.approx(path.velocity[0], abs=1e-6)


def tumbling(legs):
    """A body that moves and turns from rest to rest by force and torque."""
    ends = Pose((0, 0, 0)), Pose((2, 1, 0), attitude=rotation((0, 1, 1), degrees=100))
    return Mission(10.0, *ends, legs, actuator=Wrench(5.0, 5.0), inertia=(1.0, 2.0, 2.5))


def test_a_start_that_lies_on_a_zone_to_the_rounding_of_its_numbers_is_left_to_itself():
    # The row of the zone is a square, which is off by twice as much as the distance that a scene lets pass.
    start, goal = State((1 + 5e-10, 0), (0, 0)), State((8, 0), (0, 0))
    leg = Leg((1.0, 9.0))
    zone = KeepOut((2, 0), 1.0)
    mission = Mission(
        1.0, start, goal, [leg, Via((5, 1)), leg], duration=10.0, constraints=[zone], actuator=BallForce(5.0)
    )
    found = dmoc.solve(mission)
    assert found.success and dmoc.verify(found).ok


def test_a_body_that_turns_flies_two_legs_as_it_flies_one():
    whole = tumbling([Leg(6.0)]).alone
    one = dmoc.solve(whole, order=4, mesh=[0, 0.1, 0.2, 0.3, 0.4, 0.55, 0.7, 0.85, 1.0])
    two = dmoc.solve(tumbling([Leg(2.4), Leg(3.6)]), order=4, steps=4)
    assert two.success and dmoc.verify(two).ok
    assert two.objective == pytest.approx(one.objective, rel=1e-9)
    meeting = two.legs[0].position[-1], two.legs[1].position[0]
    assert meeting[0] == pytest.approx(meeting[1], abs=1e-9)
    assert abs(float(two.legs[0].attitude[-1] @ two.legs[1].attitude[0])) == pytest.approx(1.0)


def test_a_guess_of_a_body_that_turns_has_the_rates_of_its_attitudes():
    path = guessed(tumbling([Leg(2.4), Leg(3.6)]), [(uniform_mesh(40), 2)] * 2)
    leg = path.legs[1]
    (attitudes,), step = leg.attitudes, leg.duration / 40
    angle = 2 * np.arccos(abs(float(attitudes[0] @ attitudes[1])))
    assert np.linalg.norm(leg.start_velocity[3:]) == pytest.approx(angle / step, rel=1e-2) and angle > 0.01
    assert np.linalg.norm(attitudes, axis=1) == pytest.approx(1.0)


def test_a_body_that_turns_goes_by_way_of_a_pose():
    middle = Pose((1, 1, 0.5), attitude=rotation((1, 0, 0), degrees=60), velocity=None, rate=None)
    found = dmoc.solve(tumbling([Leg((1.0, 5.0)), Via(middle), Leg((1.0, 5.0))]), order=4, steps=8)
    assert found.success and dmoc.verify(found).ok
    assert found.legs[1].position[0] == pytest.approx([1, 1, 0.5], abs=1e-8)
    assert abs(float(found.legs[1].attitude[0] @ middle.fixed()[0][3:])) == pytest.approx(1.0)


def test_a_path_that_is_driven_closes_with_all_its_velocities():
    legs = [Leg(1.0), Via((1.0, 0.5)), Leg(2.0)]
    found = dmoc.solve(Mission(1.0, State((0, 0), (None, None)), Periodic(), legs), order=4, steps=2)
    first, last = found.legs
    assert found.success and dmoc.verify(found).ok
    assert last.velocity[-1] == pytest.approx(first.velocity[0], abs=1e-9)
    # It is a closed cubic spline: its slopes at both knots make the acceleration continuous there, which is
    # linear along each leg, so that the effort is its integral in closed form.
    place = np.array([1.0, 0.5])
    matrix = np.array([[2 / 1 + 2 / 2, 1 / 1 + 1 / 2], [1 / 1 + 1 / 2, 2 / 1 + 2 / 2]])
    slopes = np.linalg.solve(matrix, np.outer([1, 1], 3 * (1 / 1**2 - 1 / 2**2) * place))
    effort = 0.0
    for span, (begin, end), (v0, v1) in (
        (1.0, (0 * place, place), slopes),
        (2.0, (place, 0 * place), slopes[::-1]),
    ):
        a0 = 6 * (end - begin) / span**2 - (4 * v0 + 2 * v1) / span
        a1 = -6 * (end - begin) / span**2 + (2 * v0 + 4 * v1) / span
        effort += span / 6 * float((a0**2 + a0 * a1 + a1**2).sum())
    assert found.objective == pytest.approx(effort, rel=1e-10)


def test_the_start_of_a_mission_may_be_free():
    def beacon(t):
        return [1.0 + 0.5 * t, 0.0 * t]

    found = dmoc.solve(
        Mission(
            1.0,
            State((0, 0), (0, 0)),
            Condition(lambda t, q, v, m: [q[0] - beacon(t)[0], q[1] - beacon(t)[1], v[0], v[1]]),
            [Leg(2.0)],
            start_time=(-1.5, 3.0),
        ),
        order=4,
        steps=2,
    )
    # The beacon is nearest at the earliest start.
    assert found.legs[0].time[0] == pytest.approx(-1.5)
    assert found.success and dmoc.verify(found).ok


def test_one_leg_is_the_transfer_that_it_was():
    transfer = TransferProblem(
        2.0,
        State((0, 0), (0, 0)),
        State((3, 1), (0, 0)),
        4.0,
        actuator=BallForce(3.0),
        constraints=[KeepOut((1.5, 0.4), 0.3)],
    )
    mission = Mission(
        2.0,
        transfer.start,
        transfer.goal,
        [Leg(4.0)],
        actuator=transfer.actuator,
        constraints=transfer.constraints,
    )
    one, other = dmoc.solve(transfer), dmoc.solve(mission)
    assert [level.iterations for level in one.ladder] == [level.iterations for level in other.ladder]
    assert np.array_equal(one.position, other.position)
    assert one.evaluations == other.evaluations


def test_a_file_holds_a_mission_to_the_last_bit(tmp_path):
    found = dmoc.solve(hohmann())
    found.save(tmp_path / "hohmann.nc")
    back = dmoc.load(tmp_path / "hohmann.nc").attach(hohmann())
    assert np.array_equal(back.position, found.position)
    assert back.objective == found.objective and back.ladder == found.ladder
    assert [kick.size for kick in back.impulses] == [kick.size for kick in found.impulses]
    assert [(one.name, one.value) for one in dmoc.verify(back).checks] == [
        (one.name, one.value) for one in dmoc.verify(found).checks
    ]
    # Between two circles the place of the start is free, and a warm start wanders around; here all is fixed.
    assert dmoc.solve(hohmann(), guess=back).success
    dmoc.solve(gates()).save(tmp_path / "gates.nc")
    again = dmoc.solve(gates(), guess=dmoc.load(tmp_path / "gates.nc"))
    assert again.success and again.iterations < 4


def test_a_check_of_the_users_own_is_told_of_the_worst_leg():
    found = dmoc.solve(gates())

    def width(evidence):
        return dmoc.Check.of("width", float(np.ptp(evidence.position[:, 0])), 1.0 + 1e-9, "m")

    def late(evidence):
        return dmoc.Check.of("late", evidence.problem.start_time, 0.5, "s")

    report = dmoc.verify(found, more=[width, late])
    assert report["width"].ok and report["width"].value == pytest.approx(1.0)
    assert not report["late"].ok and report["late"].note.startswith(found.problem.leg_names[-1])
    assert not report.ok and dmoc.verify(found).ok
    with pytest.raises(ValueError, match="'<lambda>' gives must be"):
        dmoc.verify(found, more=[lambda evidence: True])
    with pytest.raises(ValueError, match="name that is taken: joints"):
        dmoc.verify(found, more=[lambda evidence: dmoc.Check.of("joints", 0.0, 1.0, "m")])


@pytest.mark.parametrize("what", ["velocity", "impulse", "time", "mass"])
def test_a_corrupted_joint_fails(what):
    found = dmoc.solve(rocket()) if what == "mass" else dmoc.solve(hohmann() if what == "impulse" else gates())
    first = found.legs[-1]
    path = first.path
    if what == "velocity":
        path = replace(path, start_velocity=path.start_velocity + 1e-4)
    elif what == "mass":
        path = replace(path, mass=path.mass + 1e-4)
    broken = replace(found, legs=(*found.legs[:-1], replace(first, path=path)))
    if what == "impulse":
        broken = replace(found, own={name: values * 1.001 for name, values in found.own.items()})
    if what == "time":
        later = replace(first.provenance, start_time=first.provenance.start_time + 1e-3)
        broken = replace(found, legs=(*found.legs[:-1], replace(first, provenance=later)))
    assert dmoc.verify(found)["joints"].ok
    assert not dmoc.verify(broken)["joints"].ok


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"legs": []}, "legs has no leg"),
        ({"legs": [Leg(1.0), 3]}, "legs must be a sequence of dmoc.Leg"),
        ({"legs": [Leg()]}, "a leg has no duration and neither has the mission"),
        ({"legs": [Leg(5.0)], "duration": 2.0}, "the legs last 5 to 5 s together, but the mission 2 to 2 s"),
        ({"legs": [Impulse(), Leg(1.0)]}, "an impulse without a limit costs nothing with Effort"),
        ({"legs": [Leg(1.0), Via((1, 2, 3)), Leg(1.0)]}, "its condition has 3 axes but the mission 2"),
        ({"start_time": (3.0, 1.0)}, "start_time must be one time or (earliest, latest)"),
    ],
)
def test_what_has_no_meaning_is_refused_in_one_line(change, words):
    given = {"mass": 1.0, "start": State((0, 0), (0, 0)), "goal": State((1, 0), (0, 0)), "legs": [Leg(1.0)]}
    with pytest.raises(ValueError, match=r"(?s).*") as error:
        Mission(**given | change)
    assert words in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"order": 3}, "order must be one of 2, 4, 6, 8"),
        ({"steps": 1}, "steps must be a whole number of at least 2"),
        ({"tol": 5.0}, "tol must lie between"),
        ({"hold": 3}, "hold must be True or False"),
        ({"mesh": [0, 0.5, 1]}, "a mission has a mesh for each leg"),
        ({"options": 3}, "options must be a dict"),
        ({"progress": 4}, "progress must be a function"),
        ({"time_limit": -1}, "time_limit must be greater than 0"),
    ],
)
def test_numerics_without_a_meaning_are_refused_as_of_a_transfer(given, words):
    with pytest.raises(ValueError, match=words):
        dmoc.solve(gates(), **given)


def test_a_mission_that_cannot_be_is_reported_with_its_leg():
    mission = replace(gates(False), actuator=BallForce(1.0))
    found = dmoc.solve(mission)
    assert not found.success
    assert any(name.startswith(("leg 1", "leg 2", "joint 1", "goal")) for name, _, _ in found.worst)
