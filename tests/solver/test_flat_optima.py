"""Flat optima, the cost of the control that is flown, and meshes that are to blame."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    BallForce,
    CircularOrbit,
    Engine,
    FinalMass,
    Fuel,
    Moving,
    Nozzles,
    PointGravity,
    RotatingFrame,
    SpeedLimit,
    Spring,
    State,
    TransferProblem,
    UniformGravity,
    solve,
    verify,
)
from dmoc.guess.open_ends import two_burns
from dmoc.meshes.choices import trial_path
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_weights
from dmoc.results.facts import off_optimum
from dmoc.results.flown_cost import unpriced
from dmoc.solver.flat import flat_optimum
from dmoc.solver.ladder import Ladder

CROSS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
# from place to place in a frame that turns; duality proves that the least fuel is 0.8653420757 N s
TURNING = TransferProblem(
    1.5112557613745101,
    State((-0.10177345752099187, 0.40357213749672255), (-0.15485352081870432, -0.1902283945802528)),
    State((0.42720940549401765, 0.3091532377767155), (-0.5054467812085968, 0.4412150242894053)),
    3.034941425192684,
    effects=[
        RotatingFrame(1.4473703428550952),
        Spring(1.8612951246855574, (-0.2250804531885441, -0.0088041720532)),
    ],
    actuator=Engine(1.2891952323352933),
    objective=Fuel(),
)
# a rocket on a line: when it burns hardly matters
SOUNDING = TransferProblem(
    2.4519400997535183,
    State((2.310928280227888,), (-1.0529030259559071,)),
    State((-3.116673211168544,), (-3.2002064895798394,)),
    2.3552134024284466,
    effects=[UniformGravity((-1.6,))],
    actuator=Nozzles(((1.0,), (-1.0,)), 8.300159105638235, exhaust_velocity=10.647921016102256, dry_mass=1.11),
    objective=FinalMass(),
)


@pytest.mark.parametrize(
    ("problem", "options", "known"),
    [
        (TURNING, {"order": 4, "tol": 1e-4}, 0.8653420757),
        (SOUNDING, {"order": 2, "tol": 1e-3, "hold": True}, 2.1057),
    ],
)
def test_where_paths_cost_the_same_the_tolerance_is_met(problem, options, known):
    solution = solve(problem, **options)
    assert solution.success, solution.message
    assert solution.objective == pytest.approx(known, rel=options["tol"])
    # What held the path near the one before is let go in the end.
    assert verify(solution).ok
    assert solution.iterations < 400


def test_the_thrust_of_nozzles_is_flown_as_it_is_paid_for():
    """The sum of the nozzles is not the magnitude of their force, and no part of it is idle."""
    passing = TransferProblem(
        0.9785142497775168,
        State((0.8943057816445376, 0.44745633185502337), (-0.6814792571629095, 1.362034228513449)),
        State((-0.12088030004049478, 1.556680840241573), (-1.02500676327186, 0.7124265496020762)),
        1.0810482279069835,
        effects=[PointGravity(1.0)],
        actuator=Nozzles(CROSS, 0.07229440030755822),
        objective=Fuel(),
    )
    solution = solve(passing, order=8, tol=1e-4)
    assert solution.success and solution.steps < 250


def test_where_the_error_of_the_cost_falls_slowly_all_steps_are_cut():
    """At order 2 the effort of a small correction errs in steps in which the path does not."""
    passing = TransferProblem(
        1.0,
        State((1.0, 0.0), (0.0, 1.3)),
        State((-0.35, 1.22), (-0.99, 0.42)),
        1.65,
        effects=[PointGravity(1.0)],
    )
    sharp = solve(passing, order=8, tol=1e-8)
    coarse = solve(passing, order=2, tol=1e-5)
    assert coarse.success, coarse.message
    assert coarse.objective == pytest.approx(sharp.objective, rel=1e-5)


# 0.47 m in 4.1 s at no more than 2 % above the mean speed: the ramps take a fiftieth of the time each
RAMPS = TransferProblem(
    0.7811846564173863,
    State((0.44905471156263277,), (0,)),
    State((-0.01943549610964612,), (0,)),
    4.109656028192127,
    actuator=BallForce(1.1006753584950362),
    constraints=[SpeedLimit(0.11682587443685435)],
)


@pytest.mark.parametrize("options", [{"order": 4}, {"order": 6}, {"order": 8}, {"tol": 1e-4}])
def test_ramps_shorter_than_a_step_are_found_and_paid_for(options):
    solution = solve(RAMPS, **options)
    assert solution.success and verify(solution).ok, solution.message
    exact = solve(RAMPS, order=4, tol=1e-5)
    assert solution.objective == pytest.approx(exact.objective, rel=1e-2)
    # The control of the answer, flown by its pieces, has the effort that is stated.
    assert unpriced(RAMPS, Dynamics.of(RAMPS), solution.path, solution.objective) <= 1e-2


def test_a_cost_that_is_not_flown_fails_the_ledger():
    solution = solve(RAMPS, order=8, steps=32)
    assert verify(solution)["ledger"].ok
    # Half of the objective is told: what is flown costs twice that.
    check = verify(replace(solution, objective=0.5 * solution.objective))["optimality"]
    assert not check.ok


@pytest.mark.slow
def test_a_limit_that_is_too_small_on_every_mesh_is_still_told():
    slow = replace(RAMPS, constraints=[SpeedLimit(0.11)])
    for options in ({"tol": 1e-4}, {"order": 6}):
        failed = solve(slow, **options)
        assert not failed.success and "speed limit of" in failed.message, failed.message
    weak = replace(RAMPS, actuator=BallForce(0.05))
    failed = solve(weak, tol=1e-3)
    assert "force limit of" in failed.message and "steps as long" not in failed.message


def test_what_is_flown_costs_what_the_nodes_say_where_no_limit_is_broken():
    free = TransferProblem(1.0, State((0, 0), (0, 0)), State((1, 0), (0, 0)), 2.0)
    solution = solve(free, order=6, steps=10)
    assert unpriced(free, Dynamics.of(free), solution.path, solution.objective) == 0.0
    assert np.isfinite(solution.objective)


def test_the_effort_of_nozzles_has_a_unit_though_all_at_once_make_no_force():
    """A unit of 1 N^2 s for an effort of 4e8 left the first-order conditions open by 2e-4 of 1."""
    heavy = TransferProblem(
        4655.271568681675,
        State((119.72664887819526, 119.6408106038325), (3.535863108859444, 3.5091285081502264)),
        State((119.86625356093921, 119.81667721032373), (3.343676749717904, 4.111767712489929)),
        0.044603736000931295,
        actuator=Nozzles(CROSS, 578403.8162589258),
    )
    solution = solve(heavy)
    assert solution.success and verify(solution).ok


def test_a_target_that_moves_is_met_sooner_where_the_longest_time_leads_nowhere():
    place, speed, meeting = np.array([1.0, 0.5]), np.array([1.2, -0.8]), 2.0
    target = Moving(lambda t: ca.DM(place) + ca.DM(speed) * ca.sin(3.0 * (t - meeting)) / 3.0, "matched")
    chase = TransferProblem(1.0, State((0, 0), (0, 0)), target, (1.0, 3.6), actuator=BallForce(1.6))
    solution = solve(chase, order=6)
    assert solution.success, solution.message


# Between circles with thrust to spare, anywhere on the second: Hohmann's two impulses burn 0.02701 kg.
CIRCLES = TransferProblem(
    1.0,
    State((-0.17240217175596456, 0.9850266449055207), (-0.9850266449055207, -0.17240217175596456)),
    CircularOrbit(1.2118842475446392, 1.0),
    10.02916079230658,
    effects=[PointGravity(1.0)],
    actuator=Engine(0.28774196224086646, exhaust_velocity=3.30592923439145),
    objective=Fuel(),
)


def test_with_thrust_to_spare_least_fuel_begins_near_two_burns():
    """From the path of least effort, with thrust all along, it was a long way on which most attempts failed."""
    ladder = Ladder(CIRCLES)
    with ladder.interrupt:
        rung = flat_optimum(ladder, trial_path(CIRCLES, 4, None, False))
    assert rung is not None and rung.solved and rung.pull <= off_optimum()
    # Two impulses burn 0.02701 kg; 28 steps cannot tell a switch to better than a hundredth of that.
    assert rung.level.objective == pytest.approx(0.02701, rel=1e-2)
    assert all(one.solved and not one.level.question for one in ladder.rungs)


def test_where_half_an_ellipse_takes_too_long_least_fuel_begins_near_least_effort():
    hurried = replace(CIRCLES, duration=3.5)
    ladder = Ladder(hurried)
    with ladder.interrupt:
        flat_optimum(ladder, trial_path(hurried, 4, None, False))
    assert ladder.rungs[0].level.question == "least effort"


@pytest.mark.parametrize("hold", [False, True])
def test_two_burns_have_the_impulses_of_hohmann_and_burn_their_propellant(hold):
    first = trial_path(CIRCLES, 4, 60, hold)
    path = two_burns(CIRCLES, first)
    assert path is not None
    radius, exhaust = 1.2118842475446392, 3.30592923439145
    change = np.sqrt(2 * radius / (1 + radius)) - 1 + (1 - np.sqrt(2 / (1 + radius))) / np.sqrt(radius)
    weights = np.diff(path.mesh) if hold else node_weights(path.mesh, scheme(4))
    assert path.duration * weights @ path.control[:, -1] == pytest.approx(change, rel=1e-6)
    assert 1 - path.mass[-1] == pytest.approx(change / exhaust, rel=1e-2)
    radii = np.linalg.norm(path.position, axis=1)
    assert radii[0] == pytest.approx(1.0) and radii[-1] == pytest.approx(radius, rel=1e-6)
    assert (np.diff(radii) > -1e-6).all()


def test_with_little_thrust_to_spare_least_fuel_is_sought_as_ever():
    hurried = replace(CIRCLES, actuator=Engine(0.03, exhaust_velocity=3.3))
    ladder = Ladder(hurried)
    assert flat_optimum(ladder, trial_path(hurried, 4, None, False)) is None
    assert not ladder.rungs
    assert flat_optimum(Ladder(TURNING), trial_path(TURNING, 4, None, False)) is None


def test_a_flat_optimum_is_let_go_before_the_last_mesh():
    """Hohmann's impulses bound the fuel. Let go on the last mesh alone it took 2,000 iterations and 20 s."""
    place, aside = (-0.17240217175596456, 0.9850266449055207), (-0.9850266449055207, -0.17240217175596456)
    radius, exhaust = 1.2118842475446392, 3.30592923439145
    problem = TransferProblem(
        1.0,
        State(place, aside),
        CircularOrbit(radius, 1.0, center=(0.0, 0.0)),
        10.02916079230658,
        effects=[PointGravity(1.0)],
        actuator=Engine(0.28774196224086646, exhaust_velocity=exhaust),
        objective=Fuel(),
    )
    solution = solve(problem, tol=1e-4).raise_for_status()
    change = abs(np.sqrt(2 * radius / (1 + radius)) - 1) + abs(1 - np.sqrt(2 / (1 + radius))) / np.sqrt(radius)
    assert solution.objective == pytest.approx(1 - np.exp(-change / exhaust), rel=1e-4)
    assert solution.iterations < 600 and verify(solution).ok


def test_nozzles_that_cancel_leave_the_check_of_optimality_a_unit_of_cost():
    """All nozzles at once, held weaker than is typical, made an effort of 2e-8 of one: that was the unit."""
    away = TransferProblem(
        1.1784004729244795,
        State(
            (-0.6939588275072724, -0.12840029909412712, -0.7084733650020094),
            (-0.18193774567831508, 0.9833100511524799, 0.0),
        ),
        State(
            (0.15014477873795257, 0.7921989579771114, 0.3580244420446077),
            (0.7379538593451797, -0.4304077361850586, 0.689269558674312),
        ),
        7.8843270934115,
        effects=[PointGravity(1.0)],
        actuator=Nozzles([*np.eye(3), *-np.eye(3)], 0.08006068239482939),
    )
    solution = solve(away, order=6, hold=True).raise_for_status()
    assert {check.name: check.ok for check in verify(solution).checks}["optimality"]
