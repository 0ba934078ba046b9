"""The answer of a transfer, found as a mission whose legs are its arcs."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from dmoc.missions.solution import MissionSolution
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


def structured(found: MissionSolution, **more: Any) -> StructuredSolution:
    """An answer of a mission of arcs as that of a transfer, with other fields."""
    return StructuredSolution(**{field.name: getattr(found, field.name) for field in fields(found)} | more)
