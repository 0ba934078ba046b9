"""Answers by their structure: the digits that arcs with free ends give, and how they may deceive."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import dmoc
from dmoc import (
    BallForce,
    BoxForce,
    Engine,
    Fuel,
    KeepIn,
    Leg,
    Mission,
    SpeedLimit,
    State,
    Time,
    TransferProblem,
    UniformGravity,
)
from dmoc.missions.answer import answered
from dmoc.missions.checks import verify_mission
from dmoc.missions.climb import Climb, solve_mission
from dmoc.scene.problem_file import load_problem
from dmoc.structure import solve as structure
from dmoc.structure.arcs import BURN, COAST, SINGULAR, Arc, _merged, arcs_of, from_plain, surely_seen
from dmoc.structure.build import mission_of, path_of
from dmoc.structure.coarse import coarse_answer
from dmoc.structure.improve import improved, not_turned_round
from dmoc.structure.modes import FREE
from dmoc.structure.solve import NEAR, solve_by_structure
from dmoc.structure.surfaces import Surface

# Two local optima of the free-flyer, on either side of the obstacles.
FREE_FLYER = (0.8368975590572365, 0.8624183666704004)


def gallery(name):
    return load_problem(name).make()


def bryson_denham():
    """From x = 0, v = 1 to x = 0, v = -1 in 1 s below x = 1/9: a third of the time at the limit, J = 4."""
    wall = KeepIn((-np.inf,), (1 / 9,))
    return TransferProblem(1.0, State((0.0,), (1.0,)), State((0.0,), (-1.0,)), 1.0, constraints=[wall])


def kinds(found):
    return [arc[0] for arc in found.arcs]


def test_seven_legs_of_the_least_fuel():
    found = dmoc.solve(gallery("two_body_fuel"), structure=True)
    assert found.success and kinds(found) == [BURN, COAST, BURN, COAST, BURN, COAST, BURN]
    assert found.objective == pytest.approx(0.0767810992549, rel=1e-10)
    assert found.reason.startswith("7 legs: burn 0.07165 s, coast 4.374 s, burn 0.9329 s")
    assert dmoc.verify(found).ok


@pytest.mark.parametrize(("order", "steps"), [(4, 20), (4, 40), (2, 40)])
def test_three_touches_of_the_free_flyer(order, steps):
    found = dmoc.solve(gallery("free_flyer"), order, steps, structure=True)
    assert found.success and len(found.legs) == 4
    assert min(abs(found.objective / value - 1) for value in FREE_FLYER) < 1e-11
    assert dmoc.verify(found).ok
    # At a touch the path is on the sphere and along it.
    for leg, zone in zip(found.legs, found.problem.constraints, strict=False):
        offset = leg.position[-1] - np.array(zone.center)
        assert np.linalg.norm(offset) == pytest.approx(zone.radius, abs=1e-8)
        assert offset @ leg.velocity[-1] == pytest.approx(0.0, abs=1e-10)


def test_a_singular_arc_has_one_polynomial_for_its_force():
    found = dmoc.solve(gallery("goddard"), structure=True)
    assert found.success and kinds(found) == [BURN, SINGULAR, COAST]
    assert found.objective == pytest.approx(1.012836918, rel=1e-9)
    leg = found.legs[1].path
    polynomial = np.polynomial.Polynomial.fit(leg.fractions, leg.control[:, 0], 6)
    assert polynomial(leg.fractions) == pytest.approx(leg.control[:, 0], abs=1e-9)
    assert dmoc.verify(found).ok


@pytest.mark.parametrize(("order", "steps"), [(4, 10), (4, 20), (2, 60), (8, 12), (8, 25)])
def test_a_way_along_a_limit(order, steps):
    found = dmoc.solve(bryson_denham(), order, steps, structure=True)
    assert found.success and len(found.legs) == 3
    assert found.objective == pytest.approx(4.0, rel=1e-12)
    assert found.legs[1].position == pytest.approx(1 / 9, abs=1e-14)
    assert dmoc.verify(found).ok


@pytest.mark.slow
def test_a_halo_orbit_left_and_another_reached():
    found = dmoc.solve(gallery("halo_transfer"), structure=True)
    assert found.success and len(found.legs) == 7
    assert found.final_mass == pytest.approx(0.984537, abs=5e-7)
    assert dmoc.verify(found).ok


@pytest.mark.slow
def test_five_burns_whose_begins_hardly_matter():
    found = dmoc.solve(gallery("leo_raise"), structure=True)
    assert found.success and kinds(found) == [COAST, BURN] * 5
    # 48 steps of order 6 and 32 of order 8 agree to 2e-7 kg.
    assert found.objective == pytest.approx(6.6802297, abs=5e-7)
    assert dmoc.verify(found).ok


def test_arcs_shorter_than_from_node_to_node_are_not_seen_for_sure():
    coarse = dmoc.solve(gallery("two_body_fuel"), order=4, steps=20)
    ends = [(BURN, 0.2), (COAST, 0.5), (BURN, 0.51), (COAST, 0.7), (BURN, 1.0)]
    seen = surely_seen(tuple(Arc(*end) for end in ends), coarse)
    assert [(arc.kind, arc.end) for arc in seen] == [(BURN, 0.2), (COAST, 0.7), (BURN, 1.0)]


@pytest.mark.slow
def test_thirteen_legs_to_dionysus():
    found = dmoc.solve(gallery("dionysus"), structure=True)
    assert found.success and len(found.legs) == 13
    assert found.objective == pytest.approx(2718.3396, abs=2e-4)
    assert dmoc.verify(found).ok


DOZEN = [
    (4, 30),
    (4, 40),
    (4, 50),
    (4, 60),
    (4, 80),
    (4, 100),
    (2, 60),
    (2, 100),
    (2, 150),
    (6, 30),
    (6, 40),
    (8, 25),
]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "values", "meshes"),
    [
        ("two_body_fuel", [0.0767810992549], DOZEN),
        ("bang_bang", [2.0], DOZEN),
        ("drone_hop", [211.4604945825], DOZEN),
        ("earth_mars", [3.3192202779], DOZEN),
        ("hovercraft", [10.9747903356], DOZEN),
        (
            "free_flyer",
            FREE_FLYER,
            [(4, 15), (4, 20), *DOZEN[:5], (2, 20), (2, 40), (2, 100), (6, 20), (8, 12)],
        ),
        (
            "goddard",
            [1.012836918308],
            [(2, n) for n in (40, 50, 60, 70, 80, 100, 120, 150, 200, 250, 300, 400)],
        ),
    ],
)
def test_a_dozen_coarse_meshes_lead_to_the_same_digits(name, values, meshes):
    found = [dmoc.solve(gallery(name), *mesh, structure=True) for mesh in meshes]
    errors = [min(abs(one.objective / value - 1) for value in values) for one in found]
    assert dict(zip(meshes, errors, strict=True)) == pytest.approx(dict.fromkeys(meshes, 0.0), abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("order", "steps"), [(2, (40, 80)), (4, (10, 20)), (6, (4, 8)), (8, (3, 6))])
def test_the_order_of_the_scheme_across_free_switches(order, steps):
    exact = dmoc.solve(gallery("two_body_fuel"), tol=1e-10, structure=True)
    errors = []
    for count in steps:
        found = solve_mission(exact.problem, order, count, guess=exact)
        assert found.success
        errors.append(abs(found.objective / exact.objective - 1))
    assert np.log2(errors[0] / errors[1]) > order - 0.3


# What deceives: the wrong answer comes out red, or is not reached.


@pytest.mark.slow
def test_steps_too_long_for_a_coast_past_a_moon_come_out_red():
    """Free durations let a coarse mesh cheat: the coast past the Moon is no path of the motion."""
    problem = gallery("halo_transfer")
    fine = dmoc.solve(problem, structure=True)
    uniform = [(np.linspace(0, 1, 9 if leg.duration > 1 else 3), 4) for leg in fine.legs]
    climb = Climb(fine.problem, None, None, False, None)
    attempt = climb.attempt(fine.path.onto(uniform), most=300, near=NEAR[0])
    cheat = answered(climb, attempt)
    assert not attempt.solved or not verify_mission(cheat)["reference"].ok


def test_a_way_along_a_limit_is_undercut_at_order_2_alone():
    """Forces at nodes undercut its cost, and it shrinks to its shortest duration."""
    found = dmoc.solve(bryson_denham(), structure=True)
    assert min(leg.order for leg in found.legs) >= 4
    rough = [solve_mission(found.problem, 2, count, guess=found) for count in (10, 20)]
    assert all(one.objective < 4.0 and one.legs[1].duration < 2e-4 for one in rough)
    assert np.log2((4.0 - rough[0].objective) / (4.0 - rough[1].objective)) > 1.7
    for order in (4, 6, 8):
        assert solve_mission(found.problem, order, 10, guess=found).objective == pytest.approx(4.0, rel=1e-12)


def sped(limit, duration, **more):
    """One metre from rest to rest, never faster than a limit."""
    ends = State((0.0,), (0.0,)), State((1.0,), (0.0,))
    return TransferProblem(1.0, *ends, duration, constraints=[SpeedLimit(limit)], **more)


@pytest.mark.parametrize(("order", "steps"), [(4, 20), (2, 60), (8, 12)])
def test_the_least_effort_below_a_speed_is_exact(order, steps):
    """The force falls linearly to zero where the speed is reached: 2 v / (3 t) is what is lost of the way."""
    found = dmoc.solve(sped(1.2, 1.0), order, steps, structure=True)
    rising = 1.5 * (1 - 1 / 1.2)
    assert found.success and found.reason == "3 legs: arc 0.25 s, along a limit 0.5 s, arc 0.25 s"
    assert found.legs[0].duration == pytest.approx(rising, rel=1e-9)
    assert found.objective == pytest.approx((2 * 1.2 / rising) ** 2 * rising / 3, rel=1e-12)
    assert found.legs[1].velocity == pytest.approx(1.2, abs=1e-12)
    assert found.legs[1].path.control[:, 0] == pytest.approx(0.0, abs=1e-9)
    assert dmoc.verify(found).ok


@pytest.mark.parametrize(("order", "steps"), [(4, 20), (2, 60)])
def test_the_least_time_below_a_speed_is_exact(order, steps):
    problem = sped(0.6, (0.1, 10.0), actuator=BoxForce(1.0), objective=Time())
    found = dmoc.solve(problem, order, steps, structure=True)
    assert found.success and kinds(found) == ["+x", FREE, "-x"]
    assert [leg.duration for leg in found.legs] == pytest.approx([0.6, 1 / 0.6 - 0.6, 0.6], rel=1e-12)
    assert found.objective == pytest.approx(1 / 0.6 + 0.6, rel=1e-13)
    assert dmoc.verify(found).ok


def test_a_speed_and_a_force_at_their_limits_in_the_plane():
    ends = State((0, 0), (0, 0)), State((1, 0.5), (0, 0))
    limits = {"actuator": BallForce(3.5), "constraints": [SpeedLimit(0.95)]}
    problem = TransferProblem(1.0, *ends, 1.5, effects=[UniformGravity((0, -1))], **limits)
    found = dmoc.solve(problem, structure=True)
    assert found.success and kinds(found) == ["full force", FREE, FREE, FREE, "full force"]
    # The forces of both sides are alike where the speed is reached, and where it is left.
    for one, two in zip(found.legs[1:3], found.legs[2:4], strict=True):
        assert two.path.control[0] == pytest.approx(one.path.control[-1], abs=1e-9)
    speed = np.linalg.norm(found.legs[2].velocity, axis=1)
    # It is kept to at the Gauss points of the steps; the speeds at their ends come from momenta.
    assert speed == pytest.approx(0.95, abs=1e-6)
    assert found.objective == pytest.approx(dmoc.solve(problem, tol=1e-5, structure=False).objective, rel=1e-5)
    assert dmoc.verify(found).ok


def test_a_speed_that_is_not_reached_makes_no_leg():
    assert not hasattr(dmoc.solve(sped(1.6, 1.0), structure=True), "legs")


def test_an_empty_leg_is_dropped():
    ends = State((0, 0), (0, 0)), State((1, 0.5), (0, 0))
    engine = Engine(1.0, exhaust_velocity=5.0, smoothing=1e-6)
    pull = [UniformGravity((0, -0.1))]
    problem = TransferProblem(1.0, *ends, 4.0, actuator=engine, effects=pull, objective=Fuel())
    found = dmoc.solve(problem, structure=True)
    known = from_plain(found.arcs)
    assert kinds(found) == [BURN, COAST, BURN]
    # A burn where nothing is to be gained by one shrinks to its shortest duration. The coast before it has its
    # length: an empty burn may else stand anywhere.
    middle = 0.5 * (known[0].end + known[1].end)
    arcs = (known[0], known[1]._replace(end=middle), Arc(BURN, middle + 0.003), *known[1:])
    mission = mission_of(problem, arcs)
    coast = replace(mission.legs[1], duration=4.0 * (middle - known[0].end))
    mission = replace(mission, legs=[mission.legs[0], coast, *mission.legs[2:]])
    climb = Climb(mission, None, None, False, None)
    attempt = climb.attempt(path_of(problem, arcs, found.legs), near=NEAR[0])
    assert attempt.solved
    assert [arc.kind for arc in improved(problem, arcs, answered(climb, attempt))] == kinds(found)


def test_a_burn_that_is_missing_is_found_by_the_switching_function():
    problem = gallery("two_body_fuel")
    # 60 steps of order 2 show two of the four burns.
    coarse = coarse_answer(problem, 2, 60)
    assert len(arcs_of(coarse)) == 4
    found = dmoc.solve(problem, 2, 60, structure=True)
    assert len(found.legs) == 7 and dmoc.verify(found).ok


def test_touches_without_tangency_lead_through_the_zones():
    """Their times slide away from where the path would be in the zone, and it runs through between nodes."""
    found = dmoc.solve(gallery("free_flyer"), structure=True)
    loose = replace(found.problem, legs=[part for part in found.problem.legs if isinstance(part, Leg)])
    through = solve_mission(loose, 4, 4, guess=found)
    assert through.objective < found.objective - 1e-3
    assert not verify_mission(through)["bounds"].ok


def test_a_file_holds_the_structure(tmp_path):
    problem = gallery("two_body_fuel")
    found = dmoc.solve(problem, structure=True)
    found.save(tmp_path / "legs.nc")
    back = dmoc.load(tmp_path / "legs.nc").attach(problem)
    assert kinds(back) == kinds(found) and back.objective == found.objective
    assert [(one.name, one.value) for one in dmoc.verify(back).checks] == [
        (one.name, one.value) for one in dmoc.verify(found).checks
    ]


def test_the_structure_of_a_transfer_is_a_guess_and_gives_its_controls():
    problem = gallery("two_body_fuel")
    found = dmoc.solve(problem, tol=1e-6)
    again = dmoc.solve(problem, order=4, steps=60, guess=found)
    assert again.success and again.objective == pytest.approx(found.objective, rel=2e-3)
    flight = dmoc.simulate(problem, found)
    assert flight.position[-1] == pytest.approx(found.position[-1], abs=1e-6)
    assert flight.mass[-1] == pytest.approx(1.0 - found.objective, abs=1e-9)


def test_an_answer_of_one_arc_is_that_of_the_ordinary_ladder():
    problem = gallery("point_to_point")
    assert solve_by_structure(problem) is None
    one, other = dmoc.solve(problem), dmoc.solve(problem, structure=True)
    assert one.objective == other.objective and one.ladder[-1].steps == other.ladder[-1].steps


@pytest.mark.parametrize(
    ("numerics", "legs"),
    [
        ({"tol": 1e-7}, True),
        ({"tol": 1e-4}, False),
        ({"tol": 1e-7, "structure": False, "time_limit": 0.5}, False),
        ({"tol": 1e-7, "order": 4, "time_limit": 0.5}, False),
        ({}, False),
    ],
)
def test_a_tight_tolerance_takes_structure_by_itself(numerics, legs):
    problem = TransferProblem(
        1.0,
        State((0, 0), (0, 0)),
        State((1, 0), (0, 0)),
        4.0,
        actuator=Engine(1.0, exhaust_velocity=5.0),
        objective=Fuel(),
    )
    found = dmoc.solve(problem, **numerics)
    assert hasattr(found, "legs") == legs
    if legs:
        assert [arc.kind for arc in from_plain(found.arcs)] == [BURN, COAST, BURN]
        assert found.success and dmoc.verify(found).ok and found.tolerance == 1e-7


@pytest.mark.parametrize(("limit", "legs"), [(1.1, 3), (2.0, 0)])
def test_a_force_that_comes_to_its_limit_is_parted_by_itself(limit, legs):
    """1 m from rest to rest in 2 s takes 1.5 N at both ends, if that is allowed."""
    ends = State((0,), (0,)), State((1,), (0,))
    found = dmoc.solve(TransferProblem(1.0, *ends, 2.0, actuator=BoxForce(limit)), tol=1e-10)
    assert found.success and len(getattr(found, "legs", ())) == legs


def test_without_switches_a_tight_tolerance_is_the_ladder():
    problem = TransferProblem(1.0, State((0,), (0,)), State((1,), (0,)), 1.0)
    assert not hasattr(dmoc.solve(problem, tol=1e-8), "legs")


def test_steps_where_functions_are_not_finite_are_not_told(capfd):
    """On 30 steps Ipopt tries steps on which masses become negative."""
    dmoc.solve(gallery("goddard"), 2, 30, options={"ipopt.max_iter": 150})
    assert capfd.readouterr() == ("", "")


def test_a_box_has_arcs_by_axis():
    found = dmoc.solve(gallery("bang_bang"), 4, 20, structure=True)
    assert found.success and kinds(found) == ["+x", "-x"] and found.reason == "2 legs: +x 1 s, -x 1 s"
    assert found.objective == pytest.approx(2.0, rel=1e-14)
    assert dmoc.verify(found).ok


def test_joints_at_which_a_force_is_turned_round_can_be_taken_away():
    arcs = Arc("full force", 0.4), Arc("full force and reversed", 0.7), Arc("arc", 1.0)
    assert not_turned_round(arcs) == (Arc("full force", 0.7), Arc("arc", 1.0))
    assert not_turned_round(arcs[1:2]) == (Arc("full force", 0.7),)
    assert not_turned_round(arcs[2:]) == arcs[2:]


def test_axes_of_a_box_switch_one_at_a_time():
    """Each axis has an optimum of its own: one with full force at both ends, the other a cubic throughout."""
    ends = State((0, 0), (0, 0)), State((1.0, 0.5), (0.0, 0.3))
    problem = TransferProblem(1.0, *ends, 2.2, actuator=BoxForce((1.0, 0.6)))
    found = dmoc.solve(problem, 4, 40, structure=True)
    assert found.success and set(kinds(found)) > {"+x", "-x"}
    # x, half the way in half the time: full force for 1.1 - b, then down to none within b.
    b = np.sqrt(6 * (1.1**2 / 2 - 0.5))
    along_x = (1.1 - b) + b / 3
    along_y = 6 * 0.5**2 / 2.2**3 - 6 * 0.5 * 0.3 / 2.2**2 + 2 * 0.3**2 / 2.2
    assert found.objective == pytest.approx(along_x + along_y, rel=1e-13)
    assert dmoc.verify(found).ok


def test_a_force_that_comes_to_its_limit_goes_on_over_the_joint():
    problem = gallery("drone_hop")
    found = dmoc.solve(problem, 4, 30, structure=True)
    assert found.success and kinds(found) == ["full force", "arc"]
    # Indirect shooting: 211.4604947, to the digits given.
    assert found.objective == pytest.approx(211.4604947, abs=2e-7)
    full, rest = found.legs
    assert np.linalg.norm(full.path.control, axis=1) == pytest.approx(15.0, abs=1e-9)
    assert rest.path.control[0] == pytest.approx(full.path.control[-1], abs=1e-9)
    assert np.linalg.norm(rest.path.control, axis=1)[1:].max() < 15.0
    # Without the condition the free arc would begin earlier, above the limit.
    loose = replace(found.problem, legs=[part for part in found.problem.legs if isinstance(part, Leg)])
    other = solve_mission(loose, 4, 4, guess=found.path.as_arrays())
    assert not other.success or abs(other.legs[0].duration / full.duration - 1) > 1e-4


def test_a_missing_limit_is_found_by_its_multiplier():
    problem = gallery("drone_hop")
    found = dmoc.solve(problem, 4, 30, structure=True)
    known = (Arc(FREE, 1.0),)
    climb = Climb(mission_of(problem, known), None, None, False, None)
    attempt = climb.attempt(path_of(problem, known, found.legs), near=NEAR[0])
    assert attempt.solved
    better = improved(problem, known, answered(climb, attempt))
    assert "full force" in [arc.kind for arc in better]


def test_an_engine_that_never_stops_is_one_leg():
    found = dmoc.solve(gallery("earth_mars"), 4, 20, structure=True)
    assert found.success and kinds(found) == [BURN] and found.reason == "1 leg: burn 3.319 s"
    assert found.objective == pytest.approx(3.31922028, abs=5e-9)
    assert dmoc.verify(found).ok


@pytest.mark.slow
def test_full_thrust_through_four_gates():
    found = dmoc.solve(gallery("hovercraft"), structure=True)
    assert found.success and kinds(found) == ["full force"] * 5
    assert found.objective == pytest.approx(10.97479, abs=5e-6)
    assert dmoc.verify(found).ok


def test_nothing_keeps_a_coast_at_a_limit():
    """Where a coarse path is at a zone for three steps, and coasts there, it touches the zone."""
    surface = Surface(0, 0)
    cuts = [(COAST, 0.5), (BURN, 0.6), (COAST, 1.0)]
    arcs = _merged(cuts, [(0.49, 0.61, surface)], 0.02)
    assert all(arc.follows is None for arc in arcs) and [arc.touches for arc in arcs].count(surface) == 1
    along = _merged([(FREE, 1.0)], [(0.49, 0.61, surface)], 0.02)
    assert [arc.follows for arc in along] == [None, surface, None]


def test_a_search_for_legs_that_leads_nowhere_ends_early(monkeypatch):
    problem = gallery("two_body_fuel")
    monkeypatch.setattr(structure, "MOST_WORK", 0)
    monkeypatch.setattr(structure, "MOST_TIMES", 0)
    found = dmoc.solve(problem, 4, 30, structure=True)
    assert not hasattr(found, "legs") and found.objective == dmoc.solve(problem, 4, 30).objective


def test_what_structure_does_not_take_is_refused():
    with pytest.raises(ValueError, match="give neither hold nor mesh"):
        dmoc.solve(gallery("two_body_fuel"), hold=True, structure=True)


def test_controls_of_a_leg_as_one_polynomial():
    ends = State((0, 0), (0, 0)), State((1, 0), (0, 0))
    mission = Mission(1.0, *ends, [Leg(1.0, control_degree=1), Leg(1.0)])
    found = dmoc.solve(mission, order=4, steps=6)
    leg = found.legs[0].path
    line = np.outer(1 - leg.fractions, leg.control[0]) + np.outer(leg.fractions, leg.control[-1])
    assert found.success and leg.control == pytest.approx(line, abs=1e-9)
    with pytest.raises(ValueError, match="control_degree"):
        Leg(1.0, control_degree=-1)


def test_a_full_force_that_is_turned_round_in_the_plane():
    """Between states on one line the direction jumps: the closed form, from meshes that have no node there."""
    distance, speed = 10**0.5, 0.1**0.5
    ends = State((0.0, 0.0), (0.3, 0.1)), State((3.0, 1.0), (0.0, 0.0))
    scene = TransferProblem(1.0, *ends, (0.1, 30.0), actuator=BallForce(1.0), objective=Time())
    found = dmoc.solve(scene, structure=True)
    assert kinds(found) == ["full force", "full force and reversed"] and dmoc.verify(found).ok
    assert found.objective == pytest.approx(2 * (distance + 0.5 * speed**2) ** 0.5 - speed, rel=1e-9)


def test_an_engine_that_burns_all_the_way_and_turns_round():
    """Its mass burns away, so that no mesh has the node where it turns: Tsiolkovsky's equation twice."""
    thrust, exhaust, distance = 3.0, 20.0, 5**0.5
    flow = thrust / exhaust

    def beyond(turned):
        first = 1 - turned * (1 - np.log(turned))
        second = [mass * (np.log(mass) - 1 - 2 * np.log(turned)) for mass in (turned**2, turned)]
        return exhaust / flow * (first + second[1] - second[0]) - distance

    ends = State((0.0, 0.0), (0.0, 0.0)), State((2.0, 1.0), (0.0, 0.0))
    engine = Engine(thrust, exhaust_velocity=exhaust)
    found = dmoc.solve(
        TransferProblem(1.0, *ends, (1.0, 6.0), actuator=engine, objective=Time()), tol=1e-6, time_limit=30
    )
    assert found.success and len(found.legs) == 2 and dmoc.verify(found).ok
    turned = brentq(beyond, 0.5, 0.999, xtol=1e-14)
    assert found.objective == pytest.approx((1 - turned**2) / flow, rel=1e-8)
