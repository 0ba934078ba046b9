"""What was written down for one scene, kept for the next solve of the same one.

Kept are small CasADi functions of one point, step or node, never anything that grows with the mesh.
A scene is known again by its parts and their numbers. One that holds an object that is not dmoc's own,
a user's effect or a function of time, is written down anew every time: what such an object does may
have changed without its numbers having changed.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any, TypeVar

import numpy as np

MOST = 64

T = TypeVar("T")
_known: OrderedDict[Hashable, Any] = OrderedDict()


def kept(make: Callable[[], T], *key: Any) -> T:
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


def forget() -> None:
    """Start as a new process does."""
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
        return tuple(map(identity, value))
    kind = value if isinstance(value, type) else kind
    if kind.__module__.split(".")[0] != __name__.split(".")[0]:
        raise TypeError(kind)
    if isinstance(value, type):
        return value
    fields = getattr(value, "__dataclass_fields__", {})
    if not fields and vars(value):
        raise TypeError(kind)
    return kind, tuple(identity(getattr(value, name)) for name in fields)
