"""Numbers in words: rounded to the side on which they are enough, and times in the unit a person would use."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

# Times are told in another unit from this least value on [s]: (least value, seconds of the unit, its name), the
# largest first. Three of a unit is where its own numbers become easier to imagine than those of the one below.
TIMES = ((3 * 86400.0, 86400.0, "days"), (3 * 3600.0, 3600.0, "h"))


def up(value: float) -> str:
    """Four digits, rounded up, for a number of which less would not be enough."""
    return _rounded(value, math.ceil)


def down(value: float) -> str:
    """Four digits, rounded down, for a number of which more would be too much."""
    return _rounded(value, math.floor)


def time_unit(longest: float) -> tuple[float, str]:
    """(seconds of the unit, its name) in which a person would tell times up to `longest` [s]."""
    return next(((size, name) for least, size, name in TIMES if abs(longest) >= least), (1.0, "s"))


def lasting(seconds: float, digits: int = 8) -> str:
    """A time [s] with so many digits, in days or hours where it is long: `400 days`."""
    size, unit = time_unit(seconds)
    return f"{seconds / size:.{digits}g} {unit}"


def _rounded(value: float, how: Callable[[Any], Any]) -> str:
    if value <= 0:
        return "0"
    unit = 10.0 ** (math.floor(math.log10(value)) - 3)
    # A value of a whole number of units must not gain or lose one by the rounding of the division.
    return f"{how(round(value / unit, 2)) * unit:.10g}"
