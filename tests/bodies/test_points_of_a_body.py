"""Zones and speed limits for a point of a body that turns, beside its centre of mass.

A rod with its tip 0.8 m ahead of the centre passes a sphere: the centre is never within half a metre of it,
while the tip would sweep through it.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dmoc import (
    ApproachCone,
    Attitude,
    KeepIn,
    KeepOut,
    Pose,
    SpeedLimit,
    State,
    Thrusters,
    Torque,
    TransferProblem,
    Wrench,
    load,
    rotation,
    solve,
    transcribe,
    verify,
)
from dmoc.basics.quaternions import rotated, times
from dmoc.planners.numbers import Numbers
from dmoc.plots.page import figure

TIP, CENTER, RADIUS = (0.8, 0.0, 0.0), np.array([1.5, 0.95, 0.05]), 0.4
J, MASS = np.array([0.02, 0.5, 0.5]), 2.0
BALL = KeepOut(CENTER, RADIUS, point=TIP)


def rod(*constraints, **more):
    more = {"actuator": Wrench(), "inertia": J, "duration": 6.0} | more
    goal = Pose((3, 0, 0), attitude=rotation((0, 0, 1), 170))
    return TransferProblem(MASS, Pose((0, 0, 0)), goal, constraints=constraints, **more)


def swept(position, attitude, point=TIP):
    return position + rotated(attitude, np.broadcast_to(point, position.shape))


def flown(solution):
    """Position and attitude by Newton's and Euler's equations, under the polynomials of the controls."""

    def slope(t, y, u, begin, h):
        v, q, w = y[3:6], y[6:10], y[10:]
        s = (t - begin) / h
        force, torque = np.split(
            (1 - 3 * s + 2 * s * s) * u[0] + 4 * (s - s * s) * u[1] + (2 * s * s - s) * u[2], 2
        )
        pushed = rotated(q, force) / MASS
        return np.concatenate([v, pushed, times(q, np.append(0.0, w)) / 2, (torque - np.cross(w, J * w)) / J])

    y, places = np.concatenate([np.zeros(6), [1.0, 0, 0, 0], np.zeros(3)]), []
    ends = solution.end_times
    for k, (begin, end) in enumerate(pairwise(ends)):
        given = solution.path.control[2 * k : 2 * k + 3], begin, end - begin
        within = np.linspace(begin, end, 5)
        found = solve_ivp(slope, (begin, end), y, "DOP853", within, args=given, rtol=1e-10, atol=1e-12).y
        y = found[:, -1]
        places.append(found.T)
    places = np.concatenate(places)
    return places[:, :3], places[:, 6:10]


def test_the_tip_of_a_rod_passes_a_sphere():
    """By an independent integrator the tip keeps 0.4 m to 1e-6, where a zone of the centre lets it go in."""
    centre = solve(rod(KeepOut(CENTER, RADIUS)), steps=30)
    through = np.linalg.norm(swept(centre.position, centre.attitude) - CENTER, axis=1).min()
    assert through < 0.5 * RADIUS < RADIUS < np.linalg.norm(centre.position - CENTER, axis=1).min()
    found = solve(rod(BALL), steps=60).raise_for_status()
    assert verify(found).ok and found.objective > centre.objective
    place, attitude = flown(found)
    apart = np.linalg.norm(swept(place, attitude) - CENTER, axis=1)
    assert abs(apart.min() - RADIUS) < 1e-6


def test_a_path_through_the_zone_is_found_by_the_check():
    """At the nodes and, where the tip leaps the sphere from one node to the next, between them."""
    right = solve(rod(), steps=30)
    report = verify(right, rod(BALL))
    assert not report["bounds"].ok and "KeepOut 1" in report["bounds"].note
    depth = RADIUS - np.linalg.norm(swept(right.position, right.attitude) - CENTER, axis=1).min()
    assert report["bounds"].value == pytest.approx(depth, rel=0.05)
    tips = swept(right.position, right.attitude)
    between = KeepOut(0.5 * (tips[30] + tips[31]), 0.4 * np.linalg.norm(tips[31] - tips[30]), point=TIP)
    told = verify(right, rod(between))["bounds"]
    assert not told.ok and "KeepOut 1 between nodes" in told.note


@pytest.mark.parametrize(
    "limit, most",
    [
        (KeepIn((-1, -1, -1), (4, 0.7, np.inf), point=TIP), lambda tip, speed: tip[:, 1].max() - 0.7),
        (SpeedLimit(0.5, point=TIP), lambda tip, speed: speed.max() - 0.5),
        (
            ApproachCone((-0.5, 0, 0), (1, 0, 0), 0.3, point=TIP),
            lambda tip, speed: (np.hypot(*tip.T[1:]) - np.tan(0.3) * (tip[:, 0] + 0.5)).max(),
        ),
    ],
)
def test_other_limits_act_on_the_tip(limit, most):
    """Each is broken by the free path, and met by the tip, by its nodes and their differences in time."""

    def excess(solution):
        tip = swept(solution.position, solution.attitude)
        rates, speeds = solution.rate, solution.velocity
        moving = speeds + rotated(solution.attitude[::2], np.cross(rates, TIP))
        return most(tip, np.linalg.norm(moving, axis=1))

    problem = rod()
    assert excess(solve(problem, steps=30)) > 0.01
    found = solve(replace(problem, constraints=[limit]), steps=30).raise_for_status()
    assert verify(found).ok and abs(excess(found)) < 2e-3


def test_a_point_has_numbers_that_may_change_without_a_rebuild(tmp_path):
    nlp = transcribe(rod(BALL), 30, 4)
    known = {number.name for number in Numbers.of(nlp).kept}
    assert {"keep_out_1_center", "keep_out_1_radius", "keep_out_1_point"} <= known
    shorter = rod(KeepOut(CENTER, RADIUS, point=(0.6, 0, 0)))
    found = nlp.solve(shorter)
    assert verify(found, shorter).ok
    with pytest.raises(ValueError, match="another constraints"):
        nlp.solve(rod(KeepOut(CENTER, RADIUS)))
    found.save(tmp_path / "tip.nc")
    assert verify(load(tmp_path / "tip.nc"), shorter).ok


def test_words_and_refusals_speak_of_the_point():
    assert BALL.words() == "stays 0.4 m away from (1.5, 0.95, 0.05) m with its point (0.8, 0, 0) m"
    assert KeepOut(CENTER, RADIUS, point=(0, 0, 0)) == KeepOut(CENTER, RADIUS)
    with pytest.raises(ValueError, match=r"start breaks KeepOut .* with its point"):
        rod(KeepOut((0.8, 0, 0), 0.1, point=TIP))
    with pytest.raises(ValueError, match="three entries"):
        KeepOut(CENTER, RADIUS, point=(0.8, 0))
    ends = State((0, 0, 0), (0, 0, 0)), State((3, 0, 0), (0, 0, 0))
    with pytest.raises(ValueError, match="which only a body that turns has"):
        TransferProblem(1.0, *ends, 6.0, constraints=[BALL])
    ends = Attitude((1, 0, 0, 0)), Attitude(rotation((0, 0, 1), 90))
    with pytest.raises(ValueError, match="attitudes alone"):
        TransferProblem(1.0, *ends, 6.0, actuator=Torque(), inertia=J, constraints=[BALL])


def test_zones_of_a_point_give_way_as_those_of_the_centre_do():
    """The point stays; walls move by metres, a sphere shrinks by the root of its row."""
    wall = KeepIn((-9, -9, -9), (2.0, np.inf, 9), point=TIP)
    assert wall.eased(0.2) == KeepIn((-9.2, -9.2, -9.2), (2.2, np.inf, 9.2), point=TIP)
    assert wall.needs(wall.eased(0.2), 1, "0.2 m") == "constraint 1, KeepIn, to give way by 0.2 m"
    assert BALL.eased(0.19) == KeepOut(CENTER, RADIUS * 0.9, point=TIP)


def test_the_path_of_the_point_is_drawn():
    page = figure(solve(rod(BALL), steps=20))
    lines = {line.get_label(): line for axes in page.axes for line in axes.lines}
    drawn = np.array(lines["path of point (0.8, 0, 0) m"].get_data_3d()).T
    assert drawn[0] == pytest.approx(TIP) and np.ptp(drawn, axis=0)[1] > 0.5


def tip_in_a_turn(limit, steps, order=2, actuator=None):
    """A turn of 170 degrees in place; the arm of 5 m sweeps 14.8 m in 5 s, 2.97 m/s on average."""
    ends = Pose((0, 0, 0)), Pose((0, 0, 0), attitude=rotation((0, 0, 1), 170))
    limits = [SpeedLimit(limit, point=(5, 0, 0))]
    body = {"actuator": actuator or Wrench(), "inertia": J, "constraints": limits}
    return solve(TransferProblem(3.0, *ends, 5.0, **body), steps=steps, order=order)


@pytest.mark.parametrize("limit", [3.03, 3.26])
def test_a_speed_of_the_tip_that_is_broken_between_coarse_steps_is_found(limit):
    """The rows hold at the Gauss points of 8 steps; at those of 40 steps of order 4 they hold everywhere."""
    coarse = tip_in_a_turn(limit, 8).raise_for_status()
    told = verify(coarse)["bounds"]
    assert not told.ok and "SpeedLimit 1" in told.note and told.value > 0.03 * limit
    fine = tip_in_a_turn(limit, 40, 4).raise_for_status()
    rates = rotated(fine.attitude[::2], np.cross(fine.rate, (5.0, 0, 0)))
    assert np.linalg.norm(fine.velocity + rates, axis=1).max() < 1.01 * limit
    assert verify(fine)["bounds"].ok


@pytest.mark.parametrize("steps, order", [(6, 2), (3, 4)])
def test_a_speed_of_the_tip_that_no_path_keeps_is_never_solved(steps, order):
    """The body can only turn about its centre, so that the tip must be faster than on average."""
    assert not tip_in_a_turn(2.9, steps, order, Torque()).success


def test_a_limit_of_the_tip_that_hardly_acts_leaves_the_centre_in_place():
    """The centre then moves by errors of the optimiser alone, which are no extent to judge by."""
    ends = Pose((0, 0, 0)), Pose((0, 0, 0), attitude=rotation((0, 0, 1), 170))
    limits = [SpeedLimit(3.857, point=(0, 5, 2))]
    found = solve(
        TransferProblem(3.0, *ends, 5.0, actuator=Wrench(), inertia=J, constraints=limits), steps=40, order=4
    )
    assert verify(found).ok and 0 < found.path.diagonal < 1e-5


def test_a_body_that_couples_turn_in_place_is_integrated_all_the_same():
    """Its centre moves by rounding alone, which is no extent that errors could be measured by."""
    arms = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    ways = [(0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (1, 0, 0), (-1, 0, 0)]
    pairs = Thrusters(arms * 2, [*ways, *[tuple(-x for x in way) for way in ways]], 1.0)
    turned = Pose((0, 0, 0), attitude=rotation((1, 1, 1), 120))
    problem = TransferProblem(3.0, Pose((0, 0, 0)), turned, 5.0, inertia=(1.0, 2.0, 2.8), actuator=pairs)
    found = solve(problem, order=8, steps=12)
    assert found.success and found.path.diagonal < 1e-12
    assert not [check for check in verify(found).checks if not check.ok]
