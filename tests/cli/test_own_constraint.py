"""A constraint that a problem file brings along gets what those of the library get, from the command line."""

import json
import re
import subprocess
import sys

import pytest

import dmoc

OWN = '''
"""Bring a load past a sensor that measures the field of its magnet."""

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from dmoc import BallForce, Constraint, Row, State, TransferProblem{names}


@dataclass(frozen=True)
class Field(Constraint):
    """Less than a limit [uT] at a sensor: moment / distance^3."""

    place: tuple
    limit: float
    moment: float = 8.0

    def feature(self):
        return (self.moment / self.limit) ** (1 / 3)

    def rows(self, t, q, u, m):
        offset = (q - ca.DM(self.place)) / self.feature()
        return [Row("field", ca.dot(offset, offset), 1.0, np.inf)]

    def excess(self, q, v):
        return np.maximum(0.0, self.feature() - np.linalg.norm(q - np.array(self.place), axis=1))

    def words(self):
        return f"makes no more than {{self.limit:g}} uT at {{self.place}} m"

    def violation(self, value, unit):
        return self.limit * (max(1 - value, 1e-9) ** -1.5 - 1), "uT"

    def eased(self, slack):
        return replace(self, limit=self.limit + self.violation(slack, "")[0])

    def needs(self, eased, index, amount):
        return f"a limit of {{eased.limit:.3f}} uT (you gave {{self.limit:g}} uT)"
{outline}

def problem(limit: float = 8.0, height: float = None):
    """The load comes to rest at the height given, or at any between the walls.

    Parameters
    ----------
    limit : float [uT]
        Largest field at the sensor.
    """
    goal = State((1.5, height), (0, 0))
    return TransferProblem(1.0, State((0, 0), (0, 0)), goal, 4.0, constraints=[Field((2.0, 0.1), limit){more}])
'''
OUTLINE = """
    def outline(self):
        return (Ball(np.array(self.place), self.feature()),)
"""
SHAPE = "\nfrom dmoc.parts.outline import Ball"
WALLS = "\nfrom dmoc import KeepIn"


@pytest.fixture
def solve(tmp_path):
    """Run `dmoc solve own.py ...` on the file with these changes: exit code and output."""

    def call(*arguments, names="", outline="", more=""):
        (tmp_path / "own.py").write_text(OWN.format(names=names, outline=outline, more=more))
        command = [sys.executable, "-m", "dmoc.cli", "solve", "own.py", *arguments]
        ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert ended.stderr == "" or ended.returncode == 2, ended.stderr
        return ended.returncode, ended.stdout + ended.stderr

    return call


# the goal at (1.5, y) with |y| <= 1 is at most hypot(0.5, 1.1) m away: there the field is 8 / that^3
ENOUGH = 8 / (0.5**2 + 1.1**2) ** 1.5
CROWDED = {"names": WALLS, "more": ", KeepIn((-2.0, -1.0), (9.0, 1.0))"}


def test_what_is_asked_too_much_is_told_in_its_own_unit(solve):
    """What it names is enough; the rows of the last iterate are in that unit too, not as they are stated."""
    code, out = solve("--set", "limit=3", **CROWDED)
    assert code == 3
    needed, given = map(float, re.search(r"needs a limit of (\S+) uT \(you gave (\S+) uT\)", out).groups())
    assert ENOUGH <= needed < 1.01 * ENOUGH and given == 3
    rows = dict(re.findall(r"^field_1\[(\d+)\]\.field +(\S+ \S+)", out, re.MULTILINE))
    assert rows and all(size.endswith(" uT") for size in rows.values())
    # at the goal: the field there, over the limit
    assert float(rows["100"].split()[0]) == pytest.approx(ENOUGH - 3, rel=0.3)
    assert solve("--set", f"limit={needed}", "--steps", "50", **CROWDED)[0] == 0


def test_a_sentence_of_its_own_where_it_has_no_meaning_for_the_ends(solve):
    code, out = solve("--set", "limit=3", "--set", "height=0.0")
    assert (
        code == 2 and "breaks Field (constraint 1)" in out and "makes no more than 3 uT at (2.0, 0.1) m" in out
    )


@pytest.mark.parametrize(
    "changes, entry", [({}, "forbidden by Field"), ({"names": SHAPE, "outline": OUTLINE}, "keep-out zone")]
)
def test_it_is_drawn_with_an_entry_in_the_legend(solve, tmp_path, changes, entry):
    arguments = "--steps", "50", "--plot", "own.svg", "--out", "own.nc"
    assert solve(*arguments, **changes)[0] == 0
    # the letters of an svg are paths, with the text beside them in a comment
    assert f"<!-- {entry} -->" in (tmp_path / "own.svg").read_text()
    command = [sys.executable, "-m", "dmoc.cli", "check", "own.nc", "--problem", "own.py", "--json"]
    checked = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert checked.returncode == 0 and json.loads(checked.stdout)["checks"]
    nearest = min(abs(complex(*place) - (2 + 0.1j)) for place in dmoc.load(tmp_path / "own.nc").position)
    assert nearest == pytest.approx(1.0, abs=1e-3)
