"""Missions swept, flown forward, sought from several guesses; and verbs that refuse them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dmoc
from dmoc import (
    Bounce,
    CircularOrbit,
    Coast,
    DeltaV,
    Drop,
    Engine,
    Impulse,
    Leg,
    Mission,
    PointGravity,
    State,
    UniformGravity,
    Via,
    solve,
)
from dmoc.cli.app import main
from dmoc.missions.guess import guessed
from dmoc.motion.mesh import uniform_mesh
from dmoc.studies.effects import influences
from dmoc.studies.of_missions import mission_precision
from dmoc.studies.optima import mission_optima
from dmoc.sweeps.data import read_sweep
from dmoc.sweeps.journal import journal_of
from dmoc.sweeps.worker import pack, unpack

PLANETS = '''"""From one planet to another by two impulses."""
from dmoc import Coast, DeltaV, Impulse, Mission, Moving, PointGravity, circular_motion


def problem(departure=7.9, flight=3.4):
    """
    Parameters
    ----------
    departure : float [s]
        Time of the start.
    flight : float [s]
        Duration of the coast.
    """
    here, there = circular_motion(1.0, 1.0), circular_motion(1.524, 1.524**-1.5, 1.0)
    legs = [Impulse(), Coast(flight), Impulse()]
    ends = Moving(here), Moving(there)
    return Mission(1.0, *ends, legs, [PointGravity(1.0)], objective=DeltaV(), start_time=departure)
'''


def hohmann(**more):
    ends = CircularOrbit(1.0, mu=1.0, center=(0, 0)), CircularOrbit(2.0, mu=1.0)
    legs = [Impulse(), Coast((1, 60)), Impulse()]
    return Mission(1.0, *ends, legs, [PointGravity(1.0)], objective=DeltaV(), **more)


def rocket():
    """Two stages with a drop and an impulse that burns, so that every event changes the mass."""
    engine = Engine(20.0, exhaust_velocity=50.0)
    return Mission(
        mass=10.0,
        start=State((0.0, 0.0), (0.0, 0.0)),
        goal=State((30.0, 40.0), (0.0, 0.0)),
        legs=[Leg(4.0, actuator=engine), Drop(1.0), Leg(4.0), Impulse(exhaust_velocity=60.0)],
        effects=[UniformGravity((0.0, -0.5))],
        actuator=engine,
        objective=DeltaV(),
    )


def ball():
    """A ball that is thrown, bounces once and comes to a place."""
    legs = [Impulse(), Coast((0.2, 3.0)), Bounce(lambda q: q[1], 0.8), Coast((0.2, 3.0))]
    ends = State((0.0, 1.0), (0.0, 0.0)), State((4.0, 1.0), None)
    return Mission(0.5, *ends, legs, [UniformGravity((0.0, -9.81))], objective=DeltaV())


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    return ended.value.code, capsys.readouterr()


@pytest.fixture
def planets(tmp_path, monkeypatch):
    # In a narrow terminal the names of effects would be broken.
    monkeypatch.setenv("COLUMNS", "160")
    (tmp_path / "planets.py").write_text(PLANETS)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_a_porkchop_map_is_swept_drawn_and_taken_up_again(planets, capsys):
    grid = "--vary", "departure=0,2,14", "--vary", "flight=2.5:4.5:3"
    code, said = run(capsys, "sweep", "planets.py", *grid, "--out", "map.nc")
    assert code == 0 and "Solved 9 of 9 points" in said.out
    data = read_sweep("map.nc")
    assert data.checks_hold.all() and (data.objective > 0).all()
    file = dmoc.scene.problem_file.load_problem("planets.py")
    alone = solve(file.make(departure=2.0, flight=3.5))
    assert data.objective.sel(departure=2.0, flight=3.5).item() == pytest.approx(alone.objective, rel=1e-6)
    # The mass stays, so that the impulse in N s is the velocity change times 1 kg; nothing is burnt.
    assert data.impulse.values == pytest.approx(data.objective.values) and not data.propellant.any()
    code, said = run(capsys, "plot", "map.nc")
    assert code == 0 and (planets / "map.png").stat().st_size > 1000


@pytest.mark.slow
def test_a_sweep_of_missions_goes_on_where_it_was(planets, capsys, monkeypatch):
    from dmoc.sweeps.sweep import sweep

    grid, made = {"departure": [0.0, 2.0], "flight": [3.0, 4.0]}, []
    journal = journal_of("map.nc")

    def stops(*given):
        made.append(given)
        if len(made) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep("planets.py", grid, "map.nc", workers=1, progress=stops)
    lines = journal.read_text().count("\n")
    assert 2 <= lines < 6
    data = sweep("planets.py", grid, "map.nc", workers=1)
    assert data.success.all()


def test_dropped_parts_are_no_propellant(tmp_path):
    from dmoc.sweeps.worker import _record_of

    solution = solve(rocket())
    record = _record_of(solution, False)
    burnt = sum(leg.path.mass[0] - leg.final_mass for leg in solution.legs)
    burnt += solution.legs[-1].final_mass - solution.final_mass
    assert record["propellant"] == pytest.approx(burnt) and burnt > 0.5


def test_the_path_of_a_mission_survives_the_journal_to_the_last_bit():
    path = solve(hohmann()).path
    again = unpack(pack(path))
    assert again.begins == path.begins
    for one, other in zip(path.legs, again.legs, strict=True):
        assert np.array_equal(one.position, other.position) and one.duration == other.duration
        assert all(np.array_equal(one.multipliers[key], other.multipliers[key]) for key in one.multipliers)
    for side in ("own", "forces"):
        one, other = getattr(path, side), getattr(again, side)
        assert one.keys() == other.keys() and all(np.array_equal(one[key], other[key]) for key in one)


@pytest.mark.parametrize("make", [hohmann, rocket, ball])
def test_a_mission_flown_forward_comes_to_its_goal(make):
    solution = solve(make(), tol=1e-7)
    flown = dmoc.simulate(solution.problem, solution)
    assert solution.optimal
    assert flown.time[-1] == pytest.approx(solution.duration)
    assert flown.position[-1] == pytest.approx(solution.position[-1], abs=1e-7 * solution.path.diagonal)
    assert flown.mass[-1] == pytest.approx(solution.final_mass, rel=1e-12)
    joint = len(solution.legs[0].end_times)
    if len(solution.legs) > 1:
        assert flown.time[joint - 1] == flown.time[joint]
        assert flown.position[joint - 1] == pytest.approx(flown.position[joint])


def test_the_velocity_behind_the_last_impulse_is_that_of_the_goal():
    solution = solve(hohmann(), tol=1e-8)
    flown = dmoc.simulate(solution.problem, solution)
    assert np.linalg.norm(flown.velocity[-1]) == pytest.approx(np.sqrt(0.5), rel=1e-7)
    assert np.linalg.norm(flown.velocity[-2]) < 0.6
    # Before the first impulse it is on its orbit, and the march begins behind it.
    assert np.linalg.norm(flown.velocity[0]) == pytest.approx(1 + solution.impulses[0].size, rel=1e-7)


def test_other_impulses_are_flown_as_they_are_given():
    solution = solve(hohmann())
    own = solution.own | {"goal": np.zeros(2)}
    flown = dmoc.simulate(solution.problem, replace(solution, own=own))
    assert flown.velocity[-1] == pytest.approx(flown.velocity[-2])


@pytest.mark.slow
def test_several_starts_find_the_other_optima_of_a_mission():
    found = mission_optima(hohmann(), 6)
    assert found[0].objective == pytest.approx(0.284457, rel=1e-4)
    # None is cheaper than Hohmann's transfer: on a coarse mesh one would seem to be.
    assert all(one.objective > 0.28445 for one in found)
    names = [name for one in found for name in one.starts]
    assert "default" in names and "+1 revolutions" in names and len(names) == len(set(names)) <= 6
    best = solve(hohmann(), guess=found[0].path)
    assert best.success and best.iterations < 10


def test_start_times_are_tried_where_they_are_free(planets):
    made = dmoc.scene.problem_file.load_problem("planets.py").make(flight=3.4)
    free = replace(made, start_time=(0.0, 14.0))
    found = mission_optima(free, 7)
    assert any("start at" in name for one in found for name in one.starts)
    assert len({round(one.path.begins[0], 2) for one in found}) > 1
    with pytest.raises(StopIteration):
        _exhausted(made)


def _exhausted(mission):
    """Where nothing is free there are only the default and the revolutions."""
    from dmoc.studies.optima import _variants

    variants = _variants(mission, None, False, None)
    for _ in range(20):
        next(variants)


def test_starts_from_the_command_line(planets, capsys):
    code, said = run(capsys, "solve", "planets.py", "--set", "departure=0", "--starts", "3")
    assert code == 0 and "Local optima found" in said.out and "default" in said.out


def test_what_an_effect_of_a_mission_does_is_told_by_the_leg_it_moves_most(planets, capsys):
    code, said = run(capsys, "effects", "planets.py")
    assert code == 0 and "PointGravity, mu 1 m^3/s^2" in said.out
    legs = [Coast(0.3), Impulse(), Coast(2.0), Impulse()]
    mission = replace(hohmann(), legs=[Impulse(), *legs], duration=(1, 60))
    mission = replace(mission, legs=[Coast(0.3), *legs[1:3], Impulse()], goal=mission.start, duration=None)
    (row,) = influences(solve(mission, order=4, steps=8))
    assert row.name.endswith("most in coast 2") and row.listed
    # Along the longer coast a straight line leaves the orbit further.
    assert row.displacement > 1.0 and 0.9 < row.acceleration < 3.0


def test_the_errors_of_a_mission_fall_with_the_order(planets, capsys):
    trials = mission_precision(hohmann(), (4,), (8, 16), repeats=1)
    assert [trial.nodes for trial in trials] == [17, 33]
    assert np.log2(trials[0].error / trials[1].error) > 3.7
    assert trials[0].path_error > 8 * trials[1].path_error
    code, said = run(capsys, "study", "planets.py", "--orders", "4", "--steps", "6", "--repeats", "1", "--cold")
    assert code == 2 and "a mission of legs has neither" in said.err


def test_what_a_mission_needs_to_be_simulated_is_said_in_one_line(planets, capsys):
    code, said = run(capsys, "simulate", "planets.py")
    assert code == 2 and "--controls FILE" in said.err and said.err.count("\n") == 1


def test_a_mission_is_exported_from_a_solution_in_a_file(planets, capsys):
    run(capsys, "solve", "planets.py", "--out", "flight.nc")
    code, said = run(capsys, "export", "planets.py", "folder", "--guess", "flight.nc", "--no-c")
    assert code == 0 and "rollout_coast_1" in said.out and "warm_solver" in said.out
    assert (planets / "folder" / "solver.casadi").exists() and not (planets / "folder" / "c").exists()


def test_a_mission_is_simulated_and_filmed_from_a_file(planets, capsys):
    run(capsys, "solve", "planets.py", "--out", "flight.nc")
    code, said = run(capsys, "animate", "flight.nc", "--frames", "3")
    assert code == 0 and said.out == "wrote flight.gif\n" and (planets / "flight.gif").stat().st_size > 1000
    code, said = run(capsys, "animate", "flight.nc", "--frames", "1")
    assert code == 2 and "frames must be a whole number from 2 to 200" in said.err
    code, said = run(capsys, "simulate", "planets.py", "--controls", "flight.nc")
    assert code == 0 and "final time" in said.out and "11.3 s" in said.out


def test_a_mission_of_one_plain_leg_is_a_transfer_for_every_verb(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "one.py").write_text(
        '"""One leg."""\nfrom dmoc import Leg, Mission, State\n\n\ndef problem(span=2.0):\n'
        "    return Mission(1.0, State((0, 0), (0, 0)), State((1, 0), (0, 0)), [Leg(span)])\n"
    )
    assert run(capsys, "solve", "one.py", "--out", "one.nc", "--plot", "one.png")[0] == 0
    assert run(capsys, "check", "one.nc")[0] == 0
    assert run(capsys, "simulate", "one.py", "--controls", "one.nc")[0] == 0
    assert run(capsys, "effects", "one.py")[0] == 0


def test_a_coast_may_be_changed():
    assert replace(Coast(2.0), duration=3.0) == Coast(3.0)
    with pytest.raises(ValueError, match="no actuator in a coast"):
        Coast(1.0, actuator=Engine(1.0, exhaust_velocity=1.0))


def test_a_guess_that_stands_still_divides_by_nothing():
    engine = Engine(20.0, exhaust_velocity=50.0, min_thrust=20.0)
    legs = [Leg(1.0, actuator=engine), Coast(1.0)]
    mission = Mission(10.0, State((0.0,), (0.0,)), State((None,), (None,)), legs, objective=dmoc.FinalHeight())
    with np.errstate(all="raise"):
        path = guessed(mission, [(uniform_mesh(4), 2)] * 2)
    assert np.isfinite(path.mass).all()


def test_a_former_answer_of_other_legs_is_a_guess_of_the_path():
    gate = Mission(
        1.0,
        State((0, 0), (0, 0)),
        State((2, 0), (0, 0)),
        [Leg((0.1, 1.9)), Via((1, 1)), Leg((0.1, 1.9))],
        duration=2.0,
    )
    apart, between = solve(hohmann(), order=4, steps=10), solve(gate, order=4, steps=4)
    assert solve(gate, guess=apart, order=4, steps=4).objective == pytest.approx(15.0)
    # this one begins in the center of the orbit, where no direction is nearer than another
    solve(hohmann(), guess=between, order=4, steps=10)
    other = replace(
        gate, start=State((0, 0, 0), (0, 0, 0)), goal=State((2, 0, 0), (0, 0, 0)), legs=[Leg(1.0), Leg(1.0)]
    )
    with pytest.raises(ValueError, match="it has 2 axes, and needs 3"):
        solve(other, guess=between)
