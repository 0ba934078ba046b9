"""How near two bodies of a team of missions come, phase by phase, at the nodes and between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from dmoc.basics.records import dataclass
from dmoc.meshes.cut_off import CutOff
from dmoc.phases.path import PhasedPath, suffix
from dmoc.phases.timetable import Timetable
from dmoc.results.between import Cut
from dmoc.scene.problem import TransferProblem
from dmoc.teams.cuts import cut_off_between, leapt, team_cuts


@dataclass(frozen=True)
class Phase:
    """What bodies do in a phase, as a team of transfers whose times and masses are known."""

    plan: Timetable
    members: tuple[TransferProblem, ...]

    @property
    def dimension(self) -> int:
        return self.plan.dimension

    def pairs(self) -> list:
        return self.plan.pairs()

    def pair_names(self) -> list[str]:
        return self.plan.pair_names()


def phase_of(plan: Timetable, path: PhasedPath, index: int) -> Phase:
    """The phase of a path."""
    at = range(index, len(path.legs), plan.count)
    states = [(path.begins[i], float(path.legs[i].mass[0]), path.legs[i].duration) for i in at]
    return Phase(plan, tuple(plan.fixed_at(i, *state) for i, state in zip(at, states, strict=True)))


def phased_cuts(plan: Timetable, path: PhasedPath) -> Iterator[Cut]:
    """How far each pair breaks what it keeps, phase by phase; see `dmoc.teams.cuts.team_cuts`."""
    for i in range(plan.count):
        for cut in team_cuts(phase_of(plan, path, i), path.phase(i)):
            yield replace(cut, name=cut.name + suffix(i))


def phased_leaps(plan: Timetable, path: PhasedPath) -> list[np.ndarray]:
    """The steps of each phase in which two bodies come too near between nodes, or one leaps into a zone."""
    return [leapt(phase_of(plan, path, i), path.phase(i)) for i in range(plan.count)]


def phased_cut_off(plan: Timetable, path: PhasedPath) -> CutOff:
    """What bodies cut off the distances that they keep, in all phases, as `dmoc.teams.cuts.cut_off_between`."""
    found = [cut_off_between(phase_of(plan, path, i), path.phase(i), suffix(i)) for i in range(plan.count)]
    steps, depth = (
        np.concatenate(part) for part in zip(*((one.steps, one.depth) for one in found), strict=True)
    )
    return CutOff(sum(one.cost for one in found), steps, depth)
