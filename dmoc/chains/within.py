"""The program of a leg within a mission: what its neighbours decide, and controls that are polynomials."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from dmoc.assembly.blocks import Block
from dmoc.basics.memory import remembered
from dmoc.basics.records import dataclass
from dmoc.chains.again import kernel_again
from dmoc.legs.legs import Joint, Leg
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_fractions
from dmoc.motion.path import DiscretePath
from dmoc.nlp.layout import LEG_MASS, LEG_START
from dmoc.nlp.placement import Placement
from dmoc.nlp.program import Program
from dmoc.nlp.stencils import stencils_of
from dmoc.nlp.units import Units
from dmoc.parts.rows import Row
from dmoc.scene.mission import Mission
from dmoc.scene.problem import TransferProblem

# A state keeps a limit that it breaks by no more than this [-]: rounding.
KEPT = 1e-9


@dataclass(frozen=True)
class Placed:
    """A leg's program, and where its unknowns and rows begin in those of the mission."""

    program: Program
    columns: int
    rows: int
    parameters: int

    def at(self, group: str, place: int) -> np.ndarray:
        """Unknowns of the mission that are one entry of a group of this leg."""
        return self.columns + self.program.columns[group].indices[:, place]


def leg_program(
    problem: TransferProblem, path: DiscretePath, units: Units, joined: bool = True
) -> tuple[Program, list, int]:
    """A leg without sparse derivatives, its blocks, parameters; where it begins is open if `joined`."""
    rule = scheme(path.order)
    stencils = stencils_of(problem, path.order, path.hold, joined=joined)
    placed = Placement(problem, stencils, rule, path.hold, path.mesh, units, joined=joined)
    none: Any = None
    program = Program(
        problem,
        Dynamics.of(problem),
        rule,
        path.hold,
        path.mesh,
        units,
        placed.columns,
        placed.rows,
        placed.row_bounds,
        none,
        np.empty(0),
    )
    return program, placed.blocks, stencils.parameter_count


def open_leg(mission: Mission, legs: tuple[Placed, ...], index: int, sides: list[np.ndarray]) -> None:
    """Let joints decide on the mass and the time at the start of a leg, and on its places at both ends.

    `sides` are the lower and upper bounds of its unknowns, then of its rows, which are changed in place.
    """
    program = legs[index].program
    lower, upper, columns = sides[0], sides[1], program.columns
    actuator = program.problem.actuator
    given = index == 0 and not mission.joints[0].events
    burns = "mass" in columns
    place = columns["mass" if burns else LEG_MASS].start
    scale = program.units.mass
    # The exported solver finds by large numbers how a bound depends on one: this depends on the dry mass alone.
    least = (actuator.dry_mass if burns else 0.0) or 1e-6 * scale
    lower[place], upper[place] = least / scale, np.inf
    if given:
        lower[place] = upper[place] = mission.mass / scale
    place = columns[LEG_START].start
    lower[place], upper[place] = -np.inf, np.inf
    before, behind = mission.joints[index : index + 2]
    if index == 0:
        lower[place], upper[place] = (end / program.units.time for end in mission.start_bounds)
    else:
        _leave(program, legs[index - 1].program.problem, (0, "start"), before, sides)
    if index + 1 < len(legs):
        _leave(program, legs[index + 1].program.problem, (-1, "goal"), behind, sides)
    for place, joint in ((0, before), (-1, behind)):
        if joint.boundary is not None and (joint.left is None or joint.right is None):
            _leave_known(program, joint, place, sides)
        for event in joint.events:
            if event.continued and event.left_behind == (place == -1):
                _leave_controls(program, event.continued, place, sides)


def _leave_known(program: Program, joint: Joint, place: int, sides: list[np.ndarray]) -> None:
    """Leave the limits that a start or a goal meets by what it says of place and velocity.

    Its own rows and those of a limit that it lies on would depend on each other, and their multipliers grow
    without bound.
    """
    problem, end = program.problem, "start" if place == 0 else "goal"
    if problem.turns or problem.links or joint.boundary is None:
        return
    state = joint.boundary.fixed()
    known = [not np.isnan(part).any() for part in state]
    known[1] &= known[0] and not joint.events
    for group in program.rows.groups:
        if not (group.owner and group.owner.field == "constraints" and known[group.kind == "end"]):
            continue
        if group.kind == "node" or group.owner.end == end:
            at = group.indices[:, place] if group.kind == "node" else group.indices[:, 0]
            if _met(program, group.owner.of(problem), group.kind == "end", state):
                sides[2][at], sides[3][at] = -np.inf, np.inf
    if known[0]:
        places = program.columns["position"].indices[:, place]
        at = (state[0] - program.units.origin) / program.columns.scales()[places]
        met = (sides[0][places] <= at + KEPT) & (at - KEPT <= sides[1][places])
        sides[0][places[met]], sides[1][places[met]] = -np.inf, np.inf


def _met(program: Program, constraint: Any, of_speed: bool, state: tuple[np.ndarray, np.ndarray]) -> bool:
    """Whether a state keeps a limit, whatever the time, the mass and the controls are."""
    made = remembered(lambda: _limit(program, constraint, of_speed), "met", constraint, of_speed, len(state[0]))
    if made is None:
        return False
    values, lower, upper = made
    found = values(*(np.nan_to_num(part) for part in state)).full().ravel()
    slack = KEPT * np.maximum(1.0, np.abs(found))
    if ((lower - slack <= found) & (found <= upper + slack)).all():
        return True
    # A row may be a square or a ratio: what a scene lets pass as rounding of its numbers is none of more.
    excess = constraint.excess_at(np.zeros(1), *(np.nan_to_num(part)[None] for part in state))
    return bool(excess[0] <= KEPT * np.abs(state[1] if constraint.limits_speed else state[0]).max())


def _limit(
    program: Program, constraint: Any, of_speed: bool
) -> tuple[ca.Function, np.ndarray, np.ndarray] | None:
    """What a constraint limits at a place and a velocity, from where to where; None if more says it."""
    problem, body = program.problem, program.dynamics.configuration
    t, m, u = ca.SX.sym("t"), ca.SX.sym("m"), ca.SX.sym("u", problem.controls)
    q, v = ca.SX.sym("q", problem.size), ca.SX.sym("v", problem.size)
    at = body.at(q, v, m)
    rows = constraint.speed_rows_at(at) if of_speed else constraint.rows_at(t, at, u, m)
    values = ca.vertcat(*(ca.SX(row.expression) for row in rows))
    if ca.depends_on(values, ca.vertcat(t, m, u)):
        return None
    return ca.Function("limit", [q, v], [values]), *(np.array([row[i] for row in rows]) for i in (2, 3))


def _leave_controls(program: Program, which: tuple[int, ...], place: int, sides: list[np.ndarray]) -> None:
    """Leave the limits of controls at the first or last node to the leg beside it, where they go on."""
    at = program.columns["force"].indices[list(which), place]
    sides[0][at], sides[1][at] = -np.inf, np.inf
    for group in program.rows.groups:
        if group.kind == "control" and group.owner and group.owner.field == "actuator":
            sides[2][group.indices[:, place]], sides[3][group.indices[:, place]] = -np.inf, np.inf


def _leave(
    program: Program,
    beside: TransferProblem,
    at: tuple[int, str],
    joint: Joint,
    sides: list[np.ndarray],
) -> None:
    """Leave limits at the first or last node of a leg to the leg beside it.

    A second time, rows and bounds of the same place would depend on each other. Of equal constraints the
    earlier leg keeps its limits; one that the leg beside it follows is left to that one.
    """
    place, end = at
    mine, other = program.problem.constraints, beside.constraints
    if len(mine) != len(other):
        return
    same = [
        (place == 0 and one == two) or (getattr(two, "follows", False) and not getattr(one, "follows", False))
        for one, two in zip(mine, other, strict=True)
    ]
    # The velocity goes on where no event changes it.
    smooth = all(
        event.keeps_energy and not (event.turns_velocity or event.changes_frame) for event in joint.events
    )
    for group in program.rows.groups:
        if not (group.owner and group.owner.field == "constraints" and same[group.owner.entry]):
            continue
        if group.kind == "end" and group.owner.end == end and smooth:
            sides[2][group.start : group.stop], sides[3][group.start : group.stop] = -np.inf, np.inf
        if group.kind == "node":
            sides[2][group.indices[:, place]], sides[3][group.indices[:, place]] = -np.inf, np.inf
    boxes = [np.isfinite(one.bounds(program.problem.dimension)).any() for one in mine]
    if any(boxes) and all(left for left, box in zip(same, boxes, strict=True) if box):
        places = program.columns["position"].indices[:, place]
        sides[0][places], sides[1][places] = -np.inf, np.inf


def polynomial_rows(placed: Placed, leg: Leg) -> tuple[list[Row], np.ndarray, np.ndarray]:
    """Rows, the unknowns in each and their weights, by which every control is a polynomial over a leg.

    Each control is what the polynomial through a few others says. Those few are nearest to Chebyshev's points,
    through which a polynomial does not swing.
    """
    program, degree = placed.program, leg.control_degree
    mesh, group = program.mesh, program.columns["force"]
    at = 0.5 * (mesh[1:] + mesh[:-1]) if program.hold else node_fractions(mesh, program.scheme)
    if degree is None or degree + 1 >= len(at) or not group.labels:
        return [], np.empty((0, 0), int), np.empty((0, 0))
    few = _few(at, degree)
    rest = np.setdiff1d(np.arange(len(at)), few)
    # Lagrange's polynomials of the few at the rest.
    weights = np.ones((len(few), len(rest)))
    for i, place in enumerate(at[few]):
        others = np.delete(at[few], i)
        weights[i] = np.prod((at[rest][:, None] - others) / (place - others), axis=1)
    lower, upper = program.problem.actuator.bounds(program.problem.dimension)
    # What is kept at a limit is a constant.
    places = (placed.columns + group.indices)[lower < upper]
    columns = [np.vstack([mine[rest], np.repeat(mine[few][:, None], len(rest), axis=1)]) for mine in places]
    labels = [label for label, free in zip(group.labels, lower < upper, strict=True) if free]
    names = [f"{label}[{node}]" for label in labels for node in rest]
    rows = [Row(name, None, 0.0, 0.0, "N") for name in names]
    return rows, np.hstack(columns), np.hstack([weights] * len(places))


def polynomial_block(columns: np.ndarray, weights: np.ndarray, targets: np.ndarray) -> Block:
    """The block of the rows that `polynomial_rows` names."""
    z, d = ca.SX.sym("z", len(columns)), ca.SX.sym("d", len(weights))
    made = kernel_again("polynomial", z, d, ca.SX(0, 1), z[0] - ca.dot(d, z[1:]), ca.SX(0))
    return Block(made, columns, targets, weights)


def _few(at: np.ndarray, degree: int) -> np.ndarray:
    """Different nodes nearest to Chebyshev's points."""
    wanted = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, degree + 1)) if degree else np.array([0.5])
    found: list[int] = []
    for place in wanted:
        order = np.argsort(np.abs(at - place), kind="stable")
        found.append(next(int(node) for node in order if node not in found))
    return np.array(sorted(found))
