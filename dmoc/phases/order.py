"""In which order the joints of several missions follow each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from dmoc.legs.legs import Leg
from dmoc.scene.mission import Mission

# Times that differ by less than this part of the longest duration are one [-].
SAME = 1e-9


class Place(NamedTuple):
    """A joint between two legs of a body: the body, and which of its joints it is, the start being 0."""

    body: int
    joint: int


# The joints of all bodies in time: those in one group are at one time.
Order = tuple[tuple[Place, ...], ...]


def called(body: str, name: str) -> str:
    """What a joint of a body, or a group of rows, is called among those of all."""
    return f"{body}: {name}"


def as_mission(one: Any) -> Mission:
    """A member of a team as a mission: a transfer is one of a single leg."""
    if hasattr(one, "joints"):
        return one
    return Mission(
        mass=one.mass,
        start=one.start,
        goal=one.goal,
        legs=(Leg(one.duration),),
        effects=one.effects,
        actuator=one.actuator,
        objective=one.objective,
        constraints=one.constraints,
        start_time=one.start_time,
        guess=one.guess,
        inertia=one.inertia,
        name=one.name,
    )


def order_by(times: Sequence[np.ndarray], missions: Sequence[Mission], longest: float) -> Order:
    """The order of the joints inside missions that are at these times [s].

    Those that are at one time whatever is found are one group.
    """
    known = [_known_joints(mission) for mission in missions]
    places = [(float(t), Place(body, i + 1)) for body, mine in enumerate(times) for i, t in enumerate(mine)]
    groups: list[list[Place]] = []
    before = -np.inf
    for time, place in sorted(places):
        group = groups[-1] if groups else []
        together = time - before <= SAME * longest and known[place.body][place.joint]
        if not (
            together and all(known[other.body][other.joint] and other.body != place.body for other in group)
        ):
            groups.append([])
        groups[-1].append(place)
        before = time
    return tuple(map(tuple, groups))


def _known_joints(mission: Mission) -> np.ndarray:
    """Which joints of a mission are at a time since its start that is stated."""
    fixed = np.array([leg.duration_bounds[0] == leg.duration_bounds[1] for leg in mission.stretches])
    whole = mission.duration_bounds[0] == mission.duration_bounds[1]
    ahead = np.logical_and.accumulate(np.append(True, fixed))
    return ahead | (whole & np.logical_and.accumulate(np.append(True, fixed[::-1]))[::-1])
