"""The paths of all legs to start from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from dmoc.ends.base import State
from dmoc.guess.starting import controls_for, starting_guess
from dmoc.legs.ends import Periodic
from dmoc.missions.mission import Mission
from dmoc.missions.program import MissionPath
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_fractions, uniform_mesh
from dmoc.motion.path import DiscretePath
from dmoc.scene.problem import TransferProblem

# A guess of the whole mission is made at this many places, then cut into legs.
SAMPLES = 400
# An engine of a guess burns at full thrust as long as this part of the mass is left [-].
LEAST_MASS = 0.2


def guessed(mission: Mission, meshes: Sequence[tuple[np.ndarray, int]], given: Any = None) -> MissionPath:
    """A guess on the meshes of all legs, one pair of mesh and order a leg.

    From `given`, a path over the whole mission as a function of the time or as arrays, else from the physics:
    straight lines and coasts between the places that are known.
    """
    given = mission.guess if given is None else given
    durations = likely_durations(mission)
    if (path := getattr(given, "mission_path", given)) is not None and isinstance(path, MissionPath):
        return path.onto(meshes)
    begin = mission.start_bounds[0] if not isinstance(mission.start_time, tuple) else float(
        np.mean(mission.start_time)
    )
    begins = begin + np.append(0.0, np.cumsum(durations))
    places = _places(mission, durations, begins, given)
    legs, mass, own = [], float(mission.mass), {}
    for i, (problem, (mesh, order)) in enumerate(zip(mission.stretches, meshes, strict=True)):
        mass = _after(mission, i, mass)
        legs.append(_leg(problem, mesh, order, places, begins[i], durations[i], mass))
        mass = float(legs[-1].mass[-1])
    for joint in mission.joints:
        if (values := _own(mission, joint, legs)) is not None:
            own[joint.name] = values
    return MissionPath(tuple(legs), tuple(float(t) for t in begins[:-1]), own)


def likely_durations(mission: Mission) -> np.ndarray:
    """A duration for each leg within its bounds, that add up to one of the mission [s]."""
    bounds = np.array([leg.duration_bounds for leg in mission.stretches])
    middle = np.sqrt(bounds[:, 0] * bounds[:, 1])
    if mission.duration is None:
        return middle
    low, high = mission.duration if isinstance(mission.duration, tuple) else (mission.duration,) * 2
    total = float(np.clip(middle.sum(), low, high))
    free = bounds[:, 0] < bounds[:, 1]
    durations = np.where(free, np.maximum(middle, (total - middle[~free].sum()) / max(free.sum(), 1)), middle)
    for _ in range(len(durations)):
        off = total - durations.sum()
        room = np.where(off > 0, bounds[:, 1] - durations, durations - bounds[:, 0])
        durations = durations + off * room / (room.sum() or 1.0)
        durations = np.clip(durations, bounds[:, 0], bounds[:, 1])
    return durations


def _places(
    mission: Mission, durations: np.ndarray, begins: np.ndarray, given: Any
) -> Callable[[np.ndarray], np.ndarray]:
    """Positions over time, one row a time."""
    if callable(given):
        return lambda times: np.array([np.ravel(np.asarray(given(float(t)), float)) for t in times])
    if given is not None:
        known, values = np.asarray(given[0], float), np.asarray(given[1], float).reshape(len(given[0]), -1)
        return lambda times: np.stack([np.interp(times, known, column) for column in values.T], axis=1)
    knots = _known(mission, begins)
    found = []
    for (first, start), (last, goal) in zip(knots[:-1], knots[1:], strict=True):
        span = float(begins[last] - begins[first])
        problem = mission.span(first, start, goal, float(begins[first]), span)
        mesh = uniform_mesh(SAMPLES)
        path = starting_guess(problem, mesh, 2, False, None, span)
        found.append((begins[first] + span * path.fractions, path.position))
    times = np.concatenate([part for part, _ in found])
    values = np.concatenate([part for _, part in found])
    return lambda at: np.stack([np.interp(at, times, column) for column in values.T], axis=1)


def _known(mission: Mission, begins: np.ndarray) -> list[tuple[int, Any]]:
    """Joints whose place is known, with a boundary there: start and goal are always among them."""
    known: list[tuple[int, Any]] = []
    last = len(mission.joints) - 1
    for i, joint in enumerate(mission.joints):
        if joint.boundary is not None:
            end = mission.start if i == last and isinstance(mission.goal, Periodic) else joint.boundary
            known.append((i, end))
            continue
        for event in joint.events:
            if event.condition is not None:
                where = event.condition.with_dimension(mission.dimension)
                place = where.estimate(float(begins[i]))[0]
                if not np.isnan(place).any():
                    known.append((i, State(tuple(place), None)))
    return known


def _after(mission: Mission, index: int, mass: float) -> float:
    """The mass behind the joint before a leg, without what impulses burn."""
    for event in mission.joints[index].events:
        mass = event.burnt(mass)
    return mass


def _leg(
    problem: TransferProblem,
    mesh: np.ndarray,
    order: int,
    places: Callable[[np.ndarray], np.ndarray],
    begin: float,
    duration: float,
    mass: float,
) -> DiscretePath:
    fractions = node_fractions(mesh, scheme(order))
    position = places(begin + duration * fractions)
    slopes = np.gradient(position, duration * fractions, axis=0)
    masses, control = np.full(len(fractions), mass), np.zeros((len(fractions), problem.controls))
    limit = problem.actuator.force_limit()
    if problem.actuator.burns and limit is not None:
        full = controls_for(problem, limit * slopes / np.maximum(np.linalg.norm(slopes, axis=1), 1e-12)[:, None])
        if full is not None:
            flow = np.asarray(problem.actuator.flow(full[0]), float).item()
            share = min(1.0, (1 - LEAST_MASS) * mass / (flow * duration))
            masses, control = mass - share * flow * duration * fractions, share * full
    return DiscretePath(mesh, order, False, duration, position, control, masses, slopes[0], slopes[-1])


def _own(mission: Mission, joint: Any, legs: list[DiscretePath]) -> np.ndarray | None:
    """A guess for the unknowns of a joint itself."""
    axes = mission.dimension
    if not joint.events:
        return None
    before = None if joint.left is None else legs[joint.left].goal_velocity
    after = None if joint.right is None else legs[joint.right].start_velocity
    known = [] if joint.left is not None else [None]
    if joint.boundary is not None:
        place = legs[joint.right].position[0] if joint.left is None else legs[joint.left].position[-1]
        near = (place, after if joint.left is None else before)
        speed = joint.boundary.estimate(mission.start_bounds[0], near)[1]
        speed = np.where(np.isnan(speed), near[1], speed)
        before, after = (speed, after) if joint.left is None else (before, speed)
    parts = [before] if known else []
    for event in joint.events:
        parts.append(event.first_guess(before[:axes], after[:axes]))
    return np.concatenate(parts)


