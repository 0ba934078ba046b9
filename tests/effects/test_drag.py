"""Drag slows a body as the textbooks say, leaves alone what drifts with the air, and is smooth at rest."""

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    Drag,
    ExponentialAtmosphere,
    LinearDrag,
    PointGravity,
    State,
    TransferProblem,
    UniformAtmosphere,
    UniformGravity,
    Wind,
)
from dmoc.motion.march import simulate

EARTH, RADIUS = 3.986004418e14, 6.378137e6
SEA_LEVEL = UniformAtmosphere(1.225)
THERMOSPHERE = ExponentialAtmosphere(3.725e-12, 400e3, 58.515e3, RADIUS)


def force(effect, q, v, t=0.0, order=0):
    """Force [N] or its derivatives of some order in the velocity."""
    n = len(q)
    time, place, speed, m = ca.SX.sym("t"), ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("m")
    value = effect.force(time, place, speed, m)
    for _ in range(order):
        value = ca.vec(ca.jacobian(value, speed))
    return np.array(ca.Function("f", [time, place, speed, m], [ca.densify(value)])(t, q, v, 1.0)).ravel()


def coast(effects, position, velocity, duration, steps, order, mass=1.0):
    free = (None,) * len(position)
    problem = TransferProblem(mass, State(position, velocity), State(free, free), duration, effects)
    return simulate(problem, steps=steps, order=order)


def test_a_falling_body_reaches_its_terminal_speed():
    """v = w tanh(g t/w), fallen w^2/g log cosh(g t/w), with w = sqrt(2 m g/(density cd A))."""
    g, mass, area, coefficient = 9.81, 80.0, 0.7, 1.0
    effects = (UniformGravity((0, 0, -g)), Drag(area, coefficient, SEA_LEVEL))
    fall = coast(effects, (0, 0, 4000.0), (0, 0, 0), 30.0, 200, 4, mass)
    terminal = np.sqrt(2 * mass * g / (1.225 * coefficient * area))
    np.testing.assert_allclose(-fall.velocity[:, 2], terminal * np.tanh(g * fall.time / terminal), atol=1e-4)
    fallen = terminal**2 / g * np.log(np.cosh(g * fall.time / terminal))
    np.testing.assert_allclose(4000.0 - fall.position[:, 2], fallen, atol=1e-3)
    assert abs(-fall.velocity[-1, 2] / terminal - 1) < 1e-4


def test_a_circular_orbit_decays_at_the_rate_of_the_textbook():
    """da/dt = - density cd A/m sqrt(mu a), with the density at each height.

    W. J. Larson, J. R. Wertz, Space Mission Analysis and Design, 3rd edition (1999), section 6.2.3, where
    it reads 2 pi cd A/m density a^2 a revolution.
    """
    a, mass, area, coefficient = RADIUS + 400e3, 100.0, 20.0, 2.2
    speed, days = np.sqrt(EARTH / a), 10 * 2 * np.pi * np.sqrt(a**3 / EARTH)
    effects = (PointGravity(EARTH), Drag(area, coefficient, THERMOSPHERE))
    path = coast(effects, (a, 0), (0, speed), days, 600, 6, mass)
    r, v = np.linalg.norm(path.position, axis=1), np.linalg.norm(path.velocity, axis=1)
    semi_major = 1 / (2 / r - v**2 / EARTH)
    ballistic, height = coefficient * area / mass, 58.515e3
    # with a changing by far less than itself: exp(a/H) grows in proportion to the time
    rate = 3.725e-12 * ballistic * np.sqrt(EARTH * a)
    expected = a + height * np.log(1 - rate * path.time / height)
    lost = a - expected[-1]
    assert lost > 4e3
    assert np.abs(semi_major - expected).max() < 1e-3 * lost


@pytest.mark.parametrize("n", [1, 2, 3])
def test_no_force_on_a_body_that_drifts_with_the_air(n):
    drift, q = np.array([3.0, -4.0, 1.0])[:n], np.array([10.0, 20.0, 30.0])[:n]
    for effect in (
        Drag(0.1, 1.0, UniformAtmosphere(1.2, drift)),
        Drag(0.1, 1.0, UniformAtmosphere(1.2, Wind(drift))),
        LinearDrag(0.5, drift),
    ):
        effect.check_dimension(n)
        assert not force(effect, q, drift).any()
        assert force(effect, q, 0 * drift) @ drift > 0


def test_no_force_on_a_body_that_turns_with_the_atmosphere():
    rate = 7.2921159e-5
    air = ExponentialAtmosphere(3.725e-12, 400e3, 58.515e3, RADIUS, rate)
    q = np.array([6.7e6, -4e5, 9e5])
    co_rotating = rate * np.array([-q[1], q[0], 0])
    assert not force(Drag(10.0, 2.2, air), q, co_rotating).any()
    np.testing.assert_allclose(force(Drag(10.0, 2.2, air), q[:2], co_rotating[:2]), 0, atol=0)
    gust = ExponentialAtmosphere(3.725e-12, 400e3, 58.515e3, RADIUS, rate, wind=(0, 0, 30.0))
    assert not force(Drag(10.0, 2.2, gust), q, co_rotating + np.array([0, 0, 30.0])).any()


def test_wind_may_change_with_time_and_place():
    """A wind profile over the height, and gusts."""
    field = Wind(lambda t, q: ca.vertcat(2 * q[1] + ca.sin(t), 0))
    seen = force(LinearDrag(0.5, field), [3.0, 10.0], [0.0, 0.0], t=0.7)
    np.testing.assert_allclose(seen, [0.5 * (20 + np.sin(0.7)), 0], rtol=1e-15)
    quadratic = force(Drag(0.2, 1.5, UniformAtmosphere(1.2, field)), [3.0, 10.0], [1.0, 2.0], t=0.7)
    against = np.array([1 - 20 - np.sin(0.7), 2.0])
    expected = -0.5 * 1.2 * 1.5 * 0.2 * np.linalg.norm(against) * against
    np.testing.assert_allclose(quadratic, expected, rtol=1e-12)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivatives_are_finite_at_rest(order):
    effect, q = Drag(0.1, 1.0, SEA_LEVEL), [1.0, 2.0, 3.0]
    assert np.isfinite(force(effect, q, [0.0, 0.0, 0.0], order=order)).all()
    # the second derivative stays of the size it has at speed, however near to rest
    if order == 2:
        sizes = [np.abs(force(effect, q, [speed, 0.0, 0.0], order=2)).max() for speed in np.logspace(-9, 2, 45)]
        assert max(sizes) < 1.2 * sizes[-1]


def test_the_rounding_at_rest_is_not_felt_in_flight():
    seen = force(Drag(0.1, 1.0, SEA_LEVEL), [0.0, 0.0], [0.03, -0.04])
    np.testing.assert_allclose(seen, -0.5 * 1.225 * 0.1 * 0.05 * np.array([0.03, -0.04]), rtol=1e-9)


def test_the_density_falls_by_the_factor_e_and_ends_underground():
    q = ca.SX.sym("q", 3)
    density = THERMOSPHERE.density_at(0.0, q)
    function = ca.Function("d", [q], [density, ca.gradient(density, q), ca.hessian(density, q)[0]])
    values = [float(function([0, RADIUS + z, 0])[0]) for z in (400e3, 458.515e3, 341.485e3)]
    np.testing.assert_allclose(values, 3.725e-12 * np.exp([0, -1, 1]), rtol=1e-12)
    for place in ([0, 0, 0], [1e-3, 0, 0], [1e5, 1e5, 0]):
        value, slope, curvature = (np.array(x) for x in function(place))
        assert value == pytest.approx(3.725e-12 * np.exp(400 / 58.515 + 5))
        assert np.isfinite(slope).all() and np.isfinite(curvature).all()


def test_without_wind_nothing_of_it_is_in_the_graph():
    def size(effect):
        t, q, v, m = ca.SX.sym("t"), ca.SX.sym("q", 3), ca.SX.sym("v", 3), ca.SX.sym("m")
        return ca.Function("f", [t, q, v, m], [effect.force(t, q, v, m)]).n_instructions()

    assert size(LinearDrag(0.5)) < size(LinearDrag(0.5, (1.0, 2.0, 3.0)))
    assert size(Drag(1, 1, SEA_LEVEL)) < size(Drag(1, 1, UniformAtmosphere(1.225, (1.0, 2.0, 3.0))))
    turning = ExponentialAtmosphere(1e-12, 4e5, 6e4, RADIUS, 7e-5)
    assert size(Drag(1, 1, THERMOSPHERE)) < size(Drag(1, 1, turning))


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: Drag(-1, 2.2, SEA_LEVEL), "area must not be negative .m.2."),
        (lambda: Drag(1, 2.2, 1.225), r"UniformAtmosphere\(density\)"),
        (lambda: UniformAtmosphere(-1.0), "density must not be negative"),
        (lambda: ExponentialAtmosphere(1e-12, 4e5, 0.0, RADIUS), "scale_height must be greater than 0 .m."),
        (lambda: ExponentialAtmosphere(1e-12, RADIUS + 4e5, 6e4, RADIUS), "above the surface"),
        (lambda: Drag(1, 1, THERMOSPHERE).check_dimension(1), "2 or 3 dimensions"),
        (lambda: LinearDrag(1.0, (1.0, 2.0)).check_dimension(3), "velocity has 2 entries"),
        (lambda: LinearDrag(1.0, lambda t, q: q[5]).check_dimension(2), "wind in 2 dimensions fails"),
        (lambda: LinearDrag(1.0, "west").check_dimension(2), "wind must be"),
    ],
)
def test_nonsense_is_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()
