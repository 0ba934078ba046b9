"""What users ask of an answer, against closed forms and against a look at very many places."""

from dataclasses import replace

import numpy as np
import pytest

from dmoc import (
    J2,
    ApproachCone,
    BallForce,
    BoxForce,
    Constraint,
    Engine,
    Fuel,
    KeepIn,
    KeepOut,
    Nozzles,
    PointGravity,
    Row,
    State,
    Time,
    TransferProblem,
    load,
    solve,
)
from dmoc.answers.along import least, pushes
from dmoc.answers.orbits import osculating
from dmoc.basics.digits import quantity
from dmoc.scene.problem_file import load_problem


def cart(**parts):
    return TransferProblem(
        1, State((0,), (0,)), **({"goal": State((1,), (0,)), "duration": 2.0, "name": "cart"} | parts)
    )


def flyby():
    """A free coast past an attractor of 0.1 m radius, in the plane: the periapsis lies between two nodes."""
    e, mu = 0.6, 1.0
    anomalies = np.array([-2.0, 1.1])
    radius = (1 - e * e) / (1 + e * np.cos(anomalies))
    place = radius * np.array([np.cos(anomalies), np.sin(anomalies)])
    speed = np.sqrt(mu / (1 - e * e)) * np.array([-np.sin(anomalies), e + np.cos(anomalies)])
    eccentric = 2 * np.arctan(np.sqrt((1 - e) / (1 + e)) * np.tan(anomalies / 2))
    lasts = float(np.diff(eccentric - e * np.sin(eccentric))[0])
    ends = (State(place[:, i], speed[:, i]) for i in (0, 1))
    return TransferProblem(1.0, *ends, lasts, effects=[PointGravity(mu), J2(mu, 0.1, 0.0)])


def test_the_velocity_change_is_the_integral_over_a_force_that_turns_about():
    """Least effort over 1 m in 2 s to a speed of 1/2: F = 1 - 3 t / 4, whose size has the integral 5/6 m/s.

    At order 4 the force is exact. With 7 steps it passes zero within one, with 6 at a node.
    """
    for steps in (6, 7):
        facts = solve(cart(goal=State((1,), (0.5,))), order=4, steps=steps).facts()
        assert facts["velocity change"].value == pytest.approx(5 / 6, rel=1e-9)
        assert facts["peak force"].value == pytest.approx(1.0, rel=1e-9)
        assert (facts["velocity change"].unit, facts["peak force"].unit) == ("m/s", "N")


def test_the_velocity_change_of_a_force_that_only_comes_near_zero():
    """A push at rest across the way that turns the force about without its vanishing."""
    problem = TransferProblem(1.0, State((0, 0), (0, 0)), State((1, 0), (0, 0.2)), 2.0)
    found = solve(problem, order=4, steps=7)
    t = np.linspace(0, 2, 200_001)
    exact = np.trapezoid(np.linalg.norm(found.at(t).force, axis=1), t)
    assert pushes(found)[0] == pytest.approx(exact, rel=1e-5)


def test_of_held_forces_it_is_a_sum():
    found = solve(cart(), steps=9, hold=True)
    assert found.facts()["velocity change"].value == pytest.approx(np.abs(found.force).sum() * 2 / 9, rel=1e-12)


def test_an_engine_has_tsiolkovskys_equation_beside_it():
    found = solve(cart(duration=2.5, actuator=Engine(2.0, exhaust_velocity=10.0), objective=Fuel()), tol=1e-3)
    facts, left = found.facts(), found.final_mass
    assert facts["propellant"].value == pytest.approx(1 - left, rel=1e-12)
    rocket = facts["velocity change by the rocket equation"].value
    assert rocket == pytest.approx(10 * np.log(1 / left), rel=1e-12)
    assert facts["velocity change"].value == pytest.approx(rocket, rel=5e-3)
    assert facts["peak force"].value == pytest.approx(2.0, rel=1e-3)


def test_nozzles_that_blow_against_each_other_pay_more_than_they_move():
    """Three nozzles, of which two push aside at all times; what they burn tells them from the way they move."""
    slanted = [(1, 1), (1, -1), (-1, 0)]
    found = solve(
        TransferProblem(
            1.0,
            State((0, 0), (0, 0)),
            State((1, 0), (0, 0)),
            2.5,
            actuator=Nozzles(slanted, 2.0, exhaust_velocity=10.0),
            objective=Fuel(),
        ),
        steps=60,
    )
    facts = found.facts()
    assert facts["velocity change by the rocket equation"].value > 1.15 * facts["velocity change"].value


def test_the_closest_approach_is_found_between_nodes():
    found = solve(flyby(), order=8, steps=9)
    facts = found.facts()
    nodes = np.linalg.norm(found.position, axis=1).min()
    assert facts["closest approach"].value == pytest.approx(0.4, rel=1e-6)
    assert facts["closest approach"].value < nodes - 1e-4
    assert facts["least altitude"].value == pytest.approx(0.3, rel=1e-5)
    assert facts["revolutions"].value == pytest.approx(3.1 / (2 * np.pi), rel=1e-6)
    assert "velocity change" not in facts or facts["velocity change"].value < 1e-6


def test_revolutions_count_the_way_around_and_not_the_angle_of_the_ends():
    facts = solve(load_problem("geo_raise").make()).facts()
    assert facts["revolutions"].value == pytest.approx(20, abs=0.5)
    assert facts["start i"].unit == "degrees" and facts["start a"].value > 6.4e6


ZONES = [
    KeepOut((0.5, 0.05), 0.2),
    KeepIn((-1.0, -0.11), (2.0, 3.0)),
    ApproachCone((1.2, 0.1), (-1, 0), 0.6),
]


@pytest.mark.parametrize("zone", ZONES, ids=lambda zone: type(zone).__name__)
def test_the_least_clearance_is_that_between_nodes_too(zone):
    problem = TransferProblem(1.0, State((0, 0), (0.2, -0.3)), State((1, 0.1), (0, 0.3)), 2.0)
    found = solve(problem, order=4, steps=6)
    found = found.attach(replace(problem, constraints=[zone]))
    t = np.linspace(0, 2, 100_001)
    away = zone.clearance(t, found.at(t).position)
    fact = found.facts()["clearance"]
    assert fact.value == pytest.approx(away.min(), abs=1e-9)
    assert away.min() < zone.clearance(found.time, found.position).min() - 1e-6
    assert f"{type(zone).__name__} 1" in fact.words


@pytest.mark.parametrize("zone", ZONES, ids=lambda zone: type(zone).__name__)
def test_a_clearance_is_what_the_excess_is_the_other_side_of(zone):
    """Just where a zone is not broken its clearance is not negative, and elsewhere it is minus the excess."""
    q = np.random.default_rng(1).uniform(-0.3, 1.3, (500, 2))
    away, broken = zone.clearance(np.zeros(500), q), zone.excess(q, 0 * q)
    assert 20 < (broken > 0).sum() < 480
    np.testing.assert_allclose(np.maximum(0, -away), broken, atol=2e-6 if isinstance(zone, ApproachCone) else 0)


def test_a_clearance_grows_by_the_way_that_is_gone():
    """Of a distance the slope is at most 1, and 1 nearly everywhere."""
    q, h = np.random.default_rng(2).uniform(-0.8, 1.0, (300, 2)), 1e-6
    for zone in ZONES:
        here = zone.clearance(np.zeros(300), q)
        slopes = [(zone.clearance(np.zeros(300), q + h * way) - here) / h for way in np.eye(2)]
        np.testing.assert_allclose(np.quantile(np.hypot(*slopes), [0.02, 0.98]), 1.0, atol=1e-4)


def test_zones_of_ones_own_are_left_out_and_those_that_are_met_are_touched():
    class Ceiling(Constraint):
        def rows(self, t, q, u, m):
            return [Row("height", q[1], -np.inf, 1.0)]

        def excess(self, q, v):
            return np.maximum(0.0, q[:, 1] - 1)

        def words(self):
            return "stays below"

    start, goal = State((0, 0), (0, 0)), State((1, 0), (0, 0))
    found = solve(TransferProblem(1.0, start, goal, 2.0), steps=20)
    assert "clearance" not in found.attach(replace(found.problem, constraints=[Ceiling()])).facts()
    touched = found.attach(replace(found.problem, constraints=[KeepIn((-1, 0), (2, 1))]))
    assert touched.facts()["clearance"].words == "none: it touches KeepIn 1 at the start"
    cut = found.attach(replace(found.problem, constraints=[KeepOut((0.5, 0), 0.1)])).facts()["clearance"]
    assert cut.value == pytest.approx(-0.1) and cut.words == "0.1 m beyond the edge of KeepOut 1 at 1 s"


@pytest.mark.parametrize("e, i", [(0.0, 0.0), (0.3, 28.5), (0.7, 98.0), (1.4, 30.0), (0.2, 180.0)])
def test_elements_are_those_that_a_state_was_made_of(e, i):
    mu, a, raan, argp, nu = 3.986e14, 7e6 / (1 - e), 40.0, 70.0, 100.0
    flat = i in (0.0, 180.0)
    parameter, cos, sin = a * (1 - e * e), np.cos(np.radians(nu)), np.sin(np.radians(nu))
    r = parameter / (1 + e * cos) * np.array([cos, sin, 0])
    v = np.sqrt(mu / parameter) * np.array([-sin, e + cos, 0])

    def turned(angle, axis, x):
        c, s, k = np.cos(np.radians(angle)), np.sin(np.radians(angle)), np.eye(3)[axis]
        return c * x + s * np.cross(k, x) + (1 - c) * (k @ x) * k

    for angle, axis in ((argp, 2), (i, 0), (0.0 if flat else raan, 2)):
        r, v = turned(angle, axis, r), turned(angle, axis, v)
    found = osculating(mu, r, v)
    assert found.a == pytest.approx(a, rel=1e-9) and found.e == pytest.approx(e, abs=1e-12)
    assert found.i == pytest.approx(i, abs=1e-6)
    if not flat:
        assert found.raan == pytest.approx(raan)
    latitude = argp + nu if e == 0.0 else nu
    assert found.nu == pytest.approx(latitude) and (e == 0.0 or found.argp == pytest.approx(argp))


def test_in_the_plane_an_orbit_has_a_sense():
    assert osculating(1.0, np.array([1.0, 0]), np.array([0, -1.0]))[:3] == (1.0, 0.0, 180.0)
    assert osculating(1.0, np.array([1.0, 0]), np.array([0, np.sqrt(2)])).a == np.inf


def test_of_a_mission_the_ends_lie_before_and_behind_its_impulses():
    facts = solve(load_problem("hohmann").make()).facts()
    assert (facts["start a"].value, facts["goal a"].value) == (pytest.approx(1), pytest.approx(2))
    assert facts["start e"].value < 1e-7 > facts["goal e"].value
    assert facts["velocity change"].value == pytest.approx(0.2844570504, rel=1e-6)
    assert facts["velocity change"].words == "0.2845 m/s in 2 impulses"
    assert facts["revolutions"].value == pytest.approx(0.5, rel=1e-6)


def test_what_a_mission_drops_is_no_propellant():
    found = solve(load_problem("two_stage_ascent").make())
    facts, burnt = found.facts(), sum(leg.path.mass[0] - leg.final_mass for leg in found.legs)
    assert facts["propellant"].value == pytest.approx(burnt, rel=1e-12)
    assert facts["propellant"].words == f"{burnt / 1000:.4g} t of propellant"
    assert facts["velocity change"].value == pytest.approx(
        facts["velocity change by the rocket equation"].value, rel=1e-6
    )


def test_several_attractors_each_have_their_approach():
    facts = solve(load_problem("halo_transfer").make()).facts()
    assert {"closest approach to attractor 1", "closest approach to attractor 2"} < set(facts)
    assert "revolutions" not in facts and "start a" not in facts


def test_a_team_has_the_velocity_change_of_each_body():
    found = solve(load_problem("three_robots").make())
    for name, member in zip(found.names, found.members, strict=True):
        assert found.facts()[f"velocity change of {name}"].value == pushes(member)[0] > 0


def test_linked_bodies_have_their_controls():
    facts = solve(load_problem("cart_pole").make()).facts()
    assert facts["peak cart.x"].value > 1 and "velocity change" not in facts


def test_a_body_that_turns_by_wheels():
    """By 120 degrees, with wheels that may hold 0.7 N m s; the wheels turn the body, and nothing else does."""
    found = solve(load_problem("satellite_slew").make(), steps=20)
    facts = found.facts()
    assert facts["turn"].value == pytest.approx(120, abs=5) and facts["turn"].unit == "degrees"
    assert facts["peak rate"].value == np.linalg.norm(found.rate, axis=1).max() > 0.01
    assert facts["peak wheel momentum"].value == np.abs(found.wheel_momentum).max() > 0.1
    assert facts["peak wheel torque"].value == np.abs(found.wheel_torque).max() > 0.001
    assert "peak torque" not in facts and "velocity change" not in facts


def test_a_table_of_few_lines(tmp_path):
    for name in ("orbit_raise", "leo_raise"):
        lines = repr(solve(load_problem(name).make()).facts()).splitlines()
        assert 3 <= len(lines) <= 6
    assert lines[0].startswith("velocity change     ") and "kg of propellant" in lines[0]


def test_a_name_that_is_none_and_an_answer_without_its_problem_are_told(tmp_path):
    found = solve(cart(), steps=8)
    with pytest.raises(KeyError, match="'fuel'; there are 'velocity change', 'peak force'"):
        found.facts()["fuel"]
    found.save(tmp_path / "cart.nc")
    with pytest.raises(ValueError, match="does not hold its problem 'cart'"):
        load(tmp_path / "cart.nc").facts()


def test_the_least_place_is_found_to_a_millionth():
    found = solve(cart(actuator=BoxForce(1.0), objective=Time(), duration=(0.1, 9)), steps=10, structure=False)
    lowest, time = least(found, lambda t, q: (t - 0.777) ** 2)
    assert lowest < 1e-12 and time == pytest.approx(0.777, abs=1e-6)


def test_a_limit_that_is_met_is_the_peak():
    problem = TransferProblem(
        1.0, State((0, 0), (0, 0)), State((1, 0), (0, 0)), 2.2, actuator=BallForce(1.1), name="disc"
    )
    assert solve(problem, steps=40).facts()["peak force"].value == pytest.approx(1.1, rel=1e-6)


@pytest.mark.parametrize(
    "value, unit, words",
    [
        (1.8e11, "m", "1.203 au"),
        (6.678e6, "m", "6678 km"),
        (0.5, "m", "0.5 m"),
        (0.036, "N", "0.036 N"),
        (0.0036, "N", "3.6 mN"),
        (400 * 86400.0, "s", "400 days"),
        (11360.0, "m/s", "11.36 km/s"),
        (2.618e5, "kg", "261.8 t"),
        (0.3, "-", "0.3"),
        (0.0, "m", "0 m"),
        (-2e4, "m", "-20 km"),
    ],
)
def test_units_that_a_person_would_use(value, unit, words):
    assert quantity(value, unit) == words
