"""A verdict can be trusted: every check holds on what is good and fails on what is not."""

import re
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    Actuator,
    BallForce,
    BoxForce,
    Check,
    Condition,
    Conservative,
    Effort,
    Engine,
    Fuel,
    KeepIn,
    KeepOut,
    LinearDrag,
    Moving,
    PointGravity,
    RotatingFrame,
    Row,
    SpeedLimit,
    Spring,
    State,
    Time,
    TransferProblem,
    UniformGravity,
    solve,
)
from dmoc.checks.evidence import Evidence
from dmoc.checks.limits import excesses
from dmoc.checks.optimality import stationarity
from dmoc.checks.verification import verify
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.march import force_of
from dmoc.motion.momenta import end_momenta
from dmoc.motion.path import COSTATE
from dmoc.scene.problem_file import load_problem

CHECKS = ["residual", "rollout", "reference", "ledger", "bounds", "optimality", "stability"]


def made(name, **values):
    return load_problem(name).make(**values)


def failing(report):
    return [check.name for check in report.checks if not check.ok]


def with_path(solution, **changes):
    """A solution with another path, reported just as if the solver had found it."""
    path = replace(solution.path, **changes)
    problem = solution.problem
    dynamics = Dynamics.of(problem)
    momentum, velocity = end_momenta(dynamics, path, problem.start_time)
    return replace(solution, path=path, momentum=momentum, velocity=velocity, force=force_of(dynamics, path))


def nudged(values, place, by):
    values = np.array(values, float)
    values[place] += by
    return values


@pytest.fixture(scope="module")
def orbit():
    return solve(made("orbit_raise"))


@pytest.fixture(scope="module")
def straight():
    return solve(made("point_to_point"), steps=1600)


@pytest.fixture(scope="module")
def flyer():
    return solve(made("free_flyer"))


@pytest.fixture(scope="module")
def cart():
    return solve(made("bang_bang"))


# what is good holds

TURNING = TransferProblem(
    mass=2.0,
    start=State((1, 0), (0, 0)),
    goal=State((-0.5, 1), (0.1, 0)),
    duration=5.0,
    effects=[RotatingFrame(0.7), LinearDrag(0.3)],
)
BURNING = TransferProblem(
    mass=2.0,
    start=State((0, 0), (0, 0)),
    goal=State((5, 1), (0, 0)),
    duration=5.0,
    effects=[UniformGravity((0, -1.0)), LinearDrag(0.1)],
    actuator=Engine(6.0, exhaust_velocity=20.0),
    objective=Fuel(),
)
SCENES = {
    "orbit": made("orbit_raise"),
    "free flyer": made("free_flyer"),
    "bang-bang": made("bang_bang"),
    "drone": made("drone_hop"),
    "Clohessy-Wiltshire": made("rendezvous"),
    "turning frame, drag": TURNING,
    "burning": BURNING,
}


@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize("order", [2, 4, 8])
@pytest.mark.parametrize("scene", SCENES)
def test_a_good_solution_holds(scene, order, hold):
    """Also beside a force limit, where lambda = -m F is off by what the interior point leaves of it."""
    report = verify(solve(SCENES[scene], order=order, hold=hold))
    assert [check.name for check in report.checks] == CHECKS
    assert report.ok, [check for check in report.checks if not check.ok]


KEPLER = (PointGravity(1.0),)
ODD = {
    "nothing to do": ((0, 0), (0, 0), (0, 0), (0, 0), 1.0, ()),
    "straight coast": ((0, 0), (1, 0), (5, 0), (1, 0), 5.0, ()),
    "coast on an orbit": ((1, 0), (0, 1), (np.cos(3), np.sin(3)), (-np.sin(3), np.cos(3)), 3.0, KEPLER),
    "once around": ((1, 0), (0, 1), (1, 0), (0, 1), 2 * np.pi, KEPLER),
    "start is goal": ((1, 0), (0, 1), (1, 0), (0, 1), 5.0, KEPLER),
    "hover": ((0, 0), (0, 0), (0, 0), (0, 0), 3.0, (UniformGravity((0, -3.0)),)),
    "one axis": ([0], [0], [1], [0], 1.0, (Spring(4.0, [0.0]),)),
    "free end velocity": ((0, 0), (0, 0), (1, 1), None, 1.0, ()),
    "free end position, no force needed": ((0, 0), (1, 1), None, (1, 1), 1.0, ()),
    "free entries": ((1, 0), (0, 1), (None, 1.5), (None, 0), 4.0, KEPLER),
    "free duration, no force needed": ((0, 0), (1, 0), (5, 0), (1, 0), (1.0, 50.0), ()),
    "free duration, at its bound": ((0, 0), (0, 0), (5, 0), (0, 0), (1.0, 50.0), ()),
    "far from the origin": ((1e6, 0), (0, 0), (1e6 + 1, 1), (0, 0), 1.5, (LinearDrag(0.1),)),
    "fast past": ((0, 0), (1000, 0), (1500, 1), (1000, 0), 1.5, ()),
}


@pytest.mark.parametrize("order", [4, 8])
@pytest.mark.parametrize("scene", ODD)
def test_no_false_alarm_where_scales_vanish(scene, order):
    """No motion, no force, no fixed end: no number is judged relative to round-off."""
    q0, v0, q1, v1, duration, effects = ODD[scene]
    solution = solve(TransferProblem(1.0, State(q0, v0), State(q1, v1), duration, effects), order=order)
    report = verify(solution)
    assert report.ok, [check for check in report.checks if not check.ok]
    assert report.seconds < 5


UNITS = {"SI": (7e6, 500.0), "mm": (7e9, 500.0), "AU": (7e6 / 1.496e11, 500.0), "grains": (1e-3, 1e-6)}


@pytest.mark.parametrize("units", UNITS)
def test_units_do_not_matter(units):
    """A low orbit raised by half, 500 kg, mu = 3.986e14 m^3/s^2, in other lengths and masses."""
    length, mass = UNITS[units]
    time = np.sqrt(7e6**3 / 3.986e14)
    speed = length / time
    problem = TransferProblem(
        mass=mass,
        start=State((length, 0), (0, speed)),
        goal=State((-1.5 * length, 0), (0, -speed * np.sqrt(1 / 1.5))),
        duration=12 * time,
        effects=[PointGravity(length**3 / time**2)],
    )
    report = verify(solve(problem, order=4))
    assert report.ok, [check for check in report.checks if not check.ok]
    canonical = verify(solve(made("orbit_raise"), order=4))
    assert report["reference"].value == pytest.approx(canonical["reference"].value, rel=1e-3)


def test_a_late_start_time_costs_no_digits():
    """Thirty years in seconds leave a step of 25 ms only five digits of its length."""
    early = made("free_flyer", duration=10.0, limit=10.0)
    reports = [verify(solve(replace(early, start_time=time))) for time in (0.0, 1e9)]
    assert all(report.ok for report in reports)
    assert reports[0]["bounds"].value > 1e-5
    assert reports[1]["bounds"].value == pytest.approx(reports[0]["bounds"].value, rel=1e-6)


# every check can fail, and alone where it can be alone


def test_residual_fails_alone(straight):
    """Forces that alternate by 3e-6 cancel along the path: only the rows see them."""
    path = straight.path
    wobble = 3e-6 * np.abs(path.control).max() * (-1.0) ** np.arange(len(path.control))
    wobble[[0, -1]] *= 2
    assert failing(verify(with_path(straight, control=path.control + wobble[:, None]))) == ["residual"]


def test_residual_is_a_force_not_a_length():
    """1e-8 m at one node is nothing of 13 m, but over h^2 with h = 1e-3 s it is 0.02 N."""
    solution = solve(made("point_to_point", duration=1.0), steps=1000)
    bad = with_path(solution, position=nudged(solution.position, (400, 1), 1e-8))
    check = verify(bad)["residual"]
    assert not check.ok
    assert check.value == pytest.approx(2e-8 / 1e-3**2, rel=1e-3)
    assert check.note == "at dynamics[400].y"


def test_rollout_fails_alone(straight):
    """A force that is 5e-7 off all along passes every row and adds up to a path that is not its own."""
    path = straight.path
    drift = 5e-7 * np.abs(path.control).max() * np.sin(2 * np.pi * path.fractions)
    assert failing(verify(with_path(straight, control=path.control + drift[:, None]))) == ["rollout"]


def test_rollout_forgives_what_the_transfer_amplifies_but_not_all():
    """Down from a hill rounding errors grow 7e8 times in 20 s, which no path can help; in 40 s it is lost."""
    down = TransferProblem(1.0, State([1.0], [0]), State([0.5], [0]), 20.0, effects=[Hill(1.0)])
    check = verify(solve(down, order=4))["rollout"]
    assert check.ok
    assert check.value > 1e-8
    assert check.limit == 1e-3
    assert not verify(solve(replace(down, duration=40.0), order=4))["rollout"].ok


def test_reference_fails_alone_on_a_coarse_mesh():
    """Exact for its own scheme, but 60 steps of order 2 do not follow one and a half revolutions."""
    report = verify(solve(made("orbit_raise"), steps=60))
    assert failing(report) == ["reference"]
    assert report["reference"].value > 0.05


def test_reference_and_energy_follow_the_tolerance(orbit):
    """Of a solution that was to be good to 1e-5 more is asked."""
    assert orbit.tolerance is None
    report = verify(replace(orbit, tolerance=1e-5))
    assert report["reference"].limit == pytest.approx(1e-4)
    assert failing(report) == ["reference"]
    assert "ledger" in failing(verify(replace(orbit, tolerance=1e-6)))


@pytest.mark.parametrize("what", ["velocity", "momentum", "force"])
def test_ledger_fails_alone_on_a_false_report(orbit, what):
    assert failing(verify(replace(orbit, **{what: getattr(orbit, what) * 1.001}))) == ["ledger"]
    assert failing(verify(replace(orbit, **{what: getattr(orbit, what)[:-1]}))) == ["ledger"]


def test_ledger_fails_where_momentum_is_not_the_impulse(straight):
    """A push of 5e-7 that the path does not show passes every row; the sum of all of them does not."""
    push = 5e-7 * np.abs(straight.path.control).max()
    report = verify(with_path(straight, control=straight.path.control + push))
    assert report["residual"].ok
    assert failing(report) == ["rollout", "ledger"]


def test_ledger_fails_where_mass_is_not_what_was_burnt():
    solution = solve(BURNING, order=4)
    assert solution.final_mass < 1.6
    report = verify(with_path(solution, mass=nudged(solution.path.mass, 100, 1e-4)))
    assert "ledger" in failing(report)
    free = solve(made("point_to_point"))
    assert "ledger" in failing(verify(with_path(free, mass=free.path.mass * 1.001)))


def test_ledger_fails_where_work_and_energy_differ():
    """The scheme's own energy is 7 % off where h omega is 1.5."""
    scene = TransferProblem(1.0, State([1.0], [0]), State([0.0], [0.3]), 20.0, effects=[Quartic(1.5**2)])
    check = verify(solve(scene, steps=20))["ledger"]
    assert not check.ok
    assert (check.limit, check.unit) == (0.01, "of the energy")
    assert check.value > 0.01


def test_ledger_fails_where_a_free_body_takes_a_way_that_its_forces_do_not_lead():
    """Its momentum at both ends fits all impulses all the same."""
    found = solve(made("free_flyer"))
    aside = 0.1 * np.sin(2 * np.pi * found.path.fractions)[:, None] ** 3
    check = verify(with_path(found, position=found.path.position + aside))["ledger"]
    assert not check.ok and check.unit == "of the energy" and check.value > 0.02


def test_the_work_of_a_force_that_is_not_switched_is_told_apart_from_its_impulses():
    """In three steps of h = 1 s to a speed of 1.5 m/s.

    At their mean velocities the impulses of the steps always do the work that a free body has as energy. The
    forces at the nodes do (h^2 / 8) (f(T)^2 - f(0)^2) more.
    """
    scene = TransferProblem(1.0, State([0.0], [0]), State([1.5], [1.5]), 3.0)
    coarse = solve(scene, steps=3)
    check = verify(coarse)["ledger"]
    assert not check.ok and check.unit == "of the energy"
    more = (coarse.force[-1, 0] ** 2 - coarse.force[0, 0] ** 2) / 8
    assert check.value == pytest.approx(more / (1.5**2 / 2 + more))
    assert verify(solve(scene, steps=40))["ledger"].ok


def test_residual_fails_on_another_velocity_at_either_end():
    """Where a velocity is free no bound holds it: only the momentum of that end tells it from another."""
    push = State((1, None), (None, 0.5))
    problem = TransferProblem(2.0, State((0, 0), (None, 0.1)), push, 3.0, effects=[LinearDrag(0.2)])
    solution = solve(problem, steps=20)
    assert verify(solution).ok and abs(solution.path.goal_velocity[0]) > 0.01
    for name, node in (("start_velocity", 0), ("goal_velocity", 20)):
        report = verify(with_path(solution, **{name: nudged(getattr(solution.path, name), 0, 1e-4)}))
        # 2 kg are 1e-4 m/s off, in half a step of 0.15 s
        assert report["residual"].value == pytest.approx(2.0 * 1e-4 / 0.075, rel=1e-3)
        assert not report["residual"].ok and report["residual"].note == f"at dynamics[{node}].x"


def test_bounds_fail_where_a_thrust_is_not_paid_for():
    solution = solve(BURNING)
    control = np.array(solution.path.control)
    node = int(np.argmax(control[:, -1]))
    control[node, -1] = 0.0
    evidence = Evidence(with_path(solution, control=control))
    broken = {excess.name: excess.value for excess in excesses(evidence) if not excess.ok}
    thrust = np.linalg.norm(control[node, :-1])
    assert broken["force"] == pytest.approx(thrust) and broken["force between nodes"] > 0.1 * thrust


@pytest.mark.parametrize("side", [-1, 1])
def test_bounds_fail_outside_either_corner_of_a_box(side):
    """A body that leaves at 1 m/s and is back at rest after T comes 4 T / 27 far: x = t (1 - t / T)^2."""
    away, free = 8 / 27, TransferProblem(1.0, State((0, 0), (side, 0)), State((0, 0), (0, 0)), 2.0)
    solution = solve(free, order=4, steps=30)
    reach = np.sort([-side, side * (away + 0.01)])
    wide = KeepIn((reach[0], -1), (reach[1], 1))
    assert verify(solution, replace(free, constraints=[wide])).ok
    reach = np.sort([-side, side * (away - 0.1)])
    tight = KeepIn((reach[0], -1), (reach[1], 1))
    report = verify(solution, replace(free, constraints=[tight]))
    assert failing(report) == ["bounds"] and report["bounds"].value == pytest.approx(0.1, rel=1e-3)
    assert "KeepIn 1" in report["bounds"].note


def test_bounds_fail_alone_on_a_force_beyond_its_limit():
    """A limit that the found forces keep by 20 %, then one that they break by 20 %."""
    free = made("point_to_point")
    largest = np.abs(solve(free).force).max()
    solution = solve(replace(free, actuator=BoxForce(1.2 * largest)))
    assert verify(solution).ok
    report = verify(solution, replace(free, actuator=BoxForce(0.8 * largest)))
    assert failing(report) == ["bounds"]
    assert report["bounds"].value == pytest.approx(0.2 * largest, rel=1e-3)
    assert "force" in report["bounds"].note


def test_bounds_fail_where_the_goal_is_elsewhere(straight):
    """Entries that are fixed are met to round-off, whatever force a limit would allow."""
    problem = straight.problem
    far = replace(problem, goal=State((3.0001, 4, 12), (0, 0, 0)))
    assert failing(verify(straight, far)) == ["bounds"]
    moving = replace(problem, goal=State((3, 4, 12), (1e-6, 0, 0)))
    report = verify(straight, moving)
    assert failing(report) == ["bounds"]
    assert "goal velocity" in report["bounds"].note


def test_bounds_fail_where_a_condition_is_not_met():
    """A goal that moves and a condition on the goal are rows, not fixed entries."""
    meeting = TransferProblem(
        1.0, State((0, 0), (0, 0)), Moving(lambda t: [1.0 + 0.1 * t, 0.2 * t]), 2.0, objective=Effort()
    )
    solution = solve(meeting)
    assert verify(solution).ok
    late = with_path(solution, goal_velocity=solution.path.goal_velocity + np.array([1e-3, 0]))
    assert "goal velocity.x" in verify(late)["bounds"].note
    circle = Condition(lambda t, q, v, m: ca.dot(q, q) - 4.0, "circle", 4.0)
    solution = solve(replace(meeting, start=State((1, 0.5), (0, 0)), goal=circle))
    assert verify(solution).ok
    out = with_path(solution, position=nudged(solution.position, (-1, slice(None)), 1e-3))
    assert "goal circle" in verify(out)["bounds"].note


def test_bounds_fail_on_another_duration(cart):
    assert "bounds" in failing(verify(replace(cart), replace(cart.problem, duration=(3.0, 9.0))))
    fixed = solve(made("point_to_point"))
    assert "bounds" in failing(verify(fixed, replace(fixed.problem, duration=27.0)))


def test_bounds_say_that_the_duration_sits_on_its_limit():
    report = verify(solve(TransferProblem(1.0, State([0], [0]), State([5], [0]), (1.0, 50.0)), order=4))
    assert report.ok
    assert "longest limit of 50 s" in report["bounds"].note


@pytest.mark.parametrize(
    "corrupt",
    [
        lambda values: values * 1.01,
        lambda values: -values,
        lambda values: nudged(values, (len(values) // 2, 0), 1e-3 * np.abs(values).max()),
        lambda values: values + 1e-4 * np.abs(values).max() * np.sin(np.linspace(0, 9, len(values)))[:, None],
    ],
    ids=["1 % more", "other sign", "one node", "smooth"],
)
def test_optimality_fails_alone_on_other_costates(orbit, corrupt):
    known = orbit.path.multipliers
    key = COSTATE
    bad = with_path(orbit, multipliers=known | {key: corrupt(known[key])})
    assert failing(verify(bad)) == ["optimality"]


def test_optimality_sees_every_multiplier(flyer, cart):
    """Also those of limits that do not act, of the wrong sign, or of the boundary entries."""
    for solution in (flyer, cart):
        known = solution.path.multipliers
        size = np.abs(known[COSTATE]).max()
        for key, values in known.items():
            if values.size:
                more = nudged(values, (len(values) // 3, 0), 0.01 * size)
                assert failing(verify(with_path(solution, multipliers=known | {key: more}))) == ["optimality"]
            if np.abs(values).max(initial=0.0) > 1e-3 * size:
                turned = with_path(solution, multipliers=known | {key: -values})
                assert failing(verify(turned)) == ["optimality"]
        assert failing(verify(with_path(solution, multipliers={}))) == ["optimality"]


def test_optimality_fails_on_a_path_that_is_feasible_only(flyer):
    """Best for a weight on the duration, hence not for the effort alone."""
    problem = TransferProblem(1.0, State([0], [0]), State([1], [0]), (0.5, 3.0))
    other = solve(replace(problem, objective=Effort() + 0.1 * Time()))
    assert verify(other).ok
    assert failing(verify(replace(other, problem=replace(problem, objective=Effort() + 0.2 * Time())))) == [
        "optimality"
    ]


def test_optimality_means_the_same_on_every_mesh():
    """Costates 1e-4 off, smoothly, are 1e-4 off on 100 steps and on 1600."""
    found = []
    for steps in (100, 1600):
        solution = solve(made("orbit_raise"), steps=steps)
        known = solution.path.multipliers
        values = known[COSTATE]
        wave = 1e-4 * np.abs(values).max() * np.sin(np.pi * solution.path.fractions)[:, None] ** 4
        bad = with_path(solution, multipliers=known | {COSTATE: values + wave})
        found.append(stationarity(Evidence(bad)))
    coarse, fine = found
    assert coarse.force == pytest.approx(1e-4, rel=0.1)
    assert fine.force == pytest.approx(coarse.force, rel=0.1)
    assert fine.path == pytest.approx(coarse.path, rel=0.1)


def test_optimality_fails_alone_on_a_false_objective(orbit, cart):
    for solution in (orbit, cart):
        bad = replace(solution, objective=solution.objective * 1.001)
        assert failing(verify(bad)) == ["optimality"]


def test_least_effort_has_the_costate_of_the_force(orbit):
    """lambda = -m F at every node, to round-off."""
    assert np.allclose(orbit.costate, -orbit.force, rtol=0, atol=1e-13 * np.abs(orbit.force).max())
    assert stationarity(Evidence(orbit)).force < 1e-13


@dataclass(frozen=True)
class Quartic(Conservative):
    """A spring that stiffens: its linearisation depends on where the body is."""

    stiffness: float

    def lagrangian(self, t, q, v, m):
        square = ca.dot(q, q)
        return -0.5 * self.stiffness * square * (1 + 0.1 * square)


@dataclass(frozen=True)
class Hill(Conservative):
    """A spring that pushes away, at its own rate."""

    rate: float

    def lagrangian(self, t, q, v, m):
        return 0.5 * self.rate**2 * ca.dot(q, q)


def test_stability_fails_beyond_its_limit():
    """Only the solution tells: the scene is not linear. The rows hold and the march repeats the path."""
    scene = TransferProblem(1.0, State([1.0], [0]), State([0.0], [0.3]), 20.0, effects=[Quartic(1.9**2)])
    solution = solve(scene, steps=20)
    assert solution.success
    report = verify(solution)
    assert report["residual"].ok and report["rollout"].ok
    assert not report["stability"].ok
    assert "h omega = 2.4" in report["stability"].note
    assert verify(solve(scene, steps=100))["stability"].ok


def test_one_step_too_long_among_a_thousand_is_found():
    scene = TransferProblem(1.0, State([1.0], [0]), State([0.0], [0.3]), 20.0, effects=[Quartic(1.5**2)])
    mesh = np.concatenate([np.linspace(0, 0.45, 500), np.linspace(0.55, 1, 500)])
    check = verify(solve(scene, mesh=mesh))["stability"]
    assert not check.ok
    assert "h omega = 3" in check.note


@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize("frequency", [2.05, 3.0])
def test_a_linear_scene_is_refused_beforehand_with_steps_that_work(frequency, hold):
    scene = TransferProblem(
        1.0, State([1.0], [0]), State([0.0], [0.3]), 20.0, effects=[Spring(frequency**2, [0.0])]
    )
    with pytest.raises(ValueError, match=f"h omega = {frequency:g}") as refusal:
        solve(scene, steps=20, hold=hold)
    steps = int(re.search(r"from (\d+) equal steps on", str(refusal.value))[1])
    with pytest.raises(ValueError, match="unstable"):
        solve(scene, steps=steps - 1, hold=hold)
    solve(scene, steps=steps, hold=hold)
    solution = solve(scene, steps=2 * steps, hold=hold)
    assert solution.success
    assert verify(solution)["stability"].ok
    # what it names besides
    assert "tol=1e-4" in str(refusal.value) and verify(solve(scene, tol=1e-4, hold=hold)).ok


# corrupted in any way, a solution does not pass


def corruptions(solution):
    path = solution.path
    extent = np.linalg.norm(np.ptp(path.position, axis=0))
    speed, force = np.abs(solution.velocity).max(), np.abs(solution.force).max()
    node, control = len(path.position) // 3, len(path.control) // 3
    sine = np.sin(np.pi * path.fractions)[:, None] ** 2
    yield "one position", {"position": nudged(path.position, (node, 0), 1e-4 * extent)}
    yield "the path by 1e-6, smoothly", {"position": path.position + 1e-6 * extent * sine}
    yield "all positions", {"position": path.position + 1e-4 * extent}
    yield "start position", {"position": nudged(path.position, (0, 0), 1e-4 * extent)}
    yield "goal position", {"position": nudged(path.position, (-1, 0), 1e-4 * extent)}
    yield "one force by 1 %", {"control": nudged(path.control, (control, 0), 0.01 * force)}
    yield "all forces by 0.1 %", {"control": path.control * 1.001}
    yield "start velocity", {"start_velocity": path.start_velocity + 1e-4 * speed}
    yield "goal velocity", {"goal_velocity": path.goal_velocity + 1e-4 * speed}
    yield "duration", {"duration": path.duration * 1.0001}
    yield "mass", {"mass": path.mass * 1.001}
    yield "one step end", {"mesh": nudged(path.mesh, len(path.mesh) // 3, 0.01 * path.mesh[1])}


@pytest.mark.parametrize("options", [{}, {"hold": True}, {"order": 8}], ids=["nodal", "hold", "order 8"])
@pytest.mark.parametrize("scene", ["orbit", "free flyer", "bang-bang", "turning frame, drag", "burning"])
def test_no_corruption_passes(scene, options):
    solution = solve(SCENES[scene], **options)
    passed = [what for what, change in corruptions(solution) if verify(with_path(solution, **change)).ok]
    assert passed == []


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_number_that_is_not_finite_fails_everything(orbit, bad):
    path = orbit.path
    for name in ("mesh", "position", "control", "mass", "start_velocity", "goal_velocity"):
        values = np.array(getattr(path, name), float)
        values.reshape(-1)[values.size // 2] = bad
        report = verify(replace(orbit, path=replace(path, **{name: values})))
        assert failing(report) == CHECKS, name
    assert failing(verify(replace(orbit, path=replace(path, duration=bad)))) == CHECKS
    assert failing(verify(replace(orbit, objective=bad))) == ["optimality"]
    assert failing(verify(replace(orbit, velocity=orbit.velocity * bad))) == ["ledger"]
    for key, values in path.multipliers.items():
        if values.size:
            places = (0,) * values.ndim
            worse = with_path(orbit, multipliers=path.multipliers | {key: nudged(values, places, bad)})
            assert failing(verify(worse)) == ["optimality"], key


def test_a_node_where_an_effect_is_undefined_fails(orbit):
    position = np.array(orbit.position)
    position[123] = 0.0
    report = verify(with_path(orbit, position=position))
    assert failing(report) == CHECKS
    assert "force of an effect" in report["reference"].note


@pytest.mark.parametrize("scene", ["orbit_raise", "drone_hop", "bang_bang", "free_flyer"])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-6])
def test_what_ipopt_calls_solved_with_loose_tolerances_is_not(scene, tolerance):
    """The optimiser's word is not taken: it reports success for paths that miss or are not the best."""
    loose = dict.fromkeys(("constr_viol_tol", "dual_inf_tol", "compl_inf_tol"), 1e2) | {"tol": tolerance}
    solution = solve(made(scene), options={f"ipopt.{name}": value for name, value in loose.items()})
    assert solution.success
    assert not verify(solution).ok


def test_a_path_that_its_own_march_misses_by_far_fails():
    """Beyond h omega = 2 Ipopt succeeds, and the march of the same forces ends many paths away."""
    scene = TransferProblem(1.0, State([1.0], [0]), State([0.0], [0.3]), 20.0, effects=[Quartic(9.0)])
    solution = solve(scene, steps=20)
    assert solution.success
    report = verify(solution)
    assert {"rollout", "reference", "stability"} <= set(failing(report))
    assert report["rollout"].value > 10


# between the nodes


def allowances(problem, **options):
    """Excess and allowance between the nodes, by the name of the limit."""
    solution = solve(problem, **options)
    assert solution.success
    return {
        limit.name: limit
        for limit in excesses(Evidence(solution))
        if "between" in limit.name or limit.name.startswith("SpeedLimit")
    }


FAST = TransferProblem(1.0, State((0, 0), (0, 0)), State((5, 1), (0, 0)), 5.0)
LIMITED = {
    "KeepOut": replace(FAST, constraints=[KeepOut((2.5, 0.8), 1.0)]),
    "KeepIn": replace(
        FAST,
        start=State((0, 0), (1, -1)),
        goal=State((5, 0), (1, 1)),
        constraints=[KeepIn((-1, -0.3), (6, 0.1))],
    ),
    "SpeedLimit": replace(FAST, constraints=[SpeedLimit(1.3)]),
}


@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize(("order", "steps"), [(2, 160), (4, 80), (6, 52), (8, 40)])
@pytest.mark.parametrize("limit", LIMITED)
def test_the_allowance_between_nodes_is_second_order_and_enough(limit, order, steps, hold):
    coarse, fine = (
        next(iter(allowances(LIMITED[limit], order=order, steps=n, hold=hold).values()))
        for n in (steps, 2 * steps)
    )
    assert coarse.ok and fine.ok
    assert coarse.allowed / fine.allowed == pytest.approx(4, rel=0.25)


def test_a_zone_entered_by_5_mm_fails(flyer):
    wider = [replace(zone, radius=zone.radius + 5e-3) for zone in flyer.problem.constraints]
    report = verify(flyer, replace(flyer.problem, constraints=wider))
    assert not report["bounds"].ok
    assert report["bounds"].value == pytest.approx(5e-3, rel=0.05)
    assert "KeepOut" in report["bounds"].note
    toward = np.array(flyer.problem.constraints[1].center) - flyer.position
    near = np.linalg.norm(toward, axis=1)
    moved = flyer.position + 5e-3 * (near < 1.05)[:, None] * toward / near[:, None]
    assert "bounds" in failing(verify(with_path(flyer, position=moved)))


@pytest.mark.parametrize("share", [0.4, 0.01])
def test_a_zone_between_two_nodes_is_not_stepped_over(share):
    """All nodes are outside; the path goes right through."""
    solution = solve(FAST, steps=40)
    first, second = solution.position[20:22]
    zone = KeepOut(tuple(first + 0.44 * (second - first)), share * np.linalg.norm(second - first))
    report = verify(solution, replace(FAST, constraints=[zone]))
    assert failing(report) == ["bounds"]
    assert "between nodes" in report["bounds"].note


def test_no_mesh_is_coarse_enough_to_excuse_a_deep_cut():
    """Ten steps of order 8 keep every node outside and cut 2 cm deep."""
    solution = solve(made("free_flyer"), order=8, steps=10)
    assert solution.success
    report = verify(solution)
    assert failing(report) == ["bounds"]
    assert 0.01 < report["bounds"].value < 0.05


def test_a_speed_above_the_limit_fails():
    solution = solve(LIMITED["SpeedLimit"])
    assert verify(solution).ok
    report = verify(solution, replace(FAST, constraints=[SpeedLimit(1.28)]))
    assert not report["bounds"].ok
    assert report["bounds"].value == pytest.approx(0.02, rel=0.05)


def test_a_coarse_mesh_does_not_excuse_speed():
    """Ten steps, between which the velocity sways by more than the 3 % above the limit."""
    solution = solve(FAST, steps=10)
    fastest = np.linalg.norm(solution.velocity, axis=1).max()
    report = verify(solution, replace(FAST, constraints=[SpeedLimit(0.97 * fastest)]))
    assert not report["bounds"].ok


@dataclass(frozen=True)
class Wedge(Actuator):
    """A user's actuator: no more force across than a share of that along."""

    share: float

    def rows(self, u):
        return [Row("wedge", (u[1] / 2) ** 2 - (self.share * u[0] / 2) ** 2, -np.inf, 0.0)]


def test_rows_of_a_users_actuator_count():
    solution = solve(replace(FAST, actuator=Wedge(0.3)))
    assert np.allclose(solution.force[:, 1], 0.2 * solution.force[:, 0], rtol=0, atol=1e-4)
    assert verify(solution).ok
    report = verify(solution, replace(FAST, actuator=Wedge(0.1)))
    assert not report["bounds"].ok
    assert "actuator wedge" in report["bounds"].note


def test_burning_below_the_dry_mass_fails():
    solution = solve(BURNING, order=4)
    heavy = replace(BURNING, actuator=replace(BURNING.actuator, dry_mass=1.7))
    report = verify(solution, heavy)
    assert not report["bounds"].ok
    assert "dry mass" in report["bounds"].note


def test_a_ball_of_forces_is_a_limit_too():
    problem = TransferProblem(1.0, State((0, 0), (0, 0)), State((5, 1), (0, 0)), 5.0, actuator=BallForce(1.5))
    solution = solve(problem)
    assert verify(solution).ok
    report = verify(solution, replace(problem, actuator=BallForce(1.0)))
    assert "bounds" in failing(report)


# usable by hand


def test_a_problem_is_needed_and_must_fit(orbit):
    lost = replace(orbit, problem=None)
    with pytest.raises(ValueError, match="attach"):
        verify(lost)
    assert verify(lost, orbit.problem).ok
    with pytest.raises(ValueError, match="dimension is 3"):
        verify(orbit, made("point_to_point"))


def test_a_report_is_read_by_name(orbit):
    report = verify(orbit)
    assert report["rollout"].name == "rollout"
    assert report["rollout"].value < report["rollout"].limit
    assert report.seconds > 0


def farthest(evidence):
    return Check.of("farthest", np.linalg.norm(evidence.position, axis=1).max(), 1.6, "m")


def test_a_check_of_the_users_own_counts_as_any_other(orbit):
    """A radius of 1.5 at the goal is within 1.6, and not within 1.4 of a scene that is moved out."""
    report = verify(orbit, more=[farthest])
    assert [check.name for check in report.checks] == [*CHECKS, "farthest"]
    assert report.ok and 1.5 <= report["farthest"].value < 1.6
    far = with_path(orbit, position=nudged(orbit.path.position, 200, 1.0))
    assert "farthest" in failing(verify(far, more=[farthest]))
    lost = with_path(orbit, position=nudged(orbit.path.position, 200, np.nan))
    assert failing(verify(lost, more=[farthest])) == [*CHECKS, "farthest"]


def test_a_check_that_is_no_number_fails_and_one_that_is_no_check_is_refused(orbit):
    nothing = verify(orbit, more=(lambda evidence: Check.of("nothing", np.nan, 1.0, "m"),))
    assert failing(nothing) == ["nothing"]
    with pytest.raises(ValueError, match="'<lambda>' gives must be"):
        verify(orbit, more=[lambda evidence: True])
    with pytest.raises(ValueError, match="more must be functions"):
        verify(orbit, more=farthest)
    with pytest.raises(ValueError, match="name that is taken: farthest"):
        verify(orbit, more=[farthest, farthest])
