"""What was written down for one scene, remembered for the next solve of the same one in this process.

Remembered are small CasADi functions of one point, step or node, never anything that grows with the mesh.
A scene is known again by its parts and their numbers. One that holds an object that is not dmoc's own,
a user's effect or a function of time, is written down anew every time: what such an object does may
have changed without its numbers having changed.
"""

from __future__ import annotations

import hashlib
import sys
from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import cached_property, partial
from itertools import chain
from types import FunctionType
from typing import Any, TypeVar

import numpy as np

MOST = 500
# A table of more rows is long: a key holds its digest, not all of it.
MOST_ROWS = 100

T = TypeVar("T")
_known: OrderedDict[Hashable, Any] = OrderedDict()


def remembered(make: Callable[[], T], *key: Any) -> T:
    """What `make` gives, or gave before for the same key."""
    try:
        name = identity(key)
    except TypeError:
        return make()
    # out and in again: those used last stand last, whatever other threads do meanwhile
    found = _known.pop(name, None)
    _known[name] = found = make() if found is None else found
    while len(_known) > MOST:
        _known.popitem(last=False)
    return found


class remembered_property(cached_property):  # noqa: N801 - used as a decorator
    """A property whose value is remembered for all equal objects."""

    def __init__(self, make: Callable[[Any], Any]):
        super().__init__(lambda owner: remembered(partial(make, owner), make.__qualname__, owner))
        self.__doc__ = make.__doc__


def forget() -> None:
    """Start as a new process does, for one that measures."""
    _known.clear()


def identity(value: Any) -> Hashable:
    """Equal for values that are the same for every purpose; raises TypeError where that cannot be told."""
    # of exactly these types: what derives from them may do anything
    kind = type(value)
    if kind in (type(None), bool, int, str):
        return kind, value
    if kind is float:
        return kind, value.hex()
    if kind is np.ndarray and not value.dtype.hasobject:
        return value.shape, value.dtype.str, value.tobytes()
    if kind in (tuple, list):
        return tuple(map(identity, value)) if len(value) <= MOST_ROWS else _digest(value)
    kind = value if isinstance(value, type) else kind
    if not _is_own(kind) or _is_patched(kind):
        raise TypeError(kind)
    if isinstance(value, type):
        return value
    fields = getattr(value, "__dataclass_fields__", {})
    if not fields and vars(value):
        raise TypeError(kind)
    return kind, tuple(identity(getattr(value, name)) for name in fields)


def _digest(rows: Any) -> str:
    """Of a long table; one of floats alone is not looked at number by number, which would take long."""
    nested = set(map(type, rows)) == {tuple}
    numbers = list(chain.from_iterable(rows)) if nested else rows
    if set(map(type, numbers)) == {float} and (not nested or len(set(map(len, rows))) == 1):
        content = repr((len(rows), nested)).encode() + np.array(numbers).tobytes()
    else:
        content = repr(tuple(map(identity, rows))).encode()
    return hashlib.sha256(content).hexdigest()


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
    # those that dataclasses make are not dmoc's either
    return any(not _is_own(part) and part.__module__ not in sys.stdlib_module_names for part in methods)
