"""The program of a team with named unknowns in SI units, for functions that leave the package."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from dmoc.planners.functions import Scene
from dmoc.planners.mission import MissionPlanner, identifiers, scenes_of
from dmoc.planners.numbers import Numbers, numbers_of_team
from dmoc.planners.terms import Term
from dmoc.teams.climb import first_path
from dmoc.teams.program import TeamProgram


class TeamPlanner(MissionPlanner):
    """The program of a team, and what its functions need to speak SI units.

    Bodies stand beside each other as legs do one after the other; mass at the start, start time and a duration
    that is fixed are numbers, not unknowns.
    """

    kind = "team"
    stretch, stretches = "body", "bodies"
    parts = "bodies and of what holds between them"

    @classmethod
    def of(  # type: ignore[override]
        cls, team: Any, order: int | None, steps: int | None, hold: bool, guess: Any = None
    ) -> TeamPlanner:
        """The planner of a team on the mesh of its guess, or on that it is solved on at first."""
        path = first_path(team, order, steps, hold, guess)
        program = TeamProgram.of(team, team.stretches, path)
        return cls(program, path, scenes_of(team.members, path), identifiers(team.names, "body"))

    @cached_property
    def numbers(self) -> Numbers:
        return Numbers(self.mission, numbers_of_team(self.mission, self.names), self._taken)

    def _taken(self, twin: Any) -> list[np.ndarray]:
        """Bounds and parameters of a team that differs in numbers, unchecked."""
        legs = [
            replace(placed, program=replace(placed.program, problem=member))
            for placed, member in zip(self.program.legs, twin.members, strict=True)
        ]
        program = replace(self.program, mission=twin, legs=tuple(legs))
        return [*program.bounds(), program.parameters()]

    def _unknowns(self, scene: Scene) -> list[str]:
        return ["masses"] * scene.burns + ["duration"] * scene.problem.free_duration

    def _called(self, unknown: str) -> str:
        """Start velocities and the like are numbers of a body; those of the path are called otherwise."""
        end, _, rest = unknown.partition("_")
        return f"{rest}_at_{end}" if end in ("start", "goal") else unknown

    @cached_property
    def joints(self) -> dict[str, tuple[int, Term]]:
        """A team has no joints."""
        return {}
