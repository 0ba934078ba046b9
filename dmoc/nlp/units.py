"""Canonical units of a problem near a path, in which Ipopt sees numbers near 1."""

from __future__ import annotations

import numpy as np

from dmoc.basics.records import dataclass
from dmoc.guess.coast import held_up, turning_torque
from dmoc.motion.path import DiscretePath
from dmoc.motion.scales import LEAST_TURN, TINY, least_extent, path_scales
from dmoc.results.flown_cost import costs_along
from dmoc.results.switches import has_linear_controls
from dmoc.scene.problem import TransferProblem

# The unit of force is at least this part of the limit [-], however small the largest force of a solution is.
LEAST_SHARE = 1e-3
# A limit above this many times what moves or holds a body up is no unit of force [-], unless the cost is linear
# in it: at 1e5 N for 1e-5 N the barrier ended at eight times the least effort, as good as zero.
FAR_ABOVE = 100.0
# An answer that takes less than this part of the unit of force, or of torque, is worth a second run [-].
HARDLY = 1e-2


@dataclass(frozen=True)
class Units:
    """Canonical units [m, s, N, kg, unit of the objective, N m] and the origin [m], for Ipopt."""

    length: float
    time: float
    force: float
    mass: float
    cost: float
    torque: float
    origin: np.ndarray

    @property
    def sizes(self) -> dict[str, float]:
        """The size of a number near 1, by its unit."""
        speed, rate = self.length / self.time, 1 / self.time
        known = {"m": self.length, "m/s": speed, "rad": 1.0, "rad/s": rate, "kg": self.mass, "s": self.time}
        return known | {"N": self.force, "N m": self.torque, "N m s": self.torque * self.time}

    def of(self, unit: str) -> float:
        """The size of a number near 1 in this unit; 1 for what has none."""
        return self.sizes.get(unit, 1.0)


def units_of(problem: TransferProblem, guess: DiscretePath) -> Units:
    """Canonical units of a problem near a path.

    Length: extent of the path, origin at its centre. Time: the duration. Force: the largest used
    where a solution is known, else the limit, else the force that moves the mass over that length in that
    time, or without effects the one that changes its velocities at the ends. Cost: the objective on the path,
    or with the unit of force all the way if that is more.
    """
    low, high = guess.position.min(axis=0), guess.position.max(axis=0)
    places, speeds = guess.coordinates.places, guess.coordinates.speeds
    # Attitudes count from zero: their quaternions are of size 1 anyway.
    origin = np.where(places, 0.5 * (low + high), 0.0)
    time = guess.duration
    both = np.array([guess.start_velocity, guess.goal_velocity])[:, speeds]
    # What rounding leaves of none is none.
    least = max(least_extent(problem.mass, problem.inertia), TINY)
    lengths = guess.diagonal, float(np.abs(both).max(initial=0.0) * time)
    length = next((one for one in lengths if one > least), 1.0)
    change = length / time
    if not problem.effects:
        # Without effects the actuator alone must change the velocities of both ends into the mean one.
        mean = (guess.place[-1] - guess.place[0]) / time
        turns = both - mean
        change = max(change, float(np.linalg.norm(turns, axis=1).max()))
    typical = problem.mass * change / time
    limit, torques = _limits(problem, guess, typical, length)
    forces = np.array([unit == "N" for unit in problem.actuator.units(problem.dimension)], bool)
    force = float(np.abs(guess.control[:, forces]).max(initial=0.0)) if guess.multipliers else 0.0
    if limit is not None:
        force = min(max(force, LEAST_SHARE * limit), limit) if force else limit
    force = max(force, LEAST_SHARE * typical) if force else typical
    torque = _torque(problem, guess, force * length, torques)
    sizes = np.where(forces, force, torque)
    # All nozzles at once make no force, or next to none by rounding; one of them does.
    first = sizes * (np.arange(len(sizes)) == 0)
    along, all_the_way, alone = map(abs, costs_along(problem, guess, sizes, first, of_way=True))
    cost = max(along, all_the_way)
    cost = (cost if cost > LEAST_SHARE * alone else alone) or 1.0
    return Units(length, time, force, problem.mass, cost, torque, origin)


def outgrown(problem: TransferProblem, units: Units, path: DiscretePath) -> bool:
    """Whether an answer hardly takes the force or the torque that its units were made for."""
    if not problem.limited or has_linear_controls(problem):
        return False
    fit = units_of(problem, path)
    return fit.force < HARDLY * units.force or (problem.turns and fit.torque < HARDLY * units.torque)


def _limits(
    problem: TransferProblem, guess: DiscretePath, typical: float, length: float
) -> tuple[float | None, float | None]:
    """The limits of force [N] and torque [N m], or what is far above all that the scene calls for."""
    limits = problem.actuator.force_limit(), problem.actuator.torque_limit()
    turning = turning_torque(problem, guess) if problem.turns else 0.0
    within = ((limit or 0.0) <= FAR_ABOVE * one for limit, one in zip(limits, (typical, turning), strict=True))
    if all(within) or has_linear_controls(problem):
        return limits
    force, torque = held_up(problem, guess)
    needs = max(typical, force), max(turning, torque, force * length)
    force_limit, torque_limit = (
        limit if limit is None or not need else min(limit, FAR_ABOVE * need)
        for limit, need in zip(limits, needs, strict=True)
    )
    return force_limit, torque_limit


def _torque(problem: TransferProblem, guess: DiscretePath, without: float, limit: float | None) -> float:
    """The unit of torque: the largest used where a solution is known, else the limit, else what turns the body.

    It is `without` [N m] where nothing turns.
    """
    if not problem.turns:
        return without
    turns = np.array([unit == "N m" for unit in problem.actuator.units(problem.dimension)], bool)
    used = float(np.abs(guess.control[:, turns]).max(initial=0.0)) if guess.multipliers else 0.0
    scales = path_scales(guess)
    fastest, typical = max(scales.turn / guess.duration, scales.rate), turning_torque(problem, guess)
    if problem.links or fastest * guess.duration <= LEAST_TURN:
        # What links hold up pulls on levers, also where nothing turns. In the attitude of a body that does not
        # turn are the errors of the optimiser alone, which must not be made large.
        typical = max(typical, without)
    if limit is not None:
        used = min(max(used, LEAST_SHARE * limit), limit) if used else limit
    return max(used, LEAST_SHARE * typical) if used else typical
