"""Transfers of the library in metres, kilometres and canonical units, later, and turned: the same answer.

Smooth least effort: the same objective to 1e-9 in the same iterations. Least fuel switches, and rounding
decides what Ipopt does at a switch: the same optimum to 1e-6, in at most twice the iterations in the median.
"""

import math
from dataclasses import replace
from functools import lru_cache
from statistics import median

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dmoc import (
    J2,
    Effort,
    Engine,
    Fuel,
    PointGravity,
    State,
    ThirdBody,
    TransferProblem,
    circular_motion,
    solve,
)
from dmoc.scene.problem_file import load_problem

EARTH, RADIUS, OBLATENESS = 3.986004418e14, 6378137.0, 1.08262668e-3
MOON, MOON_AWAY, MOON_RATE = 4.9048695e12, 3.844e8, 2.6617e-6
TURN = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()


def around_the_earth(length=1.0, time=1.0, later=0.0, angle=0.0):
    """300 to 800 km and 2 degrees of plane in a revolution, under J2 and the Moon, in units of so many m and s.

    J2 has the z axis for its own, so the scene turns about that.
    """
    turn = Rotation.from_rotvec([0, 0, angle]).as_matrix()

    def circle(height, inclination, travelled):
        r, speed = RADIUS + height, math.sqrt(EARTH / (RADIUS + height))
        tilt = Rotation.from_rotvec([inclination, 0, 0]).as_matrix()
        cos, sin = math.cos(travelled), math.sin(travelled)
        place, velocity = tilt @ [r * cos, r * sin, 0], tilt @ [-speed * sin, speed * cos, 0]
        return State(tuple(turn @ place / length), tuple(turn @ velocity * time / length))

    def weight(mu):
        return mu * time**2 / length**3

    # the Moon is where it was, on the clock that starts later and in the axes that are turned
    moon = circular_motion(MOON_AWAY / length, MOON_RATE * time, 1.0 + angle - MOON_RATE * later)
    effects = [
        PointGravity(weight(EARTH)),
        J2(weight(EARTH), RADIUS / length, OBLATENESS),
        ThirdBody(weight(MOON), moon),
    ]
    ends = circle(300e3, 0.9, 0.0), circle(800e3, 0.9 + math.radians(2), 6.0)
    return TransferProblem(
        500.0, *ends, 5600.0 / time, effects, objective=Effort(), start_time=later / time
    )  # fmt: skip


CANONICAL = {"length": RADIUS, "time": math.sqrt(RADIUS**3 / EARTH)}
FRAMES = {
    "kilometres": {"length": 1e3},
    "canonical units": CANONICAL,
    "later": {"later": 3e5},
    "turned": {"angle": 2.0},
    "all of it": {**CANONICAL, "later": -1e6, "angle": -0.6},
}


@lru_cache
def smooth(order):
    return solve(around_the_earth(), order=order, steps=400 // order).raise_for_status()


@pytest.mark.parametrize("order", [2, 8])
@pytest.mark.parametrize("frame", FRAMES)
def test_least_effort_is_the_same_in_the_same_iterations(frame, order):
    known, changes = smooth(order), FRAMES[frame]
    found = solve(around_the_earth(**changes), order=order, steps=400 // order).raise_for_status()
    effort = (changes.get("length", 1.0) / changes.get("time", 1.0) ** 2) ** 2 * changes.get("time", 1.0)
    assert found.objective * effort == pytest.approx(known.objective, rel=1e-9)
    assert [level.iterations for level in found.ladder] == [level.iterations for level in known.ladder]


def test_what_acts_is_felt():
    """Each part of the scene changes the objective by more than the sameness above allows."""
    scene = around_the_earth()
    for left_out in (1, 2):
        effects = [effect for i, effect in enumerate(scene.effects) if i != left_out]
        changed = solve(replace(scene, effects=effects), order=8, steps=50)
        assert abs(changed.objective / smooth(8).objective - 1) > 1e-7
    elsewhere = solve(replace(scene, start_time=3e5), order=8, steps=50)
    assert abs(elsewhere.objective / smooth(8).objective - 1) > 1e-8


def orbits_on_fuel(length=1.0, time=1.0, mass=1.0, turn=None, begin=0.0):
    """two_body_fuel in these units, turned and later."""
    known, axes = load_problem("two_body_fuel").make(), np.eye(3) if turn is None else turn
    engine = known.actuator
    ends = [
        State(tuple(axes @ end.position * length), tuple(axes @ end.velocity * length / time))
        for end in (known.start, known.goal)
    ]
    thrust, speed = engine.max_thrust * mass * length / time**2, engine.exhaust_velocity * length / time
    return TransferProblem(
        mass, *ends, known.duration * time, [PointGravity(length**3 / time**2)],
        actuator=Engine(thrust, exhaust_velocity=speed), objective=Fuel(), start_time=begin,
    )  # fmt: skip


@pytest.mark.slow
def test_least_fuel_has_the_same_optimum_in_like_iterations():
    earth = math.sqrt(7e6**3 / EARTH)
    frames = [
        {"length": 7e6, "time": earth, "mass": 1000.0},
        {"length": 7e3, "time": earth, "mass": 1000.0},
        {"length": 7e6, "time": earth, "mass": 1.0, "turn": TURN, "begin": 1e5},
        {"turn": TURN},
        {"turn": TURN.T @ np.diag([1, 1, -1])},
        {"begin": -40.0},
    ]
    known = solve(orbits_on_fuel()).raise_for_status()
    taken = []
    for frame in frames:
        found = solve(orbits_on_fuel(**frame)).raise_for_status()
        assert found.objective / frame.get("mass", 1.0) == pytest.approx(known.objective, rel=1e-6), frame
        taken.append(found.iterations)
    assert median(taken) <= 2 * known.iterations, taken
