"""How near two bodies of a team come at the nodes that they share and between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.numerics import columns
from dmoc.meshes.cut_off import CutOff, deepest, outside, paid_at_nodes
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.momenta import end_momenta, node_velocities, velocity_along
from dmoc.motion.path import DiscretePath
from dmoc.results.between import Cut, cuts, inside_gaps
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


def cut_off_between(team: Any, path: TeamPath, ending: str = "") -> CutOff:
    """What bodies cut off the distances that they keep, between the nodes where their rows act.

    As `dmoc.meshes.cut_off.cut_off`, of the path of one body as the other one sees it; `ending` is what the
    names of the rows end with.
    """
    steps, gaps = len(path.mesh) - 1, len(path.fractions) - 1
    found = CutOff(0.0, np.zeros(steps), np.zeros(steps))
    slopes = [
        _node_slopes(problem, leg)[:, leg.coordinates.places]
        for problem, leg in zip(team.members, path.legs, strict=True)
    ]
    for name, (part, a, b) in zip(team.pair_names(), team.pairs(), strict=True):
        limit, density = part.limit(team.dimension), path.densities.get(name + ending)
        if limit is None or density is None:
            continue
        apart = between(path, (a, b))
        place, moving = apart.position, slopes[b] - slopes[a]
        longest = float(np.linalg.norm(np.diff(place, axis=0), axis=1).max())
        inside, *_ = inside_gaps(limit.feature(), apart, place, moving, longest)
        q = ca.SX.sym("q", team.dimension)
        rows = part.rows(q)
        low, high = (np.array([getattr(row, side) for row in rows], float) for side in ("lower", "upper"))
        function = ca.Function("rows", [q], [ca.densify(ca.SX(ca.vertcat(*[row.expression for row in rows])))])
        broken = deepest(outside(columns(function, inside.T)[0].T, low, high), gaps)
        cost, shares = paid_at_nodes(path.weights[:, None] * np.abs(density), broken, steps)
        extent = max(path.legs[a].diagonal, path.legs[b].diagonal, part.distance_kept)
        beyond = deepest(limit.excess(inside, np.zeros_like(inside))[:, None], gaps)
        depth = np.maximum(found.depth, beyond.reshape(steps, -1).max(axis=1) / extent)
        found = CutOff(found.cost + cost, found.steps + shares, depth)
    return found


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
