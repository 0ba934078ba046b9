"""What a page shows of a flight, without a browser."""

from dataclasses import replace

import numpy as np
import pytest

from dmoc import BallForce, CircularOrbit, Engine, KeepOut, PointGravity, State, TransferProblem, solve
from dmoc.pages.cost import read_study
from dmoc.pages.over_time import MOST_ZONES, panels_over_time
from dmoc.pages.stage import THINNEST, stage_of
from dmoc.pages.words import sections, verdict
from dmoc.plots.style import flown_force
from dmoc.reports.study import write_csv
from dmoc.structure.front import verify
from dmoc.studies.accuracy import Trial


def at(*place):
    return State(place, (0.0,) * len(place))


@pytest.fixture(scope="module")
def flat():
    """A flight in space that stays in a plane, past a zone."""
    zone = KeepOut((2, 0.2, 0), 0.5)
    problem = TransferProblem(1.0, at(0, 0, 0), at(4, 0, 0), 4.0, actuator=BallForce(5.0), constraints=[zone])
    return solve(problem, steps=20)


def test_a_flat_flight_has_some_depth():
    problem = TransferProblem(1.0, at(0, 0, 0), at(4, 1, 0), 4.0)
    shape = stage_of(solve(problem, steps=10))["shape"]
    assert max(shape) == 1.0 and min(shape) >= 0.9 * THINNEST


def test_a_zone_can_be_seen_through_and_an_attractor_can_not(flat):
    (zone,) = [trace for trace in stage_of(flat)["still"] if trace.get("name") == "keep-out zone"]
    assert 0.1 < zone["opacity"] < 0.6


def test_the_path_is_coloured_by_the_force_at_its_place(flat):
    (path,) = [trace for trace in stage_of(flat)["still"] if trace.get("name") == "path"]
    times, force = flown_force(flat)
    strength = np.linalg.norm(force, axis=1)
    colour = np.array(path["line"]["color"])
    assert colour == pytest.approx(np.interp(np.linspace(0, 4, len(colour)), times, strength), abs=1e-4)
    assert path["line"]["cmax"] == pytest.approx(strength.max(), rel=1e-5)


def panel(solution, title):
    return next((one for one in panels_over_time(solution, 1.0) if one["title"] == title), None)


def test_of_many_zones_the_nearest_has_a_curve():
    zones = [KeepOut((x, 3.0), 0.5) for x in range(MOST_ZONES + 1)]
    ends = at(0, 0), at(4, 0)
    curves = [
        panel(solve(TransferProblem(1.0, *ends, 4.0, constraints=some), steps=10), "Clearance from the zones")
        for some in (zones[:-1], zones)
    ]
    named = [[curve["name"] for curve in one["curves"] if curve["name"]] for one in curves]
    assert len(named[0]) == MOST_ZONES and named[1] == ["nearest zone"]
    (nearest,) = [curve for curve in curves[1]["curves"] if curve["name"]]
    # the nearest of them is straight above it on the way
    assert min(nearest["y"]) == pytest.approx(2.5, abs=1e-2)


def test_the_mass_has_a_panel_where_it_changes():
    mu, radius = 3.986004418e14, 7e6
    start = State((radius, 0), (0, (mu / radius) ** 0.5))
    parts = {"effects": [PointGravity(mu)], "duration": 3000.0}
    burning = TransferProblem(
        500.0,
        start,
        CircularOrbit(1.002 * radius, mu),
        actuator=Engine(10.0, specific_impulse=220),
        **parts,
    )
    free = TransferProblem(500.0, start, CircularOrbit(1.002 * radius, mu), **parts)
    found = [panel(solve(problem, order=4, steps=20), "Mass") for problem in (burning, free)]
    assert found[0] is not None and found[1] is None
    assert found[0]["curves"][0]["y"][-1] < found[0]["curves"][0]["y"][0] == 500.0


def test_what_fails_is_said_to_fail(flat):
    report = verify(flat)
    assert verdict(flat, report)[0] and "What did not hold" not in [
        title for title, *_ in sections(flat, report)
    ]
    broken = replace(flat, velocity=flat.velocity + 1.0)
    assert not verdict(broken, verify(broken))[0]
    weak = TransferProblem(1.0, at(0, 0), at(4, 0), 1.0, actuator=BallForce(1.0))
    failed = solve(weak, steps=10)
    assert not verdict(failed, None)[0]
    assert "What did not hold" in [title for title, *_ in sections(failed, None)]


def test_a_study_is_read_as_it_was_written(tmp_path):
    row = Trial("order 4", 4, 10, 21, 1.5, 1e-3, 2e-3, 7, 40, 0.1, 0.2, False, "solved")
    other = Trial("by hand", None, 10, 11, 1.5, 1e-3, 2e-3, 7, 40, 0.1, 0.2, True, "solved")
    write_csv([row, other], tmp_path / "study.csv")
    assert read_study(tmp_path / "study.csv") == [row, other]
    (tmp_path / "broken.csv").write_text("method,steps\n1,2\n")
    with pytest.raises(ValueError, match="no table of a study"):
        read_study(tmp_path / "broken.csv")
