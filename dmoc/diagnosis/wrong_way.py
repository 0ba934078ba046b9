"""A thrust along a line that points the wrong way, though it is a local optimum of the discrete problem.

With a throttle floor the forces that an engine can give along a line are two separate pieces. No small change
leads from one to the other, so that the first-order conditions hold in both. The minimum principle tells them
apart: a thrust of least cost is against the costate of the velocity (D. F. Lawden, Optimal Trajectories for
Space Navigation, 1963). In two and three axes a thrust can turn round, and is not stuck.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_weights, step_nodes
from dmoc.motion.path import DiscretePath
from dmoc.results.solution import Solution
from dmoc.scene.problem import TransferProblem

# Thrusts may point the wrong way near a reversal, in one node or two. To turn the others round must not save
# more than this part of the objective [-].
WORTH = 1e-2
# Thrusts are turned round at most so many times.
MOST_TURNED = 3
Found = TypeVar("Found")
# What to try where no answer is found: limits that would be enough are not to blame then.
STUCK = (
    "along a line an engine with a throttle floor pushes one way or the other, and only at a node can it turn "
    "round: give a Mission with a Leg for each burn, of free durations, or min_thrust=0"
)


def in_two_pieces(problem: TransferProblem) -> bool:
    """Whether the forces of an actuator are two separate pieces of a line."""
    one = problem.actuator
    # A body that turns, or has links, may have other controls by these names.
    line = problem.dimension == 1 and problem.controls == 2 and one.labels(1) == ("x", "throttle")
    return line and bool(one.bounds(1)[0][1] > 0.0)


def wrong_way(leg: Solution) -> tuple[np.ndarray, float]:
    """Where thrusts point the wrong way, one entry a control, and what turning them round saves.

    The second is in the unit of the objective, to first order in the share of the time of each node.
    """
    problem, path = leg.require_problem(), leg.path
    if not in_two_pieces(problem):
        return np.zeros(len(path.control), bool), 0.0
    rule = scheme(path.order)
    costate, mass, weights = leg.costate[:, 0], path.mass, node_weights(path.mesh, rule)
    if path.hold:
        at = step_nodes(len(path.mesh) - 1, rule)
        costate, mass, weights = costate[at].T @ rule.weights, mass[at].T @ rule.weights, np.diff(path.mesh)
    force = np.asarray(leg.force)[:, 0]
    along = costate * force
    saved = 2 * path.duration * weights * np.maximum(along, 0.0) / mass
    return along > 0, float(saved.sum())


def share_of(legs: Iterable[Solution], objective: float) -> float:
    """What turning thrusts round would save, as a part of the objective [-]."""
    saved = sum(wrong_way(leg)[1] for leg in legs)
    return saved / max(abs(objective), np.finfo(float).tiny) if saved else 0.0


def told(share: float) -> str:
    """What is wrong with an answer whose thrusts had better be turned round, and the remedy."""
    return (
        f"thrusts along the line point the wrong way: to turn them round would save about {share:.0%} of the "
        "objective; give a guess of the path, with controls"
    )


def turned_round(
    found: Found,
    legs_of: Callable[[Found], tuple[Sequence[Solution], float]],
    again: Callable[[list[DiscretePath]], Found | None],
    sense: int,
) -> Found:
    """What is found from paths whose thrusts point the other way where they point the wrong one.

    Parameters
    ----------
    found
        An answer.
    legs_of : callable
        Its legs and its objective.
    again : callable
        The answer from other paths of the legs, or None.
    sense : int
        1 if the objective is minimised, -1 if it is maximised.

    Returns
    -------
    found
        The last answer that is better than the one before.
    """
    for _ in range(MOST_TURNED):
        legs, objective = legs_of(found)
        if share_of(legs, objective) <= WORTH:
            break
        other = again([_other_way(leg) for leg in legs])
        if other is None or sense * legs_of(other)[1] >= sense * objective:
            break
        found = other
    return found


def _other_way(leg: Solution) -> DiscretePath:
    """A path whose thrusts are turned round where they point the wrong way, without multipliers."""
    path = replace(leg.path, multipliers={})
    if not in_two_pieces(leg.require_problem()):
        return path
    # The controls are the force and its size.
    return replace(path, control=path.control * np.where(wrong_way(leg)[0][:, None], (-1, 1), 1))
