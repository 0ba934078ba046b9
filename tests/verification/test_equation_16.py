"""The rows of the NLP are equation (16) at order 2 and the discrete Euler-Lagrange equations at every order.

(x_k - x_{k-1}) - (x_{k+1} - x_k) + h^2/m (f_k + F(x_k)) = 0, with h/2 of the forces in the momenta of both
ends. The assembled constraints are evaluated on random unknowns and brought back to SI units.
"""

from dataclasses import dataclass

import numpy as np
import pytest

from dmoc import (
    ClohessyWiltshire,
    Conservative,
    Force,
    LinearDrag,
    PointGravity,
    RotatingFrame,
    Spring,
    State,
    TransferProblem,
    UniformGravity,
    transcribe,
)
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_fractions, node_weights, step_nodes
from dmoc.motion.step import step_momenta

MASS, DURATION, START_TIME = 2.5, 3.0, 0.7
UNEVEN = np.array([0.0, 0.08, 0.2, 0.25, 0.5, 0.85, 1.0])
EVEN = np.linspace(0.0, 1.0, 7)
GRAVITY, MU, STIFFNESS, ANCHOR = (0.3, -1.1), 1.7, 0.8, (0.4, -0.2)
POTENTIALS = (UniformGravity(GRAVITY), PointGravity(MU), Spring(STIFFNESS, ANCHOR))


def potential_force(x):
    """Force [N] of `POTENTIALS` on positions of shape (count, 2)."""
    distance = np.linalg.norm(x, axis=1, keepdims=True)
    return MASS * (np.array(GRAVITY) - MU * x / distance**3) - STIFFNESS * (x - np.array(ANCHOR))


def nlp_of(effects, order=2, mesh=EVEN, hold=False):
    problem = TransferProblem(
        mass=MASS,
        start=State((1.0, 0.2), (0.1, 0.9)),
        goal=State((-0.5, 1.4), (-0.8, -0.3)),
        duration=DURATION,
        effects=effects,
        start_time=START_TIME,
        guess=([0.0, START_TIME + DURATION], [(1.0, 0.2), (-0.5, 1.4)]),
    )
    return transcribe(problem, order=order, mesh=mesh, hold=hold)


def random_unknowns(nlp, seed=5):
    """Random positions [m], forces [N] and boundary velocities [m/s], and the NLP's scaled unknowns."""
    random = np.random.default_rng(seed)
    nodes = nlp.columns["position"].count
    angle = np.linspace(0.0, 4.0, nodes)
    positions = np.stack([np.cos(angle), np.sin(angle)], axis=1) + 0.3 * random.standard_normal((nodes, 2))
    forces = random.standard_normal((nlp.columns["force"].count, 2))
    velocities = random.standard_normal((2, 2))
    scaled = np.zeros(nlp.columns.size)
    for name, values in (
        ("position", positions - nlp.units.origin),
        ("force", forces),
        ("start.velocity", velocities[:1]),
        ("goal.velocity", velocities[1:]),
    ):
        group = nlp.columns[name]
        scaled[group.start : group.stop] = values.ravel()
    return positions, forces, velocities, scaled / nlp.columns.scales()


def dynamics_rows(nlp, scaled):
    """The discrete Euler-Lagrange rows in SI units, momentum per unit mass [m/s], shape (nodes, 2)."""
    rows = np.array(nlp.assembly.constraints(scaled, nlp.parameters(nlp.problem))).ravel()
    return nlp.rows["dynamics"].of(rows / nlp.rows.scales())


def assert_round_off(seen, expected, steps):
    """Agreement to round-off of positions of order 1 divided by the step."""
    np.testing.assert_allclose(seen, expected, rtol=0, atol=2e-15 * 10 / steps.min())


@pytest.mark.parametrize("effects", [(), POTENTIALS], ids=["free", "potentials"])
def test_interior_rows_on_equal_steps_are_equation_16(effects):
    nlp = nlp_of(effects)
    x, f, _, scaled = random_unknowns(nlp)
    h = DURATION / (len(EVEN) - 1)
    total = f + potential_force(x) if effects else f
    equation_16 = (x[1:-1] - x[:-2]) - (x[2:] - x[1:-1]) + h**2 / MASS * total[1:-1]
    np.testing.assert_allclose(h * dynamics_rows(nlp, scaled)[1:-1], equation_16, rtol=0, atol=2e-14)


@pytest.mark.parametrize("mesh", [EVEN, UNEVEN], ids=["even", "uneven"])
def test_each_term_has_its_coefficient(mesh):
    """Of a free body the rows are linear: -1/h, 1/h + 1/h', -1/h' for positions, the mean step for forces."""
    nlp = nlp_of((), mesh=mesh)
    scaled = random_unknowns(nlp)[-1]
    jacobian = np.array(nlp.assembly.jacobian(scaled, nlp.parameters(nlp.problem))[1])
    jacobian /= nlp.rows.scales()[:, None] * nlp.columns.scales()[None]
    nodes, h = len(mesh), DURATION * np.diff(mesh)
    expected = np.zeros((nodes, nodes))
    for k, step in enumerate(h):
        expected[k : k + 2, k : k + 2] += np.array([[1, -1], [-1, 1]]) / step
    share = 0.5 * (np.append(h, 0) + np.append(0, h)) / MASS
    rows, positions, forces = (
        group.indices for group in (nlp.rows["dynamics"], nlp.columns["position"], nlp.columns["force"])
    )
    for axis in range(2):
        assert_round_off(jacobian[np.ix_(rows[axis], positions[axis])], expected, h)
        assert_round_off(jacobian[np.ix_(rows[axis], forces[axis])], np.diag(share), h)
        assert not jacobian[np.ix_(rows[axis], positions[1 - axis])].any()
        assert not jacobian[np.ix_(rows[axis], forces[1 - axis])].any()


@pytest.mark.parametrize("effects", [(), POTENTIALS], ids=["free", "potentials"])
@pytest.mark.parametrize("mesh", [EVEN, UNEVEN], ids=["even", "uneven"])
def test_end_momenta_carry_half_the_step_of_the_force(effects, mesh):
    nlp = nlp_of(effects, mesh=mesh)
    x, f, v, scaled = random_unknowns(nlp)
    rows, h = dynamics_rows(nlp, scaled), DURATION * np.diff(mesh)
    total = f + potential_force(x) if effects else f
    start = MASS * v[0] - (MASS * (x[1] - x[0]) / h[0] - h[0] / 2 * total[0])
    goal = MASS * (x[-1] - x[-2]) / h[-1] + h[-1] / 2 * total[-1] - MASS * v[1]
    assert_round_off(MASS * rows[0], start, h)
    assert_round_off(MASS * rows[-1], goal, h)


@pytest.mark.parametrize("effects", [(), POTENTIALS], ids=["free", "potentials"])
@pytest.mark.parametrize("mesh", [EVEN, UNEVEN], ids=["even", "uneven"])
def test_held_forces_give_half_their_impulse_to_each_end_of_their_step(effects, mesh):
    nlp = nlp_of(effects, mesh=mesh, hold=True)
    x, g, v, scaled = random_unknowns(nlp)
    h = DURATION * np.diff(mesh)[:, None]
    assert len(g) == len(h)
    moves, potential = np.diff(x, axis=0) / h, potential_force(x) if effects else np.zeros_like(x)
    pull = node_weights(mesh, scheme(2))[:, None] * DURATION * potential / MASS
    expected = pull.copy()
    expected[:-1] += h / 2 * g / MASS - moves
    expected[1:] += h / 2 * g / MASS + moves
    expected[0] += v[0]
    expected[-1] -= v[1]
    assert_round_off(dynamics_rows(nlp, scaled), expected, h)


@dataclass(frozen=True)
class Tide(Conservative):
    """A potential that changes with time and mass."""

    def lagrangian(self, t, q, v, m):
        return 0.2 * (1 + t) * q[0] * q[1] / m


@dataclass(frozen=True)
class Wind(Force):
    """A force that grows with time and looks at the velocity."""

    def force(self, t, q, v, m):
        return -0.3 * v * (v[0] ** 2 + v[1] ** 2) * (1 + t**2)


RATE, DRAG, MEAN_MOTION = 0.6, 0.35, 0.4
EVERYTHING = (
    *POTENTIALS,
    RotatingFrame(RATE),
    ClohessyWiltshire(MEAN_MOTION),
    LinearDrag(DRAG),
    Tide(),
    Wind(),
)


def lagrangian(t, q, v):
    """Lagrangian per unit mass [J/kg] of `EVERYTHING` that is conservative, and of the body itself."""
    drift = RATE * np.array([-q[1], q[0]])
    offset = q - np.array(ANCHOR)
    return (
        0.5 * (v @ v)
        + np.array(GRAVITY) @ q
        + MU / np.sqrt(q @ q)
        - 0.5 * STIFFNESS / MASS * (offset @ offset)
        + (v @ drift + 0.5 * (drift @ drift))
        + 2 * MEAN_MOTION * q[0] * v[1]
        + 1.5 * (MEAN_MOTION * q[0]) ** 2
        + 0.2 * (1 + t) * q[0] * q[1] / MASS
    )


def resistance(t, v):
    return -DRAG * v - 0.3 * v * (v @ v) * (1 + t**2)


def derivative(function, at):
    """Gradient by a complex step: no digits are lost."""
    steps = 1e-30j * np.eye(len(at))
    return np.array([function(at + step).imag for step in steps]) / 1e-30


def direct_momenta(rule, t0, h, q, push):
    """P_j = d L_d / d q_j + h w_j F_j / m for one step, L_d = h sum_i w_i l(t_i, q_i, v_i), shape (s+1, 2)."""
    times = t0 + rule.points * h

    def discrete_lagrangian(flat):
        nodes = flat.reshape(-1, 2)
        v = rule.derivative @ nodes / h
        return h * sum(
            w * lagrangian(*state)
            for w, state in zip(rule.weights, zip(times, nodes, v, strict=True), strict=True)
        )

    v = rule.derivative @ q / h
    work = np.array([resistance(t, u) for t, u in zip(times, v, strict=True)]) / MASS + push
    return derivative(discrete_lagrangian, q.ravel()).reshape(-1, 2) + h * rule.weights[:, None] * work


def point(t, q, v, m):
    """What `step_momenta` asks of a scene, by numbers: dl/dq, dl/dv, F/m."""
    assert m == MASS
    dldq = derivative(lambda at: lagrangian(t, at, v), q)
    dldv = derivative(lambda at: lagrangian(t, q, at), v)
    return dldq, dldv, resistance(t, v) / MASS


@pytest.mark.parametrize("order", [2, 4, 6, 8])
def test_step_momenta_are_the_derivatives_of_the_discrete_lagrangian(order):
    rule, random = scheme(order), np.random.default_rng(order)
    q = np.array([1.0, 0.5]) + 0.2 * random.standard_normal((rule.degree + 1, 2))
    push = random.standard_normal((rule.degree + 1, 2))
    t0, h = 0.4, 0.3
    seen = step_momenta(rule, point, t0, h, list(q), [MASS] * len(q), list(push))
    np.testing.assert_allclose(seen, direct_momenta(rule, t0, h, q, push), rtol=0, atol=1e-12)


@pytest.mark.parametrize("hold", [False, True], ids=["nodal", "held"])
@pytest.mark.parametrize("order", [2, 4, 6, 8])
def test_rows_are_arriving_and_leaving_momenta_of_all_steps(order, hold):
    rule, nlp = scheme(order), nlp_of(EVERYTHING, order, UNEVEN, hold)
    x, f, v, scaled = random_unknowns(nlp)
    expected = np.zeros_like(x)
    for k, at in enumerate(step_nodes(len(UNEVEN) - 1, rule).T):
        t0, h = START_TIME + DURATION * UNEVEN[k], DURATION * (UNEVEN[k + 1] - UNEVEN[k])
        push = (np.tile(f[k], (len(at), 1)) if hold else f[at]) / MASS
        expected[at] += direct_momenta(rule, t0, h, x[at], push)
    expected[0] += derivative(lambda u: lagrangian(START_TIME, x[0], u), v[0])
    expected[-1] -= derivative(lambda u: lagrangian(START_TIME + DURATION, x[-1], u), v[1])
    scale = np.abs(expected).max()
    np.testing.assert_allclose(dynamics_rows(nlp, scaled), expected, rtol=0, atol=1e-13 * scale)


def test_nodes_stand_at_the_lobatto_points_of_their_steps():
    """What the rows above take for granted about times of nodes."""
    rule = scheme(6)
    nodes = node_fractions(UNEVEN, rule)
    for k, at in enumerate(step_nodes(len(UNEVEN) - 1, rule).T):
        expected = UNEVEN[k] + (UNEVEN[k + 1] - UNEVEN[k]) * rule.points
        np.testing.assert_allclose(nodes[at], expected, rtol=0, atol=1e-15)
