"""How far limits must give way: a transfer whose limits can be relaxed, one by one or together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dmoc.basics.digits import down, time_unit, up
from dmoc.basics.quaternions import normalised
from dmoc.diagnosis.elastic import Relaxation, Relaxed
from dmoc.diagnosis.giving import Giving, Limits, Remedy
from dmoc.ipopt.watch import Interrupt
from dmoc.motion.path import DiscretePath
from dmoc.nlp.solving import NLP
from dmoc.nlp.transcription import transcribe_onto
from dmoc.nlp.units import units_of
from dmoc.parts.objectives import Effort
from dmoc.results.between import BOUND
from dmoc.results.facts import Level
from dmoc.scene.problem import TransferProblem

# While a duration is looked for, the slack of a limit may fall to this [-], so that the limit is a tenth of the
# one given: a longer duration needs less than the limit.
LEAST = -0.9
# A path leaps across a zone if a chord between two nodes cuts deeper into it than this part of its size [-].
LEAP = 0.1
# Between the nodes a path is taken to need up to this much more of a zone's slack than its rows say [-].
MOST_CLEARED = 0.2
# At most this many durations are tried before the search for one ends.
MOST_DURATIONS = 9
# Each duration that is tried is at most this much longer or shorter than the one before, in the natural
# logarithm.
WIDEST = 1.0
# The search for a duration aims at one that needs this much less than the limits [-], and ends where it is
# between 0 and twice this.
EXACT = 1e-3


class Relaxable(Limits):
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

    def clear(self, entry: int, limit: Giving, slack: float, path: DiscretePath) -> float:
        """The slack of a limit with which a path keeps to its constraint between the nodes, too."""
        zone = self.problem.constraints[entry]
        q = _between(path)
        times = self.problem.start_time + path.duration * np.interp(
            np.linspace(0, 1, len(q)), np.linspace(0, 1, len(path.fractions)), path.fractions
        )
        made = path.coordinates
        seen = zone.seen_of(made, q, np.zeros((len(q), made.motions.size)))
        for more in np.linspace(0.0, MOST_CLEARED, 101):
            eased = limit.change(self.problem, slack + more).constraints[entry]
            if eased is zone:
                break
            if eased.excess_at(times, *seen).max() <= BOUND:
                return slack + more
        return slack

    def durations(self, joint: Relaxation, first: Relaxed, given: float) -> list[tuple[Remedy, ...]]:
        """A duration for which the limits are enough, by the secant method on logarithms.

        The force that is needed falls with the square of the duration where nothing else acts, and
        each duration starts from the answer for the one before.
        """
        first_duration = self.problem.duration_bounds[0]
        tried = [(0.0, float(np.log1p(first.slack[0])))]
        step, near, enough, kept = 0.5 * tried[0][1], first, None, first.path
        for _ in range(MOST_DURATIONS):
            place = tried[-1][0] + float(np.clip(step, -WIDEST, WIDEST))
            duration = float(first_duration * np.exp(place))
            path = replace(near.path, duration=duration)
            near = joint(replace(self.problem, duration=duration), path, near)
            if not near.feasible:
                break
            tried.append((place, float(np.log1p(near.slack[0]))))
            if near.slack[0] <= 0:
                enough, kept = place, near.path
            if -2 * EXACT <= near.slack[0] <= 0:
                break
            (before, above), (place, below) = tried[-2:]
            slope = (below - above) / (place - before)
            # The next duration is aimed at a little more than enough.
            step = -(below + EXACT) / slope if slope else WIDEST
        if enough is None:
            return []
        return [self._lasting(first_duration * np.exp(enough), given, kept)]

    def _lasting(self, needed: float, given: float, path: DiscretePath) -> tuple[Remedy, ...]:
        """This duration and, should it not be enough, durations a little further off the one given."""
        (size, unit), found = time_unit(given), []
        for looser in self.looser:
            lasting = needed * (1 + looser if needed > given else 1 / (1 + looser))
            told = (up if needed > given else down)(lasting / size)
            shortest = self.given.duration_bounds[0]
            bounds = (shortest, lasting) if self.given.free_duration and shortest < lasting else lasting
            problem = replace(self.given, duration=bounds)
            found.append(
                Remedy(
                    f"{told} {unit} (you gave {given / size:g} {unit})",
                    problem,
                    replace(path, duration=lasting),
                )
            )
        return tuple(found)

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

    def _largest_speed(self) -> float | None:
        # A limit on a rate or on the momentum of a wheel is no speed along the guess.
        speeds = (part.largest_speed() for part in self.problem.constraints if part.unit == "m/s")
        return min((speed for speed in speeds if speed), default=None)


def _between(path: DiscretePath) -> np.ndarray:
    """Coordinates at the nodes and on the chords between them; attitudes of length 1."""
    inside = np.linspace(0, 1, 8, endpoint=False)[:, None]
    q = path.position
    found = (q[:-1, None] * (1 - inside) + q[1:, None] * inside).reshape(-1, q.shape[1])
    found = np.vstack([found, q[-1:]])
    for at in path.coordinates.quaternions:
        found[:, at] = normalised(found[:, at])
    return found
