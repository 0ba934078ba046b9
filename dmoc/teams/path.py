"""The path of a team: those of its bodies on one mesh, and what holds between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from typing import Any

import numpy as np

from dmoc.basics.records import dataclass
from dmoc.chains.path import MissionPath, cut_in_two
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_fractions, node_weights
from dmoc.motion.path import DiscretePath
from dmoc.scene.mission import Mission

# Two bodies touch at a node whose multiplier is more than this part of the largest one [-].
PUSHES = 1e-3
# Steps that add up to less than this error, as a part of the path, need not be cut where two bodies touch [-].
NOTHING = 1e-9


@dataclass(frozen=True)
class TeamPath(MissionPath):
    """The paths of all bodies, which stand on one mesh and last equally long.

    Attributes
    ----------
    legs : tuple of DiscretePath
        One a body.
    begins : tuple of float
        Time at the start [s], once a body.
    forces : dict of array
        Multipliers of rows at the end [objective per unit of the row], by the names of their groups.
    densities : dict of array, shape (nodes, rows)
        Multipliers of rows at the nodes per fraction of the duration, by the names of their groups.
    """

    densities: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return self.legs[0].duration

    @property
    def mass(self) -> np.ndarray:
        """Mass of all bodies at the nodes [kg]."""
        return np.sum([leg.mass for leg in self.legs], axis=0)

    @property
    def mesh(self) -> np.ndarray:
        """Step ends as fractions of the duration."""
        return self.legs[0].mesh

    @property
    def order(self) -> int:
        return self.legs[0].order

    @property
    def ways(self) -> list[np.ndarray]:
        """The places of each body at the nodes [m]."""
        return [leg.place for leg in self.legs]

    @property
    def fractions(self) -> np.ndarray:
        """Fractions of the duration at the nodes."""
        return self.legs[0].fractions

    def moved(self, bends: Sequence[np.ndarray]) -> TeamPath:
        """The same with the places of all bodies moved by bends, one row a node [m]."""
        return replace(self, legs=tuple(leg.moved(bend) for leg, bend in zip(self.legs, bends, strict=True)))

    def onto(self, meshes: Sequence[tuple[np.ndarray, int]]) -> TeamPath:
        """The same on another mesh and order; there is one for all bodies."""
        (mesh, order), *_ = meshes
        old, new = self.legs[0].fractions, node_fractions(mesh, scheme(order))
        moved = {
            name: np.stack([np.interp(new, old, column) for column in values.T], axis=1)
            for name, values in self.densities.items()
        }
        return replace(self, legs=tuple(leg.onto(mesh, order, leg.hold) for leg in self.legs), densities=moved)

    def finer(self, errors: Sequence[np.ndarray]) -> TeamPath:
        """The same on a mesh where the steps that err are cut in two, and those in which two bodies touch."""
        summed = np.sum(errors, axis=0)
        touched = self.touched()
        if not len(touched) or summed.sum() > NOTHING:
            (finer,) = cut_in_two(self.legs[:1], [summed])
            return self.onto([finer]).cut(self.mesh, touched)
        return self.cut(self.mesh, touched)

    def cut(self, mesh: np.ndarray, steps: np.ndarray) -> TeamPath:
        """The same with some steps of a mesh cut in two, where they are not yet."""
        middles = 0.5 * (mesh[1:] + mesh[:-1])[steps]
        return self.onto([(np.unique(np.concatenate([self.mesh, middles])), self.order)])

    @property
    def pushes(self) -> np.ndarray:
        """The largest multiplier at each node of what two bodies keep there, in the unit of the objective."""
        each = [np.abs(values).max(axis=1) * self.weights for values in self.densities.values()]
        return np.max(each, axis=0) if each else np.zeros(len(self.fractions))

    def touched(self, largest: float = 0.0) -> np.ndarray:
        """The steps at whose nodes two bodies are as near as they may be: where rows push them apart.

        The time at which they touch is none of the nodes', which costs about the square of the steps there.
        Pushes are compared with the largest of them, or with one that is larger still.
        """
        pushes = self.pushes
        nodes = np.flatnonzero(pushes > PUSHES * max(largest, pushes.max()))
        degree, last = scheme(self.order).degree, len(self.mesh) - 2
        return np.unique(np.clip([nodes // degree, (nodes - 1) // degree], 0, last))

    @property
    def touches(self) -> bool:
        """Whether two bodies are as near as they may be somewhere."""
        return len(self.touched()) > 0

    def stretched(self, mission: Any, factor: float) -> TeamPath:
        """The same but so many times as long, within the bounds of a free duration."""
        duration = float(np.clip(factor * self.duration, *mission.duration_bounds))
        return replace(self, legs=tuple(replace(leg, duration=duration) for leg in self.legs))

    def without_idle(self, mission: Mission, nothing: float) -> TeamPath:
        """Itself: a team has no impulses."""
        return self

    @property
    def weights(self) -> np.ndarray:
        """The share of the duration that belongs to each node [-]."""
        return node_weights(self.mesh, scheme(self.order))


def between(path: TeamPath, pair: tuple[int, int]) -> DiscretePath:
    """The path of the second of two bodies as the first one sees it: the differences of their places [m]."""
    first, second = (path.legs[i] for i in pair)
    speeds = [(leg.start_velocity, leg.goal_velocity) for leg in (first, second)]
    (before, there), (behind, arriving) = (
        [velocity[leg.coordinates.speeds] for velocity in each]
        for leg, each in zip((first, second), speeds, strict=True)
    )
    return replace(
        first,
        position=second.place - first.place,
        control=np.zeros((len(first.control), 0)),
        start_velocity=behind - before,
        goal_velocity=arriving - there,
        multipliers={},
        made_of=None,
        reaction=None,
    )
