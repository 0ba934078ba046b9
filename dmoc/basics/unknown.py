"""A number that stays a symbol where formulas are written down: an unknown, or one that may change later."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from dmoc.basics.plain import LONGEST, unbroken


class Unknown(float):
    """A number of a problem that is not known well.

    It is a number like any other, with the value that is thought to be right. `identify` finds it from a
    flight; in the effects of a problem it is a parameter of the optimisation, which takes another value without
    a rebuild, and an argument of exported functions. Arithmetic with it gives a plain number.

    Parameters
    ----------
    value : float or sequence of float
        What it is thought to be, in the unit of the number it stands for; of a sequence a tuple of unknowns.
    sigma : float or sequence of float, optional
        Standard deviation of that belief; without it nothing is known but the value to begin with.

    Raises
    ------
    ValueError
        If a value is not finite or a standard deviation is not positive.
    """

    sigma: float | None

    def __new__(cls, value: Any, sigma: Any = None) -> Any:
        if _is_several(value):
            each = sigma if _is_several(sigma) else [sigma] * len(value)
            if len(each) != len(value):
                raise ValueError(
                    f"Unknown has {len(value)} values but {len(each)} standard deviations; give one each"
                )
            return tuple(cls(one, spread) for one, spread in zip(value, each, strict=True))
        made = super().__new__(cls, _finite("value", value))
        made.sigma = None if sigma is None else _finite("sigma", sigma)
        if made.sigma is not None and made.sigma <= 0:
            raise ValueError(
                f"Unknown: sigma must be greater than 0; got {made.sigma:g}: leave it out if nothing is known"
            )
        return made

    def __getnewargs__(self) -> tuple:
        return float(self), self.sigma

    def __repr__(self) -> str:
        known = "" if self.sigma is None else f", sigma={self.sigma!r}"
        return f"Unknown({float(self)!r}{known})"


def _is_several(value: Any) -> bool:
    return isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim > 0)


def _finite(name: str, value: Any) -> float:
    try:
        found = math.nan if isinstance(value, (bool, str, bytes)) else float(value)
    except Exception:  # whatever a user's object raises
        found = math.nan
    if not math.isfinite(found):
        raise ValueError(f"Unknown: {name} must be a finite number; got {unbroken(repr(value))[:LONGEST]}")
    return found


def is_number(value: Any) -> bool:
    """Whether a value is a number or a tuple of numbers, of which some may be left free as None."""
    entries = value if isinstance(value, tuple) else (value,)
    numeric = [isinstance(entry, (int, float)) and not isinstance(entry, bool) for entry in entries]
    return any(numeric) and all(known or entry is None for known, entry in zip(numeric, entries, strict=True))


def numeric_fields(part: Any) -> Iterator[str]:
    """The fields of a part that hold numbers or rows of them; those of a part in it as `air.density`."""
    for one in fields(part) if is_dataclass(part) else ():
        value = getattr(part, one.name)
        rows = (
            type(value) is tuple and bool(value) and all(type(row) is tuple and is_number(row) for row in value)
        )
        if rows or is_number(value):
            yield one.name
        elif hasattr(value, "adjustable"):
            yield from (f"{one.name}.{inner}" for inner in numeric_fields(value))


def open_fields(part: Any) -> tuple[str, ...]:
    """Those of its `numeric_fields` that hold an `Unknown`."""
    return tuple(name for name in numeric_fields(part) if has_unknown(at(part, name)))


def is_unknown(value: Any) -> bool:
    return isinstance(value, Unknown)


def has_unknown(value: Any) -> bool:
    """Whether a number is unknown, or one of the numbers in a tuple."""
    return any(map(has_unknown, value)) if isinstance(value, tuple) else is_unknown(value)


def at(part: Any, name: str) -> Any:
    """A field of a part, or of a part in it."""
    for one in name.split("."):
        part = getattr(part, one)
    return part


def with_field(part: Any, name: str, value: Any) -> Any:
    """A copy with another value in a field, without the checks of its constructor."""
    first, _, rest = name.partition(".")
    twin = copy.copy(part)
    # The twin is frozen, and its constructor would refuse a symbol: the field is set past both.
    object.__setattr__(twin, first, with_field(getattr(part, first), rest, value) if rest else value)
    return twin


def opened(part: Any, names: Sequence[str]) -> Any:
    """A copy whose fields of these names hold unknowns."""
    for name in names:
        value = at(part, name)
        unknown = (
            tuple(x if x is None else Unknown(x) for x in value) if type(value) is tuple else Unknown(value)
        )
        part = with_field(part, name, unknown)
    return part
