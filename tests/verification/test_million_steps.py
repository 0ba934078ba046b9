"""A million steps of a Kepler orbit: what is conserved stays conserved, down to what rounding does by chance.

Pass criterion: the energy error of the last tenth of the steps is that of the first tenth, to 10 %;
angular momentum and, on a circle, energy show no trend beyond ten times the random walk of
rounding, eps sqrt(steps); explicit steps with compensated sums keep angular momentum to 2e-15. The
two-step form of equation (16), marched as it stands, loses fifty times as much.
"""

import numpy as np
import pytest

from dmoc import PointGravity, State, TransferProblem, simulate
from dmoc.studies.rounding import round_off

EPS = np.finfo(float).eps
# steps a revolution, enough for an energy error of 1e-4 or less at e = 0.3
PER_REVOLUTION = {2: 1000, 4: 100, 6: 40, 8: 32}
LENGTHS = [100_000, pytest.param(1_000_000, marks=pytest.mark.slow)]


def coast(steps, order, eccentricity=0.0, compensated=False):
    e = eccentricity
    here = State((1 - e, 0), (0, np.sqrt((1 + e) / (1 - e))))
    duration = 2 * np.pi * steps / PER_REVOLUTION[order]
    problem = TransferProblem(1.0, here, here, duration, effects=[PointGravity(1.0)])
    return simulate(problem, steps=steps, order=order, compensated=compensated)


def spin(found):
    (x, y), (px, py) = found.position.T, found.momentum.T
    return x * py - y * px


def trend(values):
    """What a straight line through the relative changes gains from end to end."""
    return abs(np.polyfit(np.linspace(0, 1, len(values)), values / values[0] - 1, 1)[0])


ROUNDED = pytest.mark.xfail(
    strict=True,
    reason="the constants of the kinetic part are each rounded by themselves, so that the momenta of a step "
    "add up to 1e-17 of themselves instead of 0: angular momentum drifts by 1.4e-17 a step",
)


@pytest.mark.parametrize("steps", LENGTHS)
@pytest.mark.parametrize("order", [2, 4, 6, pytest.param(8, marks=ROUNDED)])
def test_no_trend_beyond_the_random_walk_of_rounding(steps, order):
    found = coast(steps, order)
    by_chance = 10 * EPS * np.sqrt(steps)
    assert trend(spin(found)) < by_chance
    assert trend(found.energy) < by_chance


@pytest.mark.parametrize("order", [2, 4, 6, 8])
@pytest.mark.parametrize("steps", LENGTHS)
def test_the_energy_error_is_bounded(steps, order):
    found = coast(steps, order, eccentricity=0.3)
    error, tenth = np.abs(found.energy / found.energy[0] - 1), steps // 10
    assert error.max() < 1e-4
    # at order 8 what the xfail above tells of is a tenth of the error after a million steps
    rounded = 3e-17 * steps if order == 8 else 0.0
    assert abs(error[-tenth:].max() - error[:tenth].max()) < 0.1 * error.max() + rounded
    assert np.ptp(spin(found)) < (1e-12 + rounded) * spin(found)[0]


@pytest.mark.parametrize("steps", LENGTHS)
def test_compensated_sums_keep_angular_momentum_to_the_last_bits(steps):
    plain, kept = coast(steps, 2), coast(steps, 2, compensated=True)
    assert np.ptp(spin(kept)) < 2e-15
    assert np.ptp(spin(plain)) > 10 * np.ptp(spin(kept))
    assert trend(kept.energy) < 1e-14


@pytest.mark.parametrize("steps", LENGTHS)
def test_the_two_step_form_loses_digits(steps):
    """Fifty times as much of place and angular momentum: 3e-8 against 3e-10 after a million steps."""
    naive, plain, kept = round_off(steps)
    assert kept.miss == 0 and plain.miss < 1e-9
    assert naive.miss > 20 * plain.miss
    assert naive.momentum_error[-1] > 20 * plain.momentum_error[-1] > 100 * kept.momentum_error[-1]
