"""Planets at real dates: against the ephemeris itself, and what is refused and told."""

import subprocess
import sys
from datetime import date, datetime
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    Coast,
    DeltaV,
    Flyby,
    Impulse,
    Leg,
    Mission,
    Moving,
    PointGravity,
    State,
    Team,
    ThirdBody,
    TransferProblem,
    load,
    planet,
    solve,
)
from dmoc.planets import mean_elements
from dmoc.planets.dates import iso, julian, later, minutes_of
from dmoc.reports import words
from dmoc.reports.as_json import solve_object
from dmoc.scene.clock import clock_of
from dmoc.scene.problem_file import load_problem

DAY, AU = 86400.0, 149597870700.0
MEAN = "mean elements"
# J2000 ecliptic from the J2000 equator, as NAIF's frame kernels have it.
ECLIPTIC = np.array([[1, 0, 0], [0, 0.917482062069181818, 0.397777155931913701]])
ECLIPTIC = np.array([*ECLIPTIC, [0, -0.397777155931913701, 0.917482062069181818]])


@pytest.fixture(scope="module")
def de421():
    """Position of a body in DE421 [m], by its chain of segments, at a Julian date and days after it."""
    spk = pytest.importorskip("jplephem.spk")
    data = pytest.importorskip("skyfield_data")
    kernel = spk.SPK.open(str(Path(data.__file__).parent / "data" / "de421.bsp"))

    def of(day, parts, *chain):
        return 1e3 * sum(sign * kernel[a, b].compute(day, parts) for a, b, sign in chain).T

    yield of
    kernel.close()


SUN = (0, 10, -1)
CHAINS = {
    "venus": [(0, 2, 1), (2, 299, 1), SUN],
    "earth": [(0, 3, 1), (3, 399, 1), SUN],
    "earth-moon barycenter": [(0, 3, 1), SUN],
    "mars": [(0, 4, 1), (4, 499, 1), SUN],
    "jupiter": [(0, 5, 1), SUN],
}


def at(motion, times):
    t = ca.MX.sym("t")
    return np.array(ca.Function("at", [t], [motion(t)]).map(len(times))(times)).T


@pytest.mark.parametrize("name", CHAINS)
def test_tables_are_within_a_kilometre_of_the_ephemeris(name, de421):
    """Anywhere between the times of the table, at both of its ends too."""
    motion = planet(name, "2028-11-20T06:00:00", frame="icrf", start=-20 * DAY, duration=700 * DAY)
    times = np.linspace(-20, 680, 9001) * DAY
    exact = de421(2462095.5, 0.25 + times / DAY, *CHAINS[name])
    errors = np.linalg.norm(at(motion, times) - exact, axis=1)
    assert errors.max() < 1e3
    assert len(motion.table.times) < 3000


def test_the_ecliptic_is_that_of_naif(de421):
    times = np.linspace(0, 100, 7) * DAY
    exact = de421(2462095.5, times / DAY, *CHAINS["mars"]) @ ECLIPTIC.T
    assert np.abs(at(planet("mars", "2028-11-20"), times) - exact).max() < 1e3


def test_other_centers_and_numbers_of_naif(de421):
    times = np.linspace(0, 30, 9) * DAY
    moon = planet("moon", "2028-11-20", "icrf", "earth", duration=30 * DAY)
    exact = de421(2462095.5, times / DAY, (3, 301, 1), (3, 399, -1))
    assert np.abs(at(moon, times) - exact).max() < 1e3
    assert moon == planet(301, "2028-11-20", "icrf", 399, duration=30 * DAY)
    back = planet("earth", "2028-11-20", "icrf", "moon", duration=30 * DAY)
    assert np.abs(at(back, times) + exact).max() < 1e3
    assert "barycentre" in planet("jupiter", "2028-11-20").title and "DE421" in moon.title


@pytest.mark.parametrize("name", mean_elements.ERRORS)
def test_mean_elements_are_as_far_off_as_they_say(name, de421):
    """Over 150 years; not by much less, or the number that a user is told would be of no use."""
    numbers = {"mercury": 1, "venus": 2, "mars": 4, "jupiter": 5, "saturn": 6, "uranus": 7, "neptune": 8}
    chain = CHAINS.get(name) or [(0, numbers[name], 1), SUN]
    parts = np.arange(0, 54750, 10.0)
    exact = de421(2415020.5, parts, *chain) @ ECLIPTIC.T
    rough = mean_elements.track(name, "sun", 2415020.5, parts).positions
    error = np.linalg.norm(rough - exact, axis=1).max() / 1e3
    assert 0.8 * mean_elements.ERRORS[name] < error < mean_elements.ERRORS[name]


def test_mean_elements_without_the_packages(monkeypatch):
    """They stand in, and the scene, the answer and JSON say so once."""
    monkeypatch.setattr("dmoc.planets.ephemeris.find_spec", lambda name: None)
    monkeypatch.delenv("DMOC_EPHEMERIS", raising=False)
    found = solve(load_problem("earth_mars_2028").make(departure=84.0, flight=300.0), steps=8)
    assert found.success and len(found.warnings) == 1
    assert "mars (mean elements, within 110,000 km)" in found.warnings[0]
    assert "pip install jplephem skyfield-data" in found.warnings[0]
    page = words.console()
    with page.capture() as captured:
        page.print(words.scene(found.problem))
    told = captured.get()
    assert told.count("are approximate") == 1 and "TDB at t = 0, frame ECLIPJ2000, origin sun" in told
    with pytest.raises(ValueError, match="needs the package jplephem"):
        planet("mars", "2028-11-20", ephemeris="other.bsp")


def test_a_transfer_says_that_its_planets_are_approximate():
    found = solve(transfer(here("earth"), here("mars")), order=4, steps=20)
    assert found.success and len(found.warnings) == 1
    assert "earth (mean elements, within 23,000 km) and mars" in found.warnings[0]


def test_the_ephemeris_may_be_named_by_the_environment(monkeypatch, tmp_path):
    pytest.importorskip("jplephem")
    monkeypatch.setenv("DMOC_EPHEMERIS", str(tmp_path / "mine.bsp"))
    with pytest.raises(ValueError, match=r"there is no ephemeris file .*mine.bsp"):
        planet("mars", "2028-11-20")
    (tmp_path / "mine.bsp").write_text("none")
    with pytest.raises(ValueError, match="no SPK file"):
        planet("mars", "2028-11-20")


@pytest.mark.parametrize(
    "given, told",
    [
        ({"name": "vulcan"}, "name must be one of .*mars.*got 'vulcan'"),
        ({"name": None}, "name must be one of"),
        ({"name": True}, "name must be one of"),
        ({"name": 2000433}, "no mean elements of 2000433"),
        ({"name": 10**50}, "name must be one of"),
        ({"center": "mars"}, "the center is mars itself"),
        ({"frame": "b1950"}, "frame must be 'ecliptic' or 'icrf'; got 'b1950'"),
        ({"epoch": "tomorrow"}, "epoch must be a date as ISO text"),
        ({"epoch": 2028}, "epoch must be a date as ISO text"),
        ({"epoch": "2028-11-20T00:00:00+01:00"}, "no time zone"),
        ({"epoch": "1700-01-01"}, "1800-01-01 to 2051-01-01, not from 1700-01-01 to 1702-09-28"),
        ({"epoch": "2050-01-01"}, "not from 2050-01-01 to 2052-09-27"),
        ({"duration": 0}, r"duration must be greater than 0 \[s\]"),
        ({"duration": 1e15}, "no date of the years 1 to 9999"),
        ({"start": 1e13, "duration": 1e-6}, "no date of the years 1 to 9999"),
        ({"start": 1e9, "duration": 1e-9}, "too short to tell times apart"),
        ({"start": "x"}, "start must be a finite number"),
        ({"name": "moon"}, "no mean elements of moon"),
        ({"center": "solar system barycenter"}, "no mean elements of solar system barycenter"),
        ({"ephemeris": 3}, "path of a .bsp file"),
    ],
)
def test_bad_input_is_told_in_one_line(given, told):
    with pytest.raises(ValueError, match=told) as raised:
        planet(**{"name": "mars", "epoch": "2028-11-20", "ephemeris": MEAN} | given)
    assert "\n" not in str(raised.value)


def test_what_the_ephemeris_does_not_have_is_told_with_its_dates(de421):
    for epoch, duration in (("2052-01-01", 1000 * DAY), ("1899-01-01", DAY)):
        with pytest.raises(ValueError, match=r"de421.bsp covers mars from 1899-07-29 to 2053-10-09, not from"):
            planet("mars", epoch, duration=duration)
    with pytest.raises(ValueError, match=r"has no 2000433; it has .*mercury"):
        planet(2000433, "2028-11-20")
    with pytest.raises(ValueError, match="moves too fast for a table of 50000 days"):
        planet("moon", "1900-01-01", center="earth", duration=50000 * DAY)


def test_dates():
    assert iso("2028-11-20") == iso(date(2028, 11, 20)) == iso(datetime(2028, 11, 20)) == "2028-11-20T00:00:00"
    assert julian("2000-01-01T12:00:00") == (2451544.5, 0.5) and julian("1858-11-17") == (2400000.5, 0.0)
    assert later("2028-02-28", 86400 * 2 + 0.25) == "2028-03-01T00:00:00.250000"
    assert minutes_of("2028-02-28", 59.0) == "2028-02-28 00:01"


def here(name, **more):
    return planet(name, **{"epoch": "2028-11-20", "ephemeris": MEAN, "duration": 400 * DAY} | more)


def transfer(start, goal, effects=(), **more):
    effects = [PointGravity(1.327e20), *effects]
    return TransferProblem(1000.0, Moving(start), Moving(goal), 300 * DAY, effects=effects, **more)


def test_the_clock_of_a_scene_is_found_in_every_part():
    mars, venus = here("mars"), here("venus")
    still = State((AU, 0, 0), (0, 3e4, 0))
    scenes = [
        transfer(mars, venus),
        TransferProblem(1.0, still, still, DAY, effects=[ThirdBody(3.2e14, venus)]),
        Mission(1.0, still, still, [Leg(DAY), Flyby(venus, 6.3e6, 3.2e14), Leg(DAY)]),
        Mission(1.0, still, still, [Leg(DAY, effects=[ThirdBody(3.2e14, mars)]), Leg(DAY)]),
        Team([transfer(mars, venus), transfer(venus, mars)], []),
    ]
    for scene in scenes:
        clock = clock_of(scene)
        assert clock is not None
        assert clock[:3] == ("2028-11-20T00:00:00", "ECLIPJ2000", "sun")
    assert clock_of(TransferProblem(1.0, still, still, DAY)) is None


@pytest.mark.parametrize(
    "make, told",
    [
        (
            lambda: transfer(here("mars"), here("venus", epoch="2028-11-21")),
            "mars has the epoch 2028-11-20T00:00:00 and venus 2028-11-21T00:00:00; .* one epoch",
        ),
        (lambda: transfer(here("mars"), here("venus", frame="icrf")), "one frame"),
        (lambda: transfer(here("mars"), here("venus", center="earth")), "one center"),
        (
            lambda: transfer(here("mars"), here("venus"), start_time=101 * DAY),
            r"table of mars is from 0 to 3.456e\+07 s, .* a duration of 3.46464e\+07 s",
        ),
        (lambda: transfer(here("mars"), here("venus", start=DAY)), "table of venus is from 86400 to"),
        (
            lambda: Mission(
                1.0,
                Moving(here("mars")),
                Moving(here("venus")),
                [Impulse(), Coast((DAY, 300 * DAY)), Impulse()],
                objective=DeltaV(),
                start_time=(0, 101 * DAY),
            ),
            "table of mars",
        ),
    ],
)
def test_dates_that_do_not_fit_are_refused(make, told):
    with pytest.raises(ValueError, match=told):
        make()


def test_a_leg_in_two_parts_needs_no_longer_table():
    """An impulse may be added to a flight whose table ends with its latest arrival."""
    from dmoc.scene.impulses import with_impulse

    whole = load_problem("earth_mars_2028").make(ephemeris=MEAN)
    assert with_impulse(whole, 0).duration_bounds == whole.duration_bounds == (120 * DAY, 400 * DAY)


def test_dates_go_to_files_and_reports(tmp_path):
    found = solve(load_problem("earth_mars_2028").make(departure=84.0, flight=300.0, ephemeris=MEAN), steps=8)
    found.save(tmp_path / "flight.nc")
    about = load(tmp_path / "flight.nc").provenance
    assert (about.epoch, about.frame, about.center) == ("2028-09-01T00:00:00", "ECLIPJ2000", "sun")
    told = words.figures(found)
    assert told.endswith("from 2028-11-24 00:00 to 2029-09-20 00:00 TDB")
    as_json = solve_object(found, None)
    assert as_json["start_date"] == "2028-11-24T00:00:00" and as_json["goal_date"] == "2029-09-20T00:00:00"
    assert as_json["frame"] == "ECLIPJ2000" and as_json["time_scale"] == "TDB"
    plain = solve(load_problem("hohmann").make())
    assert plain.provenance.epoch == "" and "epoch" not in solve_object(plain, None)


def test_a_scene_without_planets_loads_nothing_of_them():
    script = (
        "import sys\nfrom dmoc import solve\nfrom dmoc.scene.problem_file import load_problem\n"
        "from dmoc.reports import words\nfound = solve(load_problem('hohmann').make())\n"
        "words.figures(found); words.scene(found.problem)\n"
        "print(*sorted(name for name in sys.modules if 'planets' in name or 'jplephem' in name))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
