"""One attempt at a mission, as a value."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from dmoc.basics.records import dataclass
from dmoc.chains.path import MissionPath
from dmoc.chains.program import MissionProgram
from dmoc.ipopt.run import Answer
from dmoc.meshes.cut_off import CutOff, cut_off
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.reference import goal_miss
from dmoc.motion.scales import path_scales
from dmoc.nlp.units import outgrown
from dmoc.results.estimate import local_errors
from dmoc.results.facts import Error, Level
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

    @cached_property
    def passed(self) -> list[CutOff]:
        """What each leg cuts off its limits between its nodes, of the objective."""
        path, stretches = self.path, self.program.mission.stretches
        return [
            cut_off(problem, Dynamics.of(problem), leg, begin).of(cost_scale(self))
            for problem, leg, begin in zip(stretches, path.legs, path.begins, strict=True)
        ]

    def counted(self, error: Error) -> Error:
        """An error together with what all legs cut off."""
        steps, depth = (
            np.concatenate(part) for part in zip(*((p.steps, p.depth) for p in self.passed), strict=True)
        )
        return CutOff(sum(each.cost for each in self.passed), steps, depth).counted(error)

    def to_cut(self, accurate: float, evenly: bool, counts: bool) -> list[np.ndarray]:
        """The errors by which steps are cut; if it `counts`, what a step cuts off its limits is one, too.

        If `evenly`, all are alike where what is left is in no step more than in others.
        """
        errors = self.errors
        if evenly and self.largest_error <= accurate:
            errors = [np.ones_like(each) for each in errors]
        if not counts:
            return errors
        each = zip(errors, self.passed, strict=True)
        return [np.maximum(known, passed.heavy(accurate)) for known, passed in each]

    def out_of_time(self) -> Attempt:
        """The attempt when the time is over: what did not get there has failed, nobody interrupted it."""
        return self if self.solved else replace(self, answer=replace(self.answer, status="failed"))


def change(coarse: Attempt, fine: Attempt) -> float:
    """What the objective changes from mesh to mesh, of itself [-]."""
    return abs(fine.level.objective - coarse.level.objective) / cost_scale(fine)


def cost_scale(attempt: Attempt) -> float:
    """The size of the objective, in its own unit."""
    return max(abs(attempt.level.objective), 1e-12 * attempt.program.cost)


def rounded_to(problem: TransferProblem, rounding: float | None) -> TransferProblem:
    """A leg with |F| rounded at zero over that part of its limit, if it is rounded at all."""
    return problem if problem.actuator.smoothing is None else rounded(problem, rounding)
