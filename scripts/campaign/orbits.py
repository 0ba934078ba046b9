"""Families of scenes around attractors."""

from collections.abc import Callable

import numpy as np
from numpy.random import Generator

import dmoc
from campaign import physics
from campaign.making import Journey, Scene, direction, journey, scene, thruster
from campaign.physics import Push


def orbits(rng: Generator) -> Scene:
    """From a circular, eccentric, hyperbolic, polar or retrograde orbit, up to one and a half revolutions."""
    return _from_orbit(rng, str(rng.choice(["circular", "eccentric", "hyperbolic", "polar", "retrograde"])))


def eccentric(rng: Generator) -> Scene:
    return _from_orbit(rng, "eccentric")


def hyperbolic(rng: Generator) -> Scene:
    return _from_orbit(rng, "hyperbolic")


def polar(rng: Generator) -> Scene:
    return _from_orbit(rng, "polar")


def retrograde(rng: Generator) -> Scene:
    return _from_orbit(rng, "retrograde")


def _from_orbit(rng: Generator, kind: str) -> Scene:
    n = 3 if kind == "polar" else int(rng.integers(2, 4))
    e = {"eccentric": rng.uniform(0.2, 0.7), "hyperbolic": rng.uniform(1.1, 2.0)}.get(kind, 0.0)
    place = direction(rng, n)
    if kind == "polar":
        place = np.array([np.cos(a := rng.uniform(0, 2 * np.pi)), 0.0, np.sin(a)])
    aside = np.array([-place[1], place[0], *np.zeros(n - 2)])
    if kind == "polar":
        aside = np.array([-place[2], 0.0, place[0]])
    aside = aside / np.linalg.norm(aside) * (-1 if kind == "retrograde" else 1)
    # At the pericentre, a distance of 1.
    start = place, np.sqrt(1 + e) * aside
    duration = rng.uniform(0.3, 1.5) * (2 * np.pi if e < 1 else 2.0)
    world = physics.attractor(1.0)
    push = thruster(rng, n, rng.uniform(0.03, 0.15), ("free", "ball", "box", "engine", "nozzles"))
    cost = rng.choice(["effort"] if push.kind == "free" else ["effort", "effort", "fuel"])
    mass = rng.uniform(0.5, 1.5)
    return scene(rng, world, push, mass, journey(rng, world, push, mass, start, duration), cost)


def three_bodies(rng: Generator) -> Scene:
    """Around the smaller of two primaries and the points of balance, in their turning frame."""
    ratio = float(rng.choice([0.01215, 0.000954, 0.1]))
    place = np.array([1 - ratio, 0.0, 0.0]) + rng.uniform(0.1, 0.3) * direction(rng, 3)
    push = thruster(rng, 3, rng.uniform(0.1, 0.5), ("free", "ball", "engine"))
    cost = rng.choice(["effort"] if push.kind == "free" else ["effort", "effort", "fuel"])
    world, start = physics.two_primaries(ratio), (place, 0.2 * rng.standard_normal(3))
    return scene(rng, world, push, 1.0, journey(rng, world, push, 1.0, start, rng.uniform(0.3, 2.0)), cost)


def perturbed(rng: Generator) -> Scene:
    """An oblate attractor, and a third body that moves, seen at any time of its motion."""
    world = physics.attractor(1.0) + physics.oblateness(1.0, 0.9, rng.uniform(1e-3, 1e-2))
    if rng.random() < 0.5:
        world += physics.other_body(rng.uniform(0.01, 0.3), 6.0, 0.1)
    place, begin = direction(rng, 3), rng.uniform(-50, 50)
    aside = np.cross(place, direction(rng, 3))
    start = place, aside / np.linalg.norm(aside) * rng.uniform(0.95, 1.15)
    push = thruster(rng, 3, rng.uniform(0.03, 0.1), ("free", "ball", "box", "engine", "nozzles"))
    found = journey(rng, world, push, 1.0, start, rng.uniform(2, 8), begin=begin)
    return scene(rng, world, push, 1.0, found, start_time=begin)


def revolutions(rng: Generator) -> Scene:
    """A free time in which one to several revolutions fit, to a state or to an orbit as a whole."""
    n, count = int(rng.integers(2, 4)), rng.uniform(0.8, 4.0)
    place = direction(rng, n)
    aside = np.array([-place[1], place[0], *np.zeros(n - 2)])
    start = place, aside / np.linalg.norm(aside) * rng.uniform(1.0, 1.1)
    push = thruster(rng, n, rng.uniform(0.02, 0.06), ("free", "ball", "engine"))
    world, T = physics.attractor(1.0), 2 * np.pi * count
    found = journey(rng, world, push, 1.0, start, T)
    cost = rng.choice(["effort"] if push.kind == "free" else ["effort", "effort", "fuel"])
    within = (T * rng.uniform(0.4, 0.9), T * rng.uniform(1.1, 1.6))
    if rng.random() < 0.5:
        return scene(rng, world, push, 1.0, found, cost, duration=within)
    goal, reached = _orbit_of(*found.goal)
    return scene(rng, world, push, 1.0, found, cost, duration=within, goal=goal, reached=reached)


def _orbit_of(q: np.ndarray, v: np.ndarray) -> tuple[dmoc.Boundary, Callable]:
    """The orbit through a state by size, shape and tilt, and the conditions of being on it."""
    size, shape, tilt = _elements(q, v)
    if len(q) == 2:
        return dmoc.Orbit(1.0, size, shape, center=(0, 0)), lambda t, q, v, m: np.subtract(
            _elements(q, v), (size, shape, tilt)
        )[:2]
    orbit = dmoc.Orbit(1.0, size, shape, tilt)
    return orbit, lambda t, q, v, m: np.subtract(_elements(q, v), (size, shape, tilt))


def _elements(q: np.ndarray, v: np.ndarray) -> tuple[float, float, float]:
    """Semi-major axis, eccentricity and inclination about an attractor of 1."""
    r, h = np.linalg.norm(q), np.cross([*q, 0][:3], [*v, 0][:3])
    size = 1 / (2 / r - v @ v)
    return size, np.sqrt(max(1 - h @ h / size, 0.0)), np.arccos(h[2] / np.linalg.norm(h))


def circles(rng: Generator) -> Scene:
    """From circle to circle in a plane, anywhere on the second: Hohmann's impulses bound the fuel."""
    ratio = rng.uniform(1.1, 1.5) ** rng.choice([-1, 1])
    mass, exhaust = 1.0, rng.uniform(1, 5)
    push = Push("engine", 2, rng.uniform(0.1, 0.3), exhaust=exhaust, metered=True)
    change = abs(np.sqrt(2 * ratio / (1 + ratio)) - 1) + abs(1 - np.sqrt(2 / (1 + ratio))) / np.sqrt(ratio)
    phase = rng.uniform(0, 2 * np.pi)
    place, aside = np.array([np.cos(phase), np.sin(phase)]), np.array([-np.sin(phase), np.cos(phase)])
    duration, rate = rng.uniform(5, 14), ratio**-1.5
    # A tangential spiral takes the difference of the circular speeds at any low thrust, far less than allowed.
    known = {"fuel": 1.5 * mass * (1 - np.exp(-change / exhaust))}
    found = Journey((place, aside), (place, aside), duration, np.zeros((1, 2)), 1.0, known)
    return scene(
        rng,
        physics.attractor(1.0),
        push,
        mass,
        found,
        "fuel",
        goal=dmoc.CircularOrbit(ratio, 1.0),
        reached=lambda t, q, v, m: [q @ q - ratio**2, v[0] + rate * q[1], v[1] - rate * q[0]],
        least=mass * (1 - np.exp(-change / exhaust)),
    )
