"""The random campaign of scripts/campaign.py: its claim on fifty scenes, and that its judge can say no."""

import runpy
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dmoc

SCRIPTS = Path(dmoc.__file__).parents[1] / "scripts"
# So many scenes are solved, of all families in turn.
SCENES = 50
# A scene that takes more processor time than this counts as red [s]: half of them take a third of a second.
LONGEST = 2.0
# At most this share of them may be red [-]: with 12 s three of the fifty are, two more take over 2 s here, and
# five over 1.2 s, which is too long on a processor that is slower.
RED = 0.2


@pytest.fixture(scope="module")
def campaign():
    sys.path.insert(0, str(SCRIPTS))
    yield runpy.run_path(str(SCRIPTS / "campaign.py"))
    sys.path.remove(str(SCRIPTS))


def test_no_answer_is_wrong_and_nearly_every_scene_has_one(campaign):
    run = campaign["run"]
    scenes = [(family, seed) for seed in range(SCENES) for family in campaign["FAMILIES"]][:SCENES]
    outcomes = [run(*scene, longest=LONGEST) for scene in scenes]
    assert [one for one in outcomes if one.verdict == "wrong"] == []
    red = [one for one in outcomes if one.verdict == "red"]
    assert len(red) <= RED * len(outcomes), red


@pytest.fixture(scope="module")
def answer(campaign):
    """A scene with a limit that acts, and its answer, which the judge lets pass."""
    scene = campaign["make"]("propellant", 0)
    solution = dmoc.solve(scene.problem, order=4, steps=60)
    assert campaign["faults"](scene.truth, solution, None) == []
    return scene.truth, solution


def corrupted(solution, **changes):
    return replace(solution, path=replace(solution.path, **changes))


def test_the_judge_sees_a_control_that_does_not_lead_to_the_goal(campaign, answer):
    truth, solution = answer
    weak = corrupted(solution, control=0.9 * solution.path.control)
    assert any("misses the goal" in fault for fault in campaign["faults"](truth, weak, None))


def test_the_judge_sees_a_limit_that_is_broken(campaign, answer):
    truth, solution = answer
    lower = replace(truth, push=replace(truth.push, limit=0.7 * truth.push.limit))
    found = campaign["faults"](lower, solution, None)
    assert any("control at nodes beyond its limit" in fault for fault in found)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"zones": (lambda q: 0.3 + 0 * q[:, 0],)}, "zone beyond"),
        ({"fastest": 1e-3}, "speed beyond"),
        ({"durations": (1e3, 2e3)}, "duration beyond"),
        ({"dry": 1.0}, "dry mass beyond"),
        ({"least": 1e9}, "less than the proven bound"),
        ({"known": 1e-9}, "but a known path"),
        ({"start": lambda t, q, v, m: q - 1.0}, "misses the start"),
    ],
)
def test_the_judge_sees_what_else_may_be_wrong(campaign, answer, changes, said):
    truth, solution = answer
    if "dry" in changes:
        changes = {"push": replace(truth.push, dry=truth.mass)}
    found = campaign["faults"](replace(truth, **changes), solution, None)
    assert any(said in fault for fault in found), found


def test_the_judge_sees_a_wrong_price_and_fuel_that_was_not_paid_for(campaign, answer):
    truth, solution = answer
    assert any(
        "its integral" in one for one in campaign["faults"](truth, replace(solution, objective=1.0), None)
    )
    heavier = corrupted(solution, mass=solution.path.mass * 1.01)
    assert any("final mass" in one for one in campaign["faults"](truth, heavier, None))


def test_the_judges_lobatto_points_are_exact_for_polynomials(campaign):
    from campaign.judge import lobatto

    for degree in (1, 2, 3, 4):
        points, weights = lobatto(degree)
        powers = np.arange(2 * degree)
        assert weights @ points[:, None] ** powers == pytest.approx(1 / (powers + 1), abs=1e-14)
