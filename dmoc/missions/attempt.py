"""One attempt at a mission, as a value."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dmoc.chains.path import MissionPath
from dmoc.chains.program import MissionProgram
from dmoc.ipopt.run import Answer
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.reference import goal_miss
from dmoc.motion.scales import path_scales
from dmoc.nlp.units import outgrown
from dmoc.results.estimate import local_errors
from dmoc.results.facts import Level
from dmoc.rungs.rung import rounded
from dmoc.scene.problem import TransferProblem


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

    @cached_property
    def path(self) -> MissionPath:
        return self.program.path(self.answer)

    @cached_property
    def errors(self) -> list[np.ndarray]:
        """The error of every step of each leg, of extent and speed [-]."""
        path, stretches = self.path, self.program.mission.stretches
        return [
            local_errors(Dynamics.of(problem), leg, begin)
            for problem, leg, begin in zip(stretches, path.legs, path.begins, strict=True)
        ]

    @property
    def largest_error(self) -> float:
        """The error that the steps of a leg add up to, of the worst leg and of the path [-]."""
        return max(float(each.sum()) for each in self.errors)

    @property
    def missed(self) -> float:
        """By how much the independent integrator misses the goal of a leg, of the worst one [-]."""
        path = self.path
        legs = zip(self.program.mission.stretches, path.legs, path.begins, strict=True)
        return max(
            path_scales(leg).share(*goal_miss(Dynamics.of(problem), leg, begin)) for problem, leg, begin in legs
        )

    def to_cut(self, accurate: float) -> list[np.ndarray]:
        """The errors by which steps are cut: all alike where what is left is in no step more than in others."""
        few = self.largest_error <= accurate
        return [np.ones_like(each) for each in self.errors] if few else self.errors

    def out_of_time(self) -> Attempt:
        """The attempt when the time is over: what did not get there has failed, nobody interrupted it."""
        return self if self.solved else replace(self, answer=replace(self.answer, status="failed"))


def change(coarse: Attempt, fine: Attempt) -> float:
    """What the objective changes from mesh to mesh, of itself [-]."""
    scale = max(abs(fine.level.objective), 1e-12 * fine.program.cost)
    return abs(fine.level.objective - coarse.level.objective) / scale


def rounded_to(problem: TransferProblem, rounding: float | None) -> TransferProblem:
    """A leg with |F| rounded at zero over that part of its limit, if it is rounded at all."""
    return problem if problem.actuator.smoothing is None else rounded(problem, rounding)
