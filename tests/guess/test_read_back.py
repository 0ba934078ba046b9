"""A guess that is read from a file: what none can start from is refused in a line, and nothing is written."""

from dataclasses import replace

import numpy as np
import pytest

from dmoc import BallForce, Engine, Fuel, Nozzles, simulate, solve
from dmoc.cli.app import main
from dmoc.scene.problem_file import load_problem

RAISE = load_problem("orbit_raise").make()
GOOD = solve(RAISE, steps=20)


def spoiled(field, value, at=...):
    """The good answer with one field of its path changed, in one place or everywhere."""
    old = getattr(GOOD.path, field)
    if isinstance(old, dict):
        new = {key: np.full_like(each, value) for key, each in old.items()}
    elif isinstance(old, float):
        new = value
    else:
        new = old.copy()
        new[at] = value
    return replace(GOOD, path=replace(GOOD.path, **{field: new}))


SPOILED = {
    "position at 5, 0 must be a finite number [m]; got nan": ("position", np.nan, (5, 0)),
    "position at 0, 0 must be a finite number [m]; got -inf": ("position", -np.inf),
    "position at 7, 1 must be of a size between 1e-50 and 1e+50 [m]; got 1e+300": ("position", 1e300, (7, 1)),
    "control at 3, 1 must be a finite number; got nan": ("control", np.nan, (3, 1)),
    "control at 0, 0 must be of a size between 1e-50 and 1e+50; got 1e+300": ("control", 1e300),
    "mass at 2 must be greater than 0 [kg]; got -1": ("mass", -1.0, 2),
    "mass at 0 must be a finite number [kg]; got nan": ("mass", np.nan),
    "start velocity at 1 must be a finite number [m/s]; got nan": ("start_velocity", np.nan, 1),
    "goal velocity at 0 must be a finite number [m/s]; got inf": ("goal_velocity", np.inf),
    "duration must be greater than 0 [s]; got -1": ("duration", -1.0),
    "duration must be a finite number [s]; got nan": ("duration", np.nan),
    "must be a finite number; got nan": ("multipliers", np.nan),
}


@pytest.mark.parametrize(("words", "change"), SPOILED.items(), ids=SPOILED)
def test_numbers_that_nothing_can_start_from_are_named(words, change, tmp_path, monkeypatch, capfd):
    """The file itself is whole: the iterate of a failed solve is saved too."""
    monkeypatch.chdir(tmp_path)
    spoiled(*change).save("g.nc")
    for command in (
        ["solve", "orbit_raise", "--guess", "g.nc", "--out", "x.nc", "--plot", "x.png"],
        ["solve", "orbit_raise", "--guess", "g.nc", "--starts", "2", "--out", "x.nc"],
        ["simulate", "orbit_raise", "--controls", "g.nc"],
    ):
        with pytest.raises(SystemExit) as end:
            main(command)
        out, err = capfd.readouterr()
        assert (end.value.code, out, len(err.splitlines())) == (2, "", 1) and words in err
    assert [path.name for path in tmp_path.iterdir()] == ["g.nc"]


def test_an_array_that_is_too_large_is_refused():
    with pytest.raises(ValueError, match="guess is larger than any motion at node 1: position"):
        solve(RAISE, guess=([0, 12], [(1, 0), (1e300, 0)]), steps=20)


PARTS = {
    "limit": {"actuator": BallForce(0.1)},
    "engine": {"actuator": Engine(0.3, exhaust_velocity=1.5, dry_mass=0.2), "objective": Fuel()},
    "nozzles": {
        "actuator": Nozzles([(1, 0), (0, 1), (-1, 0), (0, -1)], 0.2, exhaust_velocity=2.0, dry_mass=0.1)
    },
}


@pytest.mark.parametrize("before", PARTS)
@pytest.mark.parametrize("after", PARTS)
@pytest.mark.parametrize("kind", ["solution", "path"])
def test_an_answer_with_another_actuator_is_a_guess_too(before, after, kind):
    known = solve(replace(RAISE, **PARTS[before]), order=4, steps=60).raise_for_status()
    problem = replace(RAISE, **PARTS[after])
    found = solve(problem, order=4, steps=60, guess=known if kind == "solution" else known.path)
    assert found.success
    assert found.objective == pytest.approx(solve(problem, order=4, steps=60).objective, rel=1e-3)


def test_a_simulation_refuses_an_iterate_that_is_not_finite():
    with pytest.raises(ValueError, match="controls: its control at 3, 1 must be a finite number; got nan"):
        simulate(RAISE, spoiled("control", np.nan, (3, 1)))
