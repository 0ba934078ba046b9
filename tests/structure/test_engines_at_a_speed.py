"""Engines that keep to a limit on the speed: the thrust there is between nothing and full, and a leg alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import dmoc
from dmoc import Engine, Fuel, SpeedLimit, State, Time, TransferProblem, UniformGravity
from dmoc.structure.arcs import BURN, COAST, SINGULAR, from_plain

PULL, THRUST, EXHAUST, MASS, HEIGHT, SPEED = 1.6, 6000.0, 3000.0, 1000.0, 2000.0, 40.0
ENGINE = {
    "effects": [UniformGravity((-PULL,))],
    "actuator": Engine(THRUST, exhaust_velocity=EXHAUST),
    "constraints": [SpeedLimit(SPEED)],
}


def lander(objective):
    return TransferProblem(
        MASS, State((HEIGHT,), (0,)), State((0,), (0,)), (20.0, 200.0), objective=objective, **ENGINE
    )


def braked(mass):
    """Time, way and mass of a full burn from the speed downwards to rest."""
    flow = THRUST / EXHAUST

    def speed(t):
        return SPEED + PULL * t - EXHAUST * np.log(mass / (mass - flow * t))

    time = brentq(speed, 1e-6, 0.9 * mass / flow)
    left = mass - flow * time
    way = SPEED * time + 0.5 * PULL * time**2 - EXHAUST * (left / flow * np.log(left / mass) + time)
    return time, way, left


def softly():
    """Durations and propellant of a fall to the speed, a descent at it and a full burn."""
    fall = SPEED / PULL, 0.5 * SPEED**2 / PULL

    def high(held):
        return HEIGHT - fall[1] - SPEED * held - braked(MASS * np.exp(-PULL * held / EXHAUST))[1]

    held = brentq(high, 0.0, 100.0)
    time, _, left = braked(MASS * np.exp(-PULL * held / EXHAUST))
    return [fall[0], held, time], MASS - left


@pytest.mark.parametrize(("order", "steps"), [(4, 30), (2, 60)])
def test_a_lander_falls_descends_at_the_speed_and_brakes(order, steps):
    found = dmoc.solve(lander(Fuel()), order, steps, structure=True)
    durations, burnt = softly()
    assert found.success and [arc.kind for arc in from_plain(found.arcs)] == [COAST, SINGULAR, BURN]
    assert [leg.duration for leg in found.legs] == pytest.approx(durations, rel=1e-8)
    assert found.objective == pytest.approx(burnt, rel=2e-9)
    held = found.legs[1]
    assert held.path.control[:, 0] == pytest.approx(PULL * held.path.mass, rel=1e-6)
    assert dmoc.verify(found).ok


def test_in_least_time_it_drives_itself_to_the_speed():
    found = dmoc.solve(lander(Time()), structure=True)
    assert found.success and len(found.legs) == 3 and dmoc.verify(found).ok
    assert found.objective < sum(softly()[0])
    assert found.legs[1].velocity[:, 0] == pytest.approx(-SPEED, rel=1e-9)


def test_a_lander_that_comes_sideways_keeps_to_the_speed_while_it_turns():
    plane = ENGINE | {"effects": [UniformGravity((0, -PULL))]}
    ends = State((0, HEIGHT), (20, 0)), State((300, 0), (0, 0))
    problem = TransferProblem(MASS, *ends, (20.0, 200.0), objective=Fuel(), **plane)
    found = dmoc.solve(problem, 4, 30, structure=True)
    assert found.success and [arc.kind for arc in from_plain(found.arcs)] == [BURN, COAST, SINGULAR, BURN]
    ladder = dmoc.solve(problem, 4, 200)
    assert found.objective == pytest.approx(ladder.objective, rel=1e-5)
    assert np.linalg.norm(found.legs[2].velocity, axis=1) == pytest.approx(SPEED, rel=1e-6)
    assert dmoc.verify(found).ok
