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
    if name not in _known:
        _known[name] = make()
        while len(_known) > MOST:
            _known.popitem(last=False)
    _known.move_to_end(name)
    return _known[name]


def forget() -> None:
    """Start as a new process does."""
    _known.clear()


def identity(value: Any) -> Hashable:
    """Equal for values that are the same for every purpose; raises TypeError where that cannot be told."""
    if value is None or isinstance(value, (bool, int, str)):
        return type(value), value
    if isinstance(value, (float, np.ndarray)):
        array = np.asarray(value)
        return array.shape, array.dtype.str, array.tobytes()
    if isinstance(value, (tuple, list)):
        return tuple(map(identity, value))
    kind = value if isinstance(value, type) else type(value)
    if kind.__module__.split(".")[0] != __name__.split(".")[0]:
        raise TypeError(kind)
    if isinstance(value, type):
        return value
    fields = getattr(value, "__dataclass_fields__", {})
    if not fields and vars(value):
        raise TypeError(kind)
    return kind, tuple(identity(getattr(value, name)) for name in fields)
