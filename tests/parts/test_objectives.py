"""What is minimised and maximised: signs, sums, a user's own, each against a closed form."""

import math

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    BoxForce,
    CircularOrbit,
    Effort,
    Engine,
    FinalHeight,
    FinalMass,
    FinalRadius,
    FreeForce,
    Fuel,
    Objective,
    State,
    Time,
    TransferProblem,
    UniformGravity,
    solve,
)

REST = State([0], [0])
ONE_AWAY = State([1], [0])


@pytest.mark.parametrize("steps", [10, 50])
def test_time_and_effort_together(steps):
    """min T + 6 N^2/(N^2 + 2) / T^3: T = (18 N^2/(N^2 + 2))^(1/4), and no force limit is needed."""
    problem = TransferProblem(1.0, REST, ONE_AWAY, (0.1, 50.0), objective=Time() + Effort())
    solution = solve(problem, steps=steps).raise_for_status()
    least = (18 * steps**2 / (steps**2 + 2)) ** 0.25
    assert solution.duration == pytest.approx(least, abs=1e-7)
    assert solution.objective == pytest.approx(4 / 3 * least, abs=1e-9)


def test_weights_move_the_balance():
    """min w T + v 6/T^3: T = (18 v/w)^(1/4); cubics are exact at order 6."""
    problem = TransferProblem(1.0, REST, ONE_AWAY, (0.1, 50.0), objective=0.5 * Effort() + 2 * Time())
    solution = solve(problem, order=6, steps=4).raise_for_status()
    assert solution.duration == pytest.approx((18 * 0.5 / 2) ** 0.25, abs=1e-7)


@pytest.mark.parametrize("objective", [Time(), 3 * Time(), Time() + 0 * Effort()])
def test_time_alone_needs_a_free_duration_and_a_limit(objective):
    with pytest.raises(ValueError, match="force limit"):
        TransferProblem(1.0, REST, ONE_AWAY, (0.1, 50.0), objective=objective)
    with pytest.raises(ValueError, match="free duration"):
        TransferProblem(1.0, REST, ONE_AWAY, 5.0, actuator=BoxForce(1), objective=objective)


def test_a_sum_is_minimised_or_maximised_as_its_terms_are():
    assert (Effort() - 2 * FinalMass()).sense == 1
    assert (FinalMass() - 0.1 * Time()).sense == -1
    assert (2 * (FinalRadius() - 3 * Effort())).terms == ((2.0, FinalRadius()), (-6.0, Effort()))
    assert (0.5 * Effort() + 2 * Time()).words() == "Least 0.5 Effort + 2 Time"
    assert (FinalMass() - 0.1 * Time()).words() == "Largest FinalMass - 0.1 Time"
    assert (Effort() + 2 * Effort()).unit_with(FreeForce()) == "N^2 s"
    for mixed in (lambda: Effort() + FinalMass(), lambda: Effort() - Time()):
        with pytest.raises(ValueError, match="subtract what is maximised"):
            mixed()
    with pytest.raises(ValueError, match="weight"):
        "twice" * Effort()


THRUST, EXHAUST, DRY, GRAVITY = 30.0, 50.0, 0.5, 9.81


def ascent(objective, goal, duration=(0.5, 20.0), thrust=THRUST):
    engine = Engine(thrust, exhaust_velocity=EXHAUST, dry_mass=DRY)
    start, pull = State([0], [0]), UniformGravity([-GRAVITY])
    return TransferProblem(1.0, start, goal, duration, effects=[pull], actuator=engine, objective=objective)


def test_the_highest_vertical_ascent():
    """All propellant at full thrust, then a coast: no drag asks for anything else (Tsiolkovsky)."""
    burn = (1.0 - DRY) * EXHAUST / THRUST
    ratio = math.log(1.0 / DRY)
    speed = EXHAUST * ratio - GRAVITY * burn
    height = EXHAUST * burn * (1 - ratio / (1.0 / DRY - 1)) - GRAVITY * burn**2 / 2 + speed**2 / (2 * GRAVITY)
    solution = solve(ascent(FinalHeight(), State([None], [0])), steps=100).raise_for_status()
    assert solution.objective == pytest.approx(height, rel=1e-3)
    assert solution.objective == pytest.approx(solution.position[-1, 0], rel=1e-12)
    assert solution.final_mass == pytest.approx(DRY, abs=1e-6)


def test_the_largest_final_mass_is_the_least_fuel():
    goal = State([10.0], [0])
    most = solve(ascent(FinalMass(), goal, 2.0), steps=50).raise_for_status()
    least = solve(ascent(Fuel(), goal, 2.0), steps=50).raise_for_status()
    assert most.objective == pytest.approx(1.0 - least.objective, rel=1e-7)
    assert most.objective == pytest.approx(most.final_mass, rel=1e-12)
    both = solve(ascent(FinalMass() - Fuel(), goal, 2.0), steps=50).raise_for_status()
    assert both.objective == pytest.approx(most.objective - least.objective, rel=1e-7)


def test_the_largest_radius_of_a_free_body():
    """x = F T^2/2 along one axis and both at full force in a box: the far corner."""
    problem = TransferProblem(
        2.0,
        State((0, 0), (0, 0)),
        State((None, None), (None, None)),
        3.0,
        actuator=BoxForce((1.0, 4.0)),
        objective=FinalRadius(center=(-1.0, 0.0)),
        guess=([0, 3], [(0, 0), (1, 1)]),
    )
    solution = solve(problem, steps=20).raise_for_status()
    corner = np.array([1.0, 4.0]) * 3.0**2 / 2 / 2.0
    assert solution.objective == pytest.approx(np.hypot(corner[0] + 1, corner[1]), rel=1e-6)


class Bolza(Objective):
    """Running cost on position and velocity."""

    unit = "m^2 s"

    def running(self, t, q, v, u, m):
        return 0.5 * (ca.dot(q, q) + ca.dot(v, v))


def test_a_running_cost_on_position_and_velocity():
    """Singular linear-quadratic problem: u = -1 until 1.4137640876, then u = x = c cosh(T - t)."""
    problem = TransferProblem(
        1.0, State([0], [1]), State([None], [None]), 5.0, actuator=BoxForce(1.0), objective=Bolza()
    )
    solution = solve(problem, steps=200, hold=True).raise_for_status()
    assert solution.objective == pytest.approx(0.376991930288, abs=1e-4)


class Nearly(Objective):
    """Effort and a price for missing x = 1."""

    def rate(self, actuator, t, q, v, u, m):
        return 0.5 * ca.dot(u, u)

    def terminal(self, t, q, v, m):
        return 0.5 * 7.0 * (q[0] - 1) ** 2


def test_a_terminal_cost_of_ones_own():
    """u = lambda (T - t) with lambda = k (1 - x_T) gives J = k/2 / (1 + k T^3/3)."""
    problem = TransferProblem(1.0, REST, State([None], [None]), 2.0, objective=Nearly())
    solution = solve(problem, order=6, steps=4).raise_for_status()
    assert solution.objective == pytest.approx(3.5 / (1 + 7.0 * 8 / 3), rel=1e-9)


def test_objectives_without_a_meaning_are_refused():
    for objective, words in (
        (FinalMass(), "burns propellant"),
        (FinalRadius(center=(0, 0)), "center has 2"),
        (FinalHeight(axis=2), "axis"),
        (Effort() - FinalMass(), "burns propellant"),
    ):
        with pytest.raises(ValueError, match=words):
            TransferProblem(1.0, REST, ONE_AWAY, 5.0, actuator=BoxForce(1), objective=objective)
    with pytest.raises(ValueError, match="axis"):
        TransferProblem(
            1.0, State((0, 0), (0, 0)), CircularOrbit(1.0, 1.0), 5.0, objective=FinalHeight(axis=True)
        )
