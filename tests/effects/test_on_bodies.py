"""Effects on bodies that turn, against what textbooks say of their forces and torques."""

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    Attitude,
    GravityGradient,
    PlateDrag,
    PlateRadiation,
    Plates,
    PointGravity,
    Pose,
    Torque,
    TransferProblem,
    Wrench,
    rotation,
    simulate,
)
from dmoc.basics.quaternions import conjugate, rotated
from dmoc.motion.dynamics import Dynamics

J = (1.0, 2.0, 2.8)
TURNED = rotation((1, -2, 0.5), 70)
PLACE, SPEED = (3.0, -1.0, 2.0), (0.4, 0.9, -0.2)
MASS = 2.0


def loads(effect):
    """Force in space axes [N] and torque in body axes [N m] of one effect at rest in its rate."""
    here = Pose(PLACE, SPEED, TURNED)
    problem = TransferProblem(MASS, here, here, 1.0, [effect], Wrench(), inertia=J)
    state = np.array([*PLACE, *TURNED]), np.array([*SPEED, 0, 0, 0])
    pushed = Dynamics.of(problem).acceleration(0.0, *state, MASS, np.zeros(6)).full().ravel()
    return MASS * pushed[:3], np.diag(J) @ pushed[3:]


def in_body(vector):
    return rotated(conjugate(np.array(TURNED)), np.asarray(vector, float))


def test_the_gravity_gradient_turns_a_body_as_hughes_says():
    """3 mu / r^3 n x J n with n the direction to the body in body axes; a ball is not turned."""
    mu, radius = 5.0, np.linalg.norm(PLACE)
    n = in_body(PLACE) / radius
    force, torque = loads(GravityGradient(mu))
    assert torque == pytest.approx(3 * mu / radius**3 * np.cross(n, np.diag(J) @ n), abs=1e-12)
    # The force is the slope of the same potential, here by central differences.
    matrix = np.diag(J)

    def potential(place):
        r, seen = np.linalg.norm(place), in_body(place)
        return -mu * (np.trace(matrix) / (2 * r**3) - 3 * seen @ matrix @ seen / (2 * r**5))

    slope = [(potential(np.array(PLACE) + d) - potential(np.array(PLACE) - d)) / 2e-5 for d in 1e-5 * np.eye(3)]
    assert force == pytest.approx(-np.array(slope), abs=1e-9)


def test_the_gravity_gradient_of_a_place_that_is_given_is_the_same():
    here = Attitude(TURNED)
    moving = GravityGradient(5.0, place=lambda t: ca.vertcat(3 + t, -1, 2))
    for effect in (GravityGradient(5.0, place=PLACE), moving):
        problem = TransferProblem(MASS, here, here, 1.0, [effect], Torque(), inertia=J)
        pushed = Dynamics.of(problem).acceleration(0.0, np.array(TURNED), np.zeros(3), MASS, np.zeros(3))
        assert np.diag(J) @ pushed.full().ravel() == pytest.approx(loads(GravityGradient(5.0))[1], abs=1e-12)


def test_a_body_in_orbit_keeps_its_energy_under_its_gravity_gradient():
    here = Pose((10, 0, 0), (0, 0.3, 0.1), rotation((1, 1, 0), 25), (0.02, -0.01, 0.03))
    effects = [PointGravity(1.0), GravityGradient(1.0)]
    problem = TransferProblem(MASS, here, here, 100.0, effects, Wrench(), inertia=J)
    energy = simulate(problem, steps=200, order=6).energy
    assert np.ptp(energy) < 1e-9 * abs(energy[0])


@pytest.mark.parametrize("lit", [True, False])
def test_one_plate_drags_and_turns_about_its_offset(lit):
    """Half C_D rho v^2 A cos(i) against the motion at the offset; none where the plate turns away."""
    ahead = in_body(SPEED) / np.linalg.norm(SPEED)
    normal = ahead if lit else -ahead
    plates = Plates((0.7,), (normal,), ((0.2, -0.1, 0.4),))
    force, torque = loads(PlateDrag(plates, 0.3, 1.1))
    size = 1.1 * 0.3 * np.dot(SPEED, SPEED) * 0.7 * lit
    wanted = -size * np.array(SPEED) / np.linalg.norm(SPEED)
    assert force == pytest.approx(wanted, abs=1e-4)
    assert torque == pytest.approx(np.cross((0.2, -0.1, 0.4), in_body(wanted)), abs=1e-4)


def test_light_pushes_a_mirror_twice_as_hard_as_a_black_plate():
    """P A cos(i) [(1 - rho) s + 2 rho cos(i) n] away from the light, P = flux / c."""
    toward = np.array([0.3, 0.2, 0.9]) / np.linalg.norm([0.3, 0.2, 0.9])
    normal = in_body(toward)
    pressure = 1361.0 / 299_792_458.0
    for mirror, times in ((0.0, 1.0), (1.0, 2.0), (0.3, 1.3)):
        effect = PlateRadiation(Plates((5.0,), (normal,), ((0, 0, 1.0),)), tuple(toward), reflectivity=mirror)
        force, torque = loads(effect)
        assert force == pytest.approx(-times * pressure * 5.0 * toward, rel=1e-3)
        assert torque == pytest.approx(np.cross((0, 0, 1.0), in_body(force)), abs=1e-9)
