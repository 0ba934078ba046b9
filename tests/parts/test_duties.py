"""Whoever derives from a base class is told what is missing, and what for; the examples there run."""

import doctest
import subprocess
import sys

import casadi as ca
import numpy as np
import pytest

import dmoc

BASES = ["Conservative", "Force", "Actuator", "Objective", "Constraint", "Boundary", "Holonomic"]


@pytest.mark.parametrize("name", BASES)
def test_the_example_in_a_base_class_runs(name):
    base = getattr(dmoc, name)
    (test,) = doctest.DocTestFinder(recurse=False).find(base, name, globs={})
    assert len(test.examples) >= 5
    told = []
    assert doctest.DocTestRunner().run(test, out=told.append).failed == 0, "".join(told)


class Typo(dmoc.Force):
    def forces(self, t, q, v, m):
        return -v


class Mute(dmoc.Constraint):
    def rows(self, t, q, u, m):
        return []


class Idle(dmoc.Constraint):
    def excess(self, q, v):
        return np.zeros(len(q))

    def words(self):
        return "does as it likes"


class Free(dmoc.Objective):
    def runing(self, t, q, v, u, m):
        return ca.dot(q, q)


class Alone(dmoc.Together):
    between = ()

    def words(self):
        return "nothing"


class Lazy(dmoc.Boundary):
    def words(self):
        return "anywhere"


@pytest.mark.parametrize(
    "kind, told",
    [
        (
            Typo,
            "Typo has no method force(self, t, q, v, m) (did you mean it by forces?). Force on the body [N]",
        ),
        (Mute, "Mute has no method excess(self, q, v). By how much states"),
        (Mute, "; words is missing, too: see help(dmoc.Constraint)"),
        (Idle, "Idle states nothing: write at least one of the methods rows, speed_rows, bounds; see help"),
        (Free, "Free states nothing (did you mean it by runing?): write at least one of the methods running,"),
        (Alone, "Alone states nothing: write at least one of the methods rows, goal_rows"),
        (Lazy, "Lazy has no property dimension. Number of axes"),
        (dmoc.Conservative, "Conservative has no method lagrangian(self, t, q, v, m). Contribution"),
    ],
)
def test_what_is_missing_is_named_with_what_it_is_for(kind, told):
    with pytest.raises(ValueError) as raised:
        kind()
    assert told in str(raised.value) and "\n" not in str(raised.value)


OWN = '''
"""Own."""

from dmoc import Constraint, State, TransferProblem


class Quiet(Constraint):
    def rows(self, t, q, u, m):
        return []


def problem():
    return TransferProblem(1.0, State((0,), (0,)), State((1,), (0,)), 2.0, constraints=[Quiet()])
'''


def test_the_command_line_tells_it_whole(tmp_path):
    (tmp_path / "own.py").write_text(OWN)
    command = [sys.executable, "-m", "dmoc.cli", "solve", "own.py"]
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert "Quiet has no method excess(self, q, v)" in ended.stderr
    assert ended.stderr.endswith("words is missing, too: see help(dmoc.Constraint)\n")
