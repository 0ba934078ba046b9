"""The oblateness of an attractor turns node and perigee of an orbit at the rates of the textbooks.

H. D. Curtis, Orbital Mechanics for Engineering Students, 3rd edition (2014): section 4.7, rates of node
and perigee to first order in J2; equation (12.30), acceleration.
"""

import casadi as ca
import numpy as np
import pytest

from dmoc import J2, PointGravity, State, TransferProblem
from dmoc.motion.march import simulate

MU, RADIUS, OBLATENESS = 3.986004418e14, 6.378137e6, 1.08262668e-3
EARTH = (PointGravity(MU), J2(MU, RADIUS, OBLATENESS))
A, E, INCLINATION = 8.0e6, 0.1, np.radians(50.0)


def acceleration(effect, dimension=3):
    """q -> dl/dq [m/s^2] of one effect."""
    t, q, v, m = ca.SX.sym("t"), ca.SX.sym("q", dimension), ca.SX.sym("v", dimension), ca.SX.sym("m")
    return ca.Function("a", [q], [ca.gradient(effect.lagrangian(t, q, v, m), q)])


def orbit(steps_a_revolution, revolutions, order=6):
    """Coast around the oblate Earth from the perigee, which is on the x axis at the ascending node."""
    period = 2 * np.pi * np.sqrt(A**3 / MU)
    reach, speed = A * (1 - E), np.sqrt(MU / A * (1 + E) / (1 - E))
    start = State((reach, 0, 0), (0, speed * np.cos(INCLINATION), speed * np.sin(INCLINATION)))
    goal = State((None, None, None), (None, None, None))
    problem = TransferProblem(1.0, start, goal, revolutions * period, EARTH)
    return simulate(problem, steps=steps_a_revolution * revolutions, order=order)


def test_acceleration_is_that_of_the_textbook():
    q = np.random.default_rng(1).standard_normal((20, 3)) * 1e7
    r = np.linalg.norm(q, axis=1)[:, None]
    factor = 1.5 * MU * OBLATENESS * RADIUS**2 / r**5
    expected = factor * q * (5 * (q[:, 2:] / r) ** 2 - [1, 1, 3])
    seen = np.array(acceleration(EARTH[1]).map(20)(q.T)).T
    np.testing.assert_allclose(seen, expected, rtol=1e-13, atol=1e-14 * np.abs(expected).max())


def test_in_the_plane_it_is_the_equator():
    space, plane = (np.array(acceleration(EARTH[1], n)([7e6, 2e6, 0.0][:n])).ravel() for n in (3, 2))
    np.testing.assert_allclose(plane, space[:2], rtol=1e-15)
    with pytest.raises(ValueError, match=r"2 .* or 3 dimensions; got 1"):
        EARTH[1].check_dimension(1)


@pytest.fixture(scope="module")
def coast():
    return orbit(steps_a_revolution=40, revolutions=40)


def test_node_and_perigee_turn_at_their_secular_rates(coast):
    """First-order theory with time-averaged elements: within 0.2 %; seen 0.07 %, of order J2."""
    q, v = coast.position, coast.velocity
    h = np.cross(q, v)
    r = np.linalg.norm(q, axis=1)
    pull = np.cross(v, h) / MU - q / r[:, None]
    node = np.unwrap(np.arctan2(h[:, 0], -h[:, 1]))
    first = np.stack([np.cos(node), np.sin(node), 0 * node], axis=1)
    second = np.cross(h / np.linalg.norm(h, axis=1)[:, None], first)
    perigee = np.unwrap(np.arctan2(np.sum(pull * second, axis=1), np.sum(pull * first, axis=1)))
    a = np.mean(1 / (2 / r - np.sum(v * v, axis=1) / MU))
    e, i = np.mean(np.linalg.norm(pull, axis=1)), np.mean(np.arccos(h[:, 2] / np.linalg.norm(h, axis=1)))
    scale = 1.5 * np.sqrt(MU / a**3) * OBLATENESS * (RADIUS / (a * (1 - e**2))) ** 2
    for angle, expected in ((node, -scale * np.cos(i)), (perigee, scale * (2 - 2.5 * np.sin(i) ** 2))):
        rate = np.polyfit(coast.time, angle, 1)[0]
        assert abs(rate / expected - 1) < 2e-3


def test_axial_momentum_and_energy_are_kept(coast):
    axial = np.cross(coast.position, coast.momentum)[:, 2]
    assert np.ptp(axial) < 1e-12 * axial[0]
    assert np.ptp(coast.energy) < 1e-9 * abs(coast.energy[0])


@pytest.mark.parametrize(
    "wrong, words",
    [
        ((-1.0, RADIUS, 1e-3), "mu must be greater than 0"),
        ((MU, 0.0, 1e-3), "radius .*m"),
        ((MU, 1.0, 6e6), "j2"),
    ],
)
def test_nonsense_is_refused(wrong, words):
    with pytest.raises(ValueError, match=words):
        J2(*wrong)
