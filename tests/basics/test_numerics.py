"""The package's cubic spline is SciPy's, digit for digit, on every kind of mesh."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from dmoc.basics.numerics import cubic_spline
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_fractions

RANDOM = np.random.default_rng(4)


def uniform(count):
    return np.linspace(-1.0, 1.0, count)


def graded(count):
    """Steps that grow ten thousandfold."""
    return np.cumsum(np.append(0.0, np.geomspace(1.0, 1e4, count - 1)))


def uneven(count):
    """Neighbours up to a hundred times as long."""
    return np.cumsum(np.append(0.0, 10.0 ** RANDOM.uniform(-2, 0, count - 1)))


def lobatto(count):
    """The nodes of steps of order 8, as many as fit."""
    return node_fractions(np.linspace(0.0, 1.0, max(count // 4, 1) + 1), scheme(8))


@pytest.mark.parametrize("clamped", [False, True], ids=["not-a-knot", "clamped"])
@pytest.mark.parametrize("count", [3, 4, 5, 8, 33, 400, 25_601])
@pytest.mark.parametrize("mesh", [uniform, graded, uneven, lobatto])
def test_it_is_scipys(mesh, count, clamped):
    x = mesh(count)
    size = x[-1] - x[0]
    y = np.stack([np.sin(7 * x / size), 1e3 * np.cos(3 * x / size), RANDOM.normal(size=len(x))], axis=1)
    slopes = (y[0] / size, y[-1] / size) if clamped else None
    # places between the points and on them
    at = np.concatenate([x[0] + size * RANDOM.uniform(0, 1, 2 * len(x)), x])
    theirs = CubicSpline(x, y, bc_type=((1, slopes[0]), (1, slopes[1])) if clamped else "not-a-knot")(at)
    error = np.abs(cubic_spline(x, y, slopes)(at) - theirs).max(axis=0) / np.abs(theirs).max(axis=0)
    # without end slopes, steps of three points that differ ten thousandfold cost either of them digits
    assert error.max() < (1e-14 if clamped else 2e-12)


@pytest.mark.parametrize("slopes", [None, (np.array(0.0), np.array(2.0))])
def test_one_column_needs_no_second_axis(slopes):
    x = np.array([0.0, 0.3, 0.4, 1.0])
    at = np.linspace(0, 1, 11)
    np.testing.assert_allclose(cubic_spline(x, x**2, slopes)(at), at**2, rtol=0, atol=1e-15)


def test_a_cubic_comes_back():
    x = graded(50) / graded(50)[-1]

    def cubic(at):
        return 1 - 2 * at + 3 * at**2 - 4 * at**3

    at = np.linspace(0, 1, 1001)
    np.testing.assert_allclose(cubic_spline(x, cubic(x))(at), cubic(at), rtol=0, atol=1e-12)
    clamped = cubic_spline(x, cubic(x), (np.array(-2.0), np.array(-8.0)))(at)
    np.testing.assert_allclose(clamped, cubic(at), rtol=0, atol=1e-14)
