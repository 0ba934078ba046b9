"""Where a user's guess ends far dearer than the program's own, the user is told, after one coarse attempt."""

import json
from dataclasses import replace

import numpy as np
import pytest

import dmoc
from dmoc import BallForce, Engine, FinalMass, Fuel, KeepOut, State, Time, TransferProblem, solve
from dmoc.cli.app import main
from dmoc.scene.problem_file import load_problem
from dmoc.solver.starts import MOST_COMPARING, _is_dear

RAISE = load_problem("orbit_raise").make()
BEST = 1.6903228945e-3


def turning(half_turns, duration=RAISE.duration):
    """From radius 1 to 1.5 through so many half revolutions: the transfer has three."""

    def place(t):
        part = t / duration
        angle = half_turns * np.pi * part
        return (1 + 0.5 * part) * np.array([np.cos(angle), np.sin(angle)])

    return place


def asked(solution):
    return [level for level in solution.ladder if level.question]


@pytest.mark.parametrize("numerics", [{}, {"order": 4, "steps": 60}, {"tol": 1e-4}, {"hold": True}])
def test_a_guess_that_turns_too_little_is_told_of(numerics):
    solution = solve(RAISE, guess=turning(1), **numerics).raise_for_status()
    assert solution.objective == pytest.approx(0.18645, rel=2e-3)
    (told,) = solution.warnings
    assert "the guess leads to effort 0.186 N^2 s, the program's own guess to about 0.00169 N^2 s" in told
    (level,) = asked(solution)
    assert level.objective == pytest.approx(BEST, rel=0.02)
    # the attempt counts in what the answer took, and is a small part of a solve
    assert level.iterations <= 20 and solution.ladder[-1] is level
    assert len(asked(solve(RAISE, **numerics))) == 0


def test_a_guess_of_the_problem_itself_is_compared_too():
    solution = solve(replace(RAISE, guess=turning(1)))
    assert len(solution.warnings) == 1 and asked(solution)


def test_a_good_guess_says_nothing():
    solution = solve(RAISE, guess=turning(3))
    assert solution.warnings == () and len(asked(solution)) == 1


def test_a_path_goes_on_from_an_answer_and_is_not_compared():
    solution = solve(RAISE, guess=solve(RAISE, guess=turning(1)).path)
    assert solution.objective > 100 * BEST and not solution.warnings and not asked(solution)


def test_the_attempt_ends_after_few_iterations():
    """From full speed past a zone, with a goal out of reach: whatever it leads to, it takes no longer."""
    ends = State((0, 0), (0, 0)), State((8, 1), (0, 0))
    zones = [KeepOut((4, 0.3), 1.5), KeepOut((6, 2), 1.2)]
    problem = TransferProblem(10.0, *ends, 40.0, actuator=BallForce(0.6), constraints=zones)
    around = np.array([0.0, 20.0, 40.0]), np.array([(0, 0), (4, 4), (8, 1)])
    (level,) = asked(solve(problem, guess=around, order=4, steps=60))
    assert level.iterations <= MOST_COMPARING


def test_an_answer_that_failed_is_compared_with_nothing():
    weak = replace(RAISE, actuator=BallForce(1e-4))
    solution = solve(weak, guess=turning(1), steps=40)
    assert not solution.success and not any("own guess" in told for told in solution.warnings)


@pytest.mark.parametrize(
    ("objective", "given", "own", "dear"),
    [
        (Time(), 1.6, 1.0, True),
        (Time(), 1.4, 1.0, False),
        (Time(), 0.1, 1.0, False),
        (FinalMass(), 1.0, 1.6, True),
        (FinalMass(), 1.0, 1.4, False),
        (FinalMass(), 1.6, 1.0, False),
        (Time(), 1e-5, 0.0, False),
        (Time(), 1e-2, 0.0, True),
    ],
)
def test_how_much_is_dear(objective, given, own, dear):
    """Least or most; next to nothing is told by the unit of the cost, here 1."""
    actuator = {"actuator": Engine(1.0, specific_impulse=300.0, dry_mass=0.1)}
    problem = TransferProblem(
        1.0, State([0], [0]), State([1], [0]), (1.0, 9.0), objective=objective, **actuator
    )
    assert _is_dear(problem, given, own, 1.0) == dear


def test_an_engine_is_compared_with_a_wide_rounding():
    speed = (1 / 1.5) ** 0.5
    goal = State((-1.5, 0), (0, -speed))
    engine = {"actuator": Engine(0.3, exhaust_velocity=1.5, dry_mass=0.2), "objective": Fuel()}
    problem = replace(RAISE, goal=goal, **engine)
    solution = solve(problem, guess=turning(1), order=4, steps=60)
    assert solution.success and "the guess leads to fuel" in solution.warnings[0]
    assert asked(solution)[0].objective < solution.objective / 1.5


def test_the_command_line_says_so(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    solve(RAISE, guess=turning(1)).save("bad.nc")
    for more in ([], ["--json"]):
        with pytest.raises(SystemExit) as end:
            main(["solve", "orbit_raise", "--guess", "bad.nc", "--out", "k.nc", *more])
        assert not end.value.code
        shown = capsys.readouterr().out
        told = json.loads(shown)["warnings"][0] if more else " ".join(shown.split())
        assert "the guess leads to effort 0.186 N^2 s" in told
    assert "the guess leads to" in dmoc.load("k.nc").warnings[0]
