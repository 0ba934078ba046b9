"""The sizes that errors of a path are judged by."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmoc.basics.quaternions import angle_between
from dmoc.basics.records import dataclass
from dmoc.configurations.coordinates import WHEELS, Coordinates
from dmoc.motion.path import DiscretePath

# A body that turns by less than this counts as turned by it [rad]: the length of its quaternion is met to 1e-10
# by the optimiser, and errors of that size are no errors of a turn.
LEAST_TURN = 1e-4
# A body that moves less than this [m] stands still: its square is no number that divides any more.
TINY = 1e-100


def least_extent(mass: float, inertia: Any) -> float:
    """The way of the parts of a body in the least turn [m]; 0 for a point mass.

    A body that turns in place has only the errors of the optimiser in its position: their size is no extent.
    """
    return 0.0 if inertia is None else LEAST_TURN * float(np.sqrt(np.trace(inertia) / mass))


@dataclass(frozen=True)
class Scales:
    """Sizes for errors of a path: [m], [m/s] of places, [rad], [rad/s] of attitudes, [N m s] of wheels."""

    extent: float
    speed: float
    turn: float
    rate: float
    made_of: Coordinates
    momentum: float
    duration: float

    @property
    def positions(self) -> np.ndarray:
        """One for each way the body can move: entries of a place, small turns of an attitude."""
        return self.made_of.paced(self.extent, self.turn, self.momentum * self.duration)

    @property
    def velocities(self) -> np.ndarray:
        """One for each independent velocity."""
        return self.made_of.paced(self.speed, self.rate, self.momentum)

    @property
    def coordinates(self) -> np.ndarray:
        """One for each coordinate; a small turn moves a quaternion by half of it."""
        return self.made_of.sized(self.extent, 0.5 * self.turn, self.momentum * self.duration)

    def share(self, moved: np.ndarray, slipped: np.ndarray) -> float:
        """The largest of errors of position and velocity over their sizes, block by block [-]."""
        errors = moved / self.positions, slipped / self.velocities
        parts = [part for error in errors for part in self.made_of.parted(error)]
        return float(max(np.linalg.norm(part) for part in parts))


def path_scales(path: DiscretePath, least: float = 0.0) -> Scales:
    """Extent of the path and its mean speed or that of its ends if that is more; the same for its turn.

    The extent is at least `least` [m].
    """
    extent = max(path.diagonal, least)
    made = path.coordinates
    both = np.array([path.start_velocity, path.goal_velocity])
    ends = float(np.linalg.norm(both[:, made.speeds], axis=1).max())
    # A body that ends where it began along a line of no extent is measured by what its speed would cover.
    extent = extent or ends * path.duration or 1.0
    length = float(np.linalg.norm(np.diff(path.place, axis=0), axis=1).sum())
    speed = max(max(length, least) / path.duration, ends) or extent / path.duration
    spins = float(np.linalg.norm(both[:, made.rates], axis=1).max())
    turn = max(path.turn, LEAST_TURN) if path.attitudes else 1.0
    turned = sum(float(angle_between(q[1:], q[:-1]).sum()) for q in path.attitudes)
    rate = max(turned / path.duration, spins) or turn / path.duration
    return Scales(extent, speed, turn, rate, made, wheel_momentum(path), path.duration)


def wheel_momentum(path: DiscretePath) -> float:
    """The largest angular momentum of a reaction wheel between two nodes [N m s]; 1 if there is none."""
    stored = path.position[:, path.coordinates.kinds == WHEELS]
    between = np.abs(np.diff(stored, axis=0)) / (path.duration * np.diff(path.fractions))[:, None]
    return float(between.max(initial=0.0)) or 1.0
