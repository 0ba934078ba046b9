"""Classes made by `dmoc.basics.records.dataclass` behave as dataclasses of the standard library do."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
from dataclasses import field
from functools import partial
from threading import Thread
from typing import ClassVar

import pytest

from dmoc.basics import records
from dmoc.basics.plain import Brief
from dmoc.basics.records import MANY, dataclass


@dataclass(frozen=True)
class Late:
    size: float
    name: str = "x"
    parts: list = field(default_factory=list, repr=False)
    told: str = field(default="t", compare=False, kw_only=True)
    kept: dict = field(default_factory=dict, init=False, compare=False)
    fixed: int = field(default=1, init=False)
    shared: ClassVar[int] = 3

    def __post_init__(self):
        if self.size < 0:
            raise ValueError("size")


@dataclass(frozen=True)
class LateChild(Late):
    size: float = 2.0
    more: int = 5


@dataclasses.dataclass(frozen=True)
class Whole:
    size: float
    name: str = "x"
    parts: list = field(default_factory=list, repr=False)
    told: str = field(default="t", compare=False, kw_only=True)
    kept: dict = field(default_factory=dict, init=False, compare=False)
    fixed: int = field(default=1, init=False)
    shared: ClassVar[int] = 3

    def __post_init__(self):
        if self.size < 0:
            raise ValueError("size")


@dataclasses.dataclass(frozen=True)
class WholeChild(Whole):
    size: float = 2.0
    more: int = 5


@dataclasses.dataclass(frozen=True)
class UsersChild(Late):
    size: float = 2.0
    more: int = 5


PAIRS = [(Late, Whole), (LateChild, WholeChild), (UsersChild, WholeChild)]


def told(make):
    """What a call gives, or the error it ends in, without the name of the class."""
    try:
        made = make()
    except Exception as error:
        made = type(error), str(error)
    return repr(made).replace("Late", "Whole").replace("UsersChild", "WholeChild")


# a default that no argument can change stays in the class
FIELDS = {
    kind: [one.name for one in dataclasses.fields(kind) if one.name != "fixed"] for kind in (Whole, WholeChild)
}
CALLS = [
    ((1.0,), {}),
    ((1.0, "y", [1]), {"told": "u"}),
    ((), {"size": 4.0, "parts": [2]}),
    ((), {}),
    ((-1.0,), {}),
    ((1.0,), {"size": 2.0}),
    ((1.0,), {"nonsense": 2.0}),
    ((1.0,), {"kept": {}}),
    (tuple(range(9)), {}),
]


@pytest.mark.parametrize("kind, whole", PAIRS)
def test_arguments_are_taken_or_refused_alike(kind, whole, monkeypatch):
    """From the first object to those of the compiled `__init__`; the fields stand in the same order."""
    for given, named in CALLS:
        if kind is not UsersChild:
            monkeypatch.setattr(kind, "__init__", records._Init(kind))
        wanted = told(partial(whole, *given, **named))
        for _ in range(MANY + 3):
            assert told(partial(kind, *given, **named)) == wanted
            assert wanted.startswith("(") or list(vars(kind(*given, **named))) == FIELDS[whole]


@pytest.mark.parametrize("kind, whole", PAIRS)
def test_the_class_says_the_same_of_itself(kind, whole):
    def names(one):
        return [(entry.name, entry.default, entry.init, entry.kw_only) for entry in dataclasses.fields(one)]

    assert names(kind) == names(whole)
    assert kind.__match_args__ == whole.__match_args__
    ours, theirs = (list(inspect.signature(one).parameters.values()) for one in (kind, whole))
    assert [(one.name, one.kind) for one in ours] == [(one.name, one.kind) for one in theirs]
    assert kind.name == whole.name and not hasattr(kind, "parts") and not hasattr(kind, "kept")
    assert dataclasses.is_dataclass(kind)


@pytest.mark.parametrize("kind, whole", PAIRS)
def test_objects_compare_copy_and_stay_alike(kind, whole):
    for one in (kind, whole):
        first, second, third = one(1.0, "a", ()), one(1.0, "a", (), told="other"), one(2.0, "a", ())
        assert first == second != third and hash(first) == hash(second) and {first, second} == {first}
        assert first != 1 and first.__eq__(1) is NotImplemented
        assert dataclasses.replace(first, size=2.0) == third
        assert dataclasses.asdict(first) == dataclasses.asdict(kind(1.0, "a", ()))
        for again in (copy.copy(first), copy.deepcopy(first), pickle.loads(pickle.dumps(first))):
            assert again == first and vars(again) == vars(first)
        with pytest.raises(TypeError, match="unhashable type: 'list'"):
            hash(one(1.0))
    for name in ("size", "new"):
        ours, theirs = kind(1.0), whole(1.0)
        assert told(partial(setattr, ours, name, 2)) == told(partial(setattr, theirs, name, 2))
        assert told(partial(delattr, ours, name)) == told(partial(delattr, theirs, name))
    for one in (kind, whole):
        free = type("Free", (one,), {})(1.0)
        free.new = 3
        with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'size'"):
            free.size = 3
        assert free.new == 3


def test_methods_of_the_class_stay():
    @dataclass(frozen=True)
    class Own(Brief):
        size: float

        def __eq__(self, other):
            return True

    assert repr(Own(1.0)) == "Own(size 1)" and Own(1.0) == Own(2.0) and hash(Own(1.0)) == hash((1.0,))


def test_a_ring_is_shown_as_a_ring():
    ring = Late(1.0, [])
    ring.name.append(ring)
    assert repr(ring) == "Late(size=1.0, name=[...], told='t', kept={}, fixed=1)"


def test_patterns_and_threads_find_it():
    """Threads may make the first objects of a class while its `__init__` changes to the compiled one."""

    @dataclass(frozen=True)
    class Fresh:
        a: int
        b: int = 2

    made = []
    threads = [Thread(target=lambda: made.extend(Fresh(k) for k in range(200))) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert inspect.isfunction(vars(Fresh)["__init__"])
    assert sorted(one.a for one in made) == sorted(list(range(200)) * 8)
    match Fresh(7):
        case Fresh(a, b):
            assert (a, b) == (7, 2)


def test_classes_that_may_change_are_refused():
    with pytest.raises(TypeError, match="may change"):
        dataclass(frozen=False)
