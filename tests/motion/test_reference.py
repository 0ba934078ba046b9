"""The independent integrator is as accurate as it says: an orbit closes after a revolution."""

import casadi as ca
import numpy as np
import pytest

from dmoc import Force, PointGravity, State, TransferProblem
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.mesh import uniform_mesh
from dmoc.motion.path import DiscretePath
from dmoc.motion.reference import reference


# Measured misses are 5.2e-11 on the circle and 9.2e-12 past the perigee of the ellipse. With ten times the
# relative tolerance they are 3.3e-10 and 6.7e-11, with ten times the absolute one 1.1e-10 and 1.8e-11.
@pytest.mark.parametrize(("eccentricity", "limit"), [(0.0, 7.5e-11), (0.5, 1.35e-11)])
def test_a_coast_of_one_revolution_ends_where_it_began(eccentricity, limit):
    """Kepler's ellipse of semi-major axis 1 m and mu 1 m^3/s^2 has the period 2 pi s, in closed form."""
    steps, period = 4, 2 * np.pi
    start = np.array([1 - eccentricity, 0.0])
    velocity = np.array([0.0, np.sqrt((1 + eccentricity) / (1 - eccentricity))])
    problem = TransferProblem(
        1.0, State(start, velocity), State(start, velocity), period, effects=[PointGravity(1.0)]
    )
    angle, zeros = np.linspace(0, period, steps + 1), np.zeros((steps + 1, 2))
    position = np.column_stack([np.cos(angle) - eccentricity, np.sqrt(1 - eccentricity**2) * np.sin(angle)])
    mass, mesh = np.ones(steps + 1), uniform_mesh(steps)
    path = DiscretePath(mesh, 2, False, period, position, zeros, mass, velocity, velocity)
    place, _ = reference(Dynamics.of(problem), path, 0.0, velocity)
    assert np.abs(place - start).max() < limit


class Tide(Force):
    """A push that swings with the time."""

    def force(self, t, q, v, m):
        return m * ca.vertcat(ca.cos(3 * t), 0)


@pytest.mark.parametrize("start_time", [0.0, 0.7])
def test_a_force_that_depends_on_the_time_acts_at_its_own_time(start_time):
    """x'' = cos(3 t) from rest, in closed form; one long step, so that the time runs within it."""
    duration, steps = 2.0, 2
    still = State((0.0, 0.0), (0.0, 0.0))
    problem = TransferProblem(1.0, still, still, duration, effects=[Tide()], start_time=start_time)
    zeros, mass = np.zeros((steps + 1, 2)), np.ones(steps + 1)
    path = DiscretePath(uniform_mesh(steps), 2, False, duration, zeros, zeros, mass, zeros[0], zeros[0])
    place, speed = reference(Dynamics.of(problem), path, start_time, zeros[0])
    begin, end = 3 * start_time, 3 * (start_time + duration)
    assert speed[0] == pytest.approx((np.sin(end) - np.sin(begin)) / 3, abs=1e-9)
    wanted = (np.cos(begin) - np.cos(end)) / 9 - np.sin(begin) * duration / 3
    assert place[0] == pytest.approx(wanted, abs=1e-9)
