"""Tubes around paths: Ipopt stays near its guess in one, and from tube to tube a path walks to an optimum."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dmoc.basics.records import dataclass
from dmoc.guess.coast import MANY_TURNS
from dmoc.guess.starting import angle_around
from dmoc.motion.path import POSITION_BOUNDS, DiscretePath
from dmoc.parts.constraint import Constraint
from dmoc.rungs.rung import Rung
from dmoc.scene.problem import TransferProblem

# A node may leave its place in the guess by this part of its distance from the attractor [-], along each axis:
# half of the width of the tube.
WIDTH = 0.4
# Past one of several attractors it is this part of the distance from the next one [-]: with 0.4 falls that lead
# somewhere with this wandered.
WIDTH_OF_FALLS = 0.1
# On a walk an attempt in a tube ends after this many iterations: those that get there take 10 to 50.
MOST_IN_A_TUBE = 60
# After an attempt that got there the next tube is so many times as wide, after another one [-].
WIDER, NARROWER = 1.5, 0.3
# A walk ends after this many tubes, 20 of which are many, or where one of this part of the first width leads
# nowhere [-].
MOST_TUBES, NARROWEST = 50, 0.03
# A path that stays within this part of its tube is an optimum without it [-].
INSIDE = 0.999
# A tube that is left at once is left halfway: Ipopt ends at the optimum for this parameter of the barrier [-],
# and goes on without the tube from there. On six meshes of `dionysus` that took half the work; from 1e-5 or
# 1e-4 four of them wandered first.
BARRIER = 1e-6
HALFWAY = {"ipopt.mu_target": BARRIER, "ipopt.tol": 10 * BARRIER}
# Those that get there from it take 35 to 91 iterations; what takes longer walks.
FROM_HALFWAY = {"ipopt.mu_init": BARRIER, "ipopt.max_iter": 100}
# What a rung of a walk is called.
ON_THE_WALK = "in a tube around the path before"


@dataclass(frozen=True)
class _Tube(Constraint):
    """Each node stays in a box around its place on a path, of shape (nodes, dimension) [m]."""

    lower: np.ndarray
    upper: np.ndarray

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        return self.lower, self.upper

    def excess(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.zeros(len(q))

    def words(self) -> str:
        return "stays near a path"


def in_tube(problem: TransferProblem, guess: DiscretePath) -> TransferProblem | None:
    """The problem with a tube around a guess, where that helps: limited forces, many revolutions.

    From a guess alone Ipopt's first steps go far; over many revolutions that leads to places from which it
    takes a thousand iterations to come back, or to another optimum. Of 16 guesses and meshes of `dionysus`
    5 converged within 300 iterations without the tube, all 12 that were tried with it in 80.
    """
    if problem.attraction.lone is None or problem.actuator.force_limit() is None:
        return None
    return around(problem, guess) if angle_around(problem, guess) >= 2 * np.pi * MANY_TURNS else None


def around(problem: TransferProblem, path: DiscretePath, width: float = 1.0) -> TransferProblem | None:
    """The problem with a tube of so many times the usual width around a path.

    None where nothing attracts, or other constraints are kept.
    """
    sources = problem.attraction.sources
    if not sources or problem.inertia is not None or problem.links or problem.constraints:
        return None
    width *= WIDTH if len(sources) == 1 else WIDTH_OF_FALLS
    away = [np.linalg.norm(path.position - one.place(problem.dimension), axis=1) for one in sources]
    reach = width * np.min(away, axis=0)[:, None]
    return replace(problem, constraints=(_Tube(path.position - reach, path.position + reach),))


def out_of_tube(path: DiscretePath) -> DiscretePath:
    """An answer within a tube without the multipliers of the tube, which the problem itself does not have."""
    multipliers = {key: value for key, value in path.multipliers.items() if key != POSITION_BOUNDS}
    return replace(path, multipliers=multipliers)


def walked(ask: Callable[..., Rung], problem: TransferProblem, guess: DiscretePath) -> DiscretePath | None:
    """An optimum, by answers each of which lies in a tube around the one before; None if none is found.

    Each is cheaper than the one before, and in a tube Ipopt does not go where it would have to come back from:
    a trust region (A. R. Conn, N. I. M. Gould and Ph. L. Toint, 2000) in which each step is an NLP. `ask` makes
    an attempt, as `Ladder.ask` does.
    """
    path, width = replace(guess, multipliers={}), 1.0
    for _ in range(MOST_TUBES):
        tube = around(problem, path, width)
        if tube is None or width < NARROWEST:
            return None
        rung = ask(tube, path, ON_THE_WALK, MOST_IN_A_TUBE)
        if rung.stopped:
            return None
        if not rung.solved:
            path, width = replace(path, multipliers={}), NARROWER * width
            continue
        low, high = tube.constraints[0].bounds(problem.dimension)
        found = out_of_tube(rung.path)
        moved = np.abs(found.position - path.position) / np.maximum(0.5 * (high - low), np.finfo(float).tiny)
        if moved.max() < INSIDE:
            return found
        path, width = found, WIDER * width
    return None


def led(
    rung: Rung,
    ask: Callable[..., Rung],
    problem: TransferProblem,
    guess: DiscretePath,
    again: Callable[[DiscretePath], Rung],
) -> Rung:
    """An attempt from a guess or, where it leads nowhere, another one (`again`) from the end of a walk."""
    if rung.solved or rung.stopped:
        return rung
    path = walked(ask, problem, guess)
    return rung if path is None else again(path)
