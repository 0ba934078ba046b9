"""Why a solve failed, in the user's words and units, and what would have to give way."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dmoc.motion.path import DiscretePath
from dmoc.nlp.elastic import MET, MOST_ITERATIONS, Relaxation, Relaxed
from dmoc.nlp.ipopt import make_solver, path_of, run
from dmoc.nlp.transcription import NLP, transcribe_onto, units_of
from dmoc.parts.forces import BallForce, BoxForce, FreeForce
from dmoc.parts.objectives import Effort
from dmoc.parts.speed import SpeedLimit
from dmoc.parts.zones import KeepOut
from dmoc.scene.problem import TransferProblem
from dmoc.solver.needs import down, force_words, speed_limit, times, times_of_limit, up

# The least slack of a limit on the way to a duration that needs less: a tenth of the limit.
LEAST = -0.9
# A limit is off by a unit, or by more, where the guess takes so many times more than it on average.
FAR_OFF = 10.0
# How deep a chord between two nodes cuts into a zone that is leapt across, in radii; how many zones are tried.
LEAP, MOST_ZONES = 0.1, 8
# How many durations are tried, by what factor's logarithm each differs from the one before at most, and
# how exactly the limits are met in the one found.
MOST_DURATIONS, WIDEST, EXACT = 9, 1.0, 1e-3


@dataclass(frozen=True)
class Cause:
    """What an infeasible transfer lacks.

    Attributes
    ----------
    path : DiscretePath or None
        A path that meets every row, if there is one after all.
    needs : tuple of str
        What would be enough, each by itself: "a force limit of 0.26 N (you gave 0.2 N)".
    rows : tuple of str
        Rows that cannot be met together; empty where a limit explains it.
    excess : float
        How much more than its limits allow the transfer needs, relative to them; infinite if no limit
        is to blame.
    """

    path: DiscretePath | None = None
    needs: tuple[str, ...] = ()
    rows: tuple[str, ...] = ()
    excess: float = np.inf

    def words(self) -> str:
        """One line for a person; empty if nothing was found."""
        parts = []
        if self.needs:
            parts.append(f"the transfer needs {', or '.join(self.needs)}")
        if self.rows:
            parts.append(f"these rows cannot be met together: {', '.join(self.rows)}")
        return "; ".join(parts)


def cause_of(problem: TransferProblem, guess: DiscretePath) -> Cause:
    """Why there is no path near a guess, found on its mesh: limits relaxed one by one, then every row."""
    case = _Case(problem, guess)
    if (far := _far_off(case)) is not None:
        return far
    limits = case.limits()
    if not limits:
        return case.rows()
    joint = case.relaxed(*limits, least=LEAST)
    found = joint(case.problem, case.guess)
    if not found.feasible:
        return _unlimited(case) or case.rows()
    if case.jumps(found.path):
        return case.zones() or case.rows()
    if found.slack[0] <= MET:
        return Cause(path=found.path)
    needs = []
    for part in limits:
        alone = found if len(limits) == 1 else case.relaxed(part)(case.problem, case.guess)
        if alone.feasible:
            needs.append(part.words(alone))
    needs += case.duration(joint, found, case.problem.duration_bounds[0])
    return Cause(needs=tuple(needs), excess=float(found.slack[0])) if needs else case.rows()


def _far_off(case: _Case) -> Cause | None:
    """What is enough where limits are too small by orders of magnitude, in units of what the guess takes.

    In units of such limits the slacks are so large that no solver finds them. The force that is needed falls
    with the square of the duration where nothing else acts, the speed with the duration: that is where a
    duration is looked for.
    """
    force, speed = (ratio if FAR_OFF < ratio < np.inf else 1.0 for ratio in case.taken())
    if force == speed == 1.0:
        return None
    problem, longest = case.problem, case.problem.duration_bounds[1]
    zones = tuple(times(part, speed) if isinstance(part, SpeedLimit) else part for part in problem.constraints)
    raised = replace(problem, actuator=times(problem.actuator, force), constraints=zones)
    case = _Case(raised, case.guess, given=problem)
    parts = [part for part, ratio in ((case.force(), force), (case.speed(), speed)) if part and ratio > 1]
    found = case.relaxed(*parts, least=LEAST)(raised, case.guess)
    if not found.feasible:
        return _unlimited(case)
    # a guess may take so much more than is needed that the least slack is not enough
    if case.jumps(found.path) or found.slack[0] < 0.99 * LEAST:
        return None
    needs = [" and ".join(part.words(found) for part in parts)]
    longer = longest * max(part.factor(found.slack[0]) ** (1 / part.falls) for part in parts)
    later = _Case(replace(problem, duration=longer), case.guess)
    joint = later.relaxed(*later.limits(), least=LEAST)
    near = joint(later.problem, later.guess)
    needs += later.duration(joint, near, longest) if near.feasible else []
    return Cause(needs=tuple(needs), excess=max(part.factor(found.slack[0]) for part in parts))


def _unlimited(case: _Case) -> Cause | None:
    """The force that least effort takes without a limit: more than the least, but sooner found."""
    given = case.given.actuator
    if not isinstance(given, (BallForce, BoxForce)):
        return None
    problem = replace(case.problem, actuator=FreeForce(), constraints=case.given.constraints)
    nlp = transcribe_onto(problem, case.guess, units_of(problem, case.guess))
    answer = run(make_solver(nlp, {"ipopt.max_iter": MOST_ITERATIONS}), nlp, problem, case.guess)
    path = replace(path_of(nlp, problem, answer), multipliers={})
    if answer.status != "solved" or case.jumps(path):
        return None
    factor = times_of_limit(given, path.control)
    if factor <= 1:
        return Cause(path=path)
    needs = (f"no more than {force_words(given, factor)}",)
    # what is not much more may not be needed
    return Cause(needs=needs, excess=factor if factor > FAR_OFF else np.inf)


@dataclass(frozen=True)
class _Part:
    """Limits that give way together: rows with the sign of their slack, unknowns with their shares.

    With a slack s what is enough is `factor(s)` times the limit that was given: `told` says so. `falls` is
    the power of the duration with which that falls.
    """

    told: Callable[[float], str]
    factor: Callable[[float], float]
    falls: int
    rows: np.ndarray
    signs: np.ndarray
    columns: np.ndarray
    below: np.ndarray
    above: np.ndarray

    def words(self, found: Relaxed) -> str:
        return self.told(self.factor(found.slack[0]))


class _Case:
    """A transfer of fixed duration, on the mesh of a guess, whose objective is the effort.

    Limits are told of as those of `given`, which are smaller where they were raised.
    """

    def __init__(self, problem: TransferProblem, guess: DiscretePath, given: TransferProblem | None = None):
        longest = problem.duration_bounds[1]
        self.given, self.guess = given or problem, replace(guess, duration=longest, multipliers={})
        self.problem = replace(problem, duration=longest, objective=Effort())
        self.nlp: NLP = transcribe_onto(self.problem, self.guess, units_of(self.problem, self.guess))
        self.bounds = self.nlp.bounds(self.problem)

    def relaxed(self, *parts: _Part, least: float = 0.0) -> Relaxation:
        rows = np.zeros((self.nlp.rows.size, 1))
        for part in parts:
            rows[part.rows, 0] = part.signs
        columns, below, above = (
            np.concatenate([getattr(part, name) for part in parts]) for name in ("columns", "below", "above")
        )
        return Relaxation(self.nlp, rows, columns, below, above, least)

    def taken(self) -> tuple[float, float]:
        """How many times the limits of force and of speed the guess takes on average; 0 without a limit.

        Without controls its rows of motion lack the momentum that these would have to give.
        """
        nlp, time = self.nlp, self.guess.duration
        coast, rows = replace(self.guess, control=0 * self.guess.control), nlp.rows["dynamics"]
        g = nlp.assembly.constraints(nlp.pack(coast), nlp.parameters(self.problem)).full().ravel()
        force = self.problem.mass * np.linalg.norm(rows.of(g) / rows.scales, axis=1).sum() / time
        speed = np.linalg.norm(np.diff(coast.position, axis=0), axis=1).sum() / time
        limits = self.problem.actuator.force_limit(), speed_limit(self.problem)
        return tuple(size / (limit or np.inf) for size, limit in zip((force, speed), limits, strict=True))

    def limits(self) -> list[_Part]:
        return [part for part in (self.force(), self.speed()) if part is not None]

    def part(
        self,
        pattern: str,
        told: Callable[[float], str],
        factor: Callable[[float], float],
        columns: np.ndarray | None = None,
        falls: int = 1,
    ) -> _Part | None:
        """Rows with a limit on one side, of the groups whose names match, and unknowns with limits."""
        lbx, ubx, lbg, ubg = self.bounds
        places = [g.indices.ravel() for g in self.nlp.rows.groups if re.fullmatch(pattern, g.name)]
        rows = np.concatenate([*places, np.empty(0, int)]).astype(int)
        rows = rows[np.isfinite(lbg[rows]) != np.isfinite(ubg[rows])]
        columns = np.empty(0, int) if columns is None else columns
        above = np.where(np.isfinite(ubx[columns]), ubx[columns], 0.0)
        below = np.where(lbx[columns] == -ubx[columns], above, 0.0)
        if not len(rows) and not above.any():
            return None
        signs = np.where(np.isfinite(lbg[rows]), 1.0, -1.0)
        return _Part(told, factor, falls, rows, signs, columns, below, above)

    def force(self) -> _Part | None:
        """The limit of the actuator."""
        given, limit = self.given.actuator, self.problem.actuator.force_limit()
        if limit is None:
            return None
        columns = self.nlp.columns["force"].indices.ravel()
        power = 0.5 if isinstance(given, BallForce) else 1.0
        raised = limit / (given.force_limit() or limit)
        told, factor = (
            (lambda needed: force_words(given, needed)),
            (lambda slack: raised * (1 + slack) ** power),
        )
        return self.part("actuator", told, factor, columns, falls=2)

    def speed(self) -> _Part | None:
        limit, given = speed_limit(self.problem), speed_limit(self.given)
        if limit is None or given is None:
            return None

        def told(needed: float) -> str:
            return f"a speed limit of {up(given * needed)} m/s (you gave {given:g} m/s)"

        return self.part(r"speed_limit_\d+|\w+\.speed", told, lambda slack: limit / given * np.sqrt(1 + slack))

    def zone(self, name: str) -> _Part | None:
        """One keep-out zone."""
        index = int(name.rsplit("_", 1)[1])
        zone = self.problem.constraints[index - 1]
        if not isinstance(zone, KeepOut):
            return None

        def told(factor: float) -> str:
            radius = down(zone.radius * factor)
            return f"keep-out {index} of at most {radius} m radius (you gave {zone.radius:g} m)"

        return self.part(name, told, lambda slack: np.sqrt(max(1 - slack, 0.0)))

    def duration(self, joint: Relaxation, first: Relaxed, given: float) -> list[str]:
        """A duration for which the limits are enough, by the secant method on logarithms.

        The force that is needed falls with the square of the duration where nothing else acts, and
        each duration starts from the answer for the one before.
        """
        first_duration = self.problem.duration_bounds[0]
        tried = [(0.0, float(np.log1p(first.slack[0])))]
        step, near, enough = 0.5 * tried[0][1], first, None
        for _ in range(MOST_DURATIONS):
            place = tried[-1][0] + float(np.clip(step, -WIDEST, WIDEST))
            duration = float(first_duration * np.exp(place))
            path = replace(near.path, duration=duration)
            near = joint(replace(self.problem, duration=duration), path, near)
            if not near.feasible:
                break
            tried.append((place, float(np.log1p(near.slack[0]))))
            if near.slack[0] <= 0:
                enough = place
            if -2 * EXACT <= near.slack[0] <= 0:
                break
            (before, above), (place, below) = tried[-2:]
            slope = (below - above) / (place - before)
            # aimed at a little more than enough
            step = -(below + EXACT) / slope if slope else WIDEST
        if enough is None:
            return []
        needed = first_duration * np.exp(enough)
        return [f"{up(needed) if needed > given else down(needed)} s (you gave {given:g} s)"]

    def rows(self) -> Cause:
        """Every row made elastic: which cannot be met, and whether a zone alone is in the way."""
        count = self.nlp.rows.size
        found = Relaxation(self.nlp, np.hstack([np.eye(count), -np.eye(count)]))(self.problem, self.guess)
        if not found.feasible:
            return Cause()
        miss = np.abs(found.slack[:count] - found.slack[count:])
        if miss.max() <= MET:
            return Cause(path=found.path)
        worst = [i for i in np.argsort(-miss)[:5] if miss[i] > 1e-3 * miss.max()]
        names = tuple(self.nlp.rows.name_of(i) for i in worst)
        blamed = {name.split("[")[0] for name in names}
        return (self.zones() if any(name.startswith("keep_out_") for name in blamed) else None) or Cause(
            rows=names
        )

    def jumps(self, path: DiscretePath) -> bool:
        """Whether a path leaps across a zone between two nodes: with enough force it can."""
        inside = np.linspace(0, 1, 9)[1:-1, None, None]
        chords = (1 - inside) * path.position[:-1] + inside * path.position[1:]
        chords = chords.reshape(-1, path.position.shape[1])
        zones = [zone for zone in self.problem.constraints if isinstance(zone, KeepOut)]
        return any((zone.excess(chords, chords) > LEAP * zone.radius).any() for zone in zones)

    def zones(self) -> Cause | None:
        """Each keep-out zone relaxed alone."""
        needs, excess = [], 0.0
        for name in [group.name for group in self.nlp.rows.groups if group.name.startswith("keep_out_")][
            :MOST_ZONES
        ]:
            part = self.zone(name)
            found = None if part is None else self.relaxed(part)(self.problem, self.guess)
            if part is not None and found is not None and found.feasible and found.slack[0] < 1:
                needs.append(part.words(found))
                excess = max(excess, float(found.slack[0]))
        return Cause(needs=tuple(needs), excess=excess) if needs else None
