"""The numbers of the scheme of each order: Lobatto points of [0, 1], weights and derivative matrix."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre

from dmoc.basics.arguments import short
from dmoc.basics.records import dataclass

# The schemes have these orders, 2 s for a polynomial of degree s = 1 to 4 in each step.
ORDERS = (2, 4, 6, 8)


@dataclass(frozen=True)
class Scheme:
    """A Galerkin variational integrator on the s + 1 Lobatto points of a step, of order 2 s.

    Attributes
    ----------
    degree : int
        s, the degree of the polynomial through the nodes of one step.
    points : array, shape (s+1,)
        Lobatto points c_j, fractions of the step.
    weights : array, shape (s+1,)
        Quadrature weights w_j, sum 1, exact to degree 2 s - 1.
    derivative : array, shape (s+1, s+1)
        D, with D_ij the derivative of the j-th Lagrange polynomial at c_i.
    integral : array, shape (s+1, s+1)
        A, with A_ij the integral of the j-th Lagrange polynomial from 0 to c_i (Lobatto IIIA).

    References
    ----------
    S. Ober-Bloebaum, N. Saake, Construction and analysis of higher order Galerkin variational
    integrators, Adv. Comput. Math. 41 (2015).
    """

    degree: int
    points: np.ndarray
    weights: np.ndarray
    derivative: np.ndarray
    integral: np.ndarray

    @property
    def order(self) -> int:
        return 2 * self.degree

    def values_at(self, fractions) -> np.ndarray:
        """Matrix (len(fractions), s+1) that evaluates the interpolant at fractions of the step."""
        return legendre.legvander(_symmetric(fractions), self.degree) @ _inverse_vandermonde(self.points)

    def slopes_at(self, fractions) -> np.ndarray:
        """Matrix (len(fractions), s+1) that differentiates the interpolant at fractions of the step."""
        return _vander_derivative(fractions, self.degree) @ _inverse_vandermonde(self.points)

    def hermite_slopes(self) -> np.ndarray:
        """Matrix (s+1, s+3): slopes at the nodes of the polynomial with given node values and end slopes."""
        powers = np.arange(self.degree + 3)
        values = self.points[:, None] ** powers
        slopes = powers * self.points[:, None] ** np.maximum(powers - 1, 0)
        return slopes @ np.linalg.inv(np.vstack([values, slopes[[0, -1]]]))

    def gauss_points(self) -> np.ndarray:
        """The s Gauss points of the step, where the velocity of the interpolant is most accurate."""
        return 0.5 * (legendre.leggauss(self.degree)[0] + 1)

    def gauss_weights(self) -> np.ndarray:
        """The weights of the Gauss points, which add up to 1."""
        return 0.5 * legendre.leggauss(self.degree)[1]


def scheme(order: int) -> Scheme:
    """The scheme of order 2, 4, 6 or 8.

    Raises
    ------
    ValueError
        If there is no such order.
    """
    if isinstance(order, bool) or not isinstance(order, (int, np.integer)) or order not in ORDERS:
        raise ValueError(f"order must be one of 2, 4, 6, 8; got {short(order)}")
    return _scheme(int(order) // 2)


@lru_cache
def _scheme(degree: int) -> Scheme:
    points = _lobatto_points(degree)
    at_points = legendre.Legendre.basis(degree)(2 * points - 1)
    weights = 1 / (degree * (degree + 1) * at_points**2)
    inverse = _inverse_vandermonde(points)
    derivative = _vander_derivative(points, degree) @ inverse
    antiderivatives = [legendre.legint(row, lbnd=-1) for row in np.eye(degree + 1)]
    integrals = np.stack([legendre.legval(2 * points - 1, row) for row in antiderivatives], axis=1)
    return Scheme(degree, points, weights, derivative, 0.5 * integrals @ inverse)


def _lobatto_points(degree: int) -> np.ndarray:
    """Ends of [0, 1] and the roots of P_s', polished to round-off and made exactly symmetric."""
    slope = legendre.Legendre.basis(degree).deriv()
    # The roots of a polynomial are eigenvalues with rounding errors, which two steps of Newton's method remove.
    inner = np.sort(np.real(slope.roots())) if degree > 1 else np.empty(0)
    for _ in range(2):
        inner = inner - slope(inner) / slope.deriv()(inner) if degree > 1 else inner
    # The mean of the points and their mirror image is symmetric to the last bit: so is the scheme in time.
    points = np.concatenate(([-1.0], inner, [1.0]))
    return 0.5 + 0.25 * (points - points[::-1])


def _symmetric(fractions) -> np.ndarray:
    """Fractions 0..1 of the step as arguments -1..1 of Legendre polynomials."""
    return 2 * np.asarray(fractions, float) - 1


def _inverse_vandermonde(points: np.ndarray) -> np.ndarray:
    """Matrix from values at the points to coefficients of Legendre polynomials."""
    return np.linalg.inv(legendre.legvander(_symmetric(points), len(points) - 1))


def _vander_derivative(fractions, degree: int) -> np.ndarray:
    """Slopes of the Legendre polynomials by the fraction of the step, one column a polynomial."""
    rows = [legendre.legval(_symmetric(fractions), legendre.legder(row)) for row in np.eye(degree + 1)]
    return 2 * np.stack(rows, axis=-1)
