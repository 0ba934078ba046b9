"""Legs of a mission, and the joints where they meet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from dmoc.basics.arguments import checked, entries, number, short, whole
from dmoc.basics.docstrings import Named
from dmoc.basics.records import dataclass
from dmoc.ends.base import Boundary
from dmoc.legs.events import Event
from dmoc.parts.forces import Unpowered


@dataclass(frozen=True)
class Leg(Named):
    """A part of a mission, with its own forces, limits and duration. What is not given is the mission's.

    Parameters
    ----------
    duration : float or (float, float), optional
        [s]; a pair (shortest, longest) leaves it free between the two. Without one it is free within the
        duration of the mission.
    effects, constraints : sequence, optional
        What acts on the body, and the limits on its way, in this leg.
    actuator : Actuator, optional
        What pushes it in this leg.
    objective : Objective, optional
        What this leg adds to the objective of the mission, in the unit of that, such as `2.0 * Effort()`.
    order, steps : int, optional
        Order of the scheme and number of steps of this leg.
    name : str
        Its name in messages, tables and pictures.
    control_degree : int, optional
        Each control is one polynomial in time of this degree over the leg. That is needed where the cost is
        linear in it and it stays between its limits: values that differ from node to node chatter there.
    """

    duration: Any = None
    effects: Sequence | None = None
    actuator: Any = None
    constraints: Sequence | None = None
    order: int | None = None
    steps: int | None = None
    name: str = ""
    control_degree: int | None = None
    objective: Any = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            raise ValueError(f"Leg: name must be a word; got {short(self.name)}")
        if self.duration is not None:
            checked(self, duration=span_of("Leg: duration", self.duration))
        if self.steps is not None:
            whole("Leg: steps", self.steps, least=2)
        if self.control_degree is not None:
            whole("Leg: control_degree", self.control_degree, least=0)
        if self.order is not None and whole("Leg: order", self.order, least=2) not in (2, 4, 6, 8):
            raise ValueError(f"Leg: order must be 2, 4, 6 or 8; got {short(self.order)}")


@dataclass(frozen=True)
class Coast(Leg):
    """A leg without thrust: it has no controls at all."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (self.actuator is None or type(self.actuator) is Unpowered):
            raise ValueError("Coast: there is no actuator in a coast; use Leg(duration, actuator=...)")
        checked(self, actuator=Unpowered())


@dataclass(frozen=True)
class Joint:
    """Where legs meet, or where the first begins or the last ends.

    Attributes
    ----------
    name : str
        "start", "goal" or "joint 1" and so on.
    events : tuple of Event
        What happens there, in turn.
    left, right : int or None
        The legs before and behind it.
    boundary : Boundary or None
        The start or the goal of the mission.
    """

    name: str
    events: tuple[Event, ...]
    left: int | None
    right: int | None
    boundary: Boundary | None = None


def span_of(name: str, value: Any) -> float | tuple[float, float]:
    """A duration as one number or (shortest, longest) [s]; ValueError if it is neither."""
    ends = entries(value)
    if ends is None:
        return number(name, value, "s", positive=True)
    if len(ends) != 2:
        raise ValueError(f"{name} must be one number or (shortest, longest) [s]; got {short(value)}")
    shortest, longest = (number(name, end, "s", positive=True) for end in ends)
    if shortest >= longest:
        raise ValueError(f"{name}: its shortest must be less than its longest; got {shortest:g}, {longest:g} s")
    return shortest, longest


def checked_sums(sums: Any, count: int) -> tuple[tuple[int, int, Any], ...]:
    """Durations of several of `count` legs together; ValueError if they are none."""
    found, parts = [], entries(sums)
    if parts is None:
        raise ValueError(f"sums must be a sequence of (first leg, last leg, duration [s]); got {short(sums)}")
    for one in parts:
        given = entries(one)
        if given is None or len(given) != 3:
            raise ValueError(f"sums: each must be (first leg, last leg, duration [s]); got {short(one)}")
        first, last = (whole("sums: a leg", at, least=0) for at in given[:2])
        if not first < last < count:
            raise ValueError(
                f"sums: legs count from 0, the first before the last, and there are {count}; "
                f"got {first} and {last}"
            )
        found.append((first, last, span_of("sums: duration", given[2])))
    return tuple(found)


def start_times(value: Any) -> Any:
    """The time of a start, or (earliest, latest) [s]; ValueError if it is neither."""
    span = entries(value)
    if span is None:
        return number("start_time", value, "s")
    times = tuple(number("start_time", each, "s") for each in span)
    if len(times) != 2 or times[0] >= times[1]:
        raise ValueError(f"start_time must be one time or (earliest, latest) [s]; got {short(value)}")
    return times
