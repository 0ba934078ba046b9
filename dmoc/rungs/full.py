"""The largest force throughout, whose direction alone is sought."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.guess.shot import is_full
from dmoc.motion.path import DiscretePath
from dmoc.rungs.rung import Rung
from dmoc.scene.problem import TransferProblem

# Where not the time alone is least, an attempt at full force ends after this many iterations: those that get
# there take 5 to 28.
MOST_AT_FULL = 60


def at_full_force(
    attempt: Callable[..., Rung], problem: TransferProblem, guess: DiscretePath, limits: dict[str, Any]
) -> Rung | None:
    """An answer with the largest force throughout, where a guess is one; else None.

    `attempt` makes one attempt at a problem with options of Ipopt. With the barrier of a limit that acts at
    every node there are two to three times as many iterations and, over many revolutions, MUMPS delays pivots.
    """
    full = problem.actuator.throughout
    if full in (None, problem.actuator) or not (is_full(problem, guess) and _turns_slowly(problem, guess)):
        return None
    few = {} if problem.objective.hurries else {"ipopt.max_iter": MOST_AT_FULL}
    rung = attempt(replace(problem, actuator=full), limits | few)
    return rung if rung.stopped or (rung.solved and gains_nothing(rung, problem)) else None


def _turns_slowly(problem: TransferProblem, guess: DiscretePath) -> bool:
    """Whether the force of a guess nowhere turns by a right angle from node to node, as where it switches."""
    force = guess.control[:, : problem.dimension]
    return bool((np.sum(force[1:] * force[:-1], axis=1) > 0).all())


def gains_nothing(rung: Rung, problem: TransferProblem) -> bool:
    """Whether no smaller force would be better than an answer at full force: then it is one without.

    A floor that the problem itself does not have pushes nowhere: the multipliers of the full force have the
    sign of those of its limit.
    """
    full, own, n = rung.nlp.problem.actuator, problem.actuator, problem.dimension
    u = ca.SX.sym("u", problem.controls)
    raised = full.bounds(n)[0] > own.bounds(n)[0]
    pushed = [rung.nlp.columns["force"].of(rung.answer.lam_x)[:, raised]]
    rows = [new.lower > old.lower for new, old in zip(full.rows(u), own.rows(u), strict=True)]
    if any(rows):
        pushed.append(rung.nlp.rows["actuator"].of(rung.answer.lam_g)[:, np.array(rows)])
    return all((part >= 0).all() for part in pushed)
