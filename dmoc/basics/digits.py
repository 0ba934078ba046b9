"""Numbers in words that are a promise: rounded to the side on which they are enough."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np


def up(value: float) -> str:
    """Four digits, rounded up, for a number of which less would not be enough."""
    return _rounded(value, np.ceil)


def down(value: float) -> str:
    """Four digits, rounded down, for a number of which more would be too much."""
    return _rounded(value, np.floor)


def _rounded(value: float, how: Callable[[Any], Any]) -> str:
    if value <= 0:
        return "0"
    unit = 10.0 ** (np.floor(np.log10(value)) - 3)
    # A value of a whole number of units must not gain or lose one by the rounding of the division.
    return f"{how(round(value / unit, 2)) * unit:.10g}"
