"""How near two bodies of a team come at the nodes that they share and between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from dmoc.motion.dynamics import Dynamics
from dmoc.motion.momenta import end_momenta, node_velocities, velocity_along
from dmoc.motion.path import DiscretePath
from dmoc.results.between import Cut, cuts
from dmoc.scene.problem import TransferProblem
from dmoc.scene.team import Team
from dmoc.teams.path import TeamPath, between


def team_cuts(team: Team, path: TeamPath) -> Iterator[Cut]:
    """How far each pair breaks what it keeps, at the nodes and between them, and how far it may.

    One body, as another one sees it, moves on a path past a zone around the origin: it is judged as by
    `dmoc.results.between.cuts`.
    """
    slopes = [_node_velocities(*one) for one in zip(team.members, path.legs, strict=True)]
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


def leapt(team: Team, path: TeamPath) -> np.ndarray:
    """The steps in which two bodies come nearer than is allowed between nodes."""
    found = [cut.steps for cut in team_cuts(team, path)]
    return np.unique(np.concatenate([np.empty(0, int), *found]))


def _node_velocities(problem: TransferProblem, path: DiscretePath) -> np.ndarray:
    """The velocity of the centre of mass at every node [m/s]."""
    dynamics = Dynamics.of(problem)
    _, velocity = end_momenta(dynamics, path, problem.start_time)
    ends = slice(None, None, (len(path.position) - 1) // (len(path.mesh) - 1))
    slopes = node_velocities(path, velocity_along(dynamics, path.position[ends], velocity))
    return slopes[:, path.coordinates.places]
