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


@pytest.mark.parametrize(
    "make, told",
    [
        (
            lambda: dmoc.Orbit(mu=1.0, semi_major_axis=2.0),
            "Orbit has no argument semi_major_axis; it takes: mu, a, e,",
        ),
        (
            lambda: dmoc.KeepOut(centre=(0, 0), radius=1),
            "no argument centre (did you mean center?); it takes: center",
        ),
        (lambda: dmoc.Effort(weight=3), "Effort has no argument weight; it takes: none"),
        (
            lambda: dmoc.TransferProblem(mass=1.0, effect=[]),
            "TransferProblem has no argument effect (did you mean effects?)",
        ),
        (lambda: dmoc.Leg(time=1.0), "Leg has no argument time"),
    ],
)
def test_an_argument_that_does_not_exist_is_told_with_those_that_do(make, told):
    with pytest.raises(ValueError) as raised:
        make()
    assert told in str(raised.value)


def test_a_part_may_take_arguments_of_any_name():
    class Loose(dmoc.Force):
        def __init__(self, **numbers):
            self.numbers = numbers

        def force(self, t, q, v, m):
            return -v

    assert Loose(a=1).numbers == {"a": 1}


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
