"""Team: several bodies on one clock and what holds between them, put together and checked when made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from typing import Any

import numpy as np

from dmoc.basics.arguments import checked, entries, short
from dmoc.basics.docstrings import Named
from dmoc.basics.records import dataclass
from dmoc.legs.together import Frames, Together
from dmoc.parts.objectives import Objective
from dmoc.parts.rows import snake
from dmoc.scene.mission import Mission
from dmoc.scene.problem import TransferProblem

# What transfers and missions are called that were given no name.
UNNAMED = tuple(kind.__dataclass_fields__["name"].default for kind in (TransferProblem, Mission))
# Durations are equal within this part of them [-].
SAME = 1e-9


@dataclass(frozen=True)
class Team(Named):
    """Several bodies, each with its own transfer, that start and end at the same time.

    Each body keeps its own mass, effects, actuator and constraints; what holds between them is said by
    `together`. The least sum of their objectives is sought.

    Parameters
    ----------
    members : sequence of TransferProblem or Mission
        One a body, all of one dimension and start time. Transfers have one duration; a free one is the same for
        all of them. Where some member is a mission of several legs, all last equally long, and legs end when
        their own durations say.
    together : sequence of Together
        `Apart` and `Meet`.
    names : sequence of str
        What the bodies are called; the names of their problems or "body 1", "body 2" and so on if not given.
    guess : TeamSolution or sequence, optional
        Starting guess: a former solution, or one guess a body as of a `TransferProblem`.

    Raises
    ------
    ValueError
        If there are fewer than two bodies, or they do not fit together.

    Examples
    --------
    >>> near, far = (
    ...     TransferProblem(m, State((x, 0), (0, 0)), Free(), 10.0) for m, x in ((1.0, 0.0), (2.0, 3.0))
    ... )
    >>> team = Team([near, far], [Meet()])
    """

    members: Sequence
    together: Sequence[Together] = ()
    names: Sequence[str] = ()
    guess: Any = None
    name: str = field(default="team", compare=False)
    parameters: dict = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        given = entries(self.members)
        if given is None or len(given) < 2:
            raise ValueError(f"members must be two or more transfers or missions; got {short(self.members)}")
        checked(self, members=tuple(_member(i, one) for i, one in enumerate(given)))
        checked(self, names=self._checked_names())
        parts = (self.together,) if isinstance(self.together, Together) else entries(self.together)
        if parts is None or not all(isinstance(part, Together) for part in parts):
            raise ValueError(f"together must be a sequence of dmoc.Apart and Meet; got {short(self.together)}")
        checked(self, together=tuple(parts))
        self._check_alike()
        if self.phased:
            self._check_durations()
        for part in self.together:
            self._check_between(part)
        self._check_frames()
        self._check_ends()

    @property
    def dimension(self) -> int:
        """Number of axes, 1 to 3."""
        return self.members[0].dimension

    @property
    def phased(self) -> bool:
        """Whether some member is a mission of several legs, so that the clock has joints inside."""
        return any(hasattr(one, "joints") for one in self.members)

    @property
    def start_time(self) -> Any:
        """Time at the start [s], or the earliest and the latest one."""
        return self.members[0].start_time

    @property
    def free_duration(self) -> bool:
        """Whether some duration is found by the optimisation."""
        return any(one.free_duration for one in self.members)

    @property
    def duration_bounds(self) -> tuple[float, float]:
        """Shortest and longest duration [s]; equal if it is fixed."""
        shortest, longest = zip(*(one.duration_bounds for one in self.members), strict=True)
        return max(shortest), min(longest)

    @property
    def mass(self) -> float:
        """Mass of all bodies at the start [kg]."""
        return sum(one.mass for one in self.members)

    @property
    def objective(self) -> Objective:
        """The objective of the first body: those of all have its unit and its sense, and are added up."""
        return self.members[0].objective

    @property
    def actuator(self) -> Any:
        """The actuator of the first body, which says with its objective what the unit of the sum is."""
        return self.members[0].actuator

    @property
    def stretches(self) -> tuple[TransferProblem, ...]:
        """The transfers beside each other, as the legs of a mission are one after the other."""
        return tuple(self.members)

    @property
    def leg_names(self) -> tuple[str, ...]:
        """What messages call the transfers."""
        return tuple(self.names)

    def pairs(self) -> list[tuple[Together, int, int]]:
        """Each part that holds between two bodies, with the places of these."""
        return [(part, a, b) for part in self.together for a, b in part.pairs(self.names)]

    def pair_names(self) -> list[str]:
        """What messages call each of `pairs`: its part and its two bodies, and which of alike parts it is."""
        found: list[str] = []
        for part, a, b in self.pairs():
            kind = snake(type(part).__name__).replace("_", " ")
            name = f"{kind} {self.names[a]} and {self.names[b]}"
            alike = sum(other == name or other.startswith(f"{name}, ") for other in found)
            found.append(name + (f", {alike + 1}" if alike else ""))
        return found

    def fixed_at(self, index: int, start_time: float, mass: float, duration: float) -> TransferProblem:
        """The transfer of a body by its own name: of a team time, mass and duration are its own."""
        return replace(self.members[index], name=self.names[index])

    def _checked_names(self) -> tuple[str, ...]:
        count, given = len(self.members), entries(self.names)
        if given is None or not all(isinstance(name, str) and name for name in given):
            raise ValueError(f"names must be words, one a body; got {short(self.names)}")
        found = given
        if not given:
            own = [one.name for one in self.members]
            usable = not {*UNNAMED} & {*own} and len(set(own)) == count
            found = tuple(own) if usable else tuple(f"body {i + 1}" for i in range(count))
        if len(found) != count or len(set(found)) < count:
            raise ValueError(f"names must be {count} words, each another one; got {short(found)}")
        return tuple(found)

    def _check_alike(self) -> None:
        """What all bodies must have in common."""
        first = self.members[0]
        facts = {
            "dimension": lambda one: (one.dimension, "axes"),
            "start_time": lambda one: (one.start_time, "s"),
            "duration": lambda one: (0.0 if self.phased else one.duration, "s"),
            "objective's unit": lambda one: (one.objective.unit_with(one.actuator), ""),
            "objective's sense": lambda one: ("maximised" if one.objective.sense < 0 else "minimised", ""),
        }
        for what, fact in facts.items():
            for name, one in zip(self.names, self.members, strict=True):
                (mine, unit), (other, _) = fact(one), fact(first)
                if mine != other:
                    raise ValueError(
                        f"all bodies of a team must have the same {what}; {name} has {short(mine)} and "
                        f"{self.names[0]} has {short(other)}{' ' + unit if unit else ''}"
                    )

    def _check_durations(self) -> None:
        """All members last equally long, and one clock is common to their durations."""
        shortest, longest = self.duration_bounds
        if shortest > longest * (1 + SAME):
            spans = [one.duration_bounds for one in self.members]
            slow, fast = spans.index(max(spans)), spans.index(min(spans, key=lambda span: span[1]))
            raise ValueError(
                f"all bodies of a team last equally long, but {self.names[slow]} lasts at least {shortest:g} s "
                f"and {self.names[fast]} at most {longest:g} s; change a duration of one of them"
            )

    def _check_between(self, part: Together) -> None:
        for name in part.between:
            if name not in self.names:
                raise ValueError(
                    f"{type(part).__name__}: no body is called {name!r}; there are {', '.join(self.names)}"
                )

    def _check_frames(self) -> None:
        """Distances are those in one frame: who keeps one, or meets, is in the same frame as the other."""
        frames = [Frames.of(one) for one in self.members]
        for part, a, b in self.pairs():
            if why := frames[a].differ(frames[b], all_along=part.distance_kept > 0):
                what = "keep a distance" if part.distance_kept else "meet"
                both = f"{self.names[a]} and {self.names[b]}"
                raise ValueError(f"{both} are to {what}, which is counted in one frame, but {why}")

    def _check_ends(self) -> None:
        """Ends that are fixed can neither be moved apart nor together."""
        for part, a, b in self.pairs():
            both, kept = f"{self.names[a]} and {self.names[b]}", part.distance_kept
            if part.meets and any(_turns_at_goal(self.members[i]) for i in (a, b)):
                raise ValueError(
                    f"{both} are to meet, but the velocity of one is turned at its goal; add a leg"
                )
            start, goal = (self._gap(a, b, end, 0) for end in ("start", "goal"))
            for verb, place in (("start", start), ("end", goal)):
                if (gap := float(np.linalg.norm(place))) < kept * (1 - 1e-9):
                    raise ValueError(
                        f"{both} {verb} {gap:g} m apart, but are to keep {kept:g} m; move one of them or "
                        "lessen the distance"
                    )
            if kept and len(start) == 1 and (start * goal < 0).all():
                raise ValueError(
                    f"{both} would have to pass through each other on a line, but are to keep {kept:g} m; move "
                    "one of their goals"
                )
            if part.missed(goal, self._gap(a, b, "goal", 1)) > 0:
                raise ValueError(
                    f"{both} are to meet, but their goals are fixed and differ; leave one of them open, for "
                    "example goal=Free()"
                )
            if kept and any({a, b} <= bodies for bodies in self.meetings()):
                raise ValueError(
                    f"{both} are to meet, but also to keep {kept:g} m; name in between whom each of the two is "
                    "about"
                )

    def meetings(self) -> list[set[int]]:
        """The bodies that are in one place at the end, place by place."""
        found: list[set[int]] = []
        for part, a, b in self.pairs():
            if part.meets:
                joined = [bodies for bodies in found if bodies & {a, b}]
                found = [bodies for bodies in found if bodies not in joined] + [{a, b}.union(*joined)]
        return found

    def _gap(self, a: int, b: int, end: str, which: int) -> np.ndarray:
        """The place (0) or velocity (1) of a body at an end from another one's; NaN where one is free."""
        first, second = (getattr(self.members[i], end).point.fixed()[which] for i in (a, b))
        return second - first


def _turns_at_goal(one: Any) -> bool:
    """Whether something at the goal of a mission changes the velocity without a push."""
    return hasattr(one, "joints") and any(event.turns_velocity for event in one.joints[-1].events)


def _member(index: int, given: Any) -> Any:
    one = getattr(given, "alone", None) or given
    if not hasattr(one, "joints") and not isinstance(one, TransferProblem):
        raise ValueError(f"members[{index}] must be a dmoc.TransferProblem or Mission; got {short(given)}")
    if one.objective.learns:
        raise ValueError(f"members[{index}] has Information as its objective, which is one of a transfer alone")
    if getattr(one, "system", None) is not None or getattr(one, "links", None):
        raise ValueError(
            f"members[{index}] has links or several bodies of its own, and a body of a team has none; "
            "bodies that links join are one dmoc.System"
        )
    if not one.start.has_position:
        raise ValueError(
            f"members[{index}] has an attitude alone, and nothing can hold between it and others; give its "
            "ends a position (Pose), or solve it by itself"
        )
    return one
