"""An approach cone keeps the path inside, up to and including its tip."""

import casadi as ca
import numpy as np
import pytest

from dmoc import ApproachCone, Condition, State, TransferProblem, solve

APEX, ANGLE = (1.0, -2.0, 0.5), 0.4


def test_the_excess_is_the_distance_to_the_cone():
    cone = ApproachCone(APEX, (2, 0, 0), ANGLE, rounding=1e-15)
    inside, beside, behind = (3.0, 0.5, 0.0), (0.0, 1.0, 0.0), (-2.0, 0.0, 0.0)
    q = np.array(APEX) + np.array([inside, beside, behind, (0, 0, 0)])
    np.testing.assert_allclose(cone.excess(q, 0 * q), [0, np.cos(ANGLE), 2, 0], atol=1e-15)


@pytest.mark.parametrize("dimension", [2, 3])
def test_rows_hold_inside_only_and_have_a_gradient_everywhere(dimension):
    random = np.random.default_rng(0)
    axis = np.array([1.0, 2.0, -0.5])[:dimension]
    cone = ApproachCone(APEX[:dimension], axis, ANGLE)
    q = ca.SX.sym("q", dimension)
    rows = ca.vertcat(*[row.expression for row in cone.rows(0, q, None, 1)])
    function = ca.Function("rows", [q], [rows, ca.jacobian(rows, q)])
    for size in (0.0, 1e-9, 1e-3, 1.0, 1e3):
        for _ in range(20):
            place = np.array(APEX[:dimension]) + size * random.normal(size=dimension)
            values, slopes = (x.full() for x in function(place))
            excess = cone.excess(place[None], None)[0]
            assert values.min() >= -1e-6 if excess == 0 else excess < 2e-6 or values.min() < 0
            assert np.linalg.norm(slopes, axis=1).min() > 0.05


@pytest.mark.parametrize("dimension", [2, 3])
def test_its_rows_give_way_by_an_angle(dimension):
    """Rows of -slack times the distance from the tip are zero on the surface of the cone that is eased."""
    slack, center = 0.1, np.array(APEX[:dimension])
    cone = ApproachCone(center, np.eye(dimension)[0], ANGLE, rounding=1e-12)
    eased = cone.eased(slack)
    assert eased.half_angle > ANGLE + 0.05
    turned = np.array([np.cos(eased.half_angle), np.sin(eased.half_angle), 0.0])[:dimension]
    for distance in (0.01, 1.0, 100.0):
        place = center + distance * turned
        row = min(float(row.expression) for row in cone.rows(0, ca.DM(place), None, 1))
        weight = cone.weights(np.zeros(1), place[None])[0]
        assert row == pytest.approx(-slack * weight, rel=1e-9) and weight == pytest.approx(distance)
    assert f"of at least {eased.half_angle:.3f}"[:-1] in cone.needs(eased, 1, "")


def test_a_cone_that_would_be_a_half_space_is_not_named():
    assert ApproachCone((0, 0), (1, 0), 1.2).eased(0.5) is None
    assert ApproachCone((0, 0, 0), (1, 0, 0), 1.2).eased(0.5) is None


@pytest.mark.parametrize("dimension", [2, 3])
def test_docking_through_a_cone(dimension):
    """Without the cone the path swings out of it; with it, it touches the side and costs more."""
    tail = (0.0,) * (dimension - 2)
    start, goal = State((5, 2, *tail), (-1, 1, *tail)), State((0, 0, *tail), (0, 0, *tail))
    cone = ApproachCone((0, 0, *tail), (1, 0, *tail), 0.5)
    free = solve(TransferProblem(1.0, start, goal, 10.0), steps=100).raise_for_status()
    kept = solve(TransferProblem(1.0, start, goal, 10.0, constraints=[cone]), steps=400).raise_for_status()
    assert cone.excess(free.position, None).max() > 0.1
    assert cone.excess(kept.position, None).max() < 2e-6
    assert kept.objective == pytest.approx(0.94038, rel=1e-5) and kept.objective > 1.1 * free.objective


def test_the_tip_may_be_passed_where_it_is_not_a_fixed_end():
    """A goal that is only a condition lands on the tip, where |d| has no derivative."""
    goal = Condition(lambda t, q, v, m: [q[0], q[1], q[2]], "tip", state=State(None, (0, 0, 0)))
    cone = ApproachCone((0, 0, 0), (1, 0, 0), 0.5)
    problem = TransferProblem(1.0, State((5, 2, 0), (0, 0, 0)), goal, 10.0, constraints=[cone])
    solution = solve(problem, steps=50).raise_for_status()
    assert solution.objective == pytest.approx(6 * 29 / 1000 * 2500 / 2502, rel=1e-6)


@pytest.mark.parametrize(
    "arguments, words",
    [
        ((APEX, (1, 0), 0.5), "same number"),
        (((0, 0), (0, 0), 0.5), "direction"),
        (((0, 0), (1, 0), 2.0), "pi/2"),
        (((0, 0), (1, 0), 0.0), "half_angle"),
        (((0,), (1,), 0.5), "direction"),
    ],
)
def test_cones_without_a_meaning_are_refused(arguments, words):
    with pytest.raises(ValueError, match=words):
        ApproachCone(*arguments)


def test_a_start_outside_the_cone_is_refused():
    cone = ApproachCone((0, 0), (1, 0), 0.5)
    with pytest.raises(ValueError, match="cone"):
        TransferProblem(1.0, State((1, 2), (0, 0)), State((0, 0), (0, 0)), 5.0, constraints=[cone])


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("time", [0.0, 2.0, 5.0])
def test_a_cone_that_moves_is_at_each_time_the_one_that_stands_there(dimension, time):
    """Its rows and its excess, with an apex that runs and an axis that turns."""

    def apex(t):
        return ca.vertcat(1 + 0.5 * t, -t, 2)[:dimension]

    def axis(t):
        return ca.vertcat(ca.cos(0.3 * t), ca.sin(0.3 * t), 0)[:dimension]

    there, along = (np.array(ca.DM(part(time))).ravel() for part in (apex, axis))
    moving, standing = ApproachCone(apex, axis, ANGLE), ApproachCone(there, along, ANGLE)
    t, q = ca.SX.sym("t"), ca.SX.sym("q", dimension)
    rows = [ca.vertcat(*[row.expression for row in cone.rows(t, q, None, 1)]) for cone in (moving, standing)]
    function = ca.Function("rows", [t, q], rows)
    places = there + np.random.default_rng(1).normal(size=(20, dimension))
    for place in places:
        one, other = (x.full() for x in function(time, place))
        assert one == pytest.approx(other, abs=1e-12)
    found = moving.excess_at(np.full(20, time), places, None)
    assert found == pytest.approx(standing.excess(places, None), abs=1e-12) and found.max() > 0.1
