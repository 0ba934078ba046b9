"""Dispersion: how far flights with errors come off a planned path, by samples and by the linear covariance."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import betaincinv

from dmoc.basics.arguments import entries, flag, number, short, whole
from dmoc.basics.records import dataclass
from dmoc.sensitivity.feedback import flights_of, gains_of

# A limit counts as broken beyond this part of the extent of the path, or of the mean speed [-]: a plan may
# lie right on it.
BEYOND = 1e-6
# The interval of a chance holds it with this probability [-].
SURE = 0.95
# The miss of the goal is given at these parts of all flights [-].
PARTS = (0.5, 0.9, 0.95, 0.99)
# The positions of all flights have at most so many entries: they are in memory, twice with the velocities.
MOST = 100_000_000


@dataclass(frozen=True)
class Chance:
    """How often a limit is broken.

    Attributes
    ----------
    broken, samples : int
        Flights that break it at a node, of how many.
    value, low, high : float
        The chance [-], and the Clopper-Pearson interval that holds it with 95 %.
    margin : float
        By how much 95 of 100 flights break it at most, in `unit`: what a zone is to be wider by.
    unit : str
    """

    broken: int
    samples: int
    value: float
    low: float
    high: float
    margin: float
    unit: str


@dataclass(frozen=True)
class Dispersion:
    """Flights with errors, and the linear covariance beside them.

    Attributes
    ----------
    time : array, shape (steps+1,)
        Of the step ends [s].
    position, velocity : arrays, shape (samples, steps+1, axes)
        [m], [m/s].
    planned : tuple of arrays, shape (steps+1, axes)
        Position and velocity of the flight without errors.
    covariance : array, shape (steps+1, 2 axes, 2 axes)
        Of position and velocity, to first order.
    chances : dict of Chance
        Of each constraint, by its name.
    miss : dict
        Distance from the planned end [m] and difference from the velocity there [m/s] that the parts 0.5,
        0.9, 0.95 and 0.99 of all flights stay below: (part, distance, speed).
    seed : int
    """

    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    planned: tuple[np.ndarray, np.ndarray]
    covariance: np.ndarray
    chances: dict[str, Chance]
    miss: tuple[tuple[float, float, float], ...]
    seed: int

    @property
    def samples(self) -> int:
        return len(self.position)

    @property
    def sigma(self) -> np.ndarray:
        """Standard deviations of position and velocity to first order, shape (steps+1, 2 axes)."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    @property
    def sampled_sigma(self) -> np.ndarray:
        """The same of the flights."""
        return np.concatenate([self.position, self.velocity], axis=2).std(axis=0, ddof=1)


def disperse(
    solution: Any,
    start: Any = (0.0, 0.0),
    force: float = 0.0,
    pointing: float = 0.0,
    mass: float = 0.0,
    samples: int = 1000,
    seed: int = 0,
    force_noise: float = 0.0,
    feedback: bool = False,
) -> Dispersion:
    """Fly the forces of a solution many times with errors, open loop or with a linear feedback.

    Errors are normally distributed. Those of force, pointing and mass are drawn once a flight and last for all
    of it, noise of the force is drawn anew in each step; propellant burns as planned. Flights are those of the
    variational scheme on the mesh of the solution. The covariance is that of the linear map of the errors, P <-
    A P A' + Q with the Jacobian A of each step and the noise Q that it adds (Maybeck, Stochastic Models,
    Estimation, and Control 1, 1979), which is symplectic as the step is. Each kind of error has random numbers
    of its own: leaving one out changes no other, and more samples only come behind the ones before.

    Parameters
    ----------
    solution : Solution
        Of a transfer of one body that does not turn, with its problem.
    start : (float, float)
        Standard deviations of position [m] and velocity [m/s] at the start, along each axis; each may be a
        sequence of one number an axis.
    force : float
        Standard deviation of the force [-], relative.
    pointing : float
        Standard deviation of a turn of the force about each axis of space [rad], in the plane about one.
    mass : float
        Standard deviation of the mass [-], relative to that at the start.
    samples : int
        Flights, at least 2.
    seed : int
        The same seed gives the same flights.
    force_noise : float
        Standard deviation of a further force along each axis [N], another one in each step. White noise of the
        power spectral density S [N^2 s] has sqrt(S / h) in a step that lasts h.
    feedback : bool
        Whether the force answers how far a flight is off the plan at the begin of each step, as `feedback`
        says; limits of the actuator are not kept.

    Raises
    ------
    ValueError
        If the solution is not of one body that does not turn, or an argument has no meaning.
    """
    flights = flights_of(solution)
    if flag("feedback", feedback):
        flights = flights.with_feedback(gains_of(solution, flights))
    axes = flights.axes
    whole("samples", samples, least=2)
    whole("seed", seed, least=0)
    most = MOST // max(solution.path.position.size, 1)
    if samples > most:
        raise ValueError(f"samples must be at most {most} on this mesh; got {short(samples)}")
    sigmas = _sigmas(axes, start, force, pointing, mass)
    errors = np.hstack(
        [
            sigma * np.random.default_rng([seed, stream]).standard_normal((samples, len(sigma)))
            for stream, sigma in enumerate(sigmas)
        ]
    )
    sigma = number("force_noise", force_noise, "N", nonnegative=True)
    noise = None
    if sigma:
        drawn = np.random.default_rng([seed, len(sigmas)])
        noise = sigma * drawn.standard_normal((samples, flights.steps, axes))
    position, velocity = flights.flown(errors, noise)
    if not (np.isfinite(position).all() and np.isfinite(velocity).all()):
        raise ValueError("a flight with these errors ends where the scheme has no solution; give smaller ones")
    slopes = flights.slopes() * np.concatenate(sigmas)
    path, ends = solution.path, slice(None, None, flights.rule.degree)
    planned = flights.flown(np.zeros((1, flights.size)))
    off = [
        np.linalg.norm(part[:, -1] - plan[0, -1], axis=1)
        for part, plan in zip((position, velocity), planned, strict=True)
    ]
    return Dispersion(
        solution.provenance.start_time + path.duration * path.mesh,
        position[:, ends],
        velocity[:, ends],
        (planned[0][0, ends], planned[1][0, ends]),
        slopes @ slopes.transpose(0, 2, 1) + (flights.process(sigma) if sigma else 0.0),
        _chances(solution, position, velocity),
        tuple((part, float(np.quantile(off[0], part)), float(np.quantile(off[1], part))) for part in PARTS),
        seed,
    )


def _sigmas(axes: int, start: Any, force: Any, pointing: Any, mass: Any) -> list[np.ndarray]:
    """Standard deviations of position, velocity, force, pointing and mass."""
    pair = entries(start)
    if pair is None or len(pair) != 2:
        raise ValueError(
            f"start must be a pair: standard deviations of position [m] and velocity [m/s]; got {short(start)}"
        )
    found = []
    for name, sigma, unit in (("position", pair[0], "m"), ("velocity", pair[1], "m/s")):
        each = entries(sigma)
        each = (sigma,) * axes if each is None else each
        if len(each) != axes:
            raise ValueError(f"start: the {name} has {axes} axes; got {short(sigma)}")
        found.append(np.array([number(f"start: {name}", one, unit, nonnegative=True) for one in each]))
    turn = number("pointing", pointing, "rad", nonnegative=True)
    if axes == 1 and turn:
        raise ValueError("pointing has no meaning along a line; leave it out")
    return [
        *found,
        np.array([number("force", force, "-", nonnegative=True)]),
        np.full({1: 0, 2: 1, 3: 3}[axes], turn),
        np.array([number("mass", mass, "-", nonnegative=True)]),
    ]


def _chances(solution: Any, position: np.ndarray, velocity: np.ndarray) -> dict[str, Chance]:
    """How often each constraint is broken at a node."""
    count, nodes, axes = position.shape
    extent = solution.path.diagonal
    scales = {"m/s": extent / solution.duration}
    times = np.tile(solution.time, count)
    found = {}
    for i, limit in enumerate(solution.problem.constraints):
        beyond = limit.excess_at(times, position.reshape(-1, axes), velocity.reshape(-1, axes))
        most = np.reshape(beyond, (count, nodes)).max(axis=1)
        broken = int(np.sum(most > BEYOND * scales.get(limit.unit, extent)))
        low, high = interval(broken, count)
        found[limit.title(i)] = Chance(
            broken, count, broken / count, low, high, float(np.quantile(most, SURE)), limit.unit
        )
    return found


def interval(hits: int, trials: int) -> tuple[float, float]:
    """The interval that holds a chance with 95 % (Clopper and Pearson 1934)."""
    tail = (1 - SURE) / 2
    low = float(betaincinv(hits, trials - hits + 1, tail)) if hits else 0.0
    high = float(betaincinv(hits + 1, trials - hits, 1 - tail)) if hits < trials else 1.0
    return low, high
