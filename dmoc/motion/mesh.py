"""Meshes: the nodes of each step, their fractions of the duration and their weights."""

from __future__ import annotations

import numpy as np

from dmoc.motion.lobatto import Scheme


def uniform_mesh(steps: int) -> np.ndarray:
    """Fractions 0..1 of the step ends, shape (steps+1,)."""
    return np.linspace(0.0, 1.0, steps + 1)


def node_fractions(mesh: np.ndarray, rule: Scheme) -> np.ndarray:
    """Fractions of all nodes, shape (steps*s+1,)."""
    inner = mesh[:-1, None] + np.diff(mesh)[:, None] * rule.points[:-1]
    return np.append(inner.ravel(), mesh[-1])


def node_weights(mesh: np.ndarray, rule: Scheme) -> np.ndarray:
    """Quadrature weight of every node, summed over the steps that share it; total 1."""
    weights = np.zeros((len(mesh) - 1) * rule.degree + 1)
    np.add.at(weights, step_nodes(len(mesh) - 1, rule), np.diff(mesh) * rule.weights[:, None])
    return weights


def step_nodes(steps: int, rule: Scheme) -> np.ndarray:
    """Which nodes each step has, shape (s+1, steps)."""
    return np.arange(rule.degree + 1)[:, None] + rule.degree * np.arange(steps)
