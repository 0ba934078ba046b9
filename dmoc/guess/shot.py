"""Guesses by shooting: least effort and least time over many revolutions, least effort past attractors."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dmoc.guess.coast import VERY_MANY_TURNS, controls_for
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_fractions, step_nodes
from dmoc.motion.path import DiscretePath
from dmoc.scene.problem import TransferProblem

# A likely duration is so many times that which full thrust throughout takes [-].
LIKELY = 1.2
# A force is the largest up to this part of it [-], which it may lose where it turns between two nodes.
FULL = 1e-3


def shot_guess(
    problem: TransferProblem, mesh: np.ndarray, order: int, hold: bool, duration: float, free: bool
) -> DiscretePath | None:
    """A guess by shooting, which lasts so long, or about so long if that is `free`; None if none is found."""
    on = mesh, order, hold, duration
    for found in (soonest_to_orbit,) * free + (least_effort_of_many_turns, past_attractors):
        if (path := found(problem, *on)) is not None:
            return path
    return None


def is_full(problem: TransferProblem, guess: DiscretePath) -> bool:
    """Whether the force of a guess is as large as it may be all along."""
    limit, force = problem.actuator.force_limit(), guess.control[:, : problem.dimension]
    return limit is not None and bool(np.isclose(np.linalg.norm(force, axis=1), limit, rtol=FULL).all())


def soonest_to_orbit(
    problem: TransferProblem, mesh: np.ndarray, order: int, hold: bool, duration: float
) -> DiscretePath | None:
    """Very many revolutions from a known state to an open place on an orbit, in the least time.

    `duration` is a likely one. None where something else than the time counts, or where none is found.
    """
    start, (shortest, longest) = problem.start.fixed(), problem.duration_bounds
    full = problem.objective.hurries and problem.actuator.throughout is not None
    if not (full and _shoots(problem) and _very_many_turns(problem, duration)):
        return None
    from dmoc.shots.soonest import least_time

    found = least_time(problem, start)
    if found is None or not shortest <= found[0] <= longest:
        return None
    flown = _flown(problem, mesh, order, hold, *found)
    return None if flown is None or flown.mass[-1] < problem.actuator.dry_mass else flown


def least_effort_of_many_turns(
    problem: TransferProblem, mesh: np.ndarray, order: int, hold: bool, duration: float
) -> DiscretePath | None:
    """Very many revolutions from a known state to an open place on an orbit, at the least effort.

    A guess that does not meet the equations of motion so well is many revolutions off at the end, and over
    hundreds of them Ipopt does not find the way back.
    """
    if not _very_many_turns(problem, duration):
        return None
    return least_effort_to_orbit(problem, mesh, order, hold, duration)


def _very_many_turns(problem: TransferProblem, duration: float) -> bool:
    """Whether there are very many revolutions from a known state around a lone attractor."""
    start = problem.start.fixed()[0][None]
    if problem.attraction.lone is None or np.isnan(start).any():
        return False
    return bool(duration * problem.attraction.rates(start)[0] >= 2 * np.pi * VERY_MANY_TURNS)


def _shoots(problem: TransferProblem) -> bool:
    """Whether shots lead from the start to an open place on the goal."""
    start = problem.start.fixed()
    # Only where the controls are the force, or the force and its magnitude, are they known from the force.
    more = problem.actuator.labels(problem.dimension)[problem.dimension :]
    # Shots see the conditions of the goal, not numbers that it fixes.
    other = problem.goal.anchored or np.isnan(start).any() or not np.isnan(problem.goal.fixed()).all()
    bound = bool(problem.constraints or problem.links or other)
    return problem.attraction.lone is not None and not bound and more in ((), ("throttle",))


def least_effort_to_orbit(
    problem: TransferProblem, mesh: np.ndarray, order: int, hold: bool, duration: float
) -> DiscretePath | None:
    """The path of least effort from a known state to an open place on an orbit; None if none is found."""
    if not _shoots(problem):
        return None
    from dmoc.shots.extremal import least_effort

    path = least_effort(problem, duration, problem.start.fixed())
    return None if path is None else _flown(problem, mesh, order, hold, duration, path)


def _flown(
    problem: TransferProblem, mesh: np.ndarray, order: int, hold: bool, duration: float, path: Callable
) -> DiscretePath | None:
    """What a shot flies on a mesh; None where the controls do not follow from the force."""
    start = problem.start.fixed()
    position, velocity, force, mass = path(node_fractions(mesh, scheme(order)))
    position[0], control = start[0], _controls_of(problem, force, mesh, order, hold)
    if control is None:
        return None
    return DiscretePath(mesh, order, hold, duration, position, control, mass, start[1], velocity[-1])


def past_attractors(
    problem: TransferProblem, mesh: np.ndarray, order: int, hold: bool, duration: float
) -> DiscretePath | None:
    """The path of least effort between two known states past several attractors, in a known duration.

    Coasts that are blended may pass an attractor on the wrong side, where hundreds of times the effort are
    needed.
    """
    attraction, ends = problem.attraction, (problem.start, problem.goal)
    times = problem.start_time, problem.start_time + duration
    states = tuple(end.estimate(at) for end, at in zip(ends, times, strict=True))
    several = len(attraction.sources) > 1 and problem.dimension > 1
    if not several or problem.free_duration or np.isnan(states).any():
        return None
    from dmoc.shots.flyby import least_effort_past

    path = least_effort_past(problem, duration, states)
    if path is None:
        return None
    position, _, force = path(node_fractions(mesh, scheme(order)))
    position[[0, -1]] = states[0][0], states[1][0]
    control = _controls_of(problem, force, mesh, order, hold)
    if control is None:
        control = np.zeros((len(mesh) - 1 if hold else len(position), problem.controls))
    mass = np.full(len(position), problem.mass)
    return DiscretePath(mesh, order, hold, duration, position, control, mass, states[0][1], states[1][1])


def _controls_of(
    problem: TransferProblem, force: np.ndarray, mesh: np.ndarray, order: int, hold: bool
) -> np.ndarray | None:
    """The controls that give forces at the nodes of a mesh [N]; held ones their mean in each step."""
    if hold:
        rule = scheme(order)
        force = np.einsum("j,jkn->kn", rule.weights, force[step_nodes(len(mesh) - 1, rule)])
    return controls_for(problem, force)
