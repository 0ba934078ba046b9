"""The one-step map keeps what the motion keeps: the symplectic form, and momenta but for applied impulses."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    ClohessyWiltshire,
    Conservative,
    LinearDrag,
    PointGravity,
    RotatingFrame,
    Spring,
    UniformGravity,
    three_body,
)
from dmoc.configurations.base import Translation
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.step import step_map

ORDERS = (2, 4, 6, 8)
MASS = 1.7


@dataclass(frozen=True)
class Tide(Conservative):
    """A potential and a velocity coupling that change with time."""

    def lagrangian(self, t, q, v, m):
        return 0.3 * ca.cos(t) * q[0] * q[1] + 0.2 * t * (v[0] * q[1] ** 2)


CONSERVATIVE = {
    "nothing": (2, ()),
    "uniform gravity": (3, (UniformGravity((0.1, -0.2, -9.81)),)),
    "point gravity": (2, (PointGravity(1.3, (0.1, -0.1)),)),
    "point gravity in space": (3, (PointGravity(1.3),)),
    "spring": (1, (Spring(2.0, (0.3,)),)),
    "rotating frame": (2, (RotatingFrame(0.7),)),
    "rotating frame in space": (3, (RotatingFrame((0.3, -0.5, 0.6)), PointGravity(1.0))),
    "neighbourhood of an orbit": (3, (ClohessyWiltshire(0.8),)),
    "three bodies": (3, three_body(0.2)),
    "tide": (2, (Tide(), PointGravity(1.0))),
}


def one_step(effects, dimension, order, hold=False):
    return step_map(Dynamics(Translation(dimension), tuple(effects)), scheme(order), hold)


def tangent(step, dimension, order, h=0.15):
    """Derivative of (q, p) after a step by (q, p) before, at some state and under some force."""
    q, p = ca.MX.sym("q", dimension), ca.MX.sym("p", dimension)
    nodes = order // 2 + 1
    force = np.linspace(-0.5, 0.8, dimension * nodes).reshape(dimension, nodes)
    dq, dp, _ = step(q, p, MASS * np.ones(nodes), force, 0.4, h, np.zeros(dimension))
    state = ca.vertcat(q, p)
    slope = ca.Function("slope", [state], [ca.jacobian(state + ca.vertcat(dq, dp), state)])
    return np.array(slope([0.9, -0.4, 0.3][:dimension] + [0.2, 0.8, -0.5][:dimension]))


def symplectic_defect(matrix):
    """Largest entry of M^T J M - J."""
    n = len(matrix) // 2
    J = np.block([[np.zeros((n, n)), np.eye(n)], [-np.eye(n), np.zeros((n, n))]])
    return np.abs(matrix.T @ J @ matrix - J).max()


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("scene", CONSERVATIVE)
def test_conservative_effects_leave_the_map_symplectic(scene, order):
    dimension, effects = CONSERVATIVE[scene]
    assert symplectic_defect(tangent(one_step(effects, dimension, order), dimension, order)) < 1e-10


@pytest.mark.parametrize("order", ORDERS)
def test_drag_does_not(order):
    """The same measure sees a resistance of 0.1 of the step: the test above can fail."""
    effects = (PointGravity(1.3), LinearDrag(0.3))
    defect = symplectic_defect(tangent(one_step(effects, 2, order), 2, order))
    # areas shrink by exp(-c h / m)
    assert defect == pytest.approx(1 - np.exp(-0.3 * 0.15 / MASS), rel=0.05)


def roll(step, order, q, p, h, force=None, steps=1000):
    """States at the step ends, and the positions and impulses per mass of the nodes of every step."""
    rule, n = scheme(order), len(q)
    nodes = rule.degree + 1
    force = np.zeros((steps, nodes, n)) if force is None else force
    states, places = [(np.array(q), np.array(p))], []
    for k in range(steps):
        q, p = states[-1]
        dq, dp, v = (
            np.array(out) for out in step(q, p, MASS * np.ones(nodes), force[k].T, k * h, h, np.zeros(n))
        )
        places.append(q + h * rule.integral @ v.T)
        states.append((q + dq[:, 0], p + dp[:, 0]))
    return np.array(states), np.array(places), h * rule.weights[:, None] * force / MASS


def cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


CENTRAL = {
    "point gravity": (PointGravity(1.0),),
    "spring": (Spring(1.4, (0, 0)),),
    "point gravity in a rotating frame": (PointGravity(1.0), RotatingFrame(0.3)),
}


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("scene", CENTRAL)
def test_angular_momentum_of_a_central_field_is_kept(scene, order):
    # large steps: Newton's method has work to do, and stopping early would show
    states, _, _ = roll(one_step(CENTRAL[scene], 2, order), order, (1.0, 0.1), (-0.1, 0.9), 0.3)
    momentum = cross(states[:, 0], states[:, 1])
    assert np.abs(momentum / momentum[0] - 1).max() < 2e-13


@pytest.mark.parametrize("order", ORDERS)
def test_angular_momentum_is_lost_to_drag(order):
    effects = (Spring(1.4, (0, 0)), LinearDrag(0.01))
    states, _, _ = roll(one_step(effects, 2, order), order, (1.0, 0.1), (-0.1, 0.9), 0.1)
    momentum = cross(states[:, 0], states[:, 1])
    assert momentum[-1] / momentum[0] == pytest.approx(np.exp(-0.01 * 100 / MASS), rel=1e-2)


@pytest.mark.parametrize("order", ORDERS)
def test_angular_momentum_changes_by_the_moment_of_the_impulses(order):
    steps, nodes = 300, order // 2 + 1
    force = 0.05 * np.random.default_rng(order).standard_normal((steps, nodes, 2))
    step = one_step((PointGravity(1.0),), 2, order)
    states, places, impulses = roll(step, order, (1.0, 0.1), (-0.1, 0.9), 0.1, force, steps)
    momentum = cross(states[:, 0], states[:, 1])
    applied = np.cumsum(cross(places, impulses).sum(axis=1))
    assert np.abs(applied).max() > 1e-2
    np.testing.assert_allclose(momentum[1:] - momentum[0], applied, rtol=0, atol=1e-12)


@pytest.mark.parametrize("hold", [False, True], ids=["nodal", "held"])
@pytest.mark.parametrize("order", ORDERS)
def test_momentum_of_a_free_body_changes_by_the_impulses(order, hold):
    rule, random = scheme(order), np.random.default_rng(1)
    force = random.standard_normal((3, 1 if hold else rule.degree + 1))
    q, p, masses = random.standard_normal(3), random.standard_normal(3), MASS * np.ones(rule.degree + 1)
    dq, dp, _ = one_step((), 3, order, hold)(q, p, masses, force, 0.0, 0.4, np.zeros(3))
    impulse = 0.4 / MASS * (force[:, 0] if hold else force @ rule.weights)
    np.testing.assert_allclose(np.array(dp)[:, 0], impulse, rtol=0, atol=1e-15)
    if hold:
        np.testing.assert_allclose(np.array(dq)[:, 0], 0.4 * (p + 0.5 * impulse), rtol=0, atol=1e-15)


@pytest.mark.parametrize("order", ORDERS)
def test_the_step_is_its_own_inverse_backward(order):
    """Symmetric points make the map symmetric: a step of -h from where a step of h led comes back."""
    dimension, effects = CONSERVATIVE["three bodies"]
    step, masses = one_step(effects, dimension, order), MASS * np.ones(order // 2 + 1)
    q, p, still = np.array([0.9, -0.4, 0.3]), np.array([0.2, 0.8, -0.5]), np.zeros((3, order // 2 + 1))
    dq, dp, _ = (np.array(out) for out in step(q, p, masses, still, 0.0, 0.1, np.zeros(3)))
    back = step(q + dq[:, 0], p + dp[:, 0], masses, still, 0.1, -0.1, np.zeros(3))
    np.testing.assert_allclose(np.array(back[0]), -dq, rtol=0, atol=1e-14)
    np.testing.assert_allclose(np.array(back[1]), -dp, rtol=0, atol=1e-14)


@pytest.mark.parametrize("frequency_step", [0.1, 1.0, 1.9])
def test_order_2_on_the_oscillator_keeps_its_own_energy(frequency_step):
    """v^2 + w^2 (1 - (h w)^2 / 4) x^2 is constant, up to the limit h w = 2 and not beyond."""
    step = one_step((Spring(MASS, (0,)),), 1, 2)
    states, _, _ = roll(step, 2, (0.3,), (1.0,), frequency_step)
    x, v = states[:, 0, 0], states[:, 1, 0]
    energy = v**2 + (1 - frequency_step**2 / 4) * x**2
    assert np.abs(energy / energy[0] - 1).max() < 1e-12
    beyond, _, _ = roll(step, 2, (0.3,), (1.0,), 2.01, steps=100)
    assert np.abs(beyond).max() > 1e5
