"""Checks of user input: every message carries the value, the unit and the remedy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def number(name: str, value: Any, unit: str, positive: bool = False, nonnegative: bool = False) -> float:
    """`value` as a finite float, or a ValueError that names it."""
    try:
        result = float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be one number{_in(unit)}; got {_short(value)}") from None
    if isinstance(value, (bool, str)) or not math.isfinite(result):
        raise ValueError(f"{name} must be a finite number{_in(unit)}; got {_short(value)}")
    if positive and result <= 0:
        raise ValueError(f"{name} must be greater than 0{_in(unit)}; got {result:g}")
    if nonnegative and result < 0:
        raise ValueError(f"{name} must not be negative{_in(unit)}; got {result:g}")
    return result


def vector(name: str, value: Any, unit: str, free: bool = False) -> tuple:
    """`value` as a tuple of 1 to 3 finite floats; with free=True entries may be None."""
    if isinstance(value, str):
        raise ValueError(f"{name} must be 1 to 3 numbers{_in(unit)}; got {_short(value)}")
    try:
        entries = tuple(np.atleast_1d(np.asarray(value, dtype=object)))
    except (TypeError, ValueError):
        entries = ()
    if not 1 <= len(entries) <= 3 or any(np.ndim(entry) for entry in entries):
        raise ValueError(f"{name} must be 1 to 3 numbers{_in(unit)}; got {_short(value)}")
    return tuple(
        None if free and entry is None else number(f"{name}[{i}]", entry, unit)
        for i, entry in enumerate(entries)
    )


def limits(name: str, value: Any, unit: str) -> float | tuple:
    """A positive number, or one positive number an axis."""
    if np.ndim(value) == 0:
        return number(name, value, unit, positive=True)
    return tuple(
        number(f"{name}[{i}]", entry, unit, positive=True) for i, entry in enumerate(vector(name, value, unit))
    )


def same_length(owner: str, **vectors) -> None:
    """ValueError unless all vectors have one length."""
    lengths = {name: len(value) for name, value in vectors.items()}
    if len(set(lengths.values())) > 1:
        listing = ", ".join(f"{name} has {length}" for name, length in lengths.items())
        raise ValueError(f"{owner}: {listing}; give all of them the same number of entries")


def _in(unit: str) -> str:
    return f" [{unit}]" if unit else ""


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
