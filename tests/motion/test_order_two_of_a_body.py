"""At order 2 the rate of a body is one for both nodes of a step: shorter formulas, and the same momenta."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from dmoc import Attitude, BodyForce, Pose, Thrusters, Torque, TransferProblem, rotation, simulate
from dmoc.basics.quaternions import rotated, turned_by
from dmoc.configurations.of_problem import configuration_of
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.momenta import legendre_function
from dmoc.nlp.stencils import stencils_of

TURN = TransferProblem(
    2.0,
    Attitude((1, 0, 0, 0), (0.3, 0.7, -0.4)),
    Attitude(rotation((1, 1, 1), 120)),
    5.0,
    inertia=((1.0, 0.1, 0.0), (0.1, 2.0, -0.2), (0.0, -0.2, 2.8)),
    actuator=Torque(),
)
FLIGHT = replace(
    TURN,
    start=Pose((0, 0, 0)),
    goal=Pose((2, 1, -1)),
    actuator=Thrusters([(0.5, 0.5, 0), (0.5, -0.5, 0)], [(-1, 0, 0), (1, 0, 0)], 1.0),
)
BURNING = replace(FLIGHT, actuator=replace(FLIGHT.actuator, exhaust_velocity=20.0))


class Brake(BodyForce):
    """A torque in body axes against the rate."""

    moves_body = False

    def wrench(self, t, body, m):
        return None, -0.3 * body.rate


@pytest.mark.parametrize("problem", [TURN, FLIGHT, BURNING])
def test_momenta_are_the_slopes_of_the_discrete_lagrangian(problem):
    """P_j is the derivative by q_j of the kinetic energy at both nodes, times half the step each."""
    body, noise, h = configuration_of(problem), np.random.default_rng(1), 0.3
    q = [ca.SX.sym(f"q{j}", body.size) for j in range(2)]
    v, m = (q[1] - q[0]) / h, np.array([1.9, 1.7]) if problem.actuator.burns else np.array([2.0, 2.0])
    energy = 0.5 * h * (body.kinetic(q[0], v, m[0]) + body.kinetic(q[1], v, m[1]))
    slopes = ca.Function("slopes", q, [ca.gradient(energy, place) for place in q])
    # positions count from an origin, attitudes too: not from an attitude of length 1, either
    origin, moves = noise.normal(size=body.size), 0.2 * noise.normal(size=(2, body.size))
    controls = np.zeros(2 * problem.controls)
    found = legendre_function(Dynamics.of(problem), 2, False)(moves.ravel(), m, controls, 0.0, h, origin)
    for momentum, expected in zip(found, slopes(*(origin + moves)), strict=True):
        np.testing.assert_allclose(np.array(momentum), np.array(expected), rtol=1e-12, atol=1e-13)
    assert max(np.abs(np.array(momentum)).max() for momentum in found) > 0.1


def test_what_looks_at_the_rate_still_does():
    braked = simulate(replace(TURN, effects=[Brake()]), steps=800)
    slow, fast = (np.linalg.norm(one.rate[-1]) for one in (braked, simulate(TURN, steps=800)))
    assert slow < 0.7 * fast
    fine = simulate(replace(TURN, effects=[Brake()]), steps=100, order=6)
    np.testing.assert_allclose(braked.rate[-1], fine.rate[-1], atol=2e-5)


def test_the_angular_momentum_in_space_is_kept_over_many_steps():
    free = simulate(replace(TURN, duration=1000.0), steps=10_000)
    in_space = rotated(free.attitude, free.spin)
    assert np.abs(in_space - in_space[0]).max() < 1e-13 * np.sqrt(10_000) * np.linalg.norm(in_space[0])
    turned = rotated(turned_by(np.array([0.0, 0.0, 0.1])), in_space[0])
    assert np.abs(turned - in_space[0]).max() > 1e-2, "a momentum that no turn would change"


def test_second_derivatives_of_a_step_are_short():
    """Node by node they take 1,453 and 1,835 instructions: half the time of a solve that starts warm."""
    step = stencils_of(replace(FLIGHT, inertia=(1, 2, 2.8)), 2, False).stencils[1]
    assert step.every == "step"
    jacobian, hessian = (step.kernel.functions[kind].n_instructions() for kind in ("jacobian", "hessian"))
    assert jacobian < 700 and hessian < 900


@pytest.mark.parametrize("order, counts", [(4, (2800, 2900)), (8, (8200, 6700))])
def test_second_derivatives_of_longer_steps_are_made_by_the_chain_rule_in_their_velocities(order, counts):
    """By CasADi alone they take 3,307 and 4,219 instructions at order 4, 10,742 and 13,397 at order 8."""
    step = stencils_of(replace(FLIGHT, inertia=(1, 2, 2.8)), order, False).stencils[1]
    for kind, most in zip(("jacobian", "hessian"), counts, strict=True):
        assert step.kernel.functions[kind].n_instructions() < most
