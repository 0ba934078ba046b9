"""Ends of a system: where each of its bodies starts or ends."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmoc.basics.arguments import checked, short
from dmoc.ends.base import Boundary, State


@dataclass(frozen=True)
class Each(Boundary):
    """The state of each body of a system, in the order of its bodies. A problem makes it of a dictionary.

    Parameters
    ----------
    names : tuple of str
    states : tuple of State
    """

    names: tuple[str, ...]
    states: tuple[State, ...]

    def __post_init__(self) -> None:
        sizes = {state.dimension for state in self.states}
        if len(sizes) > 1:
            raise ValueError(f"states of one system must have as many axes; got {sorted(sizes)}")
        checked(self, states=tuple(self.states))

    @property
    def dimension(self) -> int:
        return self.states[0].dimension

    @property
    def structure(self) -> tuple:
        return type(self), self.names

    def fixed(self) -> tuple[np.ndarray, np.ndarray]:
        known = [state.fixed() for state in self.states]
        return np.concatenate([q for q, _ in known]), np.concatenate([v for _, v in known])

    def words(self) -> str:
        named = zip(self.names, self.states, strict=True)
        return "; ".join(f"{name}: {state.words()}" for name, state in named)


def each_of(name: str, given: Any, bodies: tuple[str, ...]) -> Each:
    """The ends of all bodies, from a dictionary of states by name; a body that is not named is free.

    Raises
    ------
    ValueError
        If it names no body of the system, or something other than states.
    """
    if isinstance(given, Each):
        return given
    if not isinstance(given, Mapping):
        raise ValueError(
            f"{name} of a system must be a dictionary such as {{{bodies[0]!r}: State(position, velocity)}}; "
            f"got {short(given)}"
        )
    if strangers := [key for key in given if key not in bodies]:
        raise ValueError(f"{name} names {short(strangers[0])}; the bodies are {', '.join(bodies)}")
    for key, state in given.items():
        if not isinstance(state, State):
            raise ValueError(f"{name} of {key} must be a State(position, velocity); got {short(state)}")
    axes = next((state.dimension for state in given.values()), 0)
    free = State((None,) * axes, (None,) * axes)
    return Each(bodies, tuple(given.get(body, free) for body in bodies))
