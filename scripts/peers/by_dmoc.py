"""dmoc on the problems of `tasks.py`."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from dmoc import (
    BoxForce,
    CircularOrbit,
    Condition,
    Effort,
    Engine,
    FinalRadius,
    FreeForce,
    KeepOut,
    PointGravity,
    State,
    TransferProblem,
)
from dmoc import solve as optimum
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.flown import flown
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_fractions, uniform_mesh
from dmoc.motion.path import DiscretePath
from peers.answer import Answer
from peers.tasks import Task, forces_in_plane, guess, in_plane

# Steps of the mesh on which the path to start from is given, and its order where none is asked for.
STEPS = 200
GUESSED = 4


def problem(task: Task) -> TransferProblem:
    """A task as dmoc states it; forces have `unit` as theirs."""
    start, mass = State(*task.start), task.mass / task.unit
    effects = [PointGravity(task.mu)] if task.polar else []
    if task.thrust:
        engine = Engine(task.thrust, exhaust_velocity=task.thrust / task.flow)
        goal = Condition(_circular, "circular")
        return TransferProblem(mass, start, goal, task.duration, effects, engine, FinalRadius())
    actuator = FreeForce() if task.limit is None else BoxForce(task.limit)
    outside = [KeepOut(centre, 1.0) for centre in task.spheres]
    return TransferProblem(mass, start, _goal(task), task.duration, effects, actuator, Effort(), outside)


def _goal(task: Task) -> Any:
    if task.polar and task.angle is None:
        return CircularOrbit(task.radius, task.mu)
    place, velocity = np.split(in_plane(task.last[None])[0] if task.polar else task.last, 2)
    return State(place, velocity)


def _circular(t, q, v, m):
    """Across the position, at the speed of a circular orbit around an attractor of mu = 1."""
    square = q[0] ** 2 + q[1] ** 2
    return [q[0] * v[0] + q[1] * v[1], (v[0] ** 2 + v[1] ** 2) ** 2 * square - 1]


def solve(
    task: Task, order: int | None, steps: int | None = None, tol: float | None = None
) -> Callable[[], Answer]:
    """One solve from the statement, with an order and a number of steps, or with a tolerance alone."""
    stated = problem(task)
    found = optimum(stated, order=order, steps=steps, tol=tol, guess=_guess(stated, task, order or GUESSED))
    # an effort is half the integral of |F|^2
    share = 1.0 if task.thrust else 2 * task.weight
    return partial(_answer, found, share * found.objective)


def _guess(stated: TransferProblem, task: Task, order: int) -> DiscretePath:
    """The path that all start from, on a fine mesh."""
    mesh = uniform_mesh(STEPS)
    fractions = node_fractions(mesh, scheme(order))
    states, controls = guess(task, fractions)
    if task.polar:
        states, controls = in_plane(states), forces_in_plane(task, states, controls)
    if task.thrust:
        controls = np.column_stack([controls, np.linalg.norm(controls, axis=1)])
    n, mass = task.axes, stated.mass - task.flow * task.duration * fractions
    ends = states[0, n:], states[-1, n:]
    return DiscretePath(mesh, order, False, task.duration, states[:, :n], controls, mass, *ends)


def _answer(found: Any, objective: float) -> Answer:
    """With the control that dmoc says is flown; what was found as several legs is one path."""
    parts = [_control(leg) for leg in getattr(found, "legs", (found,))]
    meshes, times, controls = zip(*parts, strict=True)
    mesh = np.concatenate([meshes[0][:1], *(mesh[1:] for mesh in meshes)])
    end = found.position[-1]
    return Answer(objective, mesh, np.concatenate(times), np.concatenate(controls), end, True, found.status)


def _control(found: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ends of pieces, times of the nodes in each, forces there."""
    path = found.path
    known = flown(Dynamics.of(found.problem), path)
    mesh = found.problem.start_time + path.duration * known.mesh
    times = mesh[:-1, None] + np.diff(mesh)[:, None] * scheme(path.order).points
    return mesh, times, np.moveaxis(known.nodes, 0, 1)[..., : path.position.shape[1]]
