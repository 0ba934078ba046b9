"""The sensitivities of a path to unknown numbers, as unknowns of the NLP with rows of their own.

The derivative of every row of motion along a change of the numbers, or of the state at the start, is a row of
the same stencil, exact and as local as that is. `Information` looks at what of the sensitivity to a number no
change of the start, and of no number before it, brings about: at the residual of a regression, whose
coefficients and root mean square are unknowns, too, few of them, to whose rows every node adds. Its square is a
pivot of the Fisher information, that of the last number beside all others what is left of it; as unknowns
pivots stay positive.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from dmoc.nlp.layout import Layout, Limit
from dmoc.parts.largest import AXES, MASS, constants_of
from dmoc.parts.rows import Row

# The groups of unknowns, and of the rows that say what they are.
SENSITIVITY, SHARE, SPREAD = "sensitivity", "share", "spread"


def ways_of(problem: Any) -> tuple[str, ...]:
    """What the path is varied by: position and velocity at the start along each axis, then the numbers.

    A velocity counts in the length over the duration, a number relative to itself; all sensitivities are
    lengths, those to the start per length.
    """
    axes = AXES[: problem.dimension]
    starts = [f"start.{kind}.{axis}" for kind in ("position", "velocity") for axis in axes]
    return (*starts, *problem.objective.learns)


def pairs(problem: Any) -> list[tuple[int, int]]:
    """A number, and a way before it whose share in its sensitivity is taken away, as places in `ways_of`."""
    first = 2 * problem.dimension
    return [(k, j) for k in range(first, len(ways_of(problem))) for j in range(k)]


class Lesson:
    """Sensitivities while the stencils of a problem are written down; `writer` has its symbols."""

    def __init__(self, writer: Any):
        self.writer, self.problem = writer, writer.problem
        self.count, self.axes = len(ways_of(self.problem)), self.problem.dimension

    def extend(self, draft: Any, every: str) -> None:
        """Add to a stencil the derivatives of its rows of motion, and what it adds to the products."""
        size = self.count * self.axes
        places = [
            (place, ca.reshape(draft.take(SENSITIVITY, size, at), self.axes, self.count))
            for place, at in draft.unknowns("position")
        ]
        for rows, at in draft.rows_of("dynamics"):
            if every == "ends" and at.start != 0:
                # The velocity at the goal follows from the others: its row is left free.
                continue
            changes = [self._along(way, rows, places, draft) for way in range(self.count)]
            draft.add(SENSITIVITY, ca.vertcat(*changes), at)
        if every == "node":
            self._regress(draft, places[0][1])
        if every == "ends":
            spreads = draft.take(SPREAD, len(self.problem.objective.learns))
            draft.add(SPREAD, spreads**2)
            objective = self.writer.objective
            draft.cost += objective.sense * objective.told(spreads, draft.duration())

    def _regress(self, draft: Any, s: Any) -> None:
        """The part of one node in the normal equations of the regression, and in its mean squares."""
        both, weight = pairs(self.problem), draft.number("weight")
        shares = draft.take(SHARE, len(both))
        left = {k: s[:, k] for k, _ in both}
        for i, (k, j) in enumerate(both):
            left[k] = left[k] - shares[i] * s[:, j]
        draft.add(SHARE, ca.vertcat(*[weight * ca.dot(s[:, j], left[k]) for k, j in both]))
        draft.add(SPREAD, ca.vertcat(*[-weight * ca.dot(each, each) for each in left.values()]))

    def _along(self, way: int, rows: Any, places: list, draft: Any) -> Any:
        """The derivative of rows of motion along one way."""
        changes = [(place, s[:, way]) for place, s in places]
        axis = way - self.axes
        if 0 <= axis < self.axes:
            speeds = [speed for speed, _ in draft.unknowns("start.velocity")]
            changes += [(speed, ca.DM.eye(self.axes)[:, axis] / draft.duration()) for speed in speeds]
        if way >= 2 * self.axes:
            changes += self._of_number(self.problem.objective.learns[way - 2 * self.axes], draft)
        return sum((ca.jtimes(rows, symbol, change) for symbol, change in changes), ca.SX(rows.numel(), 1))

    def _of_number(self, name: str, draft: Any) -> list[tuple[Any, Any]]:
        """The symbols that change with a number, each by as much as the number is large."""
        if name == MASS:
            # What burns away is the same whatever the mass was.
            masses = [symbol for symbol, _ in draft.unknowns("mass")]
            return [(symbol, self.writer.mass) for symbol in (self.writer.mass, *masses)]
        one = next(one for one in constants_of(self.problem.effects) if one.name == name)
        symbol: Any = self.writer.effects[one.effect]
        for part in one.field.split("."):
            symbol = getattr(symbol, part)
        only = ca.DM(np.eye(symbol.numel())[:, one.entry])
        return [(symbol, symbol * only)]


def with_columns(columns: Layout, problem: Any, nodes: int, length: float) -> Layout:
    """The layout with sensitivities, shares and spreads behind."""
    scales, axes = _scales(problem, length), AXES[: problem.dimension]
    labels = [f"{way}.{axis}" for way in ways_of(problem) for axis in axes]
    columns = columns.add(SENSITIVITY, "node", labels, nodes, np.repeat(scales, len(axes))[None])
    sizes = np.array([[scales[k] / scales[j] for k, j in pairs(problem)]])
    columns = columns.add(SHARE, "end", _pair_labels(problem), 1, sizes)
    return columns.add(SPREAD, "end", problem.objective.learns, 1, length)


def limits(problem: Any, length: float, impulse: np.ndarray) -> list[tuple[Limit, Any]]:
    """The groups of rows of sensitivities, shares and spreads, and their scales."""
    scales, size = _scales(problem, length), problem.dimension
    labels = [f"{way}.{axis}" for way in ways_of(problem) for axis in AXES[:size]]
    per = np.repeat(length / scales, size) * np.tile(np.ravel(impulse), len(scales))
    products = np.array([[scales[k] * scales[j] for k, j in pairs(problem)]])
    found = [
        (SENSITIVITY, "smooth", labels, per[None]),
        (SHARE, "end", _pair_labels(problem), 1 / products),
        (SPREAD, "end", problem.objective.learns, length**-2),
    ]
    return [
        (Limit(name, kind, tuple(Row(label, 0, 0.0, 0.0) for label in each), None), scale)
        for name, kind, each, scale in found
    ]


def _scales(problem: Any, length: float) -> np.ndarray:
    starts = 2 * problem.dimension
    return np.append(np.ones(starts), np.full(len(ways_of(problem)) - starts, length))


def _pair_labels(problem: Any) -> list[str]:
    ways = ways_of(problem)
    return [f"{ways[k]} of {ways[j]}" for k, j in pairs(problem)]


def at_start(problem: Any) -> np.ndarray:
    """The sensitivities at the start, one way after the other."""
    found = np.zeros((len(ways_of(problem)), problem.dimension))
    found[: problem.dimension] = np.eye(problem.dimension)
    return found.ravel()
