"""The checks of a team: of every body, of what holds between them, and of the whole."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.checks.evidence import Evidence
from dmoc.checks.limits import Excess
from dmoc.checks.verification import CHECKS, Check, Report, not_finite, own_checks, refuse_twins
from dmoc.checks.worst import fastest, worst_of
from dmoc.missions.checks import LEAST, Whole
from dmoc.results.between import BOUND
from dmoc.teams.cuts import team_cuts
from dmoc.teams.program import TeamProgram
from dmoc.teams.solution import TeamSolution


def verify_team(solution: TeamSolution, problem: Any = None, more: Sequence = ()) -> Report:
    """Check a team, without a look at the optimiser's own verdict on it.

    Every body is checked as a transfer between its two ends, and the worst one is told; `together` is what two
    bodies keep, at the nodes, between them and at the end, and that all last equally long; `optimality` are the
    first-order conditions of the whole team. Each of `more`, which takes the `Evidence` of a body, is told of
    the worst body, too.
    """
    own = own_checks(more)
    solution = solution if problem is None else solution.attach(problem)
    begun, team = time.perf_counter(), solution.require_problem()
    with np.errstate(all="ignore"):
        least = LEAST * solution.path.diagonal, LEAST * max(fastest(one) for one in solution.members)
        bodies = [Evidence(replace(one, tolerance=solution.tolerance), least) for one in solution.members]
        undefined = next((found for one in bodies if (found := one.undefined())), "")
        if undefined:
            return Report((not_finite("bodies", undefined),), 0.0)
        checks = []
        for name, check in CHECKS.items():
            # Only bodies that turn have a constraint.
            ours = [i for i, one in enumerate(bodies) if name != "constraint" or one.path.attitudes]
            if ours and name != "optimality":
                names = [solution.names[i] for i in ours]
                checks.append(worst_of(names, [bodies[i] for i in ours], check, named=True))
        checks.append(_together(solution, bodies))
        path = solution.path
        whole = Whole(solution, TeamProgram.of(team, team.stretches, path), path)
        checks.append(whole.optimality())
        checks += [worst_of(solution.names, bodies, check) for _, check in own]
    refuse_twins(checks)
    return Report(tuple(checks), time.perf_counter() - begun)


def _together(solution: TeamSolution, bodies: Sequence[Evidence]) -> Check:
    """What holds between two bodies: the excess that is the largest part of what is allowed."""
    team, path = solution.require_problem(), solution.path
    found = [Excess(cut.name, cut.value, cut.allowed, cut.unit) for cut in team_cuts(team, path)]
    speeds = [one.path.goal_velocity[one.path.coordinates.speeds] for one in bodies]
    for name, (part, a, b) in zip(team.pair_names(), team.pairs(), strict=True):
        found += rows_between(name, part, (bodies[a], bodies[b]), speeds[b] - speeds[a])
    durations = np.array([one.duration for one in path.legs])
    found.append(Excess("common duration", float(np.ptp(durations)), BOUND * path.duration, "s"))
    shortest, longest = team.duration_bounds
    off = max(shortest - durations.min(), durations.max() - longest, 0.0)
    found.append(Excess("duration", float(off), BOUND * longest, "s"))
    worst = max(found, key=lambda one: one.share)
    note = f"worst: {worst.name}" if worst.share > 0 else "all hold"
    return Check.of("together", worst.value, worst.allowed, worst.unit, note)


def rows_between(
    name: str, part: Any, pair: tuple[Evidence, Evidence], drift: np.ndarray | None
) -> Iterator[Excess]:
    """The rows of a part for two bodies: at the nodes, if no limit of it was looked at there, and at the end.

    `drift` is the velocity of one from the other at the end [m/s], None where the end is not theirs.
    """
    first, second = pair
    sizes = {"m": max(one.extent for one in pair), "m/s": max(one.speed for one in pair)}
    apart = second.path.place - first.path.place
    q, v = (ca.SX.sym(of, apart.shape[1]) for of in "qv")
    at_nodes = part.rows(q) if part.limit(q.numel()) is None else []
    asked = [(at_nodes, apart, np.zeros_like(apart), " at nodes")]
    if drift is not None:
        asked.append((part.goal_rows(q, v), apart[-1:], drift[None], ""))
    for rows, places, speeds, where in asked:
        for row in rows:
            have = ca.Function("row", [q, v], [ca.densify(ca.SX(row.expression))])(places.T, speeds.T).full()
            beyond = float(np.max(np.maximum(row.lower - have, have - row.upper), initial=0.0))
            allowed = BOUND * sizes.get(row.unit, 1.0)
            yield Excess(f"{name} {row.name}{where}", beyond, allowed, row.unit or "-")
