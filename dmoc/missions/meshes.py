"""Meshes for the legs of a mission."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmoc.chains.path import MissionPath
from dmoc.meshes.choices import A_TURN, UNEVEN
from dmoc.meshes.widths import WIDEST_ROUNDING
from dmoc.motion.mesh import uniform_mesh
from dmoc.scene.mission import Mission
from dmoc.scene.problem import TransferProblem

# A leg has this order if none is asked for: inside a leg nothing switches, so that a high order pays.
ORDER = 6
# A leg has this many steps at each order, if no number is asked for.
STEPS = {2: 80, 4: 24, 6: 12, 8: 10}
# The mesh of a leg with more nodes than this comes after one with about so many [-].
MOST_AT_ONCE = 300
# Where there are more than two impulses their rounding falls to this in powers of ten [-].
LEAST_WIDTH = 1e-6


def meshes_along(
    mission: Mission, path: MissionPath, order: int | None, steps: int | None
) -> list[tuple[np.ndarray, int]]:
    """A mesh for each leg along a path: equal steps, or equal angles where it passes near an attractor."""
    found = []
    for leg, problem, mine in zip(mission.plan, mission.stretches, path.legs, strict=True):
        this = leg.order or order or ORDER
        count = leg.steps or steps
        have = (len(mine.mesh) - 1) * mine.order // this if mine.multipliers else 0
        least = max(STEPS[this], have)
        found.append(
            (mesh_around(problem, mine.place, mine.fractions, mine.duration, this, least, count), this)
        )
    return found


def mesh_around(
    problem: TransferProblem,
    places: np.ndarray,
    fractions: np.ndarray,
    duration: float,
    order: int,
    least: int,
    count: int | None = None,
) -> np.ndarray:
    """Steps of equal times or, where places come near to an attractor, of equal angles around it.

    There are `count` of them or, if that is not given, `least` and as many as the revolutions need.
    """
    rates = problem.attraction.rates(places)
    angles = np.append(0.0, np.cumsum(0.5 * (rates[1:] + rates[:-1]) * np.diff(fractions)))
    turns = angles[-1] * duration / (2 * np.pi)
    mesh = uniform_mesh(count or max(least, int(np.ceil(turns * A_TURN[order]))))
    if rates.max() > UNEVEN * rates.min() > 0:
        mesh = np.interp(mesh, angles / angles[-1], fractions)
        mesh[0], mesh[-1] = 0.0, 1.0
    return mesh


def coarser(path: MissionPath) -> MissionPath | None:
    """A guess on meshes of fewer steps, alike in each leg; None where there are few already."""
    every = max(leg.order // 2 * (len(leg.mesh) - 1) for leg in path.legs) // MOST_AT_ONCE
    if every < 2 or path.warm:
        return None
    meshes = []
    for mesh, order in path.meshes:
        places, count = np.linspace(0.0, 1.0, len(mesh)), max((len(mesh) - 1) // every, 2)
        meshes.append((np.interp(np.linspace(0.0, 1.0, count + 1), places, mesh), order))
    return path.onto(meshes)


def widths_of(mission: Any) -> list[float | None]:
    """Widths of the rounding of |F| and of impulses, from wide to what is asked for."""
    # An engine that always burns fully never comes to zero, where |F| is rounded.
    engines = [leg.actuator for leg in mission.stretches]
    own = [
        one.smoothing
        for one in engines
        if one.smoothing is not None and getattr(one, "min_thrust", 0.0) < (one.force_limit() or np.inf)
    ]
    joints = getattr(mission, "joints", ())
    if sum(event.pushes for joint in joints for event in joint.events) > 2:
        # One of several impulses may be none at the optimum.
        own.append(LEAST_WIDTH)
    if not own:
        return [None]
    count = max(int(np.ceil(np.log10(WIDEST_ROUNDING / min(own)))), 0)
    return [*(WIDEST_ROUNDING * 0.1**i for i in range(count)), None]
