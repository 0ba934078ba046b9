"""A mended answer: one that an independent integrator does not confirm, or that is flown at another price."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.meshes.choices import ORDER_OF_UNEVEN, trial_path
from dmoc.motion.flown import flown
from dmoc.motion.momenta import end_momenta, node_velocities, velocity_along
from dmoc.motion.path import DiscretePath
from dmoc.motion.reference import MISSED, goal_miss
from dmoc.motion.scales import path_scales
from dmoc.results.between import Cut, cuts
from dmoc.results.estimate import rounded_share
from dmoc.results.flown_cost import unpriced
from dmoc.rungs.rung import Rung
from dmoc.solver.ladder import Ladder

# A mesh on which a zone is cut, or the goal missed, is made finer at most this many times: with twice the steps
# each time that leaves an eighth of their length.
MOST_FINER = 3
# A step whose control is flown at another price than it was planned is cut into this many parts: its share of
# the cost falls with its length.
PARTS = 4
# An answer that misses the goal by less than this part of the path is near the one on a finer mesh [-]: all of
# four such answers led there, in 1 to 4 iterations, and one in six of those that missed it by more.
NEAR = 0.1
# Where the rounding of |F| costs more than this part [-], |F| is rounded less, at most so many times: over a
# tenth of the width before or, where that leads nowhere, over the next part of it [-].
PAID, MOST_SHARPER, SHARES = 1e-3, 4, (0.1, 0.3)

# What a user is told of an answer that was mended, or could not be.
MADE_FINER = "the first mesh was too coarse for this motion: it was made finer"
STILL_MISSED = (
    "the mesh is too coarse for this motion: an independent integrator misses the goal by {:.1g} of the path; "
    "ask for an accuracy, --tol 1e-4 (in Python tol=1e-4), which finds the mesh"
)


def on_shorter_steps(ladder: Ladder, rung: Rung, first: DiscretePath, given: Any) -> tuple[Rung, DiscretePath]:
    """An answer, or why there is none, on steps so short that they are not to blame; and the guess on them."""
    steps = len(first.mesh) - 1
    for _ in range(MOST_FINER):
        if rung.solved or rung.stopped or rung.cause is None or not rung.cause.coarse:
            break
        steps *= 2
        first = trial_path(ladder.problem, first.order, steps, first.hold, given)
        rung = ladder.climb_to(first, given)
    return rung, first


def onto_goal(
    ladder: Ladder, rung: Rung, first: DiscretePath, given: Any, order: int | None, pinned: bool = False
) -> Rung:
    """An answer that an independent integrator confirms, if need be on meshes of twice the steps each.

    An answer that misses the goal by a little is a good start for the next mesh. One that misses it by far is
    an optimum of its mesh alone, and leads to dear ones: then the guess is made anew, from `given` as the first
    one was. `order` is None where it is open, and then no less than 4.
    """
    path, steps = first, len(rung.nlp.mesh) - 1
    for _ in range(MOST_FINER):
        if rung.stopped or not rung.solved or (miss := goal_missed(ladder, rung.path)) <= MISSED:
            break
        if order is None and rung.path.order == 2 and not first.hold:
            order, steps = ORDER_OF_UNEVEN, steps // 2
        steps = 2 * steps
        if miss <= NEAR or pinned:
            known = rung.path
            places = np.linspace(0.0, 1.0, len(known.mesh))
            mesh = np.interp(np.linspace(0.0, 1.0, steps + 1), places, known.mesh)
            finer = ladder.refine_on(known.onto(mesh, order or known.order, known.hold), pinned)
        else:
            path = trial_path(ladder.problem, order or path.order, steps, first.hold, given)
            finer = ladder.climb_to(path, given)
        rung = finer if finer.solved or finer.stopped else rung
    else:
        if rung.solved and (miss := goal_missed(ladder, rung.path)) > MISSED:
            return noted(rung, STILL_MISSED.format(miss))
    return rung if len(rung.nlp.mesh) <= len(first.mesh) else noted(rung, MADE_FINER)


def onto_price(ladder: Ladder, rung: Rung, pinned: bool = False) -> Rung:
    """An answer whose objective is what the control costs that is flown.

    A step in which the polynomial through its nodes breaks the limit of the actuator is flown at another price:
    such steps are cut in four, if need be more than once.
    """
    begun = rung
    for _ in range(MOST_FINER):
        if not rung.solved or _unpriced(ladder, rung) <= MISSED:
            break
        path, broken = rung.path, flown(ladder.dynamics, rung.path).broken
        mesh = shortened(path.mesh, np.flatnonzero(broken), PARTS)
        finer = ladder.refine_on(path.onto(mesh, path.order, path.hold), pinned)
        if not finer.solved:
            return finer if finer.stopped else rung
        rung = finer
    return rung if rung is begun or MADE_FINER in rung.notes else noted(rung, MADE_FINER)


def onto_magnitude(ladder: Ladder, rung: Rung) -> Rung:
    """An answer that hardly pays for the rounding of |F| at zero, as `narrowed`."""

    def again(rung: Rung, share: float) -> Rung:
        sharper = ladder.try_on(rung.path, share * (rung.problem.actuator.smoothing or 0.0))
        return replace(sharper, notes=rung.notes)

    return narrowed(rung, lambda rung: rounded_share(ladder.dynamics, rung.path), again)


def narrowed(made: Any, paid: Callable[[Any], float], again: Callable[[Any, float], Any]) -> Any:
    """An answer of a transfer or of several with |F| rounded less where that costs much.

    The width is a part of the largest thrust, so that one far above what a transfer takes is paid for on the
    whole way: with 1e4 N for a transfer of 1 N s in 4 s that was a third of the cost. `paid` is which part of
    the impulse is paid and not flown [-], and `again` makes an attempt from an answer, with |F| rounded over a
    part of its width.
    """
    for _ in range(MOST_SHARPER):
        if not made.solved or paid(made) <= PAID:
            break
        for share in SHARES:
            tried = again(made, share)
            if tried.solved or tried.answer.status == "stopped":
                break
        if not tried.solved:
            return tried if tried.answer.status == "stopped" else made
        made = tried
    return made


def _unpriced(ladder: Ladder, rung: Rung) -> float:
    return unpriced(ladder.problem, ladder.dynamics, rung.path, rung.level.objective)


def noted(rung: Rung, note: str) -> Rung:
    return replace(rung, notes=(*rung.notes, note))


def is_flyable(ladder: Ladder, rung: Rung) -> bool:
    """Whether an answer is near one on a finer mesh: it cuts no zone, and hardly misses the goal."""
    return not cuts_of(ladder, rung) and goal_missed(ladder, rung.path) <= NEAR


def goal_missed(ladder: Ladder, path: DiscretePath) -> float:
    """By how much an independent integrator misses the goal, over the extent and speed of the path [-].

    Infinite where the motion cannot be integrated.
    """
    _, extent, speed = velocity_and_scales(ladder, path)
    scales = replace(path_scales(path), extent=extent, speed=speed)
    missed = scales.share(*goal_miss(ladder.dynamics, path, ladder.problem.start_time))
    return float(np.nan_to_num(missed, nan=np.inf))


def cuts_of(ladder: Ladder, rung: Rung) -> list[Cut]:
    """What cuts deeper between nodes than is allowed."""
    if not ladder.problem.constraints or not rung.solved:
        return []
    return [cut for cut in all_cuts(ladder, rung.path) if len(cut.steps)]


def all_cuts(ladder: Ladder, path: DiscretePath) -> Iterator[Cut]:
    """How far a path breaks zones and limits on the speed, at its nodes and between them."""
    problem = ladder.problem
    return cuts(problem.constraints, path, *velocity_and_scales(ladder, path), problem.start_time)


def velocity_and_scales(ladder: Ladder, path: DiscretePath) -> tuple[np.ndarray, float, float]:
    """Velocities at the nodes [m/s], and the scales of a path, its extent [m] and its largest speed [m/s]."""
    _, ends = end_momenta(ladder.dynamics, path, ladder.problem.start_time)
    extent, linear = path.diagonal or 1.0, ends[:, path.coordinates.speeds]
    speed = max(float(np.linalg.norm(linear, axis=1).max(initial=0.0)), extent / path.duration)
    return (
        node_velocities(path, velocity_along(ladder.dynamics, path.position[:: path.order // 2], ends)),
        extent,
        speed,
    )


def shortened(mesh: np.ndarray, steps: np.ndarray, parts: int = 2) -> np.ndarray:
    """The mesh with some steps and their neighbours cut into so many parts."""
    steps = np.unique(steps[:, None] + [-1, 0, 1])
    steps = steps[(steps >= 0) & (steps < len(mesh) - 1)]
    places = mesh[steps, None] + np.diff(mesh)[steps, None] * np.arange(1, parts) / parts
    return np.sort(np.append(mesh, places))
