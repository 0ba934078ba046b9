"""Ends of a system: where each of its bodies starts or ends."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from dmoc.basics.arguments import checked, short
from dmoc.basics.quaternions import AXES, rotation_of
from dmoc.basics.records import dataclass
from dmoc.configurations.coordinates import Coordinates
from dmoc.effects.base import Body
from dmoc.ends.base import Boundary, State
from dmoc.ends.joint_states import JointState, carried_along
from dmoc.ends.poses import Pose, Turning
from dmoc.links.holonomic import Holonomic
from dmoc.links.system import System
from dmoc.parts.rows import Row


@dataclass(frozen=True)
class Each(Boundary):
    """The state of each body of a system, in the order of its bodies. A problem makes it of a dictionary.

    Parameters
    ----------
    names : tuple of str
    states : tuple of State or Pose
    joints : tuple of (Holonomic, JointState)
        What is asked of joints between bodies whose states are free.
    led : tuple of str
        The bodies whose states follow from those of joints.
    """

    names: tuple[str, ...]
    states: tuple[Boundary, ...]
    joints: tuple[tuple[Any, JointState], ...] = ()
    led: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        sizes = {state.dimension for state in self.states}
        if len(sizes) > 1:
            raise ValueError(f"states of one system must have as many axes; got {sorted(sizes)}")
        checked(self, states=tuple(self.states))
        # What is asked of joints, each number under a name of its own: it may change from solve to solve.
        for (_, state), names in zip(self.joints, self._named, strict=True):
            for name, value in zip(names, state.asked.values(), strict=True):
                object.__setattr__(self, name, value)

    @property
    def _named(self) -> list[list[str]]:
        """Names for the numbers that are asked of each joint, such as elbow_value and elbow_rate."""
        several = Counter(joint.name for joint, _ in self.joints)
        return [
            [
                f"{joint.name}_{i + 1}_{name}" if several[joint.name] > 1 else f"{joint.name}_{name}"
                for name in state.asked
            ]
            for i, (joint, state) in enumerate(self.joints)
        ]

    @property
    def adjustable(self) -> tuple[str, ...]:  # type: ignore[override]
        return tuple(name for names in self._named for name in names)

    @property
    def units_of_numbers(self) -> dict[str, str]:
        """The unit of each number in `adjustable`."""
        pairs = zip(self.joints, self._named, strict=True)
        return {
            name: joint.coordinate_units[kind == "rate"] if joint.coordinates == 1 or kind == "rate" else ""
            for (joint, state), names in pairs
            for name, kind in zip(names, state.asked, strict=True)
        }

    @property
    def dimension(self) -> int:
        return self.states[0].dimension

    @property
    def structure(self) -> tuple:
        joints = tuple((joint, tuple(state.asked), np.ndim(state.value)) for joint, state in self.joints)
        return type(self), self.names, joints

    @property
    def turns_body(self) -> bool:
        return any(state.turns_body for state in self.states)

    def oriented(self, start: Boundary) -> Boundary:
        """Each attitude with the sign to which the shorter turn leads; that of joints is theirs."""
        begins = start.states if isinstance(start, Each) else self.states
        pairs = zip(self.names, self.states, begins, strict=True)
        states = tuple(one if name in self.led else one.oriented(begin) for name, one, begin in pairs)
        return Each(self.names, states, self.joints, self.led)

    def led_to(self, q: np.ndarray) -> Each:
        """The same with the signs of the quaternions to which a path leads that ends at some coordinates."""
        states = []
        for name, state in zip(self.names, self.states, strict=True):
            mine = q[self._made.of_body(name)[0]][self.dimension :]
            # NaN, where the attitude is free, is not less than 0.
            along = state.turns_body and float(mine @ state.fixed()[0][self.dimension :]) < 0
            states.append(state.the_other_way() if along else state)
        return Each(self.names, tuple(states), self.joints, self.led)

    def fixed(self) -> tuple[np.ndarray, np.ndarray]:
        known = [state.fixed() for state in self.states]
        return self._stacked([q for q, _ in known], 0), self._stacked([v for _, v in known], 1)

    def likely(self, start: Boundary) -> np.ndarray:
        """Coordinates for a guess: what is free stays where it starts, and joints carry what is on them."""
        begins = start.states if isinstance(start, Each) else self.states
        known = dict(zip(self.names, begins, strict=True))
        asked = [(joint, JointState(state.value)) for joint, state in self.joints if state.value is not None]
        carried = {joint.holds[-1] for joint, _ in asked}
        bases = {name: state for name, state in known.items() if name not in carried}
        turning = [name for name, state in known.items() if state.turns_body]
        led, _ = carried_along(bases, asked, turning, (), self.dimension)
        return self._stacked([(known | led)[name].fixed()[0] for name in self.names], 0)

    def rows(self, t: Any, q: Any, v: Any, m: Any) -> list[Row]:
        if not self.joints:
            return []
        at = self._bodies(q, v)
        found = []
        for (joint, state), names in zip(self.joints, self._named, strict=True):
            asked = {kind: getattr(self, name) for kind, name in zip(state.asked, names, strict=True)}
            found += state.rows_of(joint, at, asked)
        return found

    def _bodies(self, q: Any, v: Any) -> dict[str, Body]:
        """The bodies by name, for CasADi coordinates and independent velocities."""
        found = {}
        for name, state in zip(self.names, self.states, strict=True):
            mine, moving = (np.flatnonzero(part).tolist() for part in self._made.of_body(name))
            axes = state.dimension
            place, speed = q[mine[:axes]], v[moving[:axes]]
            found[name] = Body(place, speed)
            if state.turns_body:
                attitude = q[mine[axes:]]
                found[name] = Body(place, speed, attitude, rotation_of(attitude), v[moving[axes:]])
        return found

    @property
    def _made(self) -> Coordinates:
        """Of what parts the coordinates of all bodies are made."""
        pairs = zip(self.names, self.states, strict=True)
        kinds: dict[bool, Callable[..., Coordinates]] = {
            True: Coordinates.of_rigid_body,
            False: Coordinates.of_point,
        }
        return Coordinates.side_by_side({name: kinds[one.turns_body](one.dimension) for name, one in pairs})

    def _stacked(self, parts: Sequence[np.ndarray], kind: int) -> np.ndarray:
        """The coordinates (0) or the independent velocities (1) of all bodies from those of each."""
        masks = [self._made.of_body(name)[kind] for name in self.names]
        found = np.empty(len(masks[0]))
        for mine, part in zip(masks, parts, strict=True):
            found[mine] = part
        return found

    def words(self) -> str:
        named = [f"{name}: {state.words()}" for name, state in zip(self.names, self.states, strict=True)]
        return "; ".join([*named, *(f"{joint.words()}: {state.words()}" for joint, state in self.joints)])


def each_of(name: str, given: Any, system: System, links: Sequence[Holonomic]) -> Each:
    """The ends of all bodies, from a dictionary of states by name of a body, or by joint.

    A body that is not named, and does not follow from joints, is free.

    Raises
    ------
    ValueError
        If it names no body or joint of the system, or something other than states.
    """
    if isinstance(given, Each):
        return given
    bodies = system.names
    if not isinstance(given, Mapping):
        raise ValueError(
            f"{name} of a system must be a dictionary such as {{{bodies[0]!r}: State(position, velocity)}}; "
            f"got {short(given)}"
        )
    states: dict[str, Boundary] = {}
    joints: list[tuple[Holonomic, JointState]] = []
    for key, state in given.items():
        if isinstance(key, Holonomic):
            if key not in links:
                raise ValueError(
                    f"{name} names a {type(key).__name__} that is none of the links; list it there"
                )
            joints.append((key, JointState.checked_for(name, key, state)))
        elif key in bodies:
            states[key] = _of_body(name, key, state, system)
        else:
            raise ValueError(f"{name} names {short(key)}; the bodies are {', '.join(bodies)}")
    axes = next((state.dimension for state in states.values()), AXES if system.turns else 0)
    axes = axes or next((len(v) for link in links for v in [getattr(link, "anchor", ())] if len(v) > 1), 0)
    turning = [body.name for body in system.bodies if body.inertia is not None]
    led, left = carried_along(states, joints, turning, links, axes)
    free = {one: _free(axes, one in turning) for one in bodies}
    return Each(bodies, tuple((free | states | led)[body] for body in bodies), left, tuple(led))


def _of_body(name: str, body: str, state: Any, system: System) -> Any:
    """The state of one body: a State of a point mass, a Pose of one that turns."""
    turns = next(one.inertia is not None for one in system.bodies if one.name == body)
    if turns and type(state) is State:
        # A place alone leaves it open how the body is turned.
        return Pose(state.position, state.velocity, None, None)
    wanted: type = Pose if turns else State
    if not isinstance(state, wanted) or (isinstance(state, Turning) and not turns):
        example = "Pose(position, velocity, attitude, rate)" if turns else "State(position, velocity)"
        raise ValueError(f"{name} of {body} must be a {example}; got {short(state)}")
    return state


def _free(axes: int, turns: bool) -> Boundary:
    none = (None,) * axes
    return Pose(none, none, None, None) if turns else State(none, none)
