"""Random starts, goals, durations and numbers of most problems.

Pass criterion: at least 95 % are solved with every check green, from the default guess alone. Seen: all
of 200 each.
"""

from dataclasses import replace

import numpy as np
import pytest

from dmoc import State, solve, verify
from dmoc.scene.problem_file import load_problem


def orbit_raise(random):
    """From a circle to one of 1.1 to 2.5 times its radius in half a revolution to two and a half."""
    radius, angle = random.uniform(1.1, 2.5), random.uniform(0.5, 2.5) * 2 * np.pi
    # about as long as the mean of both circles takes for that angle
    duration = angle * 0.5 * (1 + radius**1.5) * random.uniform(0.9, 1.1)
    begin = random.uniform(0, 2 * np.pi)
    start, goal = (
        State(r * np.array([np.cos(a), np.sin(a)]), np.array([-np.sin(a), np.cos(a)]) / np.sqrt(r))
        for r, a in ((1.0, begin), (radius, begin + angle))
    )
    return replace(load_problem("orbit_raise").make(), start=start, goal=goal, duration=duration)


def free_flyer(random):
    """From one side of the obstacles to the other, from rest to rest."""
    scene, still = load_problem("free_flyer").make(), np.zeros(3)
    while True:
        start = random.uniform((-1, -1, -1), (1, 2, 2))
        goal = random.uniform((7, -1, -1), (9, 2, 2))
        try:
            ends = {"start": State(start, still), "goal": State(goal, still)}
            return replace(scene, **ends, duration=random.uniform(35, 80))
        except ValueError:
            # inside an obstacle
            continue


def rendezvous(random):
    """From within two kilometres to within a hundred metres, moving, in 10 to 200 minutes."""
    start = State(random.uniform(-2000, 2000, 3), random.uniform(-1, 1, 3))
    goal = State(random.uniform(-100, 100, 3), random.uniform(-0.1, 0.1, 3))
    scene = load_problem("rendezvous").make()
    return replace(scene, start=start, goal=goal, duration=random.uniform(600, 12000))


def drone_hop(random):
    """To any roof, in 1.3 to 3 times what full thrust takes to climb that far."""
    goal = random.uniform((4, -6, 0), (14, 6, 8))
    duration = random.uniform(1.3, 3) * 2 * np.sqrt(np.linalg.norm(goal) / 5.19)
    return load_problem("drone_hop").make(goal=tuple(goal.tolist()), duration=float(duration))


def formation(random):
    """From anywhere in the cone."""
    away = random.uniform(100, 800)
    start = (random.uniform(-0.15, 0.15) * away, -away, random.uniform(-0.15, 0.15) * away)
    return load_problem("formation").make(start=start, duration=random.uniform(600, 1500))


def lunar_landing(random):
    """From any height, at up to 0.9 of the speed that full thrust still stops."""
    height = random.uniform(5, 30)
    speed = random.uniform(0, 0.9) * np.sqrt(3 * height)
    return load_problem("lunar_landing").make(height=height, speed=float(speed))


def bang_bang(random):
    """Carts, ways and forces from a thousandth to a thousand."""
    distance, limit, mass = (10 ** random.uniform(-3, 3, 3)).tolist()
    return load_problem("bang_bang").make(distance=distance, limit=limit, mass=mass)


def earth_mars(random):
    return load_problem("earth_mars").make(radius=random.uniform(1.1, 2.2))


def hovercraft(random):
    return load_problem("hovercraft").make(opening=random.uniform(0.8, 2.0), drag=random.uniform(0, 4))


MOST = [(orbit_raise, {"tol": 1e-3}), (free_flyer, {}), (rendezvous, {})]
MORE = [(make, {}) for make in (drone_hop, formation, lunar_landing, bang_bang, earth_mars, hovercraft)]
SLOW = pytest.mark.slow
CASES = [
    *(pytest.param(*case, 8, id=case[0].__name__) for case in MOST),
    *(pytest.param(*case, 3, id=case[0].__name__) for case in MORE),
    *(pytest.param(*case, 200, id=f"{case[0].__name__} at length", marks=SLOW) for case in MOST + MORE),
]


@pytest.mark.parametrize(("make", "numerics", "count"), CASES)
def test_random_transfers_are_solved_and_certified(make, numerics, count):
    random, green = np.random.default_rng(1), 0
    for _ in range(count):
        found = solve(make(random), **numerics)
        green += found.success and verify(found).ok
    assert green >= 0.95 * count
