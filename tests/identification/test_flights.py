"""Measured flights as tables, and flights made for tests."""

import numpy as np
import pytest

from dmoc import Attitude, Flight, LinearDrag, State, Torque, fly
from dmoc.basics.quaternions import angle_between

START = State((0, 0), (1, 0))


def test_a_flight_comes_back_from_its_table_to_the_last_bit(tmp_path):
    times = np.linspace(0, 5, 21)
    seen = fly(
        times,
        np.ones((21, 2)) / 3,
        START,
        attitudes=times,
        noise=0.1,
        velocity_noise=0.1,
        dropped=0.4,
        delay=0.3,
    )
    back = Flight.read(seen.save(tmp_path / "one.csv"))
    for name in ("times", "positions", "velocities", "forces", "attitudes"):
        assert np.array_equal(getattr(back, name), getattr(seen, name), equal_nan=True), name
    assert back.name == "one" and seen.dropped == np.isnan(seen.positions[:, 0]).sum() > 4


def test_a_body_that_turns_and_many_controls_in_a_table(tmp_path):
    seen = fly(
        np.arange(4.0), np.ones((4, 3)) * 0.1, Attitude((1, 0, 0, 0)), inertia=(1, 2, 2.5), actuator=Torque()
    )
    assert seen.positions is None and seen.attitudes.shape == (4, 4)
    file = seen.save(tmp_path / "turn.csv")
    assert file.read_text().startswith("t,qs,qx,qy,qz,fx,fy,fz\n")
    again = Flight.read(file)
    assert again.attitudes == pytest.approx(seen.attitudes, abs=1e-15)


def test_a_person_may_write_the_table(tmp_path):
    """Units in brackets, comments, empty lines and cells; a missing force is that before it."""
    file = tmp_path / "mine.csv"
    file.write_text("# measured by hand\ntime [s], x [m], u1, u2\n0,0,1,2\n\n1,,,\n2,0.5,,3\n3,1,0,0\n")
    seen = Flight.read(file)
    assert seen.positions[:, 0] == pytest.approx([0, np.nan, 0.5, 1], nan_ok=True) and seen.dropped == 1
    assert seen.forces.tolist() == [[1, 2], [1, 2], [1, 3], [0, 0]]


@pytest.mark.parametrize(
    "text, words",
    [
        ("", "has no samples"),
        ("t,x\n0,1\n1,2\n", "at least 3 samples"),
        ("t,x\n0,1\n1,2\n1,3\n", "sample 3, at 1 s, not after the one before"),
        ("t,x\n0,1\n1,a\n2,3\n", "line 3: x must be a number; got 'a'"),
        ("t,x\n0,1\n1\n2,3\n", "line 3: 1 cells under 2 columns"),
        ("t,x,height\n0,1,1\n1,2,1\n2,3,1\n", "no flight has a column 'height'"),
        ("x\n1\n2\n3\n", "no column t"),
        ("t,y\n0,1\n1,2\n2,3\n", "leave out an axis"),
        ("t,x,fx,u1\n0,1,0,0\n1,2,0,0\n2,3,0,0\n", "not both"),
        ("t,x,x\n0,1,0\n1,2,0\n2,3,0\n", "two columns 'x'"),
        ("t,x\n0,1\n1,\n2,\n3,4\n", "at least 3 samples with all axes"),
        ("t,x,qs,qx,qy,qz\n0,1,2,0,0,0\n1,2,1,0,0,0\n2,3,1,0,0,0\n", "unit quaternions"),
        ("t,x\n0,1\n1,inf\n2,3\n", "must be finite"),
    ],
)
def test_a_table_that_is_no_flight_is_refused_in_one_line(text, words, tmp_path):
    file = tmp_path / "bad.csv"
    file.write_text(text)
    with pytest.raises(ValueError, match=words) as told:
        Flight.read(file)
    assert str(file) in str(told.value) and "\n" not in str(told.value)


def test_errors_are_of_the_size_that_was_asked_and_the_same_for_a_seed():
    times = np.linspace(0, 100, 2001)
    clean = fly(times, np.zeros((2001, 2)), START, effects=[LinearDrag(0.1)])
    seen = fly(
        times, np.zeros((2001, 2)), START, effects=[LinearDrag(0.1)], noise=0.02, velocity_noise=0.1, seed=3
    )
    again = fly(times, np.zeros((2001, 2)), START, effects=[LinearDrag(0.1)], noise=0.02, seed=3)
    assert np.std(seen.positions - clean.positions) == pytest.approx(0.02, rel=0.05)
    assert np.array_equal(seen.positions, again.positions)
    # x = m v / c (1 - exp(-c t / m))
    assert clean.positions[:, 0] == pytest.approx(10 * (1 - np.exp(-0.1 * times)), abs=1e-11)


def test_a_delay_shows_the_place_of_before():
    times = np.linspace(0, 10, 51)
    seen = fly(times, np.zeros((51, 2)), START, delay=0.3)
    assert np.isnan(seen.positions[:2]).all()
    assert seen.positions[2:, 0] == pytest.approx(times[2:] - 0.3, abs=1e-12)


def test_forces_fly_turned_and_scaled():
    """A constant force for a second, at rest before: s = a t^2 / 2."""
    seen = fly([0, 0.5, 1.0], np.ones((3, 2)), State((0, 0), (0, 0)), mass=2.0, strength=0.5, turn=np.pi / 2)
    assert seen.positions[-1] == pytest.approx([-0.125, 0.125])
    assert seen.forces[0].tolist() == [1, 1]


def test_attitudes_are_seen_with_errors():
    times = np.linspace(0, 20, 401)
    body = {"inertia": (1, 1, 1), "actuator": Torque(), "start": Attitude((1, 0, 0, 0), (0, 0, 0.1))}
    seen = fly(times, np.zeros((401, 3)), attitude_noise=0.01, rate_noise=0.02, **body)
    angles = np.stack([np.cos(0.05 * times), 0 * times, 0 * times, np.sin(0.05 * times)], axis=1)
    off = angle_between(seen.attitudes, angles)
    assert np.sqrt(np.mean(off**2) / 3) == pytest.approx(0.01, rel=0.1)
    assert np.std(seen.rates - [0, 0, 0.1]) == pytest.approx(0.02, rel=0.25)


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"times": [0, 1]}, "at least 3 increasing"),
        ({"forces": [[0.0]] * 3}, "forces must have shape"),
        ({"start": State((0, None), (0, 0))}, "without free entries"),
        ({"dropped": 1.0}, "less than 1"),
        ({"noise": -1}, "noise must not be negative"),
        ({"offset": (1, 2, 3)}, "offset must have 2 entries"),
        ({"seed": -1}, "seed must be a whole number"),
    ],
)
def test_a_flight_that_cannot_be_is_refused(changes, words):
    given = {"times": [0.0, 1.0, 2.0], "forces": np.zeros((3, 2)), "start": START}
    with pytest.raises(ValueError, match=words):
        fly(**(given | changes))
