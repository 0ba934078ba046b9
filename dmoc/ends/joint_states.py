"""Where a joint is at an end, and where the bodies are that joints carry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import checked, entries, number, short
from dmoc.basics.quaternions import AXES, QUATERNION, unit_quaternion
from dmoc.basics.records import dataclass
from dmoc.effects.base import Body
from dmoc.ends.base import Boundary, State
from dmoc.ends.poses import Pose
from dmoc.links.holonomic import Holonomic
from dmoc.links.joint import room
from dmoc.links.joints import Fixed
from dmoc.parts.rows import Row


@dataclass(frozen=True)
class JointState:
    """Where a joint of a system is at its start or goal: `{elbow: JointState(0.5)}`.

    Parameters
    ----------
    value : float or sequence of 4 floats or None
        Angle of a hinge [rad], way of a slide [m], unit quaternion of a ball joint, or in the plane the angle
        of a rod from the x axis [rad]; None frees it.
    rate : float or sequence of 3 floats or None
        Its rate [rad/s], [m/s]; 0 if not given, None frees it.
    """

    value: Any
    rate: Any = 0.0

    def __post_init__(self) -> None:
        value, rate = self.value, self.rate
        if value is None and rate is None:
            raise ValueError("JointState: value and rate are both None; fix at least one of them")
        if value is not None:
            ball = entries(value) is not None
            checked(
                self, value=unit_quaternion(value) if ball else number("JointState: value", value, "rad or m")
            )
        if rate is not None and entries(rate) is not None:
            rates = [number(f"JointState: rate[{i}]", x, "rad/s") for i, x in enumerate(entries(rate) or ())]
            if len(rates) != AXES:
                raise ValueError(f"JointState: rate must have {AXES} entries [rad/s]; got {short(rate)}")
            checked(self, rate=tuple(rates))
        elif rate is not None:
            checked(self, rate=number("JointState: rate", rate, "rad/s or m/s"))

    @classmethod
    def checked_for(cls, end: str, joint: Any, given: Any) -> JointState:
        """The state of a joint, checked against what the joint has.

        Raises
        ------
        ValueError
            If it does not fit.
        """
        kind = type(joint).__name__
        if not isinstance(given, JointState):
            raise ValueError(f"{end} of a {kind} must be a JointState(value, rate); got {short(given)}")
        needed = getattr(joint, "coordinates", 0)
        if not needed:
            raise ValueError(f"{end} gives a state of a {kind}, which has neither an angle nor a way")
        have = QUATERNION if isinstance(given.value, tuple) else 1
        if given.value is not None and have != needed:
            wanted = "a unit quaternion of 4 numbers" if needed == QUATERNION else "one number"
            raise ValueError(f"{end} of a {kind} needs {wanted}; got {short(given.value)}")
        if isinstance(given.rate, tuple) and needed != QUATERNION:
            raise ValueError(f"{end} of a {kind} needs one number as its rate; got {short(given.rate)}")
        return given

    @property
    def known(self) -> bool:
        """Whether both its value and its rate are given."""
        return self.value is not None and self.rate is not None

    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """Value and rate, one row, where both are known."""
        value = np.atleast_1d(np.array(self.value, float))[None]
        count = AXES if value.shape[1] == QUATERNION else 1
        return value, np.broadcast_to(np.array(self.rate, float), (1, count))

    @property
    def asked(self) -> dict[str, Any]:
        """The numbers that it fixes: value, rate or both."""
        return {
            name: value for name, value in (("value", self.value), ("rate", self.rate)) if value is not None
        }

    def rows_of(self, joint: Any, at: Mapping[str, Body], asked: Mapping[str, Any]) -> list[Row]:
        """Rows that are zero where bodies of CasADi expressions are so; `asked` may be symbols."""
        found, units = [], joint.coordinate_units
        wanted = []
        if "value" in asked:
            wanted.append(("value", joint.off(at, asked["value"]), units[0]))
        if "rate" in asked:
            rate = asked["rate"]
            rate = rate if isinstance(rate, ca.SX) else ca.DM(np.atleast_1d(rate))
            wanted.append(("rate", joint.rate(at) - rate, units[1]))
        for name, gap, unit in wanted:
            entries_of = ca.vertsplit(ca.vec(ca.SX(gap)))
            labels = [""] if len(entries_of) == 1 else [f".{axis}" for axis in "xyz"]
            found += [
                Row(f"{joint.name}.{name}{label}", entry, 0.0, 0.0, unit)
                for label, entry in zip(labels, entries_of, strict=True)
            ]
        return found

    def words(self) -> str:
        value = "free" if self.value is None else short(self.value)
        rate = "free" if self.rate is None else short(self.rate)
        return f"at {value}, rate {rate}"


def carried_along(
    states: Mapping[str, Boundary],
    joints: Sequence[tuple[Any, JointState]],
    turning: Sequence[str],
    links: Sequence[Holonomic],
    axes: int,
) -> tuple[dict[str, Boundary], tuple]:
    """States of the bodies that known joints carry on known bodies or on the room, and the other joints.

    Raises
    ------
    ValueError
        If a body is known twice.
    """
    found: dict[str, Boundary] = {}
    # Welds need no state, and those that are given none carry what they hold.
    asked = [*joints, *((link, None) for link in links if _welds(link))]
    waiting, moved = list(asked), True
    while moved:
        moved = False
        for joint, state in list(waiting):
            base = _known(joint.holds[0], {**states, **found}, axes) if len(joint.holds) > 1 else room(1)
            if base is None or (state is not None and not state.known):
                continue
            if joint.on in states or joint.on in found:
                if state is None:
                    waiting.remove((joint, state))
                    continue
                raise ValueError(
                    f"where {joint.on or 'the body'} is follows from a {type(joint).__name__} and is given as "
                    "well; leave one of them out"
                )
            value, rate = state.arrays() if state is not None else (np.ones((1, 1)), np.zeros((1, 0)))
            found[joint.on] = _state_of(joint.posed(base, value, rate), joint.on in turning)
            waiting.remove((joint, state))
            moved = True
    return found, tuple((joint, state) for joint, state in waiting if state is not None)


def _welds(link: Any) -> bool:
    return isinstance(link, Fixed)


def _known(name: str, states: Mapping[str, Boundary], axes: int) -> Body | None:
    """A body whose state is known, as arrays of one row."""
    if name not in states:
        return None
    q, v = states[name].fixed()
    if np.isnan(np.concatenate([q, v])).any():
        return None
    turned = (q[None, axes:], None, v[None, axes:]) if len(q) > axes else (None, None, None)
    return Body(q[None, :axes], v[None, :axes], *turned)


def _state_of(body: Body, turns: bool) -> Boundary:
    place, velocity = body.position[0], body.velocity[0]
    if not turns:
        return State(tuple(place), tuple(velocity))
    return Pose(tuple(place), tuple(velocity), tuple(body.attitude[0]), tuple(body.rate[0]))
