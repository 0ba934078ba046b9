"""Numbers of a body from simulated flights: right without noise, as sure as they say with it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm, t

from dmoc import (
    BallForce,
    Engine,
    Flight,
    KeepOut,
    LinearDrag,
    PointGravity,
    Pose,
    State,
    Thrusters,
    TransferProblem,
    UniformGravity,
    Unknown,
    Wrench,
    fly,
    identify,
    plan_for,
    solve,
)
from dmoc.basics.unknown import is_unknown

TRUTH = {"mass": 18.9715, "effects": [LinearDrag(1.2)], "offset": (0.05, -0.03)}
DRAG = "linear_drag_1_coefficient"


def pushes(samples, controls, size=0.4, every=5, seed=0):
    """Commands that change every few samples."""
    some = np.random.default_rng(seed).uniform(-size, size, (samples // every + 1, controls))
    return np.repeat(some, every, axis=0)[:samples]


def flight(step=0.2, samples=100, seed=0, **changes):
    times = step * np.arange(samples)
    known = TRUTH | {"attitudes": 0.3 * times, "start": State((0, 0), (0.02, 0))}
    return fly(times, pushes(samples, 2, every=5), **(known | {"seed": seed} | changes))


def held_flight(step):
    """Commands that change every two seconds, whatever the time between samples."""
    times = np.arange(0, 40 + step / 2, step)
    some = np.random.default_rng(0).uniform(-0.4, 0.4, (22, 2))
    known = TRUTH | {"attitudes": 0.3 * times}
    return fly(times, lambda t: some[int(t / 2 + 1e-9)], State((0, 0), (0.02, 0)), **known)


def asked(**changes):
    return {
        "mass": Unknown(10),
        "effects": [LinearDrag(Unknown(1.0))],
        "offset": Unknown((0, 0)),
        "noise": 1e-3,
    } | changes


def test_a_flight_without_noise_tells_its_numbers():
    """Nine digits at order 4, and more at order 6: forces are held, so the equations alone are off."""
    for order, off in ((4, 1e-7), (6, 1e-9)):
        found = identify(flight(), **asked(order=order))
        assert found.success and found.chi_squared < 1e-6
        assert found.values["mass"] == pytest.approx(18.9715, abs=off * 20)
        assert found.values[DRAG] == pytest.approx(1.2, abs=off * 20)
        assert found.values["offset.x"] == pytest.approx(0.05, abs=off)
        assert found.values["offset.y"] == pytest.approx(-0.03, abs=off)


def test_the_error_of_the_equations_falls_with_the_step_as_the_order_says():
    errors = {
        order: [
            abs(identify(held_flight(step), **asked(order=order)).values["mass"] - 18.9715)
            for step in (2.0, 1.0)
        ]
        for order in (2, 4)
    }
    for order, (long, short) in errors.items():
        assert np.log2(long / short) == pytest.approx(order, abs=0.5)


def test_the_path_is_found_too():
    seen = flight()
    found = identify(seen, **asked())
    still = fly(
        seen.times, seen.forces, State((0, 0), (0.02, 0)), 18.9715, [LinearDrag(1.2)], velocity_noise=0.0
    )
    assert found.position == pytest.approx(still.positions, abs=1e-8)
    assert found.velocity == pytest.approx(still.velocities, abs=1e-8)


def test_the_covariance_is_that_of_all_derivatives_by_the_measurements():
    """Each measurement moved by itself: the numbers move by G, and their covariance is G G' sigma^2."""
    times, sigma = 0.5 * np.arange(14), 1e-3
    forces = pushes(14, 1, every=2)
    seen = fly(times, forces, State((0,), (0,)), mass=5.0, effects=[LinearDrag(0.8)], noise=sigma)

    def values(positions):
        ask = {"mass": Unknown(4), "effects": [LinearDrag(Unknown(1.0))], "noise": sigma}
        found = identify(Flight(times, positions, forces), **ask)
        return np.array(list(found.values.values())), found

    _, found = values(seen.positions)
    step = 1e-4
    slopes = np.array(
        [
            (values(seen.positions + step * one[:, None])[0] - values(seen.positions - step * one[:, None])[0])
            / (2 * step)
            for one in np.eye(14)
        ]
    )
    assert found.covariance == pytest.approx(sigma**2 * slopes.T @ slopes, rel=0.03)


def test_beliefs_are_measurements():
    """Two independent measurements of a mass: weights are inverse squares."""
    seen = flight(noise=2e-3, seed=3)
    alone = identify(seen, **asked(effects=[LinearDrag(1.2)], offset=(0.05, -0.03), noise=2e-3))
    sigma = alone.sigma["mass"]
    thought = Unknown(alone.values["mass"] + sigma, sigma=sigma)
    sure = identify(seen, **asked(mass=thought, effects=[LinearDrag(1.2)], offset=(0.05, -0.03), noise=2e-3))
    assert sure.values["mass"] == pytest.approx(alone.values["mass"] + sigma / 2, abs=0.02 * sigma)
    assert sure.sigma["mass"] == pytest.approx(sigma / np.sqrt(2), rel=0.02)


def test_noise_is_found_where_it_is_not_given():
    found = identify(
        flight(noise=2e-3, samples=200), **{name: one for name, one in asked().items() if name != "noise"}
    )
    assert found.noise == pytest.approx(2e-3, rel=0.12)
    given = identify(flight(noise=2e-3, samples=200), **asked(noise=found.noise))
    assert found.sigma["mass"] == pytest.approx(given.sigma["mass"], rel=1e-3)


def test_a_sample_that_lost_one_axis_tells_of_the_other():
    seen = flight(samples=30, noise=1e-3, velocity_noise=1e-3)
    half, gone = seen.positions.copy(), seen.positions.copy()
    half[::3, 0], gone[::3] = np.nan, np.nan
    one, none = (identify(replace(seen, positions=each), **asked(offset=None)) for each in (half, gone))
    assert one.fit.degrees == none.fit.degrees + 10 and one.sigma["mass"] < none.sigma["mass"]
    slow = seen.velocities.copy()
    slow[::3, 0] = np.nan
    seen = replace(seen, velocities=slow)
    # Velocities are those at the begin of each of 29 steps, ten of which have one axis alone.
    assert identify(seen, **asked(offset=None, velocity_noise=1e-3)).fit.degrees == 60 + 2 * 29 - 10 - 4 - 2


def test_degrees_of_freedom_and_students_distribution():
    """Two positions a sample less the start and the numbers; where noise is found intervals are Student's."""
    seen = flight(samples=12, noise=1e-3)
    known = identify(seen, **asked(offset=None))
    assert known.fit.degrees == 2 * 12 - 4 - 2
    found = identify(seen, **asked(offset=None, noise=None))
    low, high = found.interval(0.9)[DRAG]
    assert (high - low) / (2 * found.sigma[DRAG]) == pytest.approx(t.ppf(0.95, 18), rel=1e-9)
    low, high = known.interval(0.9)[DRAG]
    assert (high - low) / (2 * known.sigma[DRAG]) == pytest.approx(norm.ppf(0.95), rel=1e-9)


def test_a_right_scene_fits_and_a_wrong_one_is_told():
    seen = flight(noise=1e-3, seed=5)
    right, wrong = identify(seen, **asked()), identify(seen, **asked(effects=[]))
    assert (
        right.fitting > 0.01 and right.whiteness > 0.02 and not any("Residuals" in one for one in right.remarks)
    )
    assert wrong.fitting < 1e-6 and wrong.whiteness < 0.01
    assert any("alike from sample to sample" in one for one in wrong.remarks)
    assert any("times as large as the stated noise" in one for one in wrong.remarks)


def test_wrong_commands_are_told_apart_from_wrong_numbers():
    """With errors of the forces as unknowns the intervals are wider, and right."""
    seen = flight(noise=1e-3, force_noise=0.05, seed=6)
    blind, right = identify(seen, **asked()), identify(seen, **asked(force_noise=0.05))
    assert blind.fitting < 1e-6 and right.fitting > 1e-3
    assert right.sigma["mass"] > 3 * blind.sigma["mass"]
    assert abs(right.values["mass"] - 18.9715) < 4 * right.sigma["mass"]
    flown = right.force - seen.forces[:-1]
    assert 0 < np.std(flown) < 0.05


@pytest.mark.parametrize(
    "changes, names",
    [
        ({"strength": Unknown(1.0)}, ["mass", DRAG, "strength"]),
        (
            {"effects": [LinearDrag(Unknown(1.0)), LinearDrag(Unknown(0.5))]},
            [DRAG, "linear_drag_2_coefficient"],
        ),
    ],
)
def test_numbers_that_only_show_together_are_named(changes, names):
    found = identify(flight(noise=1e-3), **asked(**changes))
    assert found.success and f"{' and '.join(names)} are not observable" in found.remarks[0]
    assert all(np.isinf(found.sigma[name]) for name in names)
    assert np.isfinite(found.sigma["offset.x"])
    with pytest.raises(ValueError, match="not observable"):
        plan_for(found, goal=State((0, 0), (0, 0)), duration=5)


def test_without_forces_the_mass_shows_in_nothing():
    seen = flight(noise=1e-3)
    coast = Flight(seen.times, seen.positions, attitudes=seen.attitudes)
    found = identify(replace(coast), mass=Unknown(10), effects=[UniformGravity((0, Unknown(0.0)))], noise=1e-3)
    assert "mass is not observable" in found.remarks[0] and np.isfinite(
        found.sigma["uniform_gravity_1_acceleration.y"]
    )


def test_a_delay_and_a_turn_of_the_forces_are_found():
    seen = flight(delay=0.07, turn=0.05)
    found = identify(seen, **asked(delay=Unknown(0.0), turn=Unknown(0.0), order=6))
    assert found.values["delay"] == pytest.approx(0.07, abs=1e-7)
    assert found.values["turn"] == pytest.approx(0.05, abs=1e-7)
    assert found.values["mass"] == pytest.approx(18.9715, abs=1e-5)


def test_measured_velocities_help():
    seen = flight(noise=1e-3, velocity_noise=1e-3, seed=2)
    without, found = identify(seen, **asked()), identify(seen, **asked(velocity_noise=1e-3))
    assert found.sigma["mass"] < without.sigma["mass"] and found.fitting > 1e-3
    exact = identify(flight(velocity_noise=0.0), **asked(velocity_noise=1e-3))
    assert exact.values["mass"] == pytest.approx(18.9715, abs=1e-6) and exact.chi_squared < 1e-6


def test_the_gravity_of_an_attractor_is_found_far_from_where_it_is_thought_to_be():
    """A nonlinear scene: the gravitational parameter from an arc of an orbit, without any force."""
    times = np.linspace(0, 3, 60)
    start = State((1, 0), (0, 1.1))
    seen = fly(times, np.zeros((60, 2)), start, effects=[PointGravity(1.0)], noise=1e-3)
    found = identify(seen, effects=[PointGravity(Unknown(1.6))], noise=1e-3, order=6)
    assert abs(found.values["point_gravity_1_mu"] - 1) < 4 * found.sigma["point_gravity_1_mu"] < 0.02


def cube(samples=60, seed=0, actuator=None, size=1.0, **changes):
    scale = size * np.array([0.4, 0.4, 0.4, 0.04, 0.04, 0.04])
    forces = pushes(samples, 6, 1.0, every=4, seed=1) * scale if actuator is None else changes.pop("forces")
    start = Pose((0, 0, 0), (0, 0, 0), (1, 0, 0, 0), (0.02, -0.01, 0))
    actuator = Wrench(frame="space") if actuator is None else actuator
    body = {"mass": 9.6, "inertia": (0.15, 0.14, 0.16), "actuator": actuator, "seed": seed}
    return fly(0.25 * np.arange(samples), forces, start, **(body | changes))


def test_inertia_mass_and_marker_of_a_body_that_turns():
    seen = cube(offset=(0.05, -0.03, 0.02))
    found = identify(
        seen,
        mass=Unknown(12),
        inertia=Unknown((0.1, 0.1, 0.1)),
        offset=Unknown((0, 0, 0)),
        noise=1e-3,
        attitude_noise=1e-3,
        order=6,
    )
    wanted = [9.6, 0.15, 0.14, 0.16, 0.05, -0.03, 0.02]
    assert list(found.values.values()) == pytest.approx(wanted, rel=1e-6)
    assert found.problem.inertia[1][1] == pytest.approx(0.14) and not is_unknown(found.problem.inertia[1][1])


def test_rates_alone_tell_the_inertia():
    """Of a body whose attitude is seen poorly, by a gyroscope that is good."""
    seen = cube(rate_noise=1e-4, attitude_noise=0.01, noise=1e-3)
    ask = {"mass": 9.6, "inertia": Unknown((0.1, 0.1, 0.1)), "noise": 1e-3, "attitude_noise": 0.01}
    without, found = identify(seen, **ask), identify(seen, **ask, rate_noise=1e-4)
    assert found.sigma["inertia.x"] < 0.3 * without.sigma["inertia.x"] and found.fitting > 1e-3
    assert abs(found.values["inertia.x"] - 0.15) < 4 * found.sigma["inertia.x"]
    # What is left of attitudes is of the size of their errors.
    assert np.sqrt(np.mean(found.residuals["attitude"] ** 2)) == pytest.approx(1.0, abs=0.15)


def test_thrusters_and_the_centre_of_mass():
    """One thruster is weak, and the centre of mass is two centimetres off the middle."""
    places = [
        (0.15, 0.1, 0),
        (0.15, -0.1, 0),
        (-0.15, 0.1, 0),
        (-0.15, -0.1, 0),
        (0, 0.15, 0.1),
        (0, -0.15, 0.1),
    ]
    ways = [(-1, 0, 0), (-1, 0, 0), (1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0)]
    center, count, samples = np.array([0.01, -0.02, 0.005]), len(ways), 60
    commands = 0.15 + pushes(samples, count, 0.15, every=4, seed=2)
    real = Thrusters(np.array(places) - center, ways, max_thrust=1.0)
    strong = np.array([1, 1, 0.9, 1, 1, 1])
    flown = cube(samples, actuator=real, forces=commands * strong, offset=tuple(-center))
    seen = Flight(flown.times, flown.positions, commands, attitudes=flown.attitudes)
    found = identify(
        seen,
        mass=9.6,
        inertia=(0.15, 0.14, 0.16),
        actuator=Thrusters(places, ways, max_thrust=1.0),
        center=Unknown((0, 0, 0)),
        strength=Unknown((1,) * count),
        noise=1e-3,
        attitude_noise=1e-3,
        order=6,
    )
    assert [found.values[f"center.{axis}"] for axis in "xyz"] == pytest.approx(center, abs=1e-6)
    assert [found.values[f"strength.thruster_{i + 1}"] for i in range(count)] == pytest.approx(strong, abs=1e-6)
    plan = plan_for(found, goal=Pose((1, 0, 0), (0, 0, 0), (1, 0, 0, 0)), duration=9, start=Pose((0, 0, 0)))
    assert plan.actuator.positions[0] == pytest.approx(np.array(places[0]) - center, abs=1e-6)


def test_directions_of_single_thrusters():
    """Two are turned from where they should point; what they push stays as large."""
    places, ways = (
        [(0.15, 0.1, 0), (0.15, -0.1, 0.05), (-0.15, 0.1, 0), (0, 0.15, 0.1)],
        [(-1, 0, 0), (0, 1, 0), (0.8, 0, 0.6), (0, 0, 1)],
    )
    real = [np.array(way, float) for way in ways]
    real[0] += (0, 0.06, -0.04)
    real[2] += (0, 0.05, 0)
    flown = cube(
        60, actuator=Thrusters(places, real, max_thrust=1.0), forces=pushes(60, 4, 0.3, every=4, seed=2)
    )
    stated = Thrusters(places, ways, max_thrust=1.0)
    known = {"mass": 9.6, "inertia": (0.15, 0.14, 0.16), "actuator": stated, "order": 6}
    tilt = [Unknown((0, 0)), (0, 0), Unknown((0, 0.0)), (0, 0)]
    found = identify(flown, **known, tilt=tilt, noise=1e-3, attitude_noise=1e-3)
    assert found.names == (
        "tilt.thruster_1.y",
        "tilt.thruster_1.z",
        "tilt.thruster_3.y",
        "tilt.thruster_3.z",
    )
    assert list(found.values.values()) == pytest.approx([0.06, -0.04, 0.05, 0.0], abs=1e-5)
    ways_found = np.array(found.problem.actuator.directions)
    assert np.linalg.norm(ways_found, axis=1) == pytest.approx(1.0)
    assert ways_found == pytest.approx(np.array([way / np.linalg.norm(way) for way in real]), abs=1e-5)
    every = identify(flown, **known, tilt=Unknown((0.03, -0.02), sigma=0.1), noise=1e-3, attitude_noise=1e-3)
    assert len(every.names) == 8 and every.success
    assert list(every.values.values())[:4] == pytest.approx([0.06, -0.04, 0, 0], abs=1e-3)
    with pytest.raises(ValueError, match="tilt must be two numbers, or two for each of 4"):
        identify(flown, **known, tilt=[Unknown((0, 0))], noise=1e-3, attitude_noise=1e-3)
    with pytest.raises(ValueError, match="tilt needs Thrusters"):
        identify(flight(), mass=Unknown(10), tilt=(0, 0))


def burning(seed=1, **changes):
    """A quarter of the mass is burnt in forty seconds."""
    commands = pushes(81, 2, 5.0, every=5, seed=seed)
    known = {"mass": 20.0, "effects": [LinearDrag(0.7)], "actuator": Engine(10, exhaust_velocity=50.0)}
    return fly(0.5 * np.arange(81), commands, State((0, 0), (0.1, 0)), **(known | changes))


def test_propellant_burns_along_the_flight():
    flown, thought = burning(), Engine(10, exhaust_velocity=Unknown(30.0))
    assert flown.forces.shape[1] == 2
    found = identify(flown, **asked(offset=None, actuator=thought), order=6)
    truth = [20.0, 0.7, 50.0]
    assert [found.values[name] for name in ("mass", DRAG, "exhaust_velocity")] == pytest.approx(truth, rel=1e-5)
    burnt = 0.5 * np.cumsum(np.linalg.norm(flown.forces[:-1], axis=1)) / 50.0
    assert burnt[-1] > 3 and found.mass == pytest.approx(20 - np.append(0, burnt), rel=1e-5)
    # What is thought to weigh hardly more than what burns is found all the same.
    light = identify(flown, **asked(offset=None, actuator=thought, mass=Unknown(7.0)), order=6)
    assert light.values == pytest.approx(found.values, rel=1e-6)
    with pytest.raises(ValueError, match="a mass of 4 kg burns away: the commands burn"):
        identify(flown, **asked(offset=None, actuator=thought, mass=Unknown(4.0)), order=6)
    plan = plan_for(found, goal=State((0, 0), (0, 0)), duration=60.0)
    assert plan.mass == found.mass[-1] and plan.actuator.exhaust_velocity == pytest.approx(50.0, rel=1e-5)
    assert not is_unknown(plan.actuator.exhaust_velocity)
    kept = plan_for(found, replace(plan, actuator=BallForce(1.0)))
    assert kept.actuator == BallForce(1.0)
    fired = plan_for(found, replace(plan, actuator=Engine(7.0, exhaust_velocity=30.0)))
    assert fired.actuator == Engine(7.0, exhaust_velocity=plan.actuator.exhaust_velocity)
    # One that believes in a constant mass is told that something is wrong.
    wrong = identify(flown, **asked(offset=None), order=6)
    assert abs(wrong.values["mass"] - 20) > 1 and "times as large as the stated noise" in wrong.remarks[0]


def test_a_known_mass_that_burns_and_measured_velocities():
    """The mass at the start is exact then; velocities are those of a lighter body further on."""
    flown = burning(velocity_noise=1e-4, noise=1e-3)
    thought = Engine(10, exhaust_velocity=Unknown(30.0))
    given = {"effects": [LinearDrag(0.7)], "actuator": thought, "noise": 1e-3}
    slow = identify(flown, mass=20.0, **given)
    fast = identify(flown, mass=20.0, **given, velocity_noise=1e-4)
    assert fast.mass[0] == 20.0 and fast.sigma["exhaust_velocity"] < 0.8 * slow.sigma["exhaust_velocity"]
    low, high = fast.interval(0.999)["exhaust_velocity"]
    assert low < 50.0 < high and fast.fitting > 0.01


def test_a_turned_engine_and_what_it_cannot_burn():
    turn = identify(
        burning(turn=0.05),
        **asked(offset=None, mass=20.0, turn=Unknown(0.0)) | {"actuator": Engine(10, exhaust_velocity=50.0)},
    )
    assert turn.values["turn"] == pytest.approx(0.05, abs=1e-6)
    # It burns as much as ever.
    commands = pushes(81, 2, 5.0, every=5, seed=1)
    cos, sin = np.cos(0.05), np.sin(0.05)
    known = {"mass": 20.0, "effects": [LinearDrag(0.7)], "actuator": Engine(10, exhaust_velocity=50.0)}
    straight = fly(0.5 * np.arange(81), commands @ [[cos, sin], [-sin, cos]], State((0, 0), (0.1, 0)), **known)
    assert burning(turn=0.05).positions == pytest.approx(straight.positions, abs=1e-10)
    with pytest.raises(ValueError, match="all propellant burns before the end"):
        burning(mass=3.0)


def test_thrusters_that_burn_turn_a_lighter_body():
    """With a known mass: the inertia shrinks with it, and the plan begins with what is left."""
    places = [(0.15, 0.1, 0), (0.15, -0.1, 0.05), (-0.15, 0.1, 0), (0, 0.15, 0.1)]
    ways = [(-1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0.6, 0.8)]
    engine = Thrusters(places, ways, max_thrust=1.0, exhaust_velocity=5.0)
    commands = 0.15 + pushes(60, 4, 0.15, every=4, seed=2)
    flown = cube(60, actuator=engine, forces=commands)
    given = {"actuator": engine, "noise": 1e-3, "attitude_noise": 1e-3, "order": 6}
    found = identify(flown, mass=9.6, inertia=Unknown((0.2, 0.2, 0.2)), **given)
    assert [found.values[f"inertia.{axis}"] for axis in "xyz"] == pytest.approx((0.15, 0.14, 0.16), rel=1e-4)
    rest = Pose((0, 0, 0))
    plan = plan_for(found, start=rest, goal=Pose((1, 0, 0)), duration=9.0)
    assert plan.mass < 8.5
    assert plan.inertia[0][0] == pytest.approx(0.15 * plan.mass / 9.6, rel=1e-4)
    with pytest.raises(ValueError, match="the mass at the start must be known"):
        identify(flown, mass=Unknown(9.6), inertia=(0.15, 0.14, 0.16), **given)


def test_the_estimate_goes_back_into_a_plan():
    found = identify(flight(noise=1e-3), **asked())
    goal = State((1, 1), (0, 0))
    plan = plan_for(found, goal=goal, duration=10.0)
    assert plan.mass == found.values["mass"] and plan.effects[0].coefficient == found.values[DRAG]
    assert not is_unknown(plan.effects[0].coefficient)
    assert (
        np.array(plan.start.position) == pytest.approx(found.position[-1])
        and plan.start_time == found.flight.times[-1]
    )
    old = TransferProblem(
        10.0, State((0, 0), (0, 0)), goal, 10.0, actuator=BallForce(5.0), constraints=[KeepOut((5, 5), 1)]
    )
    new = plan_for(found, old, duration=12.0)
    assert new.mass == plan.mass and new.actuator == old.actuator and new.duration == 12.0
    assert new.constraints == old.constraints and solve(new, order=4, steps=10).success


def test_an_estimate_shows_itself():
    found = identify(flight(noise=1e-3), **asked())
    text = repr(found)
    assert len(text.splitlines()) == 1 and "mass 1" in text and "kg (95 %: " in text
    assert "<table>" in found._repr_html_() and "kg" in found._repr_html_()
    low, high = found.interval()["mass"]
    wide = found.interval(0.99)["mass"]
    assert wide[0] < low < found.values["mass"] < high < wide[1]
    assert (
        found.correlation == pytest.approx(found.correlation.T) and np.abs(found.correlation).max() <= 1 + 1e-9
    )
    assert found.residuals["position"].shape == (100, 2)


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"mass": 10.0, "effects": [], "offset": None}, "nothing is unknown"),
        ({"noise": -1.0}, "noise must be greater than 0"),
        ({"force_noise": (0.1, 0.1, 0.1)}, "force_noise must be one number or 2"),
        ({"offset": Unknown((0, 0, 0))}, "offset must have 2 entries"),
        ({"inertia": (1, 1, 1)}, "attitudes as quaternions"),
        ({"center": (0, 0, 0)}, "center needs Thrusters"),
        ({"delay": Unknown(3.0)}, "less than the time between samples"),
        ({"velocity_noise": 0.1}, "the flight has no velocities"),
        ({"order": 3}, "order must be one of 2, 4, 6, 8"),
        ({"noise": None, "force_noise": 0.1}, "beside other errors it cannot be found"),
    ],
)
def test_what_has_no_meaning_is_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        identify(flight(samples=20), **asked(**changes))
    with pytest.raises(ValueError, match="start's place"):
        identify(replace(flight(samples=20), attitudes=None), **asked())


def held(truth, fits):
    """How often 95 % intervals hold the truth, of all numbers of all fits."""
    return [
        low <= truth[name] <= high
        for fit in fits
        for name, (low, high) in fit.interval().items()
        if name in truth
    ]


@pytest.mark.slow
@pytest.mark.parametrize("noise, force_noise", [(1e-3, 0.0), (1e-3, 0.02), (5e-3, 0.05)])
def test_intervals_hold_as_often_as_they_say(noise, force_noise):
    truth = {"mass": 18.9715, DRAG: 1.2, "offset.x": 0.05, "offset.y": -0.03}
    given = {"noise": noise, "force_noise": force_noise}
    fits = [identify(flight(0.1, 300, seed=seed, **given), **asked(**given)) for seed in range(60)]
    assert all(fit.success for fit in fits)
    assert 0.9 < np.mean(held(truth, fits)) < 0.99
    spread = np.std([fit.values["mass"] for fit in fits])
    assert spread == pytest.approx(np.mean([fit.sigma["mass"] for fit in fits]), rel=0.25)
    assert np.mean([fit.fitting for fit in fits]) == pytest.approx(0.5, abs=0.15)
    assert np.mean([fit.whiteness < 0.05 for fit in fits]) < 0.15
