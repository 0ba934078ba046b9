"""Air from a table, and from the model of a date: densities, derivatives, words, and what is refused."""

import importlib.util
import socket
import sys

import casadi as ca
import numpy as np
import pytest

from dmoc import Drag, PointGravity, State, TabulatedAtmosphere, TransferProblem, msis_atmosphere, simulate

EARTH, MU = 6378137.0, 3.986004418e14
HEIGHTS = np.linspace(2e5, 8e5, 25)
# Two exponentials on top of each other: the scale height grows with the height.
TABLE = TabulatedAtmosphere(
    HEIGHTS, 1e-9 * np.exp(-HEIGHTS / 4e4) + 1e-12 * np.exp(-HEIGHTS / 9e4), EARTH, source="two gases"
)


def density(air, *heights):
    q = ca.SX.sym("q", 3)
    at = ca.Function("density", [q], [air.density_at(0.0, q)])
    return [float(at([0.0, 0.6 * (EARTH + h), 0.8 * (EARTH + h)])) for h in heights]


def test_the_density_is_that_of_the_table_and_its_error_is_told():
    assert density(TABLE, *HEIGHTS) == pytest.approx(TABLE.densities, rel=TABLE.error * 1.01)
    assert 0 < TABLE.error < 1e-3 and f"{100 * TABLE.error:.2g} %" in TABLE.words()
    assert "two gases, a table from 200 to 800 km" in Drag(1.0, 2.0, TABLE).words()


def test_beyond_the_table_it_goes_on_exponentially_and_inside_the_sphere_it_stays():
    top = density(TABLE, 8e5, 8.5e5, 9e5)
    assert top[0] / top[1] == pytest.approx(top[1] / top[2], rel=1e-9) and top[2] < top[1]
    ground = density(TABLE, 0.0, -1e5, -EARTH)
    assert ground[0] == pytest.approx(ground[1]) == pytest.approx(ground[2]) and np.isfinite(ground).all()


def test_its_derivatives_are_finite_everywhere():
    q = ca.SX.sym("q", 3)
    value = TABLE.density_at(0.0, q)
    both = ca.Function("derivatives", [q], [ca.gradient(value, q), ca.hessian(value, q)[0]])
    for place in ((0, 0, 0), (EARTH, 0, 0), (EARTH + 5e5, 0, 0), (0, 0, 2 * EARTH)):
        assert all(np.isfinite(np.array(part)).all() for part in both(place))


def test_an_orbit_in_it_sinks_as_theory_says():
    """A circular orbit loses 2 pi rho (c A / m) a^2 of its radius in a revolution (Curtis, section 12.4)."""
    radius = EARTH + 4e5
    period = 2 * np.pi * np.sqrt(radius**3 / MU)
    speed = np.sqrt(MU / radius)
    start = State((radius, 0, 0), (0, speed, 0))
    coast = TransferProblem(
        100.0, start, State((None,) * 3, (None,) * 3), period, effects=[PointGravity(MU), Drag(2.0, 2.2, TABLE)]
    )
    end = simulate(coast, steps=200, order=4)
    r, v = end.position[-1], end.velocity[-1]
    axis = 1 / (2 / np.linalg.norm(r) - v @ v / MU)
    sunk = 2 * np.pi * density(TABLE, 4e5)[0] * 2.2 * 2.0 / 100.0 * radius**2
    assert radius - axis == pytest.approx(sunk, rel=2e-3)


@pytest.mark.parametrize(
    "changes, said",
    [
        ({"heights": (1, 2, 3)}, "at least 4 increasing heights"),
        ({"heights": (0, 2, 3, 4)}, "above 0 m"),
        ({"densities": (1, 2, 3)}, "4 positive numbers"),
        ({"densities": (1, -2, 3, 4)}, "positive"),
        ({"densities": "thin"}, "finite numbers"),
        ({"heights": range(1, 21), "densities": [1, 1e3] * 10}, "% off; give a smoother table"),
    ],
)
def test_a_table_without_meaning_is_refused_in_one_line(changes, said):
    given = {"heights": (1, 2, 3, 4), "densities": (4, 3, 2, 1), "radius": 10.0} | changes
    with pytest.raises(ValueError, match=said) as refused:
        TabulatedAtmosphere(**given)
    assert "\n" not in str(refused.value)


@pytest.mark.skipif(importlib.util.find_spec("pymsis") is None, reason="pymsis is not installed")
def test_the_air_of_a_date_needs_no_network(monkeypatch):
    """Densities of the model between published bounds, thicker under an active Sun (Vallado, table 8-4)."""

    def refused(*_, **__):
        raise AssertionError("a network was asked")

    monkeypatch.setattr(socket.socket, "connect", refused)
    quiet, active = (msis_atmosphere("2025-06-01T12:00", f107=flux, ap=10) for flux in (70.0, 200.0))
    low, high = density(quiet, 4e5)[0], density(active, 4e5)[0]
    assert 3e-13 < low < 3.725e-12 < high < 2e-11
    assert quiet.error < 1e-3 and "times that by place" in quiet.words()


def test_without_the_model_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymsis", None)
    with pytest.raises(ValueError, match="pip install pymsis"):
        msis_atmosphere("2025-06-01", 150, 10)
