"""One attempt on one mesh, as a value."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dmoc.basics.digits import lasting
from dmoc.motion.path import DURATION, DiscretePath
from dmoc.nlp.ipopt import Answer
from dmoc.nlp.solving import NLP
from dmoc.results.facts import Level
from dmoc.scene.problem import TransferProblem
from dmoc.solver.cause import Cause

# A duration that was kept is told of if another may save more than this part of the objective, to first order
# [-].
WORTH_TELLING = 1e-5


@dataclass(frozen=True)
class Rung:
    """One attempt on one mesh: the NLP, Ipopt's answer, its place in the ladder, the cause of a failure.

    `pinned` says that it kept the duration of its guess, free as that is; `notes` tell a user of the way to it.
    `pull` is by how much it is no optimum since it was held near its guess [-].
    """

    number: int
    problem: TransferProblem
    nlp: NLP
    answer: Answer
    level: Level
    cause: Cause | None = None
    pinned: bool = False
    notes: tuple[str, ...] = ()
    pull: float = 0.0

    @property
    def solved(self) -> bool:
        return self.answer.status == "solved"

    @property
    def stopped(self) -> bool:
        """Whether the user ended it."""
        return self.answer.status == "stopped"

    @property
    def path(self) -> DiscretePath:
        """The path of the answer, with its multipliers."""
        return self.nlp.path(self.problem, self.answer)

    @property
    def gain(self) -> float:
        """What another duration may save, to first order and of the objective, by a change by its own length.

        Zero unless the duration of the guess was kept.
        """
        if not self.pinned:
            return 0.0
        # Where nothing is to be paid, the unit of the cost stands in for it.
        path, cost = self.path, max(abs(self.level.objective), self.nlp.units.cost)
        return float(np.abs(path.multipliers[DURATION]).max() * path.duration / cost)

    def warnings(self) -> tuple[str, ...]:
        """What a user should know of an answer that is right."""
        duration = self.path.duration
        bound = self.problem.limit_of_duration(duration)
        if not self.solved:
            return ()
        if bound is not None:
            other = "shorter" if bound == "shortest" else "longer"
            told = f"the duration ends on its {bound} limit of {lasting(duration, 6)}"
            return (*self.notes, f"{told}: a {other} one may cost less")
        if self.gain > WORTH_TELLING:
            told = f"the duration of {lasting(duration, 6)} was kept as it was: another one may cost less"
            return (*self.notes, told)
        return self.notes
