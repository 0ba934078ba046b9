"""Why a solve failed, in the user's words and units, and what would have to give way."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dmoc.actuators import BallForce, BoxForce
from dmoc.constraints import KeepOut, SpeedLimit
from dmoc.mesh import Guess
from dmoc.objectives import Effort
from dmoc.problem import TransferProblem
from dmoc.relaxation import MET, Relaxation, Relaxed
from dmoc.transcription import NLP, transcribe_onto, units_of

# The least slack of a limit on the way to a duration that needs less: a tenth of the limit.
LEAST = -0.9
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
    path : Guess or None
        A path that meets every row, if there is one after all.
    needs : tuple of str
        What would be enough, each by itself: "a force limit of 0.26 N (you gave 0.2 N)".
    rows : tuple of str
        Rows that cannot be met together; empty where a limit explains it.
    excess : float
        How much more than its limits allow the transfer needs, relative to them; infinite if no limit
        is to blame.
    """

    path: Guess | None = None
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


def cause_of(problem: TransferProblem, guess: Guess) -> Cause:
    """Why there is no path near a guess, found on its mesh: limits relaxed one by one, then every row."""
    case = _Case(problem, guess)
    limits = [part for part in (case.force(), case.speed()) if part is not None]
    if not limits:
        return case.rows()
    joint = case.relaxed(*limits, least=LEAST)
    found = joint(case.problem, case.guess)
    if not found.feasible:
        return case.rows()
    if case.jumps(found.path):
        return case.zones() or case.rows()
    if found.slack[0] <= MET:
        return Cause(path=found.path)
    needs = []
    for part in limits:
        alone = found if len(limits) == 1 else case.relaxed(part)(case.problem, case.guess)
        if alone.feasible:
            needs.append(part.words(float(alone.slack[0])))
    needs += case.duration(joint, found)
    return Cause(needs=tuple(needs), excess=float(found.slack[0])) if needs else case.rows()


@dataclass(frozen=True)
class _Part:
    """Limits that give way together: rows with the sign of their slack, unknowns with their shares."""

    words: Any
    rows: np.ndarray
    signs: np.ndarray
    columns: np.ndarray
    below: np.ndarray
    above: np.ndarray


class _Case:
    """A transfer of fixed duration, on the mesh of a guess, whose objective is the effort."""

    def __init__(self, problem: TransferProblem, guess: Guess):
        longest = problem.duration_bounds[1]
        self.original, self.guess = problem, replace(guess, duration=longest, multipliers={})
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

    def part(self, pattern: str, words: Any, columns: np.ndarray | None = None) -> _Part | None:
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
        return _Part(words, rows, np.where(np.isfinite(lbg[rows]), 1.0, -1.0), columns, below, above)

    def force(self) -> _Part | None:
        """The limit of the actuator."""
        actuator = self.problem.actuator
        if actuator.force_limit() is None:
            return None
        columns = self.nlp.columns["force"].indices.ravel()
        return self.part("actuator", lambda slack: _force_words(actuator, slack), columns)

    def speed(self) -> _Part | None:
        limits = [limit.limit for limit in self.problem.constraints if isinstance(limit, SpeedLimit)]
        if not limits:
            return None
        least = min(limits)
        return self.part(
            r"speed_limit_\d+|\w+\.speed",
            lambda slack: f"a speed limit of {_up(least * np.sqrt(1 + slack))} m/s (you gave {least:g} m/s)",
        )

    def zone(self, name: str) -> _Part | None:
        """One keep-out zone."""
        index = int(name.rsplit("_", 1)[1])
        zone = self.problem.constraints[index - 1]
        if not isinstance(zone, KeepOut):
            return None

        def words(slack: float) -> str:
            radius = _down(zone.radius * np.sqrt(max(1 - slack, 0.0)))
            return f"keep-out {index} of at most {radius} m radius (you gave {zone.radius:g} m)"

        return self.part(name, words)

    def duration(self, joint: Relaxation, first: Relaxed) -> list[str]:
        """A duration for which the limits are enough, by the secant method on logarithms.

        The force that is needed falls with the square of the duration where nothing else acts, and
        each duration starts from the answer for the one before.
        """
        given = self.problem.duration_bounds[0]
        tried = [(0.0, float(np.log1p(first.slack[0])))]
        step, near, enough = 0.5 * tried[0][1], first, None
        for _ in range(MOST_DURATIONS):
            place = tried[-1][0] + float(np.clip(step, -WIDEST, WIDEST))
            duration = float(given * np.exp(place))
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
        needed = given * np.exp(enough)
        return [f"{_up(needed) if enough > 0 else _down(needed)} s (you gave {given:g} s)"]

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

    def jumps(self, path: Guess) -> bool:
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
                needs.append(part.words(float(found.slack[0])))
                excess = max(excess, float(found.slack[0]))
        return Cause(needs=tuple(needs), excess=excess) if needs else None


def _force_words(actuator: Any, slack: float) -> str:
    """The limit that is enough, beside the one given."""
    if isinstance(actuator, BallForce):
        return f"a force limit of {_up(actuator.limit * np.sqrt(1 + slack))} N (you gave {actuator.limit:g} N)"
    if isinstance(actuator, BoxForce) and isinstance(actuator.limit, tuple):
        needed = ", ".join(_up(limit * (1 + slack)) for limit in actuator.limit)
        given = ", ".join(f"{limit:g}" for limit in actuator.limit)
        return f"force limits of ({needed}) N (you gave ({given}) N)"
    given = actuator.force_limit()
    name = "force limit" if isinstance(actuator, BoxForce) else "largest thrust"
    return f"a {name} of {_up(given * (1 + slack))} N (you gave {given:g} N)"


def _up(value: float) -> str:
    """Four digits, rounded away from what is too little."""
    return _rounded(value, np.ceil)


def _down(value: float) -> str:
    return _rounded(value, np.floor)


def _rounded(value: float, how: Any) -> str:
    if value <= 0:
        return "0"
    unit = 10.0 ** (np.floor(np.log10(value)) - 3)
    # a whole number of units stays what it is
    return f"{how(round(value / unit, 2)) * unit:.10g}"
