"""Solve a team of missions, coarse to fine, on one mesh a phase for all bodies; from several guesses, too."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from dmoc.chains.path import cold
from dmoc.meshes.cut_off import CutOff
from dmoc.missions.attempt import Attempt
from dmoc.missions.climb import Climb
from dmoc.missions.guess import first_path
from dmoc.missions.sharper import onto_magnitude
from dmoc.motion.mesh import uniform_mesh
from dmoc.phases.answer import answered
from dmoc.phases.cuts import phased_cut_off, phased_leaps
from dmoc.phases.guess import SHORTEST, first_guess, flown_ways, on_clock
from dmoc.phases.order import Order, as_mission
from dmoc.phases.path import PhasedPath
from dmoc.phases.program import PhasedProgram
from dmoc.phases.solution import PhasedSolution
from dmoc.phases.timetable import Timetable
from dmoc.results.facts import Error
from dmoc.scene.mission import LEAST_SHARE
from dmoc.scene.team import Team
from dmoc.solver.solve import check_numerics
from dmoc.solver.starts import Optimum
from dmoc.teams import optima as of_transfers
from dmoc.teams.climb import ORDER, TeamClimb
from dmoc.teams.guess import bent_apart, other_sides

# At most so many other orders of joints are tried for each of them.
MOST_ORDERS = 2


class PhasedClimb(TeamClimb):
    """The attempts at one team of missions, in their order; `mission` is its timetable."""

    program: Any = PhasedProgram
    answered: Any = answered

    def prepared(self, first: Attempt, path: Any) -> Attempt:
        return onto_magnitude(self, self.reordered(first))

    def finished(self, first: Attempt, path: Any, tol: float | None) -> tuple[Attempt, Error | None, bool]:
        # Other ways round begin on the clock that was found.
        return super().finished(first, path if path.warm else cold(first.path), tol)

    def cut_at_leaps(self, path: Any) -> Any:
        steps = phased_leaps(self.mission, path)
        return path.cut(path.mesh, steps) if any(map(len, steps)) else None

    def cut_off_between(self, path: Any) -> CutOff:
        return phased_cut_off(self.mission, path)

    def straight(self, path: Any) -> Any:
        plan, leg = self.mission, path.legs[0]
        _, start = first_guess(plan.team, leg.order, None, leg.hold, bent=False)
        if start.joints == plan.order:
            return start
        clock = path.begins[0] + np.append(0.0, np.cumsum(path.durations))
        return on_clock(plan, flown_ways(start), clock, (leg.order, None, leg.hold))

    def otherwise(self, attempt: Attempt, path: Any) -> Attempt:
        """An answer from what every body would do by itself, if all of them have an answer, bent apart."""
        team, own = self.mission.team, []
        numerics = path.legs[0].order, path.legs[0].hold
        for one, member in zip(team.members, self.mission.missions, strict=True):
            alone = Climb(member, self.options, self.progress, self.compiled, None)
            alone.interrupt = self.interrupt
            found = alone.from_guess(first_path(as_mission(one), numerics[0], None, numerics[1], None))
            if not found.solved:
                return attempt
            own.append(found.path.as_arrays())
        _, start = first_guess(team, numerics[0], None, numerics[1], own)
        if not start.fits(self.mission):
            return attempt
        tried = self.from_guess(start)
        return tried if tried.solved else attempt

    def reordered(self, attempt: Attempt) -> Attempt:
        """An answer in which no phase between joints of two bodies is as short as it may be, if it is found.

        There the joints would rather follow each other the other way round or, if they do not want that either,
        still nearer to each other, or be at one time.
        """
        for _ in range(MOST_ORDERS * self.mission.count):
            path: Any = attempt.path
            plan: Timetable = self.mission
            short = plan.short(path.durations)
            if not short or not attempt.solved or self.interrupt.seen:
                break
            for order, least, lasts in _other_orders(plan, path, short[0]):
                tried = self._in_order(Timetable(plan.team, order, least), path, lasts)
                if tried is not None and self._is_better(tried, attempt):
                    found: Any = tried.path
                    # Also so they may end as near to each other as may be.
                    if found.count < plan.count or short[0] not in self.mission.short(found.durations):
                        attempt = tried
                        break
                self.mission, self.held = plan, attempt
            else:
                break
        return attempt

    def _in_order(self, other: Timetable, path: PhasedPath, lasts: np.ndarray) -> Attempt | None:
        """The answer on another timetable, from a path; None if there is none."""
        if not other.possible:
            return None
        lasts = np.clip(lasts, *other.bounds.T)
        clock = path.begins[0] + np.append(0.0, np.cumsum(lasts))
        leg = path.legs[0]
        start = on_clock(other, flown_ways(path), clock, (leg.order, None, leg.hold))
        self.mission = other
        tried = self.from_guess(start)
        return tried if tried.solved else None

    def _is_better(self, tried: Attempt, attempt: Attempt) -> bool:
        sense = self.mission.objective.sense
        before = sense * attempt.level.objective
        return sense * tried.level.objective <= before + 1e-6 * abs(before)


def _other_orders(plan: Timetable, path: PhasedPath, short: int) -> list[tuple[Order, float, np.ndarray]]:
    """Other timetables: order, shortest phase [-] and likely durations [s].

    The two joints around a short phase are the other way round, nearer to each other, or at one time.
    """
    groups, lasts = list(plan.order), path.durations
    swapped = [*groups[: short - 1], groups[short], groups[short - 1], *groups[short + 1 :]]
    longer = lasts.copy()
    longer[short] = max(lasts[short], SHORTEST * lasts.sum())
    one = [*groups[: short - 1], groups[short - 1] + groups[short], *groups[short + 1 :]]
    found = [(tuple(swapped), plan.shortest, longer)]
    if plan.shortest > LEAST_SHARE:
        found += [(plan.order, LEAST_SHARE, lasts), (tuple(swapped), LEAST_SHARE, lasts)]
    return [*found, (tuple(one), plan.shortest, np.delete(lasts, short))]


def solve_phased(
    team: Team,
    order: int | None = None,
    steps: int | None = None,
    tol: float | None = None,
    hold: bool = False,
    mesh: Any = None,
    guess: Any = None,
    options: dict[str, Any] | None = None,
    progress: Any = None,
    compiled: bool = False,
    time_limit: float | None = None,
) -> PhasedSolution:
    """Solve a team of missions; the arguments are those of `dmoc.solve`, and `steps` are those of a phase."""
    check_numerics(order, steps, tol, hold, options, progress, time_limit)
    if mesh is not None:
        raise ValueError("a team of missions has a mesh for each phase; give steps")
    plan, path = first_phases(team, order, steps, hold, guess)
    climb = PhasedClimb(plan, options, progress, compiled, time_limit)
    return climb.solve(path, tol, steps is not None)


def first_phases(
    team: Team, order: int | None, steps: int | None, hold: bool, guess: Any = None
) -> tuple[Timetable, PhasedPath]:
    """The timetable and the path to start from."""
    given = team.guess if guess is None else guess
    given = getattr(given, "path", given)
    if isinstance(given, PhasedPath):
        plan = Timetable(team, given.joints)
        if given.names != plan.names or not plan.possible or not given.fits(plan):
            raise ValueError(
                f"guess is of {', '.join(given.names)}, and its legs are not those of the team of "
                f"{', '.join(plan.names)}; give an answer of this team, or one guess a body"
            )
        if order is None and steps is None:
            return plan, given
        meshes = [
            (mesh if steps is None else uniform_mesh(steps), order or given.legs[0].order)
            for mesh in given.mesh
        ]
        return plan, given.onto(meshes)
    return first_guess(team, order or _own_order(team), steps, hold, given)


def _own_order(team: Team) -> int:
    """The largest order that a leg asks for, or the usual one."""
    asked = [leg.order for one in team.members for leg in getattr(one, "plan", ()) if leg.order]
    return max(asked, default=ORDER)


def team_optima(
    team: Team, starts: int, order: int | None = None, hold: bool = False, guess: Any = None
) -> list[Optimum]:
    """The distinct optima that `starts` guesses lead to, the best first.

    The first guess is the default one; then each pair that comes near passes on its other side, in all ways;
    then come random bends, the same ones every time.
    """
    if not team.phased:
        return of_transfers.team_optima(team, starts, order, hold, guess)
    found: list[Optimum] = []
    plan, base = first_phases(team, order, None, hold, guess)
    for _, (name, path) in zip(range(starts), _variants(plan, base), strict=False):
        climb = PhasedClimb(plan, None, None, False, None)
        with climb.interrupt:
            tried = climb.reordered(climb.from_guess(path))
        if tried.answer.status == "stopped":
            break
        if tried.solved:
            of_transfers.put(found, Optimum(tried.level.objective, tried.path, (name,)))
    return sorted(found, key=lambda optimum: team.objective.sense * optimum.objective)


def _variants(plan: Any, base: PhasedPath) -> Iterator[tuple[str, PhasedPath]]:
    """Names and guesses, the default one first."""
    yield "default", base
    if base.warm:
        return
    straight = PhasedClimb(plan, None, None, False, None).straight(base)
    for i, sides in enumerate(other_sides(plan, straight)):
        # The first way is the one that the default guess takes where no side is nearer.
        if i:
            passed = "".join("+-"[side < 0] for side in sides if side)
            yield f"sides {passed}", bent_apart(plan, straight, sides)
    draw, number = np.random.default_rng(0), 0
    along = np.sin(np.pi * base.fractions)[:, None]
    while True:
        number += 1
        bends = [
            of_transfers.BENT * base.diagonal * along * draw.uniform(-1, 1, way.shape[1]) for way in base.ways
        ]
        yield f"random bends {number}", base.moved(bends)
