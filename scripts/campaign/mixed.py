"""Scenes in which anything comes with anything: effects, actuators, objectives, limits, ends, units."""

from dataclasses import replace

import numpy as np
from numpy.random import Generator

import dmoc
from campaign import physics
from campaign.making import Journey, Scene, at, direction, journey, scene, thruster
from campaign.physics import World


def mixed(rng: Generator) -> Scene:
    """One to three effects, any actuator and objective, up to three limits, ends and duration free or not."""
    n, length, time = int(rng.integers(2, 4)), 10 ** rng.uniform(-3, 8), 10 ** rng.uniform(-2, 6)
    mass = 10 ** rng.uniform(-2, 4)
    world, start = _world(rng, n, mass, length, time), (length * rng.standard_normal(n), np.zeros(n))
    start[1][:] = 0.4 * length / time * rng.standard_normal(n)
    push = thruster(
        rng, n, mass * length / time**2 * rng.uniform(0.8, 2.5), ("ball", "box", "engine", "nozzles")
    )
    if push.kind in ("engine", "nozzles") and rng.random() < 0.5:
        push = replace(push, exhaust=length / time * rng.uniform(10, 40))
    found = journey(rng, world, push, mass, start, time * rng.uniform(1, 4))
    if push.exhaust:
        push = replace(push, dry=found.costs["mass"] * rng.uniform(0.5, 0.95))
    cost = str(rng.choice(["effort", "fuel", "time", *(["mass"] if push.exhaust else [])]))
    return scene(rng, world, push, mass, found, cost, **_limits(rng, found), **_ends(rng, found, cost))


def _world(rng: Generator, n: int, mass: float, length: float, time: float) -> World:
    """Each effect has a share in the motion; the attractor is so far that no path needs to come near it."""
    away = 5 * length * direction(rng, n)
    effects = [
        physics.gravity(0.4 * length / time**2 * direction(rng, n)),
        physics.resistance(mass / time * rng.uniform(0.05, 0.4)),
        physics.turning(rng.uniform(0.1, 0.6) / time, n),
        physics.spring(mass / time**2 * rng.uniform(0.1, 0.6), length * rng.standard_normal(n)),
        physics.attractor(5 * length**3 / time**2, away),
    ]
    chosen = rng.choice(len(effects), int(rng.integers(1, 4)), replace=False)
    return sum((effects[i] for i in chosen), World(linear=True))


def _limits(rng: Generator, found: Journey) -> dict:
    """A sphere beside the journey, a box around it, a speed limit above its own: each or none."""
    path, parts, depths, fastest = found.path, [], [], np.inf
    if rng.random() < 0.4:
        center = path[rng.integers(50, 150)] + 0.2 * np.ptp(path, axis=0).max() * direction(rng, path.shape[1])
        radius = float(np.linalg.norm(path - center, axis=1).min()) / 1.15
        parts.append(dmoc.KeepOut(tuple(center), radius))
        depths.append(lambda q: radius - np.linalg.norm(q - center, axis=1))
    if rng.random() < 0.4:
        room = 0.05 * np.ptp(path, axis=0)
        low, high = path.min(axis=0) - room, path.max(axis=0) + room
        parts.append(dmoc.KeepIn(tuple(low), tuple(high)))
        depths.append(lambda q: np.maximum(low - q, q - high).max(axis=1))
    if rng.random() < 0.4:
        fastest = found.fastest * rng.uniform(1.03, 1.3)
        parts.append(dmoc.SpeedLimit(fastest))
    return {"constraints": parts, "zones": tuple(depths), "fastest": fastest}


def _ends(rng: Generator, found: Journey, cost: str) -> dict:
    """The velocity at the goal may be free, and the duration for any cost."""
    place, ends = found.goal[0], {}
    if rng.random() < 0.2:
        free = [None] * len(place)
        ends |= {"goal": dmoc.State(place, free), "reached": at(place, free)}
    if cost != "time" and rng.random() < 0.3:
        ends["duration"] = (0.6 * found.duration, 1.4 * found.duration)
    return ends
