"""Each scheme has the order it claims, 2, 4, 6 or 8: simulated, and in everything an optimal transfer has.

The order is the slope of a least-squares line through log error over log steps, over at least three meshes
whose relative error lies between 1e-4 and 1e-11: above, the coarse meshes tell nothing, below, round-off.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dmoc import Effort, LinearDrag, Objective, PointGravity, RotatingFrame, State, TransferProblem, solve
from dmoc.configurations.base import Translation
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.step import step_map

ORDERS = (2, 4, 6, 8)
SLACK = 0.3


def observed_order(meshes, errors):
    meshes, errors = np.asarray(meshes), np.asarray(errors)
    useful = (errors < 1e-4) & (errors > 1e-11)
    assert useful.sum() >= 3, f"errors {errors} leave fewer than three meshes between 1e-4 and 1e-11"
    return -np.polyfit(np.log(meshes[useful]), np.log(errors[useful]), 1)[0]


# --- simulation -------------------------------------------------------------------------------------------

SPAN, MASS, DRAG, RATE = 4.0, 1.6, 0.04, -0.2
# position and momentum per mass, which in a rotating frame is the velocity seen from outside
Q0, P0 = np.array([1.0, 0.1]), np.array([-0.1, 0.9])
GRAVITY = PointGravity(1.0)
SIMULATED = {
    "gravity": (GRAVITY,),
    "gravity and drag": (GRAVITY, LinearDrag(DRAG)),
    "gravity in a rotating frame": (GRAVITY, RotatingFrame(RATE)),
}
SIMULATION_MESHES = {2: (1200, 2400, 4800), 4: (60, 120, 240), 6: (24, 32, 40, 60), 8: (12, 16, 20, 24, 28)}


def smooth_force(t):
    return np.array([0.2 * np.sin(1.5 * t), 0.3 * np.cos(t)])


def switched_force(t):
    """Constant over each quarter of the span, as a thruster's is."""
    return np.array([[0.2, -0.1], [-0.3, 0.2], [0.1, 0.3], [0.0, -0.2]])[min(int(t / (SPAN / 4)), 3)]


@lru_cache
def reference_state(scene, force):
    """Position and velocity at the end, by another integrator from equations of motion written here."""
    drag = DRAG if "drag" in scene else 0.0
    rate = RATE if "frame" in scene else 0.0

    def slope(t, y):
        q, v = y[:2], y[2:]
        turning = 2 * rate * np.array([v[1], -v[0]]) + rate**2 * q
        return np.concatenate([v, -q / math.hypot(*q) ** 3 + turning + (force(t) - drag * v) / MASS])

    y = np.concatenate([Q0, P0 - rate * np.array([-Q0[1], Q0[0]])])
    for begin in np.arange(4) * SPAN / 4:
        inside = (begin, begin + SPAN / 4 * (1 - 1e-15))
        y = solve_ivp(slope, inside, y, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    return y


def simulated_state(scene, order, steps, force, hold):
    """Position and velocity at the end by the one-step map."""
    rule, h = scheme(order), SPAN / steps
    dynamics = Dynamics(Translation(2), SIMULATED[scene])
    step = step_map(dynamics, rule, hold)
    begins = h * np.arange(steps)
    columns = 1 if hold else rule.degree + 1
    offsets = [0.5] if hold else rule.points
    controls = np.stack([force(t + c * h) for t in begins for c in offsets], axis=1)
    state, t, u = ca.MX.sym("state", 4), ca.MX.sym("t"), ca.MX.sym("u", 2, columns)
    dq, dp, _ = step(state[:2], state[2:], ca.DM.ones(rule.degree + 1) * MASS, u, t, h, ca.DM.zeros(2))
    advance = ca.Function("advance", [state, t, u], [state + ca.vertcat(dq, dp)])
    end = np.array(advance.mapaccum(steps)(np.concatenate([Q0, P0]), begins[None], controls))[:, -1]
    return np.concatenate([end[:2], np.array(dynamics.velocity(SPAN, end[:2], end[2:], MASS)).ravel()])


def simulation_order(scene, order, force, hold):
    meshes, reference = SIMULATION_MESHES[order], reference_state(scene, force)
    errors = [
        np.abs(simulated_state(scene, order, steps, force, hold) - reference).max() / np.abs(reference).max()
        for steps in meshes
    ]
    return observed_order(meshes, errors)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("scene", SIMULATED)
def test_simulation(scene, order):
    assert simulation_order(scene, order, smooth_force, hold=False) > order - SLACK


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("scene", SIMULATED)
def test_simulation_with_a_thruster_that_switches_between_steps(scene, order):
    """A force that really is constant over each step costs no order."""
    assert simulation_order(scene, order, switched_force, hold=True) > order - SLACK


# --- optimal control --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Hurry(Objective):
    """Effort and a cost of speed, place and time."""

    def running(self, t, q, v, u, m):
        return 0.5 * ca.dot(u, u) + 0.05 * (1 + 0.1 * t) * ca.dot(v, v) ** 2 + 0.02 * q[0] * v[1]


TRANSFERS = {
    "gravity": ((GRAVITY,), Effort()),
    "gravity and drag": ((GRAVITY, LinearDrag(0.1)), Effort()),
    "gravity in a rotating frame": ((GRAVITY, RotatingFrame(0.3)), Effort()),
    "gravity and a cost of speed": ((GRAVITY,), Hurry()),
}
REFERENCE_STEPS = 96
MESHES = {2: (576, 1152, 2304), 4: (48, 96, 192), 6: (24, 32, 48), 8: (6, 8, 12, 16, 24, 32)}


def graded(steps):
    """Steps that shrink smoothly towards both ends, to a third of the longest."""
    even = np.linspace(0, 1, steps + 1)
    return even - np.sin(np.pi * even) * np.cos(np.pi * even) / (2 * np.pi)


@lru_cache
def transfer(scene, order, steps, hold=False, mesh=None):
    """From the circular orbit of radius 1 to that of 1.5 by 4 rad in 5 time units."""
    speed = 1 / math.sqrt(1.5)
    goal = State((1.5 * math.cos(4), 1.5 * math.sin(4)), (-speed * math.sin(4), speed * math.cos(4)))
    effects, objective = TRANSFERS[scene]
    problem = TransferProblem(1.0, State((1, 0), (0, 1)), goal, 5.0, effects=effects, objective=objective)
    mesh = None if mesh is None else mesh(steps)
    return solve(problem, order=order, steps=steps, mesh=mesh, hold=hold).raise_for_status()


def at_step_ends(solution):
    degree = solution.order // 2
    found = {
        "position": solution.position[::degree],
        "velocity": solution.velocity,
        "costate": solution.costate[::degree],
        "cost": np.array([[solution.objective]]),
    }
    return found if solution.hold else found | {"control": solution.force[::degree]}


def relative_error(seen, expected):
    """Largest difference at the step ends that both meshes have."""
    if len(seen) > 1:
        shared = math.gcd(len(seen) - 1, len(expected) - 1)
        seen, expected = seen[:: (len(seen) - 1) // shared], expected[:: (len(expected) - 1) // shared]
    return np.abs(seen - expected).max() / np.abs(expected).max()


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("scene", TRANSFERS)
def test_optimal_transfer(scene, order):
    """State, control, costate at the step ends, and cost, all of one order."""
    reference = at_step_ends(transfer(scene, 8, REFERENCE_STEPS))
    found = [at_step_ends(transfer(scene, order, steps)) for steps in MESHES[order]]
    for name, expected in reference.items():
        errors = [relative_error(each[name], expected) for each in found]
        assert observed_order(MESHES[order], errors) > order - SLACK, name


@pytest.mark.parametrize("order", ORDERS)
def test_optimal_transfer_on_a_graded_mesh(order):
    reference = at_step_ends(transfer("gravity", 8, REFERENCE_STEPS, mesh=graded))
    found = [at_step_ends(transfer("gravity", order, steps, mesh=graded)) for steps in MESHES[order]]
    for name, expected in reference.items():
        errors = [relative_error(each[name], expected) for each in found]
        assert observed_order(MESHES[order], errors) > order - SLACK, name


def interpolated(solution, values, fractions):
    """Values at the nodes of a solution, at other fractions of its duration."""
    rule, steps = scheme(solution.order), solution.steps
    step = np.minimum((fractions * steps).astype(int), steps - 1)
    weights = rule.values_at(fractions * steps - step)
    nodes = rule.degree * step[:, None] + np.arange(rule.degree + 1)
    return np.einsum("ij,ijk->ik", weights, values[nodes])


HELD = [(scene, order) for scene in TRANSFERS for order in (ORDERS if scene == "gravity" else (8,))]


@pytest.mark.parametrize("scene, order", HELD)
def test_optimal_transfer_with_held_forces_is_of_second_order_whatever_the_scheme(scene, order):
    fine = transfer(scene, 8, REFERENCE_STEPS)
    reference, meshes = at_step_ends(fine), (576, 1152, 2304) if order == 2 else (240, 480, 960)
    found = [transfer(scene, order, steps, hold=True) for steps in meshes]
    errors = {
        name: [relative_error(at_step_ends(each)[name], reference[name]) for each in found]
        for name in ("position", "velocity", "costate", "cost")
    }
    middles = [interpolated(fine, fine.force, (np.arange(steps) + 0.5) / steps) for steps in meshes]
    errors["control"] = [
        np.abs(each.force - middle).max() / np.abs(middle).max()
        for each, middle in zip(found, middles, strict=True)
    ]
    for name, each in errors.items():
        assert observed_order(meshes, each) == pytest.approx(2.0, abs=SLACK), name


@pytest.mark.parametrize("order", ORDERS[1:])
def test_nodes_inside_the_steps_have_order_s_plus_2(order):
    fine, s = transfer("gravity", 8, REFERENCE_STEPS), order // 2
    meshes = {4: (48, 96, 192), 6: (16, 24, 32, 48), 8: (12, 16, 24, 32)}[order]
    found = [transfer("gravity", order, steps) for steps in meshes]
    for values in (lambda solution: solution.position, lambda solution: solution.force):
        errors = []
        for each in found:
            expected = interpolated(fine, values(fine), each.path.fractions)
            errors.append(np.abs(values(each) - expected).max() / np.abs(expected).max())
        assert observed_order(meshes, errors) > s + 2 - SLACK
