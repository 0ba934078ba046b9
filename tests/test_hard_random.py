"""Random starts, goals and durations of three problems.

Pass criterion: at least 95 % are solved with every check green, from the default guess alone; of the
rest, each says so, by its status or by a check that fails.
"""

from dataclasses import replace

import numpy as np
import pytest

from dmoc import State, solve, verify
from dmoc.library import load_problem

COUNTS = [20, pytest.param(200, marks=pytest.mark.slow)]


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


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize(
    ("make", "numerics"), [(orbit_raise, {"tol": 1e-3}), (free_flyer, {}), (rendezvous, {})]
)
def test_random_transfers_are_solved_and_certified(make, numerics, count):
    random, green = np.random.default_rng(1), 0
    for _ in range(count):
        found = solve(make(random), **numerics)
        if found.success:
            report = verify(found)
            green += report.ok
            assert report.ok or any(not check.ok and check.value is not None for check in report.checks)
        else:
            assert found.status != "solved" and found.message
    assert green >= 0.95 * count
