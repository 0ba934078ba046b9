"""Families of scenes in which limits act: zones, speeds, limits hardly large enough, and too small ones."""

import math
from dataclasses import replace

import numpy as np
from numpy.random import Generator

import dmoc
from campaign import physics
from campaign.making import Journey, Scene, direction, journey, scene, thruster
from campaign.physics import Push

LIMITED = ("ball", "box", "engine", "nozzles")


def _drift(rng: Generator, n: int) -> tuple:
    """A world, a push, a mass and a journey in it that goes some way."""
    world = physics.nothing(n) if rng.random() < 0.5 else physics.nothing(n) + physics.resistance(0.2)
    push, mass = thruster(rng, n, rng.uniform(1, 3), ("free", *LIMITED)), rng.uniform(0.5, 2.0)
    start = rng.standard_normal(n), direction(rng, n) * rng.uniform(0.2, 1.0)
    return world, push, mass, journey(rng, world, push, mass, start, rng.uniform(2, 5))


def zones(rng: Generator) -> Scene:
    """Spheres that touch the journey almost, a box around it, a cone that holds it."""
    n = int(rng.integers(2, 4))
    world, push, mass, found = _drift(rng, n)
    make = (_spheres, _box, _cone)[rng.integers(3)]
    constraints, depths = make(rng, found.path)
    return scene(rng, world, push, mass, found, constraints=constraints, zones=tuple(depths))


def _spheres(rng: Generator, path: np.ndarray) -> tuple[list, list]:
    """One to three, each beside a place of the path and as large as leaves it a tenth of the radius."""
    size, parts, depths = np.linalg.norm(np.ptp(path, axis=0)), [], []
    for _ in range(rng.integers(1, 4)):
        center = path[rng.integers(40, 160)] + 0.15 * size * direction(rng, path.shape[1])
        radius = float(np.linalg.norm(path - center, axis=1).min() / 1.1)
        if radius > 0.02 * size:
            parts.append(dmoc.KeepOut(tuple(center), radius))
            depths.append(lambda q, c=center, r=radius: r - np.linalg.norm(q - c, axis=1))
    return parts, depths


def _box(rng: Generator, path: np.ndarray) -> tuple[list, list]:
    room = 0.02 * np.ptp(path, axis=0)
    low, high = path.min(axis=0) - room, path.max(axis=0) + room
    part = dmoc.KeepIn(tuple(low), tuple(high))
    return [part], [lambda q: np.maximum(low - q, q - high).max(axis=1)]


def _cone(rng: Generator, path: np.ndarray) -> tuple[list, list]:
    """From a tip behind the middle of the path, two degrees wider than it needs."""
    middle = path.mean(axis=0)
    axis = direction(rng, path.shape[1])
    tip = middle - axis * 1.5 * np.linalg.norm(path - middle, axis=1).max()

    def angle(q: np.ndarray) -> np.ndarray:
        depth = (q - tip) @ axis
        return np.arctan2(np.linalg.norm(q - tip - depth[:, None] * axis, axis=1), depth)

    half = float(angle(path).max()) + math.radians(2)
    part = dmoc.ApproachCone(tuple(tip), tuple(axis), half)
    return [part], [lambda q: np.linalg.norm(q - tip, axis=1) * np.sin(np.clip(angle(q) - half, 0, np.pi / 2))]


def speed(rng: Generator) -> Scene:
    """A speed limit hardly above what the journey needs, which the cheapest path without it may break."""
    n = int(rng.integers(1, 4))
    world, push, mass, found = _drift(rng, n)
    limit = found.fastest * rng.uniform(1.02, 1.2)
    cost = rng.choice(["effort"] if push.kind == "free" else ["effort", "time"])
    return scene(rng, world, push, mass, found, cost, constraints=[dmoc.SpeedLimit(limit)], fastest=limit)


def _rest_to_rest(rng: Generator, n: int, mass: float, duration: float) -> tuple[Journey, float]:
    """From rest to rest in free space, and the force limit that this needs in the given time: 4 m d / T^2."""
    start, goal = rng.standard_normal(n), rng.standard_normal(n)
    still, distance = np.zeros(n), float(np.linalg.norm(goal - start))
    need = 4 * mass * distance / duration**2
    costs = {"effort": 0.5 * need**2 * duration, "fuel": need * duration, "time": duration}
    path = start + np.linspace(0, 1, 200)[:, None] * (goal - start)
    return Journey((start, still), (goal, still), duration, path, 2 * distance / duration, costs), need


def tight(rng: Generator) -> Scene:
    """Two to five per cent more force, speed, propellant or time than is needed."""
    n, mass, duration = int(rng.integers(1, 4)), rng.uniform(0.5, 2.0), rng.uniform(1, 5)
    spare, kind = rng.uniform(1.02, 1.05), rng.choice(["force", "time", "speed", "steady", "fuel"])
    found, need = _rest_to_rest(rng, n, mass, duration)
    world, push = physics.nothing(n), Push(rng.choice(["ball", "engine"]), n, need * spare)
    push = Push(push.kind, n, push.limit, metered=push.kind == "engine")
    if kind == "force":
        return scene(rng, world, push, mass, found, rng.choice(["effort", "fuel"]))
    if kind == "time":
        # The bound is sharp: bang-bang along the line.
        quickest = duration / math.sqrt(spare)
        return scene(rng, world, push, mass, found, "time", duration=(0.2 * duration, duration), least=quickest)
    if kind == "speed":
        return _at_the_speed_limit(rng, n, mass, duration, spare)
    if kind == "steady":
        world = physics.gravity(direction(rng, n)) + physics.resistance(0.2)
        start = rng.standard_normal(n), 0.5 * rng.standard_normal(n)
        flown = journey(rng, world, push, mass, start, duration, share=1 / spare, steady=True)
        return scene(rng, world, push, mass, flown, rng.choice(["effort", "fuel", "time"]))
    return _short_of_fuel(rng, n, mass, duration, spare)


def _at_the_speed_limit(rng: Generator, n: int, mass: float, duration: float, spare: float) -> Scene:
    """A speed limit just above the mean speed, and force enough to reach it in time."""
    found, _ = _rest_to_rest(rng, n, mass, duration)
    limit = float(np.linalg.norm(found.goal[0] - found.start[0])) / duration * spare
    # Full force to the limit and back takes d = v (T - v / a) with a = F / m; a fifth more force is given.
    push = Push("ball", n, 1.2 * mass * limit / (duration * (1 - 1 / spare)))
    found = replace(found, costs={"effort": push.limit * mass * limit})
    speed = dmoc.SpeedLimit(limit)
    return scene(rng, physics.nothing(n), push, mass, found, constraints=[speed], fastest=limit)


def _short_of_fuel(rng: Generator, n: int, mass: float, duration: float, spare: float) -> Scene:
    """Propellant for a few per cent more than what two short burns and a coast take."""
    found, need = _rest_to_rest(rng, n, mass, duration)
    # With twelve times the least force the burns are short; with the body's mass at most what it was they reach
    # d / T (1 + 1/40) in the first fortieth of the time.
    mean, exhaust = np.linalg.norm(found.goal[0] - found.start[0]) / duration, 20 * found.fastest
    limit, gained = 12 * need, 2 * mean * (1 + 1 / 40) * spare
    push = Push("engine", n, limit, exhaust=exhaust, metered=True, dry=mass * math.exp(-gained / exhaust))
    # Both burns at full force, each of the time that it takes the heavy body.
    effort = limit * mass * mean * (1 + 1 / 40)
    found = replace(found, costs={"effort": effort, "fuel": mass - push.dry, "mass": push.dry})
    return scene(rng, physics.nothing(n), push, mass, found, rng.choice(["effort", "fuel", "mass"]))


def impossible(rng: Generator) -> Scene:
    """A force, speed, time, propellant or room that cannot be enough; a failure must name it."""
    n, mass, duration = int(rng.integers(2, 4)), rng.uniform(0.5, 2.0), rng.uniform(1, 5)
    found, need = _rest_to_rest(rng, n, mass, duration)
    short, world = rng.uniform(0.6, 0.97), physics.nothing(n)
    kind = rng.choice(["force", "time", "speed", "fuel", "wall", "zone"])
    strong = Push("ball", n, 5 * need)
    middle = 0.5 * (found.start[0] + found.goal[0])
    distance = float(np.linalg.norm(found.goal[0] - found.start[0]))
    if kind == "force":
        made = scene(rng, world, Push("ball", n, need * short), mass, found)
        words: tuple[str, ...] = ("force limit", "largest thrust")
    elif kind == "time":
        made = scene(
            rng, world, Push("ball", n, need * short), mass, found, "time", duration=(0.1 * duration, duration)
        )
        words = ("force limit", f"{duration:.3g}"[:3])
    elif kind == "speed":
        made = scene(
            rng, world, strong, mass, found, constraints=[dmoc.SpeedLimit(distance / duration * short)]
        )
        words = ("speed limit",)
    elif kind == "fuel":
        exhaust = 20 * found.fastest
        dry = mass * math.exp(-2 * distance / duration / exhaust * short)
        push = Push("engine", n, 20 * need, exhaust=exhaust, metered=True, dry=dry)
        made = scene(rng, world, push, mass, found)
        words = ("propellant", "dry mass")
    elif kind == "wall":
        # The goal is out of the box.
        edge = found.goal[0][0] - short * (found.goal[0][0] - found.start[0][0])
        low, high = np.full(n, -math.inf), np.full(n, math.inf)
        (high if found.goal[0][0] > edge else low)[0] = 0.5 * (edge + found.goal[0][0])
        made = scene(rng, world, strong, mass, found, constraints=[dmoc.KeepIn(tuple(low), tuple(high))])
        words = ("KeepIn", "keep-in", "box", "between")
    else:
        center = found.goal[0] + 0.1 * short * (middle - found.goal[0])
        zone = dmoc.KeepOut(tuple(center), 0.3 * distance)
        made = scene(rng, world, strong, mass, found, constraints=[zone])
        words = ("KeepOut", "keep-out", "away")
    return Scene(made.parts, made.truth, made.options, blames=words)
