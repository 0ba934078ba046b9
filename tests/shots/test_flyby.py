"""Falls past the smaller of two attractors: the guess is the path of least effort, on a mesh to match."""

import numpy as np
import pytest

from dmoc import Effort, Engine, FreeForce, State, TransferProblem, solve, three_body, verify
from dmoc.guess.starting import starting_guess
from dmoc.meshes.choices import graded_guess, steps_past
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.mesh import uniform_mesh
from dmoc.shots.flyby import least_effort_past

# The states and durations of random forces flown by SciPy, and their efforts: no optimum costs more. Blended
# coasts led to 2.077 and 1.633, on the other side of the smaller attractor.
STARTS = (
    ((1.0418389147195097, 0.0973713918406376, -0.1681474592555549), (-0.239028021, -0.138871452, 0.098320789)),
    ((0.9745576828320717, -0.0857787446481892, 0.1438957334913334), (-0.224163656, -0.156142991, 0.074319591)),
)
GOALS = (
    (
        (1.1166873084403786, -0.0777998251058622, -0.1856061089841535),
        (-0.002349645, -0.138226763, -0.048410597),
    ),
    ((0.8765708791785477, -0.0704702301202181, 0.1092522577204309), (-0.136494525, 0.469939430, -0.501406996)),
)
DURATIONS, FLOWN = (0.8717590458388302, 0.7525744891552472), (0.011447, 0.00230882)
LEAST = (0.0057566, 0.0012431)


def fall(i, **parts):
    ends = State(*STARTS[i]), State(*GOALS[i])
    return TransferProblem(1.0, *ends, DURATIONS[i], effects=three_body(0.1), **parts)


@pytest.mark.parametrize("i", [0, 1])
def test_the_answer_passes_on_the_right_side(i):
    answer = solve(fall(i))
    assert answer.success and verify(answer).ok
    assert answer.objective == pytest.approx(LEAST[i], rel=1e-3)
    assert answer.objective < FLOWN[i]


def test_a_tolerance_and_an_engine_lead_to_the_same_path():
    assert solve(fall(1), order=4, tol=1e-3).objective == pytest.approx(LEAST[1], rel=1e-3)
    engine = Engine(0.3, exhaust_velocity=1e4)
    assert solve(fall(1, actuator=engine, objective=Effort())).objective == pytest.approx(LEAST[1], rel=1e-3)


def test_the_guess_meets_the_equations_of_motion():
    problem = fall(0)
    states = problem.start.fixed(), problem.goal.fixed()
    fractions = np.linspace(0.0, 1.0, 100_001)
    position, velocity, force = least_effort_past(problem, problem.duration, states)(fractions)
    times = problem.duration * fractions
    pull = Dynamics.of(problem).acceleration(
        times[None], position.T, velocity.T, np.ones((1, 100_001)), force.T
    )
    change = np.gradient(velocity, times, axis=0, edge_order=2)
    assert np.abs(change - pull.full().T).max() < 4e-4 * np.abs(change).max()
    assert np.allclose(position[-1], states[1][0], atol=1e-5)
    assert np.allclose(velocity[-1], states[1][1], atol=1e-4)


def test_the_guess_keeps_its_ends_and_has_the_controls_of_the_actuator():
    for parts, columns in (({}, 3), ({"actuator": Engine(0.3, exhaust_velocity=5.0)}, 4)):
        for hold in (False, True):
            guess = starting_guess(fall(0, **parts), uniform_mesh(50), 4, hold)
            assert guess.control.shape == (50 if hold else 101, columns)
            assert np.array_equal(guess.position[[0, -1]], [STARTS[0][0], GOALS[0][0]])


def test_steps_of_equal_angles_follow_a_fall_that_equal_times_would_leap():
    problem = fall(1)
    guess = graded_guess(problem, 100, 8, False)
    rates = problem.attraction.rates(guess.position[::4])
    angles = 0.5 * (rates[1:] + rates[:-1]) * np.diff(guess.mesh) * guess.duration
    assert angles.max() < 3 * angles.mean()
    assert np.diff(guess.mesh).max() > 100 * np.diff(guess.mesh).min()
    assert steps_past(problem, guess, 4) == pytest.approx(10 * angles.sum(), rel=0.1)


def test_without_a_fall_the_mesh_has_no_more_steps():
    ends = State((0.7, 0.0, 0.0), (0.0, 0.3, 0.0)), State((0.75, 0.1, 0.0), (0.0, 0.2, 0.0))
    calm = TransferProblem(1.0, *ends, 0.5, effects=three_body(0.01), actuator=FreeForce())
    guess = starting_guess(calm, uniform_mesh(50), 4, False)
    assert steps_past(calm, guess, 4) == 0
    # The guess is the optimum but for the mesh.
    answer = solve(calm, order=8, steps=20)
    assert answer.success and answer.iterations <= 6
