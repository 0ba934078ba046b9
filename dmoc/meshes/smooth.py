"""The mesh on which a smooth transfer meets a tolerance, by what is known of its motion before it is solved."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmoc.guess.starting import starting_guess
from dmoc.meshes.choices import fastest_rates, graded_guess, is_uneven
from dmoc.motion.mesh import uniform_mesh
from dmoc.motion.path import DiscretePath
from dmoc.motion.stability import steps_to_turn
from dmoc.scene.problem import TransferProblem

# At all tolerances this order takes the fewest nodes where nothing switches and no limit sets in.
ORDER = 8
# The motion along the guess is looked at on this many steps of order 2.
SAMPLED = 100
# A mesh has at least this many steps: on eight the linearised motion of a body that spins grew by 6 % a step.
FEWEST = 10
# In N equal steps a motion whose modes have the rates w over the duration T is off by this times the mean of
# (w T)^9 / N^8 [-]: 2e-9 to 6e-9 in four transfers around attractors.
OFF = 3e-9
# Elsewhere by this: 2e-6 to 1e-4 in four other problems.
OFF_ELSEWHERE = 3e-5
# A mesh has at most this many steps before an answer is known: a guess that strays far off tells nothing.
MOST = 2000
# From one answer to the next the steps become at most so many times as many.
MOST_TIMES = 4.0
# The error that is foreseen is this part of the tolerance [-]: the estimate is up to three times the error.
SHARE = 0.2


def smooth_path(problem: TransferProblem, tol: float, guess: Any = None) -> DiscretePath:
    """The guess on a mesh of order 8 that probably meets a tolerance."""
    sample = starting_guess(problem, uniform_mesh(SAMPLED), 2, False, guess)
    rates = fastest_rates(problem, sample)
    uneven = is_uneven(problem, sample)
    if uneven:
        # Steps of a graded mesh turn by equal angles.
        rates = np.full_like(rates, rates.mean())
    count = steps_for(tol, sample.duration * rates, OFF if problem.attraction.sources else OFF_ELSEWHERE)

    def on(steps: int) -> DiscretePath:
        if uneven:
            return graded_guess(problem, steps, ORDER, False, guess)
        return starting_guess(problem, uniform_mesh(steps), ORDER, False, guess)

    first = on(count)
    return on(enough) if (enough := steps_to_turn(first)) > count else first


def steps_for(tol: float, turned: np.ndarray, off: float) -> int:
    """Equal steps of order 8 for modes whose rates at equal times, times the duration, are `turned` [rad]."""
    count = (off * np.mean(turned ** (ORDER + 1)) / (SHARE * tol)) ** (1 / ORDER)
    return int(np.clip(np.nan_to_num(np.ceil(count), nan=FEWEST), FEWEST, MOST))


def finer(path: DiscretePath, error: float, tol: float) -> np.ndarray:
    """The mesh with as many steps as bring an estimated error down to a tolerance."""
    steps = len(path.mesh) - 1
    times = (error / (2 * SHARE * tol)) ** (1 / path.order)
    count = int(np.ceil(steps * min(np.nan_to_num(times, nan=MOST_TIMES), MOST_TIMES)))
    return np.interp(uniform_mesh(count), uniform_mesh(steps), path.mesh)
