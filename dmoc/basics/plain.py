"""Values made plain: text on one line, numbers that JSON can hold."""

from __future__ import annotations

import math
from typing import Any


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
