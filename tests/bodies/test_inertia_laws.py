"""The inertia of a body whose thrusters burn: it shrinks with the mass, or it stays.

The reference integrates Newton's and Euler's equations by SciPy, without the package:

    m dv/dt = R(q) F,    J dw/dt + w x J w = tau,    dm/dt = -sum u / c,

with J = J_0 m / m_0 ("scaled") or J = J_0 ("constant"). No term comes from the change of J: what leaves the
body takes its angular momentum along.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dmoc import (
    Effort,
    GravityGradient,
    Pose,
    Thrusters,
    TransferProblem,
    load,
    rotation,
    simulate,
    solve,
    verify,
)
from dmoc.basics.quaternions import angle_between, conjugate, rotated, times
from dmoc.exports.export import functions_of
from dmoc.motion.lobatto import scheme
from dmoc.planners.planner import Planner

J, MASS, EXHAUST, TIME = np.array([1.0, 2.0, 2.8]), 2.0, 20.0, 4.0
PLACES = np.array([(a, b, 0) for a in (0.5, -0.5) for b in (0.5, -0.5)] * 3)
PLACES = np.array([np.roll(place, i // 4) for i, place in enumerate(PLACES)])
WAYS = np.array([np.roll((sign, 0, 0), i) for i in range(3) for sign in (-1, -1, 1, 1)])
START = Pose((6, -2, 4), (0.1, 0.2, -0.1), rotation((1, 1, 0), 30), (0.4, -0.3, 0.5))
LAWS = ["scaled", "constant"]


def burning(law, **more):
    thrusters = Thrusters(PLACES, WAYS, 2.0, exhaust_velocity=EXHAUST, dry_mass=0.5, inertia_law=law)
    more = {"start": START, "goal": START, "actuator": thrusters, "inertia": J} | more
    return TransferProblem(MASS, duration=TIME, **more)


def thrust(t):
    return 0.4 * (1 + np.sin(np.multiply.outer(t, np.ones(12)) + np.arange(12)))


def flown(law, mu=0.0):
    """Position, attitude, rate and mass at the end."""

    def slope(t, y):
        place, v, q, w, m = np.split(y, [3, 6, 10, 13])
        u, inertia = thrust(t), J * (m / MASS if law == "scaled" else 1.0)
        force, torque = rotated(q, u @ WAYS), u @ np.cross(PLACES, WAYS)
        r = np.linalg.norm(place)
        n = rotated(conjugate(q), place / r)
        # The gradient of gravity turns the body and pulls at it, by the slope of the same potential.
        torque = torque + 3 * mu / r**3 * np.cross(n, inertia * n)
        middle = inertia.sum() / 2 - 2.5 * n @ (inertia * n)
        pull = -3 * mu / r**4 * (middle * place / r + rotated(q, inertia * n))
        turning = (torque - np.cross(w, inertia * w)) / inertia
        return np.concatenate(
            [v, (force + pull) / m, times(q, np.append(0.0, w)) / 2, turning, [-u.sum() / EXHAUST]]
        )

    begin = np.concatenate([START.position, START.velocity, START.attitude, START.rate, [MASS]])
    end = solve_ivp(slope, (0, TIME), begin, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    return end[:3], end[6:10], end[10:13], end[13]


@pytest.mark.parametrize("mu", [0.0, 50.0])
@pytest.mark.parametrize("law", LAWS)
def test_a_march_obeys_eulers_equations_with_that_inertia(law, mu):
    problem = burning(law, effects=[GravityGradient(mu)] if mu else [])
    rule, steps = scheme(6), 40
    nodes = np.append((np.arange(steps)[:, None] + rule.points[:-1]).ravel() / steps, 1.0) * TIME
    found = simulate(problem, thrust(nodes), steps=steps, order=6)
    place, attitude, rate, mass = flown(law, mu)
    assert found.mass[-1] == pytest.approx(mass, rel=1e-10) and mass < 0.8 * MASS
    assert found.position[-1] == pytest.approx(place, abs=1e-8)
    assert angle_between(found.attitude[-1], attitude) < 1e-8
    assert found.rate[-1] == pytest.approx(rate, abs=1e-8)


def test_the_laws_differ():
    scaled, constant = (flown(law) for law in LAWS)
    assert np.degrees(angle_between(scaled[1], constant[1])) > 10


@pytest.mark.parametrize("law", LAWS)
def test_a_transfer_passes_every_check(law, tmp_path):
    """By the independent integrator too; and from a file again."""
    goal = Pose((0, 1, 0), attitude=rotation((0, 0, 1), 40))
    problem = burning(law, start=Pose((0, 0, 0)), goal=goal)
    found = solve(problem, order=4, steps=40).raise_for_status()
    assert verify(found).ok
    found.save(tmp_path / "burnt.nc")
    assert verify(load(tmp_path / "burnt.nc"), problem).ok
    other = next(one for one in LAWS if one != law)
    assert not verify(load(tmp_path / "burnt.nc"), burning(other, start=problem.start, goal=goal)).ok


def test_the_ledger_keeps_energy_and_spin_where_the_inertia_stays():
    problem = burning("constant", start=Pose((0, 0, 0)), goal=Pose((1, 1, 0), attitude=rotation((1, 0, 1), 60)))
    found = solve(replace(problem, objective=Effort()), order=6, steps=30).raise_for_status()
    report = verify(found)
    assert report.ok and "energy" in report["ledger"].note and found.final_mass < 0.9 * MASS


@pytest.mark.parametrize("law", LAWS)
def test_an_exported_residual_is_in_newton_metres(law):
    """With thrusts that make a torque of 1 N m more than the motion takes, whatever has been burnt."""
    problem, steps = burning(law), 20
    made = functions_of(Planner.of(problem, 2, steps, False))
    residual = next(one.function for one in made if one.function.name() == "residual")
    thrusts = thrust(np.linspace(0, TIME, steps + 1))
    marched = simulate(problem, thrusts, steps=steps, order=2)
    acts = np.vstack([WAYS.T, np.cross(PLACES, WAYS).T])
    more = np.linalg.lstsq(acts, np.array([0, 0, 0, 0, 0, 1.0]), rcond=None)[0]
    found = residual(
        positions=marched.position.T,
        attitudes=marched.attitude.T,
        forces=(thrusts + more).T,
        masses=marched.mass[None],
        duration=TIME,
        start_velocity=marched.velocity[0],
        goal_velocity=marched.velocity[-1],
        start_rate=marched.rate[0],
        goal_rate=marched.rate[-1],
    )["residual_torque"].full()
    assert found == pytest.approx(np.outer([0, 0, 1.0], np.ones(steps + 1)), abs=1e-8)


def test_laws_are_told_and_others_refused():
    assert "inertia shrinks with the mass" in burning("scaled").actuator.words()
    assert "inertia stays" in burning("constant").actuator.words()
    with pytest.raises(ValueError, match="inertia_law must be 'scaled' or 'constant'; got 'linear'"):
        burning("linear")
