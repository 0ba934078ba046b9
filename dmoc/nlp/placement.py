"""Where the stencils of a problem stand on a mesh: the layout of unknowns and rows, and the blocks in it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dmoc.assembly.blocks import Block
from dmoc.guess.chart import Chart
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import Scheme
from dmoc.motion.mesh import node_fractions, node_weights
from dmoc.nlp.layout import LEG_MASS, LEG_START, Layout, Limit, Stencil, Stencils
from dmoc.nlp.lesson import (
    SENSITIVITY,
    SHARE,
    SPREAD,
    at_start,
    limits,
    pairs,
    ways_of,
    with_columns,
)
from dmoc.nlp.stencils import stencils_of
from dmoc.nlp.units import Units
from dmoc.parts.rows import Row
from dmoc.scene.problem import TransferProblem

# A path along which a number moves nothing is taken to begin with as if it moved it by this part of the extent
# [-]: the logarithm of no information has no value.
LEAST = 1e-6
BEGIN = 1e-2


class Placement:
    """The stencils of one problem, put on one mesh."""

    def __init__(
        self,
        problem: TransferProblem,
        stencils: Stencils,
        rule: Scheme,
        hold: bool,
        mesh: np.ndarray,
        units: Units,
        chart: Chart | None = None,
        joined: bool = False,
    ):
        self.problem, self.rule, self.hold, self.mesh, self.units = problem, rule, hold, mesh, units
        self.joined = joined
        self.dynamics = Dynamics.of(problem)
        self.steps = len(mesh) - 1
        self.counts = {"node": self.steps * rule.degree + 1, "step": self.steps, "ends": 1}
        self.columns = self._columns()
        self.rows = Layout()
        self._lower: list[np.ndarray] = []
        self._upper: list[np.ndarray] = []
        # A row of motion is a momentum per unit mass [m/s], of an attitude [m^2/s]; as an impulse over force or
        # torque times time it is near 1.
        body = self.dynamics.configuration
        unit = body.coordinates.sized(units.force, units.torque, units.torque)
        impulse = (problem.mass / (unit * units.time))[None]
        axes = tuple(Row(name, 0, 0.0, 0.0) for name in self.dynamics.configuration.names)
        self._add_rows(Limit("dynamics", "smooth", axes, None), self.counts["node"], impulse)
        if problem.objective.learns:
            self._add_lesson(impulse)
        numbers = {
            "fraction": node_fractions(mesh, rule),
            "weight": node_weights(mesh, rule),
            "begin": mesh[:-1],
            "length": np.diff(mesh),
        } | (chart.numbers() if chart else {})
        self.blocks = [self._block(stencil, numbers) for stencil in stencils.stencils]

    @property
    def row_bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Scaled bounds of all rows."""
        return np.concatenate(self._lower), np.concatenate(self._upper)

    def _columns(self) -> Layout:
        problem, units, nodes = self.problem, self.units, self.counts["node"]
        body, actuator, n = self.dynamics.configuration, problem.actuator, problem.dimension
        lengths = body.coordinates.sized(units.length, 1.0, units.torque * units.time**2)[None]
        paces = units.length / units.time, 1 / units.time, units.torque * units.time
        speeds = body.coordinates.paced(*paces)[None]
        columns = Layout().add("position", "node", body.names, nodes, lengths)
        sizes = np.array([[units.torque if unit == "N m" else units.force for unit in actuator.units(n)]])
        controls = self.steps if self.hold else nodes
        columns = columns.add("force", "control", actuator.labels(n), controls, sizes)
        if body.conditions:
            # The force of the constraint on a quaternion is a torque per unit mass; that of a link is a force
            # unless it keeps an angle.
            turns = np.array([unit == "rad" for link in body.link_units for unit in link], bool)
            linked = np.where(turns, units.torque, units.force)
            reactions = np.append(np.full(body.surplus, units.torque), linked)[None] / problem.mass
            labels = [str(i) for i in range(body.conditions)]
            columns = columns.add("reaction", "node", labels, nodes, reactions)
        if problem.actuator.burns:
            columns = columns.add("mass", "node", ("",), nodes, units.mass)
        elif self.joined:
            columns = columns.add(LEG_MASS, "end", ("",), 1, units.mass)
        if self.joined:
            columns = columns.add(LEG_START, "end", ("",), 1, units.time)
        columns = columns.add("start.velocity", "end", body.velocity_names, 1, speeds)
        columns = columns.add("goal.velocity", "end", body.velocity_names, 1, speeds)
        if problem.free_duration:
            columns = columns.add("duration", "end", ("",), 1, units.time)
        return with_columns(columns, problem, nodes, units.length) if problem.objective.learns else columns

    def _add_lesson(self, impulse: np.ndarray) -> None:
        """The rows of sensitivities, of which those of the goal are free, and of their regression."""
        (motion, scale), *others = limits(self.problem, self.units.length, impulse)
        self._add_rows(motion, self.counts["node"], scale)
        free = slice(-len(motion.rows), None)
        self._lower[-1][free], self._upper[-1][free] = -np.inf, np.inf
        for limit, size in others:
            self._add_rows(limit, 1, size)

    def _add_rows(self, limit: Limit, count: int, scale: Any) -> None:
        labels, units = [row.name for row in limit.rows], [row.unit for row in limit.rows]
        self.rows = self.rows.add(limit.name, limit.kind, labels, count, scale, limit.owner, units)
        scales = self.rows.groups[-1].scales
        self._lower.append((np.array([row.lower for row in limit.rows]) * scales).ravel())
        self._upper.append((np.array([row.upper for row in limit.rows]) * scales).ravel())

    def _block(self, stencil: Stencil, numbers: dict[str, np.ndarray]) -> Block:
        """A stencil with its places on the mesh, after its own rows have been added to the layout."""
        units, count = self.units, self.counts[stencil.every]
        for limit in stencil.limits:
            self._add_rows(limit, count, np.array([[1 / units.of(row.unit) for row in limit.rows]]))

        def stacked(layout: Layout, places: Sequence[tuple[str, slice]]) -> np.ndarray:
            found = [layout[group].indices[:, at] for group, at in places]
            wide = [np.broadcast_to(one, (len(one), count)) if one.shape[1] != count else one for one in found]
            return np.vstack(wide)

        values = [numbers[name][at] for name, at in stencil.numbers]
        return Block(
            stencil.kernel,
            stacked(self.columns, stencil.unknowns),
            stacked(self.rows, stencil.targets),
            np.vstack(values) if values else np.empty((0, count)),
        )


def sensitivities(program: Any, values: dict[str, Any], p: np.ndarray) -> dict[str, np.ndarray]:
    """Sensitivities at all nodes, shape (nodes, ways x axes), shares and spreads, of a path by its unknowns.

    The rows are linear in the sensitivities and as banded as those of motion: one factorisation has them.
    """
    # A scene without `Information` does without SciPy.
    from scipy import sparse
    from scipy.sparse.linalg import splu

    problem, columns, rows = program.problem, program.columns, program.rows
    stencils = stencils_of(problem, program.scheme.order, program.hold)
    placed = Placement(problem, stencils, program.scheme, program.hold, program.mesh, program.units)
    group, targets = columns[SENSITIVITY], rows[SENSITIVITY]
    s = np.zeros((group.count, len(group.labels)))
    s[0] = at_start(problem)
    whole = dict(values) | {SENSITIVITY: s}
    whole |= {name: np.zeros(len(columns[name].labels)) for name in (SHARE, SPREAD)}
    x = np.concatenate([np.ravel(whole[one.name]) for one in columns.groups])
    left, entries = np.zeros(rows.size), []
    for block in placed.blocks:
        known, used = block.kernel.used
        given = x[block.columns], block.values[known], np.tile(p[np.array(used, int)][:, None], block.count)
        np.add.at(left, block.targets, block.kernel.functions["rows"](*given).full())
        row, column = map(np.array, block.kernel.jacobian.get_triplet())
        slopes = block.kernel.functions["jacobian"](*given).full()
        entries.append((slopes.ravel(), block.targets[row].ravel(), block.columns[column].ravel()))
    slopes, row, column = (np.concatenate(side) for side in zip(*entries, strict=True))
    size = len(group.labels)
    down, across = row - targets.start, column - group.start - size
    mine = (down >= 0) & (down < targets.stop - targets.start - size) & (across >= 0) & (column < group.stop)
    count = size * (group.count - 1)
    matrix = sparse.coo_matrix((slopes[mine], (down[mine], across[mine])), shape=(count, count)).tocsc()
    try:
        found = splu(matrix).solve(-left[targets.start : targets.start + count])
    except RuntimeError:
        found = np.zeros(count)
    s[1:] = np.where(np.isfinite(found), found, 0.0).reshape(-1, size)
    shares, spreads = _regressed(program, s)
    length = program.units.length
    return {SENSITIVITY: s, SHARE: shares, SPREAD: np.where(spreads < LEAST * length, BEGIN * length, spreads)}


def fisher(program: Any, path: Any) -> np.ndarray:
    """The mean products of the sensitivities of a path to the start and to the numbers, a symmetric matrix."""
    x = program.pack(path) * program.columns.scales()
    return gram_of(program, program.columns[SENSITIVITY].of(x))


def gram_of(program: Any, s: np.ndarray) -> np.ndarray:
    """The mean products of sensitivities along the path, a symmetric matrix."""
    table = s.reshape(len(s), len(ways_of(program.problem)), -1)
    return np.einsum("k,kia,kja->ij", node_weights(program.mesh, program.scheme), table, table)


def _regressed(program: Any, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The shares of the ways before it in the sensitivity to each number, and the size of what is left [m]."""
    gram, first = gram_of(program, s), 2 * program.problem.dimension
    shares, spreads = np.zeros(len(pairs(program.problem))), []
    for k in range(first, len(gram)):
        share = np.linalg.lstsq(gram[:k, :k], gram[:k, k], rcond=None)[0]
        shares[[i for i, (own, _) in enumerate(pairs(program.problem)) if own == k]] = share
        spreads.append(np.sqrt(max(gram[k, k] - gram[:k, k] @ share, 0.0)))
    return shares, np.array(spreads)
