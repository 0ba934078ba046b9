"""Equations of motion in NumPy, each beside the effect of dmoc that must mean the same.

A pull is a function (t [s], q [m], v [m/s], m [kg]) -> acceleration [m/s^2]; no effect is asked for it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import DOP853

import dmoc

Pull = Callable[[float, np.ndarray, np.ndarray, float], np.ndarray]


@dataclass(frozen=True)
class World:
    """What acts on the body: effects for the program, and the same as accelerations for the judge.

    `steady` is the constant acceleration of a scene in which nothing else acts, None in any other: closed forms
    exist for these. `linear` says that the acceleration is an affine function of place and velocity, the same
    at all times.
    """

    effects: tuple[dmoc.Effect, ...] = ()
    pulls: tuple[Pull, ...] = ()
    steady: np.ndarray | None = None
    linear: bool = False

    def __add__(self, other: "World") -> "World":
        both = self.linear and other.linear
        return World(self.effects + other.effects, self.pulls + other.pulls, linear=both)

    def acceleration(self, t: float, q: np.ndarray, v: np.ndarray, m: float) -> np.ndarray:
        """[m/s^2], without the force of the actuator."""
        return sum((pull(t, q, v, m) for pull in self.pulls), np.zeros_like(q))


def nothing(dimension: int) -> World:
    return World(steady=np.zeros(dimension), linear=True)


def gravity(acceleration: np.ndarray) -> World:
    effect = dmoc.UniformGravity(tuple(acceleration))
    return World((effect,), (lambda t, q, v, m: acceleration,), steady=acceleration, linear=True)


def resistance(coefficient: float) -> World:
    """Drag [N] of so much a speed [m/s]."""
    return World((dmoc.LinearDrag(coefficient),), (lambda t, q, v, m: -coefficient / m * v,), linear=True)


def air(area: float, density: float) -> World:
    """Drag that grows with the square of the speed, with a drag coefficient of 2."""
    effect = dmoc.Drag(area, 2.0, dmoc.UniformAtmosphere(density))
    return World((effect,), (lambda t, q, v, m: -area * density / m * np.linalg.norm(v) * v,))


def attractor(mu: float, center: np.ndarray | None = None) -> World:
    effect = dmoc.PointGravity(mu, None if center is None else tuple(center))
    place = 0.0 if center is None else center
    return World((effect,), (lambda t, q, v, m: -mu * (q - place) / np.linalg.norm(q - place) ** 3,))


def oblateness(mu: float, radius: float, j2: float) -> World:
    """The pull of an oblate body on places in space (Vallado 2013, equation 8-30)."""

    def pull(t: float, q: np.ndarray, v: np.ndarray, m: float) -> np.ndarray:
        r2 = q @ q
        tilt = 5 * q[2] ** 2 / r2
        return -1.5 * j2 * mu * radius**2 / r2**2.5 * q * (np.array([1.0, 1.0, 3.0]) - tilt)

    return World((dmoc.J2(mu, radius, j2),), (pull,))


def turning(rate: float, dimension: int) -> World:
    """A frame that turns about z: Coriolis and centrifugal acceleration."""
    spin = np.zeros((dimension, dimension))
    spin[0, 1], spin[1, 0] = -rate, rate
    twice = spin @ spin
    return World((dmoc.RotatingFrame(rate),), (lambda t, q, v, m: -2 * spin @ v - twice @ q,), linear=True)


def neighbourhood(n: float, dimension: int) -> World:
    """The Clohessy-Wiltshire equations."""
    by_place = np.diag([3 * n**2, 0.0, -(n**2)][:dimension])
    by_speed = np.zeros((dimension, dimension))
    by_speed[0, 1], by_speed[1, 0] = 2 * n, -2 * n
    return World((dmoc.ClohessyWiltshire(n),), (lambda t, q, v, m: by_place @ q + by_speed @ v,), linear=True)


def spring(stiffness: float, anchor: np.ndarray) -> World:
    effect = dmoc.Spring(stiffness, tuple(anchor))
    return World((effect,), (lambda t, q, v, m: -stiffness / m * (q - anchor),), linear=True)


def two_primaries(ratio: float) -> World:
    """The circular restricted three-body problem in canonical units."""
    heavy, light = np.array([-ratio, 0.0, 0.0]), np.array([1 - ratio, 0.0, 0.0])
    spin = turning(1.0, 3)
    both = spin + attractor(1 - ratio, heavy) + attractor(ratio, light)
    return World(dmoc.three_body(ratio), both.pulls)


def other_body(mu: float, radius: float, rate: float) -> World:
    """A third body on a circle about the origin, seen from coordinates that fall with the origin."""

    def pull(t: float, q: np.ndarray, v: np.ndarray, m: float) -> np.ndarray:
        s = np.zeros_like(q)
        s[:2] = radius * np.cos(rate * t), radius * np.sin(rate * t)
        return mu * ((s - q) / np.linalg.norm(s - q) ** 3 - s / radius**3)

    return World((dmoc.ThirdBody(mu, dmoc.circular_motion(radius, rate)),), (pull,))


@dataclass(frozen=True)
class Push:
    """What pushes the body, and what is known of it without asking the actuator.

    Parameters
    ----------
    kind : "free", "ball", "box", "engine" or "nozzles"
    limit : float
        Largest force of a ball, component of a box, thrust of an engine or of each nozzle [N].
    exhaust : float, optional
        Exhaust velocity [m/s]; without one no mass is burnt.
    metered : bool
        Whether the controls are the force and its magnitude; else the force alone.
    dry : float
        Dry mass [kg].
    """

    kind: str
    dimension: int
    limit: float = np.inf
    exhaust: float | None = None
    metered: bool = False
    dry: float = 0.0
    directions: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def actuator(self) -> dmoc.Actuator:
        """The same for the program."""
        burner = {"exhaust_velocity": self.exhaust, "dry_mass": self.dry}
        match self.kind:
            case "free":
                return dmoc.FreeForce()
            case "ball":
                return dmoc.BallForce(self.limit)
            case "box":
                return dmoc.BoxForce(self.limit)
            case "engine":
                return dmoc.Engine(self.limit, **burner)
        return dmoc.Nozzles(self.directions.tolist(), self.limit, **burner)

    def force(self, u: np.ndarray) -> np.ndarray:
        """Forces [N] of controls of shape (..., size)."""
        return u @ self.directions if self.kind == "nozzles" else u[..., : self.dimension]

    def throttle(self, u: np.ndarray) -> np.ndarray:
        """What is paid for [N]: the magnitude that comes with a force, or the sum of the nozzles."""
        if self.kind == "nozzles":
            return u.sum(axis=-1)
        return u[..., -1] if self.metered else np.linalg.norm(u, axis=-1)

    def flow(self, u: np.ndarray) -> np.ndarray:
        """Mass burnt [kg/s]."""
        return self.throttle(u) / self.exhaust if self.exhaust else np.zeros(u.shape[:-1])

    def beyond(self, u: np.ndarray) -> np.ndarray:
        """By how much controls are beyond the limit, or not paid for, as a part of the limit [-]."""
        if self.kind == "free":
            return np.zeros(u.shape[:-1])
        if self.kind == "nozzles":
            return np.maximum(-u, u - self.limit).max(axis=-1) / self.limit
        force = self.force(u)
        size = np.abs(force).max(axis=-1) if self.kind == "box" else np.linalg.norm(force, axis=-1)
        over = size - self.limit
        if self.metered:
            over = np.maximum(over, np.linalg.norm(force, axis=-1) - self.throttle(u))
        return over / self.limit


class Flight:
    """A flight under a control that is a polynomial in each of its pieces: states at parts of the pieces.

    Dormand and Prince's steps of order 8 (their table is SciPy's), each piece in `parts` equal steps.

    Attributes
    ----------
    time, position, velocity, mass
        At the ends of all steps, from the start on.
    """

    def __init__(
        self, world: World, push: Push, start: Sequence, edges: np.ndarray, powers: np.ndarray, parts: int
    ):
        rows, weights, stages = DOP853.A[:12, :12], DOP853.B, DOP853.C[:12]
        fractions = (np.arange(parts)[:, None] + stages) / parts
        # Controls of all pieces at all stages: shape (pieces, parts, stages, size).
        controls = _values(powers, fractions)
        force, flow = push.force(controls), push.flow(controls)
        n, (q, v, m) = push.dimension, start
        y, states = np.concatenate([q, v, [m]]), []
        states.append(y)
        slopes = np.zeros((12, 2 * n + 1))
        for k, length in enumerate(np.diff(edges) / parts):
            for p in range(parts):
                begin = edges[k] + p * length
                for i in range(12):
                    z = y + length * (rows[i, :i] @ slopes[:i])
                    slopes[i, :n] = z[n : 2 * n]
                    pull = world.acceleration(begin + stages[i] * length, z[:n], z[n : 2 * n], z[-1])
                    slopes[i, n : 2 * n] = pull + force[k, p, i] / z[-1]
                    slopes[i, -1] = -flow[k, p, i]
                y = y + length * (weights @ slopes)
                states.append(y)
        table = np.array(states)
        self.position, self.velocity, self.mass = table[:, :n], table[:, n : 2 * n], table[:, -1]
        inner = edges[:-1, None] + np.diff(edges)[:, None] * np.arange(parts) / parts
        self.time = np.append(inner.ravel(), edges[-1])


def _values(powers: np.ndarray, fractions: np.ndarray) -> np.ndarray:
    """Values of polynomials, powers of shape (pieces, degree+1, size), at fractions of the piece."""
    raised = fractions[..., None] ** np.arange(powers.shape[1])
    return np.einsum("psd,kdn->kpsn", raised, powers)
