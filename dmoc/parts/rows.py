"""A constraint row as the parts of a problem state it, and parts whose numbers may change between solves."""

from __future__ import annotations

import copy
import re
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from dmoc.basics.unknown import at, with_field


class Row(NamedTuple):
    """lower <= expression <= upper: dimensionless and of a size near 1, or in `unit`, "m" or "m/s"."""

    name: str
    expression: Any
    lower: float
    upper: float
    unit: str = ""


def built_in(part: Any) -> dict[str, Any]:
    """What a part has beside its adjustable fields."""
    return {name: value for name, value in vars(part).items() if name not in part.adjustable}


def title(part: Any, index: int) -> str:
    """A name for rows and numbers of a part: KeepOut, second in the list, is keep_out_2."""
    return f"{snake(type(part).__name__)}_{index + 1}"


def snake(name: str) -> str:
    """KeepOut: keep_out."""
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()


def with_symbols(part: Any, name: str) -> tuple[Any, list]:
    """A twin of a part whose adjustable fields are CasADi symbols, and those symbols."""
    twin, symbols = copy.copy(part), []
    for field, value in zip(part.adjustable, _values(part), strict=True):
        symbols.append(ca.SX.sym(f"{name}.{field}", value.size))
        twin = with_field(twin, field, symbols[-1])
    return twin, symbols


def alike(new: Any, old: Any) -> bool:
    """Whether two parts are equal but for the numbers in their adjustable fields."""
    if type(new) is not type(old) or new.adjustable != old.adjustable:
        return False
    for field in new.adjustable:
        new, old = with_field(new, field, None), with_field(old, field, None)
    return vars(new) == vars(old)


def values_of(part: Any) -> np.ndarray:
    """The numbers that stand for the symbols of `with_symbols`, in the same order."""
    return np.concatenate([*_values(part), np.empty(0)])


def _values(part: Any) -> list[np.ndarray]:
    return [np.ravel(np.asarray(at(part, field), float)) for field in part.adjustable]
