"""The starting guess of a transfer to an orbit of which any point will do."""

import math

import numpy as np
import pytest

from dmoc import (
    BallForce,
    CircularOrbit,
    Engine,
    Orbit,
    PointGravity,
    State,
    Time,
    TransferProblem,
    solve,
    transcribe,
)
from dmoc.guess.spiral import Spiral
from dmoc.guess.starting import guess_duration, starting_guess
from dmoc.motion.mesh import uniform_mesh

GRAVITY = [PointGravity(1.0)]
CIRCLE = State((1, 0), (0, 1))


def on_circle(radius, angle, tilt=0.0):
    """Position and velocity on a circular orbit around a unit attractor, tilted about the x axis."""
    x, y = math.cos(angle), math.sin(angle)
    turn = np.array([[1, 0, 0], [0, math.cos(tilt), -math.sin(tilt)], [0, math.sin(tilt), math.cos(tilt)]])
    return radius * turn @ [x, y, 0], math.sqrt(1 / radius) * turn @ [-y, x, 0]


@pytest.mark.parametrize("from_goal", [False, True])
def test_a_spiral_has_the_orbits_of_its_ends_and_turns_at_their_pace(from_goal):
    start, goal = on_circle(1.0, 0.3), on_circle(2.0, 1.0, tilt=0.4)
    spiral = Spiral(1.0, np.zeros(3), 50.0, start, goal, from_goal)
    fractions = np.linspace(0, 1, 4001)
    q, v = spiral.states(fractions)
    for place, state in ((0, start), (-1, goal)):
        np.testing.assert_allclose(np.cross(q[place], v[place]), np.cross(*state), rtol=0, atol=1e-9)
        assert np.linalg.norm(q[place]) == pytest.approx(np.linalg.norm(state[0]), rel=1e-9)
    kept = -1 if from_goal else 0
    np.testing.assert_allclose(q[kept], (goal if from_goal else start)[0], rtol=0, atol=1e-9)
    # the path's own speed is that of the orbits of the moment, but for what the orbit changes
    slope = np.gradient(q, 50.0 * fractions, axis=0)
    assert np.abs(slope - v)[2:-2].max() < 1.5 / 50.0


def test_what_a_spiral_takes_is_what_edelbaum_says():
    """From 7000 km and 28.5 degrees to the geostationary orbit: 5.7838 km/s."""
    mu = 398_600.4418
    scale = math.sqrt(mu)
    ends = [(q, scale * v) for q, v in (on_circle(7000.0, 0.0, math.radians(28.5)), on_circle(42_166.0, 1.0))]
    assert Spiral(mu, np.zeros(3), 1.0, *ends).velocity_change == pytest.approx(5.783775, abs=1e-6)


@pytest.mark.parametrize("order", [2, 4, 8])
def test_the_guess_meets_the_discrete_equations_and_the_goal(order):
    problem = TransferProblem(2.0, CIRCLE, CircularOrbit(1.5, 1.0), 12.0, effects=GRAVITY)
    guess = starting_guess(problem, uniform_mesh(60), order, hold=False)
    nlp = transcribe(problem, 60, order)
    x, p = nlp.pack(guess), nlp.parameters(problem)
    lower, upper, low, high = nlp.bounds(problem)
    rows = nlp.assembly.constraints(x, p).full().ravel()
    assert np.maximum(low - rows, rows - high).max() < 1e-9
    assert np.maximum(lower - x, x - upper).max() < 1e-9


@pytest.mark.parametrize("radius, duration", [(1.5, 12.0), (1.2, 18.0), (1.5, 24.0), (0.8, 12.0)])
def test_several_revolutions_take_few_iterations(radius, duration):
    goal = CircularOrbit(radius, 1.0)
    solution = solve(TransferProblem(1.0, CIRCLE, goal, duration, effects=GRAVITY), steps=100)
    assert solution.raise_for_status().iterations <= 40
    # no more than a spiral of constant thrust along the velocity, which it beats by its freedom
    slow = (1 - math.sqrt(1 / radius)) ** 2 / (2 * duration)
    assert solution.objective < 1.3 * slow


def test_an_open_start_is_an_open_goal_seen_backward():
    forth = TransferProblem(1.0, CIRCLE, CircularOrbit(1.5, 1.0), 10.0, effects=GRAVITY)
    mirrored = State((1, 0), (0, -1))
    back = TransferProblem(1.0, CircularOrbit(1.5, 1.0, clockwise=True), mirrored, 10.0, effects=GRAVITY)
    there, here = (solve(problem, steps=60).raise_for_status() for problem in (forth, back))
    assert here.objective == pytest.approx(there.objective, rel=1e-8)
    np.testing.assert_allclose(here.position[::-1], there.position, rtol=0, atol=1e-5)


@pytest.mark.parametrize("bounds", [(1.0, 10.0), (0.1, 100.0)])
@pytest.mark.parametrize("radius, least", [(1.525, 3.3192203), (0.7, 2.4732711)])
def test_least_time_does_not_depend_on_the_bounds_tried(bounds, radius, least):
    """The values are those of `tol=1e-6` from one pair of bounds."""
    problem = TransferProblem(
        1.0,
        CIRCLE,
        CircularOrbit(radius, 1.0),
        bounds,
        effects=GRAVITY,
        actuator=Engine(0.1405, exhaust_velocity=0.1405 / 0.0749),
        objective=Time(),
    )
    assert solve(problem, steps=100).raise_for_status().objective == pytest.approx(least, abs=1e-6)


def test_an_orbit_whose_point_is_given_is_reached_there():
    """With the argument of latitude asked for, nothing is left for the spiral to find."""
    goal = Orbit(1.0, a=1.5, e=0, argp=0.0, nu=math.pi / 2, center=(0, 0))
    fixed = State((0, 1.5), (-math.sqrt(1 / 1.5), 0))
    costs = [
        solve(TransferProblem(1.0, CIRCLE, end, 8.0, effects=GRAVITY), steps=60).raise_for_status().objective
        for end in (goal, fixed)
    ]
    assert costs[0] == pytest.approx(costs[1], rel=1e-8)


@pytest.mark.parametrize("limit, least, most", [(0.1, 1.5, 40.0), (1e-4, 1e3, 1e4), (1e-6, 1e5, 1e6)])
def test_a_guessed_duration_is_long_enough_for_the_thrust_however_wide_the_bounds(limit, least, most):
    """Between circles of radius 1 and 1.5 a spiral takes 0.1835 of velocity."""
    goal = State((1.5 * math.cos(2), 1.5 * math.sin(2)), (-math.sin(2) / 1.5**0.5, math.cos(2) / 1.5**0.5))
    problem = TransferProblem(
        1.0, CIRCLE, goal, (0.1, 1e9), effects=GRAVITY, actuator=BallForce(limit), objective=Time()
    )
    assert least < guess_duration(problem) < most


def test_a_place_that_is_left_open_is_where_the_known_velocities_lead():
    problem = TransferProblem(1.0, State((1, 5), (0, 2)), State((None, None), (4, None)), 3.0)
    assert starting_guess(problem, uniform_mesh(4), 2, False).position[-1] == pytest.approx([1 + 6, 5 + 3])
    back = TransferProblem(1.0, State((None, 0), (4, 0)), State((1, 5), (0, 2)), 3.0)
    assert starting_guess(back, uniform_mesh(4), 2, False).position[0] == pytest.approx([1 - 6, 0])
