"""What docs/extending.md shows works and is right: each section after the scene, in an empty folder."""

import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from shown import all_is_run, endings, ends_with, parts, play, sections

import dmoc
from dmoc.plots.page import figure

ROOT = Path(dmoc.__file__).parents[1]
TEXT = (ROOT / "docs" / "extending.md").read_text()
SCENE, *ADDED = sections(TEXT).items()
# ten centimetres and a metre from the window to the far side of the street
NEEDS = "a limit of 69.2 dB at (2.0, 0.1) m (you gave 66 dB)"


def effect(names):
    """A coast from rest keeps its energy on the hill; the belt carries it along as a first-order lag."""
    rolled, carried = names["rolled"], names["carried"]
    height = 2.0 * np.exp(-((rolled.position - [-1.0, 0.5]) ** 2).sum(axis=1))
    energy = 0.5 * (rolled.velocity**2).sum(axis=1) + 9.81 * height
    assert energy == pytest.approx(np.full(201, 9.81 * 2.0 * np.exp(-1.25)), rel=1e-6)
    assert np.linalg.norm(rolled.velocity[-1]) > 3
    assert carried.velocity[:, 0] == pytest.approx(3 * (1 - np.exp(-0.25 * carried.time)), abs=1e-8)
    assert names["Hill"](2.0).words() == "A round hill beside the start (Hill, height 2 m)"
    scene = names["problem"](effects=[names["Hill"](2.0), names["Belt"](3.0)])
    assert dmoc.verify(dmoc.solve(scene, order=4)).ok


def actuator(names):
    """Each axis gets half the supply: least time is 2 sqrt(m d / F), the least force 4 m d / T^2."""
    fast, supply = names["fast"], names["SharedSupply"]
    assert fast.duration == pytest.approx(2 * np.sqrt(2 * 4 / 2), rel=1e-8)
    assert np.abs(fast.force).sum(axis=1).max() == pytest.approx(4, rel=1e-6)
    assert dmoc.verify(fast).ok
    assert not dmoc.verify(fast, replace(fast.problem, actuator=supply(3.9)))["bounds"].ok
    assert "needs a force limit of 4.004 N (you gave 3 N), or 4.619 s" in names["weak"].message


def objective(names):
    """The sum is what the path costs, and less than what the path of least effort would cost."""
    plain, wary = names["plain"], names["wary"]

    def cost(one):
        near = 1 / (1 + ((one.position - [2.0, 0.5]) ** 2).sum(axis=1))
        return np.trapezoid(0.5 * (one.force**2).sum(axis=1) + 20 * near, one.time)

    assert wary.objective == pytest.approx(cost(wary), rel=1e-9) and cost(wary) < 0.9 * cost(plain)
    assert wary.position[:, 1].min() < -0.5 and np.abs(plain.position[:, 1]).max() < 1e-9
    assert dmoc.verify(wary).ok


def constraint(names):
    """The path touches the zone, the limit that a message names is enough, and pictures show the zone."""
    solution = dmoc.solve(names["problem"]()).raise_for_status()
    distance = np.linalg.norm(solution.position - [2.0, 0.1], axis=1)
    assert distance.min() == pytest.approx(1.0, abs=1e-6) and solution.position[-1, 1] < 0
    assert dmoc.solve(names["problem"](69.2), steps=20).success
    assert (
        "a limit of 69.19 dB at (2.0, 0.1) m (you gave 69.1 dB)"
        in dmoc.solve(names["problem"](69.1), steps=20).message
    )
    assert dmoc.verify(solution).ok
    louder = dmoc.verify(solution, names["problem"](69.5))["bounds"]
    assert not louder.ok and louder.note == "worst: Quiet 1 at nodes" and louder.unit == "m"
    assert "keep-out zone" in legend(solution)
    known = names["Quiet"]
    one, other = (known((2.0, 0.1), 70.0).ways_round(solution.position, solution.path.fractions) for _ in "ab")
    assert len(list(one)) == 2 and all(np.abs(bend[[0, -1]]).max() < 1e-9 for _, bend in other)
    # half of the square of the distance is 3 dB
    assert known((2.0, 0.1), 70.0).eased(0.5).limit == pytest.approx(70 + 10 * np.log10(2))
    del known.outline
    assert "forbidden by Quiet" in legend(solution)


def legend(solution):
    drawn = figure(solution)
    try:
        return [text.get_text() for axes in drawn.axes if axes.get_legend() for text in axes.get_legend().texts]
    finally:
        plt.close(drawn)


def end(names):
    """The nearest place of the line, as a goal that is fixed there has it; a moved line needs no rebuild."""
    stopped, same = names["stopped"], names["same"]
    fixed = dmoc.solve(replace(stopped.problem, goal=dmoc.State((2, 2), (0, 0))))
    assert stopped.position[-1] == pytest.approx([2, 2], abs=1e-7)
    assert stopped.objective == pytest.approx(fixed.objective, rel=1e-8)
    assert same.objective == pytest.approx(stopped.objective, rel=1e-8)
    nlp = dmoc.transcribe(stopped.problem, 50)
    further = nlp.solve(replace(stopped.problem, goal=names["Kerb"](8.0)))
    assert further.position[-1] == pytest.approx([4, 4], abs=1e-6)
    late = dmoc.verify(stopped, replace(stopped.problem, goal=names["Kerb"](4.1)))["bounds"]
    assert not late.ok and late.note == "worst: goal kerb"


def link(names):
    """The bead keeps to its wire, and on a line that is level the wire carries its weight."""
    bead, wire = names["bead"], names["Wire"]
    assert np.abs(bead.position[:, 1] - bead.position[:, 0] ** 2).max() < 1e-10
    assert dmoc.verify(bead).ok and names["push"].shape == (len(bead.time), 1)
    level = dmoc.State((0, 0), (0, 0))
    still = dmoc.solve(replace(bead.problem, start=level, goal=level, links=[wire(0.0)]))
    assert still.reaction == pytest.approx(np.full_like(still.reaction, -9.81), rel=1e-9)


def between(names):
    """Cut loose they fly 2 m apart; in range 1.5 m, which the check sees at the nodes."""
    alone, together = names["alone"], names["together"]
    assert alone.distance("body 1", "body 2").max() > 1.9
    assert together.distance("body 1", "body 2").max() == pytest.approx(1.5, rel=1e-6)
    assert dmoc.verify(together).ok
    verdict = dmoc.verify(together, replace(together.problem, together=(names["InRange"](1.4),)))["together"]
    assert not verdict.ok and verdict.note == "worst: in range body 1 and body 2 range at nodes"
    assert together.problem.together[0].words() == "all bodies stay within 1.5 m"


def check(names):
    """The largest power of least effort from rest to rest is sqrt(3) m d^2 / (T^3 / 8) / 2 here: sqrt(3) W."""
    report = names["report"]
    assert report["power"].value == pytest.approx(np.sqrt(3), rel=1e-4)
    assert not report.ok and [one.name for one in report.checks if not one.ok] == ["power"]
    slow = dmoc.solve(replace(names["solution"].problem, duration=5.0))
    assert dmoc.verify(slow, more=[names["power"]]).ok
    assert "checks failed: power" in figure(names["solution"], report).get_supxlabel()


def method(names):
    """Held forces are off by 1 / (N^2 - 1), as is known; and the path arrives."""
    found = {(trial.method, trial.steps): trial for trial in names["trials"]}
    for steps in (10, 20):
        trial = found["shooting", steps]
        assert trial.error == pytest.approx(1 / (steps**2 - 1), rel=1e-6) and trial.path_error < 1e-12
    assert found["order 2", 20].status == "solved"
    with pytest.raises(ValueError, match="shooting knows free bodies only"):
        dmoc.work_precision(
            names["problem"](effects=[dmoc.LinearDrag(1.0)]), (), (10,), 1, names["METHODS"], reference=1.0
        )


RIGHT = {
    "An effect": effect,
    "An actuator": actuator,
    "An objective": objective,
    "A constraint": constraint,
    "A link": link,
    "An end condition": end,
    "Between two bodies": between,
    "A check": check,
    "Another method": method,
}


@pytest.mark.parametrize("title, text", ADDED, ids=[title for title, _ in ADDED])
def test_what_the_page_shows_works_and_is_right(title, text, tmp_path, monkeypatch):
    RIGHT[title](play(SCENE[1] + text, tmp_path, monkeypatch))


def test_nothing_on_the_page_is_left_out():
    assert all_is_run(TEXT) > 8


def test_what_a_constraint_that_is_too_much_ends_with(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "quiet.py").write_text(source("A constraint"))
    ((command, shown),) = endings(TEXT)
    ends_with(command, shown)


def source(title):
    return next(part["source"] for part in parts(sections(TEXT)[title]) if part["source"])


def listed(root, line):
    """Put a line into the public list of a copy of the library."""
    file = root / "dmoc" / "__init__.py"
    place = "    from dmoc.results.solution import Solution as Solution\n"
    assert place in file.read_text()
    file.write_text(file.read_text().replace(place, place + f"    {line}\n"))


def hill(root):
    (root / "dmoc" / "effects" / "hill.py").write_text(source("An effect").partition("\nrolled =")[0])
    listed(root, "from dmoc.effects.hill import Hill as Hill")
    return "effects=[dmoc.Hill(2.0)]", "Every check holds"


def quiet(root):
    (root / "dmoc" / "parts" / "quiet.py").write_text(source("A constraint").partition("\ndef problem")[0])
    listed(root, "from dmoc.parts.quiet import Quiet as Quiet")
    zones = "dmoc.Quiet((2.0, 0.1), 66.0), dmoc.KeepIn((-1, -1), (5, 1))"
    return f"goal=(2.0, None), constraints=[{zones}]", NEEDS


def power(root):
    file = root / "dmoc" / "checks" / "verification.py"
    function = re.search(r"^def power.*?\n(?=\n)", source("A check"), re.MULTILINE | re.DOTALL)[0]
    before, table, entries = file.read_text().partition("CHECKS: dict")
    file.write_text(before + function + "\n\n" + table + entries.replace("\n}", '\n    "power": power,\n}'))
    return "", "Checks that fail: power"


@pytest.mark.parametrize(
    "added, files", [(hill, 2), (quiet, 2), (power, 1)], ids=["effect", "constraint", "check"]
)
def test_a_part_joins_the_library_by_one_file_and_the_public_list(added, files, tmp_path):
    shutil.copytree(ROOT / "dmoc", tmp_path / "dmoc", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "scene.py").write_text(source(SCENE[0]))
    parts, shown = added(tmp_path)
    changed = [
        file
        for file in (tmp_path / "dmoc").rglob("*.py")
        if not (old := ROOT / file.relative_to(tmp_path)).exists() or old.read_text() != file.read_text()
    ]
    assert len(changed) == files
    (tmp_path / "own.py").write_text(
        f'"""Own."""\n\nimport dmoc\nimport scene\n\n\ndef problem():\n    return scene.problem({parts})\n'
    )
    ended = subprocess.run(
        [sys.executable, "-m", "dmoc.cli", "solve", "own.py"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert shown in " ".join(ended.stdout.split()), ended.stdout + ended.stderr
