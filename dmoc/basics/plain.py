"""Values made plain: text on one line, numbers that JSON can hold, objects in one line."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable
from typing import Any

# What takes more letters than this is told by its type.
LONGEST = 40


def unbroken(text: Any) -> str:
    """A text on one line, with one space wherever it had a break or several spaces."""
    return " ".join(str(text).split())


def finite(value: Any) -> Any:
    """`value`, in which numbers that are not finite have become None: JSON has no word for them.

    Dictionaries, lists and tuples are looked through.
    """
    if isinstance(value, dict):
        return {name: finite(entry) for name, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def meant(name: str, known: Iterable[str]) -> str:
    """Such as " (did you mean mass?)", if one of the known names is like this one; else nothing."""
    near = difflib.get_close_matches(name, list(known), n=1, cutoff=0.5)
    return f" (did you mean {near[0]}?)" if near else ""


class Brief:
    """A dataclass that shows itself in one line: of arrays their shapes, of long parts their types."""

    def __init_subclass__(cls) -> None:
        # A dataclass would otherwise write one of its own, which prints every array.
        cls.__repr__ = Brief.__repr__  # type: ignore[method-assign]

    def __repr__(self) -> str:
        """Such as Trajectory(time 401, position 401 x 2, mass 401)."""
        parts = [f"{name} {_brief(value)}" for name, value in vars(self).items() if value is not None]
        return f"{type(self).__name__}({', '.join(parts)})"


def _brief(value: Any) -> str:
    shape = getattr(value, "shape", None)
    if isinstance(shape, tuple) and shape:
        return " x ".join(map(str, shape))
    told = f"{value:g}" if isinstance(value, float) else repr(value)
    return told if len(told) <= LONGEST else type(value).__name__
