"""Every effect serves a transfer: solved, verified, without a look at the velocity it has no need for."""

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    J2,
    BallForce,
    ClohessyWiltshire,
    ConicalShadow,
    CylindricalShadow,
    Drag,
    ExponentialAtmosphere,
    LinearDrag,
    PointGravity,
    RadiationPressure,
    RotatingFrame,
    Spring,
    State,
    ThirdBody,
    Time,
    TransferProblem,
    UniformAtmosphere,
    UniformGravity,
    circular_motion,
    kepler_motion,
    solve,
    tabulated_motion,
)
from dmoc.checks.verification import verify
from dmoc.configurations.acting import split_effects
from dmoc.configurations.base import Translation
from dmoc.motion.dynamics import Dynamics

MU, RADIUS = 3.986004418e14, 6.378137e6
MOON = circular_motion(3.844e8, 2.66e-6, 0.3, 0.4)
SUN = kepler_motion(1.3271e20, 1.496e11, 0.0167, 0.409, 0.0, 1.8, 0.2)
TIMES = np.linspace(-100.0, 6000.0, 40)
AIR = ExponentialAtmosphere(3.725e-12, 400e3, 58.515e3, RADIUS, 7.29e-5)
IN_SPACE = {
    "oblateness": J2(MU, RADIUS, 1.0826e-3),
    "moon": ThirdBody(4.9028e12, MOON),
    "moon from a table": ThirdBody(
        4.9028e12, tabulated_motion(TIMES, [np.array(MOON(t)).ravel() for t in TIMES])
    ),
    "drag": Drag(20.0, 2.2, AIR),
    "cone": RadiationPressure(20.0, 0.3, SUN, ConicalShadow(RADIUS)),
    "cylinder": RadiationPressure(20.0, 0.3, SUN, CylindricalShadow(RADIUS, 30.0)),
}
OTHERS = (
    PointGravity(MU),
    UniformGravity((0, 0, -9.81)),
    Spring(1.0, (0, 0, 0)),
    RotatingFrame(1.0),
    ClohessyWiltshire(1e-3),
    LinearDrag(0.1, wind=(1.0, 0, 0)),
)


def raise_orbit(effects):
    """From 400 to 600 km, once around but for a tenth, inclined by 51 degrees."""
    (low, high), angle = (RADIUS + 400e3, RADIUS + 600e3), 0.9 * 2 * np.pi
    slow, fast = np.sqrt(MU / high), np.sqrt(MU / low)
    side = np.array([0.0, np.cos(np.radians(51)), np.sin(np.radians(51))])
    ahead = np.array([1.0, 0, 0])
    start = State(low * ahead, fast * side)
    goal = State(
        high * (np.cos(angle) * ahead + np.sin(angle) * side),
        slow * (np.cos(angle) * side - np.sin(angle) * ahead),
    )
    duration = angle * np.sqrt((RADIUS + 500e3) ** 3 / MU)
    return TransferProblem(200.0, start, goal, duration, (PointGravity(MU), *effects))


@pytest.mark.parametrize("name", [*IN_SPACE, "all"])
def test_a_climb_through_low_orbits_is_solved_and_verified(name):
    effects = tuple(IN_SPACE.values()) if name == "all" else (IN_SPACE[name],)
    solution = solve(raise_orbit(effects), order=6, steps=40)
    assert solution.success, solution.message
    report = verify(solution)
    assert report.ok, report.checks


def test_a_drone_flies_upwind_slower_than_downwind():
    """Least time over 100 m with quadratic drag in a wind of 8 m/s; the duration is free."""

    def flight(wind):
        effects = (UniformGravity((0, -9.81)), Drag(0.1, 1.0, UniformAtmosphere(1.225, (wind, 0.0))))
        start, goal = State((0, 10), (0, 0)), State((100, 10), (0, 0))
        return TransferProblem(2.0, start, goal, (1.0, 60.0), effects, BallForce(30.0), Time())

    solutions = [solve(flight(wind), steps=100) for wind in (-8.0, 0.0, 8.0)]
    assert all(solution.success for solution in solutions)
    assert all(verify(solution).ok for solution in solutions)
    upwind, still, downwind = (solution.duration for solution in solutions)
    assert upwind > still > downwind


@pytest.mark.parametrize("effect", [*IN_SPACE.values(), *OTHERS], ids=lambda effect: type(effect).__name__)
def test_only_effects_of_the_velocity_look_at_it(effect):
    resting, moving = split_effects((effect,), Translation(3))
    sees_velocity = isinstance(effect, (Drag, LinearDrag, RotatingFrame, ClohessyWiltshire))
    assert (moving if sees_velocity else resting) == (effect,)


def test_no_effect_branches():
    """CasADi evaluates both sides of a branch: the one not taken may be NaN, and so is then the derivative."""
    dynamics = Dynamics(Translation(3), (PointGravity(MU), *IN_SPACE.values()))
    branches = {ca.OP_IF_ELSE_ZERO, ca.OP_FLOOR, ca.OP_SIGN, ca.OP_FABS}
    point = dynamics.point
    assert not branches & {point.instruction_id(i) for i in range(point.n_instructions())}


@pytest.mark.parametrize("effect", [*IN_SPACE.values(), *OTHERS], ids=lambda effect: type(effect).__name__)
def test_every_effect_says_in_one_line_what_it_is(effect):
    words = effect.words()
    assert type(effect).__name__ in words and "\n" not in words and len(words) < 300


def test_words_give_numbers_with_units_and_parts_by_name():
    assert IN_SPACE["oblateness"].words() == (
        "Pull of an attractor's oblateness about the z axis, on top of a PointGravity at the origin "
        "(J2, mu 3.986004418e+14 m^3/s^2, radius 6378137 m, j2 0.0010826)"
    )
    assert "atmosphere ExponentialAtmosphere(density 3.725e-12 kg/m^3" in IN_SPACE["drag"].words()
    assert "TabulatedMotion(times (40 values) s" in IN_SPACE["moon from a table"].words()
