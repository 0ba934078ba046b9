"""Of what parts the coordinates q and the independent velocities of a configuration are made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache, cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dmoc.basics.quaternions import AXES, QUATERNION
from dmoc.basics.records import dataclass

# A place in space: 1 to 3 entries [m] that move at as many speeds [m/s].
PLACE = "place"
# A unit quaternion: 4 entries [-] that turn at a rate of 3 entries [rad/s].
ATTITUDE = "attitude"
# Reaction wheels: the time integrals [N m s^2] of their angular momenta [N m s].
WHEELS = "wheels"


QUATERNION_NAMES = ("qs", "qx", "qy", "qz")


class Block(NamedTuple):
    """A part of q: its kind, how many entries it has, and the body of a system that it belongs to."""

    kind: str
    size: int
    body: str = ""

    @property
    def freedom(self) -> int:
        """Number of independent velocities."""
        return AXES if self.kind == ATTITUDE else self.size


@dataclass(frozen=True)
class Coordinates:
    """The blocks of q in turn. Masks have one entry a coordinate or, where they say so, a velocity."""

    blocks: tuple[Block, ...]

    @classmethod
    @cache
    def of_point(cls, axes: int) -> Coordinates:
        """Those of a point mass in a space of so many axes."""
        return cls((Block(PLACE, axes),))

    @classmethod
    def of_rigid_body(cls, axes: int, wheels: int = 0) -> Coordinates:
        """Those of a rigid body: place (if there are axes), wheels (if there are some), attitude."""
        blocks = Block(PLACE, axes), Block(WHEELS, wheels), Block(ATTITUDE, QUATERNION)
        return cls(tuple(block for block in blocks if block.size))

    @classmethod
    def side_by_side(cls, bodies: Mapping[str, Coordinates]) -> Coordinates:
        """Those of several bodies by their names: first the places of all, then what turns."""
        named = [block._replace(body=name) for name, made in bodies.items() for block in made.blocks]
        return cls(tuple(sorted(named, key=lambda block: block.kind != PLACE)))

    @cached_property
    def kinds(self) -> np.ndarray:
        """The kind of each coordinate."""
        return np.repeat([block.kind for block in self.blocks], [block.size for block in self.blocks])

    @cached_property
    def motions(self) -> np.ndarray:
        """The kind of each independent velocity."""
        return np.repeat([block.kind for block in self.blocks], [block.freedom for block in self.blocks])

    @cached_property
    def places(self) -> np.ndarray:
        """Which coordinates are places in space [m]."""
        return self.kinds == PLACE

    @cached_property
    def speeds(self) -> np.ndarray:
        """Which independent velocities are speeds [m/s]."""
        return self.motions == PLACE

    @cached_property
    def rates(self) -> np.ndarray:
        """Which independent velocities are rates of turn [rad/s]."""
        return self.motions == ATTITUDE

    @cached_property
    def spins(self) -> np.ndarray:
        """Which independent velocities are angular momenta of wheels [N m s]."""
        return self.motions == WHEELS

    @cached_property
    def quaternions(self) -> list[slice]:
        """Where the unit quaternions stand among the coordinates."""
        return [at for block, at in zip(self.blocks, self._slices(), strict=True) if block.kind == ATTITUDE]

    @cached_property
    def turning(self) -> list[slice]:
        """Where the rates that belong to the unit quaternions stand among the velocities, in the same order."""
        ends = np.cumsum([0, *[block.freedom for block in self.blocks]])
        return [slice(int(ends[i]), int(ends[i + 1])) for i, b in enumerate(self.blocks) if b.kind == ATTITUDE]

    @property
    def axes(self) -> int:
        """Number of axes of space; 0 where there is no place."""
        return next((block.size for block in self.blocks if block.kind == PLACE), 0)

    @property
    def place_labels(self) -> list[str]:
        """A name for each entry of a place: x, y, z or, of a system, those of its bodies."""
        return [
            f"{block.body}.{axis}".removeprefix(".")
            for block in self.blocks
            if block.kind == PLACE
            for axis in "xyz"[: block.size]
        ]

    @property
    def attitude_labels(self) -> list[str]:
        """A name for each entry of the attitudes of the bodies of a system."""
        return [
            f"{one.body}.{name}" for one in self.blocks if one.kind == ATTITUDE for name in QUATERNION_NAMES
        ]

    def of_body(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Which coordinates, and which velocities, belong to a body of a system."""
        mine = [block.body == name for block in self.blocks]
        return (
            np.repeat(mine, [block.size for block in self.blocks]),
            np.repeat(mine, [block.freedom for block in self.blocks]),
        )

    def quaternion_of(self, name: str) -> slice:
        """Where the unit quaternion of a body of a system stands; an only body has an empty name."""
        pairs = zip(self.blocks, self._slices(), strict=True)
        return next(at for block, at in pairs if block.kind == ATTITUDE and block.body == name)

    @property
    def turns(self) -> bool:
        """Whether there is an attitude among them."""
        return bool(self.quaternions)

    def sized(self, of_place: object, of_attitude: object, of_wheels: object) -> np.ndarray:
        """One number for each coordinate, by its kind."""
        return _by_kind(self.kinds, of_place, of_attitude, of_wheels)

    def paced(self, of_speed: object, of_rate: object, of_spin: object) -> np.ndarray:
        """One number or word for each independent velocity, by its kind."""
        return _by_kind(self.motions, of_speed, of_rate, of_spin)

    def parted(self, values: np.ndarray) -> list[np.ndarray]:
        """An array whose last axis has an entry a velocity, cut into those of the blocks."""
        ends = np.cumsum([block.freedom for block in self.blocks])[:-1]
        return np.split(values, ends, axis=-1)

    def cut(self, values: np.ndarray) -> list[np.ndarray]:
        """An array whose last axis has an entry a coordinate, cut into those of the blocks."""
        return [values[..., at] for at in self._slices()]

    def _slices(self) -> list[slice]:
        ends = np.cumsum([0, *[block.size for block in self.blocks]])
        return [slice(int(a), int(b)) for a, b in pairwise(ends)]


def _by_kind(kinds: np.ndarray, *values: object) -> np.ndarray:
    named: Sequence = [kinds == name for name in (PLACE, ATTITUDE, WHEELS)]
    return np.select(named, [np.asarray(value) for value in values])
