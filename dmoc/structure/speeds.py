"""Limits on the speed that a path keeps to for a while.

Such a limit is of first order: the force holds the speed there, and where it is reached or left a force that
cannot jump goes on, so that there is no touch at an instant alone (Bryson & Ho, 1975, section 3.11).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dmoc.motion.lobatto import scheme
from dmoc.motion.path import DiscretePath, Key
from dmoc.results.switches import linear_controls
from dmoc.scene.mission import Mission
from dmoc.scene.problem import TransferProblem
from dmoc.structure.modes import Continued
from dmoc.structure.surfaces import Surface

# A limit acts at points whose multiplier is more than this part of the largest one [-].
PUSHES = 1e-2
# A switch within so many steps from where such a limit is reached or left is there.
BESIDE = 2.0


def is_of_speed(problem: TransferProblem | Mission, surface: Surface | None) -> bool:
    """Whether a limit is one on the speed."""
    return surface is not None and problem.constraints[surface.constraint].limits_speed


def sped(problem: TransferProblem, path: DiscretePath, least: float) -> dict[Surface, np.ndarray]:
    """The limits on the speed that act along a path, each with a mask of the nodes of the steps where it does.

    A limit acts in a step if loosening it by its own size there would change the objective by more than `least`
    over the number of steps.
    """
    found: dict[Surface, np.ndarray] = {}
    degree, steps = scheme(path.order).degree, np.diff(path.mesh)
    for i, constraint in enumerate(problem.constraints):
        density = path.multipliers.get(Key("step", "row", constraint.title(i)))
        if density is None or not constraint.limits_speed:
            continue
        push = np.abs(density).sum(axis=1) * steps
        acts = (push > least / len(steps)) & (push > PUSHES * push.max())
        nodes = np.zeros(len(path.position), bool)
        for step in np.flatnonzero(acts):
            nodes[step * degree : (step + 1) * degree + 1] = True
        if nodes.any():
            found[Surface(i, 0, upper=True)] = nodes
    return found


def beside(cuts: list, along: list[tuple[float, float, Surface]], step: float) -> list[tuple[str, float]]:
    """Switches; those next to where a limit on the speed is reached or left are there."""
    ends = np.array([end for first, last, _ in along for end in (first, last)])
    found = []
    for kind, end in cuts:
        near = ends[np.abs(ends - end) < BESIDE * step]
        found.append((kind, float(near[0]) if len(near) and end < 1.0 else end))
    return found


def held(problem: TransferProblem) -> Iterator[Continued]:
    """Where a path comes to a limit on the speed or leaves it, controls that cannot jump go on."""
    which = tuple(int(i) for i in np.flatnonzero(~linear_controls(problem)))
    if which:
        yield Continued(which, False)
