"""What a path says of its own size, and what it keeps when it is carried to another mesh or order."""

from dataclasses import replace

import numpy as np
import pytest

from dmoc import rotation
from dmoc.configurations.coordinates import Coordinates
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import uniform_mesh
from dmoc.motion.path import INNER_MASSES, DiscretePath, Key
from dmoc.motion.scales import path_scales


def spinning(rate, duration, steps=8):
    """A body that turns about z at this rate [rad/s]."""
    angles = np.degrees(rate * duration * np.linspace(0, 1, steps + 1))
    q = np.array([rotation((0, 0, 1), angle) for angle in angles])
    spin, mass = np.array([0.0, 0.0, rate]), np.ones(steps + 1)
    none = np.zeros((steps + 1, 3))
    return DiscretePath(
        uniform_mesh(steps), 2, False, duration, q, none, mass, spin, spin, made_of=Coordinates.of_rigid_body(0)
    )


@pytest.mark.parametrize(("rate", "duration"), [(0.2, 4.0), (2.0, 0.5)])
def test_the_scales_of_a_body_that_turns_are_its_turn_and_its_rate(rate, duration):
    scales = path_scales(spinning(rate, duration))
    assert scales.turn == pytest.approx(rate * duration) and scales.rate == pytest.approx(rate)


def test_the_rate_of_a_turn_from_rest_to_rest_is_its_mean():
    path = spinning(0.5, 3.0)
    still = DiscretePath(
        path.mesh,
        2,
        False,
        3.0,
        path.position,
        path.control,
        path.mass,
        np.zeros(3),
        np.zeros(3),
        made_of=Coordinates.of_rigid_body(0),
    )
    assert path_scales(still).rate == pytest.approx(0.5)


@pytest.mark.parametrize(("old", "new"), [(6, 8), (8, 6), (4, 8)])
def test_multipliers_within_steps_keep_their_density_at_another_order(old, new):
    """A density of 3 is 3 times the weight of each inner node of a step, whatever the order."""
    steps, density = 5, 3.0
    count = steps * (old // 2) + 1
    key = Key("step", "row", INNER_MASSES)
    inner = np.tile(density * scheme(old).weights[1:-1], (steps, 1))
    zeros = np.zeros((count, 1))
    path = DiscretePath(
        uniform_mesh(steps),
        old,
        False,
        2.0,
        zeros,
        zeros,
        np.ones(count),
        np.zeros(1),
        np.zeros(1),
        {key: inner},
    )
    carried = path.onto(uniform_mesh(7), new, False).multipliers[key]
    assert carried == pytest.approx(np.tile(density * scheme(new).weights[1:-1], (7, 1)))


def straight(steps, order=2):
    """A body that coasts along a straight line at (3, 4) m/s for 2 s."""
    fractions = np.linspace(0, 1, steps * (order // 2) + 1)
    position, speed = fractions[:, None] * [6.0, 8.0] + [1.0, -1.0], np.array([3.0, 4.0])
    zeros, mass = np.zeros_like(position), np.ones(len(position))
    return DiscretePath(uniform_mesh(steps), order, False, 2.0, position, zeros, mass, speed, speed)


@pytest.mark.parametrize("steps", [3, 7, 40])
def test_a_straight_line_stays_one_on_any_mesh_with_its_ends_to_the_last_bit(steps):
    path = straight(9)
    moved = path.onto(uniform_mesh(steps), 2, False)
    assert moved.position == pytest.approx(np.linspace(0, 1, steps + 1)[:, None] * [6.0, 8.0] + [1.0, -1.0])
    assert (moved.position[[0, -1]] == path.position[[0, -1]]).all()


def test_a_path_of_no_extent_is_measured_by_what_its_speed_would_cover():
    path = straight(4)
    scales = path_scales(replace(path, position=0 * path.position))
    assert scales.extent == pytest.approx(5.0 * 2.0) and scales.speed == pytest.approx(5.0)


@pytest.mark.parametrize("order", [True, 2.0, 3, "4", None])
def test_an_order_is_one_of_four_whole_numbers(order):
    with pytest.raises(ValueError, match="one of 2, 4, 6, 8"):
        scheme(order)
