"""Balances of momentum, of spin about the centre of mass, and of the work that is done on a body that turns."""

from __future__ import annotations

import numpy as np

from dmoc.basics.quaternions import rotated
from dmoc.checks.evidence import Evidence
from dmoc.motion.march import wrench_of
from dmoc.motion.momenta import along_path
from dmoc.motion.configuration import quaternions_in


def balance(evidence: Evidence) -> tuple[float, float]:
    """By how much momentum and impulse differ, over all impulses [-], and the sum of all impulses [m/s].

    The sums are exact: what a step gives to its nodes, added up, is the impulse of forces alone. For a body
    that turns the same holds for its angular momentum about the centre of mass, seen in space axes: R(q) turns
    what each node gets from body axes, and the inertia's part adds up to nothing.
    """
    nodes = np.concatenate(evidence.position[evidence.at])
    impulse = along_path(evidence.dynamics, nodes, np.concatenate(evidence.momenta))
    ends = [evidence.boundary_momentum(place) for place in (0, -1)]
    first, last = (_in_space(evidence, evidence.position[[place]], end[None]) for place, end in zip((0, -1), ends, strict=True))
    # Added up over a step, the parts of the inertia cancel, and the impulse is left.
    given = _in_space(evidence, nodes, impulse).reshape(*evidence.at.shape, -1).sum(axis=0)
    change, speeds = (last - first)[0], evidence.speeds
    gross = float(np.abs(given[:, speeds]).sum()) + evidence.speed
    off = np.abs(change - given.sum(axis=0))
    error = off[speeds].max(initial=0.0) / gross
    if not speeds.all():
        spins = float(np.abs(given[:, ~speeds]).sum()) + evidence.spin
        error = max(error, off[~speeds].max() / spins)
    return float(error), gross


def _in_space(evidence: Evidence, position: np.ndarray, momenta: np.ndarray) -> np.ndarray:
    """Momenta, one row a place, with the spins turned from body into space axes."""
    found = momenta.copy()
    for at in quaternions_in(evidence.path.parts):
        found[:, ~evidence.speeds] = rotated(position[:, at], momenta[:, ~evidence.speeds])
    return found


def held_wrench(evidence: Evidence) -> np.ndarray:
    """What a held control does per unit mass at each node of its step, shape (s+1, steps, freedom)."""
    return np.array(
        [
            wrench_of(evidence.dynamics, evidence.position[at], evidence.path.control) / evidence.mass[at][:, None]
            for at in evidence.at
        ]
    )
