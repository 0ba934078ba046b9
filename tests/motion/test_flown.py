"""The control between nodes: within the limit, with the impulse of the discrete equations, paid for."""

from dataclasses import replace

import numpy as np
import pytest

from dmoc import BallForce, BoxForce, Engine, FreeForce, State, Time, TransferProblem, solve, verify
from dmoc.checks.evidence import Evidence
from dmoc.checks.limits import excesses
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.flown import BREAKS, flown
from dmoc.motion.lobatto import scheme
from dmoc.motion.path import DiscretePath
from dmoc.scene.problem_file import load_problem

REST = State((0, 0), (0, 0))


def switching(actuator):
    start = State((0, 0), (0.3, -0.2))
    return TransferProblem(1.0, start, State((1, 0.3), (0, 0)), (0.5, 5.0), actuator=actuator, objective=Time())


def path_with(order, controls, size=2):
    """A path of a few steps whose controls are given, nothing else of which is looked at."""
    steps = (len(controls) - 1) // (order // 2)
    mesh, nodes = np.linspace(0.0, 1.0, steps + 1), len(controls)
    at = np.zeros((nodes, 2))
    return DiscretePath(mesh, order, False, 2.0, at, controls, np.ones(nodes), at[0], at[0])


def impulse(known):
    """Integral of the control over the fractions of the duration."""
    weights = scheme(2 * (len(known.nodes) - 1)).weights
    return np.einsum("j,k,jkn->n", weights, np.diff(known.mesh), known.nodes)


@pytest.mark.parametrize("order", [4, 6, 8])
@pytest.mark.parametrize("actuator", [BoxForce(1.0), BallForce(1.0)])
def test_it_keeps_the_limit_where_the_polynomial_breaks_it(order, actuator):
    path = solve(switching(actuator), order=order, steps=9).raise_for_status().path
    dynamics = Dynamics.of(switching(actuator))
    known = flown(dynamics, path)
    polynomials = flown(replace(dynamics, actuator=FreeForce()), path)
    assert known.broken.any() and not polynomials.broken.any()
    assert actuator.excess(polynomials.sampled(33)[1]).max() > 0.01
    assert actuator.excess(known.sampled(33)[1]).max() <= 1.1 * BREAKS
    assert impulse(known) == pytest.approx(impulse(polynomials), abs=1e-14)


def test_a_switch_keeps_the_first_moment_by_two_pieces():
    """From +1 to -1 at 0.3 of the only step of order 4: the node values give both pieces back."""
    rule, tau = scheme(4), 0.3
    mean, moment = 2 * tau - 1, tau * (tau - 1)  # of the control, and of it times (place - 1/2)
    # Three node values with this mean and moment, the first at the limit.
    matrix = np.vstack([rule.weights, rule.weights * (rule.points - 0.5), [1.0, 0.0, 0.0]])
    values = np.linalg.solve(matrix, [mean, moment, 1.0])
    controls = np.column_stack([values, np.zeros(3)])
    problem = TransferProblem(1.0, REST, State((1, 0), (0, 0)), 2.0, actuator=BoxForce(1.0))
    known = flown(Dynamics.of(problem), path_with(4, controls))
    assert known.mesh == pytest.approx([0.0, tau, 1.0], abs=0.011)
    assert known.nodes[:, 0, 0] == pytest.approx(1.0, abs=0.05)
    assert known.nodes[:, 1, 0] == pytest.approx(-1.0, abs=0.05)


def test_a_coast_within_a_step_is_flown_node_by_node():
    """Without a first moment two pieces would be one, the mean."""
    controls = np.column_stack([[1.0, 1.0, -1.0, 1.0, 1.0], np.zeros(5)])
    problem = TransferProblem(1.0, REST, State((1, 0), (0, 0)), 2.0, actuator=BoxForce(1.0))
    known = flown(Dynamics.of(problem), path_with(8, controls))
    assert known.broken.all()
    assert known.nodes[0] == pytest.approx(controls, abs=2e-6)
    assert np.diff(known.mesh) == pytest.approx(scheme(8).weights)


def test_a_thrust_at_its_limit_that_turns_keeps_nearly_all_of_its_polynomial():
    """Over a step of a sixth of a revolution the polynomial through its nodes exceeds the limit by 3e-4."""
    angle = np.pi / 3 * scheme(8).points
    controls = np.column_stack([np.cos(angle), np.sin(angle)])
    problem = TransferProblem(1.0, REST, State((1, 0), (0, 0)), 2.0, actuator=BallForce(1.0 - 2 * BREAKS))
    known = flown(Dynamics.of(problem), path_with(8, controls))
    assert known.broken.all()
    polynomial = flown(Dynamics.of(replace(problem, actuator=FreeForce())), path_with(8, controls))
    assert impulse(known) == pytest.approx(impulse(polynomial), abs=1e-14)
    at, values = known.sampled(33)
    assert np.abs(values - scheme(8).values_at(at) @ controls).max() < 0.01
    assert np.linalg.norm(known.sampled(33)[1], axis=1).max() <= 1.0


@pytest.mark.parametrize("order, turn", [(6, 0.4), (8, 0.8)])
def test_a_thrust_at_its_limit_turns_at_its_limit(order, turn):
    """The polynomial through its nodes swings about the limit; what is flown hardly does, with its impulse."""
    angle = turn * np.pi * scheme(order).points
    controls = np.column_stack([np.cos(angle), np.sin(angle)])
    problem = TransferProblem(1.0, REST, State((1, 0), (0, 0)), 2.0, actuator=BallForce(1.0))
    path = path_with(order, controls)
    known, polynomial = (
        flown(Dynamics.of(replace(problem, actuator=one)), path) for one in (BallForce(1.0), FreeForce())
    )
    assert known.broken.all() and len(known.mesh) == 5
    assert impulse(known) == pytest.approx(impulse(polynomial), abs=1e-14)

    def off(one):
        fractions, values = one.sampled(33)
        true = np.column_stack([np.cos(turn * np.pi * fractions), np.sin(turn * np.pi * fractions)])
        return np.abs(np.linalg.norm(values, axis=1) - 1.0).max(), np.abs(values - true).max()

    assert off(polynomial)[0] > 9e-4 > 5 * off(known)[0]
    assert off(known)[1] < off(polynomial)[1]


def test_a_thrust_that_turns_and_stops_keeps_its_first_moment():
    """What pieces of one direction each lose of it adds up over many revolutions."""
    order = 8
    angle = np.pi / 6 * scheme(order).points
    throttle = np.interp(scheme(order).points, [0.0, 0.4, 0.9], [1.0, 1.0, 0.4])
    controls = np.column_stack([throttle * np.cos(angle), throttle * np.sin(angle), throttle])
    problem = TransferProblem(1.0, REST, State((1, 0), (0, 0)), 2.0, actuator=Engine(1.0))
    known = flown(Dynamics.of(problem), path_with(order, controls, 3))
    assert known.broken.all()
    lengths, rule = np.diff(known.mesh), scheme(order)
    places = known.mesh[:-1] + rule.points[:, None] * lengths - 0.5
    moment = np.einsum("j,k,jk,jkn->n", rule.weights, lengths, places, known.nodes)
    assert moment == pytest.approx((rule.weights * (rule.points - 0.5)) @ controls, abs=1e-4)
    assert problem.actuator.beyond(known.sampled(33)[1]).max() <= 1.1 * BREAKS


class Tied(BallForce):
    """The same limit, of which nobody says what is nearest within it."""

    def nearest(self, u):
        return None


def test_each_step_is_flown_in_the_way_that_keeps_most_of_its_moments():
    """One more way to fly a step never keeps less of the first two moments, and often more."""
    rule, draw = scheme(6), np.random.default_rng(3)
    left = []
    for _ in range(30):
        controls = draw.normal(size=(len(rule.points), 2))
        controls *= np.minimum(1.0, 1 / np.linalg.norm(controls, axis=1))[:, None]
        off = []
        for actuator in (BallForce(1.0), Tied(1.0)):
            problem = TransferProblem(1.0, REST, State((1, 0), (0, 0)), 2.0, actuator=actuator)
            known = flown(Dynamics.of(problem), path_with(6, controls))
            lengths = np.diff(known.mesh)
            places = known.mesh[:-1] + rule.points[:, None] * lengths - 0.5
            moments = [
                np.einsum("j,k,jk,jkn->n", rule.weights, lengths, places**k, known.nodes) for k in (1, 2)
            ]
            wanted = [(rule.weights * (rule.points - 0.5) ** k) @ controls for k in (1, 2)]
            off.append(np.abs(np.subtract(moments, wanted)).sum())
        left.append(off)
    near, tied = np.transpose(left)
    assert (near <= tied + 1e-12).all() and (near < 0.5 * tied).sum() >= 5


def test_of_a_moment_that_nothing_has_within_the_limit_the_most_is_kept():
    rule = scheme(4)
    matrix = np.vstack([rule.weights, rule.weights * (rule.points - 0.5)])
    # With so large a moment about a mean so near the limit any two pieces would exceed it.
    values = np.linalg.lstsq(matrix, np.array([0.95, 0.2]), rcond=None)[0]
    problem = TransferProblem(1.0, REST, State((1, 0), (0, 0)), 2.0, actuator=BoxForce(1.0))
    known = flown(Dynamics.of(problem), path_with(4, np.column_stack([values, np.zeros(3)])))
    first, second = known.nodes[0, :, 0]
    lengths = np.diff(known.mesh)
    assert np.dot(lengths, [first, second]) == pytest.approx(0.95, abs=1e-12)
    # The largest moment of such a mean is that of -1 up to 0.025 and +1 from there on.
    moment = (second - first) * lengths.prod() / 2
    assert 0.95 * 0.025 * 0.975 < moment < 0.025 * 0.975 * (1 + 10 * BREAKS)
    assert first > -1 - 2 * BREAKS and second < 1 + 2 * BREAKS


@pytest.mark.parametrize("order, tol", [(8, None), (4, 1e-4)])
def test_an_engine_flies_no_more_impulse_than_it_pays_for(order, tol):
    problem = load_problem("two_body_fuel").make()
    solution = solve(problem, order=order, tol=tol)
    fractions, control = flown(Dynamics.of(problem), solution.path).sampled(65)
    pieces = control.reshape(-1, 65, control.shape[1])
    spans = fractions.reshape(-1, 65)
    thrust = np.trapezoid(np.linalg.norm(pieces[:, :, :-1], axis=2), spans, axis=1).sum()
    paid = np.trapezoid(pieces[:, :, -1], spans, axis=1).sum()
    assert thrust < paid * (1 + 1e-5)


@pytest.mark.parametrize("order", [4, 8])
def test_the_checks_judge_what_is_flown(order):
    solution = solve(switching(BoxForce(1.0)), order=order, steps=9)
    assert verify(solution).ok
    (limit,) = [one for one in excesses(Evidence(solution)) if one.name == "force between nodes"]
    assert limit.ok and limit.unit == "N"


def test_where_nothing_breaks_the_polynomials_are_flown():
    problem = load_problem("orbit_raise").make()
    path = solve(problem, order=6, steps=20).path
    known = flown(Dynamics.of(problem), path)
    assert not known.broken.any() and np.array_equal(known.mesh, path.mesh)
    engine = replace(problem, actuator=Engine(10.0))
    assert not flown(Dynamics.of(replace(engine, actuator=FreeForce())), path).broken.any()
