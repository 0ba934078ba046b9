"""Where a team of missions starts: the order of its joints, and the paths of all bodies on one clock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.basics.arguments import entries, short
from dmoc.chains.path import MissionPath
from dmoc.missions.guess import along, guessed, likely_durations
from dmoc.missions.meshes import mesh_around
from dmoc.motion.mesh import uniform_mesh
from dmoc.phases.order import as_mission, order_by
from dmoc.phases.path import PhasedPath
from dmoc.phases.timetable import Timetable
from dmoc.scene.mission import Mission
from dmoc.scene.team import Team
from dmoc.teams.guess import aimed, bent_apart

# Legs of a guess of one body alone are looked at in so many steps.
SAMPLES = 80
# No phase of a guess lasts less than this part of the whole [-], as far as its bounds allow.
SHORTEST = 0.02
# Until it is known that they must be nearer, joints of two bodies are this part of the whole apart [-].
COARSE = 0.01
# A phase has this many steps at each order, if no number is asked for.
STEPS = {2: 60, 4: 16, 6: 10, 8: 8}

Places = Callable[[np.ndarray], np.ndarray]


def first_guess(
    team: Team, order: int, steps: int | None, hold: bool, given: Any = None, bent: bool = True
) -> tuple[Timetable, PhasedPath]:
    """A timetable, and a guess on it: each body's own, bent apart from those of the others."""
    missions, total = _aimed(team)
    parts = _each(team, given)
    own = [_own_path(mission, mine, total) for mission, mine in zip(missions, parts, strict=True)]
    begin, total = own[0].begins[0], float(np.mean([path.duration for path in own]))
    joints = [_stretched(path, total) for path in own]
    longest = team.duration_bounds[1]
    sequence = order_by([times[1:-1] for times in joints], missions, longest)
    plan = Timetable(team, sequence, COARSE)
    plan = plan if plan.possible else Timetable(team, sequence)
    if not plan.possible:
        raise ValueError(
            f"no time was found for the joints of {' and '.join(team.names)} that suits the durations of all "
            "legs; change one of them, or leave one of them free"
        )
    known = np.array([0.0, *[joints[group[0].body][group[0].joint] for group in plan.order], total])
    durations = likely(plan, np.diff(known))
    clock = begin + np.append(0.0, np.cumsum(durations))
    ways = [_on_clock(path, clock, begin + known) for path in own]
    path = on_clock(plan, ways, clock, (order, steps, hold))
    return plan, bent_apart(plan, path) if bent else path


def likely(plan: Timetable, durations: np.ndarray) -> np.ndarray:
    """Durations of phases near to others, that their bounds allow [s]."""
    bounds = plan.bounds
    return np.clip(np.maximum(durations, SHORTEST * durations.sum()), *bounds.T)


def on_clock(
    plan: Timetable, ways: Sequence[Places], clock: np.ndarray, numerics: tuple[int, int | None, bool]
) -> PhasedPath:
    """Paths of all bodies through places that are functions of the time, one mesh a phase."""
    order, steps, hold = numerics
    plain = [(uniform_mesh(steps or STEPS[order]), order)] * plan.count

    def made(meshes: Sequence[tuple[np.ndarray, int]]) -> PhasedPath:
        parts = [along(mission, meshes, hold, way, clock) for mission, way in zip(plan.cut, ways, strict=True)]
        return PhasedPath.joined(parts, plan.names, plan.order)

    path, meshes = made(plain), []
    for i in range(plan.count):
        # Steps of equal angles for the body that needs most of them around an attractor.
        around = [
            mesh_around(problem, leg.place, leg.fractions, leg.duration, order, STEPS[order], steps)
            for problem, leg in zip(plan.stretches[i :: plan.count], path.phase(i).legs, strict=True)
        ]
        meshes.append((max(around, key=len), order))
    same = all(np.array_equal(one, other) for (one, _), (other, _) in zip(meshes, plain, strict=True))
    return path if same else made(meshes)


def flown_ways(path: PhasedPath) -> list[Places]:
    """The places of all bodies on a path as functions of the time."""
    clock = path.begins[0] + np.append(0.0, np.cumsum(path.durations))
    return [_on_clock(path.of(i), clock, clock) for i in range(len(path.names))]


def _each(team: Team, given: Any) -> tuple:
    """A guess for each body, or None."""
    if given is None:
        return tuple(one.guess for one in team.members)
    found = entries(given)
    if found is None or len(found) != len(team.members):
        raise ValueError(
            f"guess of a team must be a former solution or {len(team.members)} guesses, one a body; "
            f"got {short(given)}"
        )
    return found


def _aimed(team: Team) -> tuple[list[Mission], float]:
    """The missions of all bodies, each by itself where they meet nobody, and about how long they last [s]."""
    missions = [as_mission(one) for one in team.members]
    likely_total = max(float(likely_durations(one).sum()) for one in missions)
    total = float(np.clip(likely_total, *team.duration_bounds))
    begin = float(np.mean(missions[0].start_bounds))
    wholes = [one.span(0, one.start, one.goal, begin, total) for one in missions]
    aims = aimed(wholes, team.meetings(), total)
    found = []
    for mission, whole, aim in zip(missions, wholes, aims, strict=True):
        found.append(mission if aim is whole else replace(mission, goal=aim.goal))
    return found, total


def _own_path(mission: Mission, given: Any, total: float) -> MissionPath:
    """The path of a body by itself."""
    given = getattr(given, "path", given)
    if hasattr(given, "as_arrays"):
        given = given.as_arrays()
    meshes = [(uniform_mesh(SAMPLES), 2)] * len(mission.plan)
    return guessed(mission, meshes, False, given, total)


def _stretched(path: MissionPath, total: float) -> np.ndarray:
    """The times at which legs begin and the last one ends, since the start, where all last `total` [s]."""
    times = np.append(0.0, np.cumsum([leg.duration for leg in path.legs]))
    return times * (total / times[-1])


def _on_clock(path: MissionPath, clock: np.ndarray, known: np.ndarray) -> Places:
    """The places of a path at times of a clock, whose knots are those of `known` on the path's own."""
    times, places = path.as_arrays()
    begin, span = times[0], np.ptp(times)

    def at(now: np.ndarray) -> np.ndarray:
        fractions = (np.interp(now, clock, known) - known[0]) / (known[-1] - known[0])
        return np.stack([np.interp(begin + span * fractions, times, column) for column in places.T], axis=1)

    return at
