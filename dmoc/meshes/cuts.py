"""The steps of a mesh cut into parts, where the error of an answer arises."""

from __future__ import annotations

import numpy as np

from dmoc.motion.path import DiscretePath

# A step in which the control jumps is cut into this many parts.
PARTS = 4
# No step becomes shorter than this part of the duration.
SHORTEST = 1e-5


def cuts_of(
    path: DiscretePath, errors: np.ndarray, corners: np.ndarray, shortest: float, least: int
) -> np.ndarray:
    """Into how many parts to cut each step.

    A step is cut in two or, if it is one of those that together make little of the local errors, into `least`.
    At corners it is cut into as many parts as lead to the shortest step wanted there, since the error falls
    only with the length of that step.
    """
    parts, order = np.full(len(errors), 2), np.argsort(errors)
    # Cutting all steps in two leaves 2^-order of the errors: steps that together make half of that can wait.
    small = np.cumsum(errors[order]) <= 0.5 * 2.0**-path.order * errors.sum()
    parts[order[small]] = least
    for k in corners:
        near = slice(max(k - 1, 0), k + 2)
        wanted = np.round(np.diff(path.mesh)[near] / shortest).astype(int)
        parts[near] = np.clip(wanted, 1, PARTS)
    parts[np.diff(path.mesh) < 2 * SHORTEST] = 1
    return parts


def cut(mesh: np.ndarray, parts: np.ndarray) -> np.ndarray:
    """The mesh with each step cut into so many equal parts."""
    pieces = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(mesh[:-1], mesh[1:], parts, strict=True)]
    return np.append(np.concatenate(pieces), mesh[-1])
