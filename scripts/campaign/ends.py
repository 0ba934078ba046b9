"""Families of scenes with ends that are open or move, and in units of any size."""

import casadi as ca
import numpy as np
from numpy.random import Generator

import dmoc
from campaign import physics
from campaign.making import Scene, at, direction, journey, scene, thruster

KINDS = ("ball", "box", "engine", "nozzles")


def open_ends(rng: Generator) -> Scene:
    """Some entries of the goal or the start are free; or as high or far as the force takes it."""
    n, mass = int(rng.integers(1, 4)), rng.uniform(0.5, 2.0)
    world = physics.gravity(0.5 * rng.standard_normal(n))
    if rng.random() < 0.4:
        world += physics.resistance(0.2)
    push = thruster(rng, n, rng.uniform(1, 2), KINDS)
    start = rng.standard_normal(n), 0.3 * rng.standard_normal(n)
    found = journey(rng, world, push, mass, start, rng.uniform(1, 4))
    kind = rng.choice(["goal", "start", "height", "radius"])
    end = [*found.start[0], *found.start[1]] if kind == "start" else [*found.goal[0], *found.goal[1]]
    kept = rng.random(2 * n) < 0.5
    kept[rng.integers(n)] = True
    if kind in ("height", "radius"):
        kept = rng.random(2 * n) < 0.3
        kept[:n] = False
        kept[-1] = True
    entries = [x if keep else None for x, keep in zip(end, kept, strict=True)]
    part, rows = dmoc.State(entries[:n], entries[n:]), at(entries[:n], entries[n:])
    if kind == "start":
        return scene(rng, world, push, mass, found, start=part, left=rows, least=np.nan)
    cost = "effort" if kind == "goal" else kind
    return scene(rng, world, push, mass, found, cost, goal=part, reached=rows, least=np.nan)


def moving(rng: Generator) -> Scene:
    """A target that moves: to be met with its velocity or at any, at a time that is free or not."""
    n, mass, begin = int(rng.integers(1, 4)), rng.uniform(0.5, 2.0), rng.uniform(-20, 20)
    world = physics.gravity(0.5 * rng.standard_normal(n))
    push = thruster(rng, n, rng.uniform(1, 2), KINDS)
    start = rng.standard_normal(n), 0.3 * rng.standard_normal(n)
    found = journey(rng, world, push, mass, start, rng.uniform(1, 4), begin=begin)
    (place, speed), meeting = found.goal, begin + found.duration
    rate, matched = rng.uniform(0.3, 2.0), bool(rng.random() < 0.6)

    def position(t):
        return ca.DM(place) + ca.DM(speed) * ca.sin(rate * (t - meeting)) / rate

    def rows(t, q, v, m):
        here = place + speed * np.sin(rate * (t - meeting)) / rate
        moved = speed * np.cos(rate * (t - meeting))
        return np.concatenate([q - here, v - moved] if matched else [q - here])

    free = rng.random() < 0.5
    duration = (0.5 * found.duration, 1.5 * found.duration) if free else found.duration
    return scene(
        rng,
        world,
        push,
        mass,
        found,
        goal=dmoc.Moving(position, "matched" if matched else None),
        reached=rows,
        duration=duration,
        start_time=begin,
        least=np.nan,
    )


def units(rng: Generator) -> Scene:
    """Lengths from 1e-3 to 1e11, times from 1e-2 to 1e7, masses from 1e-3 to 1e5; some far from the origin."""
    n = int(rng.integers(2, 4))
    L, T, M = 10 ** rng.uniform(-3, 11), 10 ** rng.uniform(-2, 7), 10 ** rng.uniform(-3, 5)
    kind = rng.choice(["free", "falling", "orbit", "turning"])
    start = rng.standard_normal(n), 0.5 * rng.standard_normal(n)
    duration = rng.uniform(1, 4)
    world, size = physics.nothing(n), 1.0
    if kind == "falling":
        world = physics.gravity(L / T**2 * rng.standard_normal(n)) + physics.resistance(0.2 * M / T)
    if kind == "orbit":
        place = direction(rng, n)
        aside = np.array([-place[1], place[0], *np.zeros(n - 2)])
        start, size = (place, aside / np.linalg.norm(aside)), 0.1
        world = physics.attractor(L**3 / T**2)
    if kind == "turning":
        world = physics.turning(rng.uniform(0.2, 1) / T, n)
    push = thruster(rng, n, size * M * L / T**2, ("free", *KINDS))
    begin = (start[0] * L, start[1] * L / T)
    if kind in ("free", "falling") and rng.random() < 0.5:
        begin = (begin[0] + 1e3 * L, begin[1])
    cost = rng.choice(["effort"] if push.kind == "free" else ["effort", "fuel"])
    return scene(rng, world, push, M, journey(rng, world, push, M, begin, duration * T), cost)
