"""How far limits must give way: a transfer whose limits can be relaxed, one by one or together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dmoc.basics.digits import down, time_unit, up
from dmoc.diagnosis.elastic import Relaxation, Relaxed
from dmoc.motion.path import DiscretePath
from dmoc.nlp.ipopt import Interrupt
from dmoc.nlp.layout import Group
from dmoc.nlp.solving import NLP
from dmoc.nlp.transcription import transcribe_onto
from dmoc.nlp.units import units_of
from dmoc.parts.constraint import Constraint
from dmoc.parts.objectives import Effort
from dmoc.results.facts import Level
from dmoc.scene.problem import TransferProblem

# While a duration is looked for, the slack of a limit may fall to this [-], so that the limit is a tenth of the
# one given: a longer duration needs less than the limit.
LEAST = -0.9
# A path leaps across a zone if a chord between two nodes cuts deeper into it than this part of its size [-].
LEAP = 0.1
# At most this many durations are tried before the search for one ends.
MOST_DURATIONS = 9
# Each duration that is tried is at most this much longer or shorter than the one before, in the natural
# logarithm.
WIDEST = 1.0
# The search for a duration aims at one that needs this much less than the limits [-], and ends where it is
# between 0 and twice this.
EXACT = 1e-3


@dataclass(frozen=True)
class Giving:
    """Limits that give way together: rows with the sign of their slack, unknowns with their shares.

    With a slack s they must be `factor(s)` times as large, and `told(s)` says in words which limit is enough;
    it is empty if none is. The need falls with the duration to the power `falls`.
    """

    told: Callable[[float], str]
    factor: Callable[[float], float]
    falls: int
    rows: np.ndarray
    signs: np.ndarray
    columns: np.ndarray
    below: np.ndarray
    above: np.ndarray


class Relaxable:
    """A transfer of fixed duration, on the mesh of a guess, whose objective is the effort.

    Limits are told of as those of `given`, which are smaller where they were raised. `tell` takes the `Level`
    of every run; `interrupt` ends them.
    """

    def __init__(
        self,
        problem: TransferProblem,
        guess: DiscretePath,
        tell: Callable[[Level], None],
        interrupt: Interrupt,
        given: TransferProblem | None = None,
    ):
        self.tell, self.interrupt = tell, interrupt
        longest = problem.duration_bounds[1]
        self.given, self.guess = given or problem, replace(guess, duration=longest, multipliers={})
        self.problem = replace(problem, duration=longest, objective=Effort())
        self.nlp: NLP = transcribe_onto(self.problem, self.guess, units_of(self.problem, self.guess))
        self.bounds = self.nlp.bounds(self.problem)

    def relaxed(self, *limits: Giving, least: float = 0.0) -> Relaxation:
        """The elastic NLP in which these limits give way by one slack."""
        rows = np.zeros((self.nlp.rows.size, 1))
        for limit in limits:
            rows[limit.rows, 0] = limit.signs
        columns, below, above = (
            np.concatenate([getattr(limit, name) for limit in limits]) for name in ("columns", "below", "above")
        )
        return Relaxation(self.nlp, rows, columns, below, above, least, self.tell, self.interrupt)

    def taken(self) -> tuple[float, float]:
        """Mean force and mean speed along the guess over their limits [-]; 0 without a limit.

        With controls of zero the rows of motion are off by the momentum that the controls would have to give.
        """
        nlp, time = self.nlp, self.guess.duration
        coast, rows = replace(self.guess, control=0 * self.guess.control), nlp.rows["dynamics"]
        g = nlp.assembly.constraints(nlp.pack(coast), nlp.parameters(self.problem)).full().ravel()
        force = self.problem.mass * np.linalg.norm(rows.of(g) / rows.scales, axis=1).sum() / time
        speed = np.linalg.norm(np.diff(coast.place, axis=0), axis=1).sum() / time
        limits = self.problem.actuator.force_limit(), self._largest_speed()
        return tuple(size / (limit or np.inf) for size, limit in zip((force, speed), limits, strict=True))

    def limits(self) -> list[Giving]:
        """The limits that a longer duration eases."""
        return [limit for limit in (self.force(), self.speed(), self.propellant()) if limit is not None]

    def force(self) -> Giving | None:
        """The limit of the actuator."""
        raised, given = self.problem.actuator, self.given.actuator
        if not raised.limited:
            return None

        def told(slack: float) -> str:
            return given.needs(raised.eased(slack))

        def factor(slack: float) -> float:
            return (raised.eased(slack).main_limit() or 0.0) / (given.main_limit() or 1.0)

        groups = [group for group in self._groups() if group.owner and group.owner.field == "actuator"]
        return self._giving(told, factor, groups, self.nlp.columns["force"].indices.ravel(), falls=2)

    def speed(self) -> Giving | None:
        """The limits on the speed; messages name the lowest of them."""
        known = [
            (speed, i) for i, part in enumerate(self.problem.constraints) if (speed := part.largest_speed())
        ]
        if not known:
            return None
        _, entry = min(known)
        raised, given = self.problem.constraints[entry], self.given.constraints[entry]

        def told(slack: float) -> str:
            eased = raised.eased(slack)
            return given.needs(eased, entry + 1, "") if eased else ""

        def factor(slack: float) -> float:
            eased = raised.eased(slack)
            return (eased.largest_speed() or 0.0) / (given.largest_speed() or 1.0) if eased else np.inf

        return self._giving(told, factor, [group for group in self._groups() if self._limits_speed(group)])

    def propellant(self) -> Giving | None:
        """The dry mass, which gives way downwards: at a slack of 1 there is twice the propellant."""
        dry = self.problem.actuator.dry_mass
        load = self.problem.mass - dry
        if not self.problem.actuator.burns or dry <= 0:
            return None

        def told(slack: float) -> str:
            needed = dry - slack * load
            return f"a dry mass of {down(needed)} kg (you gave {dry:g} kg)" if needed > 0 else ""

        # The mass at the start is given and stays.
        columns = self.nlp.columns["mass"].indices.ravel()[1:]
        below, none = self.bounds[0][columns] * load / dry, np.empty(0, int)
        return Giving(told, lambda slack: 1 + slack, 1, none, none, columns, below, np.zeros(len(columns)))

    def zones(self) -> list[Giving]:
        """The constraints that no longer duration eases, each by itself."""
        entries = {
            group.owner.entry
            for group in self._groups()
            if group.owner and group.owner.field == "constraints" and not self._limits_speed(group)
        }
        found = (self._zone(self.problem.constraints[entry], entry) for entry in sorted(entries))
        return [limit for limit in found if limit is not None]

    def _zone(self, zone: Constraint, entry: int) -> Giving | None:
        mine = ("constraints", entry)
        groups = [group for group in self._groups() if group.owner and group.owner[:2] == mine]
        scale, unit = float(groups[0].scales.max()), groups[0].units[0]

        def told(slack: float) -> str:
            eased = zone.eased(slack)
            return zone.needs(eased, entry + 1, f"{up(slack / scale)} {unit}".strip()) if eased else ""

        return self._giving(told, lambda slack: 1 + slack, groups)

    def _giving(
        self,
        told: Callable[[float], str],
        factor: Callable[[float], float],
        groups: list[Group],
        columns: np.ndarray | None = None,
        falls: int = 1,
    ) -> Giving | None:
        """Rows of some groups with a limit on one side, and unknowns with limits."""
        lbx, ubx, lbg, ubg = self.bounds
        # A row with both sides finite, an equation for example, has no side to which it could give way.
        rows = np.concatenate([*(group.indices.ravel() for group in groups), np.empty(0, int)]).astype(int)
        rows = rows[np.isfinite(lbg[rows]) != np.isfinite(ubg[rows])]
        columns = np.empty(0, int) if columns is None else columns
        above = np.where(np.isfinite(ubx[columns]), ubx[columns], 0.0)
        # A lower limit gives way if it mirrors the upper one; a floor, such as a throttle of 0, stays.
        below = np.where(lbx[columns] == -ubx[columns], above, 0.0)
        if not len(rows) and not above.any():
            return None
        signs = np.where(np.isfinite(lbg[rows]), 1.0, -1.0)
        return Giving(told, factor, falls, rows, signs, columns, below, above)

    def durations(self, joint: Relaxation, first: Relaxed, given: float) -> list[str]:
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
            # The next duration is aimed at a little more than enough.
            step = -(below + EXACT) / slope if slope else WIDEST
        if enough is None:
            return []
        needed = first_duration * np.exp(enough)
        size, unit = time_unit(given)
        told = (up if needed > given else down)(needed / size)
        return [f"{told} {unit} (you gave {given / size:g} {unit})"]

    def leaps(self, path: DiscretePath) -> bool:
        """Whether a path leaps across a zone between two nodes, where no row stops a large enough force."""
        inside = np.linspace(0, 1, 9)[1:-1, None, None]
        for zone in self.problem.constraints:
            if np.isfinite(zone.feature()):
                place = path.place_of(zone)
                chords = ((1 - inside) * place[:-1] + inside * place[1:]).reshape(-1, place.shape[1])
                if (zone.excess(chords, chords) > LEAP * zone.feature()).any():
                    return True
        return False

    def _groups(self) -> tuple[Group, ...]:
        return self.nlp.rows.groups

    def _limits_speed(self, group: Group) -> bool:
        owner = group.owner
        return owner is not None and owner.field == "constraints" and owner.of(self.problem).limits_speed

    def _largest_speed(self) -> float | None:
        # A limit on a rate or on the momentum of a wheel is no speed along the guess.
        speeds = (part.largest_speed() for part in self.problem.constraints if part.unit == "m/s")
        return min((speed for speed in speeds if speed), default=None)
