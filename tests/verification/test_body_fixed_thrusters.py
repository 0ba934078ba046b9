"""The least effort of a body that moves and turns by thrusters fixed to it, found in two ways."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from dmoc import Pose, Thrusters, TransferProblem, rotation, solve, verify
from dmoc.basics.quaternions import conjugate, times

MASS, MOMENTS, TIME = 3.0, (1.0, 2.0, 2.8), 5.0
WAY, AXIS, ANGLE = np.array([2.0, 1.0, -1.0]), (0.2, 0.5, -0.8), 2.0
# Ten thrusters that push both ways: eight at the corners of a box, along its edges, and two on its axes.
PLACES = np.array(
    [
        *[(0.6, 0.5, 0.4), (0.6, -0.5, -0.4), (-0.6, 0.5, -0.4), (-0.6, -0.5, 0.4)],
        *[(0.6, 0.5, -0.4), (0.6, -0.5, 0.4), (-0.6, 0.5, 0.4), (-0.6, -0.5, -0.4)],
        *[(0.0, 0.0, 0.7), (0.7, 0.0, 0.0)],
    ]
)
WAYS = np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0)])
WAYS = np.vstack([WAYS, [(0, 1, 0), (0, 0, 1)]]).astype(float)


def extremal():
    """(state and costate) -> their rates and the cost rate, by Pontryagin's conditions on Euler's equations.

    The Hamiltonian is |u|^2 / 2 + nu . f(y, u) and least in u = -B' nu.
    """
    y, nu, u = ca.SX.sym("y", 13), ca.SX.sym("nu", 13), ca.SX.sym("u", 10)
    v, s, x, w = y[3:6], y[6], y[7:10], y[10:13]
    push, twist = ca.DM(WAYS.T) @ u, ca.DM(np.cross(PLACES, WAYS).T) @ u
    in_space = push + 2 * ca.cross(x, ca.cross(x, push) + s * push)
    turning = ca.vertcat(-ca.dot(x, w), s * w + ca.cross(x, w)) / 2
    inertia = ca.DM(MOMENTS)
    f = ca.vertcat(v, in_space / MASS, turning, (twist - ca.cross(w, inertia * w)) / inertia)
    least = -ca.mtimes(ca.jacobian(f, u).T, nu)
    energy = ca.dot(u, u) / 2 + ca.dot(nu, f)
    rates = ca.vertcat(f, -ca.gradient(energy, y), ca.dot(u, u) / 2)
    return ca.Function("extremal", [y, nu], [ca.substitute(rates, u, least)])


def least_effort():
    """The least effort by indirect shooting: costates at the start that lead to the goal."""
    rates = extremal()

    def flown(costate):
        # The part of a quaternion's costate along it changes nothing: at the start q is (1, 0, 0, 0).
        start = np.zeros(27)
        start[6], start[13:19], start[20:26] = 1.0, costate[:6], costate[6:]
        slope = lambda t, z: np.asarray(rates(z[:13], z[13:26])).ravel()  # noqa: E731 - one line
        return solve_ivp(slope, (0, TIME), start, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]

    def miss(costate, share):
        end = flown(costate)
        left = times(conjugate(np.array(rotation(AXIS, share * np.degrees(ANGLE)))), end[6:10])[1:]
        return np.concatenate([end[:3] - share * WAY, end[3:6], left, end[10:13]])

    found = np.zeros(12)
    for share in (0.3, 0.6, 1.0):
        found = fsolve(miss, found, (share,), xtol=1e-12)
    assert np.abs(miss(found, 1.0)).max() < 1e-10
    return flown(found)[26]


@pytest.mark.slow
def test_ten_thrusters_take_the_effort_of_indirect_shooting():
    """To 1e-9 at order 8, against costates on Euler's equations: 1.387830543843 N^2 s."""
    problem = TransferProblem(
        MASS,
        Pose((0, 0, 0)),
        Pose(WAY, attitude=rotation(AXIS, np.degrees(ANGLE))),
        TIME,
        actuator=Thrusters(PLACES, WAYS, both_ways=True),
        inertia=MOMENTS,
    )
    found = solve(problem, order=8, steps=32).raise_for_status()
    assert verify(found).ok
    shot = least_effort()
    assert found.objective == pytest.approx(shot, rel=1e-9) and shot == pytest.approx(1.387830543843, rel=1e-11)
