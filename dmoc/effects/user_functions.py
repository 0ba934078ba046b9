"""What a user gives to an effect: functions of CasADi symbols, tried before a solve, and fixed positions."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import vector
from dmoc.basics.plain import unbroken


def given_motion(owner: str, name: str, value: Any) -> Any:
    """A function of time that has been tried, or a fixed position as a tuple; else ValueError."""
    if not callable(value):
        return vector(f"{owner}: {name}", value, "m")
    remedy = (
        "it must take a CasADi time [s] and give 2 or 3 numbers [m]: write it with casadi's functions "
        "(casadi.cos, not math.cos), or give data as tabulated_motion(times, positions)"
    )
    entries = tried(f"{owner}: {name}", value, [ca.SX.sym("t")], remedy)
    if not 1 <= entries <= 3:
        raise ValueError(f"{owner}: {name} gives {entries} numbers; {remedy}")
    return value


def tried(name: str, function: Any, symbols: list, remedy: str) -> int:
    """How many entries a user's function of CasADi symbols gives; ValueError if it fails or gives only NaN."""
    column = evaluated(name, function, symbols, remedy)
    probe = ca.Function("probe", symbols, [ca.densify(ca.sum1(column))])
    # Python's own math functions may turn a symbol into NaN without an error. A good function may be undefined
    # at some of these places [s and m], but not at all of them
    places = [0.0, 0.37, 1.0, 1e3, 1e6]
    if all(np.isnan(float(probe(*[x] * len(symbols)))) for x in places):
        raise ValueError(f"{name} gives no number; {remedy}")
    return column.numel()


def evaluated(name: str, function: Any, symbols: list, remedy: str) -> Any:
    """The column that a user's function of CasADi symbols gives; ValueError if it fails or gives none."""
    try:
        column = as_column(function(*symbols))
        ca.Function("probe", symbols, [column])
    except Exception as error:
        raise ValueError(f"{name} fails ({unbroken(error)[:120]}); {remedy}") from error
    if not column.numel():
        raise ValueError(f"{name} gives nothing; {remedy}")
    return column


def position_at(motion: Any, t: Any, dimension: int) -> Any:
    """The position [m] of a motion, or a fixed one, as a column.

    In the plane a third entry that is zero is left out.
    """
    column = as_column(motion(t) if callable(motion) else motion)
    return column[:2] if dimension == 2 and column.numel() == 3 and column[2].is_zero() else column


def as_column(value: Any) -> Any:
    """A column of what a user's function gave: a CasADi matrix, an array or a list."""
    column = value if isinstance(value, (ca.SX, ca.MX, ca.DM)) else ca.vertcat(*np.atleast_1d(value).ravel())
    return ca.vec(column)


def is_zero(value: Any) -> bool:
    """Whether a number is 0; one that is a symbol is not."""
    return bool(ca.SX(value).is_zero())
