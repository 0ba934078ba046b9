"""The search for the cause of a failure: limits relaxed one by one, then every row."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.diagnosis.cause import MOST_NAMED, NAMED_SHARE, Cause
from dmoc.diagnosis.elastic import MET, Relaxation
from dmoc.diagnosis.giving import Giving
from dmoc.diagnosis.relaxable import LEAST, Relaxable
from dmoc.diagnosis.without import FAR_OFF, too_little_propellant, unlimited
from dmoc.ipopt.watch import Interrupt
from dmoc.motion.path import DiscretePath
from dmoc.results.facts import Level
from dmoc.scene.problem import TransferProblem

# A mesh is to blame if less than this part of the excess is sure to be left on ever shorter steps [-]: of one
# that is due to the mesh nothing is left or, where burns are shorter than steps, up to 0.45; of a true one 0.9.
SURE = 0.5
# A path that leaps a zone between two nodes needs at least this many times the excess on steps of half the
# length [-]: it has half the time, which takes twice the speed. Any other path needs about as much or less.
LEAPT = 1.2
# The mesh is asked for its share on guesses of up to this many nodes: finer ones are hardly to blame.
MOST_CONFIRMED = 500
# At most this many zones are relaxed, each alone, to find the one that is in the way.
MOST_ZONES = 8


def confirmed_cause(
    problem: TransferProblem,
    guess: DiscretePath,
    tell: Callable[[Level], None],
    interrupt: Interrupt,
    asked: TransferProblem | None = None,
) -> Cause:
    """As `cause_of`; where more than the limits is needed, a mesh of twice the steps tells if that is to blame.

    A ramp or a burn that is shorter than a step takes a larger force there. The excess falls with the length of
    the steps at least, so that on ever shorter ones at least 2 e2 - e1 is left of excesses e1 and e2. Where
    shorter steps need more, the path leaps a zone between two nodes, and the zone is to blame. Where |F| is
    rounded more than the problem `asked` says, what that burns at rest is not to blame either.
    """
    cause = _confirmed(problem, guess, tell, interrupt)
    idle = 0.0 if asked is None else idle_share(problem) - idle_share(asked)
    coarse = not cause.shown and (cause.coarse or cause.excess < idle)
    return replace(cause, coarse=coarse)


def _confirmed(
    problem: TransferProblem, guess: DiscretePath, tell: Callable[[Level], None], interrupt: Interrupt
) -> Cause:
    cause = cause_of(problem, guess, tell, interrupt)
    if cause.shown:
        return cause
    zones = any(np.isfinite(part.feature()) for part in problem.constraints) and not cause.zones
    most = np.inf if zones else FAR_OFF
    if not 0 < cause.excess <= most or np.isinf(cause.excess) or len(guess.position) > MOST_CONFIRMED:
        return cause
    finer = np.sort(np.append(guess.mesh, 0.5 * (guess.mesh[1:] + guess.mesh[:-1])))
    start = guess.onto(finer, guess.order, guess.hold)
    if cause.zones:
        # The limits are not to blame, and what a zone has to give way tells alone whether the mesh is.
        again = _zones(Relaxable(problem, start, tell, interrupt)) or Cause()
    else:
        again = cause_of(problem, start, tell, interrupt, brief=True)
    if zones and again.zones:
        return again
    if zones and LEAPT * cause.excess < again.excess < np.inf:
        return _zones(Relaxable(problem, guess, tell, interrupt)) or cause
    left = 2 * again.excess - cause.excess
    return replace(cause, coarse=again.path is not None or left < SURE * cause.excess)


def cause_of(
    problem: TransferProblem,
    guess: DiscretePath,
    tell: Callable[[Level], None],
    interrupt: Interrupt,
    brief: bool = False,
) -> Cause:
    """Why there is no path near a guess, found on its mesh: limits relaxed one by one, then every row.

    `tell` takes the `Level` of every run; once `interrupt` has seen something, nothing is found any more. If
    `brief`, no durations and no single limits are looked for.
    """
    transfer = Relaxable(problem, guess, tell, interrupt)
    if (far := _far_off(transfer, brief)) is not None:
        return far
    # Around an attractor more time hardly saves propellant: it alone is then to blame.
    around = bool(problem.attraction.sources)
    if around and not brief and (lack := too_little_propellant(transfer)) is not None:
        return lack
    limits = transfer.limits()
    if not limits:
        return _rows(transfer)
    joint = transfer.relaxed(*limits, least=LEAST)
    found = joint(transfer.problem, transfer.guess)
    if not found.feasible:
        free = (None if around else too_little_propellant(transfer)) or unlimited(transfer)
        if free is not None:
            return free
        rows = _rows(transfer)
        # A path on which every row can be met is worth more than a limit that would be enough.
        return rows if rows.path is not None else _one_alone(transfer, limits) or rows
    if transfer.leaps(found.path):
        return _zones(transfer) or _rows(transfer)
    if found.slack[0] <= MET:
        return Cause(path=found.path)
    if brief:
        return Cause(excess=float(found.slack[0]) if found.exact else np.inf)
    needs = []
    for limit in limits:
        alone = found if len(limits) == 1 else transfer.relaxed(limit)(transfer.problem, found.path)
        more = "" if alone.exact else ", which is more than enough"
        if alone.feasible and (enough := transfer.remedies([limit], alone.slack[0], more, path=alone.path)):
            needs.append(enough)
    # Limits of which none is enough alone may be so together.
    every = transfer.remedies(limits, found.slack[0], path=found.path) if found.exact and not needs else ()
    needs += transfer.durations(joint, found, transfer.problem.duration_bounds[1])
    if not needs:
        rows = _rows(transfer)
        # That nothing is enough alone may be due to the guess: a finer mesh is then worth its time.
        return rows if rows.path is not None or not every else replace(rows, needs=(every,), rows=())
    return Cause(needs=(*([every] if every else []), *needs), excess=float(found.slack[0]))


def lacks_propellant(problem: TransferProblem, guess: DiscretePath, ladder: Any) -> Cause | None:
    """A lack of propellant around an attractor, where attempts failed; `ladder` tells of runs and ends them."""
    if not (problem.actuator.burns and problem.actuator.dry_mass > 0 and problem.attraction.sources):
        return None
    return too_little_propellant(Relaxable(problem, guess, ladder.tell, ladder.interrupt))


def _far_off(transfer: Relaxable, brief: bool) -> Cause | None:
    """The limits that are enough, where those given are too small by orders of magnitude; else None.

    They are found in units of the force and the speed that the guess takes: in units of the limits given the
    slacks are so large that no solver finds them. The force that is needed falls with the square of the
    duration where nothing else acts, the speed with the duration: there the search for a duration begins.
    """
    force, speed = (ratio if FAR_OFF < ratio < np.inf else 1.0 for ratio in transfer.taken())
    if force == speed == 1.0:
        return None
    problem, longest = transfer.problem, transfer.problem.duration_bounds[1]
    raised = replace(problem, actuator=problem.actuator.times(force))
    for entry, part in enumerate(problem.constraints):
        raised = part.times(speed).within(raised, entry) if part.limits_speed else raised
    higher = Relaxable(raised, transfer.guess, transfer.tell, transfer.interrupt, given=problem)
    pairs = ((higher.force(), force), *((limit, speed) for limit in higher.speeds()))
    limits = [limit for limit, ratio in pairs if limit and ratio > 1]
    found = higher.relaxed(*limits, least=LEAST)(raised, higher.guess)
    if not found.feasible:
        return unlimited(higher)
    # The guess may take so much more than is needed that even the least slack is more than enough.
    if higher.leaps(found.path) or found.slack[0] < 0.99 * LEAST:
        return None
    excess = max(limit.factor(found.slack[0]) for limit in limits)
    if brief:
        return Cause(excess=excess)
    needs = [higher.remedies(limits, found.slack[0], path=found.path)]
    longer = longest * max(limit.factor(found.slack[0]) ** (1 / limit.falls) for limit in limits)
    later = Relaxable(
        replace(problem, duration=longer), transfer.guess, transfer.tell, transfer.interrupt, given=problem
    )
    joint = later.relaxed(*later.limits(), least=LEAST)
    near = joint(later.problem, later.guess)
    needs += later.durations(joint, near, longest) if near.feasible else []
    return Cause(needs=tuple(filter(None, needs)), excess=excess)


def _one_alone(transfer: Relaxable, limits: list[Giving]) -> Cause | None:
    """One limit that is enough where all together were not found to be: each has its own scale.

    What wheels store has one that no other limit has. Elsewhere a finer mesh is worth more than a single limit.
    """
    if len(limits) == 1 or not any(part.unit == "N m s" for part in transfer.problem.constraints):
        return None
    for limit in limits:
        alone = transfer.relaxed(limit)(transfer.problem, transfer.guess)
        if alone.feasible and (enough := transfer.remedies([limit], alone.slack[0], path=alone.path)):
            return Cause(needs=(enough,), excess=float(alone.slack[0]))
    return None


def _rows(transfer: Relaxable) -> Cause:
    """Every row made elastic: the rows that cannot be met, or the constraint that alone is in the way."""
    layout = transfer.nlp.rows
    every = ca.DM.eye(layout.size)
    slacks = ca.horzcat(every, -every)
    relaxed = Relaxation(transfer.nlp, slacks, tell=transfer.tell, interrupt=transfer.interrupt)
    found = relaxed(transfer.problem, transfer.guess)
    if not found.feasible:
        return Cause()
    miss = np.abs(found.slack[: layout.size] - found.slack[layout.size :])
    if miss.max() <= MET:
        return Cause(path=found.path)
    worst = [int(i) for i in np.argsort(-miss)[:MOST_NAMED] if miss[i] > NAMED_SHARE * miss.max()]
    owners = [layout.group_at(i).owner for i in worst]
    blamed = any(owner is not None and owner.field == "constraints" for owner in owners)
    names = tuple(layout.name_of(i) for i in worst)
    return (_zones(transfer) if blamed else None) or Cause(
        rows=names, turns=transfer.problem.actuator.turns_every_way
    )


def _zones(transfer: Relaxable) -> Cause | None:
    """Each zone relaxed alone: how much each would have to give way by itself."""
    needs, excess = [], 0.0
    for entry in transfer.zones()[:MOST_ZONES]:
        if (limit := transfer.zone(entry, transfer.guess)) is None:
            continue
        found = transfer.relaxed(limit)(transfer.problem, transfer.guess)
        if found.feasible and transfer.by_angle(entry):
            # By which angle it gives way depends on how far the path is from its tip.
            limit = transfer.zone(entry, found.path) or limit
            found = transfer.relaxed(limit)(transfer.problem, found.path)
        slack = transfer.clear(entry, limit, float(found.slack[0]), found.path)
        if found.feasible and (enough := transfer.remedies([limit], slack, room=0.0)):
            needs.append(enough)
            excess = max(excess, float(found.slack[0]))
    return Cause(needs=tuple(needs), excess=excess, zones=True) if needs else None


def idle_share(problem: TransferProblem) -> float:
    """The part of the propellant that an engine burns at rest, since |F| is rounded at zero [-]."""
    engine, duration = problem.actuator, problem.duration_bounds[1]
    if engine.smoothing is None or not engine.burns:
        return 0.0
    controls = np.zeros(problem.controls)
    controls[-1] = engine.smoothing * (engine.force_limit() or 0.0)
    return float(engine.flow(controls)) * duration / (problem.mass - engine.dry_mass)
