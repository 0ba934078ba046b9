"""Where everything stands in the linear system of a fit, in the order of time."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from dmoc.identification.equations import Equations, layout_nodes


class Pattern:
    """Where the parts of the system stand: unknowns and rows in the order of time, then the numbers."""

    def __init__(self, equations: Equations, free: np.ndarray):
        setting = equations.setting
        self.free, self.numbers = free, setting.numbers
        nodes = np.append(layout_nodes(setting, setting.columns)[free], equations.row_nodes)
        order = np.argsort(nodes, kind="stable")
        self.inner, self.split = len(order), len(free)
        rank = np.empty(self.inner, int)
        rank[order] = np.arange(self.inner)
        # Of every unknown its place in the system; -1 if it is known.
        self.place = np.full(len(setting.scales), -1)
        self.place[free] = rank[: self.split]
        self.place[setting.numbers] = self.inner + np.arange(len(setting.numbers))
        self.row_place = rank[self.split :]
        self.size = self.inner + len(setting.numbers)
        rows, columns = [], []
        for piece in equations.residuals:
            used = np.unique(piece.pattern[1])
            at = self.place[piece.columns[used]]
            rows.append(np.broadcast_to(at[:, None], (len(used), *at.shape)).ravel())
            columns.append(np.broadcast_to(at[None], (len(used), *at.shape)).ravel())
        for piece in equations.rows:
            row, column = piece.pattern
            across, down = self.place[piece.columns[column]].ravel(), self.row_place[piece.targets[row]].ravel()
            rows += [down, across]
            columns += [across, down]
        row, column = np.concatenate([*rows, []]).astype(int), np.concatenate([*columns, []]).astype(int)
        known = (row >= 0) & (column >= 0)
        inside, border = (row < self.inner) & (column < self.inner), (row < self.inner) & (column >= self.inner)
        corner = (row >= self.inner) & (column >= self.inner)
        self.parts = [
            (mask, row[mask], column[mask])
            for mask in (np.flatnonzero(known & part) for part in (inside, border, corner))
        ]

    def matrices(self, values: np.ndarray) -> tuple[sparse.csc_matrix, np.ndarray, np.ndarray]:
        """The banded part, the border and the corner from all entries."""
        found = []
        for i, (mask, row, column) in enumerate(self.parts):
            first = row - self.inner * (i == 2), column - self.inner * (i > 0)
            shape = (
                (self.inner, self.inner)
                if i == 0
                else (self.inner if i == 1 else len(self.numbers), len(self.numbers))
            )
            matrix = sparse.coo_matrix((values[mask], first), shape=shape)
            found.append(matrix.tocsc() if i == 0 else matrix.toarray())
        return tuple(found)  # type: ignore[return-value]

    def vector(self, unknowns: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """A right-hand side from its parts for free unknowns, numbers apart, and rows."""
        found = np.zeros((self.inner, *unknowns.shape[1:]))
        found[self.place[self.free]] = unknowns
        found[self.row_place] = rows
        return found
