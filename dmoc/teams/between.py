"""The rows between the bodies of a team, at the nodes that they share and at their common end."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from dmoc.assembly.blocks import Block
from dmoc.assembly.kernel import Kernel, kernel
from dmoc.chains.within import Placed
from dmoc.nlp.layout import Layout
from dmoc.parts.rows import Row
from dmoc.scene.team import Team

# Rows by which free durations are one are in the group of this name.
DURATION = "common duration"


class BetweenBodies:
    """The rows between bodies while they are written down; see `write`."""

    def __init__(self, team: Team, legs: Sequence[Placed], first_row: int):
        self.team, self.legs, self.first_row = team, legs, first_row
        self.rows = Layout()
        self.blocks: list[Block] = []
        self._low: list[np.ndarray] = []
        self._high: list[np.ndarray] = []
        self._kernels: dict[Any, Kernel] = {}
        sides = [leg.program.bounds(leg.program.problem)[:2] for leg in legs]
        self._fixed = np.concatenate([low == high for low, high in sides])

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Scaled bounds of the rows."""
        return np.concatenate([np.empty(0), *self._low]), np.concatenate([np.empty(0), *self._high])

    def write(self) -> None:
        """All rows and their blocks; pairs of one part share a kernel."""
        axes = self.team.dimension
        places, speeds = ca.SX.sym("q", 2 * axes), ca.SX.sym("v", 2 * axes)
        origin = ca.SX.sym("o", axes)
        apart, drift = places[axes:] - places[:axes] + origin, speeds[axes:] - speeds[:axes]
        for name, (part, a, b) in zip(self.team.pair_names(), self.team.pairs(), strict=True):
            gap = self._origin(b) - self._origin(a)
            at = np.vstack([self._places(a), self._places(b)])
            if rows := part.rows(apart):
                made = self._kernel((part, "node"), places, origin, rows)
                self._add(name, "node", rows, at, made, gap)
            if rows := part.goal_rows(apart, drift):
                made = self._kernel((part, "end"), ca.vertcat(places, speeds), origin, rows)
                ends = np.concatenate([at[:, -1], self._speeds(a), self._speeds(b)])
                self._add(name, "end", rows, ends[:, None], made, gap)
        if self.team.free_duration:
            self._durations()

    def _durations(self) -> None:
        """The duration of every other body is that of the first one."""
        lasts = ca.SX.sym("T", len(self.legs))
        rows = [Row(name, lasts[i + 1] - lasts[0], 0.0, 0.0, "s") for i, name in enumerate(self.team.names[1:])]
        at = np.array([int(leg.at("duration", 0)[0]) for leg in self.legs])
        made = self._kernel(DURATION, lasts, ca.SX(0, 1), rows)
        self._add(DURATION, "end", rows, at[:, None], made, np.empty(0))

    def _kernel(self, key: Any, unknowns: ca.SX, numbers: ca.SX, rows: Sequence[Row]) -> Kernel:
        if key not in self._kernels:
            expressions = ca.vertcat(*[ca.SX(row.expression) for row in rows])
            self._kernels[key] = kernel("between", unknowns, numbers, ca.SX(0, 1), expressions, ca.SX(0))
        return self._kernels[key]

    def _add(
        self,
        name: str,
        kind: str,
        rows: Sequence[Row],
        at: np.ndarray,
        made: Kernel,
        gap: np.ndarray,
        late: int = 0,
    ) -> None:
        """A group of rows and its block; `gap` is by how much the origins of two bodies differ [m].

        The first `late` of them ask for nothing.
        """
        units, count = self.legs[0].program.units, at.shape[1]
        scale = np.array([[1 / units.of(row.unit) for row in rows]])
        low, high = (
            np.repeat(np.array([[getattr(row, side) for row in rows]]) * scale, count, axis=0)
            for side in ("lower", "upper")
        )
        # Where every unknown of a row is fixed none is left to meet it: the team was checked when it was made.
        row, column = (np.array(part, int) for part in made.jacobian.get_triplet())
        loose = np.zeros((len(rows), count), bool)
        np.logical_or.at(loose, row, ~self._fixed[at[column]])
        loose[:, :late] = False
        low[~loose.T], high[~loose.T] = -np.inf, np.inf
        labels, told = [row.name for row in rows], [row.unit for row in rows]
        self.rows = self.rows.add(name, kind, labels, count, scale, None, told)
        self._low.append(low.ravel())
        self._high.append(high.ravel())
        targets = self.first_row + self.rows[name].indices
        self.blocks.append(Block(made, at, targets, np.repeat(gap[:, None], count, axis=1)))

    def _origin(self, body: int) -> np.ndarray:
        """Where the places of a body are counted from [m]."""
        program = self.legs[body].program
        return program.units.origin[program.dynamics.configuration.coordinates.places]

    def _places(self, body: int) -> np.ndarray:
        """The unknowns that are places of a body, shape (axes, nodes)."""
        leg = self.legs[body]
        made = leg.program.dynamics.configuration.coordinates
        return leg.columns + leg.program.columns["position"].indices[made.places]

    def _speeds(self, body: int) -> np.ndarray:
        """The unknowns that are its velocity at the end, shape (axes,)."""
        leg = self.legs[body]
        made = leg.program.dynamics.configuration.coordinates
        return leg.at("goal.velocity", 0)[made.speeds]
