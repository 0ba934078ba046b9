"""Mission: a chain of legs and of what happens between them, put together and checked when made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Any

from dmoc.basics.arguments import both_ends, checked, entries, number, short
from dmoc.basics.docstrings import Named
from dmoc.basics.records import dataclass
from dmoc.effects.base import Effect
from dmoc.ends.base import Boundary
from dmoc.ends.on_limits import refuse_mission_ends
from dmoc.legs.ends import Loose
from dmoc.legs.events import Event, Impulse
from dmoc.legs.legs import Joint, Leg, checked_sums, span_of, start_times
from dmoc.legs.objectives import DeltaV, share_of
from dmoc.parts.actuator import Actuator
from dmoc.parts.constraint import Constraint
from dmoc.parts.forces import FreeForce
from dmoc.parts.objectives import Effort, FinalMass, Fuel, Objective
from dmoc.scene.clock import clock_of
from dmoc.scene.problem import TransferProblem

# The shortest duration of a leg that gives none is this part of the mission's longest [-].
LEAST_SHARE = 1e-4


@dataclass(frozen=True)
class Mission(Named):
    """Move a body from `start` to `goal` in several legs at the least `objective`.

    Parameters
    ----------
    mass : float
        Mass of the body at the start [kg].
    start, goal : Boundary
        As of a `TransferProblem`, or `Free()`; as a goal also `Periodic()`.
    legs : sequence
        `Leg`, `Coast` and, between them or at the ends, `Impulse`, `Drop`, `Via`, `Frame`, `Bounce`, `Flyby`.
    effects, actuator, constraints
        Of every leg that has none of its own.
    objective : Objective
        Of the whole mission, such as `DeltaV()`, `Fuel()`, `FinalMass()`.
    duration : float or (float, float), optional
        Time of the whole mission [s]; a pair leaves it free between the two. What the legs add up to if it is
        not given.
    start_time : float or (float, float)
        Time at the start [s]; a pair (earliest, latest) leaves it free between the two.
    guess : callable, tuple of arrays or MissionSolution, optional
        Starting guess of the path over the whole mission, as of a `TransferProblem`.
    inertia : 3 floats or 3x3 floats, optional
        As of a `TransferProblem`.
    sums : tuple of (int, int, float or (float, float)), optional
        Durations of several legs together [s]: the first and the last of them, counted from 0, and how long.

    Raises
    ------
    ValueError
        If a number has no meaning or two parts do not fit together.
    """

    mass: float
    start: Boundary
    goal: Boundary
    legs: Sequence
    effects: Sequence[Effect] = ()
    actuator: Actuator = FreeForce()
    objective: Objective = Effort()
    constraints: Sequence[Constraint] = ()
    duration: Any = None
    start_time: Any = 0.0
    guess: Any = None
    inertia: Any = None
    sums: tuple[tuple[int, int, Any], ...] = ()
    name: str = field(default="mission", compare=False)
    parameters: dict = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        for name in ("start", "goal"):
            if not isinstance(getattr(self, name), Boundary):
                raise ValueError(f"{name} must be a dmoc.Boundary; got {short(getattr(self, name))}")
        if not isinstance(self.objective, Objective):
            raise ValueError(f"objective must be a dmoc.Objective; got {short(self.objective)}")
        if getattr(self.start, "closes", False):
            raise ValueError(
                "start cannot be Periodic(), which repeats the start; use it as the goal, and Free()"
            )
        checked(self, mass=number("mass", self.mass, "kg", positive=True))
        parts = entries(self.legs)
        if parts is None or not all(isinstance(part, (Leg, Event)) for part in parts):
            raise ValueError(
                "legs must be a sequence of dmoc.Leg, Coast, Impulse, Drop, Via, Frame, Bounce or Flyby; "
                f"got {short(self.legs)}"
            )
        checked(self, legs=tuple(parts))
        if not any(isinstance(part, Leg) for part in self.legs):
            raise ValueError("legs has no leg; give at least one Leg or Coast")
        if self.dropped >= self.mass:
            raise ValueError(
                f"Drop leaves {self.dropped:g} kg behind in all, but the body has {self.mass:g} kg at the "
                "start; drop less or give it more mass"
            )
        if self.duration is not None:
            checked(self, duration=span_of("duration", self.duration))
        checked(self, start_time=start_times(self.start_time))
        checked(self, sums=checked_sums(self.sums, len(self.plan)))
        self._check_spans()
        self._complete_ends()
        for part in self.legs:
            if isinstance(part, Event):
                part.check_dimension(self.dimension)
        self._check_impulses()
        refuse_mission_ends(self, self._whole)
        clock_of(self)

    @property
    def dimension(self) -> int:
        """Number of axes, 1 to 3."""
        return self.start.dimension

    @property
    def free_duration(self) -> bool:
        """Whether some duration is found by the optimisation."""
        return any(leg.free_duration for leg in self.stretches)

    @property
    def closes(self) -> bool:
        """Whether the goal is the state of the start once more."""
        return bool(getattr(self.goal, "closes", False))

    @property
    def start_bounds(self) -> tuple[float, float]:
        """Earliest and latest time of the start [s]."""
        return both_ends(self.start_time)

    @property
    def duration_bounds(self) -> tuple[float, float]:
        """Shortest and longest time that all legs may take together [s]."""
        spans = [both_ends(self.duration_of(leg)) for leg in self.plan]
        for first, last, together in self.sums:
            spans[first : last + 1] = [both_ends(together), *[(0.0, 0.0)] * (last - first)]
        shortest, longest = (sum(side) for side in zip(*spans, strict=True))
        return shortest, longest if self.duration is None else min(longest, both_ends(self.duration)[1])

    @property
    def dropped(self) -> float:
        """Mass that is left behind unburnt on the way [kg]."""
        return sum(part.dropped for part in self.legs if isinstance(part, Event))

    @property
    def plan(self) -> tuple[Leg, ...]:
        """The legs alone."""
        return tuple(part for part in self.legs if isinstance(part, Leg))

    @cached_property
    def leg_names(self) -> tuple[str, ...]:
        """A name for each leg."""
        kinds = (type(leg).__name__.lower() for leg in self.plan)
        return tuple(
            leg.name or f"{kind} {i + 1}" for i, (leg, kind) in enumerate(zip(self.plan, kinds, strict=True))
        )

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """The start, where legs meet, and the goal: one more than there are legs."""
        events: list[list[Event]] = [[]]
        for part in self.legs:
            if isinstance(part, Leg):
                events.append([])
            else:
                events[-1].append(part)
        last = len(events) - 1
        names = ["start", *(f"joint {i}" for i in range(1, last)), "goal"]
        ends = {0: self.start, last: self.goal}
        return tuple(
            Joint(name, tuple(here), i - 1 if i else None, i if i < last else None, ends.get(i))
            for i, (name, here) in enumerate(zip(names, events, strict=True))
        )

    @cached_property
    def stretches(self) -> tuple[TransferProblem, ...]:
        """Each leg as a transfer between two joints, whose states and masses are open."""
        ends = Loose.like(self._whole.start)
        return tuple(
            self._of_leg(leg, ends, ends, self.duration_of(leg), name)
            for leg, name in zip(self.plan, self.leg_names, strict=True)
        )

    def _of_leg(
        self, leg: Leg, start: Boundary, goal: Boundary, duration: Any, name: str, whole: bool = False
    ) -> TransferProblem:
        try:
            actuator = self.actuator if leg.actuator is None else leg.actuator
            share = self.objective if whole else share_of(leg, self.objective, actuator)
            return TransferProblem(
                mass=self.mass,
                start=start,
                goal=goal,
                duration=duration,
                effects=self.effects if leg.effects is None else leg.effects,
                actuator=actuator,
                objective=share,
                constraints=self.constraints if leg.constraints is None else leg.constraints,
                start_time=self.start_bounds[0],
                inertia=self.inertia,
                name=name,
            )
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from error

    @property
    def alone(self) -> TransferProblem | None:
        """The transfer that a mission of one leg is, without events and choices of its own; else None."""
        leg = self.plan[0]
        own = {leg.order, leg.steps, leg.name or None, leg.objective}
        if len(self.legs) > 1 or self.closes or own != {None} or isinstance(self.start_time, tuple):
            return None
        span = self.duration_of(leg) if self.duration is None else self.duration
        whole = self._of_leg(leg, self.start, self.goal, span, self.name, whole=True)
        return replace(whole, guess=self.guess, parameters=self.parameters)

    @cached_property
    def _whole(self) -> TransferProblem:
        """The mission as one transfer by its first leg: it checks the parts and completes the ends."""
        goal = Loose.like(self.start) if self.closes else self.goal
        shortest, longest = self.duration_bounds
        span = shortest if shortest == longest else (shortest, longest)
        leg = replace(self.plan[0], constraints=())
        return self._of_leg(leg, self.start, goal, span, self.leg_names[0])

    def _complete_ends(self) -> None:
        axes = self.start.dimension or self.goal.dimension
        if not axes:
            raise ValueError(
                "neither start nor goal says how many axes there are; give Free(axes) or a center, such as "
                "center=(0, 0)"
            )
        start = self.start.with_dimension(axes)
        checked(self, start=start, goal=self.goal.with_dimension(axes))
        whole = self._whole
        checked(self, start=whole.start, goal=self.goal if self.closes else whole.goal)

    def duration_of(self, leg: Leg) -> Any:
        """What the duration of a leg may be [s], a number or (shortest, longest)."""
        if leg.duration is not None:
            return leg.duration
        if self.duration is None:
            raise ValueError(
                "a leg has no duration and neither has the mission; give one of them, a number or "
                "(shortest, longest) [s]"
            )
        longest = both_ends(self.duration)[1]
        return (LEAST_SHARE * longest, longest)

    def _check_spans(self) -> None:
        """Legs must fit into the duration of the mission."""
        spans = []
        for leg, name in zip(self.plan, self.leg_names, strict=True):
            spans.append(both_ends(span_of(f"duration of {name}", self.duration_of(leg))))
        if self.duration is None:
            return
        shortest, longest = both_ends(self.duration)
        least, most = (sum(side) for side in zip(*spans, strict=True))
        if least > longest or most < shortest:
            raise ValueError(
                f"the legs last {least:g} to {most:g} s together, but the mission {shortest:g} to "
                f"{longest:g} s; change one of them"
            )

    def _check_impulses(self) -> None:
        """Impulses without a limit must cost something, and the objective must be able to say what."""
        impulses = [part for part in self.legs if isinstance(part, Impulse)]
        sought = {type(term) for weight, term in self.objective.terms if weight}
        if impulses and Fuel in sought:
            raise ValueError(
                "Fuel() does not count impulses; use DeltaV() [m/s], or FinalMass() with "
                "Impulse(exhaust_velocity=...)"
            )
        for one in impulses:
            costly = DeltaV in sought or (FinalMass in sought and one.exhaust_velocity is not None)
            if one.limit is None and not costly:
                names = ", ".join(sorted(term.__name__ for term in sought))
                raise ValueError(
                    f"an impulse without a limit costs nothing with {names}; "
                    "use objective=DeltaV(), or Impulse(limit=...) [m/s]"
                )

    def span(
        self, index: int, start: Boundary, goal: Boundary, start_time: float, duration: float
    ) -> TransferProblem:
        """A transfer between two ends by what acts in a leg, for a guess."""
        problem = self._of_leg(self.plan[index], start, goal, duration, self.leg_names[index])
        return replace(problem, start_time=start_time)

    def fixed_at(self, index: int, start_time: float, mass: float, duration: float) -> TransferProblem:
        """A leg as a transfer whose time, mass and duration are known."""
        return replace(self.stretches[index], start_time=start_time, mass=mass, duration=duration)
