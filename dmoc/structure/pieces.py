"""A path in two parts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dmoc.motion.lobatto import scheme
from dmoc.motion.path import DiscretePath

# A cut so near to a step end, as a part of the steps beside it, is made there [-].
SNAP = 0.2


def cut(path: DiscretePath, fraction: float) -> tuple[DiscretePath, DiscretePath]:
    """A path in two parts, without multipliers; the cut is a step end of both."""
    steps, rule = np.diff(path.mesh), scheme(path.order)
    near = int(np.argmin(np.abs(path.mesh - fraction)))
    if 0 < near < len(steps) and abs(path.mesh[near] - fraction) < SNAP * steps[near - 1 : near + 1].min():
        fraction = float(path.mesh[near])
    mesh = np.unique(np.append(path.mesh, fraction))
    fine, k = path.onto(mesh, path.order, path.hold), int(np.searchsorted(mesh, fraction))
    node, control = k * rule.degree, k if path.hold else k * rule.degree
    slopes = np.gradient(fine.position, fine.duration * fine.fractions, axis=0)[node]
    first = replace(
        fine,
        mesh=mesh[: k + 1] / fraction,
        duration=fraction * path.duration,
        position=fine.position[: node + 1],
        control=fine.control[: control + (not path.hold)],
        mass=fine.mass[: node + 1],
        goal_velocity=slopes,
        multipliers={},
    )
    last = replace(
        fine,
        mesh=(mesh[k:] - fraction) / (1 - fraction),
        duration=(1 - fraction) * path.duration,
        position=fine.position[node:],
        control=fine.control[control:],
        mass=fine.mass[node:],
        start_velocity=slopes,
        multipliers={},
    )
    return first, last
