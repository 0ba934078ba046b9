"""Which of their limits controls keep to along a path, for actuators that can be told to keep to them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from dmoc.legs.events import Event, Instant, Passed
from dmoc.motion.path import ACTUATOR_ROWS, DiscretePath, Key
from dmoc.results.switches import burns_unpaid, linear_controls
from dmoc.scene.problem import TransferProblem

# An arc in which no limit is kept to.
FREE = "arc"
# An arc of the largest force. Behind a joint where that is turned round its kind has the other word, too.
FULL, REVERSED = "full force", "reversed"
# The largest force is turned round within two gaps between nodes if its directions there have at most this
# cosine [-].
OPPOSED = -0.9
# Words for the limits that are kept to in one arc are joined by this one.
AND = " and "
# The multipliers of the limits of controls have this key.
CONTROL_BOUNDS = Key("control", "column", "force")
# A control is at a limit if it is within this part of its span from it [-].
INSIDE = 0.02
# So many nodes in a row between the limits are a singular arc: a switch takes one or two.
SINGULAR_NODES = 5
# A limit of a control acts at a node if its multiplier is more than this part of the largest one [-].
PUSHES = 1e-4
# A limit that is kept to is in the way, or one that is not acts, where its multiplier is on the wrong side by
# more than this part of the largest one [-].
WRONG_SIDE = 1e-3


def names_of(problem: TransferProblem) -> tuple[tuple[str, str], ...]:
    """The names of the limits that controls may keep to; none where they are not known."""
    return problem.actuator.limit_names(problem.dimension)


def kind_of(names: Sequence[tuple[str, str]], sides: Sequence[int]) -> str:
    """An arc in which limits are kept to, in words; `sides` has -1 or 1 for each that is, 0 for others."""
    return AND.join(name[int(side > 0)] for name, side in zip(names, sides, strict=True) if side) or FREE


def sides_of(problem: TransferProblem, kind: str) -> tuple[int, ...]:
    """The limits that are kept to in an arc of that kind."""
    words = kind.split(AND)
    return tuple((name[1] in words) - (bool(name[0]) and name[0] in words) for name in names_of(problem))


def are_rows(problem: TransferProblem) -> bool:
    """Whether its limits are rows of all controls together, not one of each."""
    return bool(problem.actuator.rows(ca.SX.sym("u", problem.controls)))


def is_linear(problem: TransferProblem) -> np.ndarray:
    """For each limit, whether the cost is linear in what it limits: then controls jump."""
    linear = linear_controls(problem)
    return np.array([linear.all()]) if are_rows(problem) else linear


def pushing(problem: TransferProblem, path: DiscretePath) -> np.ndarray:
    """The multipliers of the limits at all nodes, shape (nodes, limits): positive where an upper one acts."""
    key = ACTUATOR_ROWS if are_rows(problem) else CONTROL_BOUNDS
    found = path.multipliers.get(key)
    return np.zeros((len(path.control), len(names_of(problem)))) if found is None else found


def _acting(problem: TransferProblem, path: DiscretePath, least: float) -> np.ndarray:
    """Which limits act at which nodes: loosening them by their own size changes the objective by `least`."""
    push = np.abs(pushing(problem, path))
    size = 1.0 if are_rows(problem) else problem.actuator.bounds(problem.dimension)[1]
    return (push * size / len(push) > least) & (push > PUSHES * push.max(initial=0.0))


def kinds_along(problem: TransferProblem, path: DiscretePath, least: float) -> np.ndarray:
    """What the controls do at each node, as kinds of arcs.

    A limit of controls that do not jump acts if loosening it by its own size would change the objective by more
    than `least`.
    """
    names = names_of(problem)
    sides = np.sign(pushing(problem, path)) * _acting(problem, path, least)
    shares = _shares(problem, path)
    for i in np.flatnonzero(is_linear(problem)):
        sides[:, i] = np.where(shares[:, i] > 0, 1, -1 if names[i][0] else 0)
        _leave(sides[:, i], np.abs(shares[:, i]) < 1 - 2 * INSIDE, SINGULAR_NODES)
    for column in sides.T:
        _without_single(column)
    return np.array([kind_of(names, row) for row in sides], object)


def _shares(problem: TransferProblem, path: DiscretePath) -> np.ndarray:
    """Where controls are between their limits: -1 at the lower, 1 at the upper one."""
    if are_rows(problem):
        return 2 * np.linalg.norm(path.control, axis=1)[:, None] / (problem.actuator.force_limit() or 1.0) - 1
    lower, upper = problem.actuator.bounds(problem.dimension)
    return (2 * path.control - lower - upper) / (upper - lower)


def _leave(sides: np.ndarray, between: np.ndarray, least: int) -> None:
    """No limit is kept to where a control is between them at so many nodes in a row."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], between.astype(int), [0]])))
    for first, last in edges.reshape(-1, 2):
        if last - first >= least:
            sides[first:last] = 0


def _without_single(sides: np.ndarray) -> None:
    """A single node between two that are alike is as they are."""
    for i in range(1, len(sides) - 1):
        if sides[i - 1] == sides[i + 1]:
            sides[i] = sides[i - 1]


def switch(problem: TransferProblem, path: DiscretePath, node: int) -> float:
    """The part of the way from a node to the next one at which controls that jump pass their middle [-]."""
    for before, after in _shares(problem, path)[node : node + 2].T:
        if before * after < 0:
            return float(before / (before - after))
    return 0.5


def controls_at_limits(
    problem: TransferProblem, kind: str, control: np.ndarray, costate: np.ndarray
) -> np.ndarray:
    """Controls with those at a limit that are kept to in an arc."""
    sides = np.array(sides_of(problem, kind))
    if not sides.any():
        return control
    if are_rows(problem):
        size = np.linalg.norm(control, axis=1)[:, None]
        limit = problem.actuator.force_limit() or 1.0
        # Where it is nearly none the force of least cost is against the costate.
        way = np.where(size > INSIDE * limit, control, -costate[:, : control.shape[1]])
        return limit * way / np.maximum(np.linalg.norm(way, axis=1), np.finfo(float).tiny)[:, None]
    lower, upper = problem.actuator.kept(sides).bounds(problem.dimension)
    return np.clip(control, lower, upper)


@dataclass(frozen=True)
class Continued(Event):
    """Controls go on over a joint where they come to a limit, or leave it, without a jump.

    The time of such a joint changes the cost by the third power of its distance from the best one alone:
    without this condition it is hardly determined.

    Parameters
    ----------
    continued : tuple of int
        Which controls.
    left_behind : bool
        Whether the leg behind is at the limit, which the leg before then need not state for the joint.
    """

    continued: tuple[int, ...]
    left_behind: bool
    keeps_energy = True

    def passed(self, here: Instant, own: Any, speeds: np.ndarray, tiny: float) -> Passed:
        return Passed(here, [])

    def words(self) -> str:
        return "controls go on without a jump"


def continued(problem: TransferProblem, one: str, other: str) -> Iterator[Continued]:
    """What controls do where an arc of one kind becomes one of another kind: those that cannot jump go on."""
    if not (names := names_of(problem)):
        return
    both, linear = (sides_of(problem, one), sides_of(problem, other)), is_linear(problem)
    for entering in (False, True):
        reached = both[entering]
        left = both[not entering]
        which = [i for i in range(len(names)) if reached[i] and not left[i] and not linear[i]]
        if which:
            yield Continued(tuple(range(problem.controls)) if are_rows(problem) else tuple(which), entering)


def lacking(
    problem: TransferProblem,
    kinds: Sequence[str],
    touching: Sequence[bool],
    paths: Sequence[DiscretePath],
    least: float,
) -> tuple[int, str, np.ndarray] | None:
    """The leg in which another limit is kept to, what its controls do there, and by how much at its nodes.

    `touching` says which legs end with the touch of a zone. A limit that is kept to is in the way where its
    multiplier has the sign of the other side; one that is not kept to is to be where it acts, by `least` as in
    `kinds_along`.
    """
    names = names_of(problem)
    pushes = [pushing(problem, path) for path in paths]
    largest = max((float(np.abs(push).max()) for push in pushes if push.size), default=0.0)
    best, most = None, WRONG_SIDE * largest
    for i, (kind, push) in enumerate(zip(kinds, pushes, strict=True)):
        sides = sides_of(problem, kind)
        for limit, side in enumerate(sides):
            wrong = np.maximum(-side * push[:, limit], 0.0) if side else np.abs(push[:, limit])
            wrong = np.where(_acting(problem, paths[i], least)[:, limit], wrong, 0.0)
            # At a joint it is where one limit gives way to another, but not where a zone is touched.
            wrong[[0] * (i > 0 and not touching[i - 1]) + [-1] * (i < len(kinds) - 1 and not touching[i])] = 0.0
            if wrong.max() <= most:
                continue
            new = list(sides)
            new[limit] = _instead(names[limit], side, float(push[int(wrong.argmax()), limit]), problem, limit)
            best, most = (i, kind_of(names, new), wrong), float(wrong.max())
    return best


def _instead(name: tuple[str, str], side: int, push: float, problem: TransferProblem, limit: int) -> int:
    """The side that is kept to in the place of another one."""
    if side == 0:
        return int(np.sign(push))
    return -side if is_linear(problem)[limit] and all(name) else 0


def turned_round(
    problem: TransferProblem, path: DiscretePath, cuts: list[tuple[str, float]], full: Sequence[str]
) -> list[tuple[str, float]]:
    """Kinds of arcs and their ends, with those of `full` force cut where that is turned round, if it is unpaid.

    Between states at rest, say, the costate passes through nothing: the direction jumps, which no step follows.
    """
    force, at, limit = path.control[:, : problem.dimension], path.fractions, problem.actuator.force_limit()
    ball = bool(names_of(problem)) and are_rows(problem) and bool(linear_controls(problem).all())
    if limit is None or problem.dimension < 2 or not (ball or burns_unpaid(problem)):
        return cuts
    nodes = np.flatnonzero(np.linalg.norm(force, axis=1) > 0.5 * limit)
    ways = force[nodes] / np.linalg.norm(force[nodes], axis=1)[:, None]
    middles: list[float] = []
    for apart in (1, 2):
        for i in np.flatnonzero((ways[apart:] * ways[:-apart]).sum(axis=1) < OPPOSED):
            first, last = at[nodes[i]], at[nodes[i + apart]]
            if not any(first < middle < last for middle in middles):
                middles.append(float(0.5 * (first + last)))
    found, begin, back = [], 0.0, False
    for kind, end in cuts:
        inside = [middle for middle in sorted(middles) if begin < middle < end and kind in full]
        for last in [*inside, end]:
            found.append((kind + AND + REVERSED if back and kind in full else kind, last))
            back ^= last != end
        begin, back = end, back and kind in full
    return found


def runs_of(kinds: np.ndarray) -> list[int]:
    """The nodes behind which another kind begins."""
    return [i for i, (one, other) in enumerate(pairwise(kinds)) if one != other]
