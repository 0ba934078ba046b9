"""TransferProblem: the physics of one transfer, put together and checked when made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from functools import cached_property
from typing import Any

import numpy as np

from dmoc.basics.arguments import checked, entries, number, short
from dmoc.basics.docstrings import Named
from dmoc.basics.records import dataclass
from dmoc.configurations.of_problem import unknown_parts
from dmoc.effects.base import Effect
from dmoc.ends.base import Boundary
from dmoc.ends.mixed import with_both
from dmoc.ends.on_limits import refuse_ends_beyond_limits
from dmoc.ends.wheels import with_wheels
from dmoc.links.holonomic import Holonomic
from dmoc.links.system import System
from dmoc.parts.actuator import Actuator
from dmoc.parts.constraint import Constraint
from dmoc.parts.forces import FreeForce
from dmoc.parts.largest import learned_opened
from dmoc.parts.objectives import Effort, FinalMass, Objective, Time
from dmoc.scene.attraction import Attraction
from dmoc.scene.fits import check_acts_on, check_functions, turning_checked
from dmoc.scene.systems import check_limited, check_links, check_pushed, of_system

# A duration sits on a limit that is nearer than this part of it [-]: the barrier keeps it so far away.
SITS_ON = 1e-5


@dataclass(frozen=True)
class TransferProblem(Named):
    """Move a body from `start` to `goal` under `effects`, pushed by `actuator`, at the least `objective`.

    Parameters
    ----------
    mass : float or System
        Mass of the body at the start [kg], or several bodies; start and goal are then dictionaries of the
        `State` of each by its name, and a list of actuators acts on them.
    start, goal : Boundary
        Where the transfer starts and ends, for example `State(position, velocity)` in m and m/s.
    duration : float or (float, float)
        Time of the transfer [s]; a pair (shortest, longest) leaves it free between the two.
    effects : sequence of Effect
        Forces and potentials that act on the body. An effect that is not listed costs no time.
    actuator : Actuator
        The part that pushes the body.
    objective : Objective
        The quantity that is minimised, or maximised as `FinalMass` is.
    constraints : sequence of Constraint
        Limits that the path keeps all along the way.
    guess : callable, tuple of arrays or Solution, optional
        Starting guess of the path: a function of the time [s] that gives the position [m], arrays
        (times, positions) or (times, positions, controls) of shapes (count,), (count, dimension) and
        (count, controls), or a former solution.
    start_time : float
        Time at the start [s].
    inertia : 3 floats or 3x3 floats, optional
        Inertia of the body in body axes about its centre of mass [kg m^2], principal moments or a matrix: with
        it the body turns, and its ends are `Pose` or, for the attitude alone, `Attitude`. Of a body that
        turns and moves one end may also be of the centre of mass alone, as `State` or an orbit, or an
        `Attitude` alone: what it does not speak of is free there.
    links : sequence of Holonomic
        Rods, rails and surfaces that hold the body.
    system : System, optional
        Set when the first argument is a system.
    name, parameters
        Provenance, set when the problem is loaded from a file.

    Raises
    ------
    ValueError
        If a number has no meaning or two parts do not fit together.
    """

    mass: Any
    start: Any
    goal: Any
    duration: float | tuple[float, float]
    effects: Sequence[Effect] = ()
    actuator: Any = FreeForce()
    objective: Objective = Effort()
    constraints: Sequence[Constraint] = ()
    guess: Any = None
    start_time: float = 0.0
    inertia: Any = None
    links: Sequence[Holonomic] = ()
    system: System | None = None
    name: str = field(default="problem", compare=False)
    parameters: dict = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        checked(self, **of_system(self))
        checked(
            self,
            mass=number("mass", self.mass, "kg", positive=True),
            duration=_duration(self.duration),
            start_time=number("start_time", self.start_time, "s"),
            effects=_parts("effects", self.effects, Effect),
            constraints=_parts("constraints", self.constraints, Constraint),
            links=_parts("links", self.links, Holonomic),
        )
        for name, kind in (
            ("start", Boundary),
            ("goal", Boundary),
            ("actuator", Actuator),
            ("objective", Objective),
        ):
            if not isinstance(getattr(self, name), kind):
                raise ValueError(f"{name} must be a dmoc.{kind.__name__}; got {short(getattr(self, name))}")
        checked(self, effects=learned_opened(self))
        checked(self, **with_both(self.inertia, self.start, self.goal))
        checked(self, **with_wheels(self.actuator, self.start, self.goal, tuple(self.constraints)))
        checked(self, **turning_checked(self.system, self.inertia, self.start, self.goal))
        self._complete_ends()
        if self.objective.metered:
            checked(self, actuator=self.actuator.metered(self.dimension))
        if self.start.dimension != self.goal.dimension:
            sizes = f"start has {self.start.dimension} axes but goal has {self.goal.dimension}"
            raise ValueError(f"{sizes}; give both the same")
        parts: tuple[Any, ...] = (*self.effects, *self.constraints, self.actuator, self.objective)
        for part in (*self.links, *parts):
            part.check_dimension(self.dimension)
        for part in parts:
            check_acts_on(part, self.turns, self.start.has_position)
        self._check_clock()
        check_limited(self)
        check_functions(self)
        self._check_objective()
        if self.constraints:
            refuse_ends_beyond_limits(self)
        check_pushed(self)
        check_links(self)
        if self.actuator.dry_mass >= self.mass:
            raise ValueError(
                f"the actuator's dry_mass must be less than the mass; got {self.actuator.dry_mass:g} "
                f"and {self.mass:g} kg"
            )

    @property
    def dimension(self) -> int:
        """Number of axes, 1 to 3."""
        return self.start.dimension

    @property
    def names(self) -> tuple[str, ...]:
        """The names of its bodies; an only body has an empty name."""
        return ("",) if self.system is None else self.system.names

    @property
    def size(self) -> int:
        """Number of entries that say where everything is: those of the positions of all bodies."""
        return len(self.start.fixed()[0])

    @property
    def controls(self) -> int:
        """Number of controls at a node."""
        return self.actuator.size(self.dimension)

    @cached_property
    def attraction(self) -> Attraction:
        """The point masses that attract in the scene, collected from the effects."""
        return Attraction.of(self.effects, self.dimension)

    @property
    def adjustable_parts(self) -> tuple:
        """Parts with numbers that may change from one solve to the next without a rebuild."""
        # The stencils and the parameter vector of an NLP both follow this order.
        return (self.actuator, self.objective, self.start, self.goal, *self.constraints, *unknown_parts(self))

    @property
    def inertias(self) -> list[Any]:
        """The inertia of each body that turns [kg m^2]."""
        each = [self.inertia] if self.system is None else [body.inertia for body in self.system.bodies]
        return [inertia for inertia in each if inertia is not None]

    @property
    def turns(self) -> bool:
        """Whether a body turns: there is an attitude among the coordinates."""
        return bool(self.inertias)

    @property
    def moment(self) -> float:
        """Mean principal moment of inertia of the body, or the largest of several [kg m^2]; 0 if none turns."""
        return max((float(np.trace(inertia)) / 3 for inertia in self.inertias), default=0.0)

    @property
    def limited(self) -> bool:
        """Whether there are inequalities: limits of the actuator or constraints."""
        return bool(self.constraints) or self.actuator.limited

    @property
    def free_duration(self) -> bool:
        """Whether the duration is found by the optimisation."""
        return isinstance(self.duration, tuple)

    def limit_of_duration(self, duration: float) -> str | None:
        """Which limit of a free duration a duration [s] sits on: "shortest", "longest" or None."""
        shortest, longest = self.duration_bounds
        below, above = duration - shortest, longest - duration
        if not self.free_duration or min(below, above) > SITS_ON * duration:
            return None
        return "shortest" if below < above else "longest"

    @property
    def duration_bounds(self) -> tuple[float, float]:
        """Shortest and longest duration [s]; equal if it is fixed."""
        return self.duration if isinstance(self.duration, tuple) else (self.duration, self.duration)

    def _complete_ends(self) -> None:
        """An end that works in any number of axes takes it from the other end."""
        dimension = self.start.dimension or self.goal.dimension
        if not dimension:
            raise ValueError(
                "neither start nor goal says how many axes there are; give one of them a center, "
                "for example center=(0, 0)"
            )
        for end in ("start", "goal"):
            checked(self, **{end: getattr(self, end).with_dimension(dimension)})

    def _check_clock(self) -> None:
        """Times of a transfer must differ by more than the rounding of the clock."""
        shortest = self.duration_bounds[0]
        # With 10,000 rounding errors of the start time in a duration, 400 steps have 25 each; fewer would blur.
        if shortest < 1e4 * np.spacing(abs(self.start_time)):
            raise ValueError(
                f"start_time {self.start_time:g} s is too late to tell times within {shortest:g} s apart; "
                "count time from nearer"
            )

    def _check_objective(self) -> None:
        sought = [type(term) for weight, term in self.objective.terms if weight]
        if FinalMass in sought and not self.actuator.burns:
            raise ValueError(
                f"the final mass is always {self.mass:g} kg with {type(self.actuator).__name__}; "
                "use an actuator that burns propellant, Engine(max_thrust, specific_impulse)"
            )
        if set(sought) != {Time}:
            return
        if not self.free_duration:
            given = self.duration_bounds[0]
            raise ValueError(
                f"least time needs a free duration; got {given:g} s: give (shortest, longest), "
                f"for example ({0.1 * given:g}, {10 * given:g})"
            )
        if not self.actuator.limited:
            raise ValueError(
                "least time without a force limit has no optimum (the duration goes to 0 s); "
                "use BoxForce(limit) or BallForce(limit)"
            )


def _duration(value: Any) -> float | tuple[float, float]:
    ends = entries(value)
    if ends is None:
        return number("duration", value, "s", positive=True)
    if len(ends) != 2:
        raise ValueError(f"duration must be one number or (shortest, longest) [s]; got {short(value)}")
    shortest = number("duration's shortest", ends[0], "s", positive=True)
    longest = number("duration's longest", ends[1], "s", positive=True)
    if shortest >= longest:
        raise ValueError(
            f"duration's shortest must be less than its longest; got {shortest:g} and {longest:g} s"
        )
    return shortest, longest


def _parts(name: str, value: Any, kind: type) -> tuple:
    parts = (value,) if isinstance(value, kind) else value
    if isinstance(parts, str) or not isinstance(parts, Sequence):
        raise ValueError(f"{name} must be a sequence of dmoc.{kind.__name__}; got {short(value)}")
    for part in parts:
        if not isinstance(part, kind):
            raise ValueError(f"{name} must hold only dmoc.{kind.__name__} objects; got {short(part)}")
    return tuple(parts)
