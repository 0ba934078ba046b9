"""Flights with errors: against the plain integrator, closed forms, and their own linear map."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from dmoc import (
    BallForce,
    Engine,
    Fuel,
    KeepOut,
    LinearDrag,
    Nozzles,
    PointGravity,
    RotatingFrame,
    SpeedLimit,
    State,
    TransferProblem,
    disperse,
    feedback,
    simulate,
    solve,
    transcribe,
    worth,
)
from dmoc.cli.app import main
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_fractions
from dmoc.scene.problem_file import load_problem
from dmoc.sensitivity.dispersion import interval
from dmoc.sensitivity.flights import Flights

PLAIN = {"mass": 2.0, "start": State((0, 0), (0, 0)), "goal": State((4, 1), (0, 0)), "duration": 5.0}
# Gravity, a drag, a frame that turns: momenta differ from velocities, and steps are implicit.
ROUGH = {
    "mass": 2.0,
    "start": State((1, 0, 0), (0, 1, 0)),
    "goal": State((-1.2, 0.1, 0.1), (0, -0.9, 0)),
    "duration": 3.0,
    "effects": [PointGravity(1.0), LinearDrag(0.1), RotatingFrame((0, 0, 0.2))],
}


def rotated(turn):
    """Cayley's rotation, by its definition (1 - S/2)^-1 (1 + S/2)."""
    x, y, z = turn
    s = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) / 2
    return np.linalg.solve(np.eye(3) - s, np.eye(3) + s)


@pytest.mark.parametrize("order, hold", [(2, False), (2, True), (4, False), (8, False)])
def test_a_flight_is_that_of_the_integrator(order, hold):
    """The same start, mass and forces, given to the integrator as they are, lead to the same place."""
    problem = TransferProblem(**ROUGH)
    answer = solve(problem, order=order, steps=10, hold=hold)
    flights = Flights(problem, answer.path)
    error = np.array([0.01, -0.02, 0.03, 0.02, 0.01, -0.01, 0.05, 0.02, -0.03, 0.04, 0.06])
    position, velocity = flights.flown(np.stack([0 * error, error]))
    assert position[0] == pytest.approx(answer.position, abs=1e-10)
    begun = State(
        tuple(np.add(problem.start.position, error[:3])), tuple(np.add(problem.start.velocity, error[3:6]))
    )
    force = 1.05 * answer.path.control @ rotated(error[7:10]).T
    changed = replace(problem, start=begun, mass=2.0 * 1.06)
    known = simulate(changed, force, steps=10, order=order, hold=hold)
    ends = slice(None, None, len(position[0]) // 10)
    assert position[1, ends] == pytest.approx(known.position, abs=1e-11)
    assert np.abs(known.position - position[0, ends]).max() > 0.01
    assert velocity[1, ends] == pytest.approx(known.velocity, abs=1e-11)


def test_propellant_burns_as_planned():
    """A force 3 % too large and a body 2 % too heavy: 1 m/s less or more, mass by mass."""
    engine = Engine(1.5, exhaust_velocity=20.0)
    problem = TransferProblem(actuator=engine, objective=Fuel(), **(PLAIN | {"duration": 6.0}))
    answer = solve(problem, order=2, steps=40).raise_for_status()
    error = np.zeros(7)
    error[4], error[6] = 0.03, 0.02
    position, _ = Flights(problem, answer.path).flown(error[None])
    # x'' = F / m, and the steps of order 2 are those of the trapezoidal sum of forces.
    masses, path = answer.path.mass + 0.02 * answer.path.mass[0], answer.path
    force, h = 1.03 * answer.force, path.duration / 40
    x, p = [path.position[0]], np.zeros(2)
    for k in range(40):
        x.append(x[-1] + h * (p + 0.5 * h * force[k] / masses[k]))
        p = p + 0.5 * h * (force[k] / masses[k] + force[k + 1] / masses[k + 1])
    assert position[0] == pytest.approx(np.array(x), abs=1e-12)


def test_slopes_are_central_differences():
    answer = solve(TransferProblem(**ROUGH), order=4, steps=10)
    flights = Flights(answer.problem, answer.path)
    by = 1e-5 * np.eye(flights.size)
    position, velocity = flights.flown(np.vstack([by, -by]))
    slopes = flights.slopes()
    assert slopes.shape == (11, 6, 11)
    ends = slice(None, None, 2)
    moved = (position[:11] - position[11:])[:, ends] / 2e-5
    assert slopes[:, :3].transpose(2, 0, 1) == pytest.approx(moved, abs=1e-7)
    changed = (velocity[:11] - velocity[11:])[:, ends] / 2e-5
    assert slopes[:, 3:].transpose(2, 0, 1) == pytest.approx(changed, abs=1e-7)


def test_the_linear_covariance_is_a_closed_form_without_effects():
    """x(t) = x0 + v0 t + (1 + e) x_planned(t) for small errors; a turn moves it across."""
    answer = solve(TransferProblem(**PLAIN), order=4, steps=10)
    found = disperse(answer, start=(0.02, 0.01), force=0.03, pointing=0.02, samples=2000)
    end = np.array([4.0, 1.0])
    spread = 0.02**2 + (5 * 0.01) ** 2 + (0.03 * end) ** 2 + (0.02 * end[::-1]) ** 2
    assert found.sigma[-1, :2] == pytest.approx(np.sqrt(spread), rel=1e-9)
    assert found.sigma[-1, 2:] == pytest.approx([0.01, 0.01], rel=1e-9)
    assert found.sigma[0] == pytest.approx([0.02, 0.02, 0.01, 0.01], rel=1e-12)
    # The deviation of 2000 samples is known to 1.6 %.
    assert found.sampled_sigma[-1] == pytest.approx(found.sigma[-1], rel=0.05)
    assert [part for part, *_ in found.miss] == [0.5, 0.9, 0.95, 0.99]
    distances = np.linalg.norm(found.position[:, -1] - end, axis=1)
    assert found.miss[2][1] == pytest.approx(np.sort(distances)[1899], rel=0.01)


def test_the_documented_spread():
    """Figures of other code for the transfer between two circles."""
    answer = solve(load_problem("orbit_raise").make(), order=8, steps=32)
    found = disperse(answer, start=(1e-3, 1e-3), force=0.01, pointing=0.01, samples=300, seed=3)
    assert found.sigma[-1] == pytest.approx([0.01136, 0.0570, 0.0313, 0.00431], rel=2e-3)
    assert found.sampled_sigma[-1] == pytest.approx(found.sigma[-1], rel=0.1)


@pytest.mark.parametrize("order, hold", [(2, False), (4, True)])
def test_noise_in_each_step(order, hold):
    """Without effects a push F adds F h / m to the velocity, and half of that times h to the place."""
    answer = solve(TransferProblem(**PLAIN), order=order, steps=20, hold=hold)
    found = disperse(answer, force_noise=0.3, samples=2000, seed=3)
    h, later = 0.25, 0.25 * np.arange(20)
    kick = 0.3 * h / 2.0
    speed, place = kick * np.sqrt(20), kick * np.sqrt(np.sum((later + h / 2) ** 2))
    assert found.sigma[-1] == pytest.approx([place, place, speed, speed], rel=1e-9)
    assert found.sampled_sigma[-1] == pytest.approx(found.sigma[-1], rel=0.06)
    assert found.sigma[0] == pytest.approx(0, abs=1e-15)


def test_noise_in_each_step_of_a_rough_flight():
    """The linear covariance is that of differences of flights by the noise of every single step."""
    answer = solve(TransferProblem(**ROUGH), order=4, steps=6)
    flights, step = Flights(answer.problem, answer.path), 1e-5
    pushed = np.zeros((36, 6, 3))
    pushed[np.arange(36), np.arange(36) // 2 // 3, np.arange(36) // 2 % 3] = np.tile([step, -step], 18)
    position, velocity = flights.flown(np.zeros((36, flights.size)), pushed)
    states = np.concatenate([position, velocity], axis=2)[:, ::2]
    slopes = (states[::2] - states[1::2]) / (2 * step)
    expected = 0.04 * np.einsum("nki,nkj->kij", slopes, slopes)
    assert flights.process(0.2) == pytest.approx(expected, abs=1e-9)
    # It adds to what lasts, and each sample has noise of its own, the same whatever comes behind it.
    both = disperse(answer, (0.01, 0.0), force_noise=0.2, samples=300, seed=1)
    alone = disperse(answer, (0.01, 0.0), samples=300, seed=1)
    assert both.covariance - alone.covariance == pytest.approx(expected, abs=1e-9)
    more = disperse(answer, (0.01, 0.0), force_noise=0.2, samples=400, seed=1)
    assert np.array_equal(more.position[:300], both.position)
    assert not np.allclose(both.position[0], both.position[1])


@pytest.fixture(scope="module")
def rough():
    return solve(TransferProblem(**ROUGH), order=4, steps=20, hold=True)


def test_feedback_is_a_new_plan_to_first_order(rough):
    """At the start and on the way: the force of a plan from a state off the path, on the rest of the mesh."""
    gains, step = feedback(rough), 1e-4
    for k in (0, 8):
        mesh = (rough.path.mesh[k:] - rough.path.mesh[k]) / (1 - rough.path.mesh[k])
        left, begun = 3.0 * (1 - rough.path.mesh[k]), 3.0 * rough.path.mesh[k]
        state = rough.position[2 * k], rough.velocity[k]
        forces = []
        for sign in (1, -1):
            away = State(
                tuple(state[0] + sign * np.array([0, step, 0])), tuple(state[1] + sign * np.array([step, 0, 0]))
            )
            problem = TransferProblem(**ROUGH | {"start": away, "duration": left, "start_time": begun})
            nlp = transcribe(problem, order=4, mesh=mesh, hold=True)
            known = begun + left * node_fractions(mesh, scheme(4)), rough.position[2 * k :]
            forces.append(nlp.solve(guess=known).path.control[0])
        slope = (forces[0] - forces[1]) / (2 * step)
        assert gains[k] @ np.array([0, 1, 0, 1, 0, 0]) == pytest.approx(slope, rel=1e-4)


def test_feedback_brings_flights_to_the_goal(rough):
    errors = {"start": (0.01, 0.01), "force_noise": 0.05, "samples": 400}
    alone, answered = (disperse(rough, **errors, feedback=on) for on in (False, True))
    assert answered.sigma[-1].max() < 0.06 * alone.sigma[-1].max()
    assert answered.sampled_sigma[-1] == pytest.approx(answered.sigma[-1], rel=0.15)
    assert answered.sampled_sigma[10] == pytest.approx(answered.sigma[10], rel=0.15)
    assert np.array_equal(alone.position[:, 0], answered.position[:, 0])


def test_feedback_of_every_scheme_and_where_there_is_none():
    for order, hold in ((2, False), (8, False)):
        answer = solve(TransferProblem(**ROUGH), order=order, steps=20, hold=hold)
        errors = {"start": (0.01, 0.01), "samples": 50}
        ends = [disperse(answer, **errors, feedback=on).sigma[-1].max() for on in (False, True)]
        assert ends[1] < 0.1 * ends[0]
    free = solve(TransferProblem(**PLAIN | {"start": State((0, 0), (None, 0))}), order=4, steps=10)
    with pytest.raises(ValueError, match="feedback needs a start whose position and velocity"):
        feedback(free)
    ways = [(1, 0), (-1, 0), (0, 1), (0, -1)]
    pushed = solve(TransferProblem(**PLAIN, actuator=Nozzles(ways, 5.0)), order=4, steps=10)
    with pytest.raises(ValueError, match="feedback needs an actuator whose controls are a force"):
        disperse(pushed, (0.01, 0.01), feedback=True)


def test_each_error_has_random_numbers_of_its_own():
    answer = solve(TransferProblem(**PLAIN), order=2, steps=6)

    def flown(**errors):
        return disperse(answer, **({"samples": 300, "seed": 5} | errors)).position[:, -1]

    # Without effects what errors do adds up, and no error changes the numbers of another.
    plan = flown(samples=2)[0]
    both = flown(start=(0.1, 0.0), force=0.01) - plan
    parts = [flown(start=(0.1, 0.0)) - plan, flown(force=0.01) - plan]
    assert both == pytest.approx(sum(parts), abs=1e-12)
    assert np.array_equal(flown(force=0.01), flown(force=0.01))
    # More flights come behind the others, also beyond those that are flown at once.
    assert flown(force=0.01, samples=20) == pytest.approx(flown(force=0.01)[:20], abs=1e-14)
    assert np.abs(flown(force=0.01, seed=6) - flown(force=0.01)).max() > 1e-3
    assert abs(np.corrcoef(parts[0][:, 0], parts[1][:, 0])[0, 1]) < 0.15


def test_the_chance_of_breaking_a_limit():
    """A wall that the plan touches is broken by half of the flights; one far away by none."""
    # Straight past a disc that is 0.1 m off the path, with errors of 0.1 m across: one in six comes too near.
    problem = TransferProblem(
        mass=1.0,
        start=State((-3, 0), (1, 0)),
        goal=State((3, 0), (1, 0)),
        duration=6.0,
        constraints=[KeepOut((0, -1.1), 1.0), KeepOut((0, 9.0), 1.0), SpeedLimit(1.5)],
    )
    answer = solve(problem, order=2, steps=60)
    found = disperse(answer, start=((0.0, 0.1), 0.0), samples=4000)
    near, far = found.chances["keep_out_1"], found.chances["keep_out_2"]
    true = 0.15865525393145707
    assert near.low < true < near.high and near.value == near.broken / 4000
    assert near.unit == "m" and near.margin == pytest.approx(0.1 * (1.6448536 - 1), rel=0.1)
    assert (far.broken, far.low, far.margin) == (0, 0.0, 0.0)
    assert far.high == pytest.approx(1 - 0.025 ** (1 / 4000), rel=1e-9)
    assert found.chances["speed_limit_3"].broken == 0
    quick = disperse(answer, start=(0.0, 0.25), samples=500).chances["speed_limit_3"]
    # |v| of two errors of 0.25 m/s around (1, 0) is above 1.5 with 2.9 %.
    assert quick.unit == "m/s" and quick.low < 0.029 < quick.high


def test_the_interval_is_that_of_clopper_and_pearson():
    """From tables: 3 of 10, and none or all of them."""
    assert interval(3, 10) == pytest.approx((0.0667, 0.6525), abs=1e-4)
    assert interval(0, 10) == pytest.approx((0.0, 0.3085), abs=1e-4)
    assert interval(10, 10) == pytest.approx((0.6915, 1.0), abs=1e-4)


def test_bad_input():
    answer = solve(TransferProblem(actuator=BallForce(9.0), **PLAIN), order=2, steps=40)
    for given, words in (
        ({"start": 0.1}, "start must be a pair"),
        ({"start": (0.1, -1.0)}, "start: velocity must not be negative"),
        ({"start": ((0.1, 0.1, 0.1), 0.0)}, "the position has 2 axes"),
        ({"force": np.inf}, "force must be a finite number"),
        ({"samples": 1}, "samples must be a whole number of at least 2"),
        ({"samples": 10**7}, "samples must be at most 1219512 on this mesh"),
        ({"seed": -1}, "seed must be a whole number of at least 0"),
    ):
        with pytest.raises(ValueError, match=words):
            disperse(answer, **given)
    line = {"start": State([0], [0]), "goal": State([1], [0])}
    with pytest.raises(ValueError, match="pointing has no meaning along a line"):
        disperse(solve(TransferProblem(**(PLAIN | line)), steps=4), pointing=0.1)
    for name in ("reorientation", "pendulum", "gates"):
        problem = load_problem(name).make()
        with pytest.raises(
            ValueError, match=r"(disperse and feedback take|flights with errors are of one body)"
        ):
            disperse(solve(getattr(problem, "alone", None) or problem))
    with pytest.raises(ValueError, match="solution must be a"):
        disperse(answer.path)
    assert worth(answer)["mass"].value > 0


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main([str(one) for one in arguments])
    return ended.value.code, capsys.readouterr()


def test_the_command(capsys, tmp_path):
    file, picture = tmp_path / "flight.nc", tmp_path / "flights.png"
    run(capsys, "solve", "free_flyer", "--steps", "60", "--out", file, "--quiet")
    errors = ["--start", "0.01,0.001", "--force", "0.01", "--pointing", "0.01", "--samples", "200"]
    code, told = run(capsys, "disperse", file, *errors, "--plot", picture)
    assert code == 0 and picture.stat().st_size > 20_000
    assert "200 flights of free_flyer with errors, seed 0" in told.out and "keep_out_1" in told.out
    code, told = run(capsys, "disperse", file, *errors, "--json", "--seed", "4")
    found = json.loads(told.out)
    assert code == 0 and (found["samples"], found["seed"]) == (200, 4)
    # Free space, 40 s: 0.01 m, 0.04 m by the velocity, 0.08 m by the force, 0.01 and 0.01 m by the pointing.
    x = np.sqrt(0.01**2 + 0.04**2 + 0.08**2 + 2 * 0.01**2)
    assert found["sigma_at_end"]["linear"]["position"][0] == pytest.approx(x, rel=1e-6)
    assert set(found["limits"]) == {"keep_out_1", "keep_out_2", "keep_out_3"}
    code, told = run(capsys, "disperse", file, "--start", "1")
    assert (code, told.err.count("\n")) == (2, 1) and "two numbers A,B" in told.err
