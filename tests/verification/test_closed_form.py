"""Discrete and continuous optima that are known on paper, or from the indirect method to round-off."""

import math

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

from dmoc import (
    BoxForce,
    ClohessyWiltshire,
    Effort,
    Objective,
    PointGravity,
    Spring,
    State,
    Time,
    TransferProblem,
    solve,
)
from dmoc.motion.path import POSITION_BOUNDS

MASS, DISTANCE, DURATION = 3.0, 2.0, 4.0
SCALE = MASS**2 * DISTANCE**2 / DURATION**3


def rest_to_rest(**changes):
    return TransferProblem(MASS, State(0, 0), State(DISTANCE, 0), **{"duration": DURATION, **changes})


@pytest.mark.parametrize("steps", [2, 3, 10, 37, 200])
def test_double_integrator_with_nodal_forces(steps):
    """J_N = 6 m^2 d^2/T^3 N^2/(N^2 + 2), below the true optimum; f_k falls linearly with the node."""
    solution = solve(rest_to_rest(), steps=steps).raise_for_status()
    factor = steps**2 / (steps**2 + 2)
    forces = 6 * MASS * DISTANCE / DURATION**2 * factor * (1 - 2 * np.arange(steps + 1) / steps)
    assert solution.objective == pytest.approx(6 * SCALE * factor, rel=1e-10)
    np.testing.assert_allclose(solution.force[:, 0], forces, rtol=0, atol=1e-10 * forces[0])


@pytest.mark.parametrize("steps", [2, 3, 10, 37, 200])
def test_double_integrator_with_held_forces(steps):
    """J_N = 6 m^2 d^2/T^3 N^2/(N^2 - 1), the exact zero-order-hold optimum, above the true one."""
    solution = solve(rest_to_rest(), steps=steps, hold=True).raise_for_status()
    factor = steps**2 / (steps**2 - 1)
    forces = 6 * MASS * DISTANCE / DURATION**2 * factor * (1 - (2 * np.arange(steps) + 1) / steps)
    assert solution.objective == pytest.approx(6 * SCALE * factor, rel=1e-10)
    np.testing.assert_allclose(solution.force[:, 0], forces, rtol=0, atol=1e-10 * forces[0])


@pytest.mark.parametrize("order", [6, 8])
@pytest.mark.parametrize("steps", [2, 7])
def test_double_integrator_is_exact_from_order_6(order, steps):
    """The optimal path is a cubic, which three points and more inside a step can follow."""
    solution = solve(rest_to_rest(), order=order, steps=steps).raise_for_status()
    assert solution.objective == pytest.approx(6 * SCALE, rel=1e-10)
    fraction = solution.time / DURATION
    np.testing.assert_allclose(
        solution.force[:, 0], 6 * MASS * DISTANCE / DURATION**2 * (1 - 2 * fraction), rtol=0, atol=1e-9
    )
    np.testing.assert_allclose(
        solution.position[:, 0], DISTANCE * (3 * fraction**2 - 2 * fraction**3), rtol=0, atol=1e-9
    )


@pytest.mark.parametrize("hold", [False, True], ids=["nodal", "held"])
@pytest.mark.parametrize("steps", [6, 20, 7, 21])
def test_least_time_of_the_double_integrator(steps, hold):
    """T* = 2 sqrt(m d/F), met exactly where the switch falls on a node, missed by a known factor elsewhere."""
    limit = 0.7
    problem = rest_to_rest(duration=(0.5, 40.0), actuator=BoxForce(limit), objective=Time())
    solution = solve(problem, steps=steps, hold=hold).raise_for_status()
    best = 2 * math.sqrt(MASS * DISTANCE / limit)
    factor = 1.0 if steps % 2 == 0 else steps / math.sqrt(steps**2 + (-1 if hold else 1))
    assert solution.duration == pytest.approx(best * factor, rel=1e-7)
    assert solution.objective == pytest.approx(solution.duration, rel=1e-14)
    assert np.abs(solution.force).max() <= limit


@pytest.mark.parametrize("hold", [False, True], ids=["nodal", "held"])
@pytest.mark.parametrize("steps", [2, 5, 40])
def test_least_time_and_effort_of_the_double_integrator(steps, hold):
    """T + w J(T) with J from above: T^4 = 18 w m^2 d^2 c, c = N^2/(N^2 + 2), or N^2/(N^2 - 1) held."""
    weight = 0.3
    problem = rest_to_rest(duration=(0.1, 50.0), objective=Time() + weight * Effort())
    solution = solve(problem, steps=steps, hold=hold).raise_for_status()
    factor = steps**2 / (steps**2 + (-1 if hold else 2))
    scale = weight * MASS**2 * DISTANCE**2 * factor
    best = (18 * scale) ** 0.25
    assert solution.duration == pytest.approx(best, rel=1e-10)
    assert solution.objective == pytest.approx(best + 6 * scale / best**3, rel=1e-12)


def oscillator(frequency, start, goal, duration, mass=1.0):
    spring = Spring(mass * frequency**2, (0,))
    return TransferProblem(mass, State(*start), State(*goal), duration, effects=[spring])


def test_oscillator_brought_to_rest_in_one_period():
    """x'' = -x + u from (1, 0) to rest: J = 1/(2 pi), u = sin(t)/pi."""
    solution = solve(oscillator(1.0, (1, 0), (0, 0), 2 * math.pi), order=8).raise_for_status()
    assert solution.objective == pytest.approx(1 / (2 * math.pi), rel=1e-10)
    ends = solution.force[::4, 0]
    np.testing.assert_allclose(ends, np.sin(solution.end_times) / math.pi, rtol=0, atol=1e-10)


@pytest.mark.parametrize("mass", [1.0, 2.5])
def test_oscillator_between_two_states(mass):
    """Control and position costate at both ends; effort and costates grow with the mass squared."""
    solution = solve(oscillator(1.3, (1, 0.5), (-0.3, 0.2), 2.0, mass), order=8).raise_for_status()
    assert solution.objective == pytest.approx(1.0562831359694393 * mass**2, rel=1e-10)
    np.testing.assert_allclose(solution.force[[0, -1], 0] / mass, [-1.17613037, 1.53178724], rtol=0, atol=1e-8)
    # a boundary position stands as a bound: its multiplier is minus the slope of the optimum, a density in time
    bounds = solution.path.multipliers[POSITION_BOUNDS][[0, -1], 0] * end_weight(solution)
    expected = np.array([1.32136731, -0.34407892]) * mass**2
    np.testing.assert_allclose(-bounds * [1, -1], expected, rtol=0, atol=1e-8 * mass**2)


def end_weight(solution):
    """Share of the duration that the first node stands for."""
    from dmoc.motion.lobatto import scheme

    return scheme(solution.order).weights[0] * solution.path.mesh[1]


@pytest.mark.parametrize("order", [2, 8])
@pytest.mark.parametrize("hold", [False, True], ids=["nodal", "held"])
def test_costate_is_the_slope_of_the_optimum(order, hold):
    """dJ/dv at the start is the costate there, at the goal minus the costate: no factor, for any mass."""

    def optimum(start_speed, goal_speed):
        problem = oscillator(1.3, (1, start_speed), (-0.3, goal_speed), 2.0, mass=2.5)
        return solve(problem, order=order, steps=8, hold=hold).raise_for_status()

    step = 1e-3
    slopes = [
        (optimum(0.5 + a * step, 0.2 + b * step).objective - optimum(0.5 - a * step, 0.2 - b * step).objective)
        / (2 * step)
        for a, b in ((1, 0), (0, 1))
    ]
    costate = optimum(0.5, 0.2).costate[:, 0]
    np.testing.assert_allclose([costate[0], -costate[-1]], slopes, rtol=1e-7)


def test_rendezvous_of_least_effort():
    """Relative motion near a circular orbit, 2400 s; the optimum is the reachability Gramian's."""
    start, goal = State((200, -1000, 100), (0, 0, 0)), State((0, 0, 0), (0, 0, 0))
    problem = TransferProblem(1.0, start, goal, 2400.0, effects=[ClohessyWiltshire(0.00113)])
    solution = solve(problem, order=8).raise_for_status()
    assert solution.objective == pytest.approx(1.048842323e-3, rel=1e-9)
    expected = [-2.01469421e-3, -9.72513789e-4, -6.169e-6]
    np.testing.assert_allclose(solution.force[0], expected, rtol=0, atol=5e-10)


class Wandering(Objective):
    """1/2 integral of x^2 + v^2: nothing is said of the force."""

    def running(self, t, q, v, u, m):
        return 0.5 * (ca.dot(q, q) + ca.dot(v, v))


@pytest.fixture(scope="module")
def singular():
    """x'' = u, |u| <= 1, from (0, 1), free at 5 s: u = -1 until 1.41376 s, then u = x = c cosh(5 - t)."""
    free = State((None,), (None,))
    problem = TransferProblem(1.0, State(0, 1), free, 5.0, actuator=BoxForce(1), objective=Wandering())
    return solve(problem, steps=200, hold=True).raise_for_status()


def test_singular_arc_has_the_known_cost(singular):
    assert singular.objective == pytest.approx(0.376991930288, abs=1e-4)


def test_held_forces_do_not_chatter_on_a_singular_arc(singular):
    after = singular.end_times[:-1] > 1.45
    assert np.abs(np.diff(singular.force[after, 0])).sum() < 1.2 * 0.39


def kepler_transfer(mass=1.0):
    """From the circular orbit of radius 1 to that of radius 1.5, at angle 4, in 5 time units."""
    speed = 1 / math.sqrt(1.5)
    goal = State((1.5 * math.cos(4), 1.5 * math.sin(4)), (-speed * math.sin(4), speed * math.cos(4)))
    return TransferProblem(mass, State((1, 0), (0, 1)), goal, 5.0, effects=[PointGravity(1.0)])


@pytest.fixture(scope="module")
def indirect():
    """Least effort by shooting: the objective, and the costates of position and velocity at the start."""

    def rate(_, y):
        r, v, costate_r, costate_v = y[:2], y[2:4], y[4:6], y[6:8]
        distance = math.hypot(*r)
        gradient = -np.eye(2) / distance**3 + 3 * np.outer(r, r) / distance**5
        u = -costate_v
        return np.concatenate([v, -r / distance**3 + u, -gradient @ costate_v, -costate_r, [0.5 * u @ u]])

    def shoot(costates):
        start = np.concatenate([[1, 0, 0, 1], costates, [0]])
        return solve_ivp(rate, (0, 5), start, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]

    goal = kepler_transfer().goal
    target = np.array([*goal.position, *goal.velocity])
    first = [0.02906175, 0.03590801, 0.0571224, -0.0227536]
    costates = root(lambda y: shoot(y)[:4] - target, first, tol=1e-14).x
    assert np.abs(shoot(costates)[:4] - target).max() < 1e-12
    assert np.abs(costates - first).max() < 1e-7
    return shoot(costates)[-1], costates


@pytest.mark.parametrize("mass", [1.0, 2.5])
def test_kepler_transfer_of_least_effort(indirect, mass):
    """Objective and costates are the indirect method's; lambda_k = -m F_k, so u(0) = -lambda_v(0) at m = 1.

    The multiplier of the discrete Euler-Lagrange row of node k, per unit mass, is the table's lambda_v
    times the mass squared, as the objective is.
    """
    objective, costates = indirect
    assert objective == pytest.approx(0.010173701094176, rel=1e-12)
    solution = solve(kepler_transfer(mass), order=8).raise_for_status()
    assert solution.objective == pytest.approx(objective * mass**2, rel=1e-8)
    np.testing.assert_allclose(solution.costate[0] / mass**2, costates[2:], rtol=0, atol=1e-8)
    np.testing.assert_allclose(-solution.force[0] / mass, costates[2:], rtol=0, atol=1e-8)
    bounds = solution.path.multipliers[POSITION_BOUNDS][0] * end_weight(solution)
    np.testing.assert_allclose(-bounds / mass**2, costates[:2], rtol=0, atol=1e-8)


@pytest.mark.parametrize("order", [2, 4, 6, 8])
def test_costate_is_minus_mass_times_force_at_every_node(order):
    """Where no limit acts; a free test of optimality that holds to round-off on any mesh."""
    solution = solve(kepler_transfer(2.5), order=order, steps=20).raise_for_status()
    np.testing.assert_allclose(
        solution.costate, -2.5 * solution.force, rtol=0, atol=1e-11 * np.abs(solution.costate).max()
    )


def test_costate_is_minus_mass_times_mean_force_where_forces_are_held():
    """A held force answers to the mean of the costates at both ends of its step, by the same weights."""
    solution = solve(kepler_transfer(2.5), steps=20, hold=True).raise_for_status()
    mean = 0.5 * (solution.costate[1:] + solution.costate[:-1])
    np.testing.assert_allclose(mean, -2.5 * solution.force, rtol=0, atol=1e-11 * np.abs(mean).max())


@pytest.mark.parametrize("order", [2, 4, 6, 8])
@pytest.mark.parametrize("hold", [False, True], ids=["nodal", "held"])
def test_rotation_keeps_a_quantity_of_the_optimum(order, hold):
    """x cross lambda_x + v cross lambda_v is the same at both ends on any mesh, as gravity has no angle."""
    solution = solve(kepler_transfer(), order=order, steps=12, hold=hold).raise_for_status()
    bounds = solution.path.multipliers[POSITION_BOUNDS][[0, -1]] * end_weight(solution)
    costates_r = -bounds * np.array([[1], [-1]])
    costates_v = solution.costate[[0, -1]]
    states = np.array([[end.position, end.velocity] for end in (solution.problem.start, solution.problem.goal)])

    def cross(a, b):
        return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]

    kept = cross(states[:, 0], costates_r) + cross(states[:, 1], costates_v)
    assert kept[0] == pytest.approx(kept[1], abs=1e-11)
    assert abs(kept[0]) > 1e-3


@pytest.mark.parametrize("order", [2, 4, 8])
def test_a_fast_body_without_effects_is_turned_round_in_one_iteration(order):
    """Ends so fast that the way between them tells nothing of the force: 6 m |dv|^2 / T and more."""
    start, goal = State((7e6, 0.0), (0.0, 7.5e3)), State((7e6, 1e3), (0.0, -7.5e3))
    found = solve(TransferProblem(400.0, start, goal, 6e3), order=order, steps=100).raise_for_status()
    assert found.iterations <= 2
