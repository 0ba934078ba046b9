"""Rods, rails and surfaces: closed forms, orders, long runs, forces of links, messages."""

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dmoc import (
    BallForce,
    BoxForce,
    FinalHeight,
    FreeForce,
    Fuel,
    Holonomic,
    JointTorque,
    KeepOut,
    Member,
    On,
    Rod,
    RotatingFrame,
    Slider,
    SpeedLimit,
    State,
    Surface,
    System,
    Time,
    TransferProblem,
    UniformGravity,
    load,
    simulate,
    solve,
    verify,
)

DOWN = UniformGravity((0, -1.0))
ROD = Rod((0, 0), 1.0)


def pendulum(**changes):
    parts = {
        "mass": 1.0,
        "start": State((0, -1), (0, 0)),
        "goal": State((0, 1), (0, 0)),
        "duration": 5.0,
        "effects": [DOWN],
        "links": [ROD],
    }
    return TransferProblem(**(parts | changes))


UPPER, LOWER = Rod((0, 0), 1.0, on="elbow"), Rod("elbow", 1.0, on="tip")
ARM = System([Member("elbow", 1.0), Member("tip", 1.0)], [UPPER, LOWER])


def posed(first, second, rates=(0.0, 0.0)):
    """The states of both ends of an arm whose rods make these angles with the vertical."""
    found, place, speed = {}, np.zeros(2), np.zeros(2)
    for name, angle, rate in zip(("elbow", "tip"), (first, second), rates, strict=True):
        place = place + np.array([np.sin(angle), -np.cos(angle)])
        speed = speed + rate * np.array([np.cos(angle), np.sin(angle)])
        found[name] = State(tuple(place), tuple(speed))
    return found


def arm(**changes):
    parts = {
        "mass": ARM,
        "start": posed(0, 0),
        "goal": posed(1.2, 2.0),
        "duration": 4.0,
        "effects": [DOWN],
        "actuator": [JointTorque(UPPER), JointTorque(LOWER, against=UPPER)],
    }
    return TransferProblem(**(parts | changes))


RAIL, POLE = Slider((0, 0), (1, 0), on="cart"), Rod("cart", 0.5, on="bob")
CART = System([Member("cart", 1.0), Member("bob", 0.3)], [RAIL, POLE])


def cart_pole(**changes):
    parts = {
        "mass": CART,
        "start": {"cart": State((0, 0), (0, 0)), "bob": State((0, -0.5), (0, 0))},
        "goal": {"cart": State((1, 0), (0, 0)), "bob": State((1, 0.5), (0, 0))},
        "duration": 2.0,
        "effects": [UniformGravity((0, -9.81))],
        "actuator": On("cart", BoxForce(20.0), axes=[0]),
    }
    return TransferProblem(**(parts | changes))


def failed(solution):
    return [check for check in verify(solution).checks if not check.ok]


@pytest.mark.parametrize(
    "make, order, steps, value, digits",
    [
        # least effort of shooting on the angles, relative errors below 2e-12
        (pendulum, 8, 32, 1.212590595721, 1e-9),
        (arm, 8, 64, 2.42391982977, 1e-9),
    ],
)
def test_least_effort_is_that_of_other_methods(make, order, steps, value, digits):
    found = solve(make(), order=order, steps=steps)
    assert found.success and not failed(found)
    assert found.objective == pytest.approx(value, rel=digits)


def test_a_cart_pole_is_that_of_shooting_on_place_and_angle():
    """The same optimum by Runge-Kutta steps of x and the pole's angle, from the answer as a guess."""
    found = solve(cart_pole(), order=4, steps=50)
    assert found.success and not failed(found)
    steps, duration, x, u = 200, 2.0, ca.SX.sym("x", 4), ca.SX.sym("u")
    sin, cos, rate = ca.sin(x[1]), ca.cos(x[1]), x[3]
    # cart of 1 kg, bob of 0.3 kg on 0.5 m; the angle counts from hanging
    far = (0.5 * 0.3 * sin * rate**2 + u + 0.3 * 9.81 * cos * sin) / (1 + 0.3 * sin**2)
    swing = -(cos * far + 9.81 * sin) / 0.5
    slope = ca.Function("slope", [x, u], [ca.vertcat(x[2:], far, swing)])
    h, state = duration / steps, x
    k1 = slope(state, u)
    k2 = slope(state + h / 2 * k1, u)
    k3 = slope(state + h / 2 * k2, u)
    k4 = slope(state + h * k3, u)
    step = ca.Function("step", [x, u], [x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])
    opti = ca.Opti()
    states, pushes = opti.variable(4, steps + 1), opti.variable(1, steps)
    opti.minimize(0.5 * h * ca.sumsqr(pushes))
    opti.subject_to(states[:, 1:] == step.map(steps)(states[:, :-1], pushes))
    opti.subject_to(states[:, 0] == 0)
    times = np.linspace(0, duration, steps + 1)
    cart, bob = (
        np.array([np.interp(times, found.time, c) for c in found.of(name)[0].T]) for name in CART.names
    )
    arm = bob - cart
    angle = np.unwrap(np.arctan2(arm[0], -arm[1]))
    opti.subject_to(states[:, -1] == ca.DM([1.0, round(angle[-1] / np.pi) * np.pi, 0, 0]))
    opti.set_initial(states[0, :], cart[0])
    opti.set_initial(states[1, :], angle)
    opti.set_initial(pushes, np.interp(times[:-1] + h / 2, found.time, found.path.control[:, 0]))
    opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes"})
    other = opti.solve()
    assert other.value(opti.f) == pytest.approx(found.objective, rel=2e-3)


@pytest.mark.parametrize(
    "make, order, counts",
    [
        (pendulum, 2, (48, 96)),
        (pendulum, 4, (20, 40)),
        (pendulum, 6, (12, 24)),
        (pendulum, 8, (8, 16)),
        (arm, 2, (80, 160)),
        (arm, 4, (60, 120)),
        (arm, 6, (48, 96)),
    ],
)
def test_state_control_costate_and_cost_are_of_the_order(make, order, counts):
    problem = make()
    exact = solve(problem, order=8, steps=96)
    errors = []
    for steps in counts:
        found = solve(problem, order=order, steps=steps, guess=exact)
        assert found.success
        at, rule = np.linspace(0, 1, 5), order // 2
        pick = [np.round(at * (len(path.position) - 1)).astype(int) for path in (found.path, exact.path)]
        assert all((pick[0] % rule == 0) & (pick[1] % 4 == 0))
        errors.append(
            [
                np.abs(found.path.position[pick[0]] - exact.path.position[pick[1]]).max(),
                np.abs(found.path.control[pick[0]] - exact.path.control[pick[1]]).max(),
                np.abs(_tangential(problem, found, pick[0]) - _tangential(problem, exact, pick[1])).max(),
                abs(found.objective - exact.objective),
            ]
        )
    observed = np.log2(np.array(errors[0]) / errors[1])
    assert (observed > order - 0.3).all(), observed


def _tangential(problem, solution, places):
    """Costates in the ways that links let be: only these are determined."""
    from dmoc.motion.dynamics import Dynamics

    bars = Dynamics.of(problem).bars
    found = []
    for place in places:
        slope, costate = bars(solution.path.position[place]).full(), solution.costate[place]
        found.append(costate - np.linalg.lstsq(slope, slope @ costate, rcond=None)[0])
    return np.array(found)


def double_pendulum(first, second, rates, duration):
    """Angles and rates of a double pendulum of unit masses, lengths and gravity, by SciPy."""

    def slope(t, y):
        a, b, wa, wb = y
        cos, sin = np.cos(a - b), np.sin(a - b)
        matrix = [[2, cos], [cos, 1]]
        forces = [-sin * wb**2 - 2 * np.sin(a), sin * wa**2 - np.sin(b)]
        return np.concatenate([[wa, wb], np.linalg.solve(matrix, forces)])

    return solve_ivp(slope, (0, duration), [first, second, *rates], "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]


@pytest.mark.parametrize("order, counts", [(2, (400, 800)), (4, (100, 200)), (6, (50, 100)), (8, (40, 80))])
def test_a_double_pendulum_swings_as_its_angles_say(order, counts):
    problem = arm(start=posed(1.0, 0.5, (0.3, -0.2)), duration=6.0)
    a, b, *_ = double_pendulum(1.0, 0.5, (0.3, -0.2), 6.0)
    place = np.array([np.sin(a), -np.cos(a), np.sin(a) + np.sin(b), -np.cos(a) - np.cos(b)])
    errors = []
    for steps in counts:
        flight = simulate(problem, steps=steps, order=order)
        errors.append(np.abs(flight.position[-1] - place).max())
        np.testing.assert_allclose(np.linalg.norm(flight.position[:, :2], axis=1), 1.0, atol=1e-13)
    assert np.log2(errors[0] / errors[1]) > order - 0.3, errors


def test_a_spherical_pendulum_keeps_its_length_energy_and_vertical_momentum():
    problem = TransferProblem(
        2.0,
        State((1, 0, 0), (0, 0.5, 0)),
        State((1, 0, 0), None),
        2000.0,
        effects=[UniformGravity((0, 0, -1.0))],
        links=[Rod((0, 0, 0), 1.0)],
    )
    flight = simulate(problem, steps=20_000, order=4)
    assert np.abs(np.linalg.norm(flight.position, axis=1) - 1).max() < 1e-13
    spin = np.cross(flight.position, flight.momentum)[:, 2]
    assert np.abs(spin / spin[0] - 1).max() < 1e-11
    energy = flight.energy - flight.energy[0]
    late, early = np.abs(energy[-2000:]).max(), np.abs(energy[:2000]).max()
    assert late < 1.1 * early < 1e-5, "an energy error that does not grow"


def test_the_forces_of_links_carry_what_hangs_on_them():
    """At rest the upper rod carries both weights, the lower one its own."""
    still = arm(goal=posed(0, 0), duration=3.0)
    found = solve(still, order=4, steps=20)
    assert found.success and found.objective < 1e-12
    np.testing.assert_allclose(found.reaction, [[2.0, 1.0]] * len(found.time), atol=1e-9)
    # a bob of 2 kg on a rod that turns evenly without gravity pulls with m v^2 / L
    speed = 0.7
    ring = pendulum(
        mass=2.0,
        start=State((0, -1), (speed, 0)),
        goal=State((1, 0), (0, speed)),
        duration=0.5 * np.pi / speed,
        effects=[],
    )
    turned = solve(ring, order=8, steps=8)
    assert turned.success and turned.objective < 1e-12
    np.testing.assert_allclose(turned.reaction, 2.0 * speed**2, rtol=1e-6)


def test_a_rail_is_a_line_and_a_wire_of_ones_own_a_curve():
    rail = TransferProblem(
        1.0, State((0, 0), (0, 0)), State((3, 4), (0, 0)), 2.0, links=[Slider((0, 0), (3, 4))]
    )
    found = solve(rail, order=4, steps=10)
    assert not failed(found) and found.objective == pytest.approx(6 * 25 / 8, rel=1e-10)
    wire = TransferProblem(
        1.0,
        State((-1, 1), (0, 0)),
        State((1, 1), (0, 0)),
        2.0,
        effects=[UniformGravity((0, -9.81))],
        links=[Parabola(1.0)],
    )
    along = solve(wire, order=6, steps=20)
    assert along.success and not failed(along)
    np.testing.assert_allclose(along.position[:, 1], along.position[:, 0] ** 2, atol=1e-10)
    ball = Surface(lambda q: 0.5 * (ca.dot(q, q) - 1))
    over = TransferProblem(1.0, State((1, 0, 0), (0, 0, 0)), State((-1, 0, 0), (0, 0, 0)), 2.0, links=[ball])
    assert solve(over, order=4, steps=20).objective == pytest.approx(6 * np.pi**2 / 8, rel=1e-4)


@dataclass(frozen=True)
class Parabola(Holonomic):
    """A wire of my own."""

    steepness: float

    def g(self, q):
        return q[1] - self.steepness * q[0] ** 2


SCENES = {
    "held": (pendulum(), {"hold": True, "steps": 100}),
    "a tolerance": (pendulum(), {"tol": 1e-6}),
    "least time": (pendulum(actuator=BallForce(1.5), objective=Time(), duration=(0.5, 20.0)), {"steps": 100}),
    "a zone": (pendulum(goal=State((0.8, 0.6), (0, 0)), constraints=[KeepOut((1, -0.5), 0.1)]), {"steps": 40}),
    "a speed limit": (pendulum(constraints=[SpeedLimit(1.5)]), {"steps": 50}),
    "a frame that turns": (pendulum(effects=[DOWN, RotatingFrame(0.3)]), {"steps": 40}),
    "a free velocity": (pendulum(goal=State((0, 1), None)), {"steps": 40}),
    "a system to a tolerance": (arm(), {"tol": 1e-5}),
    "limited motors": (arm(actuator=[JointTorque(UPPER, 1.5), JointTorque(LOWER, 1.5, UPPER)]), {"steps": 60}),
}


@pytest.mark.parametrize("name", SCENES)
def test_all_that_a_scene_has_works_on_links(name):
    problem, how = SCENES[name]
    found = solve(problem, **({"order": 4} if "tol" not in how and "hold" not in how else {}), **how)
    assert found.success, found.message
    assert not failed(found)


def test_a_leap_through_the_anchor_is_seen():
    """A step straight through the anchor of its rod meets every discrete equation; no body does that."""
    problem = cart_pole()
    leap = np.linspace(0, 1, 101)[:, None] * [1, 0, 1, 0] + [0, 0, 0, -0.5]
    leap[-1, 3] = 0.5
    found = solve(problem, order=2, steps=100, guess=(np.linspace(0, 2, 101), leap))
    assert found.success and found.objective < 2, "Ipopt takes it for an answer"
    failing = {check.name: check for check in failed(found)}
    assert {"stability", "reference"} <= failing.keys()
    assert failing["stability"].unit == "degrees a node"


@pytest.mark.slow
def test_a_motor_that_is_too_weak_is_named_and_what_is_needed_is_enough():
    weak = arm(actuator=[JointTorque(UPPER, 0.5), JointTorque(LOWER, 0.5, UPPER)])
    found = solve(weak, order=2, steps=40)
    assert not found.success and "joint torque of" in found.message
    enough = float(found.message.split("joint torque of ")[1].split()[0])
    motors = [JointTorque(UPPER, enough), JointTorque(LOWER, enough, UPPER)]
    assert solve(arm(actuator=motors), order=2, steps=40).success


BAD = {
    "off the rod": (lambda: pendulum(start=State((0, -1.1), (0, 0))), "start breaks Rod .* by 0.105 m"),
    "off its velocity": (lambda: pendulum(start=State((0, -1), (0, 0.1))), "velocity leaves it at 0.1 m/s"),
    "twice": (lambda: pendulum(links=[ROD, ROD]), "hold the same motion twice"),
    "too many": (lambda: pendulum(links=[ROD, Slider((0, 0), (0, 1))]), "no way to move|same motion twice"),
    "three entries": (lambda: pendulum(links=[Rod((0, 0, 0), 1.0)]), "must have 2 entries"),
    "no length": (lambda: Rod((0, 0), 0.0), "greater than 0"),
    "no position in g": (lambda: pendulum(links=[Surface(lambda q: 1.0)]), "does not depend on the position"),
    "no direction": (lambda: Slider((0, 0), (0, 0)), "direction"),
    "an unknown body": (lambda: System([Member("a", 1.0)], [Rod("b", 1.0, on="a")]), "holds 'b'"),
    "one name twice": (lambda: System([Member("a", 1.0), Member("a", 1.0)]), "a name of its own"),
    "a name too long": (lambda: Member(41 * "a", 1.0), "at most 40 of them"),
    "an end of a stranger": (lambda: arm(goal={"hand": State((0, 0), (0, 0))}), "names 'hand'"),
    "no dictionary": (lambda: arm(goal=State((0, 0), (0, 0))), "must be a dictionary"),
    "a zone for a system": (lambda: arm(constraints=[KeepOut((1, 1), 0.1)]), "which of the bodies"),
    "a push on no body": (lambda: cart_pole(actuator=BoxForce(1.0)), "does not say which of the bodies"),
    "no actuator": (lambda: cart_pole(actuator=FreeForce()), "does not say which of the bodies"),
    "a push on a stranger": (lambda: cart_pole(actuator=On("cat", BoxForce(1.0))), "acts on 'cat'"),
    "a motor of strangers": (lambda: cart_pole(actuator=JointTorque(Rod("x", 1.0, on="y"))), "acts on 'x'"),
    "a name for an only body": (lambda: pendulum(links=[Rod((0, 0), 1.0, on="bob")]), "holds 'bob'"),
    "a place of several": (lambda: cart_pole(objective=FinalHeight()), "looks at the place of one body"),
    "least fuel": (lambda: cart_pole(objective=Fuel()), "least fuel is for a single body"),
    "another mass": (lambda: replace(cart_pole(), mass=3.0), "1.3 kg together"),
    "a rod to itself": (lambda: System([Member("a", 1.0)], [Rod("a", 1.0, on="a")]), "to itself"),
    "links and an inertia": (lambda: pendulum(inertia=(1, 1, 1)), "attitude"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_has_no_meaning_is_refused(case):
    make, words = BAD[case]
    with pytest.raises(ValueError, match=words):
        make()


def test_files_hold_systems_and_answers_start_others(tmp_path):
    problem = arm()
    found = solve(problem, order=4, steps=40)
    found.save(tmp_path / "a.nc")
    again = load(tmp_path / "a.nc")
    assert verify(again, problem).ok
    place, speed = again.of("tip")
    np.testing.assert_array_equal(place, found.position[:, 2:])
    assert speed.shape == (41, 2)
    with pytest.raises(ValueError, match="no body is called 'hand'"):
        again.of("hand")
    np.testing.assert_array_equal(again.reaction, found.reaction)
    finer = solve(problem, order=6, steps=30, guess=again)
    assert finer.objective == pytest.approx(2.42392, rel=1e-5)


def test_a_scene_without_links_has_nothing_of_them():
    free = TransferProblem(1.0, State((0, 0), (0, 0)), State((1, 0), (0, 0)), 1.0)
    found = solve(free, steps=10)
    assert found.reaction is None and found.path.reaction is None
    assert [check.name for check in verify(found).checks].count("constraint") == 0


@pytest.mark.parametrize("order", [2, 6])
def test_a_held_torque_acts_along_the_rod_wherever_the_path_is(order):
    """About a pivot away from the middle of the path: the march and the integrator have places of their own."""
    pivot = Rod((3.0, -2.0), 1.0)
    ends = State((3, -3), (0, 0)), State((4, -2), (0, 0))
    problem = TransferProblem(1.0, *ends, 2.0, effects=[DOWN], links=[pivot], actuator=JointTorque(pivot))
    report = verify(solve(problem, order, steps=60, hold=True).raise_for_status())
    assert all(report[name].ok for name in ("residual", "rollout", "reference", "ledger", "constraint"))
