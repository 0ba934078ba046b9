"""Fast, close and unstable motion: steps at the edge of stability, a flyby at e = 0.99, long arcs near L1.

Pass criteria: just below h omega of its own limit each order stays bounded over 4,000 steps, just above
it grows by what its one-step matrix says and, where that is more than 0.1 % a step, is refused. The
flyby is right to the order of the scheme on a mesh graded as r^1.5, and a mesh that misses it fails a
check. Two revolutions that amplify errors by 1e7 are judged by what they amplify.
"""

import numpy as np
import pytest
from scipy.optimize import brentq

from dmoc import (
    PointGravity,
    RotatingFrame,
    Spring,
    State,
    TransferProblem,
    simulate,
    solve,
    three_body,
    verify,
)
from dmoc.guess.starting import starting_guess
from dmoc.motion.mesh import uniform_mesh
from dmoc.motion.stability import _exponential
from dmoc.solver.ladder import Ladder

# h omega at which each order first loses stability
LIMITS = {2: 2.0, 4: 2 * np.sqrt(2.0), 6: 3.1129, 8: 3.14043}


def spring(duration):
    """From one place to another on a spring of rate 1."""
    return TransferProblem(
        1.0, State([1.0], [0.3]), State([0.5], [0.0]), duration, effects=[Spring(1.0, (0.0,))]
    )


def half_trace(order, reach):
    """Of the one-step matrix of x'' = -x at h = reach, from two marches of one step."""
    ends = []
    for q, v in ((1.0, 0.0), (0.0, 1.0)):
        start = State([q], [v])
        case = TransferProblem(1.0, start, start, reach, effects=[Spring(1.0, (0.0,))])
        ends.append(simulate(case, steps=1, order=order))
    return 0.5 * (ends[0].position[-1, 0] + ends[1].momentum[-1, 0])


@pytest.mark.parametrize("order", LIMITS)
def test_each_order_is_stable_up_to_its_own_limit(order):
    edge = brentq(lambda reach: abs(half_trace(order, reach)) - 1, LIMITS[order] - 2e-3, LIMITS[order] + 1e-3)
    assert edge == pytest.approx(LIMITS[order], abs=1e-3)
    steps, below, above = 4000, edge * (1 - 3e-4), edge * (1 + 3e-4)
    assert np.abs(simulate(spring(steps * below), steps=steps, order=order).position).max() < 1e4
    grown = np.abs(simulate(spring(steps * above), steps=steps, order=order).position[-10:]).max()
    assert np.log(grown) == pytest.approx(steps * np.arccosh(abs(half_trace(order, above))), rel=0.1, abs=2.0)


@pytest.mark.parametrize("order", LIMITS)
def test_a_mesh_beyond_the_limit_is_refused_and_one_below_it_is_not(order):
    steps, edge = 60, LIMITS[order]
    found = solve(spring(steps * 0.995 * edge), order=order, steps=steps)
    assert found.success and verify(found)["stability"].ok
    if order == 8:
        # its first gap, a thousandth wide, grows by a thousandth a step at most; the second one counts
        edge = 6.07
    with pytest.raises(ValueError, match="unstable"):
        solve(spring(steps * 1.005 * edge), order=order, steps=steps)


def test_without_the_refusal_a_stiff_spring_is_solved_wrong_and_its_march_agrees():
    """At h omega = 2.05 the march of the forces meets the path, and the cost is 16 times too small."""
    problem, true = spring(20 * 2.05), solve(spring(20 * 2.05), order=8, steps=100)
    ladder = Ladder(problem)
    with ladder.interrupt:
        rung = ladder.solve_on(starting_guess(problem, uniform_mesh(20), 2, False))
    assert rung.solved
    wrong = ladder.solution(rung)
    report = verify(wrong)
    assert report["residual"].ok and report["rollout"].ok
    assert not report["stability"].ok
    assert wrong.objective < 0.1 * true.objective
    assert verify(true).ok


ECCENTRICITY, ANOMALY = 0.99, 1.0


def ellipse(anomaly):
    """Position, velocity and time at an eccentric anomaly; semi-major axis and mu are 1."""
    e = ECCENTRICITY
    side = np.sqrt(1 - e * e)
    q = np.array([np.cos(anomaly) - e, side * np.sin(anomaly)])
    v = np.array([-np.sin(anomaly), side * np.cos(anomaly)]) / (1 - e * np.cos(anomaly))
    return q, v, anomaly - e * np.sin(anomaly)


def flyby():
    """Past the attractor at a hundredth of the semi-major axis, to a place 2e-4 off where a coast would end."""
    (q0, v0, t0), (q1, v1, t1) = ellipse(-ANOMALY), ellipse(ANOMALY)

    def arc(t):
        return ellipse(brentq(lambda anomaly: ellipse(anomaly)[2] - t0 - t, -2.0, 2.0, xtol=1e-14))[0]

    goal = State(1.0002 * q1, v1)
    return TransferProblem(1.0, State(q0, v0), goal, t1 - t0, effects=[PointGravity(1.0)], guess=arc)


def graded(steps):
    """h ~ r^1.5 along the ellipse."""
    anomaly = np.linspace(-ANOMALY, ANOMALY, 4001)
    r, t = 1 - ECCENTRICITY * np.cos(anomaly), ellipse(anomaly)[2]
    density = r**-0.5
    share = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(anomaly))])
    mesh = (np.interp(np.linspace(0, share[-1], steps + 1), share, t) - t[0]) / (t[-1] - t[0])
    mesh[0], mesh[-1] = 0.0, 1.0
    return mesh


# 100, 200 and 400 graded steps of order 8 agree to ten digits
FLYBY = 2.876282697e-6


@pytest.mark.parametrize(("order", "steps", "error"), [(8, 100, 1e-7), (4, 400, 2e-5), (2, 1600, 0.02)])
def test_a_flyby_is_right_on_a_graded_mesh(order, steps, error):
    found = solve(flyby(), order=order, mesh=graded(steps))
    assert found.success and verify(found).ok
    assert found.objective == pytest.approx(FLYBY, rel=error)
    assert np.linalg.norm(found.position, axis=1).min() < 0.0101


@pytest.mark.parametrize(("order", "steps", "error"), [(None, None, 3e-3), (2, 1600, 0.02), (8, 32, 1e-4)])
def test_steps_are_graded_where_the_guess_passes_near_an_attractor(order, steps, error):
    found = solve(flyby(), order=order, steps=steps)
    assert found.success and verify(found).ok
    assert found.objective == pytest.approx(FLYBY, rel=error)


@pytest.mark.parametrize(("order", "wrong"), [(2, 1e4), (4, 100)])
def test_a_flyby_on_equal_steps_is_wrong_and_said_so(order, wrong):
    found = solve(flyby(), order=order, mesh=np.linspace(0, 1, 401))
    assert found.success and found.objective > wrong * FLYBY
    report = verify(found)
    assert not report.ok and not report["reference"].ok


@pytest.mark.xfail(
    strict=True,
    reason="the reference check is held against the size of the path, not against what the force moves: "
    "a miss of 1e-3 of the path passes where the force itself moves the body by 2e-4 of it",
)
def test_a_cost_several_times_off_is_said_so():
    found = solve(flyby(), order=8, mesh=np.linspace(0, 1, 201))
    assert found.objective < 2 * FLYBY or not verify(found).ok


def test_a_tolerance_finds_the_mesh_of_a_flyby():
    found = solve(flyby(), tol=1e-3)
    assert found.success and verify(found).ok
    assert found.objective == pytest.approx(FLYBY, rel=1e-3)


# mass ratio of Earth and Moon, distance of L1, rate of motion near it
RATIO, PLACE, RATE = 0.01215058, 0.83691513, 2.334


def near_l1(duration):
    """Around L1 on a small ellipse, which is not quite a natural motion; exp(2.9 t) is how errors grow."""

    def path(t):
        return np.array([PLACE - 0.01 * np.cos(RATE * t), 0.036 * np.sin(RATE * t), 0.0])

    def velocity(t):
        return RATE * np.array([0.01 * np.sin(RATE * t), 0.036 * np.cos(RATE * t), 0.0])

    ends = (State(path(t), velocity(t)) for t in (0.0, duration))
    return TransferProblem(1.0, *ends, duration, effects=three_body(RATIO), guess=path)


def test_two_unstable_revolutions_are_judged_by_what_they_amplify():
    found = solve(near_l1(6.4), order=8, steps=100)
    report = verify(found)
    assert found.success and report.ok
    # unscaled, the limit would be 1e-8 of the path
    assert 1e-8 < report["rollout"].value < report["rollout"].limit
    assert "amplifies errors 1.8e+08 times" in report["rollout"].note
    # no march of the forces can confirm an arc that amplifies rounding to the size of the path
    assert not verify(solve(near_l1(12.0), order=8, steps=300))["rollout"].ok


def raised():
    from dmoc.scene.problem_file import load_problem

    return load_problem("orbit_raise").make()


@pytest.mark.parametrize("steps", [12_800, pytest.param(100_000, marks=pytest.mark.slow)])
def test_a_long_mesh_costs_no_digits(steps):
    """The error of 3,200 steps, divided by the square of the refinement, to 1e-10 of the objective."""
    true = 1.6903228945e-3
    coarse, fine = solve(raised(), steps=3200), solve(raised(), steps=steps)
    expected = (coarse.objective / true - 1) * (3200 / steps) ** 2
    assert fine.success and verify(fine).ok
    assert fine.objective / true - 1 == pytest.approx(expected, rel=0.02, abs=1e-10)


def test_a_drift_in_a_turning_frame_is_stable_though_its_eigenvalues_are_double():
    """They are split by the root of the error of a step: one exceeds 1 by 0.0017, no matter for 20 steps."""
    ends = State((-0.792, 0.36), (0.07, 0.0027)), State((-0.767, 2.2), (1.025, 1.255))
    drift = TransferProblem(1.4, *ends, 2.83, effects=[RotatingFrame(0.76)])
    answer = solve(drift, order=2, steps=20, hold=True)
    check = verify(answer)["stability"]
    assert verify(answer).ok
    assert check.value == pytest.approx(1.0, abs=1e-3) and check.value**20 < 2


def test_the_exponential_of_a_matrix_with_too_few_eigenvectors():
    jordan = np.array([[2.0, 1.0], [0.0, 2.0]])
    assert _exponential(jordan) == pytest.approx(np.exp(2) * np.array([[1, 1], [0, 1]]), rel=1e-12)
    assert _exponential(-40 * jordan) == pytest.approx(np.exp(-80) * np.array([[1, -40], [0, 1]]), rel=1e-9)
