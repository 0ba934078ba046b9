"""What the symmetries of a scene keep constant along an optimal path: Noether's theorem of the costates."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmoc.basics.records import dataclass
from dmoc.configurations.coordinates import PLACE
from dmoc.sensitivity.optimum import Optimum
from dmoc.sensitivity.worth import conditions_of, per

# A motion of the whole scene is a symmetry if it changes no part of the Lagrangian by more than this, relative
# to the largest [-]; multipliers of limits that do not act are not quite zero.
SAME = 1e-7
# Entries of a symmetry below this part of its largest one are rounding [-].
ROUND = 1e-6


@dataclass(frozen=True)
class Symmetry:
    """A motion of the whole scene that changes nothing, and what it keeps constant.

    Attributes
    ----------
    words : str
        The motion: along a direction, or a turn about a point or an axis.
    value : float
        The momentum of the costates, the same at all step ends: the derivative of the objective by the motion
        of the goal alone, its position and velocity.
    unit : str
        Of the value.
    drift : float
        By how much it changes along the path, relative to the largest of its terms [-].
    """

    words: str
    value: float
    unit: str
    drift: float


def symmetries(solution: Any) -> tuple[Symmetry, ...]:
    """The motions of space that leave a scene as it is along a path, each with its constant.

    The Lagrangian of the discrete control problem is a sum over steps. Where a translation or a rotation of
    positions, forces and costates together leaves each term as it is, the sum over the last node of a step of
    derivative times motion, in the continuous problem q x p_q + v x p_v, is the same for all steps: the
    discrete Noether theorem (Marsden, West, Discrete mechanics and variational integrators, 2001, part 1) for
    the Lagrangian of the optimal control problem. What is symmetric is found from the terms themselves.

    Parameters
    ----------
    solution : Solution
        A local optimum of a transfer, with its problem; one of other than a single body that does not turn has
        none here.

    Raises
    ------
    ValueError
        If the solution is no optimum, or does not hold its problem.
    """
    optimum = conditions_of(solution).optimum
    program = optimum.program
    blocks = getattr(program, "dynamics", None) and program.dynamics.configuration.coordinates.blocks
    if not blocks or len(blocks) != 1 or blocks[0].kind != PLACE or program.dynamics.configuration.conditions:
        return ()
    size = max(solution.path.diagonal, 1e-300)
    motions = _motions(solution.dimension, size)
    changes, ends, scale = _changes(optimum, motions)
    _, values, ways = np.linalg.svd(np.linalg.qr(changes / max(scale.max(), 1e-300), mode="r"))
    values = np.append(values, np.zeros(len(motions) - len(values)))
    found = []
    for way in _reduced(ways[values < SAME * np.sqrt(len(changes))]):
        words, unit, factor = _named(way, motions, size)
        if not words:
            continue
        along, largest = ends @ way / factor, np.abs(way) @ scale / factor
        drift = float(np.ptp(along) / largest) if largest else 0.0
        cost = solution.provenance.objective_unit
        value = float(np.mean(along)) * optimum.sense
        found.append(Symmetry(words, value, per(cost, unit), drift))
    return tuple(found)


def _motions(axes: int, size: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Translations by the size of the path and rotations about the origin: shift and matrix of each."""
    nothing = np.zeros((axes, axes))
    found = [(size * shift, nothing) for shift in np.eye(axes)]
    for i, j in [(0, 1), (1, 2), (2, 0)][: {1: 0, 2: 1, 3: 3}[axes]]:
        turn = nothing.copy()
        turn[j, i], turn[i, j] = 1.0, -1.0
        found.append((np.zeros(axes), turn))
    return found


def _changes(optimum: Optimum, motions: list) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """By how much each motion changes each term of the Lagrangian; its part at step ends; its largest."""
    program = optimum.program
    nodes, degree = program.columns["position"].count, program.scheme.degree
    moved = [_moved(optimum, *motion) for motion in motions]
    node = np.full(program.columns.size, -1)
    of_row = np.full(program.rows.size, -1)
    for name in ("position", "force"):
        group = program.columns[name]
        if group.count == nodes:
            node[group.indices] = np.arange(nodes)
    of_row[program.rows["dynamics"].indices] = np.arange(nodes)
    changes, largest = [], np.zeros(len(motions))
    ends = np.zeros((len(program.mesh) - 1, len(motions)))
    for block, given in optimum.given():
        slope, rows = (part.full() for part in block.kernel.slope(*given)[:2])
        if block.count == 1:
            # The ends are what they are: a path need not end where it would after the motion.
            continue
        parts = [np.vstack([slope * x[block.columns], rows * lam[block.targets]]) for x, lam in moved]
        largest = np.maximum(largest, [np.abs(part).max(initial=0.0) for part in parts])
        at = np.vstack([node[block.columns], of_row[block.targets]])
        inner = slice(1, -1) if block.count == nodes else slice(None)
        changes.append(np.stack([part.sum(axis=0)[inner] for part in parts], axis=1))
        if block.count == len(ends):
            last = at == degree * np.arange(1, len(ends) + 1)
            ends += np.stack([(part * last).sum(axis=0) for part in parts], axis=1)
    # Bounds of positions and forces are terms, too; both ends are fixed, or not, as they are.
    lam_x = optimum.lam_x * optimum.cost / optimum.column_scales
    for name, inside in (("position", slice(1, -1)), ("force", slice(None))):
        group = program.columns[name]
        felt = [(group.of(lam_x) * group.of(x))[inside].sum(axis=1) for x, _ in moved]
        changes.append(np.stack(felt, axis=1))
    return np.vstack(changes), ends, largest


def _moved(optimum: Optimum, shift: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What a motion does to all unknowns and to all multipliers of rows [SI]."""
    program, axes = optimum.program, len(shift)
    x, lam = np.zeros(program.columns.size), np.zeros(program.rows.size)
    values, multipliers = optimum.x * optimum.column_scales, optimum.lam_g * optimum.row_scales * optimum.cost
    place, force = program.columns["position"], program.columns["force"]
    x[place.indices] = shift[:, None] + turn @ (place.of(values) + program.units.origin).T
    if force.labels[:axes] == tuple("xyz"[:axes]):
        x[force.indices[:axes]] = turn @ force.of(values)[:, :axes].T
    rows = program.rows["dynamics"]
    lam[rows.indices] = turn @ rows.of(multipliers).T
    return x, lam


def _reduced(ways: np.ndarray) -> np.ndarray:
    """Another basis of the same space, with as many zeros as there can be: rotations, then translations."""
    ways = ways[:, ::-1].copy()
    row = 0
    for column in range(ways.shape[1]):
        if row == len(ways):
            break
        pivot = row + int(np.argmax(np.abs(ways[row:, column])))
        if abs(ways[pivot, column]) < ROUND:
            continue
        ways[[row, pivot]] = ways[[pivot, row]]
        ways[row] /= ways[row, column]
        others = np.arange(len(ways)) != row
        ways[others] -= np.outer(ways[others, column], ways[row])
        row += 1
    ways[np.abs(ways) < ROUND] = 0.0
    return ways[:, ::-1]


def _named(way: np.ndarray, motions: list, size: float) -> tuple[str, str, float]:
    """A motion in words, its unit, and how many of that unit it is; no words for a screw, which is no symmetry.

    Where a path touches a few zones, some screw keeps the distances at these few nodes by chance.
    """
    shift = sum(part * motion[0] for part, motion in zip(way, motions, strict=True))
    turn = sum(part * motion[1] for part, motion in zip(way, motions, strict=True))
    axes = len(shift)
    if not np.any(turn):
        return f"moved along {_vector(shift / np.linalg.norm(shift))}", "m", float(np.linalg.norm(shift))
    # The point nearest to the origin that the turn leaves where it is, but for a screw along its axis.
    still = -np.linalg.pinv(turn) @ shift
    still[np.abs(still) < ROUND * size] = 0.0
    speed = float(np.linalg.norm(turn) / np.sqrt(2))
    if axes == 2:
        return f"turned about {_vector(still)} m", "rad", float(turn[1, 0])
    axis = np.array([turn[2, 1], turn[0, 2], turn[1, 0]]) / speed
    if np.linalg.norm(shift + turn @ still) > ROUND * size * speed:
        return "", "rad", speed
    return f"turned about the axis {_vector(axis)} through {_vector(still)} m", "rad", speed


def _vector(values: np.ndarray) -> str:
    return f"({', '.join(f'{value + 0.0:.4g}' for value in values)})"
