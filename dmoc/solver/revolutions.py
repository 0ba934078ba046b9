"""Free time around an attractor: the number of revolutions is a choice between optima, and each is tried."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dmoc.guess.starting import starting_guess
from dmoc.motion.mesh import uniform_mesh
from dmoc.motion.path import DiscretePath
from dmoc.solver.ladder import Ladder, Rung
from dmoc.solver.meshes import COARSEST_NODES, WIDEST_ROUNDING, least_steps

# Durations are tried at least so close to each other, in revolutions: two optima are about one apart.
SPACING = 0.5
# At most this many durations are tried.
MOST_TRIED = 12
# A try that takes more iterations than this leads nowhere near: others take 15 to 100.
MOST_ITERATIONS = 150
# Where the durations that are allowed differ by less than this, in revolutions, there is nothing to choose.
NO_CHOICE = 0.75


def best_revolutions(ladder: Ladder, hold: bool = False) -> Rung | None:
    """The best answer on a coarse mesh, from guesses of different durations and so of different revolutions.

    None where there is no choice: the duration is fixed, nothing attracts alone, an end leaves its place
    open, or less than a revolution lies between the shortest and the longest duration.
    """
    durations = _durations(ladder)
    if len(durations) < 2:
        return None
    problem, rounded = ladder.problem, ladder.problem.actuator.smoothing is not None
    best: Rung | None = None
    for duration in durations:
        coarse = starting_guess(problem, uniform_mesh(COARSEST_NODES[True]), 2, hold, duration=duration)
        steps = max(COARSEST_NODES[True], least_steps(problem, coarse))
        guess = starting_guess(problem, uniform_mesh(steps), 2, hold, duration=duration)
        rung = ladder.try_on(guess, WIDEST_ROUNDING if rounded else None, MOST_ITERATIONS)
        if rung.stopped:
            return best
        sense = problem.objective.sense
        if rung.solved and (best is None or sense * rung.level.objective < sense * best.level.objective):
            best = rung
    return best


def _durations(ladder: Ladder) -> list[float]:
    """Durations to try [s]; none where there is no choice."""
    problem, attraction = ladder.problem, ladder.problem.attraction
    anchored = problem.start.anchored and problem.goal.anchored
    if not problem.free_duration or problem.guess is not None or attraction.lone is None or not anchored:
        return []
    shortest, longest = problem.duration_bounds
    ends = [end.estimate(problem.start_time)[0] for end in (problem.start, problem.goal)]
    if not np.isfinite(ends).all():
        return []
    revolutions = (longest - shortest) * attraction.rates(np.array(ends)).max() / (2 * np.pi)
    if revolutions < NO_CHOICE:
        return []
    count = int(np.clip(np.ceil(revolutions / SPACING) + 1, 2, MOST_TRIED))
    return np.linspace(shortest, longest, count).tolist()


def without_multipliers(path: DiscretePath) -> DiscretePath:
    """A path as a guess: those multipliers are of another mesh and of a wider rounding of |F|."""
    return replace(path, multipliers={})
