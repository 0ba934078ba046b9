"""Numbers in words: rounded to the side on which they are enough, and times in the unit a person would use."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

# Times are told in another unit from this least value on [s]: (least value, seconds of the unit, its name), the
# largest first. Three of a unit is where its own numbers become easier to imagine than those of the one below.
TIMES = ((3 * 86400.0, 86400.0, "days"), (3 * 3600.0, 3600.0, "h"))

# Values given in an SI unit are told in another one from this least value on: (least value, size of that unit,
# its name), the largest first.
UNITS = {
    "s": TIMES,
    "m": ((1e4, 1e3, "km"),),
    "m/s": ((1e4, 1e3, "km/s"), (1e-2, 1.0, "m/s"), (0.0, 1e-3, "mm/s")),
    "N": ((1e7, 1e6, "MN"), (1e4, 1e3, "kN"), (1e-2, 1.0, "N"), (0.0, 1e-3, "mN")),
    "N m": ((1e4, 1e3, "kN m"), (1e-2, 1.0, "N m"), (0.0, 1e-3, "mN m")),
    "J": ((1e10, 1e9, "GJ"), (1e7, 1e6, "MJ"), (1e4, 1e3, "kJ"), (1e-2, 1.0, "J"), (0.0, 1e-3, "mJ")),
    "J/kg": ((1e7, 1e6, "MJ/kg"), (1e4, 1e3, "kJ/kg")),
}
# The astronomical unit [m], exact by definition (IAU 2012).
ASTRONOMICAL_UNIT = 149_597_870_700.0
# Great lengths and masses are told in these.
GREAT = {
    "m": ((0.1 * ASTRONOMICAL_UNIT, ASTRONOMICAL_UNIT, "au"),),
    "kg": ((1e5, 1e3, "t"),),
}


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


def quantity(value: float, unit: str, digits: int = 4) -> str:
    """A value given in an SI unit, in the unit that a person would use: `1.2 au`, `36 mN`, `400 days`."""
    choices = (*GREAT.get(unit, ()), *UNITS.get(unit, ())) if value else ()
    size, name = next(((size, name) for least, size, name in choices if abs(value) >= least), (1.0, unit))
    return f"{value / size:.{digits}g} {name}".removesuffix(" -")


def _rounded(value: float, how: Callable[[Any], Any]) -> str:
    if value <= 0:
        return "0"
    unit = 10.0 ** (math.floor(math.log10(value)) - 3)
    # A value of a whole number of units must not gain or lose one by the rounding of the division.
    return f"{how(round(value / unit, 2)) * unit:.10g}"
