"""Conditions of a user's own at the ends, beside what a State fixes."""

import math

import casadi as ca
import numpy as np
import pytest

from dmoc import Boundary, Condition, Row, State, TransferProblem, solve, transcribe

REST = State((0, 0), (0, 0))


def test_to_a_line_and_to_a_line_at_rest():
    """The shortest way, to the foot of the perpendicular: 3/2 d^2/T^3 flying through, 6 d^2/T^3 to rest."""
    line = lambda t, q, v, m: 3 * q[0] + 4 * q[1] - 10  # noqa: E731 - a formula
    for state, factor in ((None, 1.5), (State(None, (0, 0)), 6.0)):
        goal = Condition(line, "line", scale=10.0, state=state)
        solution = solve(TransferProblem(1.0, REST, goal, 2.0), order=6, steps=4).raise_for_status()
        assert solution.objective == pytest.approx(factor * 2.0**2 / 2.0**3, rel=1e-9)
        np.testing.assert_allclose(solution.position[-1], [1.2, 1.6], rtol=0, atol=1e-8)


def test_a_condition_on_the_velocity_beside_a_fixed_position():
    """Arrive at x = 1 with the speed 1, in the best direction: one of those is straight on."""
    goal = Condition(lambda t, q, v, m: ca.dot(v, v) - 1, "speed", state=State((1, 0), None))
    problem = TransferProblem(1.0, REST, goal, 1.0, guess=([0, 1], [(0, 0), (1, 0)]))
    solution = solve(problem, order=6, steps=4).raise_for_status()
    np.testing.assert_allclose(solution.path.goal_velocity, [1, 0], rtol=0, atol=1e-6)
    assert solution.objective == pytest.approx(6 - 6 + 2, rel=1e-8)


def test_a_condition_on_the_time_makes_a_moving_wall():
    """Reach the wall x = 1 + t within a duration that is free and cheap: dJ/dT = 0 gives the least."""
    goal = Condition(lambda t, q, v, m: [q[0] - 1 - t, v[0] - 1], "wall")
    problem = TransferProblem(1.0, State([0], [0]), goal, (0.5, 9.0))
    solution = solve(problem, order=6, steps=4).raise_for_status()
    duration = solution.duration
    assert solution.position[-1, 0] == pytest.approx(1 + duration, rel=1e-9)
    assert solution.objective == pytest.approx(6 / duration**3 + 6 / duration**2 + 2 / duration, rel=1e-9)


def test_rows_carry_the_name_and_the_scale():
    goal = Condition(lambda t, q, v, m: [q[0] - 1, 50 * v[1]], "gate", scale=(1.0, 50.0))
    nlp = transcribe(TransferProblem(1.0, REST, goal, 2.0), 4)
    names = [nlp.rows.name_of(i) for i in range(nlp.rows.size)]
    assert names[-2:] == ["goal.condition.gate_1", "goal.condition.gate_2"]
    q, v = ca.DM([4.0, 0.0]), ca.DM([0.0, 3.0])
    assert [float(row.expression) for row in goal.rows(0, q, v, 1)] == [3.0, 3.0]


def test_another_condition_needs_a_rebuild():
    def gate(t, q, v, m):
        return q[0] - 1

    problem = TransferProblem(1.0, REST, Condition(gate), 2.0)
    nlp = transcribe(problem, 4)
    nlp.accepts(TransferProblem(1.0, REST, Condition(gate, state=State((None, 3), (None, 0))), 3.0))
    with pytest.raises(ValueError, match="goal"):
        nlp.accepts(TransferProblem(1.0, REST, Condition(lambda t, q, v, m: q[0] - 2), 2.0))


class Ring(Boundary):
    """A boundary of one's own: on a ring, in metres."""

    dimension = 2

    def rows(self, t, q, v, m):
        return [Row("ring", ca.sqrt(ca.dot(q, q)) - 3000.0, 0.0, 0.0, "m")]

    def estimate(self, t, near=None):
        return np.array([3000.0, 0.0]), np.full(2, np.nan)

    def words(self):
        return "on a ring"


def test_a_boundary_of_ones_own_may_state_rows_in_metres():
    problem = TransferProblem(1.0, State((0, 500.0), (0, 0)), Ring(), 10.0)
    solution = solve(problem, order=6, steps=4).raise_for_status()
    assert solution.objective == pytest.approx(1.5 * 2500.0**2 / 10**3, rel=1e-9)
    np.testing.assert_allclose(solution.position[-1], [0, 3000.0], rtol=0, atol=1e-3)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: Condition(3.0), "function"),
        (lambda: Condition(lambda t, q, v, m: t, ""), "name"),
        (lambda: Condition(lambda t, q, v, m: t, scale=-1), "scale"),
        (lambda: Condition(lambda t, q, v, m: t, scale=(1, 2), state=REST), "1 values"),
        (lambda: Condition(lambda t, q, v, m: t, state=(0, 0)), "State"),
        (lambda: Condition(lambda t, q, v, m: t, scale=math.nan), "scale"),
    ],
)
def test_conditions_without_a_meaning_are_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()
