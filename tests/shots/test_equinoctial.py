"""Modified equinoctial elements against the motion in space that they stand for."""

import casadi as ca
import numpy as np
import pytest

from dmoc import CircularOrbit, PointGravity, State, TransferProblem
from dmoc.shots.equinoctial import Elements

MU, CENTER = 3.0, (0.4, -0.2, 0.1)


def elements(axes):
    """Around an attractor that is not at the origin, and in the frame of a tilted start."""
    start = (1.4, 0.3, 0.5)[:axes], (-0.2, 1.5, 0.4)[:axes]
    goal = CircularOrbit(2.0, mu=MU, center=CENTER[:axes])
    problem = TransferProblem(1.0, State(*start), goal, 10.0, [PointGravity(MU, center=CENTER[:axes])])
    return Elements.of(problem, tuple(map(np.array, start)))


@pytest.mark.parametrize("axes", [2, 3])
def test_they_are_found_again_and_change_as_place_and_velocity_do(axes):
    unit = elements(axes)
    slow, angle = ca.SX.sym("slow", unit.slow), ca.SX.sym("angle")
    place, velocity, directions = unit.state(slow, angle)
    both = ca.vertcat(slow, angle)
    slopes = [ca.jacobian(part, both) for part in (place, velocity)]
    effect, turning = unit.effect(slow, angle), unit.speed_around(slow, angle)
    seen = ca.Function("seen", [slow, angle], [place, velocity, directions, *slopes, effect, turning])
    at = np.array([1.3, 0.21, -0.34, 0.12, -0.27])[: unit.slow], 0.9
    q, v, frame, by_place, by_velocity, push, rate = (part.full() for part in seen(*at))
    # A state has its elements.
    np.testing.assert_allclose(unit.found((q.ravel(), v.ravel())), [*at[0], at[1]], rtol=1e-12)
    # An acceleration changes the velocity alone, and by itself.
    np.testing.assert_allclose(by_place @ push[:, :axes], 0.0, atol=1e-14)
    expected = unit.speed * frame[:, :axes]
    np.testing.assert_allclose(by_velocity @ push[:, :axes], expected, rtol=1e-12, atol=1e-14)
    # Without one the body falls around the attractor.
    falling = np.append(np.zeros(unit.slow), rate) / unit.time
    offset = q.ravel() - np.array(CENTER[:axes])
    np.testing.assert_allclose(by_place @ falling, v.ravel(), rtol=1e-12)
    np.testing.assert_allclose(by_velocity @ falling, -MU * offset / np.linalg.norm(offset) ** 3, rtol=1e-12)
