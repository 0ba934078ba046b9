"""The pull of a third body keeps its digits however far away it is, and is the tide of the textbooks."""

import math
import pickle
from decimal import Decimal, localcontext

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    PointGravity,
    State,
    ThirdBody,
    TransferProblem,
    circular_motion,
    kepler_motion,
    tabulated_motion,
    three_body,
)
from dmoc.motion.march import simulate

MU = 1.32712440018e20


def acceleration(effect, q, t=0.0):
    """dl/dq [m/s^2] at a position [m]."""
    time, place, v, m = ca.SX.sym("t"), ca.SX.sym("q", len(q)), ca.SX.sym("v", len(q)), ca.SX.sym("m")
    slope = ca.gradient(effect.lagrangian(time, place, v, m), place)
    return np.array(ca.Function("a", [time, place], [slope])(t, q)).ravel()


def direct_less_indirect(s, q):
    """mu ((s - q)/|s - q|^3 - s/|s|^3) with 60 digits."""
    with localcontext() as context:
        context.prec = 60
        s, q = [Decimal(float(x)) for x in s], [Decimal(float(x)) for x in q]
        offset = [a - b for a, b in zip(s, q, strict=True)]
        near, far = (sum(x * x for x in r).sqrt() ** 3 for r in (offset, s))
        pull = [Decimal(MU) * (a / near - b / far) for a, b in zip(offset, s, strict=True)]
        return np.array([float(x) for x in pull])


@pytest.mark.parametrize("ratio", [1e-9, 1e-6, 1e-3, 0.3, 0.99, 1.7, 30.0])
def test_no_digits_are_lost_at_any_distance(ratio):
    """Against a difference with 60 digits; ratio of the body's distance to the third body's."""
    random = np.random.default_rng(4)
    s = 1.496e11 * np.array([2.0, -1.0, 2.0]) / 3
    for _ in range(20):
        direction = random.standard_normal(3)
        q = ratio * 1.496e11 * direction / np.linalg.norm(direction)
        expected = direct_less_indirect(s, q)
        miss = np.linalg.norm(acceleration(ThirdBody(MU, s), q) - expected) / np.linalg.norm(expected)
        assert miss < 4e-15 * max(1.0, ratio)


@pytest.mark.parametrize("gap", [1e-1, 1e-3, 1e-5])
def test_no_digits_are_lost_close_to_the_third_body(gap):
    s, side = 1.496e11 * np.array([2.0, -1.0, 2.0]) / 3, np.array([1.0, 2.0, 2.0]) / 3
    q = s + gap * 1.496e11 * side
    expected = direct_less_indirect(s, q)
    # q itself is known to a rounding error of |s|: what is asked for is no loss beyond it
    miss = np.linalg.norm(acceleration(ThirdBody(MU, s), q) - expected) / np.linalg.norm(expected)
    assert miss < 4e-15


def test_the_plain_difference_would_lose_ten_digits():
    """What the form of the potential is for: doubles in the textbook's formula, at a ratio of 1e-6."""
    s, q = 1.496e11 * np.array([2.0, -1.0, 2.0]) / 3, 1.496e5 * np.array([0.3, 0.5, -0.4])
    plain = MU * ((s - q) / np.linalg.norm(s - q) ** 3 - s / np.linalg.norm(s) ** 3)
    expected = direct_less_indirect(s, q)
    assert np.linalg.norm(plain - expected) > 1e-12 * np.linalg.norm(expected)


def test_a_distant_body_raises_the_tide():
    """mu/d^3 (3 (q . e) e - q) to first order in |q|/d: 2 mu r/d^3 along the line, - mu r/d^3 across."""
    distance, r = 1.496e11, 1e4
    effect = ThirdBody(MU, (distance, 0, 0))
    tide = MU * r / distance**3
    along, across = acceleration(effect, (r, 0, 0)), acceleration(effect, (0, r, 0))
    np.testing.assert_allclose(along, [2 * tide, 0, 0], rtol=4 * r / distance)
    np.testing.assert_allclose(across, [0, -tide, 0], rtol=1e-6, atol=4 * tide * r / distance)
    assert not acceleration(effect, (0, 0, 0)).any()


def test_a_circling_third_body_is_the_restricted_three_body_problem():
    """Around the larger primary without rotation, and in the turning frame: the same motion."""
    ratio, duration, start, push = 0.1, 2.0, np.array([0.35, 0.1]), np.array([0.2, 1.3])
    inertial = TransferProblem(
        1.0,
        State(start, push),
        State((None, None), (None, None)),
        duration,
        (PointGravity(1 - ratio), ThirdBody(ratio, circular_motion(1.0, 1.0))),
    )
    rate, *attractors = three_body(ratio)
    effects = [rate, *(PointGravity(body.mu, body.center[:2]) for body in attractors)]
    turning = TransferProblem(
        1.0,
        State(start - [ratio, 0], push - [-start[1], start[0]]),
        inertial.goal,
        duration,
        tuple(effects),
    )
    one, other = (simulate(problem, steps=400, order=8) for problem in (inertial, turning))
    x, y = other.position.T
    seen = np.stack(
        [
            (x + ratio) * np.cos(other.time) - y * np.sin(other.time),
            (x + ratio) * np.sin(other.time) + y * np.cos(other.time),
        ],
        axis=1,
    )
    assert np.abs(one.position - seen).max() < 1e-10


def motion_values(motion, times):
    t = ca.SX.sym("t")
    position = motion(t)
    slope = ca.jacobian(position, t)
    function = ca.Function("x", [t], [position, slope, ca.jacobian(slope, t)])
    return [np.array(x).T for x in function.map(len(times))(times[None])]


@pytest.mark.parametrize("e", [0.0, 0.0549, 0.3, 0.31, 0.7, 0.9, 0.99])
def test_kepler_motion_obeys_newton_and_keeps_its_elements(e):
    """Its acceleration, by CasADi, is that of the attraction; energy and angular momentum are the elements'."""
    mu, a, i, node, argument = 3.986e14, 3.844e8, 0.4, 1.0, 2.0
    period = 2 * np.pi * np.sqrt(a**3 / mu)
    times = np.linspace(-1.3, 2.9, 400) * period
    q, v, rate = motion_values(kepler_motion(mu, a, e, i, node, argument, 0.5), times)
    r = np.linalg.norm(q, axis=1)
    pull = -mu * q / r[:, None] ** 3
    # round-off of the anomaly is a round-off of the position over the perigee distance
    loose = 1e-13 / (1 - e) ** 2
    assert np.abs(rate - pull).max() < loose * np.abs(pull).max()
    np.testing.assert_allclose(1 / (2 / r - np.sum(v * v, axis=1) / mu), a, rtol=10 * loose)
    h = np.cross(q, v)
    expected = np.sqrt(mu * a * (1 - e * e)) * np.array(
        [np.sin(i) * np.sin(node), -np.sin(i) * np.cos(node), np.cos(i)]
    )
    assert np.abs(h - expected).max() < 10 * loose * np.linalg.norm(expected)


def test_kepler_motion_is_where_the_mean_anomaly_says():
    mu, a, e = 1.0, 2.0, 0.4
    motion = kepler_motion(mu, a, e, 0.3, 0.7, 1.1, 0.0)
    perigee, apogee = (np.array(motion(t)).ravel() for t in (0.0, np.pi * a**1.5))
    node, up = (
        np.array([np.cos(0.7), np.sin(0.7), 0]),
        np.array([-np.sin(0.7) * np.cos(0.3), np.cos(0.7) * np.cos(0.3), np.sin(0.3)]),
    )
    direction = np.cos(1.1) * node + np.sin(1.1) * up
    np.testing.assert_allclose(perigee, a * (1 - e) * direction, rtol=1e-13)
    np.testing.assert_allclose(apogee, -a * (1 + e) * direction, rtol=1e-13)


def test_circular_motion_is_a_kepler_motion_without_eccentricity():
    times = np.linspace(-3, 9, 50)
    circle, ellipse = circular_motion(2.0, 0.5, 0.3, 0.9), kepler_motion(2.0, 2.0, 0.0, 0.9, 0.0, 0.0, 0.3)
    for one, other in zip(motion_values(circle, times), motion_values(ellipse, times), strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-14)


def test_a_table_is_met_to_fourth_order_and_goes_on_straight():
    exact = circular_motion(1.0, 1.0)
    fine, misses = np.linspace(0, 4, 501), []
    for count in (11, 21, 41, 81):
        times = np.linspace(0, 4, count)
        table = tabulated_motion(times, motion_values(exact, times)[0])
        misses.append(np.abs(motion_values(table, fine)[0] - motion_values(exact, fine)[0]).max())
    orders = -np.diff(np.log2(misses))
    assert (np.abs(orders - 4) < 0.5).all()
    position, slope, bend = motion_values(table, np.array([4.0, 4.5, 5.0]))
    np.testing.assert_allclose(position[1:], position[0] + np.outer([0.5, 1.0], slope[0]), rtol=1e-12)
    np.testing.assert_allclose(slope[1:], [slope[0]] * 2, rtol=1e-12)
    assert not bend[1:].any()


def test_effects_with_these_motions_are_values():
    times = np.linspace(0, 5, 9)
    for make in (
        lambda: circular_motion(1.0, 2.0),
        lambda: kepler_motion(1.0, 1.0, 0.1, 0, 0, 0, 0),
        lambda: tabulated_motion(times, np.stack([times, times**2], axis=1)),
    ):
        effect = ThirdBody(1.0, make())
        assert effect == ThirdBody(1.0, make()) and hash(effect) == hash(ThirdBody(1.0, make()))
        assert pickle.loads(pickle.dumps(effect)) == effect


def test_a_motion_in_space_serves_the_plane_only_if_it_stays_there():
    ThirdBody(1.0, circular_motion(1.0, 1.0)).check_dimension(2)
    ThirdBody(1.0, kepler_motion(1.0, 1.0, 0.1, 0, 0.2, 0.3, 0)).check_dimension(2)
    with pytest.raises(ValueError, match="position has 3 entries but the problem has 2"):
        ThirdBody(1.0, circular_motion(1.0, 1.0, inclination=0.1)).check_dimension(2)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: ThirdBody(0.0, (1.0, 0.0)), "mu must be greater than 0"),
        (lambda: ThirdBody(1.0, (0.0, 0.0)), "not be the origin"),
        (lambda: ThirdBody(1.0, lambda t: [math.cos(t), 0]), "tabulated_motion"),
        (lambda: ThirdBody(1.0, lambda t: [t] * 4), "gives 4 numbers"),
        (lambda: circular_motion(-1.0, 1.0), "radius must be greater than 0 .m."),
        (lambda: kepler_motion(1.0, 1.0, 1.2, 0, 0, 0, 0), "e must not exceed 0.99"),
        (lambda: tabulated_motion([0, 1, 1, 2], np.zeros((4, 2))), "increasing times"),
        (lambda: tabulated_motion([0, 1, 2, 3], np.zeros((3, 2))), "shape .4, dimension."),
    ],
)
def test_nonsense_is_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()
