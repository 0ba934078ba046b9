"""An engine that flies along a zone: part of its thrust turns the path with the surface."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

import dmoc
from dmoc import BallForce, Engine, Fuel, KeepOut, SpeedLimit, State, TransferProblem
from dmoc.structure.arcs import BURN, COAST, PARTLY, from_plain
from dmoc.structure.improve import is_pulled

# The scene is alike on both sides of x = 3 m: mass 1 kg, nothing burns away.
LENGTH, LASTS, THRUST, DEPTH, RADIUS = 6.0, 18.0, 0.35, 0.25, 0.8
POINTS, WEIGHTS = (
    0.5 * (part + shift) for part, shift in zip(np.polynomial.legendre.leggauss(24), (1, 0), strict=True)
)


def scene(exhaust_velocity=None):
    ends = State((0, 0), (0, 0)), State((LENGTH, 0), (0, 0))
    zone = KeepOut((0.5 * LENGTH, -DEPTH), RADIUS)
    engine = Engine(THRUST, exhaust_velocity=exhaust_velocity)
    return TransferProblem(1.0, *ends, LASTS, constraints=[zone], actuator=engine, objective=Fuel())


def halves():
    """The impulse of the best burn, coast and way along the circle up to the middle, twice [N s].

    The burn turns as a polynomial of the time, the speed on the circle is one that is even about the middle;
    integrals are sums at Gauss points.
    """

    def way(x):
        burn, coast, along, first, turn, bend, more, last = x
        angle = first + turn * POINTS + bend * POINTS**2
        push = THRUST * np.stack([np.cos(angle), np.sin(angle)])
        velocity = burn * push @ WEIGHTS
        place = burn**2 * push @ (WEIGHTS * (1 - POINTS)) + coast * velocity
        speed = np.linalg.norm(velocity)
        # Time on the circle counts back from the middle: 0 there, 1 where it is reached.
        speeds = speed + more * (POINTS**2 - 1) + last * (POINTS**4 - 1)
        rates = (2 * more * POINTS + 4 * last * POINTS**3) / along
        off = place - (0.5 * LENGTH, -DEPTH)
        turned = np.arctan2(off[1], off[0]) - along * (speeds @ WEIGHTS) / RADIUS
        cost = THRUST * burn + along * np.hypot(speeds**2 / RADIUS, rates) @ WEIGHTS
        rows = [
            off @ off / RADIUS**2 - 1,
            off @ velocity / (RADIUS * speed),
            turned - 0.5 * np.pi,
            (burn + coast + along) / (0.5 * LASTS) - 1,
        ]
        return cost, np.array(rows)

    found = minimize(
        lambda x: way(x)[0],
        [1.0, 7.5, 0.3, 0.17, 0.0, 0.0, 0.0, 0.0],
        constraints={"type": "eq", "fun": lambda x: way(x)[1]},
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 500},
    )
    assert found.success and np.abs(way(found.x)[1]).max() < 1e-9
    return 2 * found.fun, found.x


@pytest.mark.parametrize("mesh", [(4, 40), (2, 60), (8, 12)])
def test_part_of_the_thrust_turns_the_path_along_a_zone(mesh):
    impulse, (burn, coast, along, *_) = halves()
    found = dmoc.solve(scene(), *mesh, structure=True).raise_for_status()
    arcs = from_plain(found.arcs)
    assert [arc.kind for arc in arcs] == [BURN, COAST, PARTLY, COAST, BURN]
    assert found.objective == pytest.approx(impulse, rel=1e-8)
    lasted = [leg.duration for leg in found.legs]
    assert lasted == pytest.approx([burn, coast, 2 * along, coast, burn], rel=1e-4)
    assert dmoc.verify(found).ok and not is_pulled(arcs, found)


def test_burns_and_coasts_alone_came_to_the_zone_from_inside():
    """One chain of them cut it by 2.7 mm between its nodes and cost 9e-4 less than may be."""
    ends = State((0, 0), (0, 0)), State((6, 0), (0, 0))
    zone, engine = KeepOut((2.61, -0.244), 0.7025), Engine(0.3552, exhaust_velocity=10.0)
    problem = TransferProblem(1.0, *ends, 18.62, constraints=[zone], actuator=engine, objective=Fuel())
    one, other = (dmoc.solve(problem, *mesh, structure=True).raise_for_status() for mesh in ((4, 40), (6, 16)))
    assert PARTLY in [arc.kind for arc in from_plain(one.arcs)]
    assert one.objective == pytest.approx(other.objective, rel=1e-9) and dmoc.verify(one).ok


def test_a_path_that_a_zone_would_have_to_hold_is_no_answer():
    """With its multipliers turned round the zone pulls the path to its surface."""
    found = dmoc.solve(scene(), 4, 20, structure=True).raise_for_status()
    arcs, at = from_plain(found.arcs), 2
    rows = next(key for key in found.legs[at].path.multipliers if key.group.startswith("followed"))
    found.legs[at].path.multipliers[rows] *= -1
    assert is_pulled(arcs, found)


@pytest.mark.slow
def test_legs_of_low_order_where_those_of_high_order_hardly_end():
    """On a short way along the zone, at the speed limit, controls of order 8 took 700 iterations and no end."""
    scene = TransferProblem(
        1.0,
        State((0.0, 0.0), (0.0, 0.0)),
        State((6.0, 0.0), (0.0, 0.0)),
        12.93753991055913,
        constraints=[
            KeepOut((3.365339008998263, 0.42579960971980524), 0.8509550226169329),
            SpeedLimit(0.6667383000416803),
        ],
        actuator=BallForce(0.21056085624188467),
    )
    found = dmoc.solve(scene, 6, 24, structure=True)
    assert len(found.legs) == 6 and found.success and dmoc.verify(found).ok
    assert found.objective == pytest.approx(0.10869572, rel=1e-6)
