"""What a user's own function, class or object does, told by its code and by all that the code looks at."""

from __future__ import annotations

import dataclasses
import dis
from collections.abc import Callable, Hashable, Iterator
from functools import lru_cache, partial
from types import BuiltinFunctionType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import casadi as ca
import numpy as np

# What these packages give does not change from one solve to the next.
LIBRARIES = frozenset(
    {
        "__future__",
        "_operator",
        "abc",
        "builtins",
        "casadi",
        "cmath",
        "collections",
        "dataclasses",
        "dmoc",
        "enum",
        "functools",
        "itertools",
        "math",
        "numpy",
        "operator",
        "scipy",
        "typing",
    }
)
# A function that uses one of these names may do something else another time.
CHANGING = frozenset(
    [
        "__import__",
        "default_rng",
        "eval",
        "exec",
        "fromfile",
        "genfromtxt",
        "getenv",
        "globals",
        "input",
        "load",
        "loadtxt",
        "now",
        "open",
        "perf_counter",
        "rand",
        "randn",
        "random",
        "read",
        "read_csv",
        "read_text",
        "time",
    ]
)
# Methods that `dataclass` writes follow from the fields, which are known.
WRITTEN = frozenset(
    [
        "__init__",
        "__repr__",
        "__eq__",
        "__hash__",
        "__setattr__",
        "__delattr__",
        "__lt__",
        "__le__",
        "__gt__",
        "__ge__",
        "__replace__",
    ]
)
# These entries of a class say nothing of what its objects do.
ASIDE = frozenset(
    [
        "__dict__",
        "__weakref__",
        "__doc__",
        "__module__",
        "__annotations__",
        "__firstlineno__",
        "__static_attributes__",
        "__dataclass_fields__",
        "__dataclass_params__",
        "__abstractmethods__",
        "_abc_impl",
    ]
)
# Functions in the class that stand behind a name: of these kinds of descriptors, the parts that count.
WRAPPED = {
    property: ("fget", "fset", "fdel"),
    classmethod: ("__func__",),
    staticmethod: ("__func__",),
    partial: ("func", "args", "keywords"),
    MethodType: ("__func__", "__self__"),
}


class Sources:
    """The contents of one object, and of all that it refers to.

    `plain` gives the identity of a value of a known kind and None for others; it takes the way to the
    identities of the parts of the value.
    """

    def __init__(self, plain: Callable[[Any, Callable], Hashable | None]):
        self.plain = plain
        # Objects may refer to one another in rings: by their addresses, in the order in which they are met.
        self._met: dict[int, int] = {}
        self._kept: list[Any] = []

    def of(self, value: Any) -> Hashable:
        """Equal for values that do the same; raises TypeError where that cannot be told."""
        if (known := self.plain(value, self.of)) is not None:
            return known
        kind = type(value)
        if kind is ModuleType:
            return "module", _of_library(value.__name__, value)
        if id(value) in self._met:
            return "again", self._met[id(value)]
        self._met[id(value)] = len(self._met)
        self._kept.append(value)
        if isinstance(value, type):
            return self._class(value)
        if kind is FunctionType:
            return self._function(value)
        if kind in (BuiltinFunctionType, np.ufunc):
            module = getattr(value, "__module__", None) or "numpy"
            return "built in", _of_library(module, value), value.__name__
        if kind in WRAPPED:
            return kind, tuple(self.of(getattr(value, name)) for name in WRAPPED[kind])
        if kind is ca.Function:
            return "casadi", value.serialize()
        if kind in (set, frozenset):
            return "set", frozenset(map(self.of, value))
        if kind is dict:
            return "dict", tuple((self.of(key), self.of(entry)) for key, entry in value.items())
        return self._object(value)

    def _function(self, function: FunctionType) -> Hashable:
        if _root(function.__module__) in LIBRARIES:
            return "function", function.__module__, function.__qualname__
        code = function.__code__
        held = [self.of(cell.cell_contents) for cell in function.__closure__ or ()]
        space = function.__globals__
        seen = [(name, self.of(space[name])) for name in _names(code) if name in space]
        given = self.of(function.__defaults__), self.of(function.__kwdefaults__)
        return "function", code, tuple(held), tuple(seen), given

    def _class(self, kind: type) -> Hashable:
        if _root(kind.__module__) in LIBRARIES:
            return "class", kind.__module__, kind.__qualname__
        entries = [
            (name, self.of(entry))
            for name, entry in vars(kind).items()
            if name not in ASIDE and not _is_written(name, entry)
        ]
        return "class", kind.__qualname__, tuple(map(self.of, kind.__bases__)), tuple(entries)

    def _object(self, value: Any) -> Hashable:
        """An object by its class and its fields."""
        kind = type(value)
        bare: Any = None
        for base in (tuple, float, int, str):
            if isinstance(value, base):
                bare = self.of(base(value))  # type: ignore[arg-type]
        if any(
            not base.__flags__ & 1 << 9 for base in kind.__mro__ if base not in (object, tuple, float, int, str)
        ):
            # Classes of compiled modules may keep more than their fields.
            raise TypeError(kind)
        if any("__slots__" in vars(base) and vars(base)["__slots__"] for base in kind.__mro__):
            raise TypeError(kind)
        fields = getattr(value, "__dict__", {})
        return "object", self.of(kind), bare, tuple((name, self.of(entry)) for name, entry in fields.items())


def _is_written(name: str, entry: Any) -> bool:
    """Whether `dataclass` wrote a method."""
    written = name in WRITTEN and type(entry) is FunctionType
    return written and entry.__code__.co_filename in ("<string>", dataclasses.__file__)


def _root(module: str | None) -> str:
    return (module or "").split(".")[0]


def _of_library(module: str, thing: Any) -> str:
    """The name of a module whose contents do not change."""
    if _root(module) not in LIBRARIES:
        raise TypeError(thing)
    return module


@lru_cache(500)
def _names(code: CodeType) -> tuple[str, ...]:
    """The names that code and the functions within it use; TypeError where it may change its mind."""
    names = dict.fromkeys(_used(code))
    if CHANGING & names.keys():
        raise TypeError(code)
    return tuple(names)


def _used(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for one in dis.get_instructions(code):
        if one.opname == "IMPORT_NAME" and _root(one.argval) not in LIBRARIES:
            raise TypeError(code)
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _used(constant)
