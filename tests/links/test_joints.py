"""Joints between rigid bodies: closed forms, other values, orders, momenta, springs, stops, messages."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
import xarray
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from dmoc import (
    Fixed,
    FreeForce,
    GravityGradient,
    JointDamper,
    JointForce,
    JointLimit,
    JointSpring,
    JointState,
    JointTorque,
    Member,
    On,
    Pose,
    Prismatic,
    Revolute,
    Rod,
    Spherical,
    State,
    System,
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
from dmoc.basics.quaternions import rotated, times, turned_by
from dmoc.checks.evidence import Evidence
from dmoc.configurations.of_problem import configuration_of
from dmoc.effects.base import Body
from dmoc.guess.starting import starting_guess
from dmoc.links.along import states_of
from dmoc.links.joint import room
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.momenta import flow_between_links
from dmoc.scene.problem_file import load_problem
from dmoc.solver.starts import local_optima

HEAVY, LIGHT = Member("a", 3.0, (1.0, 2.0, 2.8)), Member("b", 2.0, (0.4, 0.5, 0.6))
WAY, TIME = 1.5, 4.0
# Two hinges in the plane z = 0, of bars of 1 kg and 1 m.
BAR = (0.01, 1 / 12, 1 / 12)
SHOULDER = Revolute((0, 0, 1), at=(-0.5, 0, 0), on="upper")
ELBOW = Revolute((0, 0, 1), anchor=(0.5, 0, 0), at=(-0.5, 0, 0), on="fore", to="upper")
ARM = System([Member("upper", 1.0, BAR), Member("fore", 1.0, BAR)], [SHOULDER, ELBOW])
DOWN = UniformGravity((0, -1.0, 0))


def pair(joint, first, last, actuator, **changes):
    """Two free bodies and a joint between them, from rest to rest."""
    parts = {
        "start": {"a": Pose((0, 0, 0)), joint: JointState(first)},
        "goal": {joint: JointState(last)},
        "duration": TIME,
        "actuator": actuator,
    }
    return TransferProblem(System([HEAVY, LIGHT], [joint]), **(parts | changes))


def arm(angles=((0.0, 0.0), (1.2, 0.8)), **changes):
    ends = [{SHOULDER: JointState(a), ELBOW: JointState(b)} for a, b in angles]
    parts = {"duration": 4.0, "actuator": [JointTorque(SHOULDER), JointTorque(ELBOW)]}
    return TransferProblem(ARM, *ends, **(parts | changes))


def failed(solution):
    return [check for check in verify(solution).checks if not check.ok]


def reduced(one, other):
    return one * other / (one + other)


SLIDE, HINGE, BALL = (
    kind(on="b", to="a", **axis)
    for kind, axis in ((Prismatic, {"axis": (1, 0, 0)}), (Revolute, {"axis": (0, 0, 1)}), (Spherical, {}))
)
CLOSED = {
    "a slide": (SLIDE, 0.0, WAY, JointForce(SLIDE), reduced(3.0, 2.0)),
    "a hinge": (HINGE, 0.0, WAY, JointTorque(HINGE), reduced(2.8, 0.6)),
    "a ball": (BALL, (1, 0, 0, 0), rotation((0, 0, 1), np.degrees(WAY)), JointTorque(BALL), reduced(2.8, 0.6)),
}


@pytest.mark.parametrize("name", CLOSED)
def test_the_effort_of_a_motor_is_that_of_the_reduced_inertia(name):
    """6 I^2 x^2 / T^3 from rest to rest, for the reduced mass or moment of two free bodies."""
    *scene, inertia = CLOSED[name]
    found = solve(pair(*scene), steps=20)
    assert found.success and not failed(found)
    assert found.objective == pytest.approx(6 * inertia**2 * WAY**2 / TIME**3, rel=2e-6)


def test_a_weld_makes_one_body_of_two():
    """The same pushes move two welded bodies as one with the mass and the inertia of both."""
    weld = Fixed(anchor=(0.5, 0, 0), at=(-0.5, 0, 0), on="b", to="a")
    push = On("a", Wrench(frame="space"))
    two = TransferProblem(
        System([HEAVY, LIGHT], [weld]),
        {"a": Pose((0, 0, 0), (0.1, 0, 0.2), rate=(0.3, 0.2, 0))},
        {},
        2.0,
        actuator=push,
    )
    middle, reach = 0.4, reduced(3.0, 2.0) * 1.0
    inertia = np.diag(HEAVY.inertia) + np.diag(LIGHT.inertia) + reach * np.array([0, 1.0, 1.0])
    speed = np.array([0.1, 0, 0.2]) + np.cross((0.3, 0.2, 0), (middle, 0, 0))
    start = Pose((middle, 0, 0), tuple(speed), rate=(0.3, 0.2, 0))
    one = TransferProblem(
        5.0, start, replace(start, position=None), 2.0, inertia=tuple(inertia), actuator=Torque()
    )
    torque = np.array([0.2, -0.1, 0.3])
    pushes = np.tile([0.0, 0.0, 0.0, *torque], (81, 1))
    both, single = simulate(two, pushes, 40, 4), simulate(one, pushes[:, 3:], 40, 4)
    assert both.rate is not None and single.rate is not None
    np.testing.assert_allclose(both.rate[:, :3], single.rate, atol=1e-8)
    np.testing.assert_allclose(both.rate[:, 3:], single.rate, atol=1e-8)


def test_a_pendulum_and_a_top_on_joints_cost_what_they_must():
    """Least effort of shooting on the angle, and on Euler's equations about the pivot, errors below 4e-12."""
    hinge = Revolute((0, 0, 1), at=(0, 0.5, 0))
    pendulum = TransferProblem(
        2.0,
        Pose((0, -0.5, 0)),
        Pose((0, 0.5, 0), attitude=rotation((0, 0, 1), 180)),
        5.0,
        inertia=(0.4, 0.3, 0.5),
        links=[hinge],
        effects=[DOWN],
        actuator=JointTorque(hinge),
    )
    found = solve(pendulum, order=8, steps=32)
    assert not failed(found) and found.objective == pytest.approx(1.212590595721, rel=1e-9)
    cos, sin = np.cos(0.3), np.sin(0.3)
    first, last = np.array([0.0, 1.0, 0.0, 0.0]), np.array([cos, 0.6 * sin, 0.0, 0.8 * sin])
    ends = [Pose(tuple(rotated(q, np.array([0, 0, 0.1]))), attitude=tuple(q)) for q in (first, last)]
    top = TransferProblem(
        1.0,
        *ends,
        4.0,
        inertia=(0.99, 1.99, 2.8),
        links=[Spherical(at=(0, 0, -0.1))],
        effects=[UniformGravity((0, 0, -10.0))],
        actuator=Torque(),
    )
    found = solve(top, order=8, steps=32)
    assert not failed(found) and found.objective == pytest.approx(1.273065578142, rel=1e-9)


PUSH = On("a", Wrench())


def flying(joint, seed=1):
    """A state of a body, a value of a joint on it, and the body that it carries there at some rate."""
    draw = np.random.default_rng(seed)
    attitude = draw.normal(size=(1, 4))
    place, velocity, rate = draw.normal(size=(3, 1, 3))
    base = Body(place, velocity, attitude / np.linalg.norm(attitude), None, rate)
    value = draw.normal(size=(1, joint.coordinates or 1))
    if joint.coordinates == 4:
        value /= np.linalg.norm(value)
    return base, value, joint.posed(base, value, draw.normal(size=(1, joint.motors)))


PLACED = {"anchor": (0.3, -0.2, 0.4), "at": (-0.1, 0.5, 0.2), "on": "b", "to": "a"}
TILTED = {"attitude": rotation((1, 2, -1), 50)}
JOINTS = [
    Spherical(**PLACED, **TILTED),
    Fixed(**PLACED, **TILTED),
    Revolute((1, -1, 2), **PLACED, **TILTED),
    Prismatic((1, -1, 2), **PLACED, **TILTED),
]


@pytest.mark.parametrize("joint", JOINTS, ids=lambda joint: type(joint).__name__)
def test_a_body_that_a_joint_carries_keeps_to_it(joint):
    base, value, body = flying(joint)
    if joint.coordinates:
        np.testing.assert_allclose(joint.measured(base, body), value, atol=1e-13)
    ends = [{"a": _pose(base), "b": _pose(body)} for _ in range(2)]
    problem = TransferProblem(System([HEAVY, LIGHT], [joint]), *ends, 1.0, actuator=On("a", Wrench()))
    q, w = problem.start.fixed()
    linked = configuration_of(problem)
    assert np.abs(ca.DM(linked.g(q)).full()).max() < 1e-14
    assert np.abs(ca.DM(linked.opening(q, w)).full()).max() < 1e-13
    bars = ca.DM(linked.bars(q)).full()
    assert np.linalg.matrix_rank(bars) == len(bars) == 6 - joint.motors


def _pose(body):
    return Pose(*(tuple(part[0]) for part in (body.position, body.velocity, body.attitude, body.rate)))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("joint", [one for one in JOINTS if one.motors], ids=lambda joint: type(joint).__name__)
def test_a_motor_works_at_the_rate_of_its_joint_and_on_nothing_else(joint, seed):
    """Its power on both bodies is u times the rate, whatever they do together: nothing is left over."""
    draw = np.random.default_rng(seed)
    base, value, _ = flying(joint, seed)
    rate, u = draw.normal(size=(2, 1, joint.motors))
    body = joint.posed(base, value, rate)
    ends = [{"a": _pose(base), "b": _pose(body)} for _ in range(2)]
    problem = TransferProblem(System([HEAVY, LIGHT], [joint]), *ends, 1.0, actuator=PUSH)
    q, w = problem.start.fixed()
    made = configuration_of(problem)
    slopes = ca.DM(made.velocity(q, w))
    at = made.at(ca.SX(q), ca.SX(slopes), 1.0)
    np.testing.assert_allclose(ca.DM(ca.SX(joint.rate(at))).full().ravel(), rate[0], atol=1e-12)
    assert (
        np.abs(ca.DM(ca.SX(joint.off(at, value[0] if joint.coordinates == 4 else value[0, 0]))).full()).max()
        < 1e-12
    )
    column = ca.DM(ca.SX(joint.driven(made, ca.SX(q), at, ca.SX(u[0])))).full().ravel()
    assert column @ slopes.full().ravel() == pytest.approx(float(u[0] @ rate[0]), abs=1e-11)


def bars(angles, duration):
    """Absolute angles of two hinged bars under gravity along -y, by Lagrange's equations and SciPy."""
    inertia = 1 / 12

    def slope(t, y):
        a, b, wa, wb = y
        cos, sin = 0.5 * np.cos(a - b), 0.5 * np.sin(a - b)
        matrix = [[0.25 + 1 + inertia, cos], [cos, 0.25 + inertia]]
        forces = [-sin * wb**2 - 1.5 * np.cos(a), sin * wa**2 - 0.5 * np.cos(b)]
        return np.concatenate([[wa, wb], np.linalg.solve(matrix, forces)])

    return solve_ivp(slope, (0, duration), [*angles, 0, 0], "DOP853", rtol=1e-13, atol=1e-13).y[:2, -1]


@pytest.mark.parametrize("order, counts", [(2, (200, 400)), (4, (50, 100)), (6, (30, 60)), (8, (20, 40))])
def test_hinged_bars_swing_as_their_angles_say(order, counts):
    problem = arm(((0.3, 0.6), (1.2, 0.8)), effects=[DOWN], duration=3.0)
    a, b = bars((0.3, 0.9), 3.0)
    place = np.array([np.cos(a) + 0.5 * np.cos(b), np.sin(a) + 0.5 * np.sin(b), 0.0])
    errors = [np.abs(simulate(problem, steps=n, order=order).position[-1, 3:] - place).max() for n in counts]
    assert np.log2(errors[0] / errors[1]) > order - 0.3, errors


@pytest.mark.parametrize("order, counts", [(2, (80, 160)), (4, (60, 120))])
def test_state_control_costate_and_cost_of_hinged_bars_are_of_the_order(order, counts):
    """At the step ends; of costates and of controls what motors in the joints and the bars' own motion see."""
    problem = arm(effects=[DOWN], duration=3.0)
    exact = solve(problem, order=8, steps=96)
    dynamics, errors = Dynamics.of(problem), []

    def ends(found):
        """Every place, control, costate along the ways that the joints let be, at the quarters of the way."""
        pick = np.linspace(0, len(found.path.position) - 1, 5).round().astype(int)
        places, costates = found.path.position[pick], found.costate[pick]
        inner = []
        for place, costate in zip(places, costates, strict=True):
            bars = dynamics.bars(place).full()
            moving = dynamics.to_freedom(place, costate).full().ravel()
            inner.append(moving - np.linalg.pinv(bars) @ (bars @ moving))
        return places, found.path.control[pick], np.array(inner), np.array([found.objective])

    best = ends(exact)
    for steps in counts:
        found = solve(problem, order=order, steps=steps, guess=exact)
        assert found.success
        errors.append([np.abs(one - other).max() for one, other in zip(ends(found), best, strict=True)])
    observed = np.log2(np.divide(*errors))
    assert (observed > order - 0.3).all(), (observed, errors)


@pytest.mark.parametrize("order, counts", [(2, (100, 200)), (4, (40, 80)), (6, (20, 40)), (8, (12, 24))])
def test_a_march_of_a_free_flyer_with_an_arm_is_of_its_order(order, counts):
    """Against order 8 with fine steps, under torques of the motors that are polynomials of the time."""
    problem = replace(load_problem("arm_in_space").make(), duration=8.0)

    def flown(order, steps):
        rule = scheme(order)
        nodes = np.append((np.arange(steps)[:, None] + rule.points[:-1]).ravel() / steps, 1.0) * 8.0
        push = np.stack([2e-3 * np.sin(nodes), 1e-3 * np.cos(2 * nodes)], axis=-1)
        flight = simulate(problem, push, steps, order)
        return np.concatenate([flight.position[-1], flight.attitude[-1], flight.velocity[-1], flight.rate[-1]])

    exact = flown(8, 96)
    errors = [np.abs(flown(order, steps) - exact).max() for steps in counts]
    assert np.log2(errors[0] / errors[1]) > order - 0.3, errors


def total(problem, flight):
    """Momentum and angular momentum about the origin of all bodies, one row a step end."""
    momentum, spin = 0.0, 0.0
    for i, body in enumerate(problem.system.bodies):
        # Of a solution the step ends alone.
        ends = slice(None, None, (len(flight.position) - 1) // (len(flight.velocity) - 1))
        r, v = flight.position[ends, 3 * i : 3 * i + 3], flight.velocity[:, 3 * i : 3 * i + 3]
        q, w = flight.attitude[ends, 4 * i : 4 * i + 4], flight.rate[:, 3 * i : 3 * i + 3]
        momentum = momentum + body.mass * v
        spin = spin + body.mass * np.cross(r, v) + rotated(q, w @ np.array(body.inertia))
    return momentum, spin


@pytest.mark.parametrize("order", [2, 4, 6, 8])
def test_motors_in_joints_do_not_change_the_momentum_of_a_free_flyer(order):
    problem = load_problem("arm_in_space").make()
    pushes = 0.05 * np.random.default_rng(3).normal(size=(30 * order // 2 + 1, 2))
    momentum, spin = total(problem, simulate(problem, pushes, 30, order))
    assert max(np.abs(momentum).max(), np.abs(spin).max()) < 1e-13


def test_a_free_flyer_reaches_with_its_arm_while_its_base_is_free(tmp_path):
    problem = load_problem("arm_in_space").make()
    found = solve(problem)
    assert found.success and not failed(found)
    at = states_of(found.path.coordinates, found.path.position)
    angles = [link.measured(at[link.to], at[link.on])[-1, 0] for link in problem.links]
    np.testing.assert_allclose(angles, (1.0, -1.4), atol=1e-9)
    _, spin = total(problem, found)
    assert np.abs(spin).max() < 1e-10
    turned = np.degrees(2 * np.arccos(abs(found.attitude[-1, 0])))
    assert turned > 5, "the base turns back against the arm"
    found.save(tmp_path / "arm.nc")
    again = load(tmp_path / "arm.nc").attach(problem)
    np.testing.assert_array_equal(again.attitude, found.attitude)
    assert verify(again).ok
    assert solve(problem, guess=again).iterations <= 8


SCENES = {
    "order 2": (arm(), {"order": 2, "steps": 100}),
    "order 6": (arm(), {"order": 6, "steps": 12}),
    "held": (arm(), {"hold": True, "steps": 40}),
    "a tolerance": (arm(), {"tol": 1e-5}),
    "weak motors": (
        arm(actuator=[JointTorque(SHOULDER, 0.8), JointTorque(ELBOW, 0.3)], effects=[]),
        {"steps": 20},
    ),
    "a slide that moves too": (
        pair(SLIDE, 0.0, WAY, [JointForce(SLIDE, 2.0), On("a", Wrench(1.0, 1.0))]),
        {"steps": 20},
    ),
    "springs and dampers": (
        arm(effects=[JointSpring(ELBOW, 2.0, rest=0.8), JointDamper(SHOULDER, 0.5), DOWN]),
        {"steps": 30},
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_all_that_a_scene_has_works_on_joints(name):
    problem, how = SCENES[name]
    found = solve(problem, **how)
    assert found.success, found.message
    assert not failed(found)


def test_links_may_be_listed_in_any_order():
    """The guess leads each body after the one that it sits on."""
    backwards = System(ARM.bodies, [ELBOW, SHOULDER])
    paths = [
        starting_guess(replace(arm(), mass=system, system=None, links=()), np.linspace(0, 1, 9), 4, False)
        for system in (ARM, backwards)
    ]
    np.testing.assert_allclose(paths[0].position, paths[1].position, atol=1e-14)


def test_springs_swing_and_dampers_slow_down_as_they_must():
    stiffness, damping, duration = 3.0, 0.4, 2.0
    inertia = BAR[2] + 0.25
    start = {SHOULDER: JointState(0.4), ELBOW: JointState(0.0)}
    one = System([ARM.bodies[0]], [SHOULDER])
    start.pop(ELBOW)
    effects = [JointSpring(SHOULDER, stiffness, rest=0.1), JointDamper(SHOULDER, damping)]
    problem = TransferProblem(one, start, {SHOULDER: JointState(0.0)}, duration, effects, JointTorque(SHOULDER))
    flight = simulate(problem, steps=40, order=6)
    decay = damping / (2 * inertia)
    beat = np.sqrt(stiffness / inertia - decay**2)
    shape = np.cos(beat * duration) + decay / beat * np.sin(beat * duration)
    angle = 0.1 + 0.3 * np.exp(-decay * duration) * shape
    np.testing.assert_allclose(flight.position[-1], (0.5 * np.cos(angle), 0.5 * np.sin(angle), 0), atol=1e-8)


SPUN = Revolute((0, 1, 1), anchor=(0.4, 0, 0.1), at=(-0.3, 0.2, 0), on="b", to="a")


def spinning(steps):
    """Two bodies on a hinge that spin about all axes, and end as they like but for the hinge."""
    turning = {"a": Pose((0, 0, 0), (0.1, 0, 0), rate=(0.5, -0.4, 0.6)), SPUN: JointState(0.0, 0.3)}
    problem = pair(SPUN, 0, 1, JointTorque(SPUN), start=turning, goal={SPUN: JointState(0.9)})
    found = solve(problem, steps=steps)
    assert found.success
    return found


@pytest.mark.slow
def test_the_checks_see_bodies_that_spin_about_all_axes():
    found = spinning(40)
    assert not failed(found)
    path = found.path
    for body, entries in (("b", slice(3, 6)), ("b", slice(10, 14))):
        position = path.position.copy()
        q = position[20]
        if entries.stop == 14:
            q[entries] = times(q[entries], turned_by(np.array([1e-6, 0, 0])))
        else:
            q[entries] += 1e-6
        torn = verify(replace(found, path=replace(path, position=position)))["constraint"]
        assert not torn.ok and "link at node 20" in torn.note, body


def test_the_matrices_of_steps_are_those_of_the_flow_for_bodies_that_spin():
    errors = []
    for steps in (30, 60):
        evidence = Evidence(spinning(steps))
        path, n, ends = evidence.path, evidence.dynamics.freedom, evidence.ends
        times_there, place, speed = evidence.time[ends], path.position[ends], evidence.velocity
        given = times_there[None], place.T, speed.T, path.mass[ends][None], path.control[ends].T
        stacked = np.array(evidence.dynamics.linearised_under_thrust(*given))
        slopes = stacked.reshape(2 * n, steps + 1, 2 * n).transpose(1, 0, 2)
        flow = flow_between_links(evidence.dynamics, place, speed, path.mass[0], slopes)
        exact = np.array([expm(path.duration / steps * one) for one in 0.5 * (flow[1:] + flow[:-1])])
        errors.append(np.abs(evidence.matrices - exact).max())
    assert errors[1] < 0.2 * errors[0] < 1e-4, "of third order in the step"


def test_a_joint_stops_at_its_stop():
    free = arm(((0.0, 0.0), (1.2, 2.4)))
    limited = replace(free, constraints=[JointLimit(ELBOW, high=2.45)])
    angles = []
    for problem in (free, limited):
        found = solve(problem, steps=20)
        assert found.success and not failed(found)
        at = states_of(found.path.coordinates, found.path.position)
        angles.append(ELBOW.measured(at["upper"], at["fore"]).max())
    assert angles[0] > 2.7 and angles[1] == pytest.approx(2.45, abs=1e-6)
    through = replace(solve(free, steps=20), problem=limited)
    assert [check.name for check in failed(through)] == ["bounds"]
    assert "JointLimit" in verify(through)["bounds"].note


@pytest.mark.slow
def test_a_motor_that_is_too_weak_is_named_by_its_joint():
    weak = arm(actuator=[JointTorque(SHOULDER, 0.05), JointTorque(ELBOW)])
    found = solve(weak, order=2, steps=40)
    assert not found.success and "in the joint of upper" in found.message
    enough = float(found.message.split("joint torque of ")[1].split()[0])
    motors = [JointTorque(SHOULDER, enough), JointTorque(ELBOW)]
    assert solve(arm(actuator=motors), order=2, steps=40).success


def test_a_hinge_carries_what_hangs_on_it():
    """At rest the shoulder carries both bars and the torque of their weights about x and y is none."""
    hanging = ((-np.pi / 2, 0.0), (-np.pi / 2, 0.0))
    found = solve(arm(hanging, effects=[DOWN]), steps=10)
    assert found.success and found.objective < 1e-12
    forces = np.abs(found.reaction).max(axis=0)
    np.testing.assert_allclose(forces, [0, 2, 0, 0, 0, 0, 1, 0, 0, 0], atol=1e-8)


ONE = Member("a", 1.0, (1, 1, 1))
MIXED = System([ONE, Member("p", 1.0)])
BAD = {
    "a point mass": (
        lambda: TransferProblem(System([Member("a", 1.0)], [BALL_IN_ROOM]), {}, {}, 1.0, actuator=PUSHED),
        "a point mass",
    ),
    "a stranger": (lambda: System([ONE], [Revolute((0, 0, 1), on="b")]), "holds 'b'"),
    "itself": (lambda: Spherical(on="a", to="a"), "to itself"),
    "no axis": (lambda: Revolute((0, 0, 0)), "direction"),
    "a flat place": (lambda: Spherical(at=(0, 0)), "3 entries"),
    "no attitude": (lambda: Fixed(attitude=(1, 1, 0, 0)), "unit quaternion"),
    "an end off the joint": (
        lambda: TransferProblem(
            System([HEAVY, LIGHT], [BALL]), {"a": Pose((0, 0, 0)), "b": Pose((1, 0, 0))}, {}, 1.0, actuator=PUSH
        ),
        "breaks Spherical (link 1) by 1 m",
    ),
    "an end that leaves it": (
        lambda: TransferProblem(
            System([HEAVY, LIGHT], [BALL]),
            {"a": Pose((0, 0, 0)), "b": Pose((0, 0, 0), (0, 2, 0))},
            {},
            1.0,
            actuator=PUSH,
        ),
        "leaves it at 2 m/s",
    ),
    "twice held": (
        lambda: TransferProblem(
            System([HEAVY, LIGHT], [BALL, HINGE]),
            {"a": Pose((0, 0, 0)), HINGE: JointState(0.0)},
            {},
            1.0,
            actuator=PUSH,
        ),
        "the same motion twice",
    ),
    "known twice": (
        lambda: pair(
            HINGE,
            0,
            1,
            JointTorque(HINGE),
            start={"a": Pose((0, 0, 0)), "b": Pose((0, 0, 0)), HINGE: JointState(0)},
        ),
        "is given as well",
    ),
    "a strange joint": (lambda: arm(constraints=[JointLimit(HINGE, 0, 1)]), "no link"),
    "a spring in a strange joint": (lambda: arm(effects=[JointSpring(HINGE, 1.0)]), "no link"),
    "no stops": (lambda: JointLimit(HINGE), "both None"),
    "stops in the wrong order": (lambda: JointLimit(HINGE, 2.0, 1.0), "less than high"),
    "stops of a ball": (lambda: JointLimit(BALL, 0, 1), "Revolute or Prismatic"),
    "a spring in a weld": (lambda: JointSpring(Fixed(on="b"), 1.0), "Revolute, Prismatic or Rod"),
    "a force in a hinge": (lambda: JointForce(HINGE), "Prismatic"),
    "a torque in a slide": (lambda: JointTorque(SLIDE), "Revolute, Spherical or Rod"),
    "an angle of a ball": (lambda: pair(BALL, 0.3, 1.0, JointTorque(BALL)), "unit quaternion"),
    "a state of a weld": (
        lambda: TransferProblem(
            System([HEAVY, LIGHT], [Fixed(on="b", to="a")]), {Fixed(on="b", to="a"): JointState(0)}, {}, 1.0
        ),
        "neither an angle nor a way",
    ),
    "a torque on a point": (
        lambda: TransferProblem(MIXED, {"a": Pose((0, 0, 0))}, {}, 1.0, actuator=On("p", Torque())),
        "Torque turns bodies, and p is a point mass",
    ),
    "gravity that turns a point": (
        lambda: TransferProblem(
            MIXED, {"a": Pose((9, 0, 0))}, {}, 1.0, [GravityGradient(1.0)], On("a", Torque())
        ),
        "GravityGradient turns bodies, and p is a point mass",
    ),
    "nothing known": (lambda: JointState(None, None), "both None"),
    "an end beyond its stop": (
        lambda: arm(constraints=[JointLimit(ELBOW, 0.5, 2.0)]),
        "start breaks JointLimit",
    ),
    "a rod in space by its angle": (
        lambda: TransferProblem(
            System([Member("a", 1.0)], [Rod((0, 0, 0), 1.0, on="a")]),
            {Rod((0, 0, 0), 1.0, on="a"): JointState(0)},
            {"a": State((1, 0, 0), None)},
            1.0,
        ),
        "in the plane alone",
    ),
}
BALL_IN_ROOM, PUSHED = Spherical(on="a"), On("a", FreeForce())


@pytest.mark.parametrize("name", BAD)
def test_what_does_not_fit_is_refused_in_one_line(name):
    make, words = BAD[name]
    with pytest.raises(ValueError) as error:
        make()
    assert words in str(error.value) and "\n" not in str(error.value)


def test_rods_in_the_plane_start_by_their_angles_too():
    """A double pendulum of points, stated by angles from the x axis."""
    upper, lower = Rod((0, 0), 1.0, on="elbow"), Rod("elbow", 1.0, on="tip")
    system = System([Member("elbow", 1.0), Member("tip", 1.0)], [upper, lower])
    problem = TransferProblem(
        system,
        {upper: JointState(-np.pi / 2), lower: JointState(-np.pi / 2)},
        {upper: JointState(-np.pi / 2 + 1.2), lower: JointState(-np.pi / 2 + 2.0)},
        4.0,
        [UniformGravity((0, -1.0))],
        [JointTorque(upper), JointTorque(lower, against=upper)],
    )
    found = solve(problem, order=4, steps=60)
    assert not failed(found) and found.objective == pytest.approx(2.42391982977, rel=1e-5)


def test_the_room_stands_still():
    assert not np.any([room(2).position, room(2).velocity, room(2).rate])


def test_result_files_tell_the_unit_of_each_constraint_force(tmp_path):
    """Of quaternions and of angles that a joint keeps they are torques per unit mass, of lengths forces."""
    problem = arm()
    solve(problem, order=2, steps=20).save(tmp_path / "arm.nc")
    with xarray.open_dataset(tmp_path / "arm.nc") as table:
        units = table["reaction"].attrs["units"].split(", ")
    hinge = ["m/s2"] * 3 + ["m2/s2"] * 2
    assert units == ["m2/s2"] * 2 + 2 * hinge
    assert list(configuration_of(problem).link_units) == [("m", "m", "m", "rad", "rad")] * 2


@pytest.mark.slow
def test_starts_bring_a_joint_to_its_goal_the_other_way_round():
    """The arm of a free-flyer reaches for less where its forearm comes by the other side."""
    problem = load_problem("arm_in_space").make()
    optima = local_optima(problem, 4, order=4)
    named = {start: one for one in optima for start in one.starts}
    other = named["the other way round of fore"]
    assert other.objective < 0.6 * named["default"].objective
    found = solve(problem, guess=other.path)
    assert found.success and not failed(found)
    at = states_of(found.path.coordinates, found.path.position)
    fore = problem.links[1].measured(at["upper"], at["fore"])[:, 0]
    # From 2.4 rad up to -1.4 rad a whole turn on, in place of down to it.
    assert fore[0] == pytest.approx(2.4) and np.unwrap(fore)[-1] == pytest.approx(2 * np.pi - 1.4)


def test_a_rigid_body_of_a_system_is_sent_the_other_way_round():
    """Two free bodies: the one that turns by 150 degrees may turn by 210 degrees."""
    ends = {"a": Pose((0, 0, 0)), "b": Pose((5, 0, 0))}
    goal = {"a": Pose((0, 0, 0), attitude=rotation((0, 0, 1), 150)), "b": Pose((5, 0, 0))}
    problem = TransferProblem(
        System([HEAVY, LIGHT]), ends, goal, TIME, actuator=[On("a", Torque()), On("b", Torque())]
    )
    short, long = local_optima(problem, 2, order=4)
    assert long.starts == ("the other way round of a",)
    turns = [np.radians(angle) for angle in (150, 210)]
    wanted = [6 * 2.8**2 * turn**2 / TIME**3 for turn in turns]
    assert [short.objective, long.objective] == pytest.approx(wanted, rel=1e-4)


def test_a_chain_that_hangs_is_solved_from_the_load_that_its_rods_carry():
    """The default guess knows what the rods hold at rest, and leads to the least effort that is known."""
    problem = load_problem("hanging_chain").make()
    start = starting_guess(problem, np.linspace(0, 1, 11), 2, False)
    # At rest, straight down, the upper rod carries three masses, the others two and one.
    pull = 9.81 * np.array([3.0, 2.0, 1.0]) / 3.0
    np.testing.assert_allclose(start.reaction[0], pull, rtol=1e-9)
    free = replace(problem, actuator=replace(problem.actuator, limit=None))
    for one in (problem, free):
        found = solve(one)
        assert found.objective == pytest.approx(7.48577, rel=1e-5) and found.iterations < 60


def test_what_parts_one_joint_shows_in_the_rows_of_that_joint_alone():
    """The fore arm is moved: the shoulder holds, and the elbow's three rows of places are off."""
    problem = arm()
    program = transcribe(problem, 4)
    path = starting_guess(problem, program.mesh, 2, False)
    move = np.zeros(path.position.shape[1])
    move[3:6] = 0.01, 0.02, 0.03
    x = program.pack(replace(path, position=path.position + move))
    rows = program.assembly.constraints(x, program.parameters(problem)).full().ravel()
    groups = [one for one in program.rows.groups if one.owner is not None and one.owner.field == "links"]
    shoulder, elbow = (group.of(rows).reshape(-1, 5) for group in groups if group.kind == "node")
    assert np.abs(shoulder).max() < 1e-12
    assert (np.abs(elbow) > 1e-6).tolist() == [[True, True, True, False, False]] * 5
