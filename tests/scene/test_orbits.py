"""Orbits as ends: regular at e = 0 and i = 0, and the arrival point found by the optimisation."""

import itertools
import math

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    CircularOrbit,
    Condition,
    Engine,
    FinalRadius,
    Orbit,
    PointGravity,
    State,
    Time,
    TransferProblem,
    solve,
    transcribe,
)
from dmoc.guess.starting import starting_guess
from dmoc.motion.mesh import uniform_mesh
from dmoc.parts.rows import values_of, with_symbols

MU, CENTER = 1.7, (0.3, -0.2, 0.5)
VALUES = {"a": 1.3, "e": 0.3, "i": 0.7, "raan": 1.1, "argp": 2.3, "nu": 0.6}
SPECIAL = {"e": (0.0,), "i": (0.0, math.pi)}
CIRCLE = State((1, 0), (0, 1))
GRAVITY = [PointGravity(1.0)]


def every_subset(dimension):
    """Each set of elements that has a meaning, with e = 0, i = 0 and i = pi in their turn."""
    names = [name for name in VALUES if dimension == 3 or name not in ("i", "raan")]
    for count in range(1, len(names) + 1):
        for subset in itertools.combinations(names, count):
            for values in itertools.product(*((VALUES[name], *SPECIAL.get(name, ())) for name in subset)):
                given = dict(zip(subset, values, strict=True))
                meaningless = given.get("i") in (0.0, math.pi) and "raan" in given
                meaningless |= given.get("e") == 0 and ("argp" in given) != ("nu" in given)
                if not meaningless:
                    yield given


def rows_at(boundary, position, velocity):
    """Values minus targets of the equations, their Jacobian in (q, v), and the slack of inequalities."""
    n = len(position)
    q, v = ca.SX.sym("q", n), ca.SX.sym("v", n)
    twin, symbols = with_symbols(boundary, "end")
    rows = twin.rows(0.0, q, v, 1.0)
    values = ca.vertcat(*[row.expression for row in rows])
    given = [q, v, ca.vertcat(*symbols)]
    function = ca.Function("rows", given, [values, ca.jacobian(values, ca.vertcat(q, v))])
    value, slope = (np.array(ca.densify(x)) for x in function(position, velocity, values_of(boundary)))
    equal = np.array([row.lower == row.upper for row in rows])
    gap = value.ravel() - [row.lower for row in rows]
    return gap[equal], slope[equal], gap[~equal]


def random_state(random, n):
    direction = random.normal(size=n)
    distance = random.uniform(0.7, 2.0) / np.linalg.norm(direction)
    return np.array(CENTER[:n]) + distance * direction, random.normal(size=n)


@pytest.mark.parametrize("dimension", [2, 3])
def test_every_set_of_elements_has_independent_rows_where_they_hold(dimension):
    random = np.random.default_rng(1)
    for given in every_subset(dimension):
        orbit = Orbit(MU, center=CENTER[:dimension], **given)
        for _ in range(3):
            q, v = orbit.estimate(0.0, random_state(random, dimension))
            gap, slope, slack = rows_at(orbit, q, v)
            sizes = [np.linalg.norm(q - CENTER[:dimension]), np.linalg.norm(v)]
            assert np.abs(gap).max() < 1e-12, given
            assert (slack > 0.01).all(), given
            singular = np.linalg.svd(slope * np.repeat(sizes, dimension), compute_uv=False)
            assert singular[-1] > 1e-3 * singular[0], given


@pytest.mark.parametrize(
    "boundary, count",
    [
        (CircularOrbit(1.3, MU, CENTER[:2]), 3),
        (CircularOrbit(1.3, MU, CENTER[:2], clockwise=True), 3),
        (CircularOrbit(1.3, MU, CENTER), 3),
        (CircularOrbit(1.3, MU, CENTER, normal=(1, 2, -2)), 5),
        (CircularOrbit(1.3, MU, CENTER, normal=(0, 0, 1)), 5),
    ],
)
def test_a_circular_orbit_has_independent_rows_where_they_hold(boundary, count):
    random = np.random.default_rng(2)
    for _ in range(5):
        q, v = boundary.estimate(0.0, random_state(random, boundary.dimension))
        gap, slope, _ = rows_at(boundary, q, v)
        singular = np.linalg.svd(slope, compute_uv=False)
        assert len(gap) == count and np.abs(gap).max() < 1e-12 and singular[-1] > 0.1 * singular[0]
        offset = q - np.array(boundary.center)
        assert np.linalg.norm(offset) == pytest.approx(1.3)
        assert np.linalg.norm(v) == pytest.approx(math.sqrt(MU / 1.3))
        assert v @ offset == pytest.approx(0, abs=1e-12)


def test_the_sense_of_rotation_is_kept():
    q = np.array([1.0, 0.0])
    for clockwise in (False, True):
        orbit = CircularOrbit(1.0, 1.0, (0, 0), clockwise=clockwise)
        gap, _, _ = rows_at(orbit, q, np.array([0.0, -1.0 if clockwise else 1.0]))
        assert np.abs(gap).max() < 1e-15
        gap, _, _ = rows_at(orbit, q, np.array([0.0, 1.0 if clockwise else -1.0]))
        assert np.abs(gap).max() > 1
    for i, sign in ((0.0, 1), (math.pi, -1)):
        assert rows_at(Orbit(1.0, i=i, center=(0, 0)), q, np.array([0.0, sign]))[2] == pytest.approx(1)
        assert rows_at(Orbit(1.0, i=i, center=(0, 0)), q, np.array([0.0, -sign]))[2] == pytest.approx(-1)


def test_the_elements_are_those_of_the_books():
    """Curtis, Orbital Mechanics for Engineering Students, chapter 4: state from elements (km, 4 digits)."""
    h, mu, e = 80_000.0, 398_600.0, 1.4
    angles = {name: math.radians(x) for name, x in (("i", 30), ("raan", 40), ("argp", 60), ("nu", 30))}
    orbit = Orbit(mu, a=h**2 / mu / (1 - e**2), e=e, **angles)
    q, v = orbit.estimate(0.0, (np.array([7000.0, 100.0, 0.0]), np.array([0.0, 10.0, 1.0])))
    np.testing.assert_allclose(q, [-4040, 4815, 3629], atol=1)
    np.testing.assert_allclose(v, [-10.39, -4.772, 1.744], atol=5e-3)


def test_a_free_arrival_point_is_the_best_of_all_fixed_ones():
    free = solve(TransferProblem(1.0, CIRCLE, CircularOrbit(1.5, 1.0), 8.0, effects=GRAVITY), steps=100)
    free.raise_for_status()
    best = math.atan2(*free.position[-1][::-1])
    speed = math.sqrt(1 / 1.5)
    costs = {}
    for turn in (-0.4, -0.2, -0.05, 0.0, 0.05, 0.2, 0.4):
        x, y = math.cos(best + turn), math.sin(best + turn)
        fixed = State((1.5 * x, 1.5 * y), (-speed * y, speed * x))
        costs[turn] = solve(TransferProblem(1.0, CIRCLE, fixed, 8.0, effects=GRAVITY), steps=100).objective
    assert costs.pop(0.0) == pytest.approx(free.objective, rel=1e-9)
    assert min(costs.values()) > free.objective * (1 + 1e-4)


def test_the_same_goal_stated_in_five_ways_has_the_same_optimum():
    tilt = (math.cos(0.5), math.sin(0.5))
    tilted = State((1, 0, 0), (0, *tilt))
    normal = (0.0, -tilt[1], tilt[0])
    cases = [
        (CIRCLE, CircularOrbit(1.5, 1.0)),
        (CIRCLE, Orbit(1.0, a=1.5, e=0)),
        (tilted, CircularOrbit(1.5, 1.0)),
        (tilted, CircularOrbit(1.5, 1.0, normal=normal)),
        (tilted, Orbit(1.0, a=1.5, e=0, i=0.5, raan=0.0)),
    ]
    objectives = [
        solve(TransferProblem(1.0, start, goal, 8.0, effects=GRAVITY), steps=50).raise_for_status().objective
        for start, goal in cases
    ]
    np.testing.assert_allclose(objectives, objectives[0], rtol=1e-8)


def test_flat_in_two_ways_and_a_plane_change_costs_more_the_larger_it_is():
    start = State((1, 0, 0), (0, math.cos(0.3), math.sin(0.3)))
    costs = []
    for goal in (
        CircularOrbit(1.5, 1.0, normal=(0, 0, 1)),
        Orbit(1.0, a=1.5, e=0, i=0),
        Orbit(1.0, a=1.5, e=0, i=0.15),
        Orbit(1.0, a=1.5, e=0),
    ):
        solution = solve(TransferProblem(1.0, start, goal, 8.0, effects=GRAVITY), steps=50)
        costs.append(solution.raise_for_status().objective)
    assert costs[0] == pytest.approx(costs[1], rel=1e-9)
    assert costs[1] > 1.2 * costs[2] > 1.44 * costs[3]


def test_both_ends_may_be_orbits():
    """Turning the whole transfer costs nothing, so the optimum is that of a fixed start."""
    goal = CircularOrbit(1.5, 1.0)
    fixed = solve(TransferProblem(1.0, CIRCLE, goal, 8.0, effects=GRAVITY), steps=50).raise_for_status()
    loose = CircularOrbit(1.0, 1.0, center=(0, 0))
    free = solve(TransferProblem(1.0, loose, goal, 8.0, effects=GRAVITY), steps=50).raise_for_status()
    assert free.objective == pytest.approx(fixed.objective, rel=1e-8)


THRUST, FLOW = 0.1405, 0.0749  # Bryson and Ho, Applied Optimal Control (1975), section 2.5: Earth to Mars
SAIL = Engine(THRUST, exhaust_velocity=THRUST / FLOW)


def test_least_time_to_mars_from_the_default_guess():
    """3.31922028 for r = 1.525 by indirect shooting; order 4 on 100 steps."""
    goal = CircularOrbit(1.525, 1.0)
    problem = TransferProblem(1.0, CIRCLE, goal, (1.0, 10.0), effects=GRAVITY, actuator=SAIL, objective=Time())
    assert solve(problem, order=4).raise_for_status().objective == pytest.approx(3.31922028, abs=1e-6)


def circular(t, q, v, m):
    return [ca.dot(q, v), ca.dot(v, v) * ca.sqrt(ca.dot(q, q)) - 1]


@pytest.mark.parametrize("goal", [Condition(circular, "circular"), Orbit(1.0, e=0)])
def test_the_largest_orbit_in_a_given_time_from_the_default_guess(goal):
    """1.52502839 by indirect shooting; reported as a radius, not as its negative."""
    problem = TransferProblem(
        1.0, CIRCLE, goal, 3.3193, effects=GRAVITY, actuator=SAIL, objective=FinalRadius()
    )
    seen = []
    solution = solve(problem, order=4, progress=lambda *at: seen.append(at[3])).raise_for_status()
    assert solution.objective == pytest.approx(1.52502839, abs=1e-6)
    assert seen[-1] == pytest.approx(solution.objective)
    assert solution.ladder[-1].objective == pytest.approx(seen[-1], rel=1e-9)


@pytest.mark.parametrize(
    "first, second",
    [
        (CircularOrbit(1.5, 1.0), CircularOrbit(1.4, 1.0)),
        (Orbit(1.0, a=1.5, e=0.2, argp=1.0), Orbit(1.0, a=1.4, e=0.1, argp=0.8)),
    ],
)
def test_an_orbit_can_change_without_a_rebuild(first, second):
    old, new = (TransferProblem(1.0, CIRCLE, goal, 5.0, effects=GRAVITY) for goal in (first, second))
    nlp = transcribe(old, 50)
    nlp.accepts(new)
    answer = nlp.run(nlp.solver(), new, starting_guess(new, uniform_mesh(50), 2, False))
    assert answer.status == "solved"
    assert nlp.objective(answer.objective) == pytest.approx(solve(new, steps=50).objective, rel=1e-8)


def test_what_changes_the_rows_needs_a_rebuild():
    nlp = transcribe(TransferProblem(1.0, CIRCLE, Orbit(1.0, a=1.5, e=0.2), 5.0, effects=GRAVITY), 50)
    for goal in (Orbit(1.0, a=1.5, e=0), Orbit(1.0, a=1.5, argp=0.2), CircularOrbit(1.5, 1.0)):
        with pytest.raises(ValueError, match="goal"):
            nlp.accepts(TransferProblem(1.0, CIRCLE, goal, 5.0, effects=GRAVITY))


def test_counter_clockwise_and_clockwise_are_not_taken_for_each_other():
    # both are exact values of i with rows of their own; the motion of one is that of the other in a mirror
    def turning(sign, i):
        goal = Orbit(1.0, a=1.5, e=0.0, i=i)
        return TransferProblem(1.0, State((1, 0), (0, sign)), goal, 12.0, effects=GRAVITY)

    problems = turning(1, 0.0), turning(-1, math.pi)
    with pytest.raises(ValueError, match="goal"):
        transcribe(problems[0], 50).accepts(problems[1])
    efforts = [solve(problem, order=4, steps=60).raise_for_status().objective for problem in problems]
    assert efforts[1] == pytest.approx(efforts[0], rel=1e-8)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: Orbit(1.0), "at least one"),
        (lambda: Orbit(1.0, a=1.0, e=1.2), "hyperbola"),
        (lambda: Orbit(1.0, i=90), "rad"),
        (lambda: Orbit(1.0, i=0, raan=1), "raan does not exist"),
        (lambda: Orbit(1.0, e=0, argp=1), "argp \\+ nu"),
        (lambda: Orbit(1.0, i=0.5, center=(0, 0)), "3 axes"),
        (lambda: Orbit(-1.0, a=1.0), "mu"),
        (lambda: CircularOrbit(0.0, 1.0), "radius"),
        (lambda: CircularOrbit(1.0, 1.0, normal=(0, 0, 0)), "normal"),
        (lambda: CircularOrbit(1.0, 1.0, center=(0, 0, 0), clockwise=True), "normal"),
        (lambda: TransferProblem(1.0, CircularOrbit(1, 1), CircularOrbit(2, 1), 5.0), "how many axes"),
    ],
)
def test_orbits_without_a_meaning_are_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize(
    "goal", [CircularOrbit(1.5, 1.0), Orbit(1.0, a=1.5, e=0, i=0), Orbit(1.0, e=0.2, i=0, argp=1.0)]
)
def test_the_whole_jacobian_has_full_rank_at_the_optimum(goal):
    start = State((1, 0, 0), (0, math.cos(0.2), math.sin(0.2)))
    problem = TransferProblem(1.0, start, goal, 5.0, effects=GRAVITY)
    path = solve(problem, steps=20).raise_for_status().path
    nlp = transcribe(problem, 20)
    lower, upper, low, high = nlp.bounds(problem)
    slope = nlp.assembly.jacobian(nlp.pack(path), nlp.parameters(problem))[1].full()
    singular = np.linalg.svd(slope[low == high][:, lower < upper], compute_uv=False)
    assert singular[-1] > 1e-5 * singular[0]
