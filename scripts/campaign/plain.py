"""Families of scenes without an attractor: free space, gravity and air, turning frames, zones, speed limits."""

from dataclasses import replace

import numpy as np
from numpy.random import Generator

from campaign import physics
from campaign.making import Scene, journey, scene, thruster

ALL = ("free", "ball", "box", "engine", "nozzles")


def free_space(rng: Generator) -> Scene:
    """One to three axes, nothing acts; any actuator, any objective that it can have."""
    n = int(rng.integers(1, 4))
    push = thruster(rng, n, rng.uniform(0.5, 2.0), ALL)
    cost = rng.choice(["effort"] if push.kind == "free" else ["effort", "fuel", "time"])
    start = rng.standard_normal(n), 0.3 * rng.standard_normal(n)
    mass, world = rng.uniform(0.5, 2.0), physics.nothing(n)
    return scene(rng, world, push, mass, journey(rng, world, push, mass, start, rng.uniform(2, 6)), cost)


def falling(rng: Generator) -> Scene:
    """Uniform gravity with linear or quadratic drag, or none; enough thrust to hover."""
    n, mass = int(rng.integers(1, 4)), rng.uniform(0.5, 2.0)
    down = np.zeros(n)
    down[-1] = -rng.uniform(1, 10)
    world = physics.gravity(down)
    kind = rng.integers(3)
    if kind:
        world += (
            physics.resistance(rng.uniform(0.05, 0.5))
            if kind == 1
            else physics.air(rng.uniform(0.05, 0.2), 1.0)
        )
    push = thruster(rng, n, -down[-1] * mass * rng.uniform(1.5, 3), ALL)
    cost = rng.choice(["effort"] if push.kind == "free" else ["effort", "fuel", "time"])
    start = rng.standard_normal(n), rng.standard_normal(n)
    return scene(rng, world, push, mass, journey(rng, world, push, mass, start, rng.uniform(1, 3)), cost)


def turning(rng: Generator) -> Scene:
    """A frame that turns, with a spring in it or without, or the neighbourhood of a circular orbit."""
    n, rate = int(rng.integers(2, 4)), rng.uniform(0.2, 1.5)
    world = physics.turning(rate, n) if rng.random() < 0.6 else physics.neighbourhood(rate, n)
    if rng.random() < 0.3:
        world += physics.spring(rng.uniform(0.2, 2.0), 0.3 * rng.standard_normal(n))
    push = thruster(rng, n, rng.uniform(0.3, 1.5), ALL)
    cost = rng.choice(["effort"] if push.kind == "free" else ["effort", "fuel"])
    mass, start = rng.uniform(0.5, 2.0), (rng.standard_normal(n), 0.3 * rng.standard_normal(n))
    return scene(rng, world, push, mass, journey(rng, world, push, mass, start, rng.uniform(1, 5)), cost)


def burning(rng: Generator) -> Scene:
    """Engines and nozzles that burn propellant, with a dry mass below what the journey leaves."""
    n, mass = int(rng.integers(1, 4)), rng.uniform(1, 3)
    down = np.zeros(n)
    down[-1] = -rng.choice([0.0, 1.6])
    world = physics.gravity(down) if down[-1] else physics.nothing(n)
    push = thruster(rng, n, mass * rng.uniform(3, 6), ("engine", "nozzles"))
    push = replace(push, exhaust=float(rng.uniform(10, 40)), dry=0.0)
    start = 3 * rng.standard_normal(n), rng.standard_normal(n)
    found = journey(rng, world, push, mass, start, rng.uniform(1.5, 4))
    push = replace(push, dry=found.costs["mass"] * rng.uniform(0.5, 0.95))
    return scene(rng, world, push, mass, found, rng.choice(["effort", "fuel", "mass", "time"]))
