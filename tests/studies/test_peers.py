"""The problems on which scripts/peers compares tools are those of the gallery; its table says what was run."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest

from dmoc import Effort, solve
from dmoc.scene.problem_file import load_problem

sys.path.insert(0, str(Path(__file__).parents[2] / "scripts"))

from peers import by_casadi, by_dmoc, table, turns
from peers.answer import Answer, error, fly
from peers.meshes import MESHES
from peers.tasks import TASKS, guess, in_plane

GALLERY = {"P2": ("earth_mars", {"duration": 3.3193}), "P3": ("orbit_raise", {}), "P4": ("free_flyer", {})}


@pytest.mark.parametrize("name", GALLERY)
def test_a_task_is_the_problem_of_the_gallery(name):
    task, (known, parameters) = TASKS[name], GALLERY[name]
    stated, ours = load_problem(known).make(**parameters), by_dmoc.problem(task)
    for part in ("mass", "duration", "actuator", "objective", "constraints", "effects"):
        assert getattr(stated, part) == getattr(ours, part), part
    for end in ("start", "goal"):
        np.testing.assert_allclose(
            *[np.concatenate(getattr(one, end).fixed()) for one in (stated, ours)], atol=1e-15
        )


def test_the_condition_of_the_largest_radius_is_that_of_the_gallery():
    stated = load_problem("earth_mars").make(duration=3.3193).goal.function
    q, v = np.array([0.3, -1.2]), np.array([0.7, 0.4])
    assert by_dmoc._circular(0, q, v, 1) == pytest.approx(stated(0, q, v, 1), rel=1e-15)


def test_fifteen_revolutions_cost_what_is_known_of_them():
    """About (dv)^2 / (2 T), as the orbit stays a circle while its speed falls evenly."""
    task = TASKS["P5"]
    slower = (1 - math.sqrt(1 / task.radius)) / task.unit
    assert task.off(slower**2 / (2 * task.duration)) < 1e-2
    problem = by_dmoc.problem(task)
    assert isinstance(problem.objective, Effort)
    found = solve(problem, order=8, steps=80, guess=by_dmoc._guess(problem, task, 8)).raise_for_status()
    assert task.off(found.objective) < 1e-6
    angle = np.unwrap(np.arctan2(*found.position.T[::-1]))
    assert angle[-1] - angle[0] == pytest.approx(82.619, abs=2e-3)


@pytest.mark.parametrize("name", TASKS)
def test_by_hand_and_by_dmoc_come_to_the_same(name):
    task = TASKS[name]
    by_hand, ours = (MESHES[tool][name][0] for tool in ("casadi", "dmoc"))
    answers = by_casadi.solve(task, *by_hand)(), by_dmoc.solve(task, *ours)()
    assert [error(task, answer) < 1e-3 for answer in answers] == [True, True]


def test_the_error_is_that_of_the_control_flown():
    """A control that is off by a hundredth misses the goal, whatever it claims."""
    task = TASKS["P3"]
    answer = by_casadi.solve(task, "Legendre 4", 6)()
    wrong = Answer.of({**answer.plain(), "controls": (1.01 * answer.controls).tolist()})
    assert error(task, answer) < 1e-5 and 1e-3 < error(task, wrong) < 1e-1
    cheap = Answer.of({**answer.plain(), "objective": 0.9 * answer.objective})
    assert error(task, cheap) == pytest.approx(0.1, abs=1e-4)


def test_forces_along_axes_and_along_the_radius_fly_alike():
    task = TASKS["P3"]
    answer = by_casadi.solve(task, "Legendre 4", 12)()
    ours = by_dmoc.solve(task, 8, 16)()
    assert ours.fixed and not answer.fixed
    np.testing.assert_allclose(fly(task, answer)[-1], fly(task, ours)[-1], atol=1e-6)


@pytest.mark.parametrize("name", TASKS)
def test_the_path_all_start_from_begins_at_the_start(name):
    task = TASKS[name]
    states, controls = guess(task, np.linspace(0, 1, 5))
    place = (in_plane(states) if task.polar else states)[0, : task.axes]
    np.testing.assert_allclose(place, task.start[0], atol=1e-15)
    assert controls.shape == (5, task.controls)


def test_the_cheapest_mesh_that_reaches_an_accuracy_is_taken():
    runs = [turns.Run("dmoc", "P3", (8, steps), wrong) for steps, wrong in ((8, 1e-4), (12, 1e-6), (16, 1e-8))]
    found = turns.cheapest(list(zip((0.02, 0.01, 0.03), runs, strict=True)))
    assert {accuracy: run.mesh[1] for accuracy, run in found.items()} == {1e-3: 12, 1e-5: 12, 1e-7: 16}
    assert turns.cheapest([(0.02, runs[0])]) == {1e-3: runs[0]}


def test_the_table_is_written_between_its_markers_and_says_who_is_ahead(tmp_path):
    page = tmp_path / "peers.md"
    page.write_text(table.PAGE.read_text())
    before = page.read_text()
    known = {"first": [0.03, 0.02, 0.04], "warm": [0.021, 0.02, 0.022]}
    runs = {
        ("P3", "dmoc", 1e-3): turns.Run("dmoc", "P3", (8, 16), 1e-8, **known),
        ("P3", "asset", 1e-3): turns.Run("asset", "P3", ("LGL7", 8), 1e-8, first=[0.01] * 3, warm=[0.005] * 3),
    }
    table.write(runs, "0.5.1", page)
    text = page.read_text()
    row = "| P3 1.5 revolutions | 1e-03 | 10 / **5** (LGL7, 8) | - | 30 / 21 (order 8, 16) |"
    assert row in text and "Medians of 3 runs" in text and "ASSET 0.5.1" in text
    assert text.count("| P") == len(TASKS)
    outside = [re_cut(one) for one in (before, text)]
    assert outside[0] == outside[1]
    assert table.facts(runs)[0]["warm"] == 0.021


def re_cut(text):
    return table.PLACE.sub("", text)


def test_a_tool_that_is_missing_is_named_with_the_remedy(tmp_path):
    python = tmp_path / "python"
    python.write_text("#!/bin/sh\nexit 1\n")
    python.chmod(0o755)
    with pytest.raises(turns.NotInstalledError, match=r"ASSET is not installed for .* --asset"):
        turns.Bench(str(python)).refuse_missing("asset")


def test_a_process_of_its_own_tells_times_and_the_answer():
    seconds, answer = turns.Bench().once("casadi", "P3", ("Hermite-Simpson", 8), 1)
    assert len(seconds) == 2 and error(TASKS["P3"], answer) < 1e-3
