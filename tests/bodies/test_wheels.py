"""Reaction wheels: orders, what stays the same, limits, messages, files and functions for others."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dmoc import (
    Attitude,
    Fuel,
    MomentumLimit,
    Pose,
    State,
    Time,
    Torque,
    TransferProblem,
    UniformGravity,
    Wheels,
    export,
    load,
    rotation,
    simulate,
    solve,
    verify,
)
from dmoc.basics.quaternions import angle_between, rotated, times
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_fractions, uniform_mesh

J = np.array([[1.0, 0.1, 0.0], [0.1, 2.0, 0.05], [0.0, 0.05, 2.8]])
PYRAMID = [(1, 1, 1), (-1, 1, 1), (1, -1, 1), (1, 1, -1)]
AXES = np.array(PYRAMID).T / np.sqrt(3)
SPIN = (0.3, 0.7, -0.4)


def turn(**changes):
    parts = {
        "mass": 20.0,
        "inertia": J,
        "start": Attitude((1, 0, 0, 0), (0.02, -0.01, 0.03)),
        "goal": Attitude(rotation((1, 1, 1), 60)),
        "duration": 30.0,
        "actuator": Wheels(PYRAMID, 0.02, start_momentum=(0.02, -0.03, 0.01, 0.0)),
    }
    return TransferProblem(**(parts | changes))


def by_euler(duration, q, w, h, torque):
    """J w' + w x (J w + A h) = -A u, h' = u, q' = q w / 2, by SciPy."""

    def slope(t, y):
        q, w, h = y[:4], y[4:7], y[7:]
        u = torque(t)
        return np.concatenate(
            [
                0.5 * times(q, np.append(0.0, w)),
                np.linalg.solve(J, -AXES @ u - np.cross(w, J @ w + AXES @ h)),
                u,
            ]
        )

    found = solve_ivp(slope, (0, duration), np.concatenate([q, w, h]), "DOP853", rtol=1e-13, atol=1e-14).y[
        :, -1
    ]
    return found[:4] / np.linalg.norm(found[:4]), found[4:7], found[7:]


@pytest.mark.parametrize("order, counts", [(2, (50, 100)), (4, (16, 32)), (6, (12, 24)), (8, (8, 16))])
def test_a_spinning_body_with_motors_is_of_its_order(order, counts):
    held = np.array([0.5, -0.2, 0.1, 0.3])
    problem = turn(
        start=Attitude((1, 0, 0, 0), SPIN),
        duration=6.0,
        actuator=Wheels(PYRAMID, 1.0, start_momentum=tuple(held)),
    )

    def torque(t):
        return 0.2 * np.array([np.sin(t), np.cos(2 * t), -np.sin(0.5 * t), 0.3 * np.cos(t)])

    q, w, h = by_euler(6.0, (1, 0, 0, 0), SPIN, held, torque)
    errors = []
    for steps in counts:
        at = node_times(order, steps, 6.0)
        flight = simulate(problem, np.array([torque(t) for t in at]), steps, order)
        np.testing.assert_allclose(np.linalg.norm(flight.attitude, axis=1), 1.0, atol=1e-14)
        errors.append(angle_between(flight.attitude[-1], q) + np.abs(flight.rate[-1] - w).max())
    assert np.log2(errors[0] / errors[1]) > order - 0.3
    np.testing.assert_allclose(flight.wheel_momentum[-1], h, atol=10 * errors[1])


def node_times(order, steps, duration):
    return duration * node_fractions(uniform_mesh(steps), scheme(order))


@pytest.mark.parametrize("order", [2, 4, 8])
def test_body_and_wheels_together_keep_their_angular_momentum(order):
    """J w + A h in space axes does not change, whatever the motors do."""
    noise = np.random.default_rng(order)
    problem = turn(start=Attitude((1, 0, 0, 0), SPIN), duration=20.0)
    controls = 0.02 * noise.normal(size=(100 * (order // 2) + 1, 4))
    flight = simulate(problem, controls, 100, order)
    total = rotated(flight.attitude, 20.0 * flight.spin)
    by_hand = flight.rate @ J + flight.wheel_momentum @ AXES.T
    np.testing.assert_allclose(20.0 * flight.spin, by_hand, atol=1e-13)
    assert np.abs(total - total[0]).max() < 1e-12
    assert np.abs(by_hand - by_hand[0]).max() > 0.1, "in body axes it does change"


def test_a_step_of_order_two_is_the_gyrostat_of_manchester_and_peck():
    """sqrt(1 - phi.phi) (J phi + h/2 rho) + phi x (J phi + h/2 rho) is kept, phi x taken with its sign."""
    held, h = np.array([0.5, -0.2, 0.1, 0.3]), 0.1
    problem = turn(
        start=Attitude((1, 0, 0, 0), SPIN),
        duration=2 * h,
        actuator=Wheels(PYRAMID, 1.0, start_momentum=tuple(held)),
    )
    flight = simulate(problem, steps=2)
    phi = [
        times(a * (1, -1, -1, -1), b)[1:] for a, b in zip(flight.attitude, flight.attitude[1:], strict=False)
    ]
    stored = 0.5 * h * AXES @ held

    def momentum(turned, sign):
        body = J @ turned + stored
        return np.sqrt(1 - turned @ turned) * body + sign * np.cross(turned, body)

    np.testing.assert_allclose(momentum(phi[1], 1), momentum(phi[0], -1), atol=1e-14)


def test_one_wheel_about_a_principal_axis_takes_the_effort_of_its_double_integrator():
    """6 J^2 theta^2 / T^3 of a turn by theta in T from rest to rest."""
    moment, angle, duration = 2.0, np.radians(50), 7.0
    found = solve(
        TransferProblem(
            5.0,
            Attitude((1, 0, 0, 0)),
            Attitude(rotation((0, 1, 0), 50)),
            duration,
            inertia=(1.5, moment, 2.5),
            actuator=Wheels([(1, 0, 0), (0, 1, 0), (0, 0, 1)], 10.0),
        ),
        order=8,
        steps=10,
    )
    assert found.success and verify(found).ok
    assert found.objective == pytest.approx(6 * moment**2 * angle**2 / duration**3, rel=1e-9)


def test_least_time_runs_up_to_the_stored_momentum_and_coasts():
    """T = J theta / h + h / u about one axis: full torque u until the wheel holds h, then a turn, then back."""
    moment, angle, torque, stored = 2.0, np.radians(100), 0.5, 0.8
    problem = TransferProblem(
        5.0,
        Attitude((1, 0, 0, 0)),
        Attitude(rotation((0, 1, 0), 100)),
        (1.0, 60.0),
        inertia=(2.5, moment, 2.5),
        actuator=Wheels([(0, 1, 0)], torque, stored),
        objective=Time(),
    )
    found = solve(problem, order=4, steps=40)
    report = verify(found)
    assert found.success and report.ok, report
    assert found.objective == pytest.approx(moment * angle / stored + stored / torque, rel=2e-4)
    # The limit is kept at the Gauss points of the steps, and elsewhere up to the error of the mesh.
    assert np.abs(found.wheel_momentum).max() < stored * (1 + 4e-3)
    # a limit that the answer breaks is seen
    low = replace(problem, actuator=replace(problem.actuator, max_momentum=0.9 * stored))
    assert not verify(found, low)["bounds"].ok


def test_an_answer_is_checked_by_eulers_equation_and_its_file_holds_all(tmp_path):
    problem = turn()
    found = solve(problem, order=6, steps=30)
    report = verify(found)
    assert found.success and report.ok
    found.save(tmp_path / "w.nc")
    again = load(tmp_path / "w.nc")
    for name in ("wheel_momentum", "wheel_torque", "rate", "spin", "attitude"):
        np.testing.assert_array_equal(getattr(again, name), getattr(found, name))
    assert verify(again, problem).ok
    np.testing.assert_allclose(
        simulate(problem, again).wheel_momentum[-1], found.wheel_momentum[-1], atol=1e-13
    )
    wrong = replace(found, wheel_momentum=1.001 * found.wheel_momentum)
    assert not verify(wrong).ok


@pytest.mark.parametrize("keeps", [(0.0, 0.0, 0.0, 0.0), (0.05, None, None, None)])
def test_momenta_at_the_goal_are_met(keeps):
    """A goal with wheels at rest needs a body whose angular momentum is zero."""
    actuator = Wheels(PYRAMID, 0.02, goal_momentum=keeps)
    found = solve(turn(start=Attitude((1, 0, 0, 0)), actuator=actuator), order=4, steps=30)
    assert found.success and verify(found).ok
    for wanted, have in zip(keeps, found.wheel_momentum[-1], strict=True):
        assert wanted is None or have == pytest.approx(wanted, abs=1e-12)


def test_too_little_room_in_the_wheels_is_named_and_is_enough():
    """The least that a wheel must hold is the smaller root of T = J theta / h + h / u."""
    moment, angle, duration, torque = 2.0, np.radians(50), 7.0, 0.5
    problem = TransferProblem(
        5.0,
        Attitude((1, 0, 0, 0)),
        Attitude(rotation((0, 1, 0), 50)),
        duration,
        inertia=(1.5, moment, 2.5),
        actuator=Wheels([(0, 1, 0)], torque, 0.2),
    )
    found = solve(problem, order=2, steps=40)
    assert not found.success
    enough = float(found.message.split("a max_momentum of ")[1].split()[0])
    least = 0.5 * torque * (duration - np.sqrt(duration**2 - 4 * moment * angle / torque))
    assert enough == pytest.approx(least, rel=2e-3) and enough > 0.999 * least
    wheels = replace(problem.actuator, max_momentum=enough)
    assert verify(solve(replace(problem, actuator=wheels), order=2, steps=40)).ok


POINTS = State((0, 0, 0), (0, 0, 0)), State((1, 0, 0), (0, 0, 0))
BAD = {
    "no axes": (lambda: Wheels([], 1.0), "list directions"),
    "a zero axis": (lambda: Wheels([(0, 0, 0)], 1.0), "axes[0] must be a direction"),
    "torques of three": (lambda: Wheels(PYRAMID, (1, 1, 1)), "each of 4 wheels"),
    "momenta of two": (lambda: Wheels(PYRAMID, 1.0, start_momentum=(0, 0)), "each of 4 wheels"),
    "full at the start": (lambda: Wheels(PYRAMID, 1.0, 0.1, (0.2, 0, 0, 0)), "max_momentum of 0.1 N m s"),
    "a free start": (lambda: Wheels(PYRAMID, 1.0, start_momentum=(None, 0, 0, 0)), "start_momentum[0]"),
    "no body that turns": (
        lambda: TransferProblem(1.0, State((0,), (0,)), State((1,), (0,)), 1.0, actuator=Wheels(PYRAMID, 1.0)),
        "inertia",
    ),
    "least fuel": (lambda: turn(objective=Fuel()), "no propellant"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_has_no_meaning_is_refused(case):
    make, words = BAD[case]
    with pytest.raises(ValueError, match=words.replace("[", r"\[").replace("(", r"\(")):
        make()


def test_a_body_that_falls_turns_by_its_wheels():
    """Position and attitude in one problem, and no force but gravity."""
    problem = turn(
        start=Pose((0, 0, 0), (1.0, 0, 0)),
        goal=Pose((None,) * 3, (None,) * 3, rotation((1, 1, 1), 60)),
        duration=10.0,
        actuator=Wheels(PYRAMID, 0.5),
        effects=[UniformGravity((0, 0, -1.0))],
    )
    found = solve(problem, order=4, steps=20)
    assert found.success and verify(found).ok
    np.testing.assert_allclose(found.position[-1], (10.0, 0, -50.0), rtol=1e-9)


def test_a_problem_made_anew_has_one_limit_and_its_own_ends():
    first = turn(actuator=Wheels(PYRAMID, 0.02, 0.1))
    other = replace(first, actuator=replace(first.actuator, max_momentum=0.2, start_momentum=None))
    assert [part.limit for part in other.constraints] == [(0.2,) * 4]
    assert isinstance(other.constraints[0], MomentumLimit)
    assert other.start.momenta == (0.0,) * 4 and other.goal.momenta == (None,) * 4
    free = replace(first, actuator=replace(first.actuator, max_momentum=None))
    assert free.constraints == ()


def test_a_limit_that_the_scene_states_stays_beside_that_of_the_wheels():
    limit = MomentumLimit((0.05,) * 4)
    bare = turn(actuator=Wheels(PYRAMID, 0.02), constraints=[limit])
    assert bare.constraints == (limit,)
    both = replace(bare, actuator=Wheels(PYRAMID, 0.02, 0.1))
    assert [part.limit for part in both.constraints] == [(0.05,) * 4, (0.1,) * 4]
    assert replace(both, actuator=replace(both.actuator, max_momentum=None)).constraints == (limit,)


def test_a_limit_that_the_scene_states_is_kept_as_that_of_the_wheels_is():
    ends, axes = {"start": Attitude((1, 0, 0, 0))}, np.eye(3).tolist()
    free = solve(turn(**ends, actuator=Wheels(axes, 1.0)), order=4, steps=20)
    most = 0.8 * float(np.abs(free.wheel_momentum).max())
    stated = turn(**ends, actuator=Wheels(axes, 1.0), constraints=[MomentumLimit((most,) * 3)])
    found, own = solve(stated, order=4, steps=20), solve(turn(**ends, actuator=Wheels(axes, 1.0, most)), 4, 20)
    assert found.success and verify(found).ok
    assert found.objective == pytest.approx(own.objective, rel=1e-9) and found.objective > 1.01 * free.objective


@pytest.mark.parametrize(
    ("actuator", "told"),
    [
        (Torque(0.02), "limits 3 wheels, but the scene has no wheels: give it the actuator Wheels"),
        (Wheels(PYRAMID, 0.02), "limits 3 wheels, but the scene has 4 wheels"),
    ],
)
def test_a_limit_of_other_wheels_is_refused(actuator, told):
    with pytest.raises(ValueError, match=told):
        turn(actuator=actuator, constraints=[MomentumLimit((0.1,) * 3)])


def test_the_exported_solver_takes_the_momenta_and_finds_the_same(tmp_path):
    problem = turn(actuator=Wheels(PYRAMID, 0.02, 0.1, start_momentum=(0.02, -0.03, 0.01, 0.0)))
    export(problem, tmp_path / "e", order=4, steps=20, c=False)
    solver, nominal = (
        ca.Function.load(str(tmp_path / "e" / f"{name}.casadi")) for name in ("solver", "nominal")
    )
    given = {name: value for name, value in nominal.call({}).items() if name in solver.name_in()}
    for held in ((0.02, -0.03, 0.01, 0.0), (0.0, 0.0, 0.05, 0.0)):
        given["start_wheel_momentum"] = ca.DM(held)
        plan = solver.call(given)
        wheels = replace(problem.actuator, start_momentum=held)
        found = solve(replace(problem, actuator=wheels), order=4, steps=20)
        assert float(plan["objective"]) == pytest.approx(found.objective, rel=1e-6)
        np.testing.assert_allclose(plan["wheel_momenta"].full().T, found.wheel_momentum, atol=1e-6)
        assert float(plan["largest_residual_wheels"]) < 1e-9
