"""Functions of many columns give what CasADi's own call gives."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from dmoc.basics.numerics import MOST_COLUMNS, columns


def a_function() -> ca.Function:
    """Of a column, a matrix, a number and nothing; with a dense, a sparse and a matrix output."""
    x, u, t, nothing = ca.SX.sym("x", 3), ca.SX.sym("u", 2, 2), ca.SX.sym("t"), ca.SX.sym("nothing", 0)
    sparse = ca.SX(3, 1)
    sparse[1] = x[0] * t
    turned = ca.horzcat(u @ x[:2], x[1:] * ca.sin(t))
    return ca.Function("some", [x, u, t, nothing], [x**2 * t, sparse, turned])


@pytest.mark.parametrize("count", [1, 7, MOST_COLUMNS + 1, 3 * MOST_COLUMNS - 5])
def test_columns_are_those_of_casadi(count):
    random, function = np.random.default_rng(count), a_function()
    x, u, t = random.normal(size=(3, count)), random.normal(size=(2, 2 * count)), random.normal(size=count)
    found = columns(function, x, u, t, np.zeros((0, count)))
    for one, other in zip(found, function(x, u, t[None], ca.DM(0, count)), strict=True):
        np.testing.assert_array_equal(one, other.full())


def test_what_is_given_once_is_the_same_in_all_columns():
    x, u = np.arange(12.0).reshape(3, 4), np.array([[1.0, 2.0], [3.0, 4.0]])
    found = columns(a_function(), x, u, 0.5, ())
    again = columns(a_function(), x, np.tile(u, 4), np.full(4, 0.5), ())
    for one, other in zip(found, again, strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_first_may_be_the_one_that_is_given_once():
    x, u, t = np.array([[1.0], [2.0], [3.0]]), np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([0.5, 0.7, 0.9])
    found, again = columns(a_function(), x, u, t, ()), columns(a_function(), np.tile(x, 3), u, t, ())
    for one, other in zip(found, again, strict=True):
        np.testing.assert_array_equal(one, other)
