"""The path of least effort between two states past several attractors, by shooting from coasts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from dmoc.basics.memory import remembered
from dmoc.basics.records import dataclass
from dmoc.scene.problem import TransferProblem
from dmoc.shots.extremal import Extremal, Shot

# The goal is met if no part of the state misses it by more than this, in the units of `Extremal` [-].
MET = 1e-6
# Where a path falls close past an attractor the errors of the integrator grow so that shots end here [-].
NOISE = 1e-3
# A shot counts if it falls short of where its slopes say it leads by less than this part of its step [-].
LINEAR = 0.5
# After one that falls short by less than this part the next step is three times as long [-].
NEARLY_LINEAR = 0.2
# A step is shortened to this part after a shot that does not count [-].
SHORTER = 0.3
# A search ends after this many shots, or with steps of less than this part of the way: of 48 random transfers
# most took 4, and 12 at most.
MOST_SHOTS, SHORTEST = 15, 1e-4
# The effort is the sum over this many places.
PLACES = 2001


@dataclass(frozen=True)
class _Found:
    """An extremal between two states: its first costate, its effort, and whether it was shot from the goal."""

    extremal: Extremal
    costate: np.ndarray
    backward: bool

    def along(self, fractions: np.ndarray) -> tuple[np.ndarray, ...]:
        """Positions [m], velocities [m/s] and forces [N] at increasing fractions of the duration."""
        if not self.backward:
            return self.extremal.along(self.costate, fractions)[:3]
        found = self.extremal.along(self.costate, 1 - fractions[::-1])
        return tuple(part[::-1] for part in found[:3])

    @property
    def effort(self) -> float:
        force = self.along(np.linspace(0.0, 1.0, PLACES))[2]
        return float(np.mean(np.square(force).sum(axis=1)))


def least_effort_past(
    problem: TransferProblem, duration: float, states: tuple[tuple[np.ndarray, np.ndarray], ...]
) -> Callable | None:
    """The path of least effort, without limits, from a state to another; None if none is found.

    It is shot from the coast that leaves the start, and backward in time from the coast that arrives at the
    goal; of two answers the one of less effort is taken. Past an attractor at a small distance the end of a
    shot is nearly linear in its costates, where the places of nodes on a path between are not at all: from a
    good guess Ipopt took hundreds of iterations there. The function that is found gives positions [m],
    velocities [m/s] and forces [N], a row for each of the increasing fractions of the duration it is asked for.
    """
    parts = problem.effects, problem.mass, problem.start_time, duration, states
    # The guess is asked for on several meshes, and the search takes longer than all of them.
    best = remembered(partial(_best, problem, duration, states), "past attractors", *parts)[0]
    return None if best is None else best.along


def _best(problem: TransferProblem, duration: float, states: tuple) -> tuple[_Found | None]:
    later = replace(problem, start_time=problem.start_time + duration)
    ways = (
        (Extremal(problem, duration, states[0]), states[1], False),
        (Extremal(later, -duration, states[1]), states[0], True),
    )
    found = [
        _Found(extremal, costate, backward)
        for extremal, goal, backward in ways
        if (costate := _costate_to(extremal, goal)) is not None
    ]
    return (min(found, key=lambda one: one.effort, default=None),)


def _costate_to(extremal: Extremal, goal: tuple[np.ndarray, np.ndarray]) -> np.ndarray | None:
    """The first costate of the extremal that ends in a state, by Newton's method from a coast."""
    costate, wanted = np.zeros(len(extremal.scales)), np.concatenate(goal) / extremal.scales
    shot, share = _shot(extremal, costate), 1.0
    for _ in range(MOST_SHOTS):
        if shot is None:
            return None
        miss = wanted - shot.state
        error = float(np.abs(miss).max())
        if error < MET or share < SHORTEST:
            return costate if error < NOISE else None
        aim = share * miss
        change = np.linalg.lstsq(shot.state_slopes, aim, rcond=None)[0]
        tried = _shot(extremal, costate + change)
        short = np.inf if tried is None else np.linalg.norm(wanted - tried.state - miss + aim)
        short = short / np.linalg.norm(aim)
        if short < LINEAR:
            shot, costate = tried, costate + change
            share = min(1.0, share * (3.0 if short < NEARLY_LINEAR else 1.5))
        elif error < NOISE:
            return costate
        else:
            share *= SHORTER
    return None


def _shot(extremal: Extremal, costate: np.ndarray) -> Shot | None:
    """A shot; None where the body falls into an attractor."""
    try:
        shot = extremal.shot(costate, limited=False)
    except RuntimeError:
        return None
    return shot if np.isfinite(shot.state).all() and np.isfinite(shot.state_slopes).all() else None
