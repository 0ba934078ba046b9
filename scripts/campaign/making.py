"""How a scene is made: a random journey that is possible, whose ends become those of the scene."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.random import Generator
from scipy.integrate import solve_ivp

import dmoc
from campaign.judge import Truth
from campaign.physics import Push, World

# Orders, and accuracies that are asked for (None: a mesh by default), among which scenes are drawn.
ORDERS = (None, 2, 4, 6, 8)
TOLERANCES = (None, None, 1e-3, 1e-4, 1e-5)


@dataclass(frozen=True)
class Scene:
    """The parts of a problem, how it is to be solved, and what the judge knows of it.

    `blames` are words of which a failure must say one, for a scene that cannot be solved; empty for others.
    """

    parts: dict[str, Any]
    truth: Truth
    options: dict[str, Any] = field(default_factory=dict)
    blames: tuple[str, ...] = ()

    @property
    def problem(self) -> dmoc.TransferProblem:
        """The problem; a ValueError if the program refuses it."""
        return dmoc.TransferProblem(**self.parts)


@dataclass(frozen=True)
class Journey:
    """A path that is possible: its ends, and what it costs.

    `path` are 200 positions on the way [m], `fastest` its peak speed [m/s]; costs by the names of `Truth.cost`.
    """

    start: tuple[np.ndarray, np.ndarray]
    goal: tuple[np.ndarray, np.ndarray]
    duration: float
    path: np.ndarray
    fastest: float
    costs: dict[str, float]


def journey(
    rng: Generator,
    world: World,
    push: Push,
    mass: float,
    start: tuple,
    duration: float,
    share: float = 0.5,
    begin: float = 0.0,
    steady: bool = False,
) -> Journey:
    """Fly a random smooth force of at most `share` of the limit, in a ball of that size, by SciPy.

    If `steady`, the force has that magnitude all the way and only turns; it starts at the time `begin` [s].
    """
    n, size = push.dimension, push.limit * share
    waves, shifts = rng.standard_normal((3, n)), rng.uniform(0, 2 * np.pi, (3, n))
    rates = np.arange(3)[:, None] * np.pi / duration

    def raw(t: float) -> np.ndarray:
        return (waves * np.cos(rates * t + shifts)).sum(axis=0)

    peak = max(np.linalg.norm(raw(t)) for t in np.linspace(0, duration, 101))

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        q, v, m = y[:n], y[n : 2 * n], y[2 * n]
        force = size * raw(t) / (np.linalg.norm(raw(t)) if steady else peak)
        size_now = np.linalg.norm(force)
        paid = np.abs(force).sum() if push.kind == "nozzles" else size_now
        burnt = paid / push.exhaust if push.exhaust else 0.0
        return np.concatenate(
            [v, world.acceleration(begin + t, q, v, m) + force / m, [-burnt, paid, 0.5 * size_now**2]]
        )

    y0 = np.concatenate([*start, [mass, 0.0, 0.0]])
    times = np.linspace(0, duration, 200)
    found = solve_ivp(rate, (0, duration), y0, "DOP853", times, rtol=1e-9, atol=1e-11 * _sizes(y0, duration, n))
    q, v, (m, paid, effort) = found.y[:n], found.y[n : 2 * n], found.y[2 * n :, -1]
    costs = {"effort": effort, "fuel": mass - m if push.exhaust else paid, "time": duration, "mass": m}
    fastest = float(np.linalg.norm(v, axis=0).max())
    return Journey(start, (q[:, -1], v[:, -1]), duration, q.T, fastest, costs)


def _sizes(y0: np.ndarray, duration: float, n: int) -> np.ndarray:
    """Sizes of the states for the absolute tolerance: what is zero at the start stands at the others' size."""
    size = np.linalg.norm(y0[:n]) + np.linalg.norm(y0[n : 2 * n]) * duration or 1.0
    return np.concatenate([np.full(n, size), np.full(n, size / duration), np.full(3, y0[2 * n])])


def scene(
    rng: Generator,
    world: World,
    push: Push,
    mass: float,
    found: Journey,
    cost: str = "effort",
    options: dict | None = None,
    **other: Any,
) -> Scene:
    """From the start of a journey to where it ended, at the least cost, in its duration or about it.

    `other` may hold parts of the problem (goal, constraints, duration) and of the truth (reached, zones,
    fastest, least).
    """
    objective = {
        "effort": dmoc.Effort(),
        "fuel": dmoc.Fuel(),
        "time": dmoc.Time(),
        "mass": dmoc.FinalMass(),
        "height": dmoc.FinalHeight(),
        "radius": dmoc.FinalRadius(),
    }
    if cost == "fuel" and push.kind in ("ball", "box"):
        push = replace(push, metered=True)
    about = (0.3 * found.duration, 1.5 * found.duration) if cost == "time" else found.duration
    duration = other.pop("duration", about)
    reached = other.pop("reached", at(*found.goal))
    truth = Truth(
        world,
        push,
        mass,
        other.pop("left", at(*found.start)),
        reached,
        duration if isinstance(duration, tuple) else (duration, duration),
        cost,
        zones=other.pop("zones", ()),
        fastest=other.pop("fastest", np.inf),
        known=found.costs.get(cost, math.nan),
        least=other.pop("least", bound(world, push, mass, found, cost, duration)),
    )
    parts = {
        "mass": mass,
        "start": dmoc.State(*found.start),
        "goal": dmoc.State(*found.goal),
        "duration": duration,
        "effects": world.effects,
        "actuator": push.actuator,
        "objective": objective[cost],
        **other,
    }
    return Scene(parts, truth, numerics(rng, cost) if options is None else options)


def at(position: Any, velocity: Any) -> Callable:
    """Conditions of a fixed end; entries that are None are free."""
    wanted = np.array([np.nan if x is None else x for x in (*position, *velocity)], float)
    given = ~np.isnan(wanted)
    return lambda t, q, v, m: (np.concatenate([q, v]) - wanted)[given]


def numerics(rng: Generator, cost: str) -> dict[str, Any]:
    """Order, tolerance and hold: switching controls are not asked for to more than 1e-4."""
    tol = TOLERANCES[rng.integers(len(TOLERANCES))]
    if tol is not None and cost != "effort":
        tol = max(tol, 1e-4)
    found = {"order": ORDERS[rng.integers(len(ORDERS))], "tol": tol, "hold": bool(rng.random() < 0.2)}
    return {name: value for name, value in found.items() if value}


def bound(world: World, push: Push, mass: float, found: Journey, cost: str, duration: Any) -> float:
    """A proven bound of the cost where the acceleration is constant and no mass is burnt, else NaN."""
    if world.steady is None or push.exhaust or (isinstance(duration, tuple) and cost != "time"):
        return math.nan
    (q0, v0), (q1, v1), T = found.start, found.goal, found.duration
    if cost == "effort":
        # The double integrator's least effort without limits (Bryson & Ho 1975, section 5.2).
        w, d = v1 - v0 - world.steady * T, q1 - q0 - v0 * T - 0.5 * world.steady * T**2
        return float(mass**2 * (6 * d @ d / T**3 - 6 * d @ w / T**2 + 2 * w @ w / T))
    if cost == "fuel":
        # No force changes the momentum by more than its impulse.
        return float(mass * np.linalg.norm(v1 - v0 - world.steady * T))
    return math.nan


def direction(rng: Generator, dimension: int) -> np.ndarray:
    """A random unit vector."""
    found = rng.standard_normal(dimension)
    return found / np.linalg.norm(found)


def thruster(rng: Generator, dimension: int, limit: float, kinds: tuple[str, ...]) -> Push:
    """A random actuator that can push with `limit` in any direction [N]."""
    kind = kinds[rng.integers(len(kinds))]
    if kind == "free":
        return Push("free", dimension, limit)
    if kind == "nozzles":
        # One against each side of each axis.
        axes = np.vstack([np.eye(dimension), -np.eye(dimension)])
        return Push(kind, dimension, limit, directions=axes)
    return Push(kind, dimension, limit, metered=kind == "engine")
