"""The paths of a team of missions: body by body the legs of all phases, and what holds between bodies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from typing import Any

import numpy as np

from dmoc.basics.records import dataclass
from dmoc.chains.path import MissionPath, cut_in_two
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_fractions
from dmoc.phases.order import Order, called
from dmoc.phases.timetable import Timetable
from dmoc.teams.path import NOTHING, TeamPath


@dataclass(frozen=True)
class PhasedPath(MissionPath):
    """The paths of all bodies of a team of missions, whose legs share a mesh and a duration phase by phase.

    Attributes
    ----------
    legs : tuple of DiscretePath
        Those of the first body, phase by phase, then those of the next one.
    own, forces : dict of array
        As of a `MissionPath`, under the names that `called` gives the joints of a body; and the multipliers of
        rows between bodies that count nothing.
    densities : dict of array, shape (nodes, rows)
        Multipliers of rows at the nodes of a phase per fraction of its duration, by the names of their groups.
    names : tuple of str
        What the bodies are called.
    joints : tuple of tuples of Place
        In which order the joints of all bodies follow each other.
    """

    densities: dict[str, np.ndarray] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    joints: Order = ()

    @property
    def count(self) -> int:
        """Number of phases."""
        return len(self.legs) // len(self.names)

    def of(self, body: int) -> MissionPath:
        """The path of one body, without what holds between it and others."""
        mine = slice(body * self.count, (body + 1) * self.count)
        own, forces = (_of_body(known, self.names[body]) for known in (self.own, self.forces))
        start = called(self.names[body], "")
        idle = tuple(name.removeprefix(start) for name in self.idle if name.startswith(start))
        return MissionPath(self.legs[mine], self.begins[mine], own, forces, self.near, idle)

    @classmethod
    def joined(
        cls, parts: Sequence[MissionPath], names: tuple[str, ...], joints: Order, **between: Any
    ) -> PhasedPath:
        """The paths of bodies beside each other; `between` are `forces` and `densities` of what joins them."""
        own, forces = (
            {
                called(name, key): value
                for name, part in zip(names, parts, strict=True)
                for key, value in kind(part)
            }
            for kind in (lambda part: part.own.items(), lambda part: part.forces.items())
        )
        idle = tuple(called(name, key) for name, part in zip(names, parts, strict=True) for key in part.idle)
        return cls(
            tuple(leg for part in parts for leg in part.legs),
            tuple(begin for part in parts for begin in part.begins),
            own,
            forces | between.get("forces", {}),
            idle=idle,
            densities=between.get("densities", {}),
            names=names,
            joints=joints,
        )

    def phase(self, index: int) -> TeamPath:
        """The paths of all bodies in one phase."""
        at = range(index, len(self.legs), self.count)
        end = suffix(index)
        mine = {name: values for name, values in self.densities.items() if name.endswith(end)}
        return TeamPath(tuple(self.legs[i] for i in at), tuple(self.begins[i] for i in at), densities=mine)

    @property
    def durations(self) -> np.ndarray:
        """The duration of each phase [s]."""
        return np.array([leg.duration for leg in self.legs[: self.count]])

    @property
    def duration(self) -> float:
        """Duration of the whole [s]."""
        return float(self.durations.sum())

    @property
    def mass(self) -> np.ndarray:
        """Mass of all bodies at the nodes [kg]."""
        return np.concatenate([self.phase(i).mass for i in range(self.count)])

    def onto(self, meshes: Sequence[tuple[np.ndarray, int]]) -> PhasedPath:
        """The same on other meshes and orders, one pair a phase."""
        legs, densities = [], {}
        for leg, (mesh, order) in zip(self.legs, list(meshes) * len(self.names), strict=True):
            legs.append(leg.onto(mesh, order, leg.hold))
        for i, (mesh, order) in enumerate(meshes):
            old, new = self.legs[i].fractions, node_fractions(mesh, scheme(order))
            for name, values in self.phase(i).densities.items():
                columns = [np.interp(new, old, column) for column in values.T]
                densities[name] = np.stack(columns, axis=1)
        return replace(self, legs=tuple(legs), densities=densities)

    @property
    def meshes(self) -> list[tuple[np.ndarray, int]]:
        """The mesh and the order of each phase."""
        return [(leg.mesh, leg.order) for leg in self.legs[: self.count]]

    @property
    def mesh(self) -> list[np.ndarray]:
        """The mesh of each phase, as fractions of its duration."""
        return [mesh for mesh, _ in self.meshes]

    def finer(self, errors: Sequence[np.ndarray]) -> PhasedPath:
        """The same on meshes where the steps that err are cut in two, and those in which two bodies touch."""
        summed = [np.sum(errors[i :: self.count], axis=0) for i in range(self.count)]
        touched = self.touched()
        some = any(len(steps) for steps in touched)
        if some and sum(each.sum() for each in summed) <= NOTHING:
            return self.cut(self.mesh, touched)
        finer = self.onto(cut_in_two(self.legs[: self.count], summed))
        return finer.cut(self.mesh, touched) if some else finer

    def cut(self, mesh: Sequence[np.ndarray], steps: Sequence[np.ndarray]) -> PhasedPath:
        """The same with some steps of a mesh for each phase cut in two, where they are not yet."""
        found = []
        for (mine, order), given, which in zip(self.meshes, mesh, steps, strict=True):
            middles = 0.5 * (given[1:] + given[:-1])[which]
            found.append((np.unique(np.concatenate([mine, middles])), order))
        return self.onto(found)

    def touched(self) -> list[np.ndarray]:
        """The steps of each phase at whose nodes two bodies are as near as they may be."""
        phases = [self.phase(i) for i in range(self.count)]
        largest = max(float(phase.pushes.max()) for phase in phases)
        return [phase.touched(largest) for phase in phases]

    @property
    def touches(self) -> bool:
        """Whether two bodies are as near as they may be somewhere."""
        return any(map(len, self.touched()))

    def stretched(self, mission: Any, factor: float) -> PhasedPath:
        """The same with free phases that last so many times as long, within their bounds."""
        return self.lasting(np.clip(factor * self.durations, *mission.bounds.T))

    def lasting(self, durations: np.ndarray) -> PhasedPath:
        """The same with phases of other durations [s]."""
        each, bodies = list(map(float, durations)), len(self.names)
        legs = [replace(leg, duration=time) for leg, time in zip(self.legs, each * bodies, strict=True)]
        begins = self.begins[0] + np.append(0.0, np.cumsum(each)[:-1])
        return replace(self, legs=tuple(legs), begins=tuple(map(float, begins)) * bodies)

    # Guesses are bent apart over all phases.

    @property
    def ways(self) -> list[np.ndarray]:
        """The places of each body at the nodes of all phases [m]; those where phases meet are there twice."""
        return [self.of(body).place for body in range(len(self.names))]

    @property
    def fractions(self) -> np.ndarray:
        """Fractions of the duration at those nodes."""
        begins = np.append(0.0, np.cumsum(self.durations)[:-1])
        parts = zip(begins, self.legs[: self.count], strict=True)
        return np.concatenate([begin + leg.duration * leg.fractions for begin, leg in parts]) / self.duration

    def moved(self, bends: Sequence[np.ndarray]) -> PhasedPath:
        """The same with the places of all bodies moved by bends, one row a node [m]."""
        at = np.cumsum([len(leg.fractions) for leg in self.legs[: self.count - 1]])
        parts = [part for bend in bends for part in np.split(bend, at)]
        legs = tuple(leg.moved(part) for leg, part in zip(self.legs, parts, strict=True))
        return replace(self, legs=legs)

    def fits(self, plan: Timetable) -> bool:
        """Whether its legs and joints have the unknowns of this team."""
        same = self.names == plan.names and self.joints == plan.order
        return same and all(self.of(i).suits(mission) for i, mission in enumerate(plan.cut))


def suffix(phase: int) -> str:
    """The end of the name of a group of rows in a phase."""
    return f" in phase {phase + 1}"


def _of_body(known: dict[str, np.ndarray], name: str) -> dict[str, np.ndarray]:
    start = called(name, "")
    return {key.removeprefix(start): value for key, value in known.items() if key.startswith(start)}
