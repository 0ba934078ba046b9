"""How an answer moves with the numbers of its problem, from one factorisation of the optimality conditions."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from dmoc.basics.records import dataclass
from dmoc.sensitivity.optimum import Optimum

# What solves the linear system is right if it leaves this part of the right-hand side [-].
LEFT = 1e-6
# Where a right-hand side of size 1 moves the answer by more than this, the system is singular but for rounding;
# regular ones of scaled problems move it by 1e2 to 2e9, singular ones by 1e14 and more [-].
BEYOND = 1e10
# Refinements of a solution of the linear system: each takes the error of the factorisation once more away.
REFINEMENTS = 2
SINGULAR = (
    "the answer is degenerate: another path, or other multipliers, are as good, so that its optimality "
    "conditions are singular and do not say how it moves"
)


class SingularError(ValueError):
    """The optimality conditions do not say how the answer moves."""


@dataclass(frozen=True)
class Tangent:
    """How the answer moves with some changes of numbers, one column each, all scaled."""

    x: np.ndarray
    rows: np.ndarray
    lam_x: np.ndarray
    lam_g: np.ndarray


@dataclass(frozen=True)
class ActiveSet:
    """Which limits act at an answer; a limit acts where its multiplier is larger than the room left to it.

    An interior-point method ends with multiplier times room equal at all limits, so that where strict
    complementarity holds one of them is far larger.
    """

    optimum: Optimum

    @cached_property
    def columns(self) -> np.ndarray:
        """Of every unknown: -1 on the lower bound, 1 on the upper, 2 fixed, 0 free."""
        return _acting(self.optimum.x, self.optimum.lam_x, *self.optimum.bounds[:2])

    @cached_property
    def rows(self) -> np.ndarray:
        """Of every row the same; 2 for an equation."""
        return _acting(self.optimum.rows, self.optimum.lam_g, *self.optimum.bounds[2:])

    @cached_property
    def free(self) -> np.ndarray:
        return np.flatnonzero(self.columns == 0)

    @cached_property
    def held(self) -> np.ndarray:
        return np.flatnonzero(self.rows != 0)

    @cached_property
    def _factors(self) -> tuple:
        """[H J'; J 0] of free unknowns and acting rows, and its factorisation."""
        made = self.optimum
        J = made.jacobian[self.held][:, self.free]
        H = made.hessian[self.free][:, self.free]
        matrix = sparse.bmat([[H, J.T], [J, None]], format="csc")
        try:
            factors = splu(matrix)
        except RuntimeError as error:
            raise SingularError(SINGULAR) from error
        # Any right-hand side does that a singular direction is not likely to be at right angles to.
        probe = factors.solve(np.cos(np.arange(matrix.shape[0]) ** 2.0))
        if not np.abs(probe).max(initial=0.0) <= BEYOND:
            raise SingularError(SINGULAR)
        return matrix, factors

    def tangent(self, changes: np.ndarray) -> Tangent:
        """The derivative of the answer along changes of all numbers, shape (numbers, directions).

        SingularError if the conditions do not say it: more than one set of multipliers or an optimum that is
        flat.
        """
        made, (lower, upper, low, high, through) = self.optimum, self.optimum.matrices
        by_p = through @ changes
        x = np.zeros((len(made.x), changes.shape[1]))
        for sign, bounds in ((-1, lower), (1, upper), (2, lower)):
            here = self.columns == sign
            x[here] = (bounds @ changes)[here]
        of_x, of_g = (side @ by_p for side in made.mixed)
        target = np.where((self.rows == 1)[:, None], high @ changes, low @ changes)
        right = np.vstack(
            [
                -(of_x + made.hessian @ x)[self.free],
                (target - of_g - made.jacobian @ x)[self.held],
            ]
        )
        found = self._solved(right)
        x[self.free] = found[: len(self.free)]
        lam_g = np.zeros((len(made.lam_g), changes.shape[1]))
        lam_g[self.held] = found[len(self.free) :]
        lam_x = -(made.hessian @ x + made.jacobian.T @ lam_g + of_x)
        lam_x[self.free] = 0.0
        return Tangent(x, made.jacobian @ x + of_g, lam_x, lam_g)

    def _solved(self, right: np.ndarray) -> np.ndarray:
        matrix, factors = self._factors
        found = factors.solve(right)
        for _ in range(REFINEMENTS):
            found += factors.solve(right - matrix @ found)
        left = np.abs(right - matrix @ found).max(initial=0.0)
        size = np.abs(right).max(initial=0.0)
        if not left <= LEFT * size:
            raise SingularError(SINGULAR)
        return found

    def room(self, moving: Tangent, changes: np.ndarray) -> np.ndarray:
        """How far each change may go, back and forth, until a limit begins or ends to act; (directions, 2)."""
        made, (lower, upper, low, high, _) = self.optimum, self.optimum.matrices
        nearest = np.full((changes.shape[1], 2), np.inf)
        for values, slopes, lam, slope_of_lam, acting, sides, moves in (
            (made.x, moving.x, made.lam_x, moving.lam_x, self.columns, made.bounds[:2], (lower, upper)),
            (made.rows, moving.rows, made.lam_g, moving.lam_g, self.rows, made.bounds[2:], (low, high)),
        ):
            idle = acting == 0
            for sign, side, by in zip((-1, 1), sides, moves, strict=True):
                # What is left to a limit, and how that changes.
                gap = (sign * (side - values))[idle]
                rate = sign * (by @ changes - slopes)[idle]
                _meet(nearest, np.maximum(gap, 0.0), rate)
                ends = acting == sign
                _meet(nearest, np.abs(lam[ends]), sign * slope_of_lam[ends])
        return nearest


def _acting(values: np.ndarray, lam: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    found = np.zeros(len(values), int)
    found[-lam > np.abs(values - lower)] = -1
    found[lam > np.abs(upper - values)] = 1
    found[lower == upper] = 2
    return found


def _meet(nearest: np.ndarray, gap: np.ndarray, rate: np.ndarray) -> None:
    """Shorten the ways, back and forth, to where something that is `gap` now and changes by `rate` is 0."""
    for side, sign in enumerate((-1, 1)):
        with np.errstate(divide="ignore", invalid="ignore"):
            ways = np.where(sign * rate < 0, gap[:, None] / np.abs(rate), np.inf)
        nearest[:, side] = np.minimum(nearest[:, side], ways.min(axis=0, initial=np.inf))
