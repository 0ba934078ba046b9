"""Functions are remembered for the same scene alone: whatever a user makes of it, none gets another one's."""

import os
import subprocess
import sys
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    BallForce,
    BoxForce,
    Condition,
    Effort,
    Engine,
    FreeForce,
    KeepOut,
    LinearDrag,
    Nozzles,
    Orbit,
    PointGravity,
    SpeedLimit,
    Spring,
    State,
    ThirdBody,
    Time,
    TransferProblem,
    Wind,
    circular_motion,
    solve,
    tabulated_motion,
    verify,
)
from dmoc.basics import memory
from dmoc.basics.memory import forget, identity, remembered
from dmoc.motion.dynamics import Dynamics
from dmoc.nlp.stencils import stencils_of
from dmoc.scene.problem_file import load_problem


class Near(NamedTuple):
    """A motion that is a tuple as well."""

    distance: float

    def __call__(self, t):
        return ca.vertcat(self.distance, 0)


class Far(NamedTuple):
    """Another one with the same numbers."""

    distance: float

    def __call__(self, t):
        return ca.vertcat(100 * self.distance, 0)


class Fixed(float):
    """A motion that is a number as well."""

    def __call__(self, t):
        return ca.vertcat(float(self), 0)


class Tripled(PointGravity):
    """A field of the library's numbers and a formula of one's own."""

    def lagrangian(self, t, q, v, m):
        return 3 * super().lagrangian(t, q, v, m)


class Ahead(FreeForce):
    """Pushes twice as much as it is told."""

    structure = ("mine",)

    def force(self, u):
        return 2 * u


class Behind(FreeForce):
    """Pushes the other way, and says that it is built the same."""

    structure = ("mine",)

    def force(self, u):
        return -u


@dataclass(frozen=True)
class Half(Effort):
    """Half the effort."""

    def rate(self, *state):
        return 0.5 * super().rate(*state)


def wind(strength):
    return lambda t, q: ca.vertcat(strength, 0)


TIMES = (0.0, 1.0, 2.0, 3.0)
EFFECTS = {
    "none": [],
    "gravity": [PointGravity(1.0)],
    "stronger": [PointGravity(2.0)],
    "elsewhere": [PointGravity(1.0, center=(0.1, 0))],
    "user's gravity": [Tripled(1.0)],
    "spring": [Spring(1.0, (0, 0))],
    "near": [ThirdBody(1.0, Near(5.0))],
    "far": [ThirdBody(1.0, Far(5.0))],
    "number": [ThirdBody(1.0, Fixed(6.0))],
    "circle": [ThirdBody(1.0, circular_motion(5.0, 0.1))],
    "table": [ThirdBody(1.0, tabulated_motion(TIMES, [(5 + t, 1) for t in TIMES]))],
    "other table": [ThirdBody(1.0, tabulated_motion(TIMES, [(5 + t, 1 + t**3) for t in TIMES]))],
    "air": [LinearDrag(0.1)],
    "wind": [LinearDrag(0.1, Wind((1, 0)))],
    "users' wind": [LinearDrag(0.1, wind(2.0))],
    "users' storm": [LinearDrag(0.1, wind(3.0))],
}
ENDS = {"state": State((2, 0), (0, 0.7)), "orbit": Orbit(1.0, a=2.0), "round": Orbit(1.0, a=2.0, e=0.0)}
ENDS |= {f"gate {x}": Condition(lambda t, q, v, m, x=x: q[0] - x) for x in (2, 3)}
PARTS = {
    "effects": EFFECTS,
    "goal": ENDS,
    "actuator": {
        "free": FreeForce(),
        "ball": BallForce(1.0),
        "ahead": Ahead(),
        "behind": Behind(),
        "engine": Engine(1.0),
        "rocket": Engine(1.0, exhaust_velocity=5.0),
        "crossed": Nozzles([(1, 0), (0, 1), (-1, -1)], 1.0),
        "tilted": Nozzles([(1, 0.1), (0, 1), (-1, -1)], 1.0),
    },
    "objective": {"effort": Effort(), "half": Half(), "weighted": 0.3 * Effort(), "sum": Effort() + 2 * Time()},
    "constraints": {"zone": [KeepOut((1, 1), 0.5)], "speed": [SpeedLimit(9.0)]},
}


def scene(**parts):
    return TransferProblem(**{"mass": 1.0, "start": State((1, 0), (0, 1)), "goal": ENDS["state"], **parts})


def values(problem):
    """What all functions of nodes, steps and ends give for the same numbers, and the forward motion."""
    numbers, found = np.random.default_rng(1), []
    formulas = stencils_of(problem, 4, False)
    for stencil in formulas.stencils:
        for name in ("rows", "cost"):
            function = stencil.kernel.functions[name]
            given = [numbers.uniform(0.5, 1.5, function.size_in(i)) for i in range(function.n_in())]
            found.append(np.array(function(*given)).ravel())
    controls = numbers.uniform(0.5, 1.5, problem.actuator.size(2))
    push = Dynamics.of(problem).actuator.force(ca.DM(controls))
    found.append(np.array(Dynamics.of(problem).acceleration(1.0, [2, 1], [1, 2], 1.0, push)).ravel())
    return np.concatenate(found)


@pytest.mark.parametrize("part", PARTS)
def test_scenes_that_differ_in_one_part_never_share_functions(part):
    def all_values():
        return {
            name: values(scene(duration=(1.0, 5.0), **{part: value})) for name, value in PARTS[part].items()
        }

    first, again = all_values(), all_values()
    for name, found in first.items():
        np.testing.assert_array_equal(found, again[name])
        for other, theirs in first.items():
            assert name == other or not np.array_equal(found, theirs), f"{name} has the functions of {other}"


def must_not_be_made():
    raise AssertionError("made again")


@pytest.mark.parametrize("name", ["orbit_raise", "leo_raise", "drone_hop", "hovercraft", "formation"])
def test_another_solve_makes_nothing_anew_and_has_the_same_answer(name):
    problem = load_problem(name).make()
    forget()
    first = solve(problem, order=4, steps=20)
    verify(first)
    before = dict(memory._functions._held)
    assert before
    again = solve(load_problem(name).make(), order=4, steps=20)
    verify(again)
    assert again.iterations == first.iterations
    np.testing.assert_array_equal(again.position, first.position)
    assert {key: id(value) for key, value in memory._functions._held.items()} == {
        k: id(v) for k, v in before.items()
    }


def test_what_measures_starts_anew():
    assert remembered(lambda: "made", "test") == "made"
    assert remembered(must_not_be_made, "test") == "made"
    forget()
    assert remembered(lambda: "made anew", "test") == "made anew"


def test_those_used_last_are_remembered(monkeypatch):
    monkeypatch.setattr(memory._functions, "most", 3)
    forget()
    for i in range(3):
        remembered(lambda: "made", "test", i)
    remembered(must_not_be_made, "test", 0)
    remembered(lambda: "made", "test", 3)
    for i in (0, 2, 3):
        assert remembered(must_not_be_made, "test", i) == "made"
    assert remembered(lambda: "made anew", "test", 1) == "made anew"


def test_a_process_leaves_no_functions_behind(tmp_path):
    """A later one would have to trust them: whoever can write there could let it run anything."""
    code = "from dmoc import solve; from dmoc.scene.problem_file import load_problem; "
    code += "solve(load_problem('orbit_raise').make(), steps=10)"
    places = dict.fromkeys(("HOME", "XDG_CACHE_HOME", "TMPDIR"), str(tmp_path))
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, env=os.environ | places)
    assert not list(tmp_path.iterdir())


def test_what_may_change_without_a_rebuild_shares_functions():
    first, second = (
        scene(duration=d, actuator=BallForce(limit), start=State(q, (0, 1)), constraints=KeepOut((1, 3), d / 9))
        for d, limit, q in ((3.0, 1.0, (1, 0)), (4.0, 2.0, (1, 1)))
    )
    assert stencils_of(first, 2, False) is stencils_of(second, 2, False)
    assert stencils_of(first, 2, False) is not stencils_of(first, 2, True)
    assert stencils_of(first, 2, False) is not stencils_of(replace(first, duration=(3.0, 4.0)), 2, False)


class Slotted:
    """Keeps its number elsewhere than other objects do."""

    __slots__ = ("number",)

    def __init__(self):
        self.number = 1.0


def read_anew(t):
    return np.loadtxt("wind.csv")


def imported(t):
    import pathlib

    return len(pathlib.Path("a").name) * t


@pytest.mark.parametrize(
    "value",
    [np.array([object()]), np.float32(1), np.random.default_rng(1), Slotted(), read_anew, imported, iter("a")],
    ids=lambda value: getattr(value, "__name__", type(value).__name__),
)
def test_what_cannot_be_told_apart_by_what_it_does_is_made_anew(value):
    with pytest.raises(TypeError):
        identity(value)
    assert remembered(object, "test", value) is not remembered(object, "test", value)


SOURCE = """
from dataclasses import dataclass
from math import pi

import casadi as ca
import numpy as np

from dmoc import Condition, Drag, FreeForce, PointGravity

GAIN = 2.0
TABLE = np.array([1.0, 2.0])
UNUSED = 1


def helper(x):
    return GAIN * x


def wind(t, q):
    return ca.vertcat(helper(t), TABLE[0] * pi)


@dataclass(frozen=True)
class Field(PointGravity):
    more: float = 1.0

    def lagrangian(self, t, q, v, m):
        return (lambda factor: factor * super(Field, self).lagrangian(t, q, v, m))(self.more)


def made(offset=1.0):
    def inner(t, q, v, m):
        return q[0] - offset

    return inner
"""


def built(**changed):
    source = SOURCE
    for old, new in changed.values():
        assert old in source
        source = source.replace(old, new)
    space = {"__name__": "a_users_file"}
    exec(compile(source, "scene.py", "exec"), space)
    return {
        "wind": space["wind"],
        "field": space["Field"](1.0),
        "condition": Condition(space["made"](), "gate"),
        "method": space["Field"](1.0).lagrangian,
    }


CHANGES = {
    "a number it looks at": (("GAIN = 2.0", "GAIN = 3.0"), {"wind"}),
    "a table it looks at": (("[1.0, 2.0]", "[1.0, 2.5]"), {"wind"}),
    "a function it calls": (("GAIN * x", "GAIN + x"), {"wind"}),
    "its own code": (("factor * super", "factor + super"), {"field", "method"}),
    "a default": (("more: float = 1.0", "more: float = 2.0"), {"field", "method"}),
    "what it closes over": (("offset=1.0", "offset=1.5"), {"condition"}),
    "nothing of it": (("UNUSED = 1", "UNUSED = 2"), set()),
}


@pytest.mark.parametrize("what", CHANGES)
def test_what_a_user_wrote_is_known_by_all_that_it_looks_at(what):
    change, touched = CHANGES[what]
    before, after = (
        {name: identity(part) for name, part in one.items()} for one in (built(), built(it=change))
    )
    assert built()["wind"] is not built()["wind"]
    assert {name for name in before if before[name] != after[name]} == touched


def test_a_users_object_that_is_changed_is_told_apart():
    class Gust:
        def __init__(self):
            self.speed = [1.0]

        def __call__(self, t, q):
            return ca.vertcat(self.speed[0], 0)

    gust = Gust()
    before = identity(gust)
    assert identity(gust) == before
    gust.speed[0] = 2.0
    assert identity(gust) != before
    # Objects may refer to one another.
    gust.self = gust
    assert identity(gust) == identity(gust)


def test_a_users_scene_that_is_read_twice_is_written_down_once():
    first, second = (
        scene(duration=3.0, effects=[parts["field"]], goal=parts["condition"]) for parts in (built(), built())
    )
    assert stencils_of(first, 4, False) is stencils_of(second, 4, False)


def test_a_class_with_a_method_of_the_user_s_is_made_anew(monkeypatch):
    identity(PointGravity(1.0))
    monkeypatch.setattr(PointGravity, "lagrangian", lambda self, t, q, v, m: q[0])
    with pytest.raises(TypeError):
        identity(PointGravity(1.0))
    with pytest.raises(TypeError):
        identity(PointGravity)


@pytest.mark.parametrize(
    "pair", [(1, 1.0), (True, 1), (0.0, -0.0), (1, "1"), (None, 0), ((1,), ((1,),))], ids=str
)
def test_numbers_that_python_calls_equal_are_told_apart(pair):
    assert identity(pair[0]) != identity(pair[1])
    assert identity(BoxForce(1.0)) != identity(BallForce(1.0))
    assert identity(np.nan) == identity(float("nan"))


LONG = tuple(0.1 * i for i in range(1, 2001))
ROWS = tuple(zip(LONG, LONG, strict=True))
TABLES = {
    "numbers": LONG,
    "last digit": (*LONG[:-1], np.nextafter(LONG[-1], 0).item()),
    "sign of zero": (*LONG[:-1], 0.0),
    "other sign": (*LONG[:-1], -0.0),
    "whole number": (*LONG[:-1], 200),
    "float of it": (*LONG[:-1], 200.0 + 1e-9),
    "shorter": LONG[:-1],
    "rows of one": tuple((x,) for x in LONG),
    "rows": ROWS,
    "halves": tuple(zip(LONG[::2], LONG[1::2], strict=True)),
    "ragged": (*ROWS[:-2], LONG[:1], LONG[:3]),
    "otherwise ragged": (*ROWS[:-2], LONG[:3], LONG[:1]),
    "words": tuple(map(str, LONG)),
}


def test_long_tables_are_told_apart_too():
    digests = {name: identity(table) for name, table in TABLES.items()}
    assert len(set(digests.values())) == len(TABLES)
    assert identity(list(LONG)) == identity(LONG) and len(repr(identity(ROWS))) < 100
    with pytest.raises(TypeError):
        identity((*LONG, Fixed(1.0)))
    with pytest.raises(TypeError):
        identity((*ROWS, (1.0, Fixed(1.0))))
