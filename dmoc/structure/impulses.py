"""How many impulses: the primer vector says where another one helps, and one of no size is taken away.

References
----------
D. F. Lawden, Optimal Trajectories for Space Navigation (1963).
P. M. Lion, M. Handelsman, Primer vector on fixed-time impulsive trajectories, AIAA J. 6 (1968).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dmoc.chains.path import MissionPath, merged
from dmoc.checks.primer import HELPS, worth_of
from dmoc.missions.solution import MissionSolution
from dmoc.motion.lobatto import scheme
from dmoc.motion.path import DiscretePath
from dmoc.scene.impulses import FEWER, MORE, with_impulse, without_impulse
from dmoc.scene.mission import Mission
from dmoc.structure.solution import changed_solution

# There are no more than so many impulses.
MOST_IMPULSES = 8
# A new impulse is at first this part of all others together [-].
FIRST_SIZE = 0.02
# An impulse below this part of all together is taken away [-].
NO_SIZE = 1e-5
# A cut so near to a step end, as a part of the steps beside it, is made there [-].
SNAP = 0.2
# Another impulse must save at least this part of the objective [-].
WORTH = 1e-7


def with_best_impulses(found: MissionSolution, solve: Callable[..., MissionSolution]) -> MissionSolution:
    """The answer with as many impulses as the primer vector asks for, from an answer with some.

    Parameters
    ----------
    found : MissionSolution
    solve : callable
        (mission, guess) -> MissionSolution.
    """
    ladder, told = list(found.ladder), []

    def again(mission: Mission, path: MissionPath) -> MissionSolution:
        answer = solve(mission, path)
        ladder.extend(answer.ladder)
        return answer

    best = found
    while best.success and len(best.impulses) < MOST_IMPULSES:
        started = _with_another(best)
        if started is None:
            break
        mission, path, index = started
        tried = _changed(again(mission, path), best, [MORE, index])
        tried = _without_idle(tried, again)
        if not tried.success or tried.objective > (1 - WORTH) * best.objective:
            break
        told.append(f"{len(tried.impulses)} impulses cost {tried.objective:.8g}")
        best = tried
    best = _without_idle(best, again)
    return replace(best, ladder=tuple(ladder), reason="; ".join([best.reason, *told]))


def _changed(found: MissionSolution, before: MissionSolution, change: list) -> MissionSolution:
    """An answer that remembers how its mission came from that of another one."""
    return changed_solution(found, arcs=(*before.arcs, change))


def _with_another(found: MissionSolution) -> tuple[Mission, MissionPath, int] | None:
    """The mission with one more impulse where the primer vector is longest, a path to start from, the leg."""
    worth = worth_of(found)
    if worth is None:
        return None
    axes, longest, best = found.dimension, 1 + HELPS, None
    for index, leg in enumerate(found.legs):
        primer = leg.costate[1:-1, :axes] / worth
        sizes = np.linalg.norm(primer, axis=1)
        if len(sizes) and not leg.path.control.shape[1] and sizes.max() > longest:
            place = int(np.argmax(sizes))
            longest, best = float(sizes[place]), (index, float(leg.path.fractions[1 + place]), -primer[place])
    if best is None:
        return None
    index, fraction, way = best
    first, last = cut(found.legs[index].path, fraction)
    mission = with_impulse(found.require_problem(), index)
    path = found.path
    total = sum(kick.size for kick in found.impulses) or 1.0
    kick = FIRST_SIZE * total * way / np.linalg.norm(way)
    legs = (*path.legs[:index], first, last, *path.legs[index + 1 :])
    begins = (*path.begins[: index + 1], path.begins[index] + first.duration, *path.begins[index + 1 :])
    own = {_renamed(name, lambda i: i + 1 if i > index else i): values for name, values in path.own.items()}
    return mission, MissionPath(legs, begins, own | {f"joint {index + 1}": kick}, near=True), index


def _renamed(name: str, moved: Callable[[int], int]) -> str:
    """The name of a joint after legs were added or taken away."""
    if name in ("start", "goal"):
        return name
    return f"joint {moved(int(name.split()[-1]))}"


def _without_idle(found: MissionSolution, solve: Callable[..., MissionSolution]) -> MissionSolution:
    """The answer without impulses of no size between two coasts."""
    while found.success:
        total = sum(kick.size for kick in found.impulses)
        mission = found.require_problem()
        idle = [
            i
            for i, joint in enumerate(mission.joints)
            if len(joint.events) == 1
            and joint.boundary is None
            and joint.events[0].pushes
            and np.linalg.norm(found.own[joint.name]) < NO_SIZE * total
        ]
        if not idle:
            return found
        tried = solve(*_merged(found, idle[0]))
        if not tried.success:
            return found
        found = _changed(tried, found, [FEWER, idle[0]])
    return found


def _merged(found: MissionSolution, joint: int) -> tuple[Mission, MissionPath]:
    """The mission without the impulse at a joint, and a path to start from."""
    mission, path = found.require_problem(), found.path
    one = merged(path.legs[joint - 1], path.legs[joint])
    own = {
        _renamed(name, lambda i: i - 1 if i > joint else i): values
        for name, values in path.own.items()
        if name != f"joint {joint}"
    }
    begins = (*path.begins[:joint], *path.begins[joint + 1 :])
    new = MissionPath((*path.legs[: joint - 1], one, *path.legs[joint + 1 :]), begins, own, near=True)
    return without_impulse(mission, joint), new


def cut(path: DiscretePath, fraction: float) -> tuple[DiscretePath, DiscretePath]:
    """A path in two parts, without multipliers; the cut is a step end of both."""
    steps, rule = np.diff(path.mesh), scheme(path.order)
    near = int(np.argmin(np.abs(path.mesh - fraction)))
    if 0 < near < len(steps) and abs(path.mesh[near] - fraction) < SNAP * steps[near - 1 : near + 1].min():
        fraction = float(path.mesh[near])
    mesh = np.unique(np.append(path.mesh, fraction))
    fine, k = path.onto(mesh, path.order, path.hold), int(np.searchsorted(mesh, fraction))
    node, control = k * rule.degree, k if path.hold else k * rule.degree
    slopes = np.gradient(fine.position, fine.duration * fine.fractions, axis=0)[node]
    first = replace(
        fine,
        mesh=mesh[: k + 1] / fraction,
        duration=fraction * path.duration,
        position=fine.position[: node + 1],
        control=fine.control[: control + (not path.hold)],
        mass=fine.mass[: node + 1],
        goal_velocity=slopes,
        multipliers={},
    )
    last = replace(
        fine,
        mesh=(mesh[k:] - fraction) / (1 - fraction),
        duration=(1 - fraction) * path.duration,
        position=fine.position[node:],
        control=fine.control[control:],
        mass=fine.mass[node:],
        start_velocity=slopes,
        multipliers={},
    )
    return first, last
