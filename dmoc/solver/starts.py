"""More than one answer: the optima that several guesses lead to on a coarse mesh, and where a user's leads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.basics.digits import lasting
from dmoc.basics.quaternions import times, turned_by
from dmoc.basics.records import dataclass
from dmoc.guess.coast import VERY_MANY_TURNS
from dmoc.guess.open_ends import OTHER_TURNS, with_more_turns
from dmoc.guess.past_zones import ways_past
from dmoc.guess.starting import angle_around, starting_guess
from dmoc.meshes.choices import COARSEST_NODES, coarse_to_fine, first_path, followed, least_steps
from dmoc.meshes.widths import WIDEST_ROUNDING
from dmoc.motion.path import DiscretePath
from dmoc.motion.scales import path_scales
from dmoc.nlp.transcription import check_mesh
from dmoc.results.solution import Solution
from dmoc.scene.problem import TransferProblem
from dmoc.solver.ladder import Ladder
from dmoc.solver.mended import is_flyable

# Two answers can be one optimum only if the relative difference of their objectives is at most this [-].
SAME_OBJECTIVE = 1e-4
# Two answers can be one optimum only if their paths differ by less than this part of the extent [-].
SAME_PATH = 1e-2
# An answer from a user's guess is told to be dear if it costs more than this many times what the program's own
# guess leads to [-]: a coarse mesh is a few parts in a hundred off, and optima that differ by less are common.
DEAR = 1.5
# The answer from the program's own guess is looked for in this many iterations: half of what others get.
MOST_COMPARING = 75
# Costs below this part of the problem's unit of cost are next to nothing [-]: the errors of a coarse mesh are
# about as large.
NOTHING = 1e-3


@dataclass(frozen=True)
class Optimum:
    """A local optimum on the coarse mesh.

    Attributes
    ----------
    objective : float
        In the objective's own unit.
    path : DiscretePath or MissionPath
    starts : tuple of str
        The guesses that led to it.
    """

    objective: float
    path: Any
    starts: tuple[str, ...]


def local_optima(
    problem: TransferProblem,
    starts: int,
    order: int | None = None,
    hold: bool = False,
    guess: Any = None,
) -> list[Optimum]:
    """The distinct optima that `starts` guesses lead to, the best first.

    The guesses are the default one, then for a body that turns the turn the other way round, with zones paths
    that bend around each on either side, on links each hinge and rod the other way round and two of them at a
    time, with a lone attractor more and fewer revolutions, then random bends. The same
    numbers are drawn every time.
    """
    base = first_path(problem, order, None, hold, guess)
    if order or base.order == 2:
        steps = max(COARSEST_NODES[True] // (base.order // 2), least_steps(problem, base))
        base = starting_guess(problem, check_mesh(steps), base.order, hold, guess)
    found: list[Optimum] = []
    for _, (name, start) in zip(range(starts), _variants(problem, base), strict=False):
        ladder = Ladder(followed(problem, start))
        with ladder.interrupt:
            rung = ladder.climb_to(start, start)
        if rung.stopped:
            break
        if rung.solved:
            _add(found, Optimum(rung.level.objective, rung.path, (name,)))
    return sorted(found, key=lambda optimum: problem.objective.sense * optimum.objective)


def compared(ladder: Ladder, solution: Solution, hold: bool) -> Solution:
    """An answer from a user's guess, with a warning if the program's own guess leads to a far cheaper one.

    From that guess the problem is solved once, on a coarse mesh, in few iterations; the attempt stands in the
    ladder. Nothing is compared over very many revolutions, where that guess takes long, nor with an answer that
    is good for its mesh alone.
    """
    problem = replace(ladder.problem, guess=None)
    turns = angle_around(problem, solution.path) / (2 * np.pi)
    if not solution.optimal or ladder.interrupt.seen or turns > VERY_MANY_TURNS:
        return solution
    first = first_path(problem, None if solution.order == 2 else solution.order, None, hold)
    order, meshes = coarse_to_fine(problem, first)
    engine: Any = problem.actuator
    if engine.smoothing is not None:
        problem = replace(problem, actuator=replace(engine, smoothing=max(WIDEST_ROUNDING, engine.smoothing)))
    start = starting_guess(problem, meshes[0], order, hold)
    rung = ladder.ask(problem, start, "the program's own guess", MOST_COMPARING)
    solution = replace(solution, ladder=(*solution.ladder, rung.level))
    given, own = solution.objective, rung.level.objective
    if (
        not rung.solved
        or not _is_dear(problem, given, own, rung.nlp.units.cost)
        or not is_flyable(ladder, rung)
    ):
        return solution
    unit = solution.provenance.objective_unit
    costs = [lasting(cost) if unit == "s" else f"{cost:.3g} {unit}".rstrip() for cost in (given, own)]
    told = (
        f"the guess leads to {problem.objective.label} {costs[0]}, the program's own guess to about "
        f"{costs[1]}: leave it out, or give another one"
    )
    return replace(solution, warnings=(*solution.warnings, told))


def _is_dear(problem: TransferProblem, given: float, own: float, unit: float) -> bool:
    """Whether one objective is far worse than another; where next to nothing is paid, `unit` stands in."""
    lost = problem.objective.sense * (given - own)
    return lost > (DEAR - 1) * max(min(abs(given), abs(own)), NOTHING * unit)


def _add(found: list[Optimum], new: Optimum) -> None:
    """Add the start of an optimum to an equal one that was found before, or else the optimum to the list."""
    scales = path_scales(new.path).coordinates
    for i, old in enumerate(found):
        near = abs(new.objective - old.objective) <= SAME_OBJECTIVE * abs(old.objective)
        apart = np.abs(new.path.position - old.path.position).max(axis=0)
        if near and (apart < SAME_PATH * scales).all():
            found[i] = replace(old, starts=old.starts + new.starts)
            return
    found.append(new)


def _variants(problem: TransferProblem, base: DiscretePath) -> Iterator[tuple[str, DiscretePath]]:
    """Names and guesses, without end."""
    yield "default", base
    if problem.inertia is not None:
        yield from _turns(problem, base)
        return
    if linked := bool(problem.links or problem.system is not None):
        # What leads bodies on links is loaded for those alone.
        from dmoc.links.along import other_ways

        yield from ways_past(problem, base)
        for name, position in other_ways(problem, base.fractions):
            yield name, replace(base, position=position)
    lone = problem.attraction.lone
    if lone is not None and problem.dimension > 1:
        for turns in OTHER_TURNS:
            yield f"{turns:+d} revolutions", with_more_turns(problem, base, turns)
    if not linked:
        yield from ways_past(problem, base)
    # The seed is fixed: a second run must find the same optima.
    draw = np.random.default_rng(0)
    extent = float(np.linalg.norm(np.ptp(base.position, axis=0))) or 1.0
    number = 0
    while True:
        number += 1
        waves = np.sin(np.pi * np.outer(base.fractions, [1, 2]))
        bend = waves @ draw.normal(size=(2, problem.size)) * 0.25 * extent
        yield f"bend {number}", replace(base, position=base.position + bend)


def _turns(problem: TransferProblem, base: DiscretePath) -> Iterator[tuple[str, DiscretePath]]:
    """Names and guesses of a body that turns, without end: the other way round, then bends of both."""
    ways = [("", base)]
    if not np.isnan(problem.goal.fixed()[0][-4:]).any():
        other = replace(problem, goal=problem.goal.the_other_way())
        ways.append(("the other way round", starting_guess(other, base.mesh, base.order, base.hold)))
        yield ways[1]
    draw = np.random.default_rng(0)
    number = 0
    places = base.coordinates.places
    while True:
        number += 1
        name, path = ways[number % len(ways)]
        waves = np.sin(np.pi * np.outer(path.fractions, [1, 2]))
        position = path.position.copy()
        position[:, places] += waves @ draw.normal(size=(2, int(places.sum()))) * 0.25 * path.diagonal
        # Bends of a radian or so: a turn may go about another axis than the shortest one.
        for at in path.coordinates.quaternions:
            position[:, at] = times(position[:, at], turned_by(waves @ draw.normal(size=(2, 3))))
        yield f"bend {number}" + (f" of {name}" if name else ""), replace(path, position=position)
