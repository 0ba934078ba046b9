"""Structures that look right but are not: a limit that is missing beside a touch, a zone cut between nodes."""

from __future__ import annotations

import numpy as np
import pytest

import dmoc
from dmoc import BallForce, Effort, Engine, Fuel, KeepOut, State, TransferProblem
from dmoc.plots.style import within_steps
from dmoc.structure.arcs import from_plain
from dmoc.structure.modes import FREE

FULL = "full force"


def past(zones, duration, mass, actuator, objective):
    ends = State((0, 0), (0, 0)), State((6, 0), (0, 0))
    zones = [KeepOut(*zone) for zone in zones]
    return TransferProblem(mass, *ends, duration, constraints=zones, actuator=actuator, objective=objective)


def clearance(solution, zone):
    """The least distance from a zone, within steps too."""
    paths = [within_steps(leg, leg.position)[1] for leg in solution.legs]
    return min(np.linalg.norm(path - np.array(zone.center), axis=1).min() for path in paths) - zone.radius


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


@pytest.mark.parametrize("mesh", [(4, 40), (6, 16)])
def test_a_coast_that_cuts_a_zone_beside_its_joint_touches_it_instead(mesh):
    """A coast came to the zone from inside, by 2.7 mm between its nodes, and cost 9e-4 less than may be."""
    problem = past([((2.61, -0.244), 0.7025)], 18.62, 1.0, Engine(0.3552, exhaust_velocity=10.0), Fuel())
    found = dmoc.solve(problem, *mesh, structure=True).raise_for_status()
    assert len(found.legs) in (7, 8) and dmoc.verify(found).ok
    assert clearance(found, problem.constraints[0]) > -1e-9
