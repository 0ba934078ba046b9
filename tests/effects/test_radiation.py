"""Sunlight pushes as published, not at all in the umbra, and has derivatives everywhere in and around it."""

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    ConicalShadow,
    CylindricalShadow,
    PointGravity,
    RadiationPressure,
    State,
    TransferProblem,
    circular_motion,
)
from dmoc.motion.march import simulate

AU, SUN, SUN_MU, RADIUS = 149_597_870_700.0, 6.957e8, 1.32712440018e20, 6.378137e6
FAR = (AU, 0.0, 0.0)
CONE = ConicalShadow(RADIUS)


def force(effect, q, t=0.0):
    n = len(q)
    time, place, v, m = ca.SX.sym("t"), ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("m")
    return np.array(ca.Function("f", [time, place], [effect.force(time, place, v, m)])(t, q)).ravel()


def light(shadow, places, sun=FAR):
    """Fraction of light at places of shape (count, axes), its gradient and its Hessian."""
    places = np.atleast_2d(places)
    q = ca.SX.sym("q", places.shape[1])
    value = shadow.light(q, ca.DM(sun[: places.shape[1]]))
    hessian, gradient = ca.hessian(value, q)
    function = ca.Function("s", [q], [value, ca.densify(gradient), ca.vec(ca.densify(hessian))])
    return [np.array(x).T for x in function.map(len(places))(places.T)]


def behind(distance, across):
    """A place behind the sphere, off the axis."""
    return np.array([-distance, 0.6 * across, 0.8 * across])


def overlap_of_discs(place, radius=RADIUS):
    """Montenbruck & Gill (2000), equations (3.85) to (3.94): fraction of the sun's disc that is seen."""
    to_sun = np.array(FAR) - place
    d, r = np.linalg.norm(to_sun), np.linalg.norm(place)
    a, b, c = np.arcsin(SUN / d), np.arcsin(radius / r), np.arccos(np.clip(-place @ to_sun / d / r, -1, 1))
    if c >= a + b:
        return 1.0
    if c <= abs(a - b):
        return 1 - min(1.0, b / a) ** 2
    x = (c * c + a * a - b * b) / (2 * c)
    y = np.sqrt(a * a - x * x)
    return 1 - (a * a * np.arccos(x / a) + b * b * np.arccos((c - x) / b) - c * y) / (np.pi * a * a)


def test_a_mirror_of_1_53_grams_a_square_metre_hovers_over_the_sun():
    """C. R. McInnes, Solar Sailing (1999), section 2.4: the critical loading of an ideal sail, 1.53 g/m^2."""
    push = force(RadiationPressure(1.0, 1.0, (0.0, 0.0, 0.0)), [0.3 * AU, -0.8 * AU, 0.1 * AU])
    direction = np.array([0.3, -0.8, 0.1])
    loading = push @ direction / (SUN_MU / AU**2) * (direction @ direction) / np.linalg.norm(direction)
    assert loading == pytest.approx(1.53e-3, rel=6e-3)


def test_a_sail_that_faces_the_sun_keeps_to_a_kepler_orbit_of_less_gravity():
    """Lightness number b: attraction (1 - b) mu (McInnes 1999, section 4.2)."""
    mass, area = 100.0, 1e4
    effects = (PointGravity(SUN_MU), RadiationPressure(area, 1.0, (0.0, 0.0)))
    lightness = 2 * 4.56e-6 * AU**2 * area / (mass * SUN_MU)
    speed = np.sqrt((1 - lightness) * SUN_MU / AU)
    duration = 2 * np.pi * AU / speed
    problem = TransferProblem(
        mass, State((AU, 0), (0, speed)), State((None, None), (None, None)), duration, effects
    )
    path = simulate(problem, steps=60, order=8)
    np.testing.assert_allclose(np.linalg.norm(path.position, axis=1), AU, rtol=1e-9)
    assert np.linalg.norm(path.position[-1] - path.position[0]) < 1e-8 * AU


def test_pressure_and_direction_at_one_astronomical_unit():
    """- P C_R A (au/d)^2 along the sun: Montenbruck & Gill (2000), equation (3.75)."""
    seen = force(RadiationPressure(10.0, 0.3, FAR), [4.2e7, 0.0, 0.0])
    np.testing.assert_allclose(seen, [-4.56e-6 * 1.3 * 10 * (AU / (AU - 4.2e7)) ** 2, 0, 0], rtol=1e-14)
    year = circular_motion(AU, 1.99e-7, inclination=0.409)
    moving = force(RadiationPressure(10.0, 0.3, year), [0.0, 0.0, 0.0], t=1e7)
    position = np.array(year(1e7)).ravel()
    np.testing.assert_allclose(moving, -4.56e-6 * 13 * position / AU, rtol=1e-14)


@pytest.mark.parametrize("shadow", [CONE, CylindricalShadow(RADIUS)])
def test_full_light_in_front_and_none_in_the_umbra(shadow):
    lit = [[4.2e7, 0, 0], [RADIUS + 4e5, 1e6, 0], behind(4.2e7, 1.2 * RADIUS), behind(-1e6, 0.99 * RADIUS)]
    if shadow is not CONE:
        lit = lit[:3]
    dark = [behind(RADIUS + 4e5, 0.0), behind(1e7, 0.5 * RADIUS), behind(4.2e7, 0.9 * RADIUS)]
    np.testing.assert_allclose(light(shadow, lit)[0].ravel(), 1, rtol=0, atol=1e-6)
    np.testing.assert_allclose(light(shadow, dark)[0].ravel(), 0, rtol=0, atol=1e-6)


@pytest.mark.parametrize("distance", [2e6, 1e7, 4.2e7])
def test_the_penumbra_is_the_overlap_of_the_discs(distance):
    """Within 0.02 up to the height of geostationary orbits, and exact outside of the widened penumbra."""
    width = distance * SUN / AU
    across = np.linspace(RADIUS - 2 * width, RADIUS + 2 * width, 201)
    places = np.array([behind(distance, y) for y in across])
    seen, exact = light(CONE, places)[0].ravel(), np.array([overlap_of_discs(place) for place in places])
    assert np.abs(seen - exact).max() < 0.02
    assert (np.diff(seen) >= 0).all() and seen[0] == 0.0 and seen[-1] == 1.0


def test_behind_the_apex_of_the_umbra_a_ring_of_sun_is_left():
    apex = RADIUS * AU / (SUN - RADIUS)
    places = np.array([behind(k * apex, 0.0) for k in (1.5, 3.0, 10.0)])
    exact = [overlap_of_discs(place) for place in places]
    np.testing.assert_allclose(light(CONE, places)[0].ravel(), exact, atol=0.03)
    around = np.array(
        [behind(k * apex, y * RADIUS) for k in (0.5, 0.9, 1.0, 1.1, 2.0) for y in np.linspace(0, 4, 81)]
    )
    exact = np.array([overlap_of_discs(place) for place in around])
    assert np.abs(light(CONE, around)[0].ravel() - exact).max() < 0.15


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("shadow", [CONE, CylindricalShadow(RADIUS), CylindricalShadow(RADIUS, 10.0)])
def test_derivatives_are_finite_everywhere(shadow, n):
    """Axis, centre, surface, limb and apex included; a guess may go through the sphere."""
    apex = RADIUS * AU / (SUN - RADIUS)
    places = [
        [x * RADIUS, y * RADIUS, 0.0][:n]
        for x in (-apex / RADIUS, -50, -1.06, -1, -0.5, 0, 0.5, 1, 7)
        for y in (-1.0, -0.3, 0.0, 1e-9, 1e-3, 0.999, 1.0, 1.001, 6)
    ]
    for value in light(shadow, places):
        assert np.isfinite(value).all()
    assert np.isfinite(force(RadiationPressure(1.0, 0.5, FAR[:n], shadow), [0.0] * n)).all()


@pytest.mark.parametrize("shadow", [CONE, CylindricalShadow(RADIUS)])
def test_the_gradient_is_that_of_the_light_and_steps_nowhere(shadow):
    """Central differences across both edges; the second derivative has no jump either."""
    width = 1e7 * SUN / AU if shadow is CONE else RADIUS / 100
    across = np.linspace(RADIUS - 3 * width, RADIUS + 3 * width, 1201)
    value, gradient, hessian = light(shadow, [[-1e7, y, 0] for y in across])
    slope, step = gradient[:, 1], across[1] - across[0]
    np.testing.assert_allclose(
        (value[2:, 0] - value[:-2, 0]) / (2 * step), slope[1:-1], atol=1e-3 * np.abs(slope).max()
    )
    bend = hessian[:, 4]
    assert np.abs(np.diff(bend)).max() < 0.03 * np.abs(bend).max()


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: RadiationPressure(1.0, 1.3, FAR), "give C_R - 1"),
        (lambda: RadiationPressure(1.0, 0.3, (1.0, 0.0, 0.0)), "multiply a direction"),
        (lambda: RadiationPressure(1.0, 0.3, (0.0, 0.0), CONE), "sun is at the origin"),
        (lambda: RadiationPressure(1.0, 0.3, FAR, RADIUS), "shadow must be"),
        (lambda: RadiationPressure(1.0, 0.3, (AU, 0.0, 1e9)).check_dimension(2), "sun has 3 entries"),
        (lambda: CylindricalShadow(-1.0), "radius must be greater than 0 .m."),
        (lambda: CylindricalShadow(RADIUS, 0.0), "sharpness must be greater than 0"),
        (lambda: ConicalShadow(RADIUS, -1.0), "sun_radius must be greater than 0 .m."),
    ],
)
def test_nonsense_is_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()
