"""What a path cuts off its limits between the places where their rows act, and what that is worth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import casadi as ca
import numpy as np

from dmoc.basics.memory import remembered
from dmoc.basics.numerics import columns
from dmoc.basics.quaternions import normalised
from dmoc.basics.records import dataclass
from dmoc.configurations.acting import state_symbols
from dmoc.meshes.cuts import PARTS
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_weights
from dmoc.motion.momenta import end_momenta, node_velocities, rates_along, velocity_along
from dmoc.motion.path import POSITION_BOUNDS, DiscretePath, Key
from dmoc.motion.scales import least_extent, path_scales
from dmoc.parts.constraint import Constraint
from dmoc.results.between import inside_gaps
from dmoc.results.facts import Error
from dmoc.scene.problem import TransferProblem

# What is cut off between nodes is to come down to this part of a tolerance [-].
SHARE = 0.5


@dataclass(frozen=True)
class CutOff:
    """What a path cuts off its limits between the places where their rows act.

    Attributes
    ----------
    cost : float
        What it would cost more to keep them there too, to first order, in the objective's own unit.
    steps : array, shape (steps,)
        What each step adds to that; a place between two steps counts for both.
    depth : array, shape (steps,)
        How far each step is beyond a limit on place or attitude, of the extent or the turn of the path [-].
    """

    cost: float
    steps: np.ndarray
    depth: np.ndarray

    def of(self, cost: float) -> CutOff:
        """The same as parts of a cost [-]."""
        return replace(self, cost=self.cost / cost, steps=self.steps / cost)

    def counted(self, error: Error) -> Error:
        """An error by what changed from mesh to mesh, or by what is cut off if that is more.

        What is left of such a change may be the same error, so that the two do not add up.
        """
        path, cost = float(self.depth.max()), self.cost
        return replace(error, path=max(error.path, path), objective=max(error.objective, cost))

    def parts(self, tol: float) -> np.ndarray:
        """Into how many parts to cut each step, so that what is cut off falls below a tolerance.

        It falls with the square of the length of the steps.
        """
        over = self.heavy(tol) / (SHARE * tol)
        return np.clip(np.ceil(np.sqrt(over)), 1, PARTS).astype(int)

    def heavy(self, tol: float) -> np.ndarray:
        """What each step cuts off; 0 for those that together make little of a tolerance."""
        order = np.argsort(self.steps)
        counts = np.empty(len(order), bool)
        counts[order] = np.cumsum(self.steps[order]) > SHARE * tol
        return np.maximum(np.where(counts, self.cost, 0.0), np.where(self.depth > SHARE * tol, self.depth, 0.0))


class _Samples(NamedTuple):
    """Times [s], coordinates, their slopes and masses at all nodes and in equally many places between them."""

    time: np.ndarray
    position: np.ndarray
    slope: np.ndarray
    mass: np.ndarray


def cut_off(problem: TransferProblem, dynamics: Dynamics, path: DiscretePath, start_time: float) -> CutOff:
    """What a path cuts off its limits between the places where their rows act.

    A path that touches a zone at one node may pass through it beside that node, on all meshes that have the
    node: no change from mesh to mesh tells. Rows that are tighter by as much as the path breaks them beside a
    node would keep it out, and the multipliers are the derivatives of the objective by the rows.
    """
    steps, gaps = len(path.mesh) - 1, len(path.position) - 1
    cost, shares, depth = 0.0, np.zeros(steps), np.zeros(steps)
    if not problem.constraints or not path.multipliers:
        return CutOff(cost, shares, depth)
    samples = _sampled(problem, dynamics, path, start_time)
    scales = path_scales(path, least_extent(problem.mass, problem.inertia))
    sizes = {"m": scales.extent, "rad": scales.turn, "degrees": np.degrees(scales.turn)}
    for i, constraint in enumerate(problem.constraints):
        beyond = deepest(_beyond(constraint, dynamics, samples)[:, None], gaps)[:, 0]
        beyond = beyond.reshape(steps, -1).max(axis=1)
        depth = np.maximum(depth, beyond / sizes.get(constraint.unit, np.inf))
        for worth, broken in _rows(problem, i, dynamics, path, samples):
            if len(worth) == steps:
                # A speed is broken along a way, and not at one place.
                over = np.maximum(broken[:-1], 0.0).reshape(steps, -1, worth.shape[1]).mean(axis=1)
                cost, shares = cost + float((worth * over).sum()), shares + (worth * over).sum(axis=1)
                continue
            paid, mine = paid_at_nodes(worth, deepest(broken, gaps), steps)
            cost, shares = cost + paid, shares + mine
    return CutOff(cost, shares, depth)


def paid_at_nodes(worth: np.ndarray, deep: np.ndarray, steps: int) -> tuple[float, np.ndarray]:
    """What it costs to keep rows beside their nodes, too, and what each step adds to that.

    By what each row is worth at each node, and how much it is broken in each gap between two nodes.
    """
    beside = np.maximum(np.pad(deep, ((1, 0), (0, 0))), np.pad(deep, ((0, 1), (0, 0))))
    shares = ((worth[1:] + worth[:-1]) * deep).sum(axis=1).reshape(steps, -1).sum(axis=1)
    return float((worth * beside).sum()), shares


def _sampled(problem: TransferProblem, dynamics: Dynamics, path: DiscretePath, start_time: float) -> _Samples:
    """The path inside the gaps between its nodes."""
    _, ends = end_momenta(dynamics, path, start_time)
    at_ends = path.position[:: path.order // 2]
    slopes = node_velocities(path, velocity_along(dynamics, at_ends, ends))
    longest = float(np.linalg.norm(np.diff(path.place, axis=0), axis=1).max(initial=0.0))
    smallest = min(constraint.feature() for constraint in problem.constraints)
    inside, _, moving, _ = inside_gaps(smallest, path, path.position, slopes, longest)
    for at in path.coordinates.quaternions:
        inside[:, at] = normalised(inside[:, at])
    parts = (len(inside) - 1) // (len(path.position) - 1)
    fractions = np.interp(np.arange(len(inside)) / parts, np.arange(len(path.position)), path.fractions)
    mass = np.interp(fractions, path.fractions, path.mass)
    return _Samples(start_time + path.duration * fractions, inside, moving, mass)


def _beyond(constraint: Constraint, dynamics: Dynamics, samples: _Samples) -> np.ndarray:
    """By how much a constraint is broken along the path, in its unit."""
    made, q = dynamics.configuration.coordinates, samples.position
    if constraint.limits_joint:
        seen, _ = constraint.seen_of(made, q, np.zeros_like(q))
        return constraint.excess(seen, seen)
    rates = rates_along(dynamics, q, samples.slope)
    return constraint.excess_at(samples.time, *constraint.seen_of(made, q, rates))


def _rows(
    problem: TransferProblem, index: int, dynamics: Dynamics, path: DiscretePath, samples: _Samples
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """What the rows and bounds of a constraint are worth, and by how much samples break them.

    Of shape (nodes, rows) or (steps, rows), and (samples, rows).
    """
    constraint, weights = problem.constraints[index], node_weights(path.mesh, scheme(path.order))[:, None]
    make = partial(_functions, constraint, dynamics, None if path.hold else problem.controls)
    functions = remembered(make, "limits along a path", dynamics.configuration, constraint, path.hold)
    for kind, (function, low, high) in functions.items():
        density = path.multipliers.get(Key(kind, "row", constraint.title(index)))
        if density is None:
            continue
        given = samples.time, samples.position.T, samples.slope.T, samples.mass
        worth = weights * np.abs(density) if kind == "node" else _over_steps(path, np.abs(density), len(low))
        yield worth, outside(columns(function, *given)[0].T, low, high)
    for at, low, high in _walls(constraint, path):
        worth = weights * np.abs(path.multipliers[POSITION_BOUNDS])[:, at]
        # At the ends, bounds hold fixed positions.
        worth[[0, -1]] = 0.0
        yield worth, outside(samples.position[:, at], low, high)


def _functions(
    constraint: Constraint, dynamics: Dynamics, controls: int | None
) -> dict[str, tuple[ca.Function, np.ndarray, np.ndarray]]:
    """The rows of a constraint and their bounds, by where they act; those that look at controls never break."""
    body = dynamics.configuration
    t, q, v, m = state_symbols(body.size)
    u = None if controls is None else ca.SX.sym("u", controls)
    at, found = body.at(q, v, m), {}
    for kind, rows in (("node", constraint.rows_at(t, at, u, m)), ("step", constraint.speed_rows_at(at))):
        if not rows:
            continue
        low, high = (np.array([getattr(row, side) for row in rows], float) for side in ("lower", "upper"))
        values = [
            np.clip(0.0, *limits) if u is not None and ca.depends_on(row.expression, u) else row.expression
            for row, limits in zip(rows, zip(low, high, strict=True), strict=True)
        ]
        found[kind] = ca.Function(kind, [t, q, v, m], [ca.densify(ca.SX(ca.vertcat(*values)))]), low, high
    return found


def _over_steps(path: DiscretePath, density: np.ndarray, rows: int) -> np.ndarray:
    """What rows at the Gauss points of each step are worth together, shape (steps, rows)."""
    return np.diff(path.mesh)[:, None] * density.reshape(len(density), -1, rows).sum(axis=1)


def _walls(constraint: Constraint, path: DiscretePath) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Places that a constraint sets bounds on: which coordinates, and the bounds."""
    made = path.coordinates
    at = np.flatnonzero(made.places & made.of_body(constraint.on)[0])
    low, high = constraint.bounds(len(at)) if len(at) else (np.empty(0), np.empty(0))
    if np.isfinite([low, high]).any() and POSITION_BOUNDS in path.multipliers:
        yield at, low, high


def outside(values: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """By how much values are outside of bounds, negative inside."""
    return np.maximum(low - values, values - high)


def deepest(broken: np.ndarray, gaps: int) -> np.ndarray:
    """The most that each gap breaks, at least 0, by parabolas through three samples each; shape (gaps, rows).

    A path that touches a zone at a node may be inside it for less than the distance of two samples.
    """
    inner = broken[:-1].reshape(gaps, -1, broken.shape[1])
    each = np.concatenate([inner, np.append(inner[1:, 0], broken[-1:], axis=0)[:, None]], axis=1)
    before, here, after = each[:, :-2], each[:, 1:-1], each[:, 2:]
    bend, slope = 0.5 * (before + after) - here, 0.5 * (after - before)
    # The top of a parabola, or the sample towards it if it lies beyond.
    at = slope / np.maximum(np.maximum(2 * np.abs(bend), np.abs(slope)), np.finfo(float).tiny)
    peak = np.where(bend < 0, here + slope * at + bend * at**2, 0.0)
    return np.maximum(np.maximum(each.max(axis=1), peak.max(axis=1)), 0.0)
