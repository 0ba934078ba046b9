"""A guess may be a function, arrays, with controls or not, or a solution: all lead to the same optimum."""

import numpy as np
import pytest

from dmoc import BallForce, State, TransferProblem, solve
from dmoc.guess.starting import starting_guess
from dmoc.motion.mesh import uniform_mesh
from dmoc.scene.problem_file import load_problem

ORBIT_RAISE = load_problem("orbit_raise").make()


def spiral(t):
    """From radius 1 outwards, through one and a half revolutions."""
    part = t / ORBIT_RAISE.duration
    return (1 + 0.5 * part) * np.array([np.cos(3 * np.pi * part), np.sin(3 * np.pi * part)])


def guesses():
    times = np.linspace(0, ORBIT_RAISE.duration, 200)
    places = np.array([spiral(t) for t in times])
    return {
        "function": spiral,
        "arrays": (times, places),
        "arrays with controls": (times, places, np.zeros((200, 2))),
        "solution": solve(ORBIT_RAISE),
        "path": solve(ORBIT_RAISE).path,
    }


@pytest.mark.parametrize("order, steps", [(2, 50), (2, 400), (4, 50), (4, 400), (6, 50), (6, 100), (8, 50)])
def test_all_kinds_of_guesses_lead_to_one_optimum(order, steps):
    costs = [
        solve(ORBIT_RAISE, order=order, steps=steps, guess=guess).objective for guess in guesses().values()
    ]
    assert max(costs) == pytest.approx(min(costs), rel=1e-6)
    assert costs[0] == pytest.approx(0.00169, rel=0.02)


@pytest.mark.parametrize("hold", [False, True])
def test_controls_of_a_guess_are_carried_to_the_mesh(hold):
    times = np.array([0.0, 1.0, 2.0])
    controls = np.column_stack([times, 1 - times])
    problem = TransferProblem(1.0, State((0, 0), (0, 0)), State((1, 0), (0, 0)), 2.0, actuator=BallForce(3.0))
    path = starting_guess(problem, uniform_mesh(4), 2, hold, (times, np.column_stack([times, times]), controls))
    at = np.array([0.25, 0.75, 1.25, 1.75]) if hold else np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    np.testing.assert_allclose(path.control, np.column_stack([at, 1 - at]))


@pytest.mark.parametrize("controls", [np.zeros((3, 1)), np.zeros((2, 2)), np.full((3, 2), np.nan)])
def test_controls_of_another_shape_are_refused(controls):
    times = np.array([0.0, 6.0, 12.0])
    places = np.array([spiral(t) for t in times])
    with pytest.raises(ValueError, match=r"needs finite numbers of shape \(3, 2\): one row a time, with x, y"):
        solve(ORBIT_RAISE, guess=(times, places, controls))
