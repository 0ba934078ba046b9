"""What a path cuts off its limits between the nodes counts in the error of an answer to a tolerance."""

from dataclasses import replace

import numpy as np
import pytest

from dmoc import (
    Apart,
    Attitude,
    BallTorque,
    Effort,
    KeepIn,
    KeepOut,
    Leg,
    Mission,
    PointingKeepOut,
    SpeedLimit,
    State,
    Team,
    TransferProblem,
    Via,
    rotation,
    solve,
    verify,
)
from dmoc.meshes.cut_off import cut_off
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.path import POSITION_BOUNDS


def rest(*place):
    return State(place, (0.0,) * len(place))


ZONES = [KeepOut((2.14, 0.109, -0.56), 0.765), KeepOut((4.284, 0.475, -0.345), 0.72)]


def thrown(limit):
    return TransferProblem(1.0, State((0, 0), (0.2, 1.0)), State((2, 0), (0.3, -1.0)), 2.0, constraints=[limit])


SCENES = {
    "two spheres": (TransferProblem(7.2, rest(0, 0, 0), rest(6, 0, 0), 9.17, constraints=ZONES), 4, 20),
    "a wall": (thrown(KeepIn((-5, -5), (5, 0.2))), 4, 11),
    "a speed": (TransferProblem(1.0, rest(0, 0), rest(3, 1), 3.0, constraints=[SpeedLimit(1.3)]), 8, 12),
    "a cone": (
        TransferProblem(
            2.0,
            Attitude((1, 0, 0, 0)),
            Attitude(rotation((0, 0, 1), 60)),
            6.0,
            actuator=BallTorque(1.0),
            objective=Effort(),
            inertia=np.diag([1.0, 2.0, 1.5]),
            constraints=[PointingKeepOut((1, 0, 0), (np.cos(0.5), np.sin(0.5), 0.2), 12.0)],
        ),
        4,
        10,
    ),
}


def lacks(found):
    """What the limits would cost that an answer cuts off between its nodes."""
    return cut_off(found.problem, Dynamics.of(found.problem), found.path, found.problem.start_time).cost


@pytest.mark.parametrize("name", SCENES)
def test_it_is_worth_what_the_objective_lacks(name):
    problem, order, steps = SCENES[name]
    coarse = solve(problem, order=order, steps=steps, structure=False).raise_for_status()
    fine = solve(problem, order=4, steps=160, structure=False).raise_for_status()
    lost = fine.objective - coarse.objective
    # The optimum lies between the objective of the fine mesh and that with what it lacks.
    assert 0 < lost <= 1.1 * lacks(coarse) and lacks(coarse) <= 2 * (lost + lacks(fine))


@pytest.mark.parametrize("tol", [1e-4, pytest.param(1e-6, marks=pytest.mark.slow)])
def test_two_meshes_that_share_the_node_at_a_zone_do_not_tell_their_error(tol):
    """The first two are off by 1.5e-5 and differ by 1e-10. Arcs that touch the zones have the optimum."""
    problem, *_ = SCENES["two spheres"]
    exact = solve(problem, order=4, steps=40, structure=True).raise_for_status()
    assert len(exact.legs) > 1
    # Between its nodes the path is inside a zone for less than an eighth of a gap.
    coarse = solve(problem, order=4, steps=20, structure=False).raise_for_status()
    assert 0 < exact.objective - coarse.objective <= lacks(coarse)
    found = solve(problem, tol=tol, structure=False).raise_for_status()
    # Ipopt meets its rows to 1e-8.
    assert abs(found.objective / exact.objective - 1) <= found.error.objective + 1e-8
    assert found.error.largest <= tol and verify(found).ok


def test_of_a_mission_it_counts_in_all_legs():
    problem, *_ = SCENES["two spheres"]
    legs = [Leg(2.5), Via((0.3, 0.15, 0.05)), Leg(6.67)]
    mission = Mission(problem.mass, problem.start, problem.goal, legs, constraints=ZONES)
    found, fine = (solve(mission, tol=tol, structure=False).raise_for_status() for tol in (1e-4, 1e-6))
    assert abs(found.objective / fine.objective - 1) <= found.error.objective


def test_of_a_team_the_distances_count_that_bodies_keep():
    """One body along x and one across its way: two meshes share the node at which they touch."""
    members = [
        TransferProblem(1.7326, rest(0, 0, 0), rest(6, 0, 0), 8.0),
        TransferProblem(1.0, rest(2.8699, -2.6023, 0), rest(3.9484, 3.3442, 0), 8.0),
    ]
    team = Team(members, together=[Apart(1.3494)])
    found, fine = (solve(team, tol=tol, structure=False).raise_for_status() for tol in (1e-3, 1e-6))
    assert 1e-5 < abs(found.objective / fine.objective - 1) <= found.error.objective


def test_what_holds_the_ends_of_a_path_is_no_limit():
    """Bounds on the positions of the ends have multipliers that say what other ends would be worth."""
    problem, order, steps = SCENES["a wall"]
    path = solve(problem, order=order, steps=steps).raise_for_status().path
    outside = path.position.copy()
    outside[:3, 1] += 0.5
    path = replace(path, position=outside)
    dearer = dict(path.multipliers)
    dearer[POSITION_BOUNDS] = dearer[POSITION_BOUNDS].copy()
    dearer[POSITION_BOUNDS][[0, -1]] += 100.0
    dynamics = Dynamics.of(problem)
    costs = [cut_off(problem, dynamics, one, 0.0).cost for one in (path, replace(path, multipliers=dearer))]
    assert costs[0] == costs[1]
