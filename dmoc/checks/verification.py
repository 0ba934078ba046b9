"""The checks of a solution: one number, unit and limit each, none of them taken on Ipopt's word."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from dmoc.basics.arguments import entries, of_kind, short
from dmoc.basics.digits import lasting
from dmoc.basics.memory import unchanged
from dmoc.checks.balances import amplification, balance, energy_gap, misses
from dmoc.checks.evidence import ROUNDING, Evidence
from dmoc.checks.limits import excesses
from dmoc.checks.optimality import stationarity
from dmoc.checks.report import Check as Check
from dmoc.checks.report import Report as Report
from dmoc.diagnosis.wrong_way import WORTH, share_of, told
from dmoc.motion.march import node_masses, rollout
from dmoc.motion.reference import MISSED, apart, goal_miss
from dmoc.motion.stability import growth_along
from dmoc.results.estimate import rounded_share
from dmoc.results.facts import optimality_limit
from dmoc.results.flown_cost import unpriced
from dmoc.results.solution import Solution
from dmoc.scene.problem import TransferProblem

# A row of motion, as a force, may be off by this part of the largest force of actuator or scene [-].
RESIDUAL = 1e-6
# The scheme marched forward may miss the path by this part of its extent and speed [-], times the factor by
# which the path amplifies errors: the optimiser's errors grow on the way, too.
ROLLOUT = 1e-8
# The scheme marched forward may never miss the path by more than this part of it [-], however unstable it is.
ROLLOUT_MOST = 1e-3
# Momentum, mass and the reported arrays may be off by this part of themselves [-]: they are exact sums.
LEDGER = 1e-8
# The square of a quaternion's length less 1 may be off by this [-]: Ipopt meets rows to a tolerance.
CONSTRAINT = 1e-10
# A body may turn by less than this between neighbouring nodes [rad]: beyond it the scheme has other solutions.
TURN_MOST = np.radians(90)


@unchanged()
def verify(
    solution: Solution,
    problem: TransferProblem | None = None,
    more: Sequence[Callable[[Evidence], Check]] = (),
) -> Report:
    """Check a solution, without a look at the optimiser's own verdict on it.

    Parameters
    ----------
    solution : Solution
    problem : TransferProblem, optional
        The problem it answers, if it is not the solution's own.
    more : sequence of functions
        Checks of your own: each takes the `Evidence` and gives a `Check`, best by `Check.of`.

    Returns
    -------
    Report
        residual : largest defect of the discrete Euler-Lagrange equations, as a force [N];
        rollout : the same scheme marched forward from the start, against the path, as a fraction of
        its extent and of its peak speed; reference : the same at the goal for an independent
        integrator of the equations of motion (DOP853); ledger : change of momentum against impulse,
        of mass against propellant, of energy against work, and whether the velocities and forces
        reported are those of the path; bounds : the worst excess over a limit and the worst miss of a
        boundary condition, at the nodes and between them; optimality : the first-order conditions
        with the solution's multipliers (for least effort lambda = -m F where no limit of the force
        acts), and whether the objective is the cost of the path; stability : growth of the one-step
        matrix over that of the exact flow. A number that is not finite fails.

    Raises
    ------
    ValueError
        If the solution has no problem and none is given, or one that does not fit it; if one of `more`
        gives no `Check`, or one whose name is taken.
    """
    of_kind("solution", solution, Solution)
    if problem is not None:
        solution = solution.attach(problem)
    begun = time.perf_counter()
    with np.errstate(all="ignore"):
        evidence = Evidence(solution)
        undefined = evidence.undefined()
        held = evidence.path.attitudes or evidence.problem.links
        ours = [(name, check) for name, check in CHECKS.items() if held or check is not _constraint]
        wanted = [*ours, *own_checks(more)]
        checks = tuple(not_finite(name, undefined) if undefined else check(evidence) for name, check in wanted)
    if not undefined:
        refuse_twins(checks)
    return Report(checks, time.perf_counter() - begun)


def not_finite(name: str, what: str) -> Check:
    """A check that fails since something is no number."""
    return Check(name, np.inf, 0.0, "-", False, f"not a finite number: {what}")


def own_checks(more: Any) -> list[tuple[str, Callable[[Evidence], Check]]]:
    """Checks of the user's own, by the names of their functions until they have told theirs."""
    given = entries(more)
    if given is None or not all(map(callable, given)):
        raise ValueError(f"more must be functions of the evidence that give a dmoc.Check; got {short(more)}")

    def told(name: str, check: Callable[[Evidence], Any], evidence: Evidence) -> Check:
        return of_kind(f"what the check {name!r} gives", check(evidence), Check)

    names = [getattr(check, "__name__", type(check).__name__) for check in given]
    return [(name, partial(told, name, check)) for name, check in zip(names, given, strict=True)]


def refuse_twins(checks: Sequence[Check]) -> None:
    """ValueError if two checks have one name."""
    names = [check.name for check in checks]
    if twice := {name for name in names if names.count(name) > 1}:
        raise ValueError(f"more has a check of a name that is taken: {', '.join(sorted(twice))}")


def _residual(evidence: Evidence) -> Check:
    """Row k of the discrete Euler-Lagrange equations is a momentum; over the node's weight, a force.

    In units of length the same row would be h^2 / m times smaller and hide its error.
    """
    defect = np.abs(evidence.rows) / evidence.weights[:, None] / evidence.per_mass(1.0, evidence.mass)
    actuator, mass = evidence.problem.actuator, evidence.mass.max()
    scene = np.max(
        [mass * np.abs(evidence.pulls).max(initial=0.0), mass * evidence.speed / evidence.path.duration]
    )
    scale = np.max([actuator.force_limit() or 0.0, evidence.largest, 1e-3 * scene, evidence.force_of_turn])
    # Positions are known to a rounding error of their size: no row can be better than that over h^2.
    floor = mass * evidence.rounding / evidence.shortest**2
    allowed = np.where(evidence.speeds, RESIDUAL * scale + floor, RESIDUAL * evidence.torque_scale)
    node, axis = np.unravel_index(np.argmax(defect / allowed), defect.shape)
    note = f"at dynamics[{node}].{evidence.dynamics.configuration.velocity_names[axis]}"
    unit = "N" if evidence.speeds[axis] else "N m"
    return Check.of("residual", defect[node, axis], allowed[axis], unit, note)


def _constraint(evidence: Evidence) -> Check:
    """The constraint g(q) = 0 of the coordinates at every node, and of velocities at every step end."""
    gaps = [("|q.q - 1| at node", np.abs(np.sum(q * q, axis=1) - 1)) for q in evidence.path.attitudes]
    gaps += zip(("gap of a link at node", "opening of a link at step end"), evidence.link_gaps(), strict=True)
    worst = max(range(len(gaps)), key=lambda i: gaps[i][1].max(initial=-1.0))
    words, values = gaps[worst]
    place = int(np.argmax(values))
    unit = "-" if worst < len(evidence.path.attitudes) else "of the path"
    return Check.of("constraint", values[place], CONSTRAINT, unit, f"{words} {place}")


def _rollout(evidence: Evidence) -> Check:
    """March the scheme from the start; errors that the motion itself amplifies are allowed for in the limit."""
    begin = evidence.boundary_momentum(0)
    q, p = rollout(evidence.dynamics, evidence.path, evidence.begin, evidence.position[0], begin)
    miss = apart(evidence.path.coordinates, q, evidence.position[evidence.ends])
    slip = p - evidence.momentum
    sizes = evidence.sizes
    off = np.abs(np.concatenate([miss, slip], axis=1)).max(axis=0)
    growth = amplification(evidence.matrices * evidence.in_size)
    turned = ROUNDING * evidence.acceleration * evidence.path.duration
    floor = (
        evidence.rounding / evidence.extent + (evidence.rounding / evidence.shortest + turned) / evidence.speed
    )
    limit = np.min([ROLLOUT * max(1.0, growth) + floor, ROLLOUT_MOST])
    note = f"{misses(evidence, off)}; path amplifies errors {growth:.2g} times"
    return Check.of("rollout", np.max(off / sizes), limit, "of the path", note)


def _reference(evidence: Evidence) -> Check:
    """The equations of motion, integrated without the scheme, meet the goal."""
    miss, slip = goal_miss(evidence.dynamics, evidence.path, evidence.begin)
    speeds, rates, told = evidence.speeds, evidence.rates, []
    if speeds.any():
        told += [f"{np.linalg.norm(miss[speeds]):.2g} m", f"{np.linalg.norm(slip[speeds]):.2g} m/s"]
    if rates.any():
        turned = np.degrees(np.linalg.norm(miss[rates]))
        told += [f"{turned:.2g} degrees", f"{np.linalg.norm(slip[rates]):.2g} rad/s"]
    note = f"misses the goal by {', '.join(told[:-1])} and {told[-1]}"
    return Check.of("reference", evidence.scales.share(miss, slip), _accuracy(evidence), "of the path", note)


def _accuracy(evidence: Evidence) -> float:
    """Limit for the error of the discretisation [-]: ten times the tolerance if there is one."""
    return MISSED if evidence.solution.tolerance is None else 10 * evidence.solution.tolerance


def _ledger(evidence: Evidence) -> Check:
    """Momentum and mass: discrete sums, exact. Energy: the work is a quadrature, of the scheme's order.

    And the velocities, momenta and forces that the solution reports are those of its path, and its objective
    what the control costs that is flown.
    """
    momentum, gross = balance(evidence)
    masses = node_masses(evidence.dynamics, evidence.path, evidence.problem.mass)
    mass = np.abs(evidence.mass - masses).max() / evidence.problem.mass
    exact = LEDGER + ROUNDING * evidence.acceleration * evidence.path.duration / gross
    value = np.max([momentum, mass, evidence.misreported()])
    note, accuracy, energy = "energy is not kept here", _accuracy(evidence), energy_gap(evidence)
    if energy is not None:
        note = f"energy to {energy:.1e} of {accuracy:g}"
    if evidence.mass.min() < evidence.mass.max():
        note += f", mass to {mass:.1e}"
    if energy is not None and not energy <= accuracy:
        return Check.of("ledger", energy, accuracy, "of the energy", note)
    priced = unpriced(evidence.problem, evidence.dynamics, evidence.path, evidence.solution.objective)
    # Throttle is paid for, thrust is flown: where |F| is rounded far too widely they differ all along.
    rounded = rounded_share(evidence.dynamics, evidence.path)
    if rounded > max(priced, MISSED):
        note += f", {rounded:.1e} of the impulse is paid for the rounding of |F| alone"
        return Check.of("ledger", rounded, MISSED, "of the impulse", note)
    if priced:
        note += f", cost to {priced:.1e} of {accuracy:g}"
    if not priced <= accuracy:
        return Check.of("ledger", priced, accuracy, "of the objective", note)
    return Check.of("ledger", value, exact, "of the impulse", note)


def _bounds(evidence: Evidence) -> Check:
    """The limit whose excess is the largest part of the excess that is allowed."""
    worst = max(excesses(evidence), key=lambda limit: limit.share)
    note = f"worst: {worst.name}" if worst.share > 0 else "all hold"
    bound = evidence.problem.limit_of_duration(evidence.path.duration)
    if bound is not None:
        note += f"; the duration sits on its {bound} limit of {lasting(evidence.path.duration, 6)}"
    return Check.of("bounds", worst.value, worst.allowed, worst.unit, note)


def _optimality(evidence: Evidence) -> Check:
    """First-order conditions: for least effort lambda = -m F, but for what limits of the force add to it."""
    share = share_of([evidence.solution], evidence.solution.objective)
    if share > WORTH:
        return Check.of("optimality", share, WORTH, "of the objective", told(share))
    left = stationarity(evidence)
    note = (
        f"control {left.force:.0e}, costate {left.path:.0e}, limits {left.limits:.0e}, "
        f"objective {left.objective:.0e}"
    )
    limit = optimality_limit(evidence.solution.tolerance)
    return Check.of("optimality", left.largest, limit, "-", note)


def _stability(evidence: Evidence) -> Check:
    """Spectral radius of each one-step matrix over that of the exact flow, both frozen at the step."""
    growth = growth_along(
        evidence.dynamics, evidence.path, evidence.begin, evidence.velocity, evidence.matrices
    )
    note = f"h omega = {growth.frequency:.2g} at most"
    # A body that turns too far between two nodes, or leaps through the anchor of a rod, is none of the motion.
    turned = max(evidence.path.largest_turn, evidence.link_turn)
    if turned >= TURN_MOST:
        note = f"{note}; more than {np.degrees(TURN_MOST):.0f} degrees turned between two nodes"
        return Check("stability", np.degrees(turned), np.degrees(TURN_MOST), "degrees a node", False, note)
    return Check.of("stability", growth.value, growth.limit, "growth a step", note)


# The checks by name, in the order in which a report lists them.
CHECKS: dict[str, Callable[[Evidence], Check]] = {
    "residual": _residual,
    "constraint": _constraint,
    "rollout": _rollout,
    "reference": _reference,
    "ledger": _ledger,
    "bounds": _bounds,
    "optimality": _optimality,
    "stability": _stability,
}
