"""Noether's theorem of the costates: what symmetries keep, and that nothing else is taken for one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dmoc import (
    BallForce,
    Engine,
    Fuel,
    KeepOut,
    PointGravity,
    State,
    TransferProblem,
    UniformGravity,
    solve,
    symmetries,
    worth,
)
from dmoc.motion.path import COSTATE
from dmoc.scene.problem_file import load_problem


def of_goal(found, axis, center=(0, 0)):
    """What it costs to move the goal along an axis or, without one, to turn it about a point of the plane."""
    if axis:
        return found[f"goal_position.{axis}"].value
    x, y = (found[f"goal_position.{a}"].number - c for a, c in zip("xy", center, strict=True))
    vx, vy = (found[f"goal_velocity.{a}"].number for a in "xy")
    place = x * found["goal_position.y"].value - y * found["goal_position.x"].value
    return place + vx * found["goal_velocity.y"].value - vy * found["goal_velocity.x"].value


@pytest.mark.parametrize("order, hold", [(2, False), (2, True), (4, False), (8, False)])
def test_around_an_attractor_turns_keep_the_angular_momentum_of_the_costates(order, hold):
    center = (0.5, -0.2)
    problem = TransferProblem(
        1.3,
        State((1.5, -0.2), (0, 1)),
        State((-0.8, 0.1), (-0.1, -0.8)),
        3.0,
        effects=[PointGravity(1.0, center)],
        actuator=BallForce(3.0),
    )
    answer = solve(problem, order=order, steps=12, hold=hold).raise_for_status()
    (turn,) = symmetries(answer)
    assert turn.words == "turned about (0.5, -0.2) m" and turn.unit == "N^2 s/rad"
    assert turn.drift < 1e-8
    assert turn.value == pytest.approx(of_goal(worth(answer), "", center), rel=1e-6)
    assert abs(turn.value) > 0.1
    # Costates that are off by a thousandth keep nothing.
    costates = answer.costate * (1 + 1e-3 * np.sin(np.arange(len(answer.costate))))[:, None]
    path = replace(answer.path, multipliers=answer.path.multipliers | {COSTATE: costates})
    (spoilt,) = symmetries(replace(answer, path=path))
    assert spoilt.drift > 1e-5


def test_gravity_that_is_the_same_everywhere_lets_everything_be_moved():
    problem = TransferProblem(
        2.0, State((0, 0), (0, 0)), State((4, 3), (0, 0)), 5.0, effects=[UniformGravity((0, -1.5))]
    )
    answer = solve(problem, order=4, steps=10)
    found = {one.words: one for one in symmetries(answer)}
    assert set(found) == {"moved along (1, 0)", "moved along (0, 1)"}
    values = worth(answer)
    for words, axis in (("moved along (1, 0)", "x"), ("moved along (0, 1)", "y")):
        assert found[words].value == pytest.approx(of_goal(values, axis), rel=1e-8)
        assert found[words].drift < 1e-9


def test_a_zone_that_is_touched_has_its_own_centre():
    zone = KeepOut((0.1, -0.3), 1.0)
    problem = TransferProblem(1.0, State((-3, 0), (0, 0)), State((3, 0), (0, 0)), 6.0, constraints=[zone])
    (turn,) = symmetries(solve(problem, order=4, steps=20))
    assert turn.words == "turned about (0.1, -0.3) m" and turn.drift < 1e-6


def test_three_axes_and_an_engine():
    """The objective is a mass; the symmetry of a central attractor in space is that of three axes."""
    answer = solve(load_problem("two_body_fuel").make(), order=4, steps=60)
    found = symmetries(answer)
    assert sorted(one.words for one in found) == [
        f"turned about the axis {axis} through (0, 0, 0) m" for axis in ("(0, 0, 1)", "(0, 1, 0)", "(1, 0, 0)")
    ]
    assert max(one.drift for one in found) < 1e-8 and found[0].unit == "kg/rad"
    values = worth(answer)
    about_z = next(one for one in found if "(0, 0, 1)" in one.words)
    assert about_z.value == pytest.approx(of_goal(values, ""), rel=1e-6)
    assert isinstance(answer.problem.actuator, Engine) and isinstance(answer.problem.objective, Fuel)


def test_what_has_none():
    # Some screw keeps the distances from all spheres at the few nodes that touch them, by chance.
    for name in ("halo_transfer", "reorientation", "free_flyer"):
        assert symmetries(solve(load_problem(name).make(), order=4, steps=40)) == ()
    with pytest.raises(ValueError, match="solution must be a"):
        symmetries(load_problem("orbit_raise").make())
