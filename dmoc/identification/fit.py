"""Least squares under equations, in the order of time: Gauss and Newton's method on one banded system.

With J the slopes of the rows and R those of the residuals, every step solves

    [R'R  J'] [dx ]     [R'r]
    [J    0 ] [lam] = - [ c ]

for the unknowns of the path; its band is as wide as one step of the flight. The few numbers that are asked for
are a border of it, of which the Schur complement is the information that the flight has of them: its inverse is
their covariance, with all of the path and all forces unknown beside them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from dmoc.identification.equations import Equations, layout_nodes
from dmoc.identification.setting import Setting

# At most so many steps of Newton's method, and so many halvings of one.
MOST_STEPS, MOST_HALVINGS = 50, 12
# Done where the last step moved the unknowns by less than this [-], or rows and gradient are rounding.
SMALL = 1e-10
# Near enough, where rounding lets a step become no smaller [-].
NEAR = 1e-8
# A mass changes by at most this factor in one step.
FACTOR = 4.0
# A direction of the numbers of which there is less information than this, against what there is of each of
# them alone, is not seen in the flight [-].
UNSEEN = 1e-11
# Refinements of each solution of the linear system.
REFINEMENTS = 2


@dataclass(frozen=True)
class Fit:
    """The least-squares answer.

    Attributes
    ----------
    x : array
        All unknowns in SI units, the numbers last.
    residuals : array
        Over their standard deviations.
    information : array, shape (numbers, numbers)
        Of the unknowns that stand for the numbers, each over its scale.
    unseen : array
        Directions of the numbers that the flight does not see, one a column, in the same scale.
    """

    x: np.ndarray
    residuals: np.ndarray
    information: np.ndarray
    unseen: np.ndarray
    degrees: int
    steps: int
    converged: bool
    last_step: float
    system: System

    def covariance(self) -> np.ndarray:
        """The inverse of the information, in what the flight sees."""
        return self.system.weight**2 * self.system.inverse()


class System:
    """The linear system of one step at one place, factorised."""

    def __init__(self, equations: Equations, free: np.ndarray, weight: float, x: np.ndarray):
        setting = equations.setting
        self.equations, self.weight = equations, weight
        self.free, self.count = free, len(setting.wanted)
        c, J = equations.rows_at(x)
        r, R = equations.residuals_at(x)
        scale, rows = setting.scales, equations.row_scales
        self.c, self.r = c * rows, r * weight
        J = sparse.diags(rows) @ J @ sparse.diags(scale)
        R = R @ sparse.diags(scale * weight)
        self.R = R[:, np.append(free, setting.numbers)].tocsr()
        path, border = J[:, free], J[:, setting.numbers]
        Rx, Rn = R[:, free], R[:, setting.numbers]
        self.matrix = sparse.bmat([[Rx.T @ Rx, path.T], [path, None]], format="csr")
        self.border = np.vstack([(Rx.T @ Rn).toarray(), border.toarray()])
        self.corner = (Rn.T @ Rn).toarray()
        nodes = np.append(layout_nodes(setting, setting.columns)[free], equations.row_nodes)
        self.order = np.argsort(nodes, kind="stable")
        banded = self.matrix[self.order][:, self.order].tocsc()
        # In the order of time the band stays a band: any other order of columns would be dearer.
        self.factors: SuperLU = splu(banded, permc_spec="NATURAL")
        self.beyond = self.solved(self.border)
        self.information = self.corner - self.border.T @ self.beyond
        self.information = 0.5 * (self.information + self.information.T)

    def solved(self, right: np.ndarray) -> np.ndarray:
        """The path's part of the system, numbers fixed."""
        found = self._once(right)
        for _ in range(REFINEMENTS):
            found = found + self._once(right - self.matrix @ found)
        return found

    def _once(self, right: np.ndarray) -> np.ndarray:
        found = np.empty_like(right)
        found[self.order] = self.factors.solve(np.ascontiguousarray(right[self.order]))
        return found

    def step(self, r: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Changes of free unknowns and of numbers, scaled, for weighted residuals and scaled rows."""
        gradient, split = self.R.T @ r, len(self.free)
        inner = self.solved(-np.concatenate([gradient[:split], c]))
        numbers = self.inverse() @ (-gradient[split:] - self.border.T @ inner)
        return (inner - self.beyond @ numbers)[:split], numbers

    def steps_of(self, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same for many sets of residuals, one a column, where all rows hold."""
        return self.step(r, np.zeros((len(self.c), r.shape[1])))

    def inverse(self) -> np.ndarray:
        """The inverse of the information in what is seen."""
        values, vectors, size = self._spectrum()
        kept = values > UNSEEN
        inside = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T
        return inside / np.outer(size, size)

    def _spectrum(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Eigenvalues and vectors of the information, each number over what there is of it alone."""
        size = np.sqrt(
            np.maximum(np.diag(self.corner) + (self.border * np.abs(self.beyond)).sum(axis=0).clip(0), 0)
        )
        size = np.where(size > 0, size, 1.0)
        alone = np.sqrt(np.maximum(np.diag(self.information), UNSEEN * size**2))
        values, vectors = np.linalg.eigh(self.information / np.outer(alone, alone))
        return values, vectors, alone

    def unseen(self) -> np.ndarray:
        """Directions of the numbers, over their scales, of which the flight says nothing; one a column."""
        if not self.count:
            return np.empty((0, 0))
        values, vectors, size = self._spectrum()
        found = vectors[:, values <= UNSEEN] / size[:, None]
        return found / np.maximum(np.linalg.norm(found, axis=0), 1e-300)


def fitted(equations: Equations, fixed: np.ndarray, weight: float) -> Fit:
    """The answer of the least-squares problem.

    `fixed` says which unknowns of the path are known; residuals are multiplied by `weight`, so that they and
    the rows are of one size.
    """
    setting = equations.setting
    free, x = np.flatnonzero(~fixed), setting.begin()
    scale = setting.scales
    last, converged = np.inf, False
    for count in range(1, MOST_STEPS + 1):
        system = System(equations, free, weight, x)
        path, numbers = system.step(system.r, system.c)
        most = _allowed(setting, x, numbers)
        before = _merit(system.r, system.c)
        for _ in range(MOST_HALVINGS):
            trial = x.copy()
            trial[free] += most * path * scale[free]
            trial[setting.numbers] += most * numbers * scale[setting.numbers]
            after = _merit_at(equations, trial, weight)
            if np.isfinite(after) and after <= before * (1 + 1e-6) + 1e-18:
                break
            most *= 0.5
        size = float(max(np.abs(path).max(initial=0.0), np.abs(numbers).max(initial=0.0)))
        x = trial
        steps = count
        if size < SMALL or (size < NEAR and size > 0.3 * last):
            converged = True
            break
        last = size
    residuals = equations.values_at(x)[1]
    degrees = equations.count + equations.row_count - len(free) - len(setting.wanted)
    return Fit(
        x,
        residuals,
        system.information / weight**2,
        system.unseen(),
        degrees,
        steps,
        converged,
        size,
        system,
    )


def _merit(r: np.ndarray, c: np.ndarray) -> float:
    """Half the sum of squares, and how far rows are from 0."""
    return float(0.5 * r @ r + np.abs(c).sum())


def _merit_at(equations: Equations, x: np.ndarray, weight: float) -> float:
    with np.errstate(all="ignore"):
        c, r = equations.values_at(x)
        return _merit(r * weight, c * equations.row_scales)


def _allowed(setting: Setting, x: np.ndarray, numbers: np.ndarray) -> float:
    """The part of a step for which masses stay positive."""
    most = 1.0
    for j, one in enumerate(setting.wanted):
        now, change = x[setting.numbers[j]], numbers[j] * one.scale
        if one.inverse and change < 0 and now + change < now / FACTOR:
            most = min(most, (now - now / FACTOR) / -change)
    return most
