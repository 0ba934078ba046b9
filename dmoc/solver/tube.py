"""A tube around a path of many revolutions, to stay in until the optimum next to it is in sight."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from dmoc.guess.coast import MANY_TURNS
from dmoc.guess.starting import angle_around
from dmoc.motion.path import POSITION_BOUNDS, DiscretePath
from dmoc.parts.constraint import Constraint
from dmoc.scene.problem import TransferProblem

# A node may leave its place in the guess by this part of its distance from the attractor [-], along each axis:
# half of the width of the tube.
WIDTH = 0.4


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
    attractor = problem.attraction.lone
    bare = problem.inertia is None and not problem.constraints
    if attractor is None or not bare or problem.actuator.force_limit() is None:
        return None
    if angle_around(problem, guess) < 2 * math.pi * MANY_TURNS:
        return None
    offset = guess.position - attractor.place(problem.dimension)
    width = WIDTH * np.linalg.norm(offset, axis=1, keepdims=True)
    return replace(problem, constraints=(_Tube(guess.position - width, guess.position + width),))


def out_of_tube(path: DiscretePath) -> DiscretePath:
    """An answer within a tube without the multipliers of the tube, which the problem itself does not have."""
    multipliers = {key: value for key, value in path.multipliers.items() if key != POSITION_BOUNDS}
    return replace(path, multipliers=multipliers)
