"""Ipopt sees numbers near 1 whatever the size of the body, of its forces and of their cost."""

import numpy as np
import pytest

from dmoc import Attitude, Nozzles, State, Torque, TransferProblem, rotation, solve, transcribe

CROSS = ((1, 0), (-1, 0), (0, 1), (0, -1))


def turn(size, mass=1.0):
    inertia = tuple(size * moment for moment in (1.0, 2.0, 2.8))
    ends = Attitude((1, 0, 0, 0)), Attitude(rotation((1, 2, 1), 90))
    return TransferProblem(mass, *ends, 4.0, inertia=inertia, actuator=Torque())


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_the_unit_of_torque_grows_with_the_inertia(size):
    unit = transcribe(turn(size), 6, 4).units.torque
    assert unit == pytest.approx(size * transcribe(turn(1.0), 6, 4).units.torque)


@pytest.mark.parametrize("mass", [1e-3, 1e3])
def test_the_force_that_keeps_a_quaternion_long_is_a_number_near_one(mass):
    found = solve(turn(mass, mass), order=4, steps=8).raise_for_status()
    nlp = transcribe(turn(mass, mass), 8, 4)
    seen = np.abs(nlp.pack(found.path)[nlp.columns["reaction"].indices])
    assert 1e-2 < seen.max() < 1e2


@pytest.mark.parametrize("duration", [1.0, 10.0])
def test_the_unit_of_cost_is_that_of_the_unit_of_force_all_the_way(duration):
    """On each axis, as the guess of a transfer from rest to rest has no controls."""
    ends = State((0, 0), (0, 0)), State((1, 0), (0, 0))
    units = transcribe(TransferProblem(1.0, *ends, duration), 6).units
    assert units.cost == pytest.approx(0.5 * 2 * units.force**2 * duration)
    # All nozzles of a cross at once make no force, one of them does.
    units = transcribe(TransferProblem(1.0, *ends, duration, actuator=Nozzles(CROSS, 2.0)), 6).units
    assert units.cost == pytest.approx(0.5 * units.force**2 * duration)


@pytest.mark.parametrize("mass", [0.5, 40.0])
@pytest.mark.parametrize("duration", [0.2, 5.0])
def test_the_unit_of_force_moves_the_mass_over_the_path_in_its_time(mass, duration):
    """Or changes the velocities of its ends into the mean one, if that takes more."""
    slow = TransferProblem(mass, State((0, 0), (0, 0)), State((3, 4), (0, 0)), duration)
    assert transcribe(slow, 6).units.force == pytest.approx(mass * 5.0 / duration**2)
    fast = TransferProblem(mass, State((0, 0), (300, 400)), State((3, 4), (0, 0)), duration)
    turned = np.hypot(300 - 3 / duration, 400 - 4 / duration)
    assert transcribe(fast, 6).units.force == pytest.approx(mass * turned / duration)
