"""Bodies that turn: orders, what is kept over long runs, and the equations of Manchester and Peck."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dmoc import Attitude, Effort, Pose, Thrusters, Torque, TransferProblem, Wrench, rotation, simulate, solve
from dmoc.basics.quaternions import angle_between, rotated, times
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.step import step_map
from dmoc.studies.drift import step_function
from dmoc.studies.spinning import free_body, heavy_top, spin

J = np.diag([1.0, 2.0, 2.8])
RATE = (0.3, 0.7, -0.4)
TIME = 6.0


def torque_at(t):
    return np.stack([0.3 * np.sin(t), 0.2 * np.cos(2 * t), -0.1 * t / TIME], axis=-1)


def by_euler(forced, q, w, time):
    """Attitude and rate at the end by Euler's equations, without the package."""

    def slope(t, y):
        torque = torque_at(np.array(t)) if forced else np.zeros(3)
        turn = times(y[:4], np.append(0.0, y[4:])) / 2
        return np.concatenate([turn, np.linalg.solve(J, torque - np.cross(y[4:], J @ y[4:]))])

    found = solve_ivp(slope, (0, time), np.concatenate([q, w]), "DOP853", rtol=3e-14, atol=1e-15)
    return found.y[:4, -1], found.y[4:, -1]


MESHES = {2: (50, 100), 4: (24, 48), 6: (12, 24), 8: (10, 20)}


@pytest.mark.parametrize("forced", [False, True])
@pytest.mark.parametrize("order", MESHES)
def test_simulation_has_its_order(order, forced):
    here = Attitude((1, 0, 0, 0), RATE)
    problem = TransferProblem(1.0, here, here, TIME, actuator=Torque(), inertia=(1, 2, 2.8))
    q, w = by_euler(forced, np.array([1.0, 0, 0, 0]), np.array(RATE), TIME)
    errors = []
    for steps in MESHES[order]:
        rule = scheme(order)
        nodes = np.append((np.arange(steps)[:, None] + rule.points[:-1]).ravel() / steps, 1.0) * TIME
        control = torque_at(nodes) if forced else None
        found = simulate(problem, control, steps=steps, order=order)
        errors.append([angle_between(found.attitude[-1], q), np.linalg.norm(found.rate[-1] - w)])
    seen = np.log2(np.divide(*errors))
    assert seen.min() > order - 0.3, f"{seen} {errors}"


def body_with_thrusters():
    corners = np.array(
        [(1, 1, 0), (1, -1, 0), (-1, 1, 0), (0, 1, 1), (0, 1, -1), (0, -1, 1), (1, 0, 1), (-1, 0, 1)]
    )
    ways = [(-1, 0, 0), (-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, -1)]
    return TransferProblem(
        3.0,
        Pose((0, 0, 0)),
        Pose((2, 1, -1), attitude=rotation((0.2, 0.5, -0.8), 114)),
        5.0,
        actuator=Thrusters(0.5 * corners, ways, both_ways=True),
        inertia=(1, 2, 2.8),
    )


def reorientation(**more):
    goal = Attitude(rotation((1, 1, 1), 120))
    return TransferProblem(
        1.0, Attitude((1, 0, 0, 0)), goal, 5.0, actuator=Torque(), inertia=(1, 2, 2.8), **more
    )


OPTIMA = {2: (40, 80), 4: (20, 40), 6: (16, 32), 8: (8, 16)}


@pytest.mark.parametrize("make", [reorientation, body_with_thrusters], ids=["torque", "thrusters"])
@pytest.mark.parametrize("order", OPTIMA)
def test_optima_have_their_order_in_state_control_costate_and_cost(order, make):
    fine = solve(make(), order=8, steps=48).raise_for_status()

    def at_ends(solution, values):
        """Values at four common times."""
        count = len(values) - 1
        return values[:: count // 4][:5]

    def errors(steps):
        found = solve(make(), order=order, steps=steps).raise_for_status()
        pairs = [(found.path.position, fine.path.position), (found.path.control, fine.path.control)]
        # At the ends the costate of fixed entries is not the density that it is inside.
        pairs.append((found.costate, fine.costate))
        gaps = [np.abs(at_ends(found, a)[1:-1] - at_ends(fine, b)[1:-1]).max() for a, b in pairs]
        return [*gaps, abs(found.objective - fine.objective)]

    coarse, halved = map(errors, OPTIMA[order])
    for name, before, after in zip(("state", "control", "costate", "cost"), coarse, halved, strict=True):
        # Below this, what is left is the optimiser's own error.
        if after > 2e-11:
            assert np.log2(before / after) > order - 0.3, f"{name}: {before} {after}"


def manchester_peck(forces, h, steps, q, momentum):
    """Their equations for the quaternion variational integrator with half torques at both ends of a step.

    The turn of a step is f = (sqrt(1 - x.x), x), and 2/h (sqrt(1 - x.x) J x + x cross J x) is the momentum in
    body axes that leaves its begin, half of the torque there included.
    """
    for k in range(steps):
        p = momentum + 0.5 * h * forces[k]
        x = 0.5 * h * np.linalg.solve(J, p)
        for _ in range(8):
            root = np.sqrt(1 - x @ x)
            rest = 2 / h * (root * (J @ x) + np.cross(x, J @ x)) - p
            slope = 2 / h * (root * J - np.outer(J @ x, x) / root + _cross(x) @ J - _cross(J @ x))
            x = x - np.linalg.solve(slope, rest)
        f = np.append(np.sqrt(1 - x @ x), x)
        q = times(q, f)
        momentum = 2 / h * (f[0] * (J @ x) - np.cross(x, J @ x)) + 0.5 * h * forces[k + 1]
    return q, momentum


def _cross(x):
    return np.array([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]])


def test_order_2_is_the_integrator_of_manchester_and_peck_with_half_torques():
    steps = 60
    forces = torque_at(np.linspace(0, TIME, steps + 1))
    here = Attitude((1, 0, 0, 0), RATE)
    problem = TransferProblem(1.0, here, here, TIME, actuator=Torque(), inertia=(1, 2, 2.8))
    found = simulate(problem, forces, steps=steps, order=2)
    q, p = manchester_peck(forces, TIME / steps, steps, np.array([1.0, 0, 0, 0]), J @ np.array(RATE))
    assert np.abs(found.attitude[-1] - q).max() < 1e-13
    assert np.abs(found.spin[-1] - p).max() < 1e-13


def test_whole_torques_at_one_end_as_published_are_of_first_order():
    q, _ = by_euler(True, np.array([1.0, 0, 0, 0]), np.array(RATE), TIME)
    errors = {}
    for steps in (400, 800):
        forces = torque_at(np.linspace(0, TIME, steps + 1))
        # All of the torque of a step acts where it begins: twice the half there, none at its end.
        h, here, p = TIME / steps, np.array([1.0, 0, 0, 0]), J @ np.array(RATE)
        for k in range(steps):
            here, p = manchester_peck(np.array([2 * forces[k], 0 * forces[k]]), h, 1, here, p)
        errors[steps] = angle_between(here, q)
    assert 0.9 < np.log2(errors[400] / errors[800]) < 1.1


# By method: step length [s], and limits of |q.q - 1|, of angular momentum and energy over 10,000 steps.
KEPT = {
    "order 2": (0.1, 1e-14, 1e-11, 1e-12),
    "order 4": (0.2, 1e-14, 1e-11, 2e-7),
    "order 8": (0.5, 1e-14, 1e-11, 1e-10),
}


@pytest.mark.parametrize("name", KEPT)
def test_a_free_body_keeps_length_momentum_and_energy(name):
    h, norm, momentum, energy = KEPT[name]
    (found,) = spin(free_body(), 10_000, {name: (h,)})
    assert found.norm_error < norm and found.momentum_error < momentum and found.energy_error < energy
    # The energy swings and does not drift, where it is more than rounding.
    assert found.growth < 1.5 or found.energy_error < 1e-12


@pytest.mark.parametrize("name", ["RK4", "DOP853"])
def test_runge_kutta_methods_lose_all_of_it(name):
    (found,) = spin(free_body(), 10_000, {name: (0.1 if name == "RK4" else 0.5,)})
    assert found.norm_error > 1e-9 and found.momentum_error > 1e-9 and found.growth > 5


@pytest.mark.slow
def test_a_hundred_thousand_steps_of_runge_kutta_lose_length_momentum_and_energy():
    """At the length of step at which order 2 keeps them to 1e-15, 1e-13 and 2e-13."""
    (found,) = spin(free_body(), 100_000, {"RK4": (0.1,)})
    assert found.norm_error == pytest.approx(1.54e-5, rel=0.1)
    assert found.momentum_error == pytest.approx(5.66e-5, rel=0.1)
    assert found.energy_error == pytest.approx(3.93e-5, rel=0.1) and found.growth > 9


@pytest.mark.slow
@pytest.mark.parametrize("make", [free_body, heavy_top])
@pytest.mark.parametrize("name", KEPT)
def test_a_hundred_thousand_steps(make, name):
    (found,) = spin(make(), 100_000, {name: (KEPT[name][0],)})
    assert found.norm_error < 1e-14 and found.momentum_error < 1e-11
    assert found.growth < 1.6 or found.energy_error < 1e-12


def test_a_heavy_top_keeps_its_vertical_momentum_and_its_energy_stays_bounded():
    (found,) = spin(heavy_top(), 5_000, {"order 4": (0.2,)})
    (other,) = spin(heavy_top(), 5_000, {"RK4": (0.1,)})
    assert found.momentum_error < 1e-11 and found.growth < 1.5
    assert other.momentum_error > 1e-5 and other.growth > 5


def unkept(step, start, spin):
    """By how much the small turns e and spins z of a step do not keep e1.z2 - e2.z1 - z.(e1 x e2).

    `step` gives attitude and spin after a step as CasADi expressions of both before it.
    """
    q, p = ca.MX.sym("q", 4), ca.MX.sym("p", 3)
    ends = step(q, p)
    slopes = ca.Function("slopes", [q, p], [ends, ca.jacobian(ends, ca.vertcat(q, p))])
    end, matrix = (part.full() for part in slopes(start, spin))

    def tangent(q):
        """Half of L(q) without its first column: how q moves with a small turn about the body axes."""
        return np.stack([times(q, np.append(0.0, axis)) for axis in np.eye(3)], axis=1) / 2

    def form(z):
        return np.block([[-_cross(z), np.eye(3)], [-np.eye(3), np.zeros((3, 3))]])

    before = np.block([[tangent(start), np.zeros((4, 3))], [np.zeros((3, 3)), np.eye(3)]])
    # A small turn is 4 Z' of the change of q.
    after = np.block([[4 * tangent(end[:4, 0]).T, np.zeros((3, 3))], [np.zeros((3, 4)), np.eye(3)]])
    moved = after @ matrix @ before
    return np.abs(moved.T @ form(end[4:, 0]) @ moved - form(spin)).max()


TILTED, SPUN = np.array(rotation((1, 2, 0.5), 40)), np.array([0.3, -0.5, 1.2])


@pytest.mark.parametrize("order", [2, 4, 6, 8])
def test_the_one_step_map_is_symplectic_on_the_constraint(order):
    dynamics, rule = Dynamics.of(heavy_top()), scheme(order)
    still, mass = np.zeros((3, rule.degree + 1)), np.ones(rule.degree + 1)

    def step(q, p):
        dq, dp, _ = step_map(dynamics, rule)(q, p, mass, still, 0.0, 0.1, np.zeros(4))
        return ca.vertcat(q + dq, p + dp)

    assert unkept(step, TILTED, SPUN) < 1e-12


def test_a_step_of_runge_kutta_is_not_symplectic():
    """One step of 0.1 s changes the form by 2.4e-6, two million times what the schemes may."""
    top = heavy_top()
    rk4, moments = step_function("RK4", Dynamics.of(top), top), np.diag(top.inertia)

    def step(q, p):
        state = rk4(ca.vertcat(q, p / moments), 0.0, 0.1)
        return ca.vertcat(state[:4], moments * state[4:])

    assert unkept(step, TILTED, SPUN) == pytest.approx(2.4e-6, rel=0.1)


def test_position_and_attitude_part_where_nothing_joins_them():
    both = TransferProblem(
        3.0,
        Pose((0, 0, 0)),
        Pose((2, 1, -1), attitude=rotation((1, 1, 1), 120)),
        5.0,
        actuator=Wrench(frame="space"),
        objective=Effort(),
        inertia=(1, 2, 2.8),
    )
    found = solve(both, order=8).raise_for_status()
    # 6 m^2 d^2 / T^3 for the place, and the effort of the turn alone.
    assert found.objective == pytest.approx(6 * 9 * 6 / 125 + 0.753733560549, abs=1e-9)


def test_angular_momentum_in_space_changes_by_the_torques_alone():
    found = solve(reorientation(), order=4, steps=20)
    in_space = rotated(found.attitude[::2], found.spin)
    weights = np.diff(found.path.mesh)[:, None] * found.duration
    rule = scheme(4)
    pushes = rotated(found.attitude, found.torque)
    nodes = 2 * np.arange(20)[:, None] + np.arange(3)
    impulses = (rule.weights[:, None] * pushes[nodes]).sum(axis=1) * weights
    assert np.abs(in_space[1:] - in_space[:-1] - impulses).max() < 1e-12
