"""The paths of all legs to start from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import both_ends, short
from dmoc.basics.plain import unbroken
from dmoc.basics.quaternions import in_one_sign, normalised
from dmoc.chains.path import MissionPath
from dmoc.configurations.base import Configuration
from dmoc.configurations.of_problem import configuration_of
from dmoc.ends.base import State
from dmoc.guess.starting import controls_for, starting_guess
from dmoc.missions.arcs import cheapest_arc
from dmoc.missions.meshes import ORDER, STEPS, meshes_along
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_fractions, step_nodes, uniform_mesh
from dmoc.motion.path import DiscretePath
from dmoc.scene.mission import Mission
from dmoc.scene.problem import TransferProblem

# A guess of the whole mission is made at this many places, then cut into legs.
SAMPLES = 400
# An engine of a guess burns at full thrust as long as this part of the mass is left [-].
LEAST_MASS = 0.2


def guessed(
    mission: Mission,
    meshes: Sequence[tuple[np.ndarray, int]],
    hold: bool = False,
    given: Any = None,
    total: float | None = None,
) -> MissionPath:
    """A guess on the meshes of all legs, one pair of mesh and order a leg.

    From `given`, a path over the whole mission as a function of the time or as arrays, else from the physics:
    straight lines and coasts between the places that are known, in about the time `total` [s].
    """
    given = _checked_guess(mission, given)
    total = float(np.ptp(given[0])) if isinstance(given, tuple) else total
    durations = likely_durations(mission, total)
    arc = cheapest_arc(mission) if given is None else None
    begin = float(np.mean(mission.start_bounds))
    if arc is not None:
        begin, durations = arc.begin, likely_durations(mission, arc.duration)
    begins = begin + np.append(0.0, np.cumsum(durations))
    places = _places(mission, durations, begins, given) if arc is None else arc.places
    return along(mission, meshes, hold, places, begins)


def along(
    mission: Mission,
    meshes: Sequence[tuple[np.ndarray, int]],
    hold: bool,
    places: Callable[[np.ndarray], np.ndarray],
    begins: np.ndarray,
) -> MissionPath:
    """A guess at places that are a function of the time; `begins` are when legs begin, then the end [s]."""
    legs, mass, own, durations = [], float(mission.mass), {}, np.diff(begins)
    for i, (problem, (mesh, order)) in enumerate(zip(mission.stretches, meshes, strict=True)):
        mass = _after(mission, i, mass)
        legs.append(_leg(problem, (mesh, order, hold), places, begins[i], durations[i], mass))
        mass = float(legs[-1].mass[-1])
    for joint in mission.joints:
        if (values := _own(mission, joint, legs)) is not None:
            own[joint.name] = values
    return MissionPath(tuple(legs), tuple(float(t) for t in begins[:-1]), own)


def _checked_guess(mission: Mission, given: Any) -> Any:
    """A function of time, arrays (times, positions), or None; ValueError for anything else."""
    size = len(mission.stretches[0].start.fixed()[0])
    try:
        if given is None:
            return None
        if callable(given):
            sample = np.ravel(np.asarray(given(float(mission.start_bounds[0])), float))[None]
            found: Any = given
        else:
            times, sample = np.asarray(given[0], float), np.asarray(given[1], float)
            sample = sample.reshape(len(times), -1)
            found = times, sample
            if not (np.diff(times) > 0).all():
                raise ValueError("its times do not increase")
        if sample.shape[1] != size or not np.isfinite(sample).all():
            raise ValueError(f"it has {sample.shape[1]} axes, and needs {size} finite numbers a time")
    except Exception as error:  # whatever a user's function raises
        raise ValueError(
            "guess must be a function of the time [s] that gives positions [m], arrays (times, positions), or "
            f"a former solution; {short(given)} fails: {unbroken(error)[:120]}"
        ) from error
    return found


def likely_durations(mission: Mission, total: float | None = None) -> np.ndarray:
    """A duration for each leg within its bounds, that add up to `total` or to one of the mission [s]."""
    bounds = np.array([leg.duration_bounds for leg in mission.stretches])
    middle = np.sqrt(bounds[:, 0] * bounds[:, 1])
    if total is None:
        if mission.duration is None:
            return middle
        total = float(np.clip(middle.sum(), *both_ends(mission.duration)))
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
        known, values = given
        return lambda times: np.stack([np.interp(times, known, column) for column in values.T], axis=1)
    if mission.closes and (around := _around(mission, float(begins[0]), float(durations.sum()))) is not None:
        return around
    knots = _known(mission, begins)
    found = []
    for (first, start), (last, goal) in pairwise(knots):
        span = float(begins[last] - begins[first])
        problem = mission.span(first, start, goal, float(begins[first]), span)
        mesh = uniform_mesh(SAMPLES)
        path = starting_guess(problem, mesh, 2, False, None, span)
        found.append((begins[first] + span * path.fractions, path.position))
    times = np.concatenate([part for part, _ in found])
    values = np.concatenate([part for _, part in found])
    return lambda at: np.stack([np.interp(at, times, column) for column in values.T], axis=1)


def _around(mission: Mission, begin: float, period: float) -> Callable[[np.ndarray], np.ndarray] | None:
    """The circle around a lone attractor that closes in a time [s], for a closed path whose places are open."""
    attractor, axes = mission.stretches[0].attraction.lone, mission.dimension
    if attractor is None or axes < 2 or not np.isnan(mission.start.estimate(begin)[0]).all():
        return None
    center, rate = attractor.place(axes), 2 * np.pi / period
    radius = (attractor.mu / rate**2) ** (1 / 3)

    def places(times: np.ndarray) -> np.ndarray:
        angles = rate * (times - begin)
        flat = np.zeros((len(times), axes - 2))
        return center + np.column_stack([radius * np.cos(angles), radius * np.sin(angles), flat])

    return places


def _known(mission: Mission, begins: np.ndarray) -> list[tuple[int, Any]]:
    """Joints whose place is known, with a boundary there: start and goal are always among them."""
    known: list[tuple[int, Any]] = []
    last = len(mission.joints) - 1
    for i, joint in enumerate(mission.joints):
        if joint.boundary is not None:
            end = mission.start if i == last and mission.closes else joint.boundary
            known.append((i, end))
            continue
        for event in joint.events:
            if event.condition is not None:
                where = event.condition.with_dimension(mission.dimension)
                place = where.estimate(float(begins[i]))[0]
                if not np.isnan(place).any():
                    known.append((i, where if where.turns_body else State(tuple(place), None)))
                    break
    return known


def _after(mission: Mission, index: int, mass: float) -> float:
    """The mass behind the joint before a leg, without what impulses burn."""
    for event in mission.joints[index].events:
        mass = event.burnt(mass)
    return mass


def _leg(
    problem: TransferProblem,
    numerics: tuple[np.ndarray, int, bool],
    places: Callable[[np.ndarray], np.ndarray],
    begin: float,
    duration: float,
    mass: float,
) -> DiscretePath:
    mesh, order, hold = numerics
    fractions = node_fractions(mesh, scheme(order))
    position, body = places(begin + duration * fractions), configuration_of(problem)
    for at in body.coordinates.quaternions:
        position[:, at] = in_one_sign(normalised(position[:, at]))
    slopes = np.gradient(position, duration * fractions, axis=0)
    masses, control = np.full(len(fractions), mass), np.zeros((len(fractions), problem.controls))
    limit = problem.actuator.force_limit()
    if problem.actuator.burns and limit is not None:
        full = controls_for(
            problem, limit * slopes / np.maximum(np.linalg.norm(slopes, axis=1), 1e-12)[:, None]
        )
        if full is not None:
            flow = np.asarray(problem.actuator.flow(full[0]), float).item()
            # A guess that stands still has no direction to push in, and burns nothing.
            share = min(1.0, (1 - LEAST_MASS) * mass / (flow * duration)) if flow else 1.0
            masses, control = mass - share * flow * duration * fractions, share * full
    if hold:
        rule = scheme(order)
        control = np.einsum("j,jkn->kn", rule.weights, control[step_nodes(len(mesh) - 1, rule)])
    first, last = (_independent(body, position[at], slopes[at]) for at in (0, -1))
    made_of = body.coordinates if body.surplus else None
    return DiscretePath(mesh, order, hold, duration, position, control, masses, first, last, made_of=made_of)


def _independent(body: Configuration, place: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Independent velocities of a body whose coordinates change by a slope."""
    if not body.surplus:
        return slope
    tangent = np.array(ca.DM(ca.evalf(ca.SX(body.tangent(ca.SX(ca.DM(place)))))))
    return np.linalg.lstsq(tangent, slope, rcond=None)[0]


def _own(mission: Mission, joint: Any, legs: list[DiscretePath]) -> np.ndarray | None:
    """A guess for the unknowns of a joint itself."""
    axes = mission.dimension
    if not joint.events:
        return None
    at_start = joint.left is None
    before = legs[joint.right if at_start else joint.left].start_velocity  # type: ignore[index]
    after = before
    if not at_start:
        before = legs[joint.left].goal_velocity
        after = before if joint.right is None else legs[joint.right].start_velocity
    if joint.boundary is not None:
        beside = legs[0].position[0] if at_start else legs[-1].position[-1]
        near = after if at_start else before
        speed = joint.boundary.estimate(mission.start_bounds[0], (beside, near))[1]
        speed = np.where(np.isnan(speed), near, speed)
        before, after = (speed, after) if at_start else (before, speed)
    parts = [before] if at_start else []
    parts += [event.first_guess(before[:axes], after[:axes]) for event in joint.events]
    return np.concatenate(parts)


def first_path(mission: Mission, order: int | None, steps: int | None, hold: bool, guess: Any) -> MissionPath:
    """The path to start from, on its first meshes."""
    given = mission.guess if guess is None else guess
    given = getattr(given, "path", given)
    if isinstance(given, MissionPath) and not given.suits(mission):
        given = given.as_arrays()
    if isinstance(given, MissionPath):
        return given.onto(meshes_along(mission, given, order, steps)) if order or steps else given
    orders = [leg.order or order or ORDER for leg in mission.plan]
    counts = [leg.steps or steps or STEPS[each] for leg, each in zip(mission.plan, orders, strict=True)]
    path = guessed(mission, list(zip(map(uniform_mesh, counts), orders, strict=True)), hold, given)
    return path.onto(meshes_along(mission, path, order, steps))
