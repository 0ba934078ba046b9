"""The least-squares problem of a flight: discrete equations as rows, and what was measured as residuals.

Both are made of small functions with their first derivatives, evaluated many times and scattered.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.memory import Shelf
from dmoc.basics.numerics import nonzeros_of
from dmoc.identification.setting import Setting

# Groups of these kinds count steps, others nodes.
OF_STEPS = ("control", "step", "between")
# So many functions are held in this process: flights of one kind share them.
_FUNCTIONS = Shelf(60)


@dataclass(frozen=True)
class Piece:
    """A function of some unknowns, evaluated `count` times, and where unknowns and results stand.

    Attributes
    ----------
    functions : pair of Function
        (unknowns, numbers) of all evaluations -> results; and beside them structural nonzeros of the Jacobian.
    pattern : tuple of arrays
        Row and column of each nonzero.
    columns : int array, shape (unknowns, count)
    targets : int array, shape (results, count)
        Results of one place are added up.
    numbers : array, shape (numbers, count)
    """

    functions: tuple[ca.Function, ca.Function]
    pattern: tuple[np.ndarray, np.ndarray]
    columns: np.ndarray
    targets: np.ndarray
    numbers: np.ndarray

    @property
    def results(self) -> int:
        """How many results an evaluation has."""
        return len(self.targets)

    def values(self, x: np.ndarray) -> np.ndarray:
        """Results, one column an evaluation."""
        return self.functions[0](x[self.columns], self.numbers).full()

    def at(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Results and nonzeros of the Jacobian, one column an evaluation."""
        values, slopes = self.functions[1](x[self.columns], self.numbers)
        return values.full(), slopes.full()


def made(
    key: tuple, count: int, write: Callable[[], tuple[Sequence[ca.SX], Sequence[ca.SX], ca.SX]]
) -> tuple[tuple[ca.Function, ca.Function], tuple[np.ndarray, np.ndarray]]:
    """The functions of a piece and its pattern; `write` gives its unknowns, its numbers and its results.

    `key` must tell it from all others; objects in it are held, so that no other gets their identity.
    """

    def make() -> tuple:
        unknowns, numbers, results = write()
        z, d, r = ca.vertcat(*unknowns), ca.vertcat(*numbers), ca.densify(ca.SX(results))
        slopes = ca.jacobian(r, z)
        row, column = slopes.sparsity().get_triplet()
        outputs = [r], [r, nonzeros_of(slopes)]
        functions = tuple(ca.Function("piece", [z, d], each).map(count) for each in outputs)
        return functions, (np.array(row, int), np.array(column, int)), key

    name = tuple(part if isinstance(part, (str, int, bytes, float, tuple)) else id(part) for part in key)
    return _FUNCTIONS.get((*name, count), make)[:2]


def values(pieces: Sequence[Piece], x: np.ndarray, count: int) -> np.ndarray:
    """The results of all pieces."""
    total = np.zeros(count)
    for piece in pieces:
        np.add.at(total, piece.targets, piece.values(x))
    return total


@dataclass
class Equations:
    """Rows that hold and residuals that are to be small, of all unknowns in SI units.

    Attributes
    ----------
    rows, residuals : list of Piece
    labels : list of (str, array)
        Of each kind of residual its name and where it stands, shape (entries, count).
    missing : int
        How many residuals stand for what was not measured.
    """

    setting: Setting
    rows: list[Piece] = field(default_factory=list)
    residuals: list[Piece] = field(default_factory=list)
    labels: list[tuple[str, np.ndarray]] = field(default_factory=list)
    row_count: int = 0
    missing: int = 0
    row_scales: np.ndarray = field(default_factory=lambda: np.empty(0))
    row_nodes: np.ndarray = field(default_factory=lambda: np.empty(0))

    @property
    def count(self) -> int:
        """Number of residuals."""
        return sum(places.size for _, places in self.labels)

    def add_rows(
        self, part: tuple, columns: np.ndarray, numbers: np.ndarray, nodes: np.ndarray, scale: float
    ) -> None:
        """Rows of their own; `nodes` is where on the path each evaluation stands."""
        results = part[0][0].size1_out(0)
        targets = self.row_count + np.arange(results * columns.shape[1]).reshape(-1, results).T
        self.rows.append(Piece(part[0], part[1], columns, targets, numbers))
        self.row_count += targets.size
        self.row_scales = np.append(self.row_scales, np.full(targets.size, scale))
        self.row_nodes = np.append(self.row_nodes, np.repeat(nodes, results))

    def add_residuals(
        self, name: str, part: tuple, columns: np.ndarray, numbers: np.ndarray, missing: int = 0
    ) -> None:
        """Residuals over their standard deviations, of which so many are 0 since an axis was not measured."""
        self.missing += missing
        results = part[0][0].size1_out(0)
        targets = self.count + np.arange(results * columns.shape[1]).reshape(-1, results).T
        self.residuals.append(Piece(part[0], part[1], columns, targets, numbers))
        self.labels.append((name, targets))

    def values_at(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows and residuals alone."""
        return values(self.rows, x, self.row_count), values(self.residuals, x, self.count)

    def with_numbers(self, columns: np.ndarray) -> np.ndarray:
        """Places of unknowns, with those of all numbers below."""
        numbers = np.broadcast_to(self.setting.numbers[:, None], (len(self.setting.wanted), columns.shape[1]))
        return np.vstack([columns, numbers])


def add_motion(equations: Equations) -> None:
    """The discrete Euler-Lagrange equations, whose parameters are the numbers of the scene."""
    setting = equations.setting
    held = setting.held
    place = np.cumsum(held) - 1
    for block in setting.blocks:
        known, used = block.kernel.used
        inside = block.first + np.array(used, int)
        rows = np.flatnonzero(held[block.targets].all(axis=1))
        if not len(rows):
            continue
        inverted = [(j, int(at)) for j, place in setting.inverted for at in np.flatnonzero(inside == place)]
        slopes = setting.slopes[inside]

        def write(
            block: Any = block, rows: Any = rows, inverted: Any = inverted, slopes: Any = slopes
        ) -> tuple:
            z, p = ca.SX.sym("z", len(block.columns)), ca.SX.sym("p", len(slopes))
            d, theta = ca.SX.sym("d", len(block.kernel.used[0])), numbers_of(setting)
            values = block.kernel.functions["rows"](z, d, scene_numbers(p, inverted, slopes, theta))
            return [z, theta], [d, p], values[rows.tolist()]

        key = "motion", block.kernel, len(setting.wanted), kinds_of(setting), slopes.tobytes(), rows.tobytes()
        base = setting.parameters[inside] - slopes @ [one.begin for one in setting.wanted]
        numbers = np.vstack([block.values[known], np.tile(base[:, None], block.count)])
        columns = equations.with_numbers(block.columns)
        equations.rows.append(
            Piece(*made(key, block.count, write), columns, place[block.targets[rows]], numbers)
        )
    equations.row_count = int(held.sum())
    equations.row_scales = setting.row_scales[held]
    equations.row_nodes = layout_nodes(setting, setting.rows)[held]


def kinds_of(setting: Setting) -> tuple:
    return tuple(one.kind for one in setting.wanted)


def numbers_of(setting: Setting) -> ca.SX:
    """Symbols of the numbers."""
    return ca.SX.sym("theta", len(setting.wanted))


def scene_numbers(base: Any, inverted: Any, slopes: np.ndarray, theta: ca.SX) -> Any:
    """Parameters of the scene with the numbers in them, from those where the numbers are 0."""
    p = ca.SX(base + ca.sparsify(ca.DM(slopes)) @ theta)
    for j, place in inverted:
        p[place] = 1 / theta[j]
    return p


def layout_nodes(setting: Setting, layout: Any) -> np.ndarray:
    """The node at which each unknown or row of the path stands."""
    last = setting.steps * setting.degree
    found = np.zeros(layout.size)
    for group in layout.groups:
        many = np.arange(group.count) * (setting.degree if group.kind in OF_STEPS else 1.0)
        ends = last if group.name.startswith("goal") else 0.0
        found[group.indices] = ends if group.kind == "end" else many
    return found


def residual_parts(equations: Equations, r: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Residuals over their standard deviations by kind, one row an evaluation."""
    for name, places in equations.labels:
        yield name, r[places].T
