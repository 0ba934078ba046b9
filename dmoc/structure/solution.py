"""The answer of a transfer, found as a mission whose legs are its arcs."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from dmoc.missions.solution import MissionSolution
from dmoc.scene.impulses import FEWER, MORE, changed
from dmoc.structure.arcs import from_plain
from dmoc.structure.build import mission_of


@dataclass(frozen=True)
class StructuredSolution(MissionSolution):
    """The answer of a `TransferProblem` whose arcs became legs with free ends.

    `problem` is the mission of these legs; `attach` takes the transfer, and makes the mission from it.
    """

    def attach(self, problem: Any) -> MissionSolution:
        """A copy that holds its mission again, after `load`: of the transfer, or that mission itself."""
        mission = problem if hasattr(problem, "joints") else mission_of(problem, from_plain(self.arcs))
        return super().attach(mission)


@dataclass(frozen=True)
class ChangedSolution(MissionSolution):
    """The answer of a mission to which impulses were added, or from which some were taken.

    `problem` is the mission after that; `attach` takes it, or the mission as it was stated.
    """

    def attach(self, problem: Any) -> MissionSolution:
        """A copy that holds its mission again, after `load`: as it was stated, or as it became."""
        alike = hasattr(problem, "plan") and len(problem.plan) == len(self.legs)
        return super().attach(problem if alike else changed(problem, self.arcs))


def changed_solution(found: MissionSolution, **more: Any) -> ChangedSolution:
    """An answer of a mission as that of another one to which impulses were added; `more` are other fields."""
    return ChangedSolution(**{field.name: getattr(found, field.name) for field in fields(found)} | more)


def as_found(found: MissionSolution) -> MissionSolution:
    """A mission's answer from a file, as what made its legs says."""
    if not found.arcs:
        return found
    return changed_solution(found) if found.arcs[0][0] in (FEWER, MORE) else structured(found)


def structured(found: MissionSolution, **more: Any) -> StructuredSolution:
    """An answer of a mission of arcs as that of a transfer, with other fields."""
    return StructuredSolution(**{field.name: getattr(found, field.name) for field in fields(found)} | more)
