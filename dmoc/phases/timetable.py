"""The clock of a team of missions: cut into phases wherever a body has a joint, in an order that is given."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from dmoc.basics.arguments import both_ends
from dmoc.basics.records import dataclass
from dmoc.legs.legs import Joint
from dmoc.phases.order import SAME, Order, as_mission, called
from dmoc.scene.mission import LEAST_SHARE, Mission
from dmoc.scene.problem import TransferProblem
from dmoc.scene.team import Team

# A phase whose duration follows from others must last at least this part of the whole [-].
SOME = 1e-9


class Span(NamedTuple):
    """How long phases last together [s]: the first and the last of them, the shortest and the longest."""

    first: int
    last: int
    shortest: float
    longest: float


@dataclass(frozen=True)
class Timetable:
    """A team of missions whose legs are cut wherever another body has a joint.

    Between two cuts, in a phase, no body has a joint: there all of them share a mesh, as the transfers of a
    team do, and the durations of phases are unknowns that all of them share. Where legs meet that are parts of
    one nothing happens: state and mass go on.

    Attributes
    ----------
    team : Team
    order : tuple of tuples of Place
        In which order the joints follow each other.
    shortest : float
        The part of the whole that a phase between joints of two bodies lasts at least [-]. Where steps are far
        shorter there than elsewhere, iterations hardly converge; and whether joints would rather be in another
        order shows at any such bound.
    """

    team: Team
    order: Order
    shortest: float = LEAST_SHARE

    @cached_property
    def missions(self) -> tuple[Mission, ...]:
        """All bodies as missions, as they were stated."""
        return tuple(as_mission(one) for one in self.team.members)

    @property
    def count(self) -> int:
        """Number of phases."""
        return len(self.order) + 1

    @cached_property
    def leg_of(self) -> np.ndarray:
        """Which leg of each body is flown in each phase, shape (bodies, phases)."""
        found = np.zeros((len(self.missions), self.count), int)
        for i, group in enumerate(self.order):
            for place in group:
                found[place.body, i + 1 :] += 1
        return found

    @cached_property
    def spans(self) -> list[Span]:
        """What is asked of the durations of phases, each once."""
        found: dict[Span, None] = {}
        for mission, mine in zip(self.missions, self.leg_of, strict=True):
            asked = [(i, i, mission.duration_of(leg)) for i, leg in enumerate(mission.plan)]
            asked += mission.sums
            if mission.duration is not None:
                asked.append((0, len(mission.plan) - 1, mission.duration))
            for first, last, span in asked:
                phases = np.flatnonzero((mine >= first) & (mine <= last))
                found[Span(int(phases[0]), int(phases[-1]), *both_ends(span))] = None
        return list(found)

    @cached_property
    def known(self) -> np.ndarray:
        """The durations of phases that follow from those that are given [s], NaN where they are free.

        Raises
        ------
        ValueError
            If some durations contradict each other.
        """
        fixed = [span for span in self.spans if span.shortest == span.longest]
        rows = np.array([_row(span, self.count) for span in fixed]).reshape(-1, self.count)
        values = np.array([span.shortest for span in fixed])
        found = np.full(self.count, np.nan)
        if not len(rows):
            return found
        durations, _, rank, _ = np.linalg.lstsq(rows, values, rcond=None)
        off = float(np.abs(rows @ durations - values).max())
        if off > SAME * values.max():
            raise ValueError(
                f"the legs of {' and '.join(self.team.names)} are to last times that differ by {off:g} s; all "
                "bodies of a team last equally long: change one of them"
            )
        for i in range(self.count):
            unit = np.eye(self.count)[i : i + 1]
            if np.linalg.matrix_rank(np.vstack([rows, unit])) == rank:
                found[i] = durations[i]
        return found

    @property
    def possible(self) -> bool:
        """Whether joints can follow each other in this order."""
        least, bounds = SOME * max(span.longest for span in self.spans), self.bounds
        fits = [bounds[span.first : span.last + 1, 0].sum() <= span.longest * (1 + SAME) for span in self.spans]
        reach = [
            bounds[span.first : span.last + 1, 1].sum() >= span.shortest * (1 - SAME) for span in self.spans
        ]
        lasting = (np.nan_to_num(self.known, nan=1.0) > least).all() and (bounds[:, 0] <= bounds[:, 1]).all()
        return bool(lasting and all(fits) and all(reach))

    @cached_property
    def bounds(self) -> np.ndarray:
        """The shortest and the longest duration of each phase [s], shape (phases, 2)."""
        longest = self.team.duration_bounds[1]
        found = np.array([[self.shortest * longest, longest]] * self.count)
        for i, side in enumerate(found):
            covering = [span for span in self.spans if span.first <= i <= span.last]
            alone = [span.shortest for span in covering if span.first == span.last]
            side[:] = max(alone, default=side[0]), min([longest, *(span.longest for span in covering)])
        given = ~np.isnan(self.known)
        found[given] = self.known[given, None]
        return found

    @cached_property
    def rows(self) -> list[Span]:
        """What bounds of single phases do not say: durations of several phases together, none of them twice."""
        found, used = [], np.empty((0, self.count))
        free = np.isnan(self.known)
        for span in self.spans:
            row = _row(span, self.count) * free
            mine = self.bounds[span.first : span.last + 1]
            if span.shortest < span.longest:
                low, high = mine.sum(axis=0)
                if row.sum() > 1 and (span.shortest > low or span.longest < high):
                    found.append(span)
                continue
            if row.any() and np.linalg.matrix_rank(np.vstack([used, row])) > len(used):
                used = np.vstack([used, row])
                found.append(span)
        return found

    @property
    def between(self) -> list[int]:
        """The phases between joints of different bodies whose shortest duration nobody asked for."""
        alone = {span.first for span in self.spans if span.first == span.last}
        return [i for i in range(1, self.count - 1) if i not in alone and np.isnan(self.known[i])]

    def short(self, durations: np.ndarray) -> list[int]:
        """The phases between joints of two bodies that are as short as they may be, by their durations [s]."""
        spare = LEAST_SHARE * durations.sum()
        return [i for i in self.between if durations[i] <= self.bounds[i, 0] + spare]

    @cached_property
    def cut(self) -> tuple[Mission, ...]:
        """The missions of all bodies with as many legs as there are phases, whose durations stand alone."""
        return tuple(self._cut(body) for body in range(len(self.missions)))

    def _cut(self, body: int) -> Mission:
        mission, mine, last = self.missions[body], self.leg_of[body], self.count - 1
        parts: list[Any] = list(mission.joints[0].events)
        for phase, leg in enumerate(mine):
            same = np.flatnonzero(mine == leg)
            name = mission.leg_names[leg]
            if len(same) > 1:
                name = f"{name}, part {phase - same[0] + 1}"
            low, high = map(float, self.bounds[phase])
            span = low if low == high else (low, high)
            parts.append(replace(mission.plan[leg], duration=span, name=name))
            if phase == last or mine[phase + 1] != leg:
                parts += mission.joints[leg + 1].events
        name = self.team.names[body]
        return replace(mission, legs=tuple(parts), duration=None, sums=(), guess=None, name=name)

    @cached_property
    def stretches(self) -> tuple[TransferProblem, ...]:
        """The legs of all bodies, body by body."""
        return tuple(leg for mission in self.cut for leg in mission.stretches)

    @cached_property
    def leg_names(self) -> tuple[str, ...]:
        """What messages call the legs of all bodies."""
        pairs = zip(self.names, self.cut, strict=True)
        return tuple(f"{name}, {leg}" for name, mission in pairs for leg in mission.leg_names)

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """The joints of all bodies with the places of their legs among all, under names of their own."""
        found = []
        for body, (name, mission) in enumerate(zip(self.names, self.cut, strict=True)):
            first = body * self.count
            for joint in mission.joints:
                left, right = (None if side is None else first + side for side in (joint.left, joint.right))
                found.append(replace(joint, name=called(name, joint.name), left=left, right=right))
        return tuple(found)

    def fixed_at(self, index: int, start_time: float, mass: float, duration: float) -> TransferProblem:
        """A leg as a transfer whose time, mass and duration are known."""
        body, phase = divmod(index, self.count)
        return self.cut[body].fixed_at(phase, start_time, mass, duration)

    def words(self) -> str:
        """The joints in their order, for people."""
        told = [
            " and ".join(
                f"{self.names[place.body]} {self.missions[place.body].joints[place.joint].name}"
                for place in group
            )
            for group in self.order
        ]
        return ", ".join(told)

    # What a team of transfers answers, too.

    @property
    def names(self) -> tuple[str, ...]:
        """What the bodies are called."""
        return tuple(self.team.names)

    @property
    def name(self) -> str:
        return self.team.name

    @property
    def parameters(self) -> dict:
        return self.team.parameters

    @property
    def dimension(self) -> int:
        return self.team.dimension

    @property
    def mass(self) -> float:
        return self.team.mass

    @property
    def objective(self) -> Any:
        return self.team.objective

    @property
    def actuator(self) -> Any:
        return self.team.actuator

    @property
    def free_duration(self) -> bool:
        """Whether some phase may last longer or shorter."""
        return bool(np.isnan(self.known).any())

    @property
    def start_bounds(self) -> tuple[float, float]:
        """Earliest and latest time of the start [s]."""
        return both_ends(self.team.start_time)

    def pairs(self) -> list:
        return self.team.pairs()

    def pair_names(self) -> list[str]:
        return self.team.pair_names()


def _row(span: Span, count: int) -> np.ndarray:
    """Which phases a span is made of, 1 or 0."""
    at = np.arange(count)
    return ((at >= span.first) & (at <= span.last)).astype(float)
