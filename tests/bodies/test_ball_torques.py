"""A torque of limited magnitude: closed forms of a ball, and what differs from a limit about each axis.

A ball with moment J = 1 turns about one axis at best, whichever that is: its rate is at most that of a cart
that is pushed as hard, and the angle that it turns by at most the integral of the rate.
"""

from dataclasses import replace

import numpy as np
import pytest

from dmoc import Attitude, BallTorque, Fuel, Time, Torque, TransferProblem, load, rotation, solve, verify

REST = Attitude((1, 0, 0, 0))
# Seven eighths of a half turn about an axis of no symmetry.
ANGLE, GOAL = 2.75, Attitude(rotation((1, 2, 2), np.degrees(2.75)))


def turn(**more):
    more = {"actuator": BallTorque(1.0), "inertia": (1, 1, 1), "duration": 5.0} | more
    return TransferProblem(1.0, REST, GOAL, **more)


def test_least_time_is_that_of_a_cart():
    """2 sqrt(J theta / tau); with the same limit about each body axis the torque may be longer."""
    problem = turn(objective=Time(), duration=(1.0, 9.0))
    found = solve(problem, steps=60).raise_for_status()
    assert verify(found).ok
    assert found.duration == pytest.approx(2 * np.sqrt(ANGLE), rel=1e-3)
    assert np.linalg.norm(found.torque, axis=1).max() <= 1 + 1e-6
    assert solve(replace(problem, actuator=Torque(1.0)), steps=60).duration < 0.9 * found.duration


@pytest.mark.parametrize("axis, moment", [((1, 0, 0), 1.0), ((0, 0, 1), 2.8)])
def test_a_slew_about_a_principal_axis_is_in_closed_form_at_order_8(axis, moment):
    """Least time 2 sqrt(J theta / tau), whose switch is on a step end, and least effort 6 J^2 theta^2 / T^3."""
    goal, angle, most = Attitude(rotation(axis, 90)), np.pi / 2, 0.5
    body = {"inertia": (1.0, 2.0, 2.8), "actuator": BallTorque(most), "objective": Time()}
    found = solve(TransferProblem(1.0, REST, goal, (1.0, 12.0), **body), order=8, steps=16).raise_for_status()
    assert verify(found).ok
    assert found.duration == pytest.approx(2 * np.sqrt(moment * angle / most), rel=1e-8)
    slow = TransferProblem(1.0, REST, goal, 5.0, inertia=(1.0, 2.0, 2.8), actuator=Torque())
    least = 6 * moment**2 * angle**2 / 5**3
    assert solve(slow, order=8, steps=16).objective == pytest.approx(least, rel=1e-10)


def test_least_impulse_is_that_of_a_cart(tmp_path):
    """It turns at w with w T - w^2 J / tau = theta and spends 2 J w of torque times time."""
    problem = turn(objective=Fuel())
    found = solve(problem, steps=60).raise_for_status()
    assert verify(found).ok
    rate = 0.5 * (5 - np.sqrt(25 - 4 * ANGLE))
    assert found.objective == pytest.approx(2 * rate, rel=2e-3)
    assert problem.objective.unit_with(problem.actuator) == "N m s"
    found.save(tmp_path / "fuel.nc")
    assert verify(load(tmp_path / "fuel.nc"), problem).ok


def test_least_fuel_of_a_torque_without_a_magnitude_is_refused():
    with pytest.raises(ValueError, match="use BallTorque"):
        turn(actuator=Torque(1.0), objective=Fuel())


def test_least_effort_keeps_to_the_limit_on_the_magnitude():
    """Free, the torque is 6 J theta / T^2 at the ends; within a limit it costs more and stays at the limit."""
    free = solve(turn(actuator=Torque()), steps=40)
    assert free.objective == pytest.approx(6 * ANGLE**2 / 5**3, rel=1e-6)
    held = solve(turn(actuator=BallTorque(0.5)), steps=40).raise_for_status()
    assert verify(held).ok and held.objective > 1.01 * free.objective
    assert np.linalg.norm(held.torque, axis=1).max() == pytest.approx(0.5, rel=1e-4)


def test_a_limit_that_is_enough_is_named():
    """The cart needs 4 J theta / T^2."""
    failed = solve(turn(actuator=BallTorque(0.3)), order=2, steps=20)
    limit = float(failed.message.split("torque limit of ")[1].split()[0])
    assert not failed.success and limit == pytest.approx(4 * ANGLE / 25, rel=1e-2)


def test_too_much_is_found_in_the_unit_of_a_torque():
    actuator = BallTorque(0.5)
    assert actuator.excess(np.array([[0.3, 0.4, 0.0], [0.6, 0.0, 0.8]])) == pytest.approx([0.0, 0.5])
    assert actuator.limit_unit == "N m" and "0.5 N m" in actuator.words()
    found = solve(turn(actuator=actuator), steps=10)
    worse = verify(replace(found, path=replace(found.path, control=1.1 * found.path.control)))
    assert not worse["bounds"].ok
