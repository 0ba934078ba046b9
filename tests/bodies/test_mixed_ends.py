"""Bodies that turn and move, one end of which speaks of the place alone or of the attitude alone."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    Attitude,
    CircularOrbit,
    Moving,
    PointGravity,
    Pose,
    State,
    Torque,
    TransferProblem,
    Wrench,
    export,
    load,
    rotation,
    solve,
    transcribe,
    verify,
)
from dmoc.basics.quaternions import angle_between
from dmoc.reports.ends import goal_words, met_words

J = (1.0, 2.0, 2.8)
MASS, TIME, WAY = 3.0, 5.0, np.array([2.0, 1.0, -1.0])
TURNED = rotation((0.2, 0.5, -0.8), np.degrees(2.0))
REST = State((0, 0, 0), (0, 0, 0))
# From rest to rest over a distance d a point costs 6 m^2 d^2 / T^3.
MOVED = 6 * MASS**2 * (WAY @ WAY) / TIME**3
# The turn of two radians alone, from rest to rest, by indirect shooting on Euler's equations.
TURN = 3.69659102851 - MOVED


def tumbling(t):
    return ca.vertcat(ca.cos(0.15 * t), 0, 0.6 * ca.sin(0.15 * t), 0.8 * ca.sin(0.15 * t))


def drifting(t):
    return ca.vertcat(2 + 0.1 * t, 1, -0.2 * t)


def flyer(start, goal, **more):
    return TransferProblem(MASS, start, goal, **{"duration": TIME, "actuator": Wrench(), "inertia": J} | more)


CASES = {
    "a place": (flyer(Pose((0, 0, 0)), State(WAY, (0, 0, 0))), MOVED),
    "from a place": (flyer(REST, Pose(WAY, attitude=TURNED)), MOVED),
    "an attitude": (flyer(Pose((0, 0, 0)), Attitude(TURNED)), TURN),
    "from an attitude": (flyer(Attitude((1, 0, 0, 0)), Pose(WAY, attitude=TURNED)), TURN),
    # Along x a point covers 2.5 m to a speed of 0.1 m/s: 2 m^2 (3 d^2 / T^3 - 3 d v / T^2 + v^2 / T) an axis.
    "a place that moves": (
        flyer(Pose((0, 0, 0)), Moving(drifting)),
        sum(
            2 * MASS**2 * (3 * d**2 / TIME**3 - 3 * d * v / TIME**2 + v**2 / TIME)
            for d, v in ((2.5, 0.1), (1, 0), (-1, -0.2))
        ),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_what_an_end_does_not_speak_of_is_free(name):
    """The costs are those of the translation alone or of the turn alone."""
    problem, cost = CASES[name]
    found = solve(problem, order=6).raise_for_status()
    assert verify(found).ok
    assert found.objective == pytest.approx(cost, rel=1e-8)
    assert found.position.shape[1] == 3 and found.attitude.shape[1] == 4


def test_an_attitude_that_turns_is_met_wherever_the_body_is():
    problem = flyer(Pose((0, 0, 0)), Moving(None, attitude=tumbling))
    found = solve(problem, order=4).raise_for_status()
    assert verify(found).ok and np.abs(found.position).max() < 1e-9
    wanted = np.array(ca.DM(tumbling(TIME))).ravel()
    assert angle_between(found.attitude[-1], wanted) < 1e-8
    assert found.rate[-1] == pytest.approx((0, 0.18, 0.24), abs=1e-8)
    alone = solve(replace(problem, start=Attitude((1, 0, 0, 0)), actuator=Torque()), order=4)
    assert found.objective == pytest.approx(alone.objective, rel=1e-9)
    assert "any position, at the attitude (0.73169, 0, 0.40898, 0.54531) at 5 s" in goal_words(problem)
    assert met_words(found).startswith("goal met at the attitude (0.73169, ")
    placed = flyer(Pose((0, 0, 0)), Moving(drifting))
    assert goal_words(placed).endswith("any attitude, at (2.5, 1, -1) m at 5 s")


@pytest.mark.parametrize("radius", [1.3, 1.5])
def test_an_orbit_is_reached_in_any_attitude(radius):
    start, gravity = Pose((1, 0, 0), (0, 1, 0)), [PointGravity(1.0)]
    body = flyer(start, CircularOrbit(radius, 1.0), duration=6.0, effects=gravity)
    found = solve(body, order=4).raise_for_status()
    point = TransferProblem(MASS, State((1, 0, 0), (0, 1, 0)), CircularOrbit(radius, 1.0), 6.0, effects=gravity)
    assert verify(found).ok
    assert found.objective == pytest.approx(solve(point, order=4).objective, rel=1e-8)
    assert np.linalg.norm(found.position[-1]) == pytest.approx(radius, abs=1e-8)


def test_the_numbers_of_an_orbit_are_built_in():
    def leaving(radius):
        return flyer(Pose((1, 0, 0), (0, 1, 0)), CircularOrbit(radius, 1.0), effects=[PointGravity(1.0)])

    nlp = transcribe(leaving(1.3), 20, 4)
    assert nlp.solve(leaving(1.3)).success
    with pytest.raises(ValueError, match="another goal"):
        nlp.solve(leaving(1.5))


def test_a_free_time_to_an_orbit_is_guessed_for_the_centre_of_mass():
    body = flyer(
        Pose((1, 0, 0), (0, 1, 0)),
        State((-1.3, 0, 0), (0, -0.9, 0)),
        duration=(3.0, 4.5),
        effects=[PointGravity(1.0)],
        actuator=Wrench(2.0, 1.0),
    )
    assert verify(solve(body, order=4).raise_for_status()).ok


def test_files_and_exports_know_a_free_attitude(tmp_path):
    spinning = flyer(Pose((0, 0, 0), rate=(0.3, 0.1, -0.2)), State(WAY, (0, 0, 0)))
    found = solve(spinning, order=4, steps=12).raise_for_status()
    found.save(tmp_path / "mixed.nc")
    back = load(tmp_path / "mixed.nc")
    assert np.array_equal(back.attitude, found.attitude) and verify(back, spinning).ok
    export(spinning, tmp_path / "mixed", steps=12, order=4)
    planner = ca.Function.load(str(tmp_path / "mixed" / "solver.casadi"))
    given = ca.Function.load(str(tmp_path / "mixed" / "nominal.casadi"))()
    replanned = planner(**given | {"goal_position": WAY / 2})
    assert float(replanned["objective"]) == pytest.approx(found.objective / 4, rel=1e-8)
