"""Problems of bodies that turn: what is refused, which way round they go, their limits and checks."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    Attitude,
    BallForce,
    BodyConservative,
    BodyForce,
    Effort,
    Engine,
    FinalRadius,
    Fuel,
    KeepOut,
    Moving,
    PointingKeepIn,
    PointingKeepOut,
    Pose,
    RateLimit,
    State,
    Thrusters,
    Time,
    Torque,
    TransferProblem,
    UniformGravity,
    Wrench,
    load,
    rotation,
    simulate,
    solve,
    transcribe,
    verify,
)
from dmoc.basics.quaternions import angle_between, rotated, times, turned_by
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_weights
from dmoc.solver.starts import local_optima

J = (1.0, 2.0, 2.8)
REST = Attitude((1, 0, 0, 0))
POINT = State((0, 0, 0), (0, 0, 0))


def turn(degrees=120, axis=(1, 1, 1), duration=5.0, **more):
    more = {"actuator": Torque(), "inertia": J} | more
    return TransferProblem(1.0, REST, Attitude(rotation(axis, degrees)), duration, **more)


BAD = {
    "an inertia is missing": (lambda: turn(inertia=None), "inertia"),
    "no body has these moments": (lambda: turn(inertia=(1, 1, 3)), "sum of the two others"),
    "negative": (lambda: turn(inertia=(1, 1, -1)), "greater than 0"),
    "not symmetric": (lambda: turn(inertia=((1, 0.1, 0), (0, 1, 0), (0, 0, 1))), "symmetric"),
    "two numbers": (lambda: turn(inertia=(1, 1)), "three numbers"),
    "no unit quaternion": (lambda: Attitude((1, 1, 0, 0)), "unit quaternion"),
    "three entries": (lambda: Attitude((1, 0, 0)), "4 numbers"),
    "a rate of two": (lambda: Attitude((1, 0, 0, 0), (0, 0)), "three entries"),
    "nothing is fixed": (lambda: Attitude(None, None), "both None"),
    "an axis of zeros": (lambda: rotation((0, 0, 0), 10), "direction"),
    "a force on an attitude": (lambda: turn(actuator=BallForce(1.0)), "Torque"),
    "an effect on a place": (lambda: turn(effects=[UniformGravity((0, 0, -1))]), "attitudes alone"),
    "a zone": (lambda: turn(constraints=[KeepOut((1, 0, 0), 0.1)]), "attitudes alone"),
    "a distance": (lambda: turn(objective=FinalRadius()), "attitudes alone"),
    "a torque on a point": (
        lambda: TransferProblem(1.0, State((0,), (0,)), State((1,), (0,)), 1.0, actuator=Torque()),
        "inertia",
    ),
    "two points": (lambda: TransferProblem(1.0, POINT, POINT, 1.0, inertia=J), "neither .* has an attitude"),
    "a goal in the plane": (lambda: replace(turn(), goal=State((0, 0), (0, 0))), "its goal .* three axes"),
    "least time without a limit": (lambda: turn(objective=Time(), duration=(1, 9)), "limit"),
    "thrusters of a limit": (lambda: Thrusters([(1, 0, 0)], [(0, 1, 0)]), "max_thrust"),
    "as many ways as places": (lambda: Thrusters([(1, 0, 0)], [(0, 1, 0), (1, 0, 0)], 1.0), "one each"),
    "fuel both ways": (
        lambda: replace(
            turn(), actuator=Thrusters([(1, 0, 0)], [(0, 1, 0)], 1.0, both_ways=True), objective=Fuel()
        ),
        "both ways",
    ),
    "a wide cone": (lambda: PointingKeepOut((1, 0, 0), (0, 1, 0), 180), "less than 180"),
    "a start in the cone": (
        lambda: turn(constraints=[PointingKeepOut((1, 0, 0), (1, 0.1, 0), 20)]),
        "start breaks PointingKeepOut",
    ),
    "a start that turns too fast": (
        lambda: replace(turn(constraints=[RateLimit(0.5)]), start=Attitude((1, 0, 0, 0), (1, 0, 0))),
        "start breaks RateLimit",
    ),
    "a moving attitude of three": (lambda: Moving(None, attitude=lambda t: ca.vertcat(1, t, 0)), "4 entries"),
}
BAD["steps that turn too far"] = (
    lambda: solve(replace(turn(170), goal=Attitude(rotation((0, 0, 1), 170))), steps=3, order=2),
    "6 equal steps do not",
)


@pytest.mark.parametrize("name", BAD)
def test_what_has_no_meaning_is_refused_in_one_line(name):
    make, words = BAD[name]
    with pytest.raises(ValueError, match=words) as told:
        make()
    assert "\n" not in str(told.value)


def test_a_goal_is_reached_the_shorter_way_whatever_its_sign():
    goal = np.array(rotation((1, 2, 2), 300))
    costs = [solve(replace(turn(), goal=Attitude(tuple(sign * goal))), order=4).objective for sign in (1, -1)]
    assert costs[0] == pytest.approx(costs[1], rel=1e-9)
    path = solve(replace(turn(), goal=Attitude(tuple(goal))), order=4).path
    assert np.degrees(path.turn) < 75


def test_the_other_way_round_is_another_optimum_that_starts_list():
    short = turn(200, (1, 2, 2))
    long = solve(replace(short, goal=Attitude(rotation((1, 2, 2), 200), other_way=True)), order=4)
    # Both figures were found by indirect shooting on Euler's equations.
    assert solve(short, order=6).objective == pytest.approx(1.574, abs=4e-3)
    assert long.success and long.objective == pytest.approx(2.1180, abs=2e-3)
    found = local_optima(short, 3)
    assert [optimum.starts[0] for optimum in found] == ["default", "the other way round"]
    # Going on from there keeps to that way.
    again = solve(short, order=4, guess=found[1].path)
    assert again.objective == pytest.approx(long.objective, rel=1e-6) and verify(again).ok


def test_a_jump_of_the_sign_is_found_by_the_checks():
    """For order 4 and more Ipopt calls a path with q and then -q solved; it is none."""
    problem = turn(200, (1, 2, 2))
    right = solve(problem, order=4, steps=20)
    position = right.path.position.copy()
    position[21:] *= -1
    spoiled = replace(right, path=replace(right.path, position=position))
    report = verify(spoiled)
    assert not report.ok and not report["stability"].ok
    assert report["stability"].unit == "degrees a node"


def test_a_quaternion_that_is_too_long_fails_its_check():
    right = solve(turn(), order=4, steps=20)
    position = right.path.position.copy()
    position[7] *= 1 + 1e-9
    report = verify(replace(right, path=replace(right.path, position=position)))
    assert not report["constraint"].ok and "node 7" in report["constraint"].note


@pytest.mark.parametrize("order", [2, 4, 8])
def test_limits_of_pointing_and_rate_hold_and_cost(order):
    free = turn(150, (0, 0, 1), 8.0, actuator=Torque(0.75))
    lamp = (np.cos(1.2), np.sin(1.2), 0.05)
    limited = replace(free, constraints=[PointingKeepOut((1, 0, 0), lamp, 15), RateLimit(0.5)])
    found = solve(limited, order=order).raise_for_status()
    assert verify(found).ok and found.objective > 1.02 * solve(free, order=order).objective
    axis = rotated(found.attitude, np.broadcast_to([1.0, 0, 0], (len(found.attitude), 3)))
    apart = np.degrees(np.arccos(axis @ lamp / np.linalg.norm(lamp)))
    assert apart.min() == pytest.approx(15, abs=0.1)
    assert np.linalg.norm(found.rate, axis=1).max() == pytest.approx(0.5, rel=1e-3)


def test_an_antenna_that_must_follow_the_earth_follows_it():
    def earth(t):
        return ca.vertcat(ca.cos(0.1 * t), ca.sin(0.1 * t), 0)

    goal = Attitude(rotation((0, 0, 1), np.degrees(0.5)), (None, None, None))
    problem = TransferProblem(
        1.0, REST, goal, 5.0, actuator=Torque(), inertia=J, constraints=[PointingKeepIn((1, 0, 0), earth, 1.0)]
    )
    found = solve(problem, order=4).raise_for_status()
    assert verify(found).ok
    seen = rotated(found.attitude, np.broadcast_to([1.0, 0, 0], (len(found.attitude), 3)))
    toward = np.stack([np.cos(0.1 * found.time), np.sin(0.1 * found.time), 0 * found.time], axis=1)
    assert np.degrees(np.arccos(np.clip(np.sum(seen * toward, axis=1), -1, 1))).max() < 1.001


def test_a_spoiled_rate_or_torque_of_a_solution_fails_the_ledger():
    right = solve(turn(), order=4, steps=20)
    for name in ("rate", "spin", "torque"):
        wrong = replace(right, **{name: getattr(right, name) + 1e-4})
        assert not verify(wrong)["ledger"].ok, name
    assert verify(right).ok


def test_files_hold_a_body_that_turns_to_the_last_bit(tmp_path):
    problem = TransferProblem(
        3.0,
        Pose((0, 0, 0)),
        Pose((1, 0, 1), attitude=rotation((1, 0, 1), 60)),
        4.0,
        actuator=Wrench(),
        inertia=J,
    )
    right = solve(problem, order=4, steps=20)
    right.save(tmp_path / "pose.nc")
    back = load(tmp_path / "pose.nc")
    for name in ("position", "attitude", "velocity", "rate", "momentum", "spin", "force", "torque"):
        assert np.array_equal(getattr(back, name), getattr(right, name)), name
    assert np.array_equal(back.path.reaction, right.path.reaction)
    assert verify(back, problem).ok
    assert solve(problem, order=4, steps=20, guess=back).iterations < right.iterations + 8


def test_attitude_alone_has_no_position_in_any_graph():
    problem = turn()
    nlp = transcribe(problem, 10, 4)
    labels = [label for group in nlp.columns.groups for label in group.labels]
    assert nlp.columns["position"].labels == ("qs", "qx", "qy", "qz") and "x" not in labels
    assert nlp.columns["start.velocity"].labels == ("wx", "wy", "wz")
    solution = solve(problem, order=4)
    assert solution.position.shape[1] == solution.velocity.shape[1] == solution.force.shape[1] == 0


def test_a_burning_body_shrinks_in_its_inertia_and_pays_for_what_it_flies():
    places = [(a, b, 0) for a in (0.5, -0.5) for b in (0.5, -0.5)] * 3
    places = [np.roll(place, i // 4) for i, place in enumerate(places)]
    ways = [np.roll((sign, 0, 0), i) for i in range(3) for sign in (-1, -1, 1, 1)]
    problem = TransferProblem(
        2.0,
        Pose((0, 0, 0)),
        Pose((0, 1, 0), attitude=rotation((0, 0, 1), 40)),
        4.0,
        actuator=Thrusters(places, ways, 2.0, exhaust_velocity=20.0, dry_mass=1.0),
        objective=Fuel(),
        inertia=J,
    )
    found = solve(problem, order=4).raise_for_status()
    assert verify(found).ok
    weights = found.path.duration * node_weights(found.path.mesh, scheme(4))
    assert found.objective == pytest.approx(2.0 - found.final_mass, rel=1e-9)
    assert (found.path.control.sum(axis=1) * weights).sum() / 20 == pytest.approx(found.objective, rel=1e-6)


def test_a_target_that_tumbles_is_met_in_attitude_and_rate():
    axis, speed = np.array([0.6, 0.0, 0.8]), 0.3

    def turned(t):
        half = speed * t / 2
        return ca.vertcat(ca.cos(half), *(float(x) * ca.sin(half) for x in axis))

    problem = TransferProblem(
        1.0, REST, Moving(None, attitude=turned), (2.0, 9.0), actuator=Torque(0.8), inertia=J
    )
    found = solve(replace(problem, objective=Effort() + 0.05 * Time()), order=4).raise_for_status()
    assert verify(found).ok
    wanted = turned_by(speed * found.duration * axis[None])[0]
    assert angle_between(found.attitude[-1], wanted) < 1e-8
    assert found.rate[-1] == pytest.approx(speed * axis, abs=1e-8)


def test_turning_space_turns_the_answer():
    """The same transfer in other axes of space costs the same; the torques in body axes are equal."""
    frame = np.array(rotation((1, -2, 0.5), 70))
    first = solve(turn(), order=4)
    start = Attitude(tuple(frame))
    goal = Attitude(tuple(times(frame, np.array(rotation((1, 1, 1), 120)))))
    other = solve(replace(turn(), start=start, goal=goal), order=4)
    assert other.iterations == first.iterations
    assert np.abs(other.torque - first.torque).max() < 1e-9


@pytest.mark.slow
def test_a_needed_torque_and_time_are_named():
    hard = turn(150, (0, 0, 1), 2.0, actuator=Torque(0.75))
    failed = solve(hard)
    assert not failed.success
    limit = float(failed.message.split("torque limit of ")[1].split()[0])
    time = float(failed.message.split("), or ")[1].split()[0])
    assert solve(replace(hard, actuator=Torque(limit))).success
    assert solve(replace(hard, duration=time)).success


class Compass(BodyConservative):
    """A needle along the body's x axis in a field along the x axis of space."""

    moves_body = False

    def lagrangian(self, t, body, m):
        return 0.2 * body.rotation[0, 0] / m


class Friction(BodyForce):
    """A torque against the rate."""

    moves_body = False

    def wrench(self, t, body, m):
        return None, -0.1 * body.rate


def test_effects_of_the_users_own_act_as_euler_says():
    from scipy.integrate import solve_ivp

    start = Attitude(rotation((0, 0, 1), 50), (0.2, 0.1, 0.5))
    problem = TransferProblem(
        1.0, start, REST, 4.0, effects=[Compass(), Friction()], actuator=Torque(), inertia=J
    )
    inertia = np.diag(J)

    def slope(t, y):
        q, w = y[:4], y[4:]
        field = rotated(q * np.array([1, -1, -1, -1]), np.array([[1.0, 0, 0]]))[0]
        torque = 0.2 * np.cross([1.0, 0, 0], field) - 0.1 * w
        return np.concatenate(
            [times(q, np.append(0.0, w)) / 2, np.linalg.solve(inertia, torque - np.cross(w, inertia @ w))]
        )

    q0 = np.array(start.quaternion)
    right = solve_ivp(slope, (0, 4), np.append(q0, start.rate), "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    found = simulate(problem, steps=60, order=8)
    assert angle_between(found.attitude[-1], right[:4]) < 1e-10
    assert np.abs(found.rate[-1] - right[4:]).max() < 1e-10
    swung = solve(problem, order=6).raise_for_status()
    assert verify(swung).ok


def test_an_effect_that_gives_the_wrong_number_of_values_is_refused():
    class Wrong(BodyForce):
        moves_body = False

        def wrench(self, t, body, m):
            return None, ca.vertcat(1, 2)

    with pytest.raises(ValueError, match="3 values"):
        turn(effects=[Wrong()])


def test_an_engine_acts_on_a_body_at_its_centre():
    """An ordinary actuator pushes in space axes and does not turn the body."""
    ends = Pose((0, 0, 0)), Pose((1, 0, 0))
    problem = TransferProblem(2.0, *ends, 3.0, actuator=Engine(5.0), objective=Fuel(), inertia=J)
    alone = TransferProblem(
        2.0,
        State((0, 0, 0), (0, 0, 0)),
        State((1, 0, 0), (0, 0, 0)),
        3.0,
        actuator=Engine(5.0),
        objective=Fuel(),
    )
    both = solve(problem, order=4), solve(alone, order=4)
    assert both[0].success and both[0].objective == pytest.approx(both[1].objective, rel=1e-5)
