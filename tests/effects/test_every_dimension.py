"""Every effect of the library works in the plane and in space, and with one axis where that has a meaning."""

import casadi as ca
import numpy as np
import pytest

import dmoc
from dmoc import (
    J2,
    ClohessyWiltshire,
    Conservative,
    Drag,
    Force,
    FreeForce,
    LinearDrag,
    PointGravity,
    RadiationPressure,
    RotatingFrame,
    Spring,
    State,
    ThirdBody,
    TransferProblem,
    UniformAtmosphere,
    UniformGravity,
    solve,
    three_body,
    verify,
)


def vector(dimension, *entries):
    return tuple(np.pad(entries, (0, 3))[:dimension])


def circling(dimension):
    """A body at distance 20 in the plane of the first axes."""
    return lambda t: ca.vertcat(20 * ca.cos(0.1 * t), 20 * ca.sin(0.1 * t), 0)[:dimension]


# Each effect in so many axes.
EVERY = {
    J2: lambda n: J2(1.0, 0.5, 1e-3),
    ClohessyWiltshire: lambda n: ClohessyWiltshire(0.3),
    Drag: lambda n: Drag(0.1, 2.0, UniformAtmosphere(0.1)),
    LinearDrag: lambda n: LinearDrag(0.1, wind=vector(n, 0.2)),
    PointGravity: lambda n: PointGravity(1.0, vector(n, 0.1)),
    RadiationPressure: lambda n: RadiationPressure(1.0, 0.3, vector(n, 1.496e11)),
    RotatingFrame: lambda n: RotatingFrame(0.2),
    Spring: lambda n: Spring(0.5, vector(n, 0.3)),
    ThirdBody: lambda n: ThirdBody(1.0, circling(n)),
    UniformGravity: lambda n: UniformGravity(vector(n, -0.2)),
}
# These turn or look about an axis, so that one axis alone has no meaning.
NOT_ON_A_LINE = {ClohessyWiltshire, RotatingFrame, J2}


def transfer(effects, dimension):
    start, goal = State(vector(dimension, 1.0), vector(dimension, 0.0, 0.8)), vector(dimension, 1.6, 0.4, 0.2)
    return TransferProblem(1.0, start, State(goal, None), 1.5, effects=effects, actuator=FreeForce())


def test_no_effect_is_left_out():
    public = [getattr(dmoc, name) for name in dmoc.__all__ if not name.startswith("_")]
    # An effect that sees an attitude acts on bodies in space alone.
    points = (Conservative, Force)
    effects = {one for one in public if isinstance(one, type) and issubclass(one, points)}
    assert {one for one in effects if hasattr(one, "__dataclass_fields__")} == EVERY.keys()


@pytest.mark.parametrize("dimension", [1, 2, 3])
@pytest.mark.parametrize("effect", EVERY, ids=lambda effect: effect.__name__)
def test_it_serves_a_transfer(effect, dimension):
    if dimension == 1 and effect in NOT_ON_A_LINE:
        with pytest.raises(ValueError, match=r"dimension"):
            transfer([EVERY[effect](1)], 1)
        return
    solution = solve(transfer([EVERY[effect](dimension)], dimension), order=4, steps=20).raise_for_status()
    assert verify(solution).ok


@pytest.mark.parametrize("dimension", [2, 3])
def test_three_bodies_in_the_plane_and_in_space(dimension):
    """In the plane of the primaries both are the same motion."""
    start = State(vector(dimension, 0.8), vector(dimension, 0.0, 0.2))
    goal = State(vector(dimension, 0.85, 0.1), vector(dimension))
    problem = TransferProblem(1.0, start, goal, 1.0, effects=three_body(0.01215))
    flat = TransferProblem(
        1.0, State((0.8, 0), (0, 0.2)), State((0.85, 0.1), (0, 0)), 1.0, effects=three_body(0.01215)
    )
    found, plane = (solve(one, order=6, steps=20).raise_for_status() for one in (problem, flat))
    assert verify(found).ok and found.objective == pytest.approx(plane.objective, rel=1e-9)


def test_a_centre_off_the_plane_is_refused_in_the_plane():
    with pytest.raises(ValueError, match="center has 3 entries but the problem has 2 dimensions"):
        transfer([PointGravity(1.0, (0.0, 0.0, 0.1))], 2)
