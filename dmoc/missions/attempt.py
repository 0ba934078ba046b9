"""One attempt at a mission, as a value."""

from __future__ import annotations

from dataclasses import dataclass

from dmoc.chains.path import MissionPath
from dmoc.chains.program import MissionProgram
from dmoc.ipopt.run import Answer
from dmoc.nlp.units import outgrown
from dmoc.results.facts import Level


@dataclass(frozen=True)
class Attempt:
    """One run of Ipopt on one set of meshes."""

    program: MissionProgram
    answer: Answer
    level: Level

    @property
    def solved(self) -> bool:
        return self.answer.status == "solved"

    @property
    def outgrown(self) -> bool:
        """Whether the answer of a leg takes far less than its units were made for."""
        each = zip(self.program.legs, self.path.legs, strict=True)
        return any(outgrown(placed.program.problem, placed.program.units, leg) for placed, leg in each)

    @property
    def path(self) -> MissionPath:
        return self.program.path(self.answer)
