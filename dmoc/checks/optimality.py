"""Whether a path and its multipliers are a stationary point of its own discrete problem."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.basics.numerics import columns
from dmoc.basics.records import dataclass
from dmoc.checks.evidence import Evidence
from dmoc.motion.mesh import node_weights
from dmoc.nlp.program import Program
from dmoc.nlp.solving import NLP
from dmoc.nlp.transcription import unassembled
from dmoc.nlp.units import units_of

# Where a node has less than this part of the mean share of the time, it counts as that [-]: the solver ends
# with about the same error in every derivative, which divided by the shortest steps at a switch says nothing.
SHORT = 0.1


@dataclass(frozen=True)
class Stationarity:
    """The errors of the first-order conditions, each relative to the objective or the force [-].

    Attributes
    ----------
    force : float
        Derivative of the Lagrangian along the controls: for least effort |lambda + m F| over the force.
    path : float
        The same along positions, masses and ends: the defect of the costate equations, summed up
        along the path as errors are. Entries that are fixed count: their multipliers are the
        derivatives of the objective by the boundary data.
    limits : float
        Multipliers of limits that do not act, or of the wrong sign, times the distance from the limit.
    objective : float
        The difference between the cost of the path and the objective that the solution reports.
    """

    force: float
    path: float
    limits: float
    objective: float

    @property
    def largest(self) -> float:
        return float(np.max([self.force, self.path, self.limits, self.objective]))


def stationarity(evidence: Evidence) -> Stationarity:
    """First-order conditions at a solution, from its multipliers.

    Evaluated block by block, without the sparse derivatives that a solve needs.
    """
    nlp, blocks = _unassembled(evidence)
    lam_x, lam_g = nlp.multipliers(evidence.path)
    x, p = nlp.pack(evidence.path), nlp.parameters(evidence.problem)
    lbx, ubx, lbg, ubg = nlp.bounds(evidence.problem)
    slope, rows, cost = _evaluate(blocks, nlp, x, p, lam_g)
    slope = slope + lam_x
    force, path, limits = left_over(
        nlp, slope, ((nlp.columns, lam_x, x, lbx, ubx), (nlp.rows, lam_g, rows, lbg, ubg))
    )
    stated = evidence.solution.objective * evidence.problem.objective.sense / nlp.units.cost
    return Stationarity(force, path, limits, float(abs(cost - stated)))


def left_over(program: Program, slope: np.ndarray, sides: tuple) -> tuple[float, float, float]:
    """What is left of the conditions on controls, on the path and on limits that do not act [-].

    `slope` is the scaled gradient of the Lagrangian by the unknowns of a program, `sides` are its layouts of
    unknowns and of rows, each with multipliers, values, lower and upper bounds.
    """
    weights = {"node": node_weights(program.mesh, program.scheme), "step": np.diff(program.mesh)}
    weights["control"] = weights["step" if program.hold else "node"]
    # Errors of the costate add up along the path, so sums from the start on are judged, not single entries.
    along = [group.of(slope) for group in program.columns.groups if group.kind != "control"]
    force = program.columns["force"].of(slope)
    if force.size:
        force = force / _not_tiny(weights["control"], SHORT)
    return (
        float(np.abs(force).max(initial=0.0)),
        float(np.max([np.abs(np.cumsum(part, axis=0)).max(initial=0.0) for part in along])),
        float(np.max([idle(*side, weights=weights) for side in sides])),
    )


def _unassembled(evidence: Evidence) -> tuple[NLP, list]:
    """The NLP of a path without its sparse derivatives, and its blocks.

    Its unit of force is at least the force that moves the body over the extent of the path in the duration:
    a solution that needs hardly any force would have no scale for errors of its force.
    """
    problem, path = evidence.problem, evidence.path
    if evidence.largest < evidence.typical_force:
        # Torques keep their size, and so do thrusters that turn a body and hardly move it.
        forces = np.array([unit == "N" for unit in problem.actuator.units(problem.dimension)], bool)
        raised = np.maximum(np.abs(path.control), evidence.typical_force)
        path = replace(path, control=np.where(forces, raised, path.control))
    return unassembled(problem, path, units_of(problem, path))


def _evaluate(blocks: list, nlp: NLP, x: np.ndarray, p: np.ndarray, lam_g: np.ndarray) -> tuple:
    """Scaled gradient of cost + lam_g . rows, the rows and the cost."""
    unknowns, multipliers = x * nlp.columns.scales(), lam_g * nlp.rows.scales() * nlp.units.cost
    slope, rows, cost = np.zeros(len(x)), np.zeros(len(lam_g)), 0.0
    for block in blocks:
        known, constant = block.kernel.used
        given = unknowns[block.columns], block.values[known], p[constant], multipliers[block.targets], 1.0
        slopes, values, costs = columns(block.kernel.slope, *given)
        np.add.at(slope, block.columns, slopes)
        np.add.at(rows, block.targets, values)
        cost += float(costs.sum())
    return slope * nlp.columns.scales() / nlp.units.cost, rows * nlp.rows.scales(), cost / nlp.units.cost


def idle(layout: Any, multipliers: Any, values: Any, lower: Any, upper: Any, *, weights: dict) -> float:
    """Largest multiplier times the distance from its limit, as a density in time.

    Steps shorter than the mean count as the mean. The barrier leaves the same product at every limit, which
    divided by the shortest steps of a graded mesh would look like a limit that acts.
    """
    room = np.where(multipliers > 0, upper - values, values - lower)
    # A limit that is not there, or that is more than one unit away, must not have a multiplier at all.
    product = np.abs(multipliers) * np.clip(room, 0.0, 1.0)
    product[lower == upper] = 0.0
    worst = [
        (group.of(product) / _not_tiny(weights.get(group.kind, np.ones(group.count)))).max(initial=0.0)
        for group in layout.groups
    ]
    return float(np.max(worst))


def _not_tiny(weights: np.ndarray, share: float = 1.0) -> np.ndarray:
    return np.maximum(weights, share * np.mean(weights))[:, None]
