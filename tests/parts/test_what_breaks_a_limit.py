"""By how much a control or a place breaks a limit, and which limit would be enough: one that is."""

import re

import numpy as np
import pytest

from dmoc import BallForce, BoxForce, Engine, KeepIn, KeepOut, Nozzles, SpeedLimit


def test_a_thrust_that_the_throttle_does_not_pay_for_breaks_the_engine():
    """The throttle is what burns: at zero the whole thrust is flown for nothing, at the nodes and between."""
    engine = Engine(2.0, exhaust_velocity=50.0)
    control = np.array([[0.6, -0.8, 0.0], [0.6, -0.8, 1.0], [0.6, -0.8, 1.5], [0.0, 0.0, 0.5]])
    rounding = 2 * engine.smoothing * engine.max_thrust
    np.testing.assert_allclose(engine.excess(control), [1.0, 0.0, 0.5, 0.5], atol=rounding)
    # between nodes more may be paid than is flown, never less
    np.testing.assert_allclose(engine.beyond(control), [1.0, 0.0, 0.0, 0.0], atol=rounding)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_place_beyond_either_corner_of_a_box_is_outside(axis, side):
    box, place = KeepIn((-1.0, -2.0, -np.inf), (3.0, np.inf, 4.0)), np.array([1.0, 0.0, 1.0])
    corner = np.array(box.upper if side > 0 else box.lower)[axis]
    place[axis] = corner + 0.25 * side if np.isfinite(corner) else 1e6 * side
    wanted = 0.25 if np.isfinite(corner) else 0.0
    assert box.excess(place[None], np.zeros((1, 3))) == pytest.approx([wanted])


ROUND = 1.23401  # no number of four digits


@pytest.mark.parametrize(
    ("given", "eased"),
    [
        (BoxForce(1.0), BoxForce(ROUND)),
        (BoxForce((1.0, 1.0)), BoxForce((ROUND, ROUND))),
        (BallForce(1.0), BallForce(ROUND)),
        (Engine(1.0), Engine(ROUND)),
        (Nozzles(((1, 0), (-1, 0)), 1.0), Nozzles(((1, 0), (-1, 0)), ROUND)),
    ],
)
def test_a_force_limit_that_is_called_enough_is_rounded_up(given, eased):
    said = [float(number) for number in re.findall(r"1\.23\d*", given.needs(eased))]
    assert said and min(said) >= ROUND and max(said) < ROUND + 0.0011


def test_a_speed_limit_is_rounded_up_and_a_radius_down():
    assert "1.235 " in SpeedLimit(1.0).needs(SpeedLimit(ROUND), 1, "")
    assert "of at most 1.233 m" in KeepOut((0, 0), 2.0).needs(KeepOut((0, 0), 1.23399), 1, "")
