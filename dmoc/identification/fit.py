"""Least squares under equations, in the order of time: Gauss and Newton's method on one banded system.

With J the slopes of the rows and R those of the residuals, every step solves

    [R'R  J'] [dx ]     [R'r]
    [J    0 ] [lam] = - [ c ]

for the unknowns of the path; its band is as wide as one step of the flight. The few numbers that are asked for
are a border of it, of which the Schur complement is the information that the flight has of them: its inverse is
their covariance, with all of the path and all forces unknown beside them.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from dmoc.basics.records import dataclass
from dmoc.identification.equations import Equations
from dmoc.identification.pattern import Pattern
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

    def __init__(self, equations: Equations, pattern: Pattern, weight: float, x: np.ndarray):
        self.equations, self.pattern, self.weight, self.count = equations, pattern, weight, len(pattern.numbers)
        scale, row_scale = equations.setting.scales, equations.row_scales
        self.c, self.r = np.zeros(equations.row_count), np.zeros(equations.count)
        self.gradient, entries = np.zeros(len(scale)), []
        self._slopes: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        for piece in equations.residuals:
            values, slopes = piece.at(x)
            row, column = piece.pattern
            slopes = weight * slopes * scale[piece.columns[column]]
            np.add.at(self.r, piece.targets, weight * values)
            np.add.at(self.gradient, piece.columns[column], slopes * weight * values[row])
            used, local = np.unique(column, return_inverse=True)
            dense = np.zeros((piece.results, len(used), slopes.shape[1]))
            dense[row, local] = slopes
            entries.append(np.einsum("rzc,rwc->zwc", dense, dense).ravel())
            self._slopes.append((slopes.ravel(), piece.targets[row].ravel(), piece.columns[column].ravel()))
        for piece in equations.rows:
            values, slopes = piece.at(x)
            row, column = piece.pattern
            np.add.at(self.c, piece.targets, values)
            slopes = (slopes * row_scale[piece.targets[row]] * scale[piece.columns[column]]).ravel()
            entries += [slopes, slopes]
        self.c *= row_scale
        self.matrix, self.border, self.corner = pattern.matrices(np.concatenate([*entries, []]))
        # In the order of time the band stays a band: any other order of columns would be dearer.
        self.factors: SuperLU = splu(self.matrix, permc_spec="NATURAL")
        self.beyond = self.solved(self.border)
        information = self.corner - self.border.T @ self.beyond
        self.information = 0.5 * (information + information.T)

    @cached_property
    def slopes(self) -> sparse.csr_matrix:
        """Weighted and scaled slopes of all residuals by all unknowns."""
        values, rows, columns = (np.concatenate(side) for side in zip(*self._slopes, strict=True))
        shape = len(self.r), len(self.gradient)
        return sparse.coo_matrix((values, (rows, columns)), shape=shape).tocsr()

    def solved(self, right: np.ndarray) -> np.ndarray:
        """The path's part of the system, numbers fixed."""
        found = self.factors.solve(right)
        for _ in range(REFINEMENTS):
            found = found + self.factors.solve(right - self.matrix @ found)
        return found

    def step(self) -> tuple[np.ndarray, np.ndarray]:
        """Changes of the free unknowns and of the numbers, scaled."""
        return self._stepped(self.gradient, self.c)

    def _stepped(self, gradient: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        inner = self.solved(-self.pattern.vector(gradient[self.pattern.free], c))
        numbers = self.inverse() @ (-gradient[self.pattern.numbers] - self.border.T @ inner)
        return (inner - self.beyond @ numbers)[self.pattern.place[self.pattern.free]], numbers

    def left_of(self, errors: np.ndarray) -> np.ndarray:
        """What the fit leaves of errors of all residuals, one set a column, to first order."""
        path, numbers = self._stepped(self.slopes.T @ errors, np.zeros((len(self.c), errors.shape[1])))
        moved = np.zeros((len(self.gradient), errors.shape[1]))
        moved[self.pattern.free], moved[self.pattern.numbers] = path, numbers
        return errors + self.slopes @ moved

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
    last, size, converged, steps = np.inf, np.inf, False, 0
    pattern = Pattern(equations, free)
    system = _system(equations, pattern, weight, x)
    if system is None:
        raise ValueError(
            "the samples do not tell the path: there are too few of them, "
            "or the scene has no meaning where they are"
        )
    while steps < MOST_STEPS and not converged and system is not None:
        steps, known = steps + 1, system
        path, numbers = system.step()
        x = _moved(system, x, path, numbers)
        size = float(max(np.abs(path).max(initial=0.0), np.abs(numbers).max(initial=0.0)))
        converged = size < SMALL or (size < NEAR and size > 0.3 * last)
        last = size
        if not converged:
            system = _system(equations, pattern, weight, x)
    system = known
    residuals = equations.values_at(x)[1]
    degrees = equations.count - equations.missing + equations.row_count - len(free) - len(setting.wanted)
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


def _system(equations: Equations, pattern: Pattern, weight: float, x: np.ndarray) -> System | None:
    """The system at a place; None where it is singular or the scene has no meaning."""
    try:
        with np.errstate(all="ignore"):
            found = System(equations, pattern, weight, x)
    except RuntimeError:
        return None
    return found if np.isfinite(found.information).all() and np.isfinite(found.beyond).all() else None


def _moved(system: System, x: np.ndarray, path: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """The unknowns after a step, or after as much of it as makes residuals and rows no larger."""
    equations, pattern = system.equations, system.pattern
    setting, before = equations.setting, _merit(system.r, system.c)
    change = np.zeros_like(x)
    change[pattern.free], change[pattern.numbers] = path, numbers
    change *= setting.scales
    most = _allowed(setting, x, change)
    for _ in range(MOST_HALVINGS):
        after = _merit_at(equations, x + most * change, system.weight)
        if np.isfinite(after) and after <= before * (1 + 1e-6) + 1e-18:
            break
        most *= 0.5
    return x + most * change


def _merit(r: np.ndarray, c: np.ndarray) -> float:
    """Half the sum of squares, and how far rows are from 0."""
    return float(0.5 * r @ r + np.abs(c).sum())


def _merit_at(equations: Equations, x: np.ndarray, weight: float) -> float:
    with np.errstate(all="ignore"):
        c, r = equations.values_at(x)
        return _merit(r * weight, c * equations.row_scales)


def _allowed(setting: Setting, x: np.ndarray, change: np.ndarray) -> float:
    """The part of a step for which masses, and exhaust velocities, stay positive."""
    places = setting.numbers[[j for j, one in enumerate(setting.wanted) if one.inverse]]
    if "mass" in setting.columns:
        places = np.append(places, setting.columns["mass"].indices)
    now, falls = x[places], -change[places]
    far = falls > now * (1 - 1 / FACTOR)
    return float(np.min(now[far] * (1 - 1 / FACTOR) / falls[far], initial=1.0))
