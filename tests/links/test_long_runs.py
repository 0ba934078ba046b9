"""A hundred thousand steps of a double pendulum and of a free chain, beside Runge-Kutta's method."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    JointState,
    JointTorque,
    Member,
    Pose,
    Revolute,
    Rod,
    State,
    System,
    TransferProblem,
    UniformGravity,
    simulate,
)
from dmoc.basics.quaternions import rotated
from dmoc.configurations.of_problem import configuration_of
from dmoc.motion.dynamics import Dynamics
from dmoc.studies.drift import kepler
from dmoc.studies.swinging import LENGTHS, double_pendulum, swing

STEPS, STEP = 100_000, 0.05


def pendulum():
    """Two points of 1 kg on rods of 1 m, which swing widely."""
    upper, lower = Rod((0, 0), 1.0, on="elbow"), Rod("elbow", 1.0, on="tip")
    start = {"elbow": State((1, 0), (0, 0)), "tip": State((1, -1), (0, 0))}
    return TransferProblem(
        System([Member("elbow", 1.0), Member("tip", 1.0)], [upper, lower]),
        start,
        {"elbow": State((1, 0), None)},
        STEPS * STEP,
        [UniformGravity((0, -1.0))],
        JointTorque(upper),
    )


def runge_kutta(problem, steps):
    """Coordinates and velocities after steps of the classical method on the equations differentiated twice."""
    dynamics = Dynamics.of(problem)
    t, q, w, m, slope = dynamics.states()
    rate = dynamics.acceleration(t, q, w, m, ca.DM.zeros(dynamics.freedom))
    flow = ca.Function("flow", [ca.vertcat(q, w)], [ca.substitute(ca.vertcat(slope, rate), m, problem.mass)])
    y = ca.SX.sym("y", q.numel() + w.numel())
    k1 = flow(y)
    k2 = flow(y + STEP / 2 * k1)
    k3 = flow(y + STEP / 2 * k2)
    k4 = flow(y + STEP * k3)
    step = ca.Function("step", [y], [y + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])
    start = np.concatenate(problem.start.fixed())
    return step.mapaccum("march", steps, {"base": 4})(start).full().T[:, : q.numel()]


def test_schemes_keep_rods_and_energy_where_runge_kutta_lets_both_go():
    methods = {name: LENGTHS[name] for name in ("order 2", "order 4", "RK4")}
    rows = {row.method: row for row in swing(double_pendulum(), 1000, methods)}
    for name, most in (("order 2", 2e-3), ("order 4", 2e-5)):
        assert rows[name].gap < 1e-15 and rows[name].energy_error < most and rows[name].growth < 10
    assert rows["RK4"].gap > 1e-5 and rows["RK4"].growth > 50


def test_a_swing_needs_links_and_a_whole_start():
    for problem in (kepler(0.1), replace(double_pendulum(), start={"elbow": State((1, 0), None)})):
        with pytest.raises(ValueError, match="swing needs a problem with links"):
            swing(problem)


@pytest.mark.slow
def test_a_double_pendulum_keeps_its_rods_and_its_energy_and_runge_kutta_does_not():
    problem = pendulum()
    flight = simulate(problem, steps=STEPS, order=4)
    body = configuration_of(problem)
    q = ca.SX.sym("q", body.size)
    gap = ca.Function("gap", [q], [body.g(q)])
    assert np.abs(gap(flight.position.T).full()).max() < 1e-13
    energy = np.abs(flight.energy - flight.energy[0])
    early, late = energy[: STEPS // 10].max(), energy[-STEPS // 10 :].max()
    assert late < 2 * early < 1e-3, "the energy error does not grow"
    drift = np.abs(gap(runge_kutta(problem, 1000).T).full()).max(axis=0)
    # A hundredth of the steps is enough: without a projection its rods have grown by 1.8 cm.
    assert drift[99] < 2e-4 < 1e-2 < drift[-1]


@pytest.mark.slow
def test_a_free_chain_keeps_its_angular_momentum():
    hinge = Revolute((0, 0, 1), anchor=(0.5, 0, 0), at=(-0.5, 0, 0), on="b", to="a")
    bodies = [Member("a", 1.0, (0.1, 0.2, 0.25)), Member("b", 0.8, (0.05, 0.1, 0.12))]
    problem = TransferProblem(
        System(bodies, [hinge]),
        {"a": Pose((0, 0, 0), (0, 0, 0), rate=(0.3, 0.2, 0.1)), hinge: JointState(0.5, 0.4)},
        {},
        STEPS * STEP,
        actuator=JointTorque(hinge),
    )
    flight = simulate(problem, steps=STEPS, order=4)
    spin = 0.0
    for i, body in enumerate(bodies):
        r, v = (part[:, 3 * i : 3 * i + 3] for part in (flight.position, flight.velocity))
        attitude, rate = flight.attitude[:, 4 * i : 4 * i + 4], flight.rate[:, 3 * i : 3 * i + 3]
        assert np.abs(np.sum(attitude**2, axis=1) - 1).max() < 1e-13
        spin = spin + body.mass * np.cross(r, v) + rotated(attitude, rate @ np.array(body.inertia))
    assert np.abs(spin - spin[0]).max() < 1e-11 * np.abs(spin[0]).max() * max(1, np.abs(flight.position).max())
