"""A hundred thousand steps of a free body and of a heavy top: what is conserved stays so, and RK4 loses it.

Seen with steps of 0.1, 0.2, 0.3, 0.5 s at orders 2, 4, 6, 8 (1,400 to 6,800 turns of the free body, 4,800 to
24,000 of the top). The length of the quaternion, | |q|^2 - 1 |, is off by 7e-16 at most:
each step meets it anew. The angular momentum in space, of the top its vertical part, is off by 1e-13, 9e-13,
2e-13, 2e-13 of its size (free body) and by 1e-12, 4e-13, 2e-13, 6e-13 (top): rounding. The energy swings by
2e-13, 1.0e-7, 1.1e-9, 2.3e-11 and by 2.1e-4, 3.3e-7, 2.5e-8, 4.1e-10, in the last tenth of the steps as in the
first; at order 2 that of the free body is exact, and 2e-13 is what rounding makes of it.

RK4 with the shortest of these steps, 0.1 s, is off by 1.5e-5, 5.7e-5 and 3.9e-5 in length, momentum and energy
of the free body and by 0.017, 0.045 and 0.043 of the top's, ten times as much in the end as in the first tenth.
"""

import numpy as np
import pytest

from dmoc.studies.spinning import LENGTHS, free_body, heavy_top, spin

STEPS = 100_000
BODIES = {"free body": free_body, "heavy top": heavy_top}
# Energy errors of this size are rounding: eps times the root of the number of steps, with a factor of 10.
ROUNDED = 7e-13
# What RK4 loses at least with steps of 0.1 s: length of the quaternion, angular momentum, energy.
LOST = {"free body": (1.4e-5, 5e-5, 3.5e-5), "heavy top": (0.015, 0.04, 0.04)}


@pytest.mark.slow
@pytest.mark.parametrize("order", ["order 2", "order 4", "order 6", "order 8"])
@pytest.mark.parametrize("body", BODIES)
def test_nothing_is_lost_in_a_hundred_thousand_steps(body, order):
    (found,) = spin(BODIES[body](), STEPS, {order: LENGTHS[order]})
    assert found.norm_error < 1e-14
    # Rounding of half a unit in the last place a step, were it all one way, would add up to this.
    assert found.momentum_error < 0.5 * STEPS * np.finfo(float).eps
    assert found.growth < 1.1 or found.energy_error < ROUNDED


@pytest.mark.slow
@pytest.mark.parametrize("body", BODIES)
def test_rk4_loses_each_of_them(body):
    (found,) = spin(BODIES[body](), STEPS, {"RK4": (0.1,)})
    norm, momentum, energy = LOST[body]
    assert found.norm_error > norm and found.momentum_error > momentum and found.energy_error > energy
    assert found.growth > 9


@pytest.mark.slow
@pytest.mark.parametrize("length", [0.2, 0.3, 0.5])
@pytest.mark.parametrize("body", BODIES)
def test_rk4_loses_more_with_the_steps_of_the_higher_orders(body, length):
    """The steps of orders 4, 6 and 8 are longer than 0.1 s."""
    (found,) = spin(BODIES[body](), STEPS, {"RK4": (length,)})
    norm, momentum, energy = LOST[body]
    assert found.norm_error > 10 * norm and found.momentum_error > 10 * momentum
    assert found.energy_error > 10 * energy
