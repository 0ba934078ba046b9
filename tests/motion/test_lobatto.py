"""Each order's points, weights and matrices are those of Lobatto quadrature and of exact polynomials."""

import numpy as np
import pytest

from dmoc.motion.lobatto import ORDERS, scheme
from dmoc.motion.mesh import node_fractions, node_weights, step_nodes, uniform_mesh

ROUND_OFF = 1e-14


@pytest.fixture(params=ORDERS)
def rule(request):
    return scheme(request.param)


def test_points_and_weights_are_the_known_ones():
    fifth, seventh = 1 / np.sqrt(5), np.sqrt(3 / 7)
    known = {
        2: ([0, 1], [1 / 2, 1 / 2]),
        4: ([0, 1 / 2, 1], [1 / 6, 2 / 3, 1 / 6]),
        6: ([0, (1 - fifth) / 2, (1 + fifth) / 2, 1], [1 / 12, 5 / 12, 5 / 12, 1 / 12]),
        8: ([0, (1 - seventh) / 2, 1 / 2, (1 + seventh) / 2, 1], [1 / 20, 49 / 180, 16 / 45, 49 / 180, 1 / 20]),
    }
    for order, (points, weights) in known.items():
        np.testing.assert_allclose(scheme(order).points, points, rtol=0, atol=ROUND_OFF)
        np.testing.assert_allclose(scheme(order).weights, weights, rtol=0, atol=ROUND_OFF)


def test_derivative_matrix_of_order_4_is_the_known_one():
    known = [[-3, 4, -1], [-1, 0, 1], [1, -4, 3]]
    np.testing.assert_allclose(scheme(4).derivative, known, rtol=0, atol=10 * ROUND_OFF)


def test_order_is_twice_the_degree(rule):
    assert rule.order == 2 * rule.degree == 2 * (len(rule.points) - 1)


def test_points_are_exactly_symmetric_and_touch_both_ends(rule):
    assert (rule.points + rule.points[::-1] == 1).all()
    assert rule.points[0] == 0 and rule.points[-1] == 1
    assert (np.diff(rule.points) > 0).all()
    np.testing.assert_allclose(rule.weights, rule.weights[::-1], rtol=0, atol=ROUND_OFF)


def test_weights_sum_to_one(rule):
    assert abs(rule.weights.sum() - 1) < ROUND_OFF


def test_quadrature_is_exact_to_degree_2s_minus_1_and_not_beyond(rule):
    for degree in range(2 * rule.degree):
        assert abs(rule.weights @ rule.points**degree - 1 / (degree + 1)) < ROUND_OFF
    first_missed = 2 * rule.degree
    assert abs(rule.weights @ rule.points**first_missed - 1 / (first_missed + 1)) > 1e-5


def test_derivative_matrix_is_exact_to_degree_s_and_not_beyond(rule):
    c, s = rule.points, rule.degree
    for degree in range(s + 1):
        slope = degree * c ** max(degree - 1, 0)
        np.testing.assert_allclose(rule.derivative @ c**degree, slope, rtol=0, atol=20 * ROUND_OFF)
    assert np.abs(rule.derivative @ c ** (s + 1) - (s + 1) * c**s).max() > 1e-2


def test_integral_matrix_is_exact_to_degree_s_and_undoes_the_derivative(rule):
    c, s = rule.points, rule.degree
    for degree in range(s + 1):
        area = c ** (degree + 1) / (degree + 1)
        np.testing.assert_allclose(rule.integral @ c**degree, area, rtol=0, atol=ROUND_OFF)
    moves = np.eye(s + 1) - np.eye(s + 1)[0]
    np.testing.assert_allclose(rule.integral @ rule.derivative, moves, rtol=0, atol=20 * ROUND_OFF)


def test_last_row_of_the_integral_matrix_is_the_weights(rule):
    np.testing.assert_allclose(rule.integral[-1], rule.weights, rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(rule.integral[0], 0, rtol=0, atol=ROUND_OFF)


def test_discrete_integration_by_parts_holds(rule):
    """W D + D^T W = diag(-1, 0, .., 0, 1): momentum enters and leaves a step through its ends alone."""
    W = np.diag(rule.weights)
    ends = np.zeros((rule.degree + 1, rule.degree + 1))
    ends[0, 0], ends[-1, -1] = -1, 1
    np.testing.assert_allclose(W @ rule.derivative + rule.derivative.T @ W, ends, rtol=0, atol=10 * ROUND_OFF)


def test_interpolant_is_exact_between_the_nodes(rule):
    fractions = np.array([0.0, 0.13, 0.5, 0.87, 1.0])
    c = rule.points
    for degree in range(rule.degree + 1):
        slope = degree * fractions ** max(degree - 1, 0)
        np.testing.assert_allclose(
            rule.values_at(fractions) @ c**degree, fractions**degree, rtol=0, atol=10 * ROUND_OFF
        )
        np.testing.assert_allclose(rule.slopes_at(fractions) @ c**degree, slope, rtol=0, atol=40 * ROUND_OFF)
    np.testing.assert_allclose(rule.values_at(c), np.eye(len(c)), rtol=0, atol=10 * ROUND_OFF)
    np.testing.assert_allclose(rule.slopes_at(c), rule.derivative, rtol=0, atol=40 * ROUND_OFF)


def test_slope_at_the_gauss_points_is_exact_one_degree_higher(rule):
    c, s = rule.points, rule.degree
    at = rule.gauss_points()
    assert len(at) == s
    assert np.abs(rule.slopes_at(at) @ c ** (s + 1) - (s + 1) * at**s).max() < 40 * ROUND_OFF


@pytest.mark.parametrize("order", [0, 1, 3, 10, -2, 2.5, "2", None])
def test_another_order_is_refused(order):
    with pytest.raises(ValueError, match=r"order must be one of 2, 4, 6, 8; got"):
        scheme(order)


def test_node_weights_of_a_mesh_integrate_over_the_whole_of_it(rule):
    uneven = np.array([0.0, 0.1, 0.35, 0.4, 0.8, 1.0])
    for mesh in (uniform_mesh(7), uneven):
        nodes, weights = node_fractions(mesh, rule), node_weights(mesh, rule)
        assert step_nodes(len(mesh) - 1, rule).max() == len(nodes) - 1
        np.testing.assert_allclose(nodes[:: rule.degree], mesh, rtol=0, atol=ROUND_OFF)
        for degree in range(2 * rule.degree):
            assert abs(weights @ nodes**degree - 1 / (degree + 1)) < ROUND_OFF


def test_hermite_slopes_are_exact_two_degrees_higher(rule):
    """Node values and both end slopes fix a polynomial of degree s + 2."""
    c, s = rule.points, rule.degree
    for degree in range(s + 3):
        slopes = degree * c ** max(degree - 1, 0)
        given = np.concatenate([c**degree, slopes[[0, -1]]])
        np.testing.assert_allclose(rule.hermite_slopes() @ given, slopes, rtol=0, atol=1e-12)
