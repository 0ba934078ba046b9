"""A mission whose legs are the arcs of a transfer's answer, and the path to start it from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dmoc.basics.numerics import cubic_spline
from dmoc.chains.path import MissionPath
from dmoc.legs.legs import Coast, Leg
from dmoc.missions.meshes import mesh_around
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_fractions
from dmoc.motion.path import DiscretePath
from dmoc.results.solution import Solution
from dmoc.results.switches import linear_controls
from dmoc.scene.mission import LEAST_SHARE, Mission
from dmoc.scene.problem import TransferProblem
from dmoc.structure.arcs import BURN, COAST, SINGULAR, Arc
from dmoc.structure.modes import (
    REVERSED,
    are_rows,
    continued,
    controls_at_limits,
    is_linear,
    names_of,
    sides_of,
)
from dmoc.structure.speeds import held, is_of_speed
from dmoc.structure.surfaces import Followed, Tangent

# Legs are found with this order: from a rough path Ipopt gets there far more often than at order 6 or 8.
FOUND_ORDER = 4
# Legs that are found have this order: nothing switches inside them.
ORDER = 8
# A leg begins with at least so many steps.
LEAST_STEPS = 2
# On a singular arc the force is one polynomial of this degree: forces at the nodes chatter there.
SINGULAR_DEGREE = 6
# A leg of a guess lasts at least this part of the whole duration [-].
LEAST_GUESSED = 2e-3
# Forces at neighbouring nodes of an arc that is turned round have at least this cosine in a guess [-].
ALIKE = 0.5
# The angle around attractors is summed up over this many places of a leg.
SAMPLES = 200


def mission_of(problem: TransferProblem, arcs: Sequence[Arc]) -> Mission:
    """The mission with a leg for each arc, whose ends are free."""
    parts: list[Any] = []
    for i, arc in enumerate(arcs):
        parts.append(_leg(problem, arc, i))
        if is_of_speed(problem, arc.touches):
            parts += held(problem)
        elif arc.touches is not None:
            parts.append(Tangent(problem.constraints[arc.touches.constraint], arc.touches))
        elif i + 1 < len(arcs):
            parts += continued(problem, arc.kind, arcs[i + 1].kind)
    return Mission(
        mass=problem.mass,
        start=problem.start,
        goal=problem.goal,
        legs=parts,
        effects=problem.effects,
        actuator=problem.actuator,
        objective=problem.objective,
        constraints=problem.constraints,
        duration=problem.duration,
        start_time=problem.start_time,
        name=problem.name,
        parameters=problem.parameters,
    )


def _leg(problem: TransferProblem, arc: Arc, index: int) -> Leg:
    name = f"{arc.words()} {index + 1}"
    constraints = None
    if arc.follows is not None:
        parts = list(problem.constraints)
        entry = arc.follows.constraint
        parts[entry] = Followed(parts[entry], arc.follows)
        constraints = tuple(parts)
    if arc.kind == COAST:
        return Coast(constraints=constraints, name=name)
    if arc.kind.startswith(BURN):
        engine: Any = problem.actuator
        return Leg(actuator=replace(engine, min_thrust=engine.max_thrust), constraints=constraints, name=name)
    # Where a speed is kept to along a line, that says what the control is; in a plane it may turn, and where no
    # thrust is paid for nothing says how.
    unpaid = bool(names_of(problem)) and bool(linear_controls(problem).all())
    turning = problem.dimension > 1 and unpaid
    singular = turning if is_of_speed(problem, arc.follows) else arc.kind == SINGULAR
    degree = SINGULAR_DEGREE if singular else None
    sides = sides_of(problem, arc.kind)
    kept = problem.actuator.kept(sides) if any(sides) else None
    linear = names_of(problem) and not is_of_speed(problem, arc.follows)
    if linear and not are_rows(problem) and (is_linear(problem) & (np.array(sides) == 0)).any():
        degree = SINGULAR_DEGREE
    return Leg(constraints=constraints, name=name, actuator=kept, control_degree=degree)


@dataclass(frozen=True)
class Course:
    """A path as functions of the time: places, velocities, controls, masses and costates."""

    times: np.ndarray
    ends: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    control: np.ndarray
    mass: np.ndarray
    costate: np.ndarray

    @classmethod
    def of(cls, legs: Sequence[Solution]) -> Course:
        """That of one answer or of the legs of a mission; where legs meet the earlier one counts."""
        size = max(leg.path.control.shape[1] for leg in legs)
        parts: list[list[np.ndarray]] = []
        for i, leg in enumerate(legs):
            path, first = leg.path, int(i > 0)
            control = np.zeros((len(path.position), size))
            control[:, : path.control.shape[1]] = path.control
            begin = leg.provenance.start_time
            nodes = (begin + path.duration * path.fractions, path.position, control, path.mass, leg.costate)
            both = begin + path.duration * path.mesh, leg.velocity
            parts.append([part[first:] for part in (*nodes, *both)])
        times, position, control, mass, costate, ends, velocity = map(np.concatenate, zip(*parts, strict=True))
        return cls(times, ends, position, velocity, control, mass, costate)

    def leg(self, problem: TransferProblem, kind: str, span: tuple[float, float], order: int) -> DiscretePath:
        """The path between two times as that of a leg."""
        begin, end = span
        mesh = self.mesh(problem, span, order)
        at = begin + (end - begin) * node_fractions(mesh, scheme(order))
        slopes = self.velocity[0], self.velocity[-1]
        position = cubic_spline(self.times, self.position, slopes)(at)
        speeds = cubic_spline(self.ends, self.velocity)(np.array([begin, end]))
        mass = np.interp(at, self.times, self.mass)
        return DiscretePath(
            mesh,
            order,
            False,
            end - begin,
            position,
            self._controls(problem, kind, at),
            mass,
            speeds[0],
            speeds[1],
        )

    def mesh(self, problem: TransferProblem, span: tuple[float, float], order: int) -> np.ndarray:
        """Steps of equal angles around attractors where the motion is uneven, else of equal times."""
        fine = np.linspace(*span, SAMPLES)
        places = np.stack([np.interp(fine, self.times, column) for column in self.position.T], axis=1)
        fractions, duration = np.linspace(0.0, 1.0, SAMPLES), span[1] - span[0]
        return mesh_around(problem, places, fractions, duration, order, LEAST_STEPS)

    def _controls(self, problem: TransferProblem, kind: str, at: np.ndarray) -> np.ndarray:
        if kind == COAST:
            return np.zeros((len(at), 0))
        control = np.stack([np.interp(at, self.times, column) for column in self.control.T], axis=1)
        primer = np.stack([np.interp(at, self.times, column) for column in self.costate.T], axis=1)
        if not kind.startswith(BURN):
            return controls_at_limits(problem, kind, control, primer)
        upper = problem.actuator.bounds(problem.dimension)[1]
        if problem.actuator.smoothing is None:
            return np.broadcast_to(upper, control.shape).copy()
        # A thrust of least cost is against the costate, also where the coarse answer coasts.
        primer = -primer / np.maximum(np.linalg.norm(primer, axis=1), 1e-300)[:, None]
        return np.hstack([upper[-1] * primer, np.full((len(at), 1), upper[-1])])


def with_one_way(path: DiscretePath, axes: int) -> DiscretePath:
    """The path of an arc whose force hardly turns from node to node: where it does, that is as it was before.

    An arc ends where its force is turned round. There the costate is nearly none, and a node whose force is
    against the others is an optimum of its own.
    """
    control, middle = path.control.copy(), len(path.control) // 2
    force = control[:, :axes]
    for nodes, back in ((range(middle + 1, len(force)), 1), (range(middle - 1, -1, -1), -1)):
        for node in nodes:
            before = force[node - back]
            if force[node] @ before < ALIKE * np.linalg.norm(force[node]) * np.linalg.norm(before):
                force[node] = before
    return replace(path, control=control)


def path_of(
    problem: TransferProblem, arcs: Sequence[Arc], legs: Sequence[Solution], order: int = FOUND_ORDER
) -> MissionPath:
    """The path of a mission of arcs to start from, cut out of an answer."""
    course = Course.of(legs)
    first, whole = course.times[0], course.times[-1] - course.times[0]
    ends = first + whole * _apart(np.array([arc.end for arc in arcs]))
    begins = np.append(first, ends[:-1])
    paths = [
        course.leg(problem, arc.kind, (begin, end), order)
        for arc, begin, end in zip(arcs, begins, ends, strict=True)
    ]
    if any(REVERSED in arc.kind for arc in arcs):
        paths = [with_one_way(path, problem.dimension) for path in paths]
    return MissionPath(tuple(paths), tuple(map(float, begins)))


def _apart(ends: np.ndarray) -> np.ndarray:
    """Fractions at which arcs end, so that each lasts a little."""
    lengths = np.maximum(np.diff(np.append(0.0, ends)), max(LEAST_GUESSED, 4 * LEAST_SHARE))
    return np.cumsum(lengths) / lengths.sum()
