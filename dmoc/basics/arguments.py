"""Checks of user input: every message carries the value, the unit and the remedy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from dmoc.basics.plain import unbroken
from dmoc.basics.unknown import is_unknown

# A number may be this large [in its SI unit]: products of six of them still stay below 1e308, where floating
# point overflows, and nothing that moves comes near it.
LARGEST = 1e50
# A smaller number [in its SI unit] counts as 0, or is refused where 0 is: its products would underflow to 0.
SMALLEST = 1e-50
# A count of steps or repetitions may be this large: the path of more steps would not fit into memory.
MOST_COUNTED = 10_000_000
# Longer values are cut off in a message, which should fit on one line of a terminal [letters].
SHORT = 60

# A part takes one of these types for a vector; it holds the tuple that `vector` makes of it.
Vector = Sequence[float] | np.ndarray
# A boundary also takes None, for an entry that is free or for a vector whose entries are all free.
FreeVector = Sequence[float | None] | np.ndarray | None


def number(name: str, value: Any, unit: str, positive: bool = False, nonnegative: bool = False) -> float:
    """`value` as a finite float, or a ValueError that names it; an `Unknown` stays one."""
    try:
        result = math.nan if isinstance(value, (bool, np.bool_, str, bytes)) else float(value)
        several = np.ndim(value) > 0 if isinstance(value, np.ndarray) else False
    except Exception:
        # The conversion of a user's own object may raise anything.
        several = True
    if several:
        raise ValueError(f"{name} must be one number{_in(unit)}; got {short(value)}") from None
    if not math.isfinite(result):
        raise ValueError(f"{name} must be a finite number{_in(unit)}; got {short(value)}")
    if positive and result <= 0:
        raise ValueError(f"{name} must be greater than 0{_in(unit)}; got {result:g}")
    if nonnegative and result < 0:
        raise ValueError(f"{name} must not be negative{_in(unit)}; got {result:g}")
    if abs(result) > LARGEST or (positive and result < SMALLEST):
        raise ValueError(
            f"{name} must be of a size between {SMALLEST:g} and {LARGEST:g}{_in(unit)}; got {result:g}"
        )
    if is_unknown(value):
        return value
    return result if abs(result) >= SMALLEST else 0.0


def vector(name: str, value: Any, unit: str, free: bool = False) -> tuple:
    """`value` as a tuple of 1 to 3 finite floats; with free=True entries may be None."""
    parts = entries(value)
    parts = (value,) if parts is None else parts
    several = 1 <= len(parts) <= 3 and not isinstance(value, (str, bytes))
    if not several or any(entries(part) is not None for part in parts):
        raise ValueError(f"{name} must be 1 to 3 numbers{_in(unit)}; got {short(value)}")
    return tuple(
        None if free and part is None else number(f"{name}[{i}]", part, unit) for i, part in enumerate(parts)
    )


def endless_vector(name: str, value: Any, unit: str) -> tuple[float, ...]:
    """As `vector`, but entries may be -inf and inf."""
    given = entries(value)
    given = (value,) if given is None else given
    # `vector` refuses infinite numbers: they pass it as 0 and are put back afterwards.
    endless = {i for i, x in enumerate(given) if isinstance(x, (float, np.floating)) and abs(x) == np.inf}
    finite = vector(name, [0.0 if i in endless else x for i, x in enumerate(given)], unit)
    return tuple(float(given[i] if i in endless else x) for i, x in enumerate(finite))


def limits(name: str, value: Any, unit: str) -> float | tuple:
    """A positive number, or one positive number an axis."""
    if entries(value) is None:
        return number(name, value, unit, positive=True)
    return tuple(
        number(f"{name}[{i}]", entry, unit, positive=True) for i, entry in enumerate(vector(name, value, unit))
    )


def entries(value: Any) -> tuple | None:
    """The entries of a list, tuple, range or array; None for anything else."""
    if isinstance(value, np.ndarray):
        return tuple(value) if value.ndim else None
    return tuple(value) if isinstance(value, (list, tuple, range)) else None


def whole(name: str, value: Any, least: int = 1) -> int:
    """`value` as a whole number of at least `least` that a computer can count to, or a ValueError."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)) or value < least:
        raise ValueError(f"{name} must be a whole number of at least {least}; got {short(value)}")
    if value > MOST_COUNTED:
        raise ValueError(f"{name} must be at most {MOST_COUNTED:,}; got {short(value)}")
    return int(value)


def of_kind(name: str, value: Any, kind: type) -> Any:
    """`value` itself, or a ValueError that says what it should be."""
    if not isinstance(value, kind):
        home = "dmoc." if kind.__module__.startswith("dmoc.") else ""
        raise ValueError(f"{name} must be a {home}{kind.__name__}; got {short(value)}")
    return value


def flag(name: str, value: Any) -> bool:
    """`value` as a bool, or a ValueError that names it."""
    if not isinstance(value, (bool, np.bool_)):
        raise ValueError(f"{name} must be True or False; got {short(value)}")
    return bool(value)


def same_length(owner: str, **vectors) -> None:
    """ValueError unless all vectors have one length."""
    lengths = {name: len(value) for name, value in vectors.items()}
    if len(set(lengths.values())) > 1:
        listing = ", ".join(f"{name} has {length}" for name, length in lengths.items())
        raise ValueError(f"{owner}: {listing}; give all of them the same number of entries")


def matching_length(part: Any, argument: str, given: int, dimension: int) -> None:
    """ValueError unless an argument of a part has as many entries as the problem has dimensions."""
    if given != dimension:
        raise ValueError(
            f"{type(part).__name__}: {argument} has {given} entries but the problem has {dimension} "
            f"dimensions; give {dimension} entries"
        )


def checked(part: Any, **values: Any) -> None:
    """Set fields of a frozen dataclass from its `__post_init__`: the values given, after they were checked."""
    for name, value in values.items():
        # a frozen dataclass refuses an assignment, from its own methods too
        object.__setattr__(part, name, value)


def short(value: Any) -> str:
    """`value` as it is written, on one line that is not too long."""
    text = unbroken(repr(value))
    return text if len(text) <= SHORT else text[: SHORT - 3] + "..."


def times_each(value: float | Vector, factor: float) -> float | tuple[float, ...]:
    """A number, or each of several, times `factor`."""
    return factor * value if isinstance(value, (int, float)) else tuple(factor * float(each) for each in value)


def _in(unit: str) -> str:
    return f" [{unit}]" if unit else ""


def both_ends(span: Any) -> tuple[float, float]:
    """Shortest and longest of a duration, the same where it is one number."""
    return tuple(span) if isinstance(span, (tuple, list)) else (span, span)  # type: ignore[return-value]
