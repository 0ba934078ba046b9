"""How far a body is from what lies around its path, at any time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

# A distance [m] for times [s] and coordinates, one row each.
Distance = Callable[[np.ndarray, np.ndarray], Any]


def from_attractors(solution: Any) -> dict[tuple[float, ...], tuple[Distance, float]]:
    """By the centre of each attractor [m]: the distance from it, and its radius [m], 0 where none is known."""
    problem, axes = solution.problem, solution.dimension
    radius = max((effect.body_radius() for effect in problem.effects), default=0.0)
    found: dict[tuple[float, ...], tuple[Distance, float]] = {}
    for source in problem.attraction.sources if axes else ():
        center = source.place(axes)
        # The scene tells the radius of the body at the origin.
        size = radius if not center.any() else 0.0
        found[tuple(center)] = partial(_distance, solution.path.coordinates, center), size
    return found


def from_zones(solution: Any) -> list[tuple[str, Distance]]:
    """The clearance from each zone, by the zone's name."""
    made = solution.path.coordinates
    found: list[tuple[str, Distance]] = []
    for i, zone in enumerate(solution.problem.constraints):
        here = partial(_clear, made, zone)
        if here(solution.time[:1], solution.path.position[:1]) is not None:
            found.append((zone.named(i), here))
    return found


def _distance(made: Any, center: np.ndarray, times: np.ndarray, q: np.ndarray) -> np.ndarray:
    return np.linalg.norm(q[:, made.places] - center, axis=1)


def _clear(made: Any, zone: Any, times: np.ndarray, q: np.ndarray) -> Any:
    if zone.point is None and not zone.on:
        return zone.clearance(times, q[:, made.places])
    return zone.clearance(times, zone.seen_of(made, q, np.zeros((len(q), made.motions.size)))[0])
