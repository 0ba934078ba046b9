"""Marching forward: what the scheme keeps exactly, what it refuses, and the integrator it is measured by."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dmoc import (
    Engine,
    Force,
    LinearDrag,
    PointGravity,
    RotatingFrame,
    Spring,
    State,
    TransferProblem,
    UniformGravity,
    solve,
)
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.march import simulate
from dmoc.motion.mesh import node_fractions, node_weights, uniform_mesh
from dmoc.motion.path import DiscretePath
from dmoc.motion.reference import reference
from dmoc.scene.problem_file import load_problem

ORDERS = [2, 4, 6, 8]
REST = State((0, 0), (0, 0))


def scene(position, velocity, duration, effects=(), mass=1.0, **more):
    """A scene with a start; the goal is never looked at."""
    return TransferProblem(
        mass, State(position, velocity), State(position, velocity), duration, effects, **more
    )


def held_path(problem, control, order=2, hold=True, mesh=None):
    """Controls on a mesh as a path that stays at the start, as the reference takes it."""
    mesh = uniform_mesh(len(control) if hold else (len(control) - 1) * 2 // order) if mesh is None else mesh
    nodes = len(node_fractions(mesh, scheme(order)))
    position, velocity = problem.start.fixed()
    return DiscretePath(
        mesh,
        order,
        hold,
        problem.duration,
        np.tile(position, (nodes, 1)),
        np.asarray(control, float),
        np.full(nodes, problem.mass),
        velocity,
        velocity,
    )


def refer(problem, path):
    dynamics = Dynamics.of(problem)
    return reference(dynamics, path, problem.start_time, problem.start.fixed()[1])


# simulate

KEPLER = (PointGravity(1.0),)


@pytest.mark.parametrize("order", ORDERS)
def test_a_coast_without_effects_is_a_straight_line(order):
    path = simulate(scene((1, 2, 3), (0.5, 0, -1), 8.0, mass=3.0), steps=10, order=order)
    assert np.allclose(path.time, np.linspace(0, 8, 11), rtol=1e-15)
    assert np.allclose(path.position, [1, 2, 3] + path.time[:, None] * [0.5, 0, -1], rtol=0, atol=1e-14)
    assert np.allclose(path.velocity, [0.5, 0, -1], rtol=0, atol=1e-15)
    assert np.array_equal(path.mass, np.full(11, 3.0))
    assert np.allclose(path.energy, 0.625, rtol=1e-15)


@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize("order", ORDERS)
def test_a_constant_force_in_uniform_gravity_is_exact(order, hold):
    steps, s = 7, order // 2
    controls = np.tile([3.0, 1.0], (steps if hold else s * steps + 1, 1))
    problem = scene((1, 0), (0, 2), 5.0, [UniformGravity((0.0, -2.0))], mass=2.0)
    path = simulate(problem, controls, steps, order, hold)
    t, push = path.time[:, None], np.array([1.5, -1.5])
    assert np.allclose(path.position, [1, 0] + t * [0, 2] + 0.5 * t**2 * push, rtol=0, atol=1e-13)
    assert np.allclose(path.velocity, [0, 2] + t * push, rtol=0, atol=1e-13)


@pytest.mark.parametrize("options", [{}, {"hold": True}, {"order": 4}, {"order": 8}])
@pytest.mark.parametrize("name", ["orbit_raise", "drone_hop", "rendezvous"])
def test_a_solution_is_repeated(name, options):
    solution = solve(load_problem(name).make(), **options)
    path = simulate(solution.problem, solution)
    extent, speed = np.ptp(solution.position, axis=0).max(), np.abs(solution.velocity).max()
    assert np.allclose(path.position, solution.position[:: solution.order // 2], rtol=0, atol=1e-10 * extent)
    assert np.allclose(path.velocity, solution.velocity, rtol=0, atol=1e-10 * speed)
    assert np.allclose(path.momentum, solution.momentum, rtol=0, atol=1e-10 * speed)
    assert np.array_equal(path.time, solution.end_times)


def test_a_solution_is_repeated_with_the_mass_it_burns():
    engine = Engine(6.0, exhaust_velocity=20.0)
    problem = TransferProblem(2.0, REST, State((5, 1), (0, 0)), 5.0, actuator=engine)
    for options in ({}, {"order": 6}, {"hold": True}):
        solution = solve(problem, **options)
        path = simulate(problem, solution)
        assert np.allclose(path.mass, solution.path.mass[:: solution.order // 2], rtol=1e-12)
        assert np.allclose(path.position[-1], [5, 1], rtol=0, atol=1e-9)


def test_mass_burns_away_as_by_tsiolkovsky():
    """Thrust 0.6 N, exhaust 3 m/s, 2 kg, 5 s: v = 3 ln 2 and x = 4.6027922916; order 2, then 4."""
    exact = np.array([4.6027922916, 3 * np.log(2)])
    problem = TransferProblem(
        2.0, State([0], [0]), State([1], [0]), 5.0, actuator=Engine(1, exhaust_velocity=3)
    )
    errors = {}
    for order, steps in ((2, 80), (2, 160), (4, 20), (4, 40)):
        controls = np.tile([0.6, 0.6], (steps * order // 2 + 1, 1))
        path = simulate(problem, controls, steps, order)
        assert path.mass[-1] == pytest.approx(1.0, rel=1e-13)
        errors[order, steps] = np.abs([path.position[-1, 0], path.velocity[-1, 0]] - exact).max()
    assert errors[2, 160] < 1e-4
    assert np.log2(errors[2, 80] / errors[2, 160]) == pytest.approx(2, abs=0.3)
    assert np.log2(errors[4, 20] / errors[4, 40]) == pytest.approx(4, abs=0.3)


def test_time_starts_where_the_problem_says():
    @dataclass(frozen=True)
    class Sway(Force):
        def force(self, t, q, v, m):
            return t + 0 * q

    path = simulate(scene([0], [0], 2.0, [Sway()], start_time=3.0), steps=50, order=4)
    assert path.time[0] == 3.0 and path.time[-1] == 5.0
    assert path.velocity[-1, 0] == pytest.approx((25 - 9) / 2, rel=1e-12)


def test_a_duration_can_be_given_and_is_else_the_longest():
    problem = replace(scene([0], [1], 2.0), duration=(1.0, 6.0))
    assert simulate(problem, steps=3).time[-1] == 6.0
    assert simulate(problem, steps=3, duration=2.5).time[-1] == 2.5
    assert len(simulate(problem).time) == 401


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"controls": np.zeros((10, 2)), "steps": 10}, r"shape \(11, 2\) on this mesh; got \(10, 2\)"),
        ({"controls": np.zeros((11, 2)), "steps": 10, "hold": True}, r"shape \(10, 2\)"),
        ({"controls": np.zeros((11, 3)), "steps": 10}, r"shape \(11, 2\)"),
        ({"controls": np.full((11, 2), np.nan), "steps": 10}, "row 0 is not"),
        ({"steps": 0}, "at least 1; got 0"),
        ({"steps": 2.5}, "whole number"),
        ({"steps": True}, "whole number"),
        ({"order": 3}, "order must be one of 2, 4, 6, 8"),
        ({"duration": 0.0}, "duration must be greater than 0"),
        ({"duration": np.inf}, "duration must be a finite number"),
    ],
)
def test_bad_input_is_refused_with_the_remedy(arguments, words):
    with pytest.raises(ValueError, match=words):
        simulate(scene((0, 0), (0, 0), 1.0), **arguments)


def test_a_start_with_free_entries_is_refused():
    with pytest.raises(ValueError, match="without free entries"):
        simulate(TransferProblem(1.0, State((0, None), (0, 0)), REST, 1.0))


def test_a_solution_of_another_problem_is_refused():
    solution = solve(load_problem("point_to_point").make(), order=4)
    with pytest.raises(ValueError, match="another dimension"):
        simulate(scene((0, 0), (0, 0), 1.0), solution)


# what the scheme keeps


@pytest.mark.parametrize("reach", [0.1, 0.5, 1.5, 1.99])
def test_the_oscillator_keeps_its_own_energy_and_frequency(reach):
    """v^2 + w^2 (1 - h^2 w^2 / 4) x^2 is constant, and cos(w' h) = 1 - (h w)^2 / 2, for 20,000 steps."""
    w, steps = 1.3, 20_000
    h = reach / w
    path = simulate(scene([0.7], [0.4], steps * h, [Spring(w**2, [0.0])]), steps=steps)
    x, v = path.position[:, 0], path.velocity[:, 0]
    kept = v**2 + w**2 * (1 - reach**2 / 4) * x**2
    assert np.ptp(kept) < 1e-12 * kept[0]
    assert np.std(path.energy) > 1e-4 * path.energy[0]
    angle = np.arccos(1 - reach**2 / 2) * np.arange(steps + 1)
    slowness = 0.4 / (w * np.sqrt(1 - reach**2 / 4))
    assert np.allclose(x, 0.7 * np.cos(angle) + slowness * np.sin(angle), rtol=0, atol=1e-11 / (2 - reach))


def test_beyond_h_omega_two_it_grows_as_it_must():
    """At 2.01 by the larger root of z^2 - (2 - 2.01^2) z + 1, 1.22 a step."""
    path = simulate(scene([1.0], [0.0], 60 * 2.01, [Spring(1.0, [0.0])]), steps=60)
    growth = np.abs(path.position[-1, 0] / path.position[-2, 0])
    trace = 2 - 2.01**2
    assert growth == pytest.approx(np.abs(trace - np.sqrt(trace**2 - 4)) / 2, rel=1e-6)
    assert growth == pytest.approx(1.22, abs=0.005)


@pytest.mark.parametrize("hold", [False, True])
def test_the_momentum_changes_by_the_impulses_alone(hold):
    """Discrete Noether: p_N - p_0 and L_N - L_0 are the sums of the impulses and of their moments."""
    steps, mass, duration = 300, 2.5, 9.0
    controls = np.random.default_rng(7).normal(size=(steps if hold else steps + 1, 2))
    problem = scene((1, 0.2), (0.1, 1.1), duration, KEPLER, mass=mass)
    path = simulate(problem, 0.1 * controls, steps, hold=hold)
    q, p = path.position, path.momentum
    weights = duration * node_weights(path.time / duration, scheme(2))[:, None]
    pull = -weights * q / np.linalg.norm(q, axis=1, keepdims=True) ** 3
    push = 0.1 * controls / mass
    if hold:
        half = 0.5 * duration / steps * push
        impulse = np.concatenate([half, [[0, 0]]]) + np.concatenate([[[0, 0]], half])
    else:
        impulse = weights * push
    gross = np.abs(pull + impulse).sum()
    assert np.abs(p[-1] - p[0] - (pull + impulse).sum(axis=0)).max() < 1e-12 * gross
    spin = q[:, 0] * p[:, 1] - q[:, 1] * p[:, 0]
    moment = q[:, 0] * impulse[:, 1] - q[:, 1] * impulse[:, 0]
    assert abs(spin[-1] - spin[0] - moment.sum()) < 1e-12 * gross


@pytest.mark.parametrize("order", ORDERS)
def test_an_orbit_keeps_its_angular_momentum_and_never_loses_energy(order):
    """e = 0.5, 100 revolutions of 200 steps: momentum to round-off, energy within its band, no drift."""
    problem = scene((0.5, 0), (0, np.sqrt(3)), 200 * np.pi, KEPLER)
    path = simulate(problem, steps=20_000, order=order)
    q, p = path.position, path.momentum
    spin = q[:, 0] * p[:, 1] - q[:, 1] * p[:, 0]
    assert np.ptp(spin) < 1e-12 * spin[0]
    error = np.abs(path.energy / path.energy[0] - 1)
    assert error.max() < {2: 3e-3, 4: 1e-5, 6: 1e-8, 8: 1e-10}[order]
    thirds = error.reshape(-1)[:-1].reshape(4, -1).max(axis=1)
    assert thirds[-1] < 1.5 * thirds[0] + 1e-12


@pytest.mark.parametrize("order", ORDERS)
def test_a_turning_frame_only_turns(order):
    """A body at rest outside moves on a circle inside; the momentum is the velocity seen from outside."""
    rate = 0.7
    problem = scene((1, 0), (0, -rate), 4.0, [RotatingFrame(rate)])
    path = simulate(problem, steps=200, order=order)
    accuracy = {2: 3e-4, 4: 2e-9, 6: 1e-13, 8: 1e-13}[order]
    exact = np.stack([np.cos(rate * path.time), -np.sin(rate * path.time)], axis=1)
    assert np.abs(path.position - exact).max() < accuracy
    assert np.abs(path.momentum).max() < accuracy


# the independent integrator


@pytest.mark.parametrize("order", ORDERS)
def test_the_reference_takes_nodal_forces_as_polynomials(order):
    """F = degree s in every step: a polynomial of that degree all along is met exactly."""
    s, steps, duration = order // 2, 5, 3.0
    t = duration * node_fractions(uniform_mesh(steps), scheme(order))
    problem = scene([1.0], [-0.5], duration, mass=2.0)
    q, v = refer(problem, held_path(problem, (t**s)[:, None], order, hold=False))
    assert v[0] == pytest.approx(-0.5 + duration ** (s + 1) / (s + 1) / 2.0, rel=1e-13)
    gain = duration ** (s + 2) / (s + 1) / (s + 2) / 2.0
    assert q[0] == pytest.approx(1.0 - 0.5 * duration + gain, rel=1e-13)


@pytest.mark.parametrize("order", [2, 8])
def test_the_reference_holds_held_forces(order):
    """An oscillator under forces that jump, against the closed form of every step, on uneven steps."""
    w, mass, mesh = 2.0, 1.5, np.array([0.0, 0.1, 0.15, 0.5, 0.9, 1.0])
    controls = np.array([1.0, -2.0, 0.0, 3.0, -1.0])[:, None]
    problem = scene([0.3], [-0.2], 4.0, [Spring(mass * w**2, [0.0])], mass=mass)
    x, v = 0.3, -0.2
    for h, force in zip(4.0 * np.diff(mesh), controls[:, 0], strict=True):
        rest = force / (mass * w**2)
        x, v = (
            rest + (x - rest) * np.cos(w * h) + v / w * np.sin(w * h),
            v * np.cos(w * h) - (x - rest) * w * np.sin(w * h),
        )
    q, u = refer(problem, held_path(problem, controls, order, mesh=mesh))
    assert q[0] == pytest.approx(x, abs=1e-11)
    assert u[0] == pytest.approx(v, abs=1e-11)


def test_the_reference_burns_the_mass():
    problem = TransferProblem(
        2.0, State([0], [0]), State([1], [0]), 5.0, actuator=Engine(1, exhaust_velocity=3)
    )
    for path in (
        held_path(problem, np.tile([0.6, 0.6], (4, 1))),
        held_path(problem, np.tile([0.6, 0.6], (9, 1)), 4, hold=False),
    ):
        q, v = refer(problem, path)
        assert v[0] == pytest.approx(3 * np.log(2), rel=1e-12)
        assert q[0] == pytest.approx(4.6027922916, rel=1e-10)


def test_the_reference_feels_drag_and_a_turning_frame():
    """Drag alone decays; a frame that turns shows a straight line as a spiral."""
    drag = scene([0.0], [2.0], 3.0, [LinearDrag(0.8)], mass=2.0)
    q, v = refer(drag, held_path(drag, np.zeros((3, 1))))
    assert v[0] == pytest.approx(2 * np.exp(-0.4 * 3), rel=1e-11)
    assert q[0] == pytest.approx(5 * (1 - np.exp(-0.4 * 3)), rel=1e-11)
    turning = scene((1, 0), (0.3, 0.0), 3.0, [RotatingFrame(0.7)])
    q, v = refer(turning, held_path(turning, np.zeros((3, 2))))
    outside = np.array([1.0, 0.0]) + 3.0 * np.array([0.3, 0.7])
    back = np.array([[np.cos(2.1), np.sin(2.1)], [-np.sin(2.1), np.cos(2.1)]])
    assert np.allclose(q, back @ outside, rtol=0, atol=1e-10)


@pytest.mark.parametrize("options", [{}, {"hold": True}, {"order": 8}])
def test_the_reference_agrees_with_scipy(options):
    """SciPy's own DOP853 on the same forces, one run a step."""
    solution = solve(load_problem("orbit_raise").make(), steps=50, **options)
    path, rule = solution.path, scheme(solution.order)
    state = np.concatenate([path.position[0], path.start_velocity])
    ends = path.duration * path.mesh
    for k in range(solution.steps):
        nodes = path.control[k : k + 1] if path.hold else path.control[rule.degree * k :][: rule.degree + 1]

        def rate(t, y, k=k, nodes=nodes):
            share = (t - ends[k]) / (ends[k + 1] - ends[k])
            push = nodes[0] if path.hold else rule.values_at([share])[0] @ nodes
            return np.concatenate([y[2:], push - y[:2] / np.linalg.norm(y[:2]) ** 3])

        state = solve_ivp(rate, ends[k : k + 2], state, "DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    q, v = refer(solution.problem, path)
    assert np.allclose(q, state[:2], rtol=0, atol=1e-9)
    assert np.allclose(v, state[2:], rtol=0, atol=1e-9)


def test_the_reference_does_not_step_over_a_short_thrust():
    """One step of 400 with a force, on a body that else coasts."""
    controls = np.zeros((400, 1))
    controls[123] = 5.0
    problem = scene([0.0], [0.0], 40.0)
    q, v = refer(problem, held_path(problem, controls))
    assert v[0] == pytest.approx(0.5, rel=1e-13)
    assert q[0] == pytest.approx(0.5 * (40 - 12.35), rel=1e-13)


@pytest.mark.slow
def test_the_reference_says_where_motion_cannot_be_integrated():
    """A fall into a point mass ends in a singularity, not in the last state before it."""
    fall = scene((1, 0), (0, 0), 3.0, KEPLER)
    q, v = refer(fall, held_path(fall, np.zeros((10, 2))))
    assert np.isnan(q).all() and np.isnan(v).all()


def test_the_reference_of_a_body_that_stays_does_not_crawl():
    """Held against gravity: no extent and no speed to be accurate to."""
    hover = scene((0, 0), (0, 0), 3.0, [UniformGravity((0, -3.0))], mass=2.0)
    q, v = refer(hover, held_path(hover, np.tile([0.0, 6.0], (201, 1)), 4, hold=False))
    assert np.abs(q).max() < 1e-13 and np.abs(v).max() < 1e-13
