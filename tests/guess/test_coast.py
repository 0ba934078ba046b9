"""Coasts for the starting guess: as an independent integrator has them, and nothing where there is none."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import DOP853, solve_ivp

from dmoc import PointGravity, RotatingFrame, Spring, State, ThirdBody, TransferProblem
from dmoc.basics.numerics import coefficients, root
from dmoc.configurations.base import Translation
from dmoc.guess.coast import coast
from dmoc.guess.spiral import Spiral
from dmoc.motion.dynamics import Dynamics

GRAVITY = (PointGravity(1.0),)


def scene(effects=GRAVITY, start_time=0.0):
    return TransferProblem(
        2.0, State((1, 0), (0, 1)), State((2, 0), (0, 1)), 1.0, effects, start_time=start_time
    )


def moon(t):
    return 3 * ca.cos(2 * t), 3 * ca.sin(2 * t)


@pytest.mark.parametrize(
    "effects",
    [
        GRAVITY,
        (PointGravity(0.6, (-0.4, 0)), PointGravity(0.4, (0.6, 0)), RotatingFrame(1.0)),
        (PointGravity(1.0), ThirdBody(0.3, moon)),
    ],
)
@pytest.mark.parametrize("begin, finish", [(0.5, 6.0), (6.0, 0.5)])
def test_it_is_the_motion_without_thrust(effects, begin, finish):
    problem, state = scene(effects, start_time=0.7), np.array([1.3, 0.2, 0.1, 0.7])
    acceleration = Dynamics(Translation(2), effects).acceleration

    def rate(t, y):
        push = acceleration(problem.start_time + t, y[:2], y[2:], problem.mass, np.zeros(2))
        return np.append(y[2:], push.full())

    times = np.linspace(begin, finish, 50)
    found = coast(problem, begin, finish, (state[:2], state[2:]), len(times))
    exact = solve_ivp(rate, (begin, finish), state, "DOP853", times, rtol=1e-12, atol=1e-12).y.T
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-6)


@pytest.mark.parametrize("sign", [1, -1], ids=["forward", "backward"])
@pytest.mark.parametrize(
    "q, v, center",
    [
        ((1, 0), (0, 0), None),
        ((1, 0.3), (0, 0), None),
        ((1, 0), (0.5, 0), None),
        ((1, 0), (-2, 0), None),
        ((1, 0), (0, 0.1), None),
        ((0, 0), (0, 1), None),
        ((1 / 3, 0.7), (0, 1), (1 / 3, 0.7)),
        ((1, 0), (0, 0), (0.1, 0.7)),
    ],
)
def test_there_is_none_into_an_attractor_and_nothing_is_printed(q, v, center, sign, capfd):
    problem, state = scene((PointGravity(1.0, center),)), (np.array(q, float), sign * np.array(v, float))
    assert coast(problem, 0.0, 5.0 * sign, state) is None
    assert capfd.readouterr() == ("", "")


def test_beside_an_attractor_there_is_one():
    """Closest at 0.047 of the first distance."""
    state = coast(scene(), 0.0, 20.0, (np.array([1.0, 0.0]), np.array([0.0, 0.3])))[-1]
    assert 0.5 * state[2:] @ state[2:] - 1 / np.linalg.norm(state[:2]) == pytest.approx(0.045 - 1, abs=1e-6)


@pytest.mark.parametrize("effects", [GRAVITY, (Spring(1e12, (0, 0)),)])
def test_what_turns_too_often_is_given_up_at_once(effects, capfd):
    state = np.array([1.0, 0.0]), np.array([0.0, 1.0])
    assert coast(scene(effects), 0.0, 1e8, state) is None
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("from_goal", [False, True])
def test_a_spiral_is_the_same_wherever_it_is_looked_at(from_goal):
    """Its end is found alone, and must be that of the path."""
    q, v = np.array([1.0, 0, 0]), np.array([0, 1.0, 0.1])
    spiral = Spiral(1.0, np.zeros(3), 60.0, (q, v), (2 * q, 0.7 * v), from_goal)
    end = 0 if from_goal else -1
    alone, path = spiral.states(np.array([0.0 if from_goal else 1.0])), spiral.states(np.linspace(0, 1, 77))
    np.testing.assert_allclose([part[0] for part in alone], [part[end] for part in path], rtol=0, atol=1e-12)


def test_a_spiral_without_angular_momentum_is_nowhere(capfd):
    q, v = np.array([1.0, 0, 0]), np.array([0, 0.7, 0])
    assert np.isnan(Spiral(1.0, np.zeros(3), 9.0, (q, 0 * v), (2 * q, v)).states(np.linspace(0, 1, 5))).all()
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    "function, place",
    [
        (lambda x: x**3 - 0.2, 0.2 ** (1 / 3)),
        (lambda x: np.expm1(30 * (x - 0.9)), 0.9),
        (lambda x: 0.1 * (x - 0.3) if x < 0.3 else 50 * (x - 0.3), 0.3),
        (lambda x: x - 1, 1.0),
        (lambda x: -np.sign(x) * abs(x) ** 0.2, 0.0),
    ],
)
def test_the_root_between_two_places(function, place):
    calls = []
    found = root(lambda x: calls.append(x) or function(x), -1.0, 1.0, 1e-6)
    assert found == pytest.approx(place, abs=1e-6)
    assert len(calls) < 60


def test_the_reference_integrator_has_scipys_coefficients():
    scipys = DOP853.C, DOP853.A, DOP853.B, DOP853.E3, DOP853.E5
    for ours, theirs in zip(coefficients(), scipys, strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_the_reference_integrator_does_without_scipys_file(monkeypatch):
    """It is an inner one: where a later SciPy has it elsewhere, the public class gives the same."""
    before = coefficients()
    monkeypatch.setattr("dmoc.basics.numerics.spec_from_file_location", lambda *_: None)
    for ours, theirs in zip(coefficients(), before, strict=True):
        np.testing.assert_array_equal(ours, theirs)
