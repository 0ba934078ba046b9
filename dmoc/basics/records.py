"""Frozen dataclasses whose methods are compiled only where that pays.

The decorator of the standard library compiles six methods for every class, 0.6 ms. A solve from the command
line imports 90 such classes and makes few objects of 40 of them: a tenth of its processor time.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from inspect import get_annotations
from operator import attrgetter
from reprlib import recursive_repr
from types import MethodType
from typing import TYPE_CHECKING, Any

# From so many objects of a class on its `__init__` is compiled.
MANY = 20
# A class without a docstring would be given one with its signature, which takes as long as all the rest.
NO_SIGNATURE = "made for its methods"


@dataclasses.dataclass(frozen=True)
class _Frozen:
    """Its parameters say to the standard library, which may derive a class from ours, that it is frozen."""


class _Init:
    """The `__init__` of a class, which goes through the fields until it is compiled.

    That is when many objects are made, when its signature is asked for, and when arguments do not fit: then the
    compiled one says why.
    """

    def __init__(self, kind: Any):
        self.kind = kind
        self.fields: tuple[dataclasses.Field, ...] = dataclasses.fields(kind)
        self.places = [one.name for one in self.fields if one.init and not one.kw_only]
        self.known = {one.name for one in self.fields if one.init}
        self.needed = {
            one.name
            for one in self.fields
            if one.init and one.default is one.default_factory is dataclasses.MISSING
        }
        self.made = 0

    def __get__(self, thing: Any, owner: type | None = None) -> Any:
        return self.compiled() if thing is None else MethodType(self, thing)

    def __call__(self, thing: Any, /, *given: Any, **named: Any) -> None:
        values = dict(zip(self.places, given, strict=False)) | named
        fits = len(values) == len(given) + len(named) and self.needed <= values.keys() <= self.known
        self.made += 1
        if not fits or self.made > MANY:
            self.compiled()(thing, *given, **named)
            return
        for one in self.fields:
            if one.name in values:
                object.__setattr__(thing, one.name, values[one.name])
            elif one.default_factory is not dataclasses.MISSING:
                object.__setattr__(thing, one.name, one.default_factory())
            elif one.init:
                object.__setattr__(thing, one.name, one.default)
        if hasattr(thing, "__post_init__"):
            thing.__post_init__()

    def compiled(self) -> Callable:
        """That of the standard library, which takes its place."""
        kind = self.kind
        names = {"__module__": kind.__module__, "__qualname__": kind.__qualname__, "__doc__": NO_SIGNATURE}
        whole: Any = type(kind.__name__, (kind,), names)
        kind.__init__ = dataclasses.dataclass(frozen=True, repr=False, eq=False)(whole).__init__
        return kind.__init__


def _record(kind: Any) -> Any:
    own = get_annotations(kind)
    given = {name: getattr(kind, name) for name in own if hasattr(kind, name)}
    told = {"__module__": kind.__module__, "__annotations__": own, "__doc__": NO_SIGNATURE}
    # The standard library reads the fields of a class that stands alone, where it compiles nothing.
    alone: Any = dataclasses.dataclass(init=False, repr=False, eq=False)(type(kind.__name__, (), given | told))
    fields: dict[str, dataclasses.Field] = {}
    for base in reversed(kind.__mro__[1:]):
        fields |= getattr(base, "__dataclass_fields__", {})
    for name in own:
        if isinstance(vars(kind).get(name), dataclasses.Field):
            if hasattr(alone, name):
                setattr(kind, name, getattr(alone, name))
            else:
                delattr(kind, name)
    kind.__dataclass_fields__ = fields | alone.__dataclass_fields__
    kind.__dataclass_params__ = vars(_Frozen)["__dataclass_params__"]
    init = _Init(kind)
    more = {"__init__": init, "__match_args__": tuple(init.places), "__replace__": dataclasses.replace}
    for name, method in (_methods(kind) | more).items():
        # Python puts None in place of the hash of a class with an `__eq__` of its own.
        if vars(kind).get(name) is None:
            setattr(kind, name, method)
    return kind


def _methods(kind: Any) -> dict[str, Callable]:
    """What the standard library would compile, as functions that go through the fields."""
    fields = dataclasses.fields(kind)
    shown = [one.name for one in fields if one.repr]
    compared = _values([one.name for one in fields if one.compare])
    hashed = _values([one.name for one in fields if (one.compare if one.hash is None else one.hash)])

    def show(self: Any) -> str:
        told = ", ".join(f"{name}={getattr(self, name)!r}" for name in shown)
        return f"{type(self).__qualname__}({told})"

    def equal(self: Any, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return compared(self) == compared(other)

    def number(self: Any) -> int:
        return hash(hashed(self))

    def put(self: Any, name: str, value: Any) -> None:
        if type(self) is kind or name in kind.__dataclass_fields__:
            raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
        super(kind, self).__setattr__(name, value)

    def remove(self: Any, name: str) -> None:
        if type(self) is kind or name in kind.__dataclass_fields__:
            raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
        super(kind, self).__delattr__(name)

    methods: dict[str, Callable] = {
        "__repr__": recursive_repr()(show),
        "__eq__": equal,
        "__hash__": number,
        "__setattr__": put,
        "__delattr__": remove,
    }
    for name, method in methods.items():
        method.__name__, method.__qualname__ = name, f"{kind.__qualname__}.{name}"
    return methods


def _values(names: list[str]) -> Callable[[Any], tuple]:
    """A function that gives the values of an object's fields."""
    # That of the standard library gives the value itself where there is one name.
    return attrgetter(*names) if len(names) > 1 else lambda self: tuple(getattr(self, name) for name in names)


# Type checkers know the decorator of the standard library, and this one does the same.
if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(*, frozen: bool) -> Callable[[type], type]:
        """As `dataclasses.dataclass(frozen=True)`, for classes whose objects are not to change."""
        if not frozen:
            raise TypeError("use dataclasses.dataclass for a class whose objects may change")
        return _record
