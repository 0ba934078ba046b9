"""Options of Ipopt for a problem on a mesh, chosen by measurement over all problems."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from dmoc.guess.coast import VERY_MANY_TURNS
from dmoc.guess.past_zones import has_sides
from dmoc.ipopt.run import STATUSES
from dmoc.motion.path import DiscretePath
from dmoc.results.flown_cost import mass_worth
from dmoc.results.switches import has_linear_controls
from dmoc.scene.problem import TransferProblem

# Rounding loosens the tolerance to this at most [-]: at 2e-8 the costates of 140 revolutions are 3e-5 of the
# largest off, at 5e-9 1e-6.
LOOSEST = 5e-9
# A body that turns is solved again after a change without these three aids of MUMPS, since all its unknowns are
# near 1: 192 changed starts and masses of nine problems, by 1 % and by 10 %, took 2,575 iterations in place of
# 2,577, and 6 to 21 % less time.
QUICK = {
    "ipopt.mumps_scaling": 0,
    "ipopt.min_refinement_steps": 0,
    "ipopt.fast_step_computation": "yes",
}
# Where this over the number of nodes is the tolerance [-], a gradient by a control is off by less than a check
# allows, which is 1e-5 over a tenth of the mean time of a node. For that the tolerance falls to the second of
# these parts of the rounding at most.
SURE, LEAST_ROUNDING = 3e-7, 0.2
# On more steps less than the rounding is not reached: 200,000 took 4 iterations, not 1, and a million 17.
MOST_SURE = 10_000
# Over very many revolutions propellant hardly depends on where it is burnt: the barrier begins with this
# parameter [-], at which that little counts. From 1e-6 or 1e-4 on it takes 45 iterations, not 25. It is left at
# the limit of every node, and what that adds up to must not grow with their number: it is so much in all.
FLAT, FLAT_IN_ALL = 1e-9, 5e-6


# A mesh follows a fall past an attractor if its longest step is so many times its shortest one [-].
UNEVEN = 20.0
# The barrier parameter with which an answer is carried to a finer mesh. The barrier is a sum over nodes, and on
# many of them a larger one leads the path away from its limits first: among three spheres 6,400 steps take 12
# iterations, from 1e-6 on 41. Over 34 solves of the gallery 1e-7, 1e-8 and 1e-9 took 2,681, 2,666 and 2,668
# iterations, 1e-6 2,751.
CARRIED_BARRIER = 1e-8
# Options that say how far from limits a run begins.
NEAR = tuple(
    f"ipopt.{name}" for name in ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mu_init")
)


def ipopt_alone(options: dict[str, Any] | None) -> bool:
    """Whether a user's options are of Ipopt alone; those of CasADi may ask for a graph of the NLP."""
    return all(name.startswith("ipopt.") for name in options or {})


def advice_of(status: str, options: dict[str, Any] | None = None) -> str:
    """What to try after a status; where the user's own options ended the run, that these let it go on."""
    most = (options or {}).get("ipopt.max_iter")
    if status == "iteration limit" and most is not None:
        return f"options={{'ipopt.max_iter': {most}}} ended it: give more, or leave it out"
    return STATUSES[status].advice


def tolerance(mesh: np.ndarray, degree: int, limited: bool, turns: float = 0.0) -> float:
    """Ipopt's tolerance for scaled rows and gradients [-].

    A row is the momentum of one node, over a share of the duration that falls with the number of steps: for the
    same error of the force the tolerance must fall as well, down to the rounding of positions over the
    shortest step. Without limits the last iterations converge quadratically: another digit or two cost one of
    them at most. Over very many revolutions to an open place on an orbit that place hardly changes the cost,
    and rounding is amplified by the angle passed.
    """
    floor = rounding(mesh, degree)
    if len(mesh) <= MOST_SURE:
        floor = min(floor, max(SURE / (degree * len(mesh)), LEAST_ROUNDING * floor))
    if turns > VERY_MANY_TURNS:
        floor = max(floor, min(floor * 2 * np.pi * turns, LOOSEST))
    return float(max(min(1e-10 if limited else 5e-12, 1e-8 / len(mesh)), floor))


def rounding(mesh: np.ndarray, degree: int) -> float:
    """The rounding of positions over the shortest step [-], in units of the extent over the duration."""
    return float(20 * np.finfo(float).eps * degree / np.diff(mesh).min())


def settings_for(
    problem: TransferProblem,
    mesh: np.ndarray,
    degree: int,
    warm: bool = False,
    carried: bool = False,
    turned: float = 0.0,
) -> dict[str, Any]:
    """Options of Ipopt for a problem on a mesh.

    `warm` if multipliers are known, `carried` if they and the path come from the answer on a coarser mesh,
    `turned` are the revolutions of the path whose chart gives the unknowns, 0 without a chart.
    """
    curved, turns = turned > 0, max(turned, _turns(problem))
    settings: dict[str, Any] = {
        # Limits are kept as they are given: Ipopt would loosen them by 1e-8.
        "ipopt.bound_relax_factor": 0.0,
        "ipopt.tol": tolerance(mesh, degree, problem.limited, turns),
        "ipopt.constr_viol_tol": 1e-6,
        # At some optima the objective does not change in one direction, along which Ipopt would wander on: a
        # run ends after ten iterations without a gain.
        "ipopt.acceptable_iter": 10,
        "ipopt.acceptable_tol": 1e-6,
        "ipopt.acceptable_constr_viol_tol": 1e-10,
        "ipopt.acceptable_obj_change_tol": 1e-10,
        "ipopt.max_iter": 1000,
    }
    settings |= _linear_solver(problem, curved)
    settings |= {} if curved else _barrier(problem, warm, carried)
    if (
        problem.limited
        and not warm
        and (curved or problem.actuator.smoothing is None)
        and turns > VERY_MANY_TURNS
    ):
        # The guess is the optimum but for the mesh. A barrier of the usual size leads it away by revolutions,
        # and over 97 of them in low orbit Ipopt does not come back; from 1e-6 it takes ten iterations.
        flat = curved and _meters(problem)
        size = min(FLAT, FLAT_IN_ALL / (degree * (len(mesh) - 1))) if flat else 1e-6
        settings |= dict.fromkeys(NEAR, size)
        if flat:
            # The answer is that at this barrier: a lower one took 35 of 64 iterations, or 105 of 150 that led
            # nowhere, for 3e-6 of the propellant at most.
            settings["ipopt.mu_target"] = size
    if _falls_past(problem, mesh) and not warm and not _meters(problem):
        # As there: the guess is the path of least effort, and past an attractor Ipopt does not come back to it.
        settings |= dict.fromkeys(NEAR, 1e-6)
    if warm:
        # Values interpolated from a coarser mesh break the equations: from 1e-8 away from a limit the first
        # steps would be cut short. A distance of 1e-3 takes 1,173 iterations, not 1,309, on the last meshes of
        # eleven problems in 42 variants.
        push = 1e-3 if carried and not _falls_past(problem, mesh) else 1e-8
        pushed = ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mult_bound_push")
        barrier = CARRIED_BARRIER if carried else 1e-6
        settings |= {"ipopt.warm_start_init_point": "yes", "ipopt.mu_init": barrier}
        settings |= {f"ipopt.warm_start_{name}": push for name in pushed}
        if problem.turns and not carried:
            settings |= QUICK
    return settings


def _linear_solver(problem: TransferProblem, curved: bool) -> dict[str, Any]:
    """Options for MUMPS, which solves the linear systems."""
    settings: dict[str, Any] = {}
    if curved:
        # Over very many revolutions the steps must be more exact: with MUMPS' other orderings, or without its
        # matching, errors look like negative curvature, and 64 iterations were taken instead of two.
        settings["ipopt.mumps_pivot_order"] = 5
        # With MUMPS' own choice of scaling pivots are delayed: 48 s went into one iteration on 970 steps, and
        # with rows and columns scaled in turn 8 s into all 24.
        settings["ipopt.mumps_scaling"] = 8
        if problem.free_duration and problem.actuator == problem.actuator.throughout:
            # A free duration stands in every row of motion: pivots that are small beside it are delayed, and
            # three iterations on 700 steps took 49 s, like this 1 s. Where the place of arrival hardly counts,
            # 1e-9 makes steps so wrong that Ipopt sees negative curvature: 65 iterations, and not 13.
            settings |= {"ipopt.mumps_pivtol": 1e-7, "ipopt.mumps_pivtolmax": 1e-6}
            # The guess is the answer but for the mesh, and so are the multipliers that follow from it, however
            # large: Ipopt would begin with none, and far off.
            settings["ipopt.constr_mult_init_max"] = 1e10
        elif _meters(problem) and _turns(problem) > VERY_MANY_TURNS:
            # Where thrust is all or nothing pivots are delayed, too: over 200 revolutions the first iteration
            # did not end.
            settings["ipopt.mumps_pivtol"] = 1e-10
    elif problem.limited:
        # With barrier terms MUMPS' default matching delays pivots: it took 8 s instead of 0.15 s an iteration.
        settings["ipopt.mumps_permuting_scaling"] = 0
    return settings


def _turns(problem: TransferProblem) -> float:
    """About the revolutions to an open place around the attractor, at the rate of the start; else 0."""
    place = problem.start.point.fixed()[0][None]
    if problem.attraction.lone is None or problem.goal.anchored or np.isnan(place).any():
        return 0.0
    return float(problem.duration_bounds[0] * problem.attraction.rates(place)[0] / (2 * np.pi))


def _falls_past(problem: TransferProblem, mesh: np.ndarray) -> bool:
    """Whether a path between two states, of known duration, falls past one of several attractors."""
    several = bool(problem.attraction.sources) and problem.attraction.lone is None
    lengths = np.diff(mesh)
    return problem.limited and several and not problem.free_duration and lengths.max() > UNEVEN * lengths.min()


def _meters(problem: TransferProblem) -> bool:
    """Whether the objective counts propellant or thrust, be it by the final mass."""
    return problem.objective.metered or mass_worth(problem) != 0.0


def _comes_to_zero(engine: Any) -> bool:
    """Whether a thrust may be none: where it never is, a barrier that may rise takes twice as long."""
    return getattr(engine, "min_thrust", 0.0) != engine.force_limit()


def _barrier(problem: TransferProblem, warm: bool, carried: bool) -> dict[str, Any]:
    """Options for the barrier parameter, where it is better that it may also rise; none elsewhere."""
    rounded = problem.actuator.smoothing is not None
    if rounded and _meters(problem) and _comes_to_zero(problem.actuator):
        # With |F| rounded at zero, a barrier that only falls takes 3 to 30 times the iterations.
        settings: dict[str, Any] = {"ipopt.mu_strategy": "adaptive", "ipopt.mu_oracle": "probing"}
        # Near the optimum full steps can go to and fro, 2,700 times in one case, each for hardly less violation
        # of the rows: a larger gamma_theta accepts a step only for clearly less. Between paths that cost almost
        # the same the adaptive barrier falls far too soon; held to no decrease, it rises again.
        held = {"ipopt.gamma_theta": 1e-2, "ipopt.adaptive_mu_globalization": "never-monotone-mode"}
        return settings | (held if warm else {})
    if problem.limited and not rounded and warm and not carried:
        # After a change of the start or of a limit this takes 78 iterations instead of 143, over eleven changes
        # of four problems. After a change of the mesh or of the rounding of |F| it would take up to 13 times as
        # many.
        return {"ipopt.mu_strategy": "adaptive"}
    return {}


def barrier_from(problem: TransferProblem, guess: DiscretePath) -> dict[str, Any]:
    """Options for the barrier parameter in a run from a guess, where it is better that it may also rise.

    Where the cost is curved in all controls and their limits are plain numbers this takes a quarter less
    iterations over 35 random scenes, and leads to the same optima; at a limit of |F|, with free times, or with
    costs that are linear in controls up to twice as many. From a way past zones it may lead to the other side.
    """
    if not problem.limited or problem.turns or problem.free_duration or problem.actuator.smoothing is not None:
        return {}
    if problem.actuator.rows(ca.SX.sym("u", problem.controls)) or has_linear_controls(problem):
        return {}
    if has_sides(problem, guess):
        return {}
    return {"ipopt.mu_strategy": "adaptive", "ipopt.mu_oracle": "probing"}
