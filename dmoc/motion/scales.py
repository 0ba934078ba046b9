"""The sizes that errors of a path are judged by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.quaternions import angle_between
from dmoc.configurations.acting import point_function
from dmoc.configurations.coordinates import WHEELS, Coordinates
from dmoc.configurations.of_problem import configuration_of
from dmoc.motion.path import DiscretePath

# A body that turns by less than this counts as turned by it [rad]: the length of its quaternion is met to 1e-10
# by the optimiser, and errors of that size are no errors of a turn.
LEAST_TURN = 1e-4
# What holds a body up is estimated in this many places of a path.
HELD_UP_AT = 20


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


def held_up(problem: Any, path: DiscretePath) -> tuple[float, float]:
    """About the largest force [N] and torque [N m] that undo what the effects of a scene do along a path."""
    if not problem.effects:
        return 0.0, 0.0
    some = np.linspace(0, len(path.position) - 1, min(len(path.position), HELD_UP_AT)).astype(int)
    times = problem.start_time + path.duration * path.fractions[some]
    position, mass = path.position[some], path.mass[some]
    velocity = np.gradient(position, times, axis=0)
    acting = point_function(problem.effects, configuration_of(problem), kinetic=False)
    pull, _, push = (
        np.array(ca.densify(part)) for part in acting(times[None], position.T, velocity.T, mass[None])
    )
    load = np.nan_to_num(np.abs(pull + push) * mass, posinf=0.0).max(axis=1)
    places = path.coordinates.places
    return float(load[places].max(initial=0.0)), float(load[~places].max(initial=0.0))


def turning_torque(problem: Any, path: DiscretePath) -> float:
    """The torque that turns the body as far as a path does, or as fast as it turns at an end [N m]."""
    scales = path_scales(path)
    return float(problem.moment * max(scales.turn / path.duration, scales.rate) / path.duration)
