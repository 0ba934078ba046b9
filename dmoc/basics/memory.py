"""Functions that were written down for one scene, remembered for the next solve of it in this process.

Remembered are small CasADi functions of one point, step or node, never anything that grows with the mesh.
A scene is known again by its parts and their numbers. A user's own effect or function is known by its code
and by all that the code looks at (`dmoc.basics.sources`). One of which that cannot be told, as it reads a file
or belongs to a compiled module, is written down anew in every solve: what it does may have changed.
"""

from __future__ import annotations

import sys
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cached_property, partial
from itertools import chain
from types import FunctionType
from typing import Any, ClassVar, TypeVar

import numpy as np

from dmoc.basics.sources import Sources
from dmoc.basics.unknown import Unknown

# At most this many functions are remembered; the ones used longest ago go first.
MOST = 500
# A table of more rows is long: a key holds its digest, not all of it.
MOST_ROWS = 100

# The type of a thing that is made once and then taken from a shelf.
T = TypeVar("T")


class Shelf:
    """At most `most` things by their keys; the ones used longest ago make room for new ones."""

    _all: ClassVar[list[Shelf]] = []

    def __init__(self, most: int, lasting: bool = True):
        self.most = most
        self._held: OrderedDict[Hashable, Any] = OrderedDict()
        if lasting:
            self._all.append(self)

    def get(self, key: Hashable, make: Callable[[], T]) -> T:
        """The thing with this key; if there is none, `make` makes it, and it is put there."""
        # An entry that is taken out and put in again stands last, also where another thread did the same.
        found = self._held.pop(key, None)
        self._held[key] = found = make() if found is None else found
        while len(self._held) > self.most:
            self._held.popitem(last=False)
        return found

    @classmethod
    def clear_all(cls) -> None:
        """Empty every shelf."""
        for shelf in cls._all:
            shelf._held.clear()


# Values of these kinds are their own identities.
SIMPLE = (type(None), bool, int, str, float)
# The functions that this process remembers, by the identity of the scene that they were written for.
_functions = Shelf(MOST)


class _Meanwhile:
    """What is remembered while objects that are not dmoc's own are taken not to change."""

    def __init__(self) -> None:
        self.shelf = Shelf(MOST, lasting=False)
        # An object whose address is in a key must live as long as the key.
        self.kept: dict[int, Any] = {}
        # Identities of parts by their addresses, each with its part; None where it cannot be told.
        self.known: dict[int, tuple[Any, Hashable]] = {}
        self._patched: dict[type, bool] = {}

    def is_patched(self, kind: type) -> bool:
        """As `_is_patched`, looked at once."""
        if kind not in self._patched:
            self._patched[kind] = _is_patched(kind)
        return self._patched[kind]


_meanwhile: ContextVar[_Meanwhile | None] = ContextVar("meanwhile", default=None)


@contextmanager
def unchanged() -> Iterator[None]:
    """Within it, as in one solve, also objects that are not dmoc's own are known again: by what they are."""
    token = _meanwhile.set(_meanwhile.get() or _Meanwhile())
    try:
        yield
    finally:
        _meanwhile.reset(token)


def remembered(make: Callable[[], T], *key: Any) -> T:
    """The result of `make`, or its earlier result for the same key."""
    try:
        name = known(key)
    except TypeError:
        pass
    else:
        return _functions.get(name, make)
    if (now := _meanwhile.get()) is None:
        return make()
    return now.shelf.get(_identity_now(key, now.kept), make)


def known(value: Any) -> Hashable:
    """The identity of a key: of each of its parts, found once while they do not change."""
    if type(value) is tuple and len(value) <= MOST_ROWS:
        return tuple(map(known, value))
    now = _meanwhile.get()
    if now is None or type(value) in SIMPLE:
        return identity(value)
    if id(value) not in now.known:
        now.known[id(value)] = value, _told(value)
    found = now.known[id(value)][1]
    if found is None:
        raise TypeError(value)
    return found


def _told(value: Any) -> Hashable | None:
    try:
        return identity(value)
    except TypeError:
        return None


def _identity_now(value: Any, kept: dict[int, Any]) -> Hashable:
    """Equal for values that are the same for as long as `kept` is kept."""
    if type(value) in (tuple, list):
        return tuple(_identity_now(entry, kept) for entry in value)
    try:
        return identity(value)
    except TypeError:
        fields = getattr(value, "__dataclass_fields__", {}) if _is_own(type(value)) else {}
        if fields and not isinstance(value, type):
            return type(value), tuple(_identity_now(getattr(value, name), kept) for name in fields)
        kept[id(value)] = value
        return type(value), id(value)


class remembered_property(cached_property):  # noqa: N801 - used as a decorator
    """A property whose value is remembered for all equal objects."""

    def __init__(self, make: Callable[[Any], Any]):
        super().__init__(lambda owner: remembered(partial(make, owner), make.__qualname__, owner))
        self.__doc__ = make.__doc__


def forget() -> None:
    """Forget all functions, so that a measurement starts as a new process does."""
    Shelf.clear_all()


def identity(value: Any) -> Hashable:
    """Equal for values that are the same for every purpose; raises TypeError where that cannot be told."""
    return Sources(_plain).of(value)


def _plain(value: Any, of: Callable[[Any], Hashable]) -> Hashable | None:
    """The identity of a number, a text, an array, a row of things, or a part of dmoc's own; None for others."""
    # Types must match exactly: a class that derives from one of them may do anything.
    kind = type(value)
    if kind in (type(None), bool, int, str):
        return kind, value
    if kind is float or kind is Unknown:
        return kind, value.hex()
    if kind is np.ndarray and not value.dtype.hasobject:
        return value.shape, value.dtype.str, value.tobytes()
    if kind in (tuple, list):
        return tuple(map(of, value)) if len(value) <= MOST_ROWS else _digest(value)
    kind = value if isinstance(value, type) else kind
    if not _is_own(kind):
        return None
    now = _meanwhile.get()
    if _is_patched(kind) if now is None else now.is_patched(kind):
        raise TypeError(kind)
    if isinstance(value, type):
        return value
    fields = getattr(value, "__dataclass_fields__", {})
    if not fields and vars(value):
        raise TypeError(kind)
    return kind, tuple(of(getattr(value, name)) for name in fields)


def _digest(rows: Any) -> str:
    """The digest of a long table; a table of floats alone is taken as a whole, as entry by entry takes long."""
    nested = set(map(type, rows)) == {tuple}
    numbers = list(chain.from_iterable(rows)) if nested else rows
    if set(map(type, numbers)) == {float} and (not nested or len(set(map(len, rows))) == 1):
        content = repr((len(rows), nested)).encode() + np.array(numbers).tobytes()
    else:
        content = repr(tuple(map(_listed, rows))).encode()
    # it loads OpenSSL, 4 ms of which a small solve has no need
    import hashlib

    return hashlib.sha256(content).hexdigest()


def _listed(value: Any) -> Hashable:
    """The identity of an entry of a table: of a number, a text, or rows of them."""
    if (found := _plain(value, _listed)) is None:
        raise TypeError(value)
    return found


def _is_own(thing: Any) -> bool:
    return str(thing.__module__).split(".")[0] == __name__.split(".")[0]


def _is_patched(kind: type) -> bool:
    """Whether somebody has put a method of their own into one of dmoc's classes."""
    methods = [
        part
        for base in kind.__mro__
        if _is_own(base)
        for part in vars(base).values()
        if type(part) is FunctionType and part.__module__ != base.__module__
    ]
    # Methods that dataclasses generate do not belong to dmoc either, but nobody patched them in.
    return any(not _is_own(part) and part.__module__ not in sys.stdlib_module_names for part in methods)
