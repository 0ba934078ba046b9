"""Solutions in other formats are read back, and what a format cannot hold is refused in one line."""

import csv
import json
import re
import subprocess
import sys
from dataclasses import replace
from datetime import datetime, timedelta

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    Coast,
    DeltaV,
    Engine,
    Impulse,
    Leg,
    Mission,
    Moving,
    PointGravity,
    State,
    TransferProblem,
    convert,
    load,
    simulate,
    solve,
)
from dmoc.cli.app import main
from dmoc.conversions.marched import marched_columns, write_marched
from dmoc.planets.dates import utc_of
from dmoc.scene.problem_file import load_problem

EARTH, RADIUS = 3.986004418e14, 7e6
SPEED = (EARTH / RADIUS) ** 0.5
OBLIQUITY = np.radians(84381.448 / 3600)


def around(t):
    """A circle a twentieth wider than that of the start, inclined by 0.02 rad."""
    wide = 1.05 * RADIUS
    angle = 0.1 + (EARTH / wide**3) ** 0.5 * t
    return wide * ca.vertcat(ca.cos(angle), np.cos(0.02) * ca.sin(angle), np.sin(0.02) * ca.sin(angle))


@pytest.fixture(scope="module")
def transfer():
    """In space about the Earth, without any date."""
    start = State((RADIUS, 0, 0), (0, SPEED, 0))
    goal = State((0, 1.1 * RADIUS, 1e5), (-0.95 * SPEED, 0, 0))
    scene = TransferProblem(100.0, start, goal, 1500.0, effects=[PointGravity(EARTH)], start_time=250.0)
    return solve(scene, order=4, steps=12).raise_for_status()


@pytest.fixture(scope="module")
def mission():
    """Two coasts with an impulse between them."""
    scene = Mission(
        100.0,
        State((RADIUS, 0, 0), (0, SPEED, 0)),
        Moving(around),
        [Coast(600.0), Impulse(), Coast(1200.0), Impulse()],
        effects=[PointGravity(EARTH)],
        objective=DeltaV(),
    )
    return solve(scene, steps=8).raise_for_status()


@pytest.fixture(scope="module")
def to_mars():
    scene = load_problem("earth_mars_2028").make(departure=84.0, flight=300.0, ephemeris="mean elements")
    return solve(scene, steps=8).raise_for_status()


@pytest.fixture(scope="module")
def turning():
    return solve(load_problem("reorientation").make(), order=4, steps=10).raise_for_status()


GIVEN = {"epoch": "2028-11-20T06:00:00", "frame": "EME2000", "center": "EARTH"}


def read_oem(path):
    """The segments of an OEM: their keys, and dates, positions and velocities of their states."""
    lines = [line for line in path.read_text().splitlines() if line and not line.startswith("COMMENT")]
    assert lines[0] == "CCSDS_OEM_VERS = 2.0"
    assert [line.split(" = ")[0] for line in lines[1:3]] == ["CREATION_DATE", "ORIGINATOR"]
    segments, keys, inside = [], {}, False
    for line in lines[3:]:
        if line == "META_START":
            keys, inside = {}, True
        elif line == "META_STOP":
            segments.append((keys, [], []))
            inside = False
        elif inside:
            name, value = line.split(" = ")
            keys[name] = value
        else:
            date, *numbers = line.split()
            segments[-1][1].append(datetime.fromisoformat(date))
            segments[-1][2].append([float(x) for x in numbers])
    return [(keys, dates, np.array(states)) for keys, dates, states in segments]


def seconds(dates, epoch):
    return np.array([(date - datetime.fromisoformat(epoch)).total_seconds() for date in dates])


def test_a_table_has_every_node(transfer, tmp_path):
    convert(transfer, tmp_path / "path.csv")
    with (tmp_path / "path.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    names = [
        *(
            f"{what} {axis} [{unit}]"
            for what, unit in (("position", "m"), ("velocity", "m/s"))
            for axis in "xyz"
        )
    ]
    found = np.array(
        [[float(row[name]) for name in ["time [s]", *names, "force z [N]", "mass [kg]"]] for row in rows]
    )
    assert (found[:, 0] == transfer.time).all() and (found[:, 1:4] == transfer.position).all()
    assert (found[::2, 4:7] == transfer.velocity).all() and len(found) == 25
    assert (found[:, 7] == transfer.force[:, 2]).all() and (found[:, 8] == 100.0).all()
    # inside the steps the velocity is that of the motion there, to the order of the mesh
    middle = np.gradient(transfer.position, transfer.time, axis=0, edge_order=2)[1::2]
    assert np.abs(found[1::2, 4:7] - middle).max() < 0.01 * SPEED
    assert not any(name.startswith(("date", "leg", "body")) for name in rows[0])
    convert(transfer, tmp_path / "dated.csv", epoch="2028-11-20", time_system="UTC")
    with (tmp_path / "dated.csv").open(newline="") as file:
        assert next(csv.DictReader(file))["date (UTC)"] == "2028-11-20T00:04:10"


def test_a_leg_without_a_column_has_empty_cells(tmp_path):
    """An engine has a throttle, a free force has none."""
    ends = State((0, 0), (0, 0)), State((1, 0), (1, 0))
    mixed = Mission(1.0, *ends, [Leg(1.0, actuator=Engine(9.0)), Leg(1.0)])
    convert(solve(mixed, order=2, steps=4), tmp_path / "path.csv")
    with (tmp_path / "path.csv").open(newline="") as file:
        throttles = [row["control throttle [N]"] for row in csv.DictReader(file)]
    assert throttles[5:] == [""] * 5 and all(np.isfinite([float(cell) for cell in throttles[:5]]))


def test_a_marched_path_is_a_table(turning, tmp_path):
    """Of a body that turns, by the torques of an answer."""
    marched = simulate(turning.problem, turning)
    columns = marched_columns(marched, turning.problem)
    turns = np.stack([columns[f"rate {axis} [rad/s]"] for axis in "xyz"], axis=1)
    np.testing.assert_allclose(turns, turning.rate, atol=1e-9)
    quaternions = [values for name, values in columns.items() if name.startswith("attitude")]
    np.testing.assert_allclose(np.transpose(quaternions)[-1], turning.attitude[-1], atol=1e-9)
    write_marched(marched, turning.problem, tmp_path / "marched.csv")
    with (tmp_path / "marched.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["rate z [rad/s]"]) for row in rows] == columns["rate z [rad/s]"].tolist()
    assert set(rows[0]) == set(columns) and {"time [s]", "mass [kg]", "energy [J/kg]"} < set(columns)


def test_json_is_the_same_table(mission, turning, tmp_path):
    convert(mission, tmp_path / "path.json", epoch="2028-11-20")
    found = json.loads((tmp_path / "path.json").read_text())
    assert (found["epoch"], found["time_system"]) == ("2028-11-20T00:00:00", "TDB")
    for leg, told in zip(mission.legs, found["stretches"], strict=True):
        assert told["kind"] == "leg" and told["columns"]["time [s]"] == leg.time.tolist()
        assert told["columns"]["position y [m]"] == leg.position[:, 1].tolist()
    kicks = found["impulses"]
    assert [kick["at"] for kick in kicks] == ["joint 1", "goal"]
    assert kicks[0]["velocity change [m/s]"] == mission.impulses[0].change.tolist()
    convert(turning, tmp_path / "turn.json")
    columns = json.loads((tmp_path / "turn.json").read_text())["stretches"][0]["columns"]
    assert columns["attitude qs [1]"] == turning.attitude[:, 0].tolist()
    assert (
        columns["rate z [rad/s]"][::2] == turning.rate[:, 2].tolist() and columns["rate z [rad/s]"][1] is None
    )
    assert columns["torque x [N m]"] == turning.torque[:, 0].tolist()


def test_held_forces_stand_at_the_nodes_of_their_step(tmp_path):
    held = solve(load_problem("point_to_point").make(), order=4, steps=5, hold=True)
    convert(held, tmp_path / "held.json")
    columns = json.loads((tmp_path / "held.json").read_text())["stretches"][0]["columns"]
    force = held.force[:, 0]
    assert columns["force x [N]"] == [*np.repeat(force, 2), force[-1]]


def test_teams_and_systems_have_all_their_bodies(tmp_path):
    team = solve(load_problem("three_robots").make(), steps=8)
    convert(team, tmp_path / "team.csv")
    with (tmp_path / "team.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(dict.fromkeys(row["body"] for row in rows)) == list(team.names)
    assert len(rows) == 3 * len(team.time)
    with pytest.raises(ValueError, match="an OEM is of one body"):
        convert(team, tmp_path / "team.oem", **GIVEN)
    arm = solve(load_problem("arm_reach").make(), order=4, steps=10)
    convert(arm, tmp_path / "arm.csv")
    names = (tmp_path / "arm.csv").read_text().splitlines()[0]
    assert all(f"position {label} [m]" in names for label in arm.path.coordinates.place_labels)


def test_an_oem_is_read_back(transfer, tmp_path):
    convert(transfer, tmp_path / "path.oem", **GIVEN, time_system="UTC")
    ((keys, dates, states),) = read_oem(tmp_path / "path.oem")
    assert keys == {
        "OBJECT_NAME": "PROBLEM",
        "OBJECT_ID": "PROBLEM",
        "CENTER_NAME": "EARTH",
        "REF_FRAME": "EME2000",
        "TIME_SYSTEM": "UTC",
        "START_TIME": "2028-11-20T06:04:10.000000",
        "STOP_TIME": "2028-11-20T06:29:10.000000",
        "INTERPOLATION": "HERMITE",
        "INTERPOLATION_DEGREE": "3",
    }
    assert np.abs(seconds(dates, GIVEN["epoch"]) - transfer.time).max() < 1e-6
    np.testing.assert_allclose(states[:, :3], transfer.position / 1e3, rtol=1e-14)
    np.testing.assert_allclose(states[::2, 3:], transfer.velocity / 1e3, rtol=1e-14)


def test_an_oem_of_a_mission_has_a_segment_a_leg(mission, tmp_path):
    convert(mission, tmp_path / "path.oem", **GIVEN)
    segments = read_oem(tmp_path / "path.oem")
    assert len(segments) == 2
    for (keys, dates, states), leg in zip(segments, mission.legs, strict=True):
        np.testing.assert_allclose(states[:, :3], leg.position / 1e3, rtol=1e-14)
        assert keys["STOP_TIME"] == dates[-1].isoformat(timespec="microseconds")
    assert segments[0][0]["STOP_TIME"] == segments[1][0]["START_TIME"]
    change = segments[1][2][0, 3:] - segments[0][2][-1, 3:]
    told = re.findall(
        r"COMMENT impulse at joint 1, (\S+), (\S+) (\S+) (\S+) km/s", (tmp_path / "path.oem").read_text()
    )
    assert len(told) == 1 and told[0][0] == segments[0][0]["STOP_TIME"]
    np.testing.assert_allclose([float(x) for x in told[0][1:]], change, atol=1e-9 * SPEED)


def test_the_ecliptic_is_turned_to_the_frame_of_the_format(to_mars, tmp_path):
    """Epoch, frame and center are those of the scene."""
    convert(to_mars, tmp_path / "path.oem")
    ((keys, dates, states),) = read_oem(tmp_path / "path.oem")
    assert (keys["REF_FRAME"], keys["CENTER_NAME"], keys["TIME_SYSTEM"]) == ("ICRF", "SUN", "TDB")
    assert dates[0] == datetime(2028, 11, 24)
    c, s = np.cos(OBLIQUITY), np.sin(OBLIQUITY)
    turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    np.testing.assert_allclose(1e3 * states[:, :3], to_mars.position @ turn.T, rtol=1e-13, atol=1.0)
    np.testing.assert_allclose(1e3 * states[0, 3:], turn @ to_mars.legs[0].velocity[0], rtol=1e-13)
    assert "COMMENT turned from the ecliptic of J2000" in (tmp_path / "path.oem").read_text().splitlines()
    kicks = re.findall(r"COMMENT impulse at .*, (\S+) (\S+) (\S+) km/s", (tmp_path / "path.oem").read_text())
    found = [[float(x) for x in kick] for kick in kicks]
    changes = np.array([kick.change for kick in to_mars.impulses])
    np.testing.assert_allclose(found, changes @ turn.T / 1e3, rtol=1e-12)
    # what the scene says may be said again, in letters of another size
    convert(to_mars, tmp_path / "again.oem", frame="eclipj2000", center="SUN")
    assert read_oem(tmp_path / "again.oem")[0][0] == keys


def test_an_ecliptic_that_is_given_is_turned_too(transfer, tmp_path):
    for frame in ("ECLIPJ2000", "eclipj2000"):
        convert(transfer, tmp_path / "path.oem", **GIVEN | {"frame": frame})
        ((keys, _, states),) = read_oem(tmp_path / "path.oem")
        assert keys["REF_FRAME"] == "ICRF" and "ecliptic of J2000" in (tmp_path / "path.oem").read_text()
        y, z = transfer.position[-1, 1:] / 1e3
        assert states[-1, 2] == pytest.approx(np.sin(OBLIQUITY) * y + np.cos(OBLIQUITY) * z, rel=1e-12)


def test_another_reader_reads_an_oem(mission, tmp_path):
    oem = pytest.importorskip("oem")
    convert(mission, tmp_path / "path.oem", **GIVEN)
    found = oem.OrbitEphemerisMessage.open(str(tmp_path / "path.oem"))
    assert len(found.segments) == 2
    for segment, leg in zip(found.segments, mission.legs, strict=True):
        states = list(segment.states)
        np.testing.assert_allclose([state.position for state in states], leg.position / 1e3, rtol=1e-13)
        middle = states[2].epoch + (states[3].epoch - states[2].epoch) / 2
        t = 0.5 * (leg.time[2] + leg.time[3])
        near = np.array([np.interp(t, leg.time, column) for column in leg.position.T]) / 1e3
        assert np.linalg.norm(segment(middle).position - near) < 1e-3 * RADIUS / 1e3


def test_czml_has_a_position_with_velocities(mission, tmp_path):
    convert(mission, tmp_path / "path.czml", **GIVEN)
    document, packet = json.loads((tmp_path / "path.czml").read_text())
    assert document["id"] == "document" and document["version"] == "1.0"
    # TDB is 69.184 s ahead of UTC in 2028
    assert packet["availability"] == "2028-11-20T05:58:50.816000Z/2028-11-20T06:28:50.816000Z"
    assert document["clock"]["interval"] == packet["availability"] and packet["id"] == "mission"
    for part, leg in zip(packet["position"], mission.legs, strict=True):
        samples = np.array(part["cartesianVelocity"]).reshape(-1, 7)
        assert (samples[:, 0] == leg.time - leg.time[0]).all() and (samples[:, 1:4] == leg.position).all()
        assert (samples[:: len(leg.position) // leg.steps, 4:] == leg.velocity).all()
        assert (part["interpolationAlgorithm"], part["referenceFrame"]) == ("HERMITE", "INERTIAL")
        assert part["interval"].startswith(part["epoch"])
    assert packet["position"][0]["interval"].split("/")[1] == packet["position"][1]["epoch"]
    convert(mission, tmp_path / "path.czml", **GIVEN | {"frame": "ITRF2014"}, time_system="UTC")
    packet = json.loads((tmp_path / "path.czml").read_text())[1]
    assert packet["position"][0]["referenceFrame"] == "FIXED"
    assert packet["position"][0]["epoch"] == "2028-11-20T06:00:00Z"
    # TAI is 37 s ahead of UTC
    convert(mission, tmp_path / "path.czml", **GIVEN, time_system="TAI")
    packet = json.loads((tmp_path / "path.czml").read_text())[1]
    assert packet["position"][0]["epoch"] == "2028-11-20T05:59:23Z"


def test_utc_by_leap_seconds():
    """TT - UTC: 64.184 s in 2000 and 69.184 s since 2017; 42.184 s on the first day of 1972."""
    assert utc_of("2000-01-01T12:00:00") == "2000-01-01T11:58:55.816000"
    assert utc_of("2017-01-01T00:01:09.184") == "2017-01-01T00:00:00"
    assert utc_of("2016-12-31T00:01:08.184") == "2016-12-31T00:00:00"
    assert utc_of("1972-01-01T00:00:42.184") == "1972-01-01T00:00:00"
    counts = {
        1973: 12,
        1980: 19,
        1984: 22,
        1985: 22,
        1986: 23,
        1990: 25,
        1993: 27,
        1995: 29,
        1998: 31,
        2005: 32,
    }
    for year, count in (counts | {2008: 33, 2011: 34, 2014: 35, 2016: 36}).items():
        ahead = datetime(year, 4, 1) - datetime.fromisoformat(utc_of(f"{year}-04-01"))
        assert ahead.total_seconds() == pytest.approx(count + 32.184, abs=1e-6)
    with pytest.raises(ValueError, match="begin with 1972"):
        utc_of("1971-12-31")


def test_utc_is_that_of_astropy():
    time = pytest.importorskip("astropy.time")
    for year in range(1973, 2030):
        date = f"{year}-06-30T12:00:00"
        exact = time.Time(date, scale="tdb").utc.to_datetime()
        assert abs(datetime.fromisoformat(utc_of(date)) - exact) < timedelta(seconds=0.002)


@pytest.mark.parametrize(
    "of, given, told",
    [
        (
            "transfer",
            {"to": "oem"},
            "an OEM needs the date of t = 0, the axes and the body at the origin, .* give epoch .* and center",
        ),
        ("transfer", {"to": "oem", "epoch": "2028-11-20"}, "needs the axes, .* give frame"),
        (
            "transfer",
            {"to": "oem", "epoch": "2028-11-20", "frame": "ICRF"},
            "the body at the origin, .* give center",
        ),
        ("transfer", {"to": "czml", "epoch": "2028-11-20"}, "CZML needs the axes"),
        ("transfer", {"to": "czml", **GIVEN, "center": "MOON"}, "about the Earth, and these are about MOON"),
        ("transfer", {"to": "czml", **GIVEN, "epoch": "1960-01-01"}, "begin with 1972"),
        ("transfer", {"to": "oem", **GIVEN, "epoch": "9999-12-31T23:59:59"}, "no date of the years 1 to 9999"),
        ("transfer", {"to": "oem", **GIVEN, "epoch": "soon"}, "epoch must be a date"),
        ("transfer", {"to": "oem", **GIVEN, "frame": 3}, "frame must be a word; got 3"),
        ("transfer", {"to": "oem", **GIVEN, "center": "A\nB"}, "center must be a word"),
        (
            "transfer",
            {"to": "oem", **GIVEN, "time_system": "GPS"},
            "time_system must be TDB, TT, TAI, UTC; got 'GPS'",
        ),
        ("transfer", {"to": "xlsx"}, "written as csv, json, oem, czml; got 'xlsx'"),
        ("transfer", {}, "got the name out: say which with to"),
        ("turning", {"to": "oem", **GIVEN}, "this has 0 axes: use csv or json"),
        ("to_mars", {"to": "oem", "epoch": "2028-11-20"}, "has the epoch 2028-09-01T00:00:00 already"),
        ("to_mars", {"to": "oem", "time_system": "UTC"}, "counts time in TDB already"),
        ("to_mars", {"to": "czml"}, "these are about sun"),
    ],
)
def test_what_a_format_cannot_hold_is_refused(of, given, told, tmp_path, request):
    with pytest.raises(ValueError, match=told) as raised:
        convert(request.getfixturevalue(of), tmp_path / "out", **given)
    assert "\n" not in str(raised.value) and not list(tmp_path.iterdir())


def test_more_that_an_oem_cannot_hold(mission, transfer, tmp_path):
    second = mission.legs[1]
    away = replace(second, path=replace(second.path, position=second.path.position + 1e6))
    with pytest.raises(ValueError, match="begins elsewhere than coast 1 ends"):
        convert(replace(mission, legs=(mission.legs[0], away)), tmp_path / "a.oem", **GIVEN)
    short = replace(transfer, path=replace(transfer.path, duration=1e-5))
    with pytest.raises(ValueError, match="times by microseconds"):
        convert(short, tmp_path / "a.oem", **GIVEN)
    with pytest.raises(ValueError, match=r"solution must be a dmoc.Solution"):
        convert("flight.nc", tmp_path / "a.csv")
    for name in ("orbit_raise", "arm_reach"):
        found = solve(load_problem(name).make(), order=4, steps=4)
        with pytest.raises(ValueError, match=r"(2 axes|several bodies).*use csv or json"):
            convert(found, tmp_path / "a.oem", **GIVEN)


def test_from_the_command_line(to_mars, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    to_mars.save("flight.nc")

    def run(*words):
        with pytest.raises(SystemExit) as ended:
            main(["convert", "flight.nc", *words])
        shown = capsys.readouterr()
        return ended.value.code, shown.out + shown.err

    assert run("--to", "csv") == (0, "wrote flight.csv\n")
    assert run("--out", "mine.oem") == (0, "wrote mine.oem\n")
    assert len(read_oem(tmp_path / "mine.oem")[0][1]) == len(to_mars.time)
    assert run("--to", "json", "--out", "a.txt") == (0, "wrote a.txt\n") and json.loads(
        (tmp_path / "a.txt").read_text()
    )
    for words, told in (
        ((), "error: say what to write"),
        (("--to", "nc"), "error: flight.nc is the solution itself"),
        (("--to", "czml"), "error: CZML shows places about the Earth"),
        (("--to", "oem", "--epoch", "2020-01-01"), "already; leave epoch out"),
        (("--out", "missing/a.csv"), "the folder missing does not exist"),
    ):
        code, shown = run(*words)
        assert code == 2 and told in shown and shown.count("\n") == 1
    assert load("flight.nc").success


def test_a_solve_loads_nothing_of_it():
    script = (
        "import sys\nfrom dmoc.cli.app import main\ntry:\n    main(['solve', 'point_to_point', '--quiet'])\n"
        "finally:\n    print(*[name for name in sys.modules if 'conversions' in name], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.returncode, done.stderr.split()) == (0, [])
