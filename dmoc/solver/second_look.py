"""A second look in a fixed time around an attractor: an answer of other revolutions may cost far less."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.guess.coast import VERY_MANY_TURNS
from dmoc.guess.open_ends import OTHER_TURNS, change_without_phase, end_estimates, with_more_turns
from dmoc.guess.starting import angle_around, starting_guess
from dmoc.meshes.choices import COARSEST_NODES, first_path, least_steps
from dmoc.motion.lobatto import scheme
from dmoc.motion.march import force_of
from dmoc.motion.mesh import node_weights, uniform_mesh
from dmoc.motion.path import DiscretePath
from dmoc.parts.forces import FreeForce
from dmoc.parts.objectives import Effort
from dmoc.results.switches import has_linear_controls
from dmoc.rungs.rung import Rung
from dmoc.scene.problem import TransferProblem
from dmoc.solver.ladder import Ladder
from dmoc.solver.mended import NEAR, goal_missed
from dmoc.solver.revolutions import Sounding, promise, solved_from

# In a fixed time another number of revolutions may be better if a path takes more than this many times the
# least effort of a change of its orbit without a phase [-]: of 60 random transfers the ten that cost more than
# a third more than the best one known did (2.2 times or more), and 13 others.
FOR_A_PHASE = 2.0
# It may also be if so many iterations without limits led to a path: others take 2 to 40.
WANDERED = 40
# Paths of other revolutions are looked for at these orders: from the same guess one mesh leads to a path that
# another one misses.
OTHER_ORDERS = (4, 6)
# Another path is worth its solve if it costs less by this part [-]: a coarse mesh is about as much off.
CHEAPER = 0.05
# What a user is told of it.
CHEAPER_WAY = "the first answer cost {}: this one was found in a second look, at other revolutions and meshes"
MISSED_WAY = "a path of other revolutions may cost less, about {}, but led to no answer: try --starts 8"


def cheaper_revolutions(ladder: Ladder, rung: Rung, on: Callable[[Any], DiscretePath]) -> Rung:
    """An answer in a fixed time or, where a second look finds one, a cheaper answer with other revolutions.

    Paths of least effort without a limit of the force are looked for on coarse meshes of another order, from a
    guess of the same and of more and fewer revolutions. From the best one that promises less the problem itself
    is solved; `on` puts a path onto the mesh of the answer. Nothing is tried where what the answer takes goes
    into the change of the orbit, and not into its phase.
    """
    problem = ladder.problem
    if not rung.solved or not _may_be_dear(ladder, rung):
        return rung
    cost = rung.cost
    free = replace(problem, actuator=FreeForce(), objective=Effort())
    enough = FOR_A_PHASE * (_without_phase(problem) or 0.0)
    found: list[Sounding] = []
    for told, guess in _others(free, rung.path.order):
        if (one := _confirmed(ladder, guess, told, cost)) is not None:
            found.append(one)
            if one.effort < enough:
                break
    if not found:
        return rung
    best = min(found, key=lambda one: (one.excess, one.cost))
    # Without limits the path is the answer but for its mesh.
    other = solved_from(ladder, best, rung.path.order, rung.path.hold) if problem.limited else None
    if other is None or other.solved:
        other = ladder.refine_on(on(best.path if other is None else other.path))
    if other.stopped:
        return other
    unit = problem.objective.unit_with(problem.actuator)
    costs = [f"{problem.objective.sense * one:.3g} {unit}".rstrip() for one in (cost, best.cost)]
    if other.solved and other.cost < cost and goal_missed(ladder, other.path) <= NEAR:
        return replace(other, notes=(CHEAPER_WAY.format(costs[0]),))
    # Without the limit a path takes less than with it: that is no other answer.
    missed = best.excess == 0 and not problem.limited
    return replace(rung, notes=(*rung.notes, MISSED_WAY.format(costs[1]))) if missed else rung


def _others(free: TransferProblem, order: int) -> Iterator[tuple[str, DiscretePath]]:
    """Names and guesses of paths of least effort, on other meshes than led to an answer of an order."""
    for other in OTHER_ORDERS:
        base = first_path(free, other)
        if other != order:
            yield f"least effort at order {other}", base
        steps = max(COARSEST_NODES[True] // (other // 2), least_steps(free, base))
        base = starting_guess(free, uniform_mesh(steps), other, False)
        for turns in OTHER_TURNS:
            yield f"least effort with {turns:+d} revolutions", with_more_turns(free, base, turns)


def _confirmed(ladder: Ladder, guess: DiscretePath, told: str, cost: float) -> Sounding | None:
    """The path of least effort from a guess, if it follows the motion and promises less than a cost."""
    free = replace(ladder.problem, actuator=FreeForce(), objective=Effort())
    for graded in (False, True):
        rung = ladder.ask(free, guess, told)
        if not rung.solved:
            break
        one = promise(ladder.problem, rung)
        if one.cost > cost - CHEAPER * abs(cost):
            break
        if goal_missed(Ladder(free), rung.path) <= NEAR:
            return one
        # Where equal steps do not follow a path it may cost anything.
        guess = guess if graded else first_path(free, rung.path.order, guess=rung.path)
    return None


def _may_be_dear(ladder: Ladder, rung: Rung) -> bool:
    """Whether an answer may be one of several that differ in revolutions, and a dear one."""
    problem, path = ladder.problem, rung.path
    ends = (problem.start, problem.goal)
    bare = problem.inertia is None and not problem.links and problem.guess is None
    if not bare or problem.free_duration or problem.attraction.lone is None or problem.dimension == 1:
        return False
    if not all(end.anchored for end in ends) or angle_around(problem, path) > 2 * np.pi * VERY_MANY_TURNS:
        return False
    taken = sum(one.level.iterations for one in ladder.rungs if not one.level.question)
    if not problem.limited and taken > WANDERED:
        return True
    if len(problem.effects) > 1:
        # What an oblate body or the air takes is no matter of the phase: between two states in low orbit that
        # was most of the effort, and the look took 1.6 s for nothing.
        return False
    force = np.linalg.norm(force_of(ladder.dynamics, path), axis=1)
    weights = np.diff(path.mesh) if path.hold else node_weights(path.mesh, scheme(path.order))
    # Least fuel burns in short pieces: only the mean of such a force tells what it does.
    mean = weights @ force if has_linear_controls(problem) else np.sqrt(weights @ force**2)
    least = _without_phase(problem)
    return least is not None and 0.5 * mean**2 * path.duration > FOR_A_PHASE * least


def _without_phase(problem: TransferProblem) -> float | None:
    """The least effort of a change of the orbit alone [N^2 s]; None where an orbit does not change evenly."""
    duration = problem.duration_bounds[0]
    change = change_without_phase(problem, end_estimates(problem, duration))
    return None if change is None else 0.5 * (problem.mass * change) ** 2 / duration
