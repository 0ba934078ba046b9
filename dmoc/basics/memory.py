"""What was written down for one scene, kept for the next solve of the same one, in this process and later.

Kept are small CasADi functions of one point, step or node, never anything that grows with the mesh.
A scene is known again by its parts and their numbers. One that holds an object that is not dmoc's own,
a user's effect or a function of time, is written down anew every time: what such an object does may
have changed without its numbers having changed.

At the end of a process what is new is written to the user's own folder (`cache`), under a name made of
the scene, dmoc's source files and the versions of CasADi and Python. Scenes with a long table are kept in
memory alone: each of their files would hold all of it.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import pickle
import sys
from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import cached_property, partial
from itertools import chain
from types import FunctionType
from typing import Any, TypeVar

import casadi as ca
import numpy as np

from dmoc.basics import cache

MOST = 500
# A table of more rows is long; it is known by its digest, under this name.
MOST_ROWS, TABLE = 100, "a long table"

T = TypeVar("T")
_known: OrderedDict[Hashable, Any] = OrderedDict()
_new: OrderedDict[Hashable, Any] = OrderedDict()
_use_files = True


def remembered(make: Callable[[], T], *key: Any) -> T:
    """What `make` gives, or gave before for the same key."""
    try:
        name = identity(key)
    except TypeError:
        return make()
    # out and in again: those used last stand last, whatever other threads do meanwhile
    found = _known.pop(name, None)
    if found is None:
        found = _read(name)
    if found is None:
        _new[name] = found = make()
    _known[name] = found
    for table in (_known, _new):
        while len(table) > MOST:
            table.popitem(last=False)
    return found


class remembered_property(cached_property):  # noqa: N801 - used as a decorator
    """A property whose value is kept for all equal objects."""

    def __init__(self, make: Callable[[Any], Any]):
        super().__init__(lambda owner: remembered(partial(make, owner), make.__qualname__, owner))
        self.__doc__ = make.__doc__


def forget(files: bool = False) -> None:
    """Start as a new process does, for one that measures; without `files` as the first one of all."""
    global _use_files
    _known.clear()
    _use_files = files


@atexit.register
def store() -> None:
    """Write what is new to the user's folder, unless dmoc's source files are no longer what made it."""
    if not _new:
        return
    unchanged = VERSION and _version() == VERSION
    while _new:
        name, value = _new.popitem()
        file = _file(name)
        if unchanged and file is not None:
            cache.write(file, pickle.dumps(value))
    cache.tidy("*.functions")


def _read(name: Hashable) -> Any:
    file = _file(name) if _use_files and VERSION else None
    content = None if file is None else cache.read(file)
    try:
        return None if content is None else pickle.loads(content)
    except Exception:  # whatever another build of CasADi raises
        return None


def _file(name: Hashable) -> str | None:
    text = f"{VERSION} {name}"
    return None if TABLE in text else hashlib.sha256(text.encode()).hexdigest() + ".functions"


def _version() -> str:
    """Of all that has a say in what is made, another one has other files; empty where there are no sources."""
    here = os.path.dirname(os.path.dirname(__file__))
    try:
        files = [os.path.join(place, name) for place, _, names in os.walk(here) for name in names]
        found = [(file, os.stat(file)) for file in files if file.endswith(".py")]
    except OSError:  # in an archive
        found = []
    sources = sorted((path, about.st_size, about.st_mtime_ns) for path, about in found)
    made_of = repr((ca.CasadiMeta.version(), np.__version__, sys.version, sources))
    return hashlib.sha256(made_of.encode()).hexdigest() if sources else ""


# When this is loaded: sources that are edited afterwards are not what runs.
VERSION = _version()


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
        return tuple(map(identity, value)) if len(value) <= MOST_ROWS else (TABLE, _digest(value))
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
