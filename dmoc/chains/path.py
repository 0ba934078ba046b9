"""The path of a mission: those of its legs, and what belongs to its joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from functools import reduce

import casadi as ca
import numpy as np

from dmoc.basics.records import dataclass
from dmoc.legs.legs import Joint
from dmoc.motion.path import DiscretePath
from dmoc.scene.mission import Mission

# About this part of the cost at a goal is decided by the way there [-]: in units of all of it a launcher takes
# 218 iterations, in units of this part 24.
DECIDED = 0.01


@dataclass(frozen=True)
class MissionPath:
    """The paths of all legs, and what belongs to the joints.

    Attributes
    ----------
    legs : tuple of DiscretePath
    begins : tuple of float
        Time at the start of each leg [s].
    own : dict of array
        Unknowns of the joints themselves, by the name of the joint [SI].
    forces : dict of array
        Multipliers of the rows of the joints [objective per unit of the row], by the name of the joint.
    near : bool
        Whether it is nearly an answer, so that a solve had better stay close to it.
    idle : tuple of str
        Joints whose impulse is none, and stays none: the size of an impulse has no derivative at zero.
    """

    legs: tuple[DiscretePath, ...]
    begins: tuple[float, ...]
    own: dict[str, np.ndarray] = field(default_factory=dict)
    forces: dict[str, np.ndarray] = field(default_factory=dict)
    near: bool = False
    idle: tuple[str, ...] = ()

    def suits(self, mission: Mission) -> bool:
        """Whether its legs and joints have the unknowns of this mission."""
        sizes = [(leg.position.shape[1], leg.control.shape[1]) for leg in self.legs]
        wanted = [(leg.size, leg.controls) for leg in mission.stretches]
        own = {name for name, values in self.own.items() if len(values)}
        axes = mission.dimension
        # At the start the velocity before its events is an unknown, too.
        named = {
            joint.name
            for joint in mission.joints
            if any(event.unknowns(axes) or joint.left is None for event in joint.events)
        }
        return sizes == wanted and own == named

    def as_arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """Times [s] and positions of the nodes of all legs; where legs meet the later one counts."""
        if not (np.diff(self.begins) > 0).all():
            raise ValueError("guess is of several bodies at one time; give that of one of them")
        parts = zip(self.begins, self.legs, strict=True)
        times = np.concatenate([begin + leg.duration * leg.fractions for begin, leg in parts])
        last = np.append(np.diff(times) > 0, True)
        return times[last], np.concatenate([leg.position for leg in self.legs])[last]

    def as_one(self, controls: int) -> DiscretePath:
        """The path of all legs as that of a transfer with so many controls, without multipliers."""
        order = max(leg.order for leg in self.legs)
        parts = [leg.onto(leg.mesh, order, False) for leg in self.legs]
        parts = [part if part.control.shape[1] == controls else coasting(part, controls) for part in parts]
        return reduce(merged, parts)

    def without_idle(self, mission: Mission, nothing: float) -> MissionPath:
        """The same with impulses below a speed [m/s] as none, but for the last one."""
        sizes = {
            joint.name: max(map(np.linalg.norm, kicks))
            for joint in mission.joints
            if (kicks := kicks_of(joint, self.own.get(joint.name), mission.dimension))
        }
        idle = tuple(name for name, size in sizes.items() if size < nothing)
        if not idle or len(idle) == len(sizes):
            return self
        own = dict(self.own)
        for name in idle:
            joint = next(joint for joint in mission.joints if joint.name == name)
            count = sum(map(len, kicks_of(joint, own[name], mission.dimension)))
            own[name] = np.append(own[name][: len(own[name]) - count], np.zeros(count))
        return replace(self, own=own, idle=idle)

    @property
    def warm(self) -> bool:
        """Whether there are multipliers to start from."""
        return all(leg.multipliers for leg in self.legs)

    @property
    def place(self) -> np.ndarray:
        """Places at the nodes of all legs [m]."""
        return np.concatenate([leg.place for leg in self.legs])

    @property
    def duration(self) -> float:
        """Duration of all legs [s]."""
        return float(sum(leg.duration for leg in self.legs))

    @property
    def mass(self) -> np.ndarray:
        """Masses at the nodes of all legs [kg]."""
        return np.concatenate([leg.mass for leg in self.legs])

    @property
    def diagonal(self) -> float:
        """Diagonal of the box around the path [m]."""
        return float(np.linalg.norm(np.ptp(self.place, axis=0)))

    @property
    def attitudes(self) -> list[np.ndarray]:
        """The attitudes of each body that turns in the first leg."""
        return self.legs[0].attitudes

    @property
    def turn(self) -> float:
        """The largest angle that a body is turned by in a leg [rad]."""
        return max(leg.turn for leg in self.legs)

    @property
    def meshes(self) -> list[tuple[np.ndarray, int]]:
        """The mesh and the order of each leg."""
        return [(leg.mesh, leg.order) for leg in self.legs]

    def onto(self, meshes: Sequence[tuple[np.ndarray, int]]) -> MissionPath:
        """The same on other meshes and orders, one pair a leg."""
        legs = [leg.onto(mesh, order, leg.hold) for leg, (mesh, order) in zip(self.legs, meshes, strict=True)]
        return replace(self, legs=tuple(legs))

    def finer(self, errors: Sequence[np.ndarray]) -> MissionPath:
        """The same on meshes where the steps that make up the errors of all legs are cut in two."""
        return self.onto(cut_in_two(self.legs, errors))

    def stretched(self, mission: Mission, factor: float) -> MissionPath:
        """The same with free legs that last so many times as long, within their bounds."""
        legs = []
        for leg, problem in zip(self.legs, mission.stretches, strict=True):
            duration = float(np.clip(factor * leg.duration, *problem.duration_bounds))
            legs.append(replace(leg, duration=duration))
        begins = self.begins[0] + np.append(0.0, np.cumsum([leg.duration for leg in legs]))[:-1]
        return replace(self, legs=tuple(legs), begins=tuple(float(t) for t in begins))


def own_parts(joint: Joint, own: np.ndarray | None, axes: int) -> list[np.ndarray]:
    """The unknowns of each event of a joint; empty for one that has none."""
    sizes = [len(event.unknowns(axes)) for event in joint.events]
    if own is None or not sum(sizes):
        return [np.zeros(0)] * len(sizes)
    return np.split(own[len(own) - sum(sizes) :], np.cumsum(sizes)[:-1])


def kicks_of(joint: Joint, own: np.ndarray | None, axes: int) -> list[np.ndarray]:
    """The velocity change of each impulse of a joint [m/s]."""
    parts = zip(joint.events, own_parts(joint, own, axes), strict=True)
    return [part for event, part in parts if event.pushes and len(part)]


def cut_in_two(legs: Sequence[DiscretePath], errors: Sequence[np.ndarray]) -> list[tuple[np.ndarray, int]]:
    """Meshes on which the steps that make up the errors of all legs are cut in two."""
    total = np.concatenate(errors)
    order = np.argsort(total)
    least = min(leg.order for leg in legs)
    small = np.cumsum(total[order]) <= 0.5 * 2.0**-least * total.sum()
    cut = np.ones(len(total), bool)
    cut[order[small]] = False
    found, at = [], 0
    for leg in legs:
        mine = cut[at : at + len(leg.mesh) - 1]
        at += len(mine)
        middles = 0.5 * (leg.mesh[1:] + leg.mesh[:-1])[mine]
        found.append((np.sort(np.concatenate([leg.mesh, middles])), leg.order))
    return found


def joint_cost(mission: Mission, path: MissionPath) -> float:
    """About the cost of the impulses of a path and of the state at its goal."""
    total = 0.0
    for joint in mission.joints:
        for values in kicks_of(joint, path.own.get(joint.name), mission.dimension):
            total += abs(float(mission.objective.kick(float(np.linalg.norm(values)), mission.mass)))
    last = path.legs[-1]
    state = last.place[-1], last.goal_velocity[last.coordinates.speeds], last.mass[-1]
    end = mission.objective.terminal(ca.DM(path.begins[-1] + last.duration), *map(ca.DM, state))
    return total + DECIDED * abs(float(end))


def merged(first: DiscretePath, last: DiscretePath) -> DiscretePath:
    """Two paths of one order, one after the other, as one without multipliers."""
    total = first.duration + last.duration
    share = first.duration / total
    return replace(
        first,
        mesh=np.concatenate([share * first.mesh, share + (1 - share) * last.mesh[1:]]),
        duration=total,
        position=np.concatenate([first.position, last.position[1:]]),
        control=np.concatenate([first.control, last.control[0 if first.hold else 1 :]]),
        mass=np.concatenate([first.mass, last.mass[1:]]),
        goal_velocity=last.goal_velocity,
        multipliers={},
    )


def coasting(path: DiscretePath, controls: int) -> DiscretePath:
    """A path with so many controls, none of which pushes."""
    return replace(path, control=np.zeros((len(path.control), controls)))


def cold(path: MissionPath) -> MissionPath:
    """A path without multipliers."""
    return replace(path, legs=tuple(replace(leg, multipliers={}) for leg in path.legs), forces={})
