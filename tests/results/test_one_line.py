"""What Python prints of an answer is one line, of whatever kind it is."""

import pkgutil
from dataclasses import replace
from importlib import import_module

import numpy as np

import dmoc
from dmoc import BoxForce, State, Time, TransferProblem, simulate, solve, transcribe, verify
from dmoc.results.outcome import NOT_MET, Outcome
from dmoc.results.solution import Solution
from dmoc.scene.problem_file import load_problem


def cart(**parts):
    return TransferProblem(
        1, State((0,), (0,)), State((1,), (0,)), **({"duration": 2.0, "name": "cart"} | parts)
    )


def test_a_solution_says_what_was_found_and_on_which_mesh():
    found = solve(cart(), steps=40)
    # 6 / duration^3 of the continuous cart, and at order 2 a little less
    iterations = f"{found.iterations} iterations"
    assert (
        repr(found)
        == f"Solution of 'cart': effort 0.74906 N^2 s, duration 2 s, order 2, 40 steps, {iterations}"
    )


def test_a_solution_without_its_problem_knows_no_objective_by_name(tmp_path):
    solve(cart(), steps=40).save(tmp_path / "cart.nc")
    assert repr(dmoc.load(tmp_path / "cart.nc")).startswith(
        "Solution of 'cart': objective 0.74906 N^2 s, duration"
    )


def test_least_time_is_told_once_and_in_days():
    fast = solve(cart(actuator=BoxForce(1e-11), duration=(1.0, 1e9), objective=Time()), steps=20)
    assert repr(fast).startswith("Solution of 'cart': time 7.3") and " days, order 2" in repr(fast)
    assert "duration" not in repr(fast)


def test_a_failed_one_says_its_status():
    failed = solve(cart(actuator=BoxForce(0.1)), steps=8)
    assert repr(failed).startswith(f"Solution of 'cart', not solved: {failed.status}, order 2, 8 steps")


def test_one_that_misses_its_tolerance_says_so_behind_what_was_found():
    missed = replace(solve(cart(), steps=40), success=False, status=NOT_MET)
    assert repr(missed).endswith("iterations, tolerance not met") and "effort 0.74906 N^2 s" in repr(missed)


def test_every_kind_of_answer_has_it():
    """A dataclass writes its own, unless it is told not to."""
    for module in pkgutil.walk_packages(dmoc.__path__, "dmoc."):
        if module.name.endswith("solution"):
            import_module(module.name)
    kinds, found = [Outcome], set()
    while kinds:
        found |= set(below := kinds.pop().__subclasses__())
        kinds += below
    assert {kind.__name__ for kind in found} >= {
        "Solution",
        "MissionSolution",
        "StructuredSolution",
        "TeamSolution",
    }
    assert {kind.__repr__ for kind in found} == {Outcome.__repr__}


def test_missions_and_teams_are_one_line():
    for name, begins in (
        ("hohmann", "MissionSolution of 'hohmann': delta v 0.28446 m/s"),
        ("three_robots", "Team"),
    ):
        told = repr(solve(load_problem(name).make()))
        assert told.startswith(begins) and "\n" not in told and len(told) < 130


def test_reports_trajectories_paths_and_programmes_are_one_line():
    found = solve(cart(), steps=40)
    report = verify(found)
    assert repr(report) == "Report: all 7 checks hold"
    broken = Solution(**(vars(found) | {"velocity": found.velocity + 1.0}))
    assert repr(verify(broken)).startswith("Report: 1 of 7 checks fail: ledger ")
    trajectory = simulate(cart(), np.zeros((5, 1)), steps=4)
    assert repr(trajectory).startswith("Trajectory(time 5, position 5 x 1, velocity 5 x 1")
    assert repr(found.path).startswith("DiscretePath(mesh 41, order 2, hold False, duration 2, position 41 x 1")
    programme = repr(transcribe(cart(), 4))
    assert programme.startswith("NLP of 'cart': order 2, 4 steps, ") and programme.endswith(" rows")
