"""Half the force in the end momenta gives second order; any other end treatment loses to first order.

x'' = -w^2 x + u from (1, 0.5) to (-0.3, 0.2) in 2 s, w = 1.3, least 1/2 integral u^2. All variants are
equality-constrained quadratic programmes, so the losing ones are solved here by their linear optimality
conditions: positions x_0 .. x_N and forces f_0 .. f_N, equation (16) inside, trapezoidal cost, and a share
of h (f + F) in the end momenta of 0 (no force), 1/2 (discrete Legendre transforms) or 1 (the slip in M. Ekal's
equation (14)).
"""

import numpy as np
import pytest

from dmoc import Spring, State, TransferProblem, solve

FREQUENCY, DURATION, START, GOAL = 1.3, 2.0, (1.0, 0.5), (-0.3, 0.2)
OPTIMUM = 1.0562831359694393
STEPS = (20, 40, 80, 160, 320)


def optimum_by_gramian():
    """The continuous optimum in closed form: 1/2 miss^T G^-1 miss with the reachability Gramian G."""
    w, T = FREQUENCY, DURATION
    flow = np.array([[np.cos(w * T), np.sin(w * T) / w], [-w * np.sin(w * T), np.cos(w * T)]])
    miss = np.array(GOAL) - flow @ np.array(START)
    first = (T / 2 - np.sin(2 * w * T) / (4 * w)) / w**2
    mixed = np.sin(w * T) ** 2 / (2 * w**2)
    last = T / 2 + np.sin(2 * w * T) / (4 * w)
    return 0.5 * miss @ np.linalg.solve([[first, mixed], [mixed, last]], miss)


def dense_objective(steps, end_share):
    """Optimal objective with `end_share` of h times the force in both end momenta."""
    n, h = steps + 1, DURATION / steps
    cost = np.zeros(2 * n)
    cost[n:] = h
    cost[[n, -1]] = h / 2
    rows, right = np.zeros((n + 2, 2 * n)), np.zeros(n + 2)
    stiffness = FREQUENCY**2
    for k in range(1, steps):
        rows[k - 1, [k - 1, k, k + 1]] = -1, 2 - h**2 * stiffness, -1
        rows[k - 1, n + k] = h**2
    rows[-4, 0], rows[-3, steps] = 1, 1
    # v_0 = (x_1 - x_0)/h - share h (f_0 + F_0),  v_N = (x_N - x_{N-1})/h + share h (f_N + F_N)
    rows[-2, [0, 1]] = -1 / h + end_share * h * stiffness, 1 / h
    rows[-2, n] = -end_share * h
    rows[-1, [steps - 1, steps]] = -1 / h, 1 / h - end_share * h * stiffness
    rows[-1, -1] = end_share * h
    right[-4:] = START[0], GOAL[0], START[1], GOAL[1]
    system = np.block([[np.diag(cost), rows.T], [rows, np.zeros((n + 2, n + 2))]])
    unknowns = np.linalg.solve(system, np.concatenate([np.zeros(2 * n), right]))[: 2 * n]
    return 0.5 * unknowns @ (cost * unknowns)


def dmoc_objective(steps, hold=False):
    mass = 2.0
    problem = TransferProblem(
        mass,
        State(START[0], START[1]),
        State(GOAL[0], GOAL[1]),
        DURATION,
        effects=[Spring(mass * FREQUENCY**2, (0,))],
    )
    solution = solve(problem, steps=steps, hold=hold).raise_for_status()
    return solution.objective / mass**2


def observed_order(errors):
    return -np.polyfit(np.log(STEPS[: len(errors)]), np.log(np.abs(errors)), 1)[0]


def errors_of(objective, meshes=STEPS):
    return np.array([objective(steps) - OPTIMUM for steps in meshes])


def test_reference_is_the_closed_form():
    assert optimum_by_gramian() == pytest.approx(OPTIMUM, rel=1e-14)


@pytest.mark.parametrize(
    "end_share, error_at_80",
    [(0.0, 6.0e-2), (1.0, -9.6e-2)],
    ids=["no force in the end momenta", "the whole force in the end momenta"],
)
def test_other_end_treatments_are_of_first_order(end_share, error_at_80):
    errors = errors_of(lambda steps: dense_objective(steps, end_share))
    assert errors[2] == pytest.approx(error_at_80, rel=0.03)
    assert 0.8 < observed_order(errors) < 1.2


def test_half_the_force_is_of_second_order():
    errors = errors_of(lambda steps: dense_objective(steps, 0.5))
    assert errors[2] == pytest.approx(-3.5e-4, rel=0.03)
    assert observed_order(errors) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("hold, error_at_80", [(False, -3.5e-4), (True, 1.4e-5)], ids=["nodal", "held"])
def test_dmoc_is_of_second_order(hold, error_at_80):
    errors = errors_of(lambda steps: dmoc_objective(steps, hold), STEPS[:4])
    assert errors[2] == pytest.approx(error_at_80, rel=0.03)
    assert observed_order(errors) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("steps", [10, 80])
def test_dmoc_is_the_half_force_variant(steps):
    assert dmoc_objective(steps) == pytest.approx(dense_objective(steps, 0.5), rel=1e-10)
    for share in (0.0, 1.0):
        assert abs(dmoc_objective(steps) / dense_objective(steps, share) - 1) > 0.01
