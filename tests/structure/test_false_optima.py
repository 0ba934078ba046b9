"""Structures that look right but are not: a limit that is missing beside a touch, a zone cut between nodes."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import dmoc
from dmoc import BallForce, Effort, Engine, Fuel, KeepOut, SpeedLimit, State, Time, TransferProblem
from dmoc.motion.path import DiscretePath
from dmoc.scene.problem_file import load_problem
from dmoc.structure.arcs import from_plain
from dmoc.structure.modes import FREE
from dmoc.structure.surfaces import _surfaces, pierced

FULL = "full force"


def past(zones, duration, mass, actuator, objective):
    ends = State((0, 0), (0, 0)), State((6, 0), (0, 0))
    zones = [KeepOut(*zone) for zone in zones]
    return TransferProblem(mass, *ends, duration, constraints=zones, actuator=actuator, objective=objective)


@pytest.mark.parametrize("mesh", [(4, 30), (2, 40), (6, 24)])
def test_full_force_on_both_sides_of_a_touch_is_found(mesh):
    """The force would be largest at the touch alone, which costs 3e-4 more: its limit acts around that."""
    zones = [((1.75, -0.185), 0.828), ((4.313, 0.331), 0.78)]
    problem = past(zones, 13.65, 4.697, BallForce(1.0545), Effort())
    found = dmoc.solve(problem, *mesh, structure=True).raise_for_status()
    assert [arc.kind for arc in from_plain(found.arcs)] == [
        FULL,
        FREE,
        FULL,
        FULL,
        FREE,
        FULL,
        FULL,
        FREE,
        FULL,
    ]
    dense = dmoc.solve(problem, 4, 480, guess=found)
    assert found.objective == pytest.approx(dense.objective, rel=2e-5) and dmoc.verify(found).ok


def test_a_way_at_a_speed_around_a_zone_is_right_between_nodes_too():
    """On two steps of order 4 a leg is flown exactly, but its speed between the nodes was 8e-5 too high."""
    ends, lasts = (State((0, 0), (0, 0)), State((6, 0), (0, 0))), 9.179835438632743
    limits = [KeepOut((3.0494477749847118, -0.12041253464345669), 0.8532273729756097)]
    limits.append(SpeedLimit(0.8078952066831727))
    problem = TransferProblem(1.0, *ends, lasts, constraints=limits)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = dmoc.solve(problem, 4, 40, structure=True).raise_for_status()
    assert len(found.legs) == 4 and dmoc.verify(found)["bounds"].value < 1e-5
    # The speed at the touch between two ways at the limit is stated once: twice, its multiplier was 2e8.
    ends = [value for leg in found.legs for key, value in leg.path.multipliers.items() if key.kind == "end"]
    assert max(np.abs(value).max() for value in ends) < 1e3
    dense = dmoc.solve(problem, 4, 480, guess=found)
    assert found.objective == pytest.approx(dense.objective, rel=2e-6)


def test_a_zone_that_is_cut_beside_a_joint_is_broken_there_unless_the_joint_touches_it():
    """A coast along y = 0 from a joint on a circle, through this, and out of it inside the leg."""
    problem = past([((1.0, 0.0), 0.5)], 4.0, 1.0, Engine(1.0, exhaust_velocity=10.0), Fuel())
    (surface,) = _surfaces(problem)
    at = np.linspace(0.0, 1.0, 9)
    path = DiscretePath(
        mesh=at,
        order=2,
        hold=False,
        duration=4.0,
        position=np.stack([0.5 + 2.0 * at, 0 * at], axis=1),
        control=np.zeros((9, 0)),
        mass=np.ones(9),
        start_velocity=np.array([0.5, 0.0]),
        goal_velocity=np.array([0.5, 0.0]),
    )
    assert [found for _, found in pierced(problem, path, 0.0, ((), ()))] == [surface]
    assert not pierced(problem, path, 0.0, ((surface,), ())) and not pierced(problem, path, 0.0)


@pytest.mark.parametrize("mesh", [(4, 30), (2, 60)])
def test_least_time_in_a_plane_at_a_speed_limit_has_all_digits(mesh):
    """Where no cost says how the force turns at that speed, it is a polynomial: else it chatters."""
    ends, speed, force = (State((0, 0), (0, 0)), State((4, 3), (0, 0))), 0.8, 0.9
    problem = TransferProblem(
        1.0, *ends, (1.0, 30.0), constraints=[SpeedLimit(speed)], actuator=BallForce(force), objective=Time()
    )
    found = dmoc.solve(problem, *mesh, structure=True).raise_for_status()
    assert [arc.kind for arc in from_plain(found.arcs)] == [FULL, FREE, FULL]
    assert found.duration == pytest.approx(5 / speed + speed / force, rel=1e-9)
    assert sum(level.iterations * level.steps for level in found.ladder) < 4000


def test_a_goal_at_the_apex_of_its_cone_is_stated_once():
    """As a row of the goal and as one of the cone its multipliers grew without bound: 37 s for `formation`."""
    problem = load_problem("formation").make()
    found = dmoc.solve(problem, 4, 30, structure=True).raise_for_status()
    assert len(found.legs) == 3 and found.objective == pytest.approx(4.0624843982, rel=1e-9)
    goal = found.path.forces["goal"]
    assert np.abs(goal).max() < 1e3 * np.abs(found.legs[-1].costate[-1]).max()
    assert sum(level.iterations for level in found.ladder) < 250


def test_a_graze_of_a_zone_in_the_coarse_answer_is_cut_and_no_other_way_is_tried():
    found = dmoc.solve(load_problem("free_flyer").make(), 4, 15, structure=True).raise_for_status()
    assert len(found.legs) == 4 and len(found.ladder) <= 5
