"""`dmoc stability` measures what it says: bounded and growing errors, rounding, the edges of stability."""

import json

import numpy as np
import pytest

from dmoc.cli.app import main
from dmoc.studies.drift import drift, kepler, per_revolution
from dmoc.studies.rounding import H_OMEGA, growth, round_off


def run(capfd, *arguments):
    with pytest.raises(SystemExit) as end:
        main(["stability", *map(str, arguments)])
    out, err = capfd.readouterr()
    return end.value.code or 0, out, err


def test_a_history_is_flat_for_a_scheme_and_rises_for_runge_kutta():
    ours, theirs = drift(kepler(0.3), 100, {"order 4": (60,), "RK4": (100,)})
    for row in (ours, theirs):
        revolutions, energy, turning = row.history
        assert revolutions[0] == pytest.approx(1, abs=0.02) and revolutions[-1] == pytest.approx(100)
        assert (energy[-1], turning[-1]) == (row.energy_error, row.momentum_error)
        assert (np.diff(energy) >= 0).all()
    assert ours.history[1, -1] < 1.05 * ours.history[1, 0]
    assert theirs.history[1, -1] > 50 * theirs.history[1, 0]


def test_steps_follow_the_passage():
    """As fine at the periapsis, an orbit of e = 0.7 loses no more energy than one of 0.3, to a factor 5."""
    near, far = (drift(kepler(e), 10, {"order 4": per_revolution(e)["order 4"][:1]})[0] for e in (0.3, 0.7))
    assert near.energy_error < far.energy_error * 5 and far.energy_error < 15 * near.energy_error
    coarse = drift(kepler(0.7), 10, {"order 4": per_revolution(0.3)["order 4"][:1]})[0]
    assert coarse.energy_error > 100 * far.energy_error


def test_edges_of_stability_are_where_theory_has_them():
    """Order 2: h omega = 2. Order 4: growth (the (2, 2) element of its matrix) from 2 sqrt 2 to 2 sqrt 3."""
    rows = {row.method: row for row in growth()}
    grid = H_OMEGA[1] - H_OMEGA[0]
    assert rows["order 2"].gaps[0][:2] == pytest.approx((2.0, H_OMEGA[-1]), abs=1.1 * grid)
    assert rows["order 4"].gaps[0][:2] == pytest.approx((2 * np.sqrt(2), 2 * np.sqrt(3)), abs=1.1 * grid)
    assert len(rows["order 8"].gaps) == 2 and rows["order 8"].gaps[0][0] == pytest.approx(3.1404, abs=2 * grid)
    # |1 + z + z^2/2 + z^3/6 + z^4/24| at z = i: a hundredth of the energy is lost a step
    at_one = rows["RK4"].growth[np.searchsorted(H_OMEGA, 1.0)]
    assert at_one == pytest.approx(np.hypot(13 / 24, 5 / 6), rel=1e-3)
    for name in ("order 2", "order 4", "order 6", "order 8"):
        below = rows[name].reach < rows[name].gaps[0][0]
        assert np.abs(rows[name].growth[below] - 1).max() < 1e-6


def test_the_verb_draws_prints_and_speaks_json(capfd, tmp_path):
    options = ("--revolutions", 3, "--eccentricity", "0.2", "--steps", 5000, "--turned", 200)
    code, out, err = run(capfd, *options, "--plot", tmp_path / "s.svg")
    assert (code, err) == (0, "") and "<svg" in (tmp_path / "s.svg").read_text()
    for word in (
        "e = 0.2, 3 revolutions",
        "order 8",
        "DOP853, adaptive",
        "two-step form",
        "stable up to",
        "2.829",
        "double pendulum of rods",
    ):
        assert word in out
    code, out, err = run(capfd, *options, "--json")
    found = json.loads(out)
    assert (code, err, list(found)) == (0, "", ["drift", "turning", "swinging", "round_off", "unstable"])
    assert {row["method"] for row in found["drift"]} >= {"order 2", "RK4", "DOP853"}
    assert [row["steps"] for row in found["round_off"]] == [5000] * 3


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--eccentricity", "1.2"), "less than 1"),
        (("--eccentricity", "nan"), "eccentricity must be a finite number"),
        (("--eccentricity", "a,b"), "--eccentricity must be numbers"),
        (("--revolutions", "-1"), "revolutions must be greater than 0"),
        (("--revolutions", "inf"), "revolutions must be a finite number"),
        (("--steps", "10"), "at least 1000"),
        (("--plot", "s.gif"), "must end in"),
    ],
)
def test_bad_options_are_one_line(capfd, options, words):
    code, out, err = run(capfd, *options)
    assert (code, out, err.count("\n")) == (2, "", 1) and words in err


def test_too_few_steps_for_rounding_are_refused():
    with pytest.raises(ValueError, match="at least 1000"):
        round_off(999)
