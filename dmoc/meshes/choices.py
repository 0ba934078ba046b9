"""How many steps, of which order, on which mesh: every choice that the user leaves open is made here."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.guess.chart import is_curved
from dmoc.guess.coast import MANY_TURNS, VERY_MANY_TURNS
from dmoc.guess.shot import is_full
from dmoc.guess.starting import angle_around, starting_guess
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.mesh import uniform_mesh
from dmoc.motion.momenta import rates_along
from dmoc.motion.path import DiscretePath
from dmoc.motion.stability import TURN_A_STEP, flow_matrices, stable_from, steps_to_turn
from dmoc.nlp.transcription import check_mesh
from dmoc.results.switches import burns_unpaid, corners, is_singular
from dmoc.scene.problem import TransferProblem

# The last mesh has this many steps at each order: they reach an error of about 1e-4 to 1e-6 on a smooth
# transfer.
DEFAULT_STEPS = {2: 400, 4: 100, 6: 50, 8: 32}
# A transfer of many revolutions gets this many steps a revolution at each order. At order 2 that is multiplied
# by the root of the number of revolutions, since errors of the phase add up: after n revolutions in N steps the
# goal of `geo_raise` is missed by 141 n^3 / N^2 of the path.
A_TURN = {2: 150, 4: 40, 6: 20, 8: 12}
# Where the force is the largest throughout nothing switches, and fewer do.
A_TURN_AT_FULL = {8: 8}
# A fall past one of several attractors gets this many steps a radian at each order, and no more than that in
# all: on half as many Ipopt wanders off from the path of least effort itself, on these it stays, in 2 to 5
# iterations.
A_RADIAN = {2: 40, 4: 10, 6: 5, 8: 2.5}
MOST_PAST = {2: 1600, 4: 800, 6: 400, 8: 300}
# A transfer of many revolutions has this order if none is asked for.
ORDER_OF_MANY_TURNS = 6
# A body that turns has this order if none is asked for: at the same cost its attitude is a thousand times as
# exact as at order 2. So has an engine whose propellant is not paid for: few nodes find a reversal at once.
ORDER_OF_TURNING = 4
# From this many revolutions on it has this order: over 97 of them in low orbit six steps of order 8 each miss
# the goal by 1e-4 of the path, seven of order 6, nearly as many nodes, by 1e-2.
MOST_TURNS_OF_ORDER_6, ORDER_OF_MORE_TURNS = 30, 8
# A transfer on which equal steps would be too long near an attractor has this order if none is asked for.
ORDER_OF_UNEVEN = 4
# Where such a one falls so close past one of several attractors that order 4 needs more steps than the default,
# it has this order.
ORDER_OF_DEEP_FALLS = 8

# Held forces are second order whatever the scheme, but motion around an attractor is not: to a tolerance of
# 1e-5 a fall past one took 399 steps of this order and 7,209 of order 2.
ORDER_OF_HELD = 4

# The coarsest mesh has this many nodes, with limits (True) and without (False); up to twice as many are solved
# at once. Limits take many iterations, which are cheap on 100 nodes; without limits 400 nodes at once take no
# longer than 100 and then 400. Past an attractor 800 nodes at once took up to 120 iterations, by 200 nodes 18.
COARSEST_NODES = {True: 100, False: 200}
# With links and limits it is this: first attempts often fail there, and cost half as much on so few nodes.
COARSEST_LINKED = 50
# Each mesh has up to this many times the nodes of the one before, with limits (True) and without (False).
FINER = {True: 4, False: 16}
# The coarse mesh of a problem without limits has this order: its motion is smooth, and the answer is nearer to
# the last one than those of finer meshes of order 2.
SMOOTH_ORDER = 6
# A coarse mesh gets at most this many steps to keep h omega below 1: the rates along a guess that strays far
# off mean nothing.
MOST_COARSE = 400
# A coarse mesh of order 2 has at least this many steps times n^1.5 for n revolutions: its phase is then roughly
# right.
IN_PHASE = 50
# A coarse mesh of higher order has at least this many steps a revolution where there are very many: with fewer
# its optima are others.
COARSE_TURN = {4: 16, 6: 10, 8: 6}

# A solve to a tolerance begins with a trial of this order, if none is asked for.
TRIAL_ORDER = 4
# The trial has this many steps, if no number is given and the motion along the guess does not need more.
TRIAL_STEPS = 20

# Equal steps are too long if the rate of the motion around attractors varies by more than this factor along the
# guess.
UNEVEN = 5.0
# The angle around attractors is summed up over this many steps of a guess before its mesh is graded.
SAMPLES = 1000
# It is summed up anew over steps of equal angles, at most so many times in all, until none of them turns by
# more than this many times their mean [-]: between two of the equal times a body may fall past an attractor and
# leave.
GRADED, EVEN = 4, 10.0
# A guess for a mesh of more than twice this many nodes is made on this many nodes and interpolated.
GUESSED = 2000
# A guess is interpolated only if it has at least this many nodes a revolution.
NODES_A_TURN = 100


def first_path(
    problem: TransferProblem,
    order: int | None = None,
    steps: int | None = None,
    hold: bool = False,
    guess: Any = None,
    mesh: Any = None,
) -> DiscretePath:
    """The guess on the last mesh; order and steps that are not given are those that the motion needs."""
    asked, unpaid = order, steps is None and mesh is None and burns_unpaid(problem)
    if (problem.turns or problem.links or unpaid) and not hold:
        order = order or ORDER_OF_TURNING
    ends = check_mesh(DEFAULT_STEPS[order or 2] if steps is None else steps, mesh)
    first = guess_on(problem, ends, order or 2, hold, guess)
    if mesh is not None:
        return first
    if steps is None and (enough := steps_to_turn(first)) > len(first.mesh) - 1:
        return starting_guess(problem, check_mesh(enough), first.order, hold, guess)
    turns = angle_around(problem, first) / (2 * np.pi)
    errors_add_up = turns
    if steps is None and (fastest := _unstable_angle(problem, first)):
        turns, errors_add_up = fastest / (2 * np.pi), 1.0
    if steps is None and turns > MANY_TURNS:
        many = ORDER_OF_MANY_TURNS if turns < MOST_TURNS_OF_ORDER_6 else ORDER_OF_MORE_TURNS
        # Over many revolutions no thrust is reversed.
        order = asked if unpaid else order
        order = order or (2 if hold else many)
        a_turn = A_TURN_AT_FULL.get(order, A_TURN[order]) if is_full(problem, first) else A_TURN[order]
        steps = max(DEFAULT_STEPS[order], int(turns * a_turn * (errors_add_up**0.5 if order == 2 else 1)))
        first = starting_guess(problem, check_mesh(steps), order, hold, guess)
    if is_uneven(problem, first):
        if order is None:
            order = 2 if hold else ORDER_OF_UNEVEN
            if not hold and steps_past(problem, first, order) > DEFAULT_STEPS[order]:
                order = ORDER_OF_DEEP_FALLS
        enough = max(DEFAULT_STEPS[order], steps_past(problem, first, order))
        return graded_guess(problem, steps or enough, order, hold, guess)
    return first


def _unstable_angle(problem: TransferProblem, guess: DiscretePath) -> float:
    """The angle [rad] of a linear motion on which the steps of a guess are unstable; else 0."""
    dynamics, longest, steps = Dynamics.of(problem), problem.duration_bounds[1], len(guess.mesh) - 1
    stable, angle = stable_from(dynamics, guess, problem.start_time, longest, steps)
    return angle if stable > steps else 0.0


def trial_path(
    problem: TransferProblem, order: int, steps: int | None, hold: bool, guess: Any = None
) -> DiscretePath:
    """A guess for the trial of a tolerance, with as many steps as the motion along it needs."""

    def on(count: int) -> DiscretePath:
        first = starting_guess(problem, check_mesh(count), order, hold, guess)
        return graded_guess(problem, count, order, hold, guess) if is_uneven(problem, first) else first

    first = on(steps or TRIAL_STEPS)
    stable, _ = stable_from(Dynamics.of(problem), first, problem.start_time, problem.duration_bounds[1])
    followed = max(steps_to_turn(first), steps_past(problem, first, order))
    enough = max(2 * least_steps(problem, first), 2 * stable, followed)
    return on(enough) if steps is None and enough > TRIAL_STEPS else first


def guess_on(
    problem: TransferProblem, mesh: np.ndarray, order: int, hold: bool, given: Any = None
) -> DiscretePath:
    """A starting guess; for very many steps it is made on fewer that follow its revolutions, and carried."""
    fewer = mesh[np.linspace(0, len(mesh) - 1, GUESSED // (order // 2) + 1).round().astype(int)]
    if given is None and problem.guess is None and len(mesh) > 2 * len(fewer):
        found = starting_guess(problem, fewer, order, hold)
        if angle_around(problem, found) < 2 * np.pi * GUESSED / NODES_A_TURN:
            return found.onto(mesh, order, hold)
    return starting_guess(problem, mesh, order, hold, given)


def is_uneven(problem: TransferProblem, path: DiscretePath) -> bool:
    """Whether a path comes so much nearer to an attractor that equal steps would be too long there."""
    rates = problem.attraction.rates(path.place)
    return bool(rates.max() > UNEVEN * rates.min())


def steps_past(problem: TransferProblem, path: DiscretePath, order: int) -> int:
    """Steps of equal angles that follow a body which falls past one of several attractors; 0 elsewhere."""
    if problem.attraction.lone is not None or not is_uneven(problem, path):
        return 0
    return int(min(A_RADIAN[order] * angle_around(problem, path), MOST_PAST[order]))


def graded_guess(
    problem: TransferProblem, steps: int, order: int, hold: bool, given: Any = None
) -> DiscretePath:
    """A guess whose steps turn by equal angles around attractors: h ~ r^1.5."""
    sampled, density = uniform_mesh(SAMPLES), np.full(SAMPLES, float(SAMPLES))
    for _ in range(GRADED):
        fine = starting_guess(problem, sampled, 2, hold, given)
        rates = problem.attraction.rates(fine.place)
        turned = (rates[1:] + rates[:-1]) / density
        angles = np.append(0.0, np.cumsum(turned))
        mesh = np.interp(np.linspace(0.0, 1.0, steps + 1), angles / angles[-1], fine.fractions)
        if turned.max() < EVEN * turned.mean() or problem.attraction.lone is not None:
            break
        sampled = np.interp(uniform_mesh(SAMPLES), angles / angles[-1], sampled)
        density = 1 / np.diff(sampled)
    return starting_guess(problem, mesh, order, hold, given)


def coarse_to_fine(problem: TransferProblem, first: DiscretePath) -> tuple[int, list[np.ndarray]]:
    """The order of the coarse meshes, and all meshes up to that of a first guess.

    The coarsest has 100 or 400 nodes, or as many as keep h omega below 1 on the guess: a mesh that
    cannot follow the motion has optima of its own. Over many revolutions that takes more at order 2,
    where errors of the phase add up. In the unknowns of a chart the last mesh is solved at once.
    """
    final, limited = first.mesh, problem.limited
    if is_curved(problem, first):
        return first.order, [final]
    order = first.order if limited or first.hold else max(first.order, SMOOTH_ORDER)
    counts = [(len(final) - 1) * (first.order // 2)]
    least = COARSEST_LINKED if problem.links and limited else COARSEST_NODES[limited]
    if counts[0] > 2 * least:
        turns = angle_around(problem, first) / (2 * np.pi)
        a_turn = order // 2 * COARSE_TURN[order] if order > 2 and turns > VERY_MANY_TURNS else 0
        in_phase = IN_PHASE * turns**1.5 if order == 2 else a_turn * turns
        turned = order // 2 * int(steps_to_turn(first) * TURN_A_STEP[first.order] / TURN_A_STEP[order])
        past = order // 2 * steps_past(problem, first, order)
        least = max(least, order // 2 * least_steps(problem, first), int(in_phase), turned, past)
    while counts[-1] > 2 * least:
        counts.append(max(least, -(-counts[-1] // FINER[limited])) if order == first.order else least)
    places = np.linspace(0.0, 1.0, len(final))
    steps = [count // (order // 2) for count in reversed(counts[1:])]
    return order, [*(np.interp(uniform_mesh(count), places, final) for count in steps), final]


def least_steps(problem: TransferProblem, path: DiscretePath) -> int:
    """Steps that keep h omega below 1 along a path, omega the fastest rate of the linearised motion.

    They are equal ones, more than enough if they will be short where the motion is fast; past one of several
    attractors, where that would be far more, they are those of the mesh of the path.
    """
    mesh = uniform_mesh(min(100, len(path.mesh) - 1))
    falls = problem.attraction.lone is None and is_uneven(problem, path)
    if falls:
        mesh = np.interp(mesh, np.linspace(0.0, 1.0, len(path.mesh)), path.mesh)
    fastest = fastest_rates(problem, path.onto(mesh, 2, path.hold))
    if falls:
        h = (len(mesh) - 1) * np.diff(mesh)
        fastest = fastest * np.maximum(np.append(h, 0.0), np.append(0.0, h))
    return int(np.clip(path.duration * fastest.max(), 2, MOST_COARSE))


def fastest_rates(problem: TransferProblem, path: DiscretePath) -> np.ndarray:
    """The rate of the fastest mode of the linearised motion at each node of a path of order 2 [1/s]."""
    slopes = np.gradient(path.position, path.duration * path.fractions, axis=0)
    dynamics = Dynamics.of(problem)
    flow = flow_matrices(dynamics, path, problem.start_time, rates_along(dynamics, path.position, slopes))
    rates = np.linalg.eigvals(flow) if np.isfinite(flow).all() else np.full((1, 1), np.inf)
    # A mode that dies out need not be followed.
    return np.maximum(rates.real, np.abs(rates.imag)).max(axis=-1)


def best_order(problem: TransferProblem, path: DiscretePath, objective: float, tol: float) -> tuple[int, str]:
    """The order that pays for a tolerance, by an answer on a coarse mesh and its objective, and why."""
    if path.hold:
        if problem.attraction.sources:
            return ORDER_OF_HELD, "held forces, and motion that is better followed than by order 2"
        return 2, "held forces are second order whatever the scheme"
    if is_singular(problem, path):
        return 2, "controls stay between their limits where no cost decides on them"
    if len(corners(problem, path, objective)):
        return 4, "controls switch or limits set in"
    return next(order for order, loosest in ((4, 1e-3), (6, 1e-5), (8, 0.0)) if tol >= loosest), "smooth"


def with_as_many_nodes(path: DiscretePath, order: int) -> np.ndarray:
    """The mesh of a path for another order, with about as many nodes and at least eight steps."""
    steps = max(8, (len(path.mesh) - 1) * path.order // order)
    places = np.linspace(0.0, 1.0, len(path.mesh))
    return path.mesh if order == path.order else np.interp(np.linspace(0.0, 1.0, steps + 1), places, path.mesh)


def followed(problem: TransferProblem, given: Any) -> TransferProblem:
    """The problem whose goal has the sign of its quaternion to which a former path leads."""
    path = getattr(given, "path", given)
    if not isinstance(path, DiscretePath) or not path.attitudes:
        return problem
    if problem.system is not None:
        return replace(problem, goal=problem.goal.led_to(path.position[-1]))
    ends = (problem.start.fixed()[0][-4:], problem.goal.fixed()[0][-4:])
    signs = [np.sign(path.attitudes[0][place] @ end) for place, end in zip((0, -1), ends, strict=True)]
    # NaN, where an end leaves its attitude open, is not less than 0.
    return replace(problem, goal=problem.goal.the_other_way()) if signs[0] * signs[1] < 0 else problem
