"""Families of scenes around attractors."""

import numpy as np
from numpy.random import Generator

from campaign import physics
from campaign.making import Scene, direction, journey, scene, thruster


def orbits(rng: Generator) -> Scene:
    """From a circular, eccentric, hyperbolic, polar or retrograde orbit, up to one and a half revolutions."""
    kind = rng.choice(["circular", "eccentric", "hyperbolic", "polar", "retrograde"])
    n = 3 if kind == "polar" else int(rng.integers(2, 4))
    e = {"eccentric": rng.uniform(0.2, 0.7), "hyperbolic": rng.uniform(1.1, 2.0)}.get(str(kind), 0.0)
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
