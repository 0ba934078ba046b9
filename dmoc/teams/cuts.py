"""How near two bodies of a team come at the nodes that they share and between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.momenta import end_momenta, node_velocities, velocity_along
from dmoc.motion.path import DiscretePath
from dmoc.results.between import Cut, cuts
from dmoc.scene.problem import TransferProblem
from dmoc.teams.path import TeamPath, between


def team_cuts(team: Any, path: TeamPath) -> Iterator[Cut]:
    """How far each pair breaks what it keeps, at the nodes and between them, and how far it may.

    One body, as another one sees it, moves on a path past a zone around the origin: it is judged as by
    `dmoc.results.between.cuts`.
    """
    slopes = [
        _node_slopes(problem, leg)[:, leg.coordinates.places]
        for problem, leg in zip(team.members, path.legs, strict=True)
    ]
    speeds = [np.linalg.norm(slope, axis=1).max() for slope in slopes]
    for name, (part, a, b) in zip(team.pair_names(), team.pairs(), strict=True):
        if (limit := part.limit(team.dimension)) is None:
            continue
        apart = between(path, (a, b))
        extent = max(path.legs[a].diagonal, path.legs[b].diagonal, part.distance_kept)
        found = cuts([limit], apart, slopes[b] - slopes[a], extent, float(max(speeds[a], speeds[b])))
        for cut in found:
            place = cut.name.removeprefix(limit.named(0)).strip()
            yield replace(cut, name=f"{name} {place}".strip())


def leapt(team: Any, path: TeamPath) -> np.ndarray:
    """The steps in which two bodies come nearer than is allowed between nodes, or one leaps into a zone."""
    found = [cut.steps for cut in team_cuts(team, path)]
    for problem, leg in zip(team.members, path.legs, strict=True):
        if problem.constraints:
            slopes = _node_slopes(problem, leg)
            speed = float(np.linalg.norm(slopes[:, leg.coordinates.places], axis=1).max())
            scales = leg.diagonal or 1.0, speed, problem.start_time
            found += [cut.steps for cut in cuts(problem.constraints, leg, slopes, *scales)]
    return np.unique(np.concatenate([np.empty(0, int), *found]))


def _node_slopes(problem: TransferProblem, path: DiscretePath) -> np.ndarray:
    """dq/dt at every node, that of places in [m/s]."""
    dynamics = Dynamics.of(problem)
    _, velocity = end_momenta(dynamics, path, problem.start_time)
    ends = slice(None, None, scheme(path.order).degree)
    return node_velocities(path, velocity_along(dynamics, path.position[ends], velocity))
