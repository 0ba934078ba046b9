"""An answer between its nodes: its order, the force that is flown there, and on which side of a joint it is."""

import numpy as np
import pytest

from dmoc import (
    Attitude,
    BoxForce,
    Engine,
    Fuel,
    Member,
    On,
    PointGravity,
    Rod,
    Slider,
    State,
    System,
    Time,
    Torque,
    TransferProblem,
    UniformGravity,
    load,
    rotation,
    solve,
)
from dmoc.basics.quaternions import angle_between
from dmoc.scene.problem_file import load_problem

# An ellipse around an attractor with mu = 1 m^3/s^2: its eccentricity, and the time from the periapsis on [s].
E, LASTS = 0.3, 3.0


def ellipse(times):
    """Positions and velocities on it, by Kepler's equation."""
    anomaly = np.array(times, float)
    for _ in range(60):
        anomaly -= (anomaly - E * np.sin(anomaly) - times) / (1 - E * np.cos(anomaly))
    short, rate = np.sqrt(1 - E * E), 1 / (1 - E * np.cos(anomaly))
    place = np.stack([np.cos(anomaly) - E, short * np.sin(anomaly)], axis=-1)
    return place, np.stack([-np.sin(anomaly) * rate, short * np.cos(anomaly) * rate], axis=-1)


def coast(order, steps):
    """The arc of the ellipse as a transfer that needs no force."""
    (start, goal), (leaves, arrives) = ellipse(np.array([0.0, LASTS]))
    problem = TransferProblem(
        1.0, State(start, leaves), State(goal, arrives), LASTS, effects=[PointGravity(1.0)]
    )
    return solve(problem, order=order, steps=steps, options={"ipopt.tol": 1e-12})


def cart(**parts):
    return TransferProblem(1, State((0,), (0,)), State((1,), (0,)), **({"duration": 2.0} | parts))


def least_time(**numerics):
    problem = cart(duration=(0.1, 10), actuator=BoxForce(1.0), objective=Time())
    return solve(problem, structure=False, **numerics)


# Nodes inside a step are of order s + 2, its ends of order 2 s; a slope is one order less than what it is of.
@pytest.mark.parametrize(
    "order, meshes, of_place, of_speed",
    [(2, (40, 80), 2, 2), (4, (16, 32), 4, 3), (6, (8, 16), 5, 4), (8, (5, 10), 6, 5)],
)
def test_between_nodes_an_answer_is_as_exact_as_at_them(order, meshes, of_place, of_speed):
    times = np.linspace(0, LASTS, 401)
    place, speed = ellipse(times)
    gaps = []
    for steps in meshes:
        found = coast(order, steps).at(times)
        gaps.append([np.abs(found.position - place).max(), np.abs(found.velocity - speed).max()])
    seen = np.log2(np.divide(*gaps))
    assert seen == pytest.approx([of_place, of_speed], abs=0.3)


def test_at_order_2_it_is_the_cubic_of_hermite():
    found = coast(2, 12)
    h = found.duration / 12
    middles = 0.5 * (found.time[1:] + found.time[:-1])
    q, v = found.position, found.velocity
    cubic = 0.5 * (q[1:] + q[:-1]) + h / 8 * (v[:-1] - v[1:])
    slope = 1.5 * np.diff(q, axis=0) / h - 0.25 * (v[:-1] + v[1:])
    np.testing.assert_allclose(found.at(middles).position, cubic, atol=1e-14)
    np.testing.assert_allclose(found.at(middles).velocity, slope, atol=1e-13)


def test_nodes_and_step_ends_are_hit():
    found = coast(6, 5)
    np.testing.assert_allclose(found.at(found.time).position, found.position, atol=1e-14)
    np.testing.assert_allclose(found.at(found.end_times).velocity, found.velocity, atol=1e-12)


def test_times_keep_their_shape():
    found = coast(2, 12)
    assert found.at(1.0).position.shape == (2,) and found.at(1.0).mass.shape == ()
    square = found.at(np.full((3, 4), 1.0))
    assert square.position.shape == (3, 4, 2) and square.mass.shape == (3, 4)
    assert found.at([]).velocity.shape == (0, 2)
    assert "velocity" in repr(found.at(1.0)) and "12 times" in repr(square)


@pytest.mark.parametrize("t", [-0.1, 3.1, [1.0, 4.0], np.nan])
def test_outside_its_span_it_says_which_span_it_has(t):
    with pytest.raises(ValueError, match="goes from 0 s to 3 s"):
        coast(2, 12).at(t)


def test_what_is_no_time_is_refused():
    with pytest.raises(ValueError, match="t must be a time"):
        coast(2, 12).at("noon")


def test_a_held_force_jumps_to_the_one_behind():
    found = least_time(steps=10, hold=True)
    at = found.end_times[5]
    np.testing.assert_array_equal(found.at([at - 1e-9, at]).force, found.force[[4, 5]])
    np.testing.assert_array_equal(found.at(found.time[-1]).force, found.force[-1])


def test_the_force_is_what_is_flown_and_without_the_problem_the_polynomial(tmp_path):
    found = least_time(order=6, steps=9)
    found.save(tmp_path / "cart.nc")
    times = np.linspace(0, found.duration, 2001)
    flown, polynomial = found.at(times).force, load(tmp_path / "cart.nc").at(times).force
    assert np.abs(flown).max() <= 1 + 1e-4 < 1.02 < np.abs(polynomial).max()
    # both have the impulse of the discrete equations, here that of a cart that stops
    assert np.trapezoid(flown[:, 0], times) == pytest.approx(0, abs=2e-3)


def test_mass_falls_as_the_engine_burns():
    engine = Engine(2.0, exhaust_velocity=10.0)
    found = solve(cart(duration=2.5, actuator=engine, objective=Fuel()), order=4, steps=20)
    mass = found.at(np.linspace(0, 2.5, 300)).mass
    assert mass[0] == 1 and mass[-1] == pytest.approx(found.final_mass) and mass[-1] < 0.99
    assert np.diff(mass).max() < 1e-5


@pytest.mark.parametrize("order", [2, 4])
def test_a_body_turns_by_unit_quaternions(order):
    """Of a ball the way of least effort is a cubic of the angle: 2 rad x^2 (3 - 2 x)."""
    problem = TransferProblem(
        1.0,
        Attitude((1, 0, 0, 0)),
        Attitude(rotation((0, 0, 1), np.degrees(2.0))),
        3.0,
        inertia=3.0 * np.ones(3),
        actuator=Torque(),
    )
    found = solve(problem, order=order, steps=60)
    x = np.linspace(0, 1, 301)
    at, angle = found.at(3.0 * x), 2.0 * x**2 * (3 - 2 * x)
    half = np.stack([np.cos(angle / 2), 0 * x, 0 * x, np.sin(angle / 2)], axis=1)
    np.testing.assert_allclose(np.linalg.norm(at.attitude, axis=1), 1, rtol=1e-14)
    near = 2e-3 if order == 2 else 5e-6
    assert angle_between(at.attitude, half).max() < near
    np.testing.assert_allclose(at.rate[:, 2], 4.0 * x * (1 - x), atol=near)
    np.testing.assert_allclose(at.torque[:, 2], 4.0 * (1 - 2 * x), atol=3 * near)
    assert at.position.shape == (301, 0)


def test_of_a_system_each_body_by_its_name():
    links = [Slider((0, 0), (1, 0), on="cart"), Rod("cart", 0.5, on="bob")]
    problem = TransferProblem(
        System([Member("cart", 1.0), Member("bob", 0.3)], links),
        start={"cart": State((0, 0), (0, 0)), "bob": State((0, -0.5), (0, 0))},
        goal={"cart": State((1, 0), (0, 0)), "bob": State((1, -0.5), (0, 0))},
        duration=2.0,
        effects=[UniformGravity((0, -9.81))],
        actuator=On("cart", BoxForce(20), axes=[0]),
    )
    found = solve(problem, steps=20)
    at = found.at(np.linspace(0, 2, 77))
    (cart_at, _, push), (bob_at, moves, none) = at.of("cart"), at.of("bob")
    assert np.abs(np.linalg.norm(bob_at - cart_at, axis=1) - 0.5).max() < 1e-5
    assert np.abs(push).max() > 0.1 and not none.any() and np.abs(moves).max() > 0.1
    with pytest.raises(ValueError, match="no body is called 'rope'"):
        at.of("rope")


def test_at_a_joint_of_a_mission_it_is_the_state_behind():
    """Behind a separation there is less mass."""
    found = solve(load_problem("two_stage_ascent").make())
    joint = found.legs[1].provenance.start_time
    at = found.at([joint - 1e-6, joint, joint + 1.0, found.time[-1]])
    assert at.mass[0] == pytest.approx(found.legs[0].final_mass, abs=0.01)
    assert at.mass[1] == found.legs[1].path.mass[0] < at.mass[0] - 1000
    np.testing.assert_allclose(at.position[3], found.position[-1], atol=1e-6)
    np.testing.assert_array_equal(at.force[1], found.legs[1].at(joint).force)
    assert found.at([]).position.shape == (0, 2)


def test_of_a_team_each_body_by_its_name():
    found = solve(load_problem("three_robots").make())
    for name, at in found.at(10.0).items():
        np.testing.assert_array_equal(at.position, found.of(name).at(10.0).position)


def test_the_table_has_a_row_a_node_and_units_in_its_names():
    engine = Engine(2.0, exhaust_velocity=10.0)
    found = solve(cart(duration=2.5, actuator=engine, objective=Fuel()), order=4, steps=20)
    table = found.table()
    assert list(table) == [
        "time [s]",
        "position x [m]",
        "velocity x [m/s]",
        "force x [N]",
        "control throttle [N]",
        "mass [kg]",
    ]
    for name, values in (("time [s]", found.time), ("mass [kg]", found.path.mass)):
        np.testing.assert_array_equal(table[name], values)
    np.testing.assert_array_equal(table["force x [N]"], found.force[:, 0])
    np.testing.assert_allclose(table["velocity x [m/s]"][::2], found.velocity[:, 0], atol=1e-12)
    held = least_time(steps=10, hold=True)
    assert held.table()["force x [N]"].tolist() == [*held.force[:, 0], held.force[-1, 0]]


def test_the_table_of_a_mission_names_the_legs():
    found = solve(load_problem("two_stage_ascent").make())
    table = found.table()
    assert len(table) == len(found.time) and set(table["leg"]) == {"first stage", "second stage"}
    np.testing.assert_array_equal(table["position y [m]"], found.position[:, 1])
