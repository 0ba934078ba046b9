"""Is there a cheaper answer? Each is sought again from other starts, and in other durations.

What is found so is judged like any answer before it counts as cheaper.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from campaign.judge import faults
from campaign.making import Scene
from dmoc import solve, verify
from dmoc.solver.starts import local_optima

# Guesses to start from, and durations to hold it to if it is free [-]: more than two revolutions more or fewer
# come with the durations.
STARTS, DURATIONS = 7, 6


def cheapest(scene: Scene, solution: Any) -> float:
    """How many times as dear an answer is as the cheapest other one that the judge lets pass; at least 1."""
    sense = scene.problem.objective.sense
    best = solution.objective
    for rival in _rivals(scene, solution):
        better = sense * rival.objective < sense * best - 1e-6 * abs(best)
        if better and rival.success and verify(rival).ok and not faults(scene.truth, rival, None):
            best = rival.objective
    if best == solution.objective:
        return 1.0
    ratio = abs(solution.objective / best) if best else np.inf
    return ratio if sense > 0 else 1 / ratio


def _rivals(scene: Scene, solution: Any) -> Iterator[Any]:
    """Answers to the same scene from elsewhere, in the order and with the hold of the answer."""
    kept = {name: value for name, value in scene.options.items() if name in ("order", "hold")}
    problem = scene.problem
    for optimum in local_optima(problem, STARTS, **kept):
        yield solve(problem, guess=optimum.path, **kept)
    shortest, longest = scene.truth.durations
    if shortest < longest:
        for duration in np.linspace(shortest, longest, DURATIONS):
            yield solve(replace(problem, duration=float(duration)), **kept)
