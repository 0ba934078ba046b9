"""What a planned flight will tell of numbers, before it is flown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.basics.arguments import of_kind
from dmoc.nlp.placement import fisher
from dmoc.nlp.transcription import unassembled
from dmoc.nlp.units import units_of
from dmoc.parts.information import MASS, Information, constants_of
from dmoc.results.solution import Outcome, Solution


def foresee(solution: Any, unknown: str | Sequence[str], noise: float, every: float) -> dict[str, float]:
    """Standard deviations that `identify` will give numbers after a flight of this plan.

    To first order, with the state at the start unknown and exact forces: the inverse of the Fisher information,
    whose logarithm is the objective `Information`, which says where it comes from. Any plan has one, whatever
    it was made for.

    Parameters
    ----------
    solution : Solution
        Of a transfer of one body that does not turn, with its problem.
    unknown, noise, every
        As for `Information`.

    Returns
    -------
    dict of float
        By the names [SI]; infinite where the flight does not tell them.

    Raises
    ------
    ValueError
        If the solution is not such a one, or there is no such number.
    """
    of_kind("solution", solution, Outcome)
    problem = solution.require_problem()
    if not isinstance(solution, Solution):
        raise ValueError("foresee takes the solution of one transfer, not that of a mission or of a team")
    solution.path.refuse_unusable("solution")
    objective = Information(unknown, noise, every)
    twin = replace(problem, objective=objective)
    program, _ = unassembled(twin, solution.path, units_of(twin, solution.path))
    matrix = fisher(program, solution.path) * solution.duration / (every * noise**2)
    known = {one.name: one.value for one in constants_of(twin.effects)} | {MASS: problem.mass}
    count = len(objective.learns)
    size = np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(matrix / np.outer(size, size))
    hidden = values <= len(matrix) * np.finfo(float).eps
    inverse = (vectors / np.where(hidden, np.inf, values)) @ vectors.T / np.outer(size, size)
    blind = (np.abs(vectors[-count:, hidden]) > np.sqrt(np.finfo(float).eps)).any(axis=1)
    spread = np.where(blind, np.inf, np.sqrt(np.diag(inverse)[-count:]))
    return {name: float(one * abs(known[name])) for name, one in zip(objective.learns, spread, strict=True)}
