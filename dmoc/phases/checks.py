"""The checks of a team of missions: of every leg, of joints, of what holds between bodies, of the whole."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.chains.path import kicks_of
from dmoc.checks.evidence import Evidence
from dmoc.checks.limits import Excess
from dmoc.checks.primer import primer_check
from dmoc.checks.verification import CHECKS, Check, Report, not_finite, own_checks, refuse_twins
from dmoc.checks.worst import fastest, worst_of
from dmoc.missions.checks import LEAST, Whole
from dmoc.phases.cuts import phased_cuts
from dmoc.phases.path import PhasedPath, suffix
from dmoc.phases.program import PhasedProgram
from dmoc.phases.solution import PhasedSolution
from dmoc.phases.timetable import Timetable
from dmoc.results.between import BOUND
from dmoc.teams.checks import rows_between


def verify_phased(solution: PhasedSolution, problem: Any = None, more: Sequence = ()) -> Report:
    """Check a team of missions, without a look at the optimiser's own verdict on it.

    Every leg of every body is checked as a transfer between its two states, and the worst one is told; `joints`
    are those of all bodies; `together` is what two bodies keep, phase by phase, at the nodes, between them and
    at the end, that they share one clock, and that legs as they were stated last as long as they may; `primer`
    is that of the body for which another impulse would help most. Each of `more`, which takes the `Evidence` of
    a leg, is told of the worst leg, too.
    """
    own = own_checks(more)
    solution = solution if problem is None else solution.attach(problem)
    begun, plan = time.perf_counter(), solution.timetable
    with np.errstate(all="ignore"):
        least = LEAST * solution.path.diagonal, LEAST * max(map(fastest, solution.parts))
        legs = [Evidence(replace(leg, tolerance=solution.tolerance), least) for leg in solution.parts]
        undefined = next((found for leg in legs if (found := leg.undefined())), "")
        if undefined:
            return Report((not_finite("legs", undefined),), 0.0)
        checks = []
        for name, check in CHECKS.items():
            # Only bodies that turn have a constraint.
            ours = [i for i, leg in enumerate(legs) if name != "constraint" or leg.path.attitudes]
            if ours and name != "optimality":
                names = [plan.leg_names[i] for i in ours]
                checks.append(worst_of(names, [legs[i] for i in ours], check, named=True))
        path = solution.path
        whole = Whole(solution, PhasedProgram.of(plan, plan.stretches, path), path)  # type: ignore[arg-type]
        checks += [whole.joints(), _together(plan, path, legs), whole.optimality()]
        primers = [
            (primer_check(one), name)
            for one, name in zip(solution.members, plan.names, strict=True)
            if one.impulses
        ]
        if primers:
            worst, name = max(primers, key=lambda pair: pair[0].value or 0.0)
            checks.append(replace(worst, note=f"{name}: {worst.note}"))
        checks += [worst_of(plan.leg_names, legs, check) for _, check in own]
    refuse_twins(checks)
    return Report(tuple(checks), time.perf_counter() - begun)


def _together(plan: Timetable, path: PhasedPath, legs: Sequence[Evidence]) -> Check:
    """What holds between bodies: the excess that is the largest part of what is allowed."""
    found = [Excess(cut.name, cut.value, cut.allowed, cut.unit) for cut in phased_cuts(plan, path)]
    last = plan.count - 1
    speeds = [_goal_speed(plan, path, body) for body in range(len(plan.names))]
    for name, (part, a, b) in zip(plan.pair_names(), plan.pairs(), strict=True):
        for i in range(plan.count):
            pair = legs[a * plan.count + i], legs[b * plan.count + i]
            drift = speeds[b] - speeds[a] if i == last else None
            found += rows_between(name if i == last else name + suffix(i), part, pair, drift)
    found += _clock(plan, path)
    worst = max(found, key=lambda one: one.share)
    note = f"worst: {worst.name}" if worst.share > 0 else "all hold"
    return Check.of("together", worst.value, worst.allowed, worst.unit, note)


def _clock(plan: Timetable, path: PhasedPath) -> Iterator[Excess]:
    """One start, one duration of each phase, and durations of legs and missions within what was stated."""
    whole = path.duration
    begins, lasts = (
        np.array(values, float).reshape(len(plan.names), plan.count)
        for values in (path.begins, [leg.duration for leg in path.legs])
    )
    yield Excess("common start", float(np.ptp(begins[:, 0])), BOUND * whole, "s")
    yield Excess("common duration", float(np.ptp(lasts, axis=0).max()), BOUND * whole, "s")
    for span in plan.spans:
        total = lasts[:, span.first : span.last + 1].sum(axis=1)
        off = max(span.shortest - total.min(), total.max() - span.longest, 0.0)
        name = f"duration of phases {span.first + 1} to {span.last + 1}"
        yield Excess(name, float(off), BOUND * span.longest, "s")


def _goal_speed(plan: Timetable, path: PhasedPath, body: int) -> np.ndarray:
    """The velocity of a body behind what happens at its goal [m/s]."""
    part, joint = path.of(body), plan.cut[body].joints[-1]
    last = part.legs[-1]
    speed = last.goal_velocity[last.coordinates.speeds]
    return speed + sum(kicks_of(joint, part.own.get(joint.name), plan.dimension))
