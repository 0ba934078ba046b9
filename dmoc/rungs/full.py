"""Least time over very many revolutions: the largest force throughout, whose direction alone is sought."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np

from dmoc.meshes.choices import is_full
from dmoc.motion.path import DiscretePath
from dmoc.rungs.rung import Rung
from dmoc.scene.problem import TransferProblem


def at_full_force(
    attempt: Callable[[TransferProblem], Rung], problem: TransferProblem, guess: DiscretePath
) -> Rung | None:
    """An answer with the largest force throughout, where a guess is that of least time with it; else None.

    `attempt` makes one attempt at a problem. With the barrier of a limit that acts at every node MUMPS delays
    pivots, and Ipopt gets nowhere.
    """
    full = problem.actuator.throughout
    if full is None or not (problem.objective.hurries and is_full(problem, guess)):
        return None
    rung = attempt(replace(problem, actuator=full))
    return rung if rung.stopped or (rung.solved and gains_nothing(rung, problem)) else None


def gains_nothing(rung: Rung, problem: TransferProblem) -> bool:
    """Whether no smaller force would take less time than an answer at full force: then it is one without.

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
