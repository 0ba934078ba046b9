"""A free time in which motion turns or swings: each revolution or swing may hold an optimum, all are tried."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from dmoc.basics.digits import lasting
from dmoc.basics.records import dataclass
from dmoc.guess.coast import MANY_TURNS, controls_for, with_mass
from dmoc.guess.open_ends import end_estimates, swings
from dmoc.guess.shot import least_effort_to_orbit
from dmoc.guess.starting import guess_duration, starting_guess
from dmoc.meshes.choices import COARSEST_NODES, ORDER_OF_MANY_TURNS, least_steps
from dmoc.meshes.widths import rounding_stages
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_weights, uniform_mesh
from dmoc.motion.path import DiscretePath
from dmoc.parts.forces import FreeForce
from dmoc.parts.objectives import Effort
from dmoc.results.flown_cost import cost_along
from dmoc.rungs.rung import Rung
from dmoc.rungs.tube import led
from dmoc.scene.problem import TransferProblem
from dmoc.solver.ladder import Ladder

# Durations are tried at least so close to each other, in revolutions: two optima are about one apart.
SPACING = 0.5
# A swing may hold two optima, in a short part of it: durations are tried so close to each other, in swings.
OF_A_SWING = 0.2
# At most this many durations are tried.
MOST_TRIED = 16
# Where the durations that are allowed differ by less than this, in revolutions, there is nothing to choose.
NO_CHOICE = 0.1
# A body that cannot go half round in the longest duration, as on an ascent, has no revolutions to choose.
HALF_ROUND = 0.5
# To an orbit as a whole, durations up to this many times the likely one are tried.
LONG = 4.0
# Of two answers whose costs differ by less than this part [-] the shorter one is taken.
ALIKE = 1e-3
# The least effort of a duration is found on at least this many steps of order 6, and on at most five times as
# many.
SOUNDING_STEPS = 20
# A sounding ends after this many iterations, and goes on in tubes: nearly all that get there take 5 to 40.
MOST_SOUNDING = 60
# The duration of the best answer is freed if that may save more than this part of the objective, to first order
# [-].
NOTHING_TO_GAIN = 1e-9
# Where freeing the duration leads nowhere, the path is held as strongly as this [-], one after the other.
HELD = (1e-2, 1e-4, 1e-6)
# The problem itself is solved on a coarse mesh from this many of the durations, the most promising ones.
MOST_SOLVED = 3


@dataclass(frozen=True)
class Sounding:
    """The path of least effort for one duration, and what it promises for the problem itself.

    `excess` is by how much its force in the mean square exceeds the limit [N]. As no force moves the body in
    that time with less in the mean square, a transfer cannot be flown if that is above the limit. `cost` is
    about the objective of the problem along the path, with the sign of a minimum. `pinned` says that the
    problem is to be solved with this duration first; where force costs nothing, the duration is all there is.
    `effort` is that of the path [N^2 s].
    """

    path: DiscretePath
    excess: float
    cost: float
    pinned: bool
    effort: float


def best_revolutions(ladder: Ladder, order: int | None, hold: bool) -> Rung | None:
    """The best answer on a coarse mesh, from paths of different durations and so of different revolutions.

    For each duration the path of least effort without a limit of the force is found, which takes a few
    iterations. The problem itself is solved from those that promise most, first with their durations, then
    with that of the best one freed. None where there is no choice: the duration is fixed, nothing turns or
    swings, an end leaves all open, or the shortest and the longest duration hardly differ.
    """
    problem = ladder.problem
    soundings = [found for duration in _durations(problem) if (found := _sounding(ladder, duration))]
    if len(soundings) < 2:
        return None
    if problem.attraction.lone is None:
        soundings = _valleys(soundings)
    soundings.sort(key=lambda one: (one.excess, one.cost))
    order = order or (2 if hold else ORDER_OF_MANY_TURNS)
    best: Rung | None = None
    for one in soundings[:MOST_SOLVED]:
        # Least effort without a limit costs about as much as the answer to the problem, or more.
        if best is not None and one.cost > best.cost:
            break
        rung = solved_from(ladder, one, order, hold)
        if rung.solved and (best is None or rung.cost < best.cost):
            best = rung
    if best is not None and best.pinned:
        best = _shortest_alike(ladder, best, [one for one in soundings if one.excess == 0], hold)
    if best is None or not best.pinned or best.gain < NOTHING_TO_GAIN:
        return best
    freed = led(ladder.try_on(best.path), ladder.ask, ladder.problem, best.path, ladder.try_on)
    # Where the duration hardly matters Ipopt wanders off.
    freed = freed if freed.solved or freed.stopped else _held(ladder, best.path)
    return freed if freed.solved else best


def _held(ladder: Ladder, start: DiscretePath) -> Rung:
    """An answer near a path, by way of answers that are held near it less and less."""
    for lean in HELD:
        rung = ladder.try_on(start, lean=lean)
        start = rung.path if rung.solved else start
    return rung


def _valleys(soundings: list[Sounding]) -> list[Sounding]:
    """The soundings that promise less than those beside them, each with what a duration near it may promise.

    That is twice as far below it as the lowest place of a parabola through the three: between two soundings the
    cost may fall to next to nothing.
    """
    found = []
    for i, one in enumerate(soundings):
        near = soundings[max(i - 1, 0) : i + 2]
        if any((other.excess, other.cost) < (one.excess, one.cost) for other in near):
            continue
        cost, after = one.cost, [other.path.duration - one.path.duration for other in near]
        if len(near) == 3 and not any(other.excess for other in near):
            bend, slope, _ = np.polyfit(after, [other.cost for other in near], 2)
            cost -= 0.5 * slope**2 / bend if bend > 0 else 0.0
        found.append(replace(one, cost=cost, pinned=False))
    return found


def _shortest_alike(ladder: Ladder, best: Rung, soundings: list[Sounding], hold: bool) -> Rung:
    """An answer that costs as much as the best one and takes less time, if there is one: it does not coast."""
    for one in sorted(soundings, key=lambda one: -one.path.duration):
        if one.path.duration < best.path.duration:
            rung = solved_from(ladder, one, best.nlp.scheme.order, hold)
            if not rung.solved or rung.cost > best.cost + ALIKE * abs(best.cost):
                break
            best = rung
    return best


def solved_from(ladder: Ladder, one: Sounding, order: int, hold: bool) -> Rung:
    """The problem itself from the path of least effort of one duration."""
    steps = max(COARSEST_NODES[True] // (order // 2), least_steps(ladder.problem, one.path))
    guess = one.path.onto(uniform_mesh(steps), order, hold)
    rung = _sharpened(ladder, guess, one.pinned)
    if rung.solved or rung.stopped or not np.isclose(one.cost, one.effort):
        return rung
    near = _without_limits(ladder, guess)
    return rung if near is None else ladder.try_on(near, pinned=one.pinned)


def _without_limits(ladder: Ladder, guess: DiscretePath) -> DiscretePath | None:
    """The path of least effort on the mesh of a guess, if it keeps the limit, with its multipliers.

    It is then an answer. From a guess alone the barriers of limits can lead far away from it.
    """
    problem, limit = ladder.problem, ladder.problem.actuator.force_limit()
    free = replace(problem, duration=guess.duration, actuator=FreeForce(), objective=Effort())
    start = replace(guess, control=guess.control[:, : problem.dimension])
    rung = ladder.ask(free, start, "least effort on this mesh")
    if not rung.solved or (limit or np.inf) < np.linalg.norm(rung.path.control, axis=1).max():
        return None
    control = controls_for(problem, rung.path.control)
    if control is None:
        return None
    same = control.shape == rung.path.control.shape
    known = {key: value for key, value in rung.path.multipliers.items() if same or key.group != "force"}
    return replace(rung.path, control=control, multipliers=known)


def _sharpened(ladder: Ladder, guess: DiscretePath, pinned: bool) -> Rung:
    """An answer on the mesh of a guess, with |F| rounded less and less, if at all."""
    for _, width in rounding_stages([guess.mesh], ladder.problem):
        rung = ladder.try_on(guess, width, pinned=pinned)
        if not rung.solved:
            break
        guess = rung.path
    return rung


def _durations(problem: TransferProblem) -> list[float]:
    """Durations to try [s]; none where there is no choice."""
    shortest, longest = problem.duration_bounds
    if not problem.free_duration or problem.guess is not None:
        return []
    spacing = SPACING
    if problem.attraction.lone is None:
        rate, spacing = swings(problem), OF_A_SWING
    else:
        places = np.array([position for position, _ in end_estimates(problem, shortest)])
        if not np.isfinite(places).all():
            return []
        rate = problem.attraction.rates(places).max() / (2 * np.pi)
        if not (problem.start.anchored and problem.goal.anchored):
            # To an orbit as a whole more revolutions than are likely cost much the same, and the soundings
            # of many take long.
            likely = guess_duration(problem)
            longest = min(longest, LONG * likely)
            if likely * rate > MANY_TURNS:
                return []
    if longest * rate < HALF_ROUND or (longest - shortest) * rate < NO_CHOICE:
        return []
    count = int(np.clip(np.ceil((longest - shortest) * rate / spacing) + 1, 2, MOST_TRIED))
    return np.linspace(shortest, longest, count).tolist()


def _sounding(ladder: Ladder, duration: float) -> Sounding | None:
    """The path of least effort in a duration; None where it was not found in a few iterations.

    To an open place on an orbit Ipopt may wander along it, where a shot that knows the curvature does not.
    """
    free = replace(ladder.problem, duration=duration, actuator=FreeForce(), objective=Effort())
    first = starting_guess(free, uniform_mesh(SOUNDING_STEPS), ORDER_OF_MANY_TURNS, False)
    steps = int(np.clip(least_steps(free, first), SOUNDING_STEPS, 5 * SOUNDING_STEPS))
    guess = starting_guess(free, uniform_mesh(steps), ORDER_OF_MANY_TURNS, False)
    ask = partial(ladder.ask, free, question=f"least effort in {lasting(duration, 6)}", most=MOST_SOUNDING)
    rung = ask(guess)
    if not (rung.solved or rung.stopped):
        shot = least_effort_to_orbit(free, guess.mesh, guess.order, False, duration)
        rung = rung if shot is None else ask(shot)
    rung = led(rung, ladder.ask, free, guess, ask)
    return promise(ladder.problem, rung) if rung.solved else None


def promise(problem: TransferProblem, rung: Rung) -> Sounding:
    """What a path of least effort promises for the problem itself."""
    path, effort = replace(rung.path, multipliers={}), rung.level.objective
    weights = node_weights(path.mesh, scheme(path.order))
    needed = float(np.sqrt(weights @ np.square(path.control).sum(axis=1)))
    limit = problem.actuator.force_limit()
    excess = 0.0 if limit is None else max(0.0, needed - limit)
    control = controls_for(problem, path.control)
    if control is None:
        control = np.zeros((len(path.control), problem.controls))
        return Sounding(replace(path, control=control), excess, effort, problem.free_duration, effort)
    flown = with_mass(problem, replace(path, control=control))
    cost = problem.objective.sense * cost_along(problem, flown)
    paid = cost_along(problem, replace(path, control=0 * control)) != cost_along(problem, flown)
    pinned = problem.free_duration and paid
    most = np.inf if limit is None else limit
    within = control * min(1.0, most / np.linalg.norm(path.control, axis=1).max(initial=0.0))
    return Sounding(replace(path, control=within), excess, cost, pinned, effort)
