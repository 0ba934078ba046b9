"""ASSET on the problems of `tasks.py`: NumPy and `asset_asrl` alone."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import asset_asrl
import numpy as np

from peers.answer import Answer
from peers.tasks import Task, guess, in_plane

functions, control = asset_asrl.VectorFunctions, asset_asrl.OptimalControl
# Places of a method's nodes in a segment; ASSET's own polynomial of the control goes through them.
NODES = {"Trapezoidal": 1, "LGL3": 1, "LGL5": 2, "LGL7": 3}
# One thread each for functions and for the linear solver: more cost more processor time on small problems.
THREADS = 1
# Of the barrier where limits act: a tenth of its default takes fewer iterations here.
BARRIER = 1e-4
# Tolerances of all its conditions.
TOLERANCE = 1e-9


class Motion(control.ODEBase):
    """The equations of motion of a task; an effort is one more state."""

    def __init__(self, task: Task):
        n, size = task.axes, task.states
        given = control.ODEArguments(size, task.controls)
        x, u, t = given.XVec(), given.UVec(), given.TVar()
        if task.thrust:
            push = task.thrust / (1.0 - task.flow * t)
            acceleration = functions.stack([functions.sin(u[0]), functions.cos(u[0])]) * push
        else:
            acceleration = u * (task.unit / task.mass)
        if task.polar:
            r, away, across = x[0], x[2], x[3]
            turn = across / r
            spin = functions.stack([turn * across - task.mu / (r * r), -1.0 * away * turn])
            rates = [away, turn, acceleration + spin]
        else:
            rates = [x.segment(n, n), acceleration]
        if not task.thrust:
            rates.append(u.squared_norm() * task.weight)
        super().__init__(functions.stack(rates), size, task.controls)


def solve(task: Task, method: str, *segments: int) -> Callable[[], Answer]:
    """One solve from the statement, on so many equal segments, and again on finer ones from what was found."""
    phase = _phase(task, method, segments[0])
    done = phase.optimize()
    for count in segments[1:]:
        phase.refineTrajEqual(count)
        done = phase.optimize()
    return partial(_answer, task, method, np.array(phase.returnTraj()), str(done))


def _phase(task: Task, method: str, segments: int) -> Any:
    size, controls = task.states, range(task.states + 1, task.states + 1 + task.controls)
    rows = _guess(task, np.linspace(0.0, 1.0, 1 + segments * NODES[method]))
    phase = Motion(task).phase(method, list(rows), segments)
    phase.setControlMode("NoSpline")
    phase.setThreads(THREADS, THREADS)
    phase.optimizer.set_PrintLevel(3)
    phase.optimizer.set_tols(TOLERANCE, TOLERANCE, TOLERANCE, TOLERANCE)
    phase.optimizer.initMu = BARRIER
    # an effort and the time begin at 0
    phase.addBoundaryValue("Front", range(size + 1), [*task.first, *[0.0] * (size + 1 - len(task.first))])
    known = np.flatnonzero(~np.isnan(task.last))
    phase.addBoundaryValue("Back", [*known, size], [*task.last[known], task.duration])
    if task.thrust:
        r, across = functions.Arguments(2).tolist()
        phase.addEqualCon("Back", across * across * r - task.mu, [0, 3])
        phase.addValueObjective("Back", 0, -1.0)
    else:
        phase.addValueObjective("Back", size - 1, 1.0)
    if task.limit is not None:
        phase.addLUVarBounds("Path", controls, -task.limit, task.limit, 1.0)
    for centre in task.spheres:
        square = (functions.Arguments(task.axes) - np.array(centre)).squared_norm()
        phase.addInequalCon("Path", 1.0 - square, range(task.axes))
    return phase


def _guess(task: Task, fractions: np.ndarray) -> np.ndarray:
    """Rows of state, effort, time and control."""
    states, controls = guess(task, fractions)
    times = task.duration * fractions
    if task.thrust:
        return np.column_stack([states, times, controls])
    rate = task.weight * np.square(controls).sum(axis=1)
    spent = np.append(0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(times)))
    return np.column_stack([states, spent, times, controls])


def _answer(task: Task, method: str, found: np.ndarray, done: str) -> Answer:
    size, degree = task.states, NODES[method]
    times, controls = found[:, size], found[:, size + 1 :]
    places = np.arange(0, len(found) - 1, degree)[:, None] + np.arange(degree + 1)
    last = found[-1:, : len(task.first)]
    end = (in_plane(last) if task.polar else last)[0, : task.axes]
    objective = found[-1, 0 if task.thrust else size - 1]
    mesh = times[::degree]
    return Answer(
        float(objective), mesh, times[places], controls[places], end, status=done.split(".")[-1].lower()
    )
