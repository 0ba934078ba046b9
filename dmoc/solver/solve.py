"""Solve a transfer problem: on a mesh that is asked for, or to an accuracy that is asked for."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmoc.basics.arguments import flag, number, of_kind, short, whole
from dmoc.guess.coast import MANY_TURNS
from dmoc.guess.starting import angle_around, graded_guess, guess_on, is_uneven, starting_guess
from dmoc.motion.lobatto import scheme
from dmoc.motion.path import DiscretePath
from dmoc.nlp.ipopt import Progress, scaled_multipliers
from dmoc.nlp.transcription import check_mesh, transcribe_onto, units_of
from dmoc.results.solution import Solution
from dmoc.scene.problem import TransferProblem
from dmoc.solver.ladder import Climb
from dmoc.solver.tolerance import climb_to_tolerance

DEFAULT_STEPS = {2: 400, 4: 100, 6: 50, 8: 32}
# Steps a revolution, where there are many; at order 2 times the root of their number, as phase errors add up:
# after n revolutions in N steps the goal of `geo_raise` is missed by 141 n^3 / N^2 of the path.
A_TURN = {2: 150, 4: 40, 6: 20, 8: 12}


def solve(
    problem: TransferProblem,
    order: int | None = None,
    steps: int | None = None,
    tol: float | None = None,
    hold: bool = False,
    mesh: Any = None,
    guess: Any = None,
    options: dict[str, Any] | None = None,
    progress: Progress | None = None,
    compiled: bool = False,
) -> Solution:
    """Solve a transfer problem, coarse to fine.

    Parameters
    ----------
    problem : TransferProblem
    order : int
        2 (the default, equation (16)), 4, 6 or 8. Where the guess passes so near an attractor that the
        motion there is five times as fast as elsewhere, steps are equal angles, not equal times, and
        the default is 4; from three revolutions on it is 6.
    steps : int
        Steps of the last mesh; if not given 400, 100, 50, 32 at orders 2, 4, 6, 8, and over many
        revolutions as many as these need. Or `mesh`: the step ends as increasing fractions 0..1.
    tol : float
        Relative error [-] of path and objective to reach instead: mesh, and the order if it is not
        given, follow from it; `steps` is then where to begin.
    hold : bool
        Forces constant over each step.
    guess
        Overrides the problem's own guess: function of time, (times, positions), or a Solution.
    options : dict
        CasADi `nlpsol` options, for example {"ipopt.max_iter": 50}.
    progress : callable
        Called every iteration with (order, steps, iteration, objective, row, violation): the worst
        violated row by name and its scaled size. Return True to stop; what it raises, this raises.
    compiled : bool
        Evaluate the functions of nodes and steps as machine code. The C compiler takes a second or two
        once for a scene and order, then the library is kept (`dmoc.basics.compiled`); it pays in scenes with
        several effects and in repeated solves. Without a compiler nothing changes.

    Returns
    -------
    Solution
        Whether it succeeded or not; `raise_for_status()` raises if not.

    Raises
    ------
    ValueError
        If an argument has no meaning for this problem.
    """
    of_kind("problem", problem, TransferProblem)
    scheme(2 if order is None else order)
    hold = flag("hold", hold)
    if options is not None and not all(isinstance(name, str) for name in of_kind("options", options, dict)):
        raise ValueError(f"options must have names such as 'ipopt.max_iter'; got {short(options)}")
    if steps is not None:
        whole("steps", steps, least=2)
    if progress is not None and not callable(progress):
        raise ValueError(f"progress must be a function; got {short(progress)}")
    climb = Climb(problem, options, progress, compiled)
    if tol is not None:
        if mesh is not None:
            raise ValueError("give mesh or tol, not both: to meet a tolerance the mesh is chosen")
        tol = _tolerance(tol)
        with climb.interrupt:
            return climb_to_tolerance(climb, tol, order, steps, hold, guess)
    first = first_guess(problem, order, steps, hold, guess, mesh)
    with climb.interrupt:
        climb.up_to(first, guess)
    return climb.solution()


def first_guess(
    problem: TransferProblem,
    order: int | None = None,
    steps: int | None = None,
    hold: bool = False,
    guess: Any = None,
    mesh: Any = None,
) -> DiscretePath:
    """The guess on the last mesh; what is not given of order and steps is as the motion needs it."""
    ends = check_mesh(DEFAULT_STEPS[order or 2] if steps is None else steps, mesh)
    first = guess_on(problem, ends, order or 2, hold, guess)
    if mesh is not None:
        return first
    turns = angle_around(problem, first) / (2 * np.pi)
    if steps is None and turns > MANY_TURNS:
        # the error adds up from one revolution to the next
        order = order or (2 if hold else 6)
        steps = max(DEFAULT_STEPS[order], int(turns * A_TURN[order] * (turns**0.5 if order == 2 else 1)))
        first = starting_guess(problem, check_mesh(steps), order, hold, guess)
    if is_uneven(problem, first):
        order = order or (2 if hold else 4)
        return graded_guess(problem, steps or DEFAULT_STEPS[order], order, hold, guess)
    return first


def _tolerance(value: Any) -> float:
    tol = number("tol", value, "-", positive=True)
    if not 1e-11 <= tol <= 0.1:
        raise ValueError(f"tol must lie between 1e-11 and 0.1 [-]; got {tol:g}")
    return tol


def stationarity(problem: TransferProblem, path: DiscretePath) -> float:
    """Largest entry of the scaled gradient of the Lagrangian, over the unknowns that are not fixed [-]."""
    nlp = transcribe_onto(problem, path, units_of(problem, path))
    x, p = nlp.pack(path), nlp.parameters(problem)
    lam_x, lam_g = scaled_multipliers(nlp, path)
    slope = np.array(nlp.assembly.gradient(x, p)[1]).ravel()
    jacobian = nlp.assembly.jacobian(x, p)[1].sparse()
    lbx, ubx, _, _ = nlp.bounds(problem)
    return float(np.abs(slope + jacobian.T @ lam_g + lam_x)[lbx < ubx].max(initial=0.0))
