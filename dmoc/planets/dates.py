"""Dates as ISO text in barycentric dynamical time (TDB), as Julian dates, and seconds after them."""

from __future__ import annotations

from datetime import date, datetime, timedelta
from typing import Any

from dmoc.basics.arguments import short

DAY = 86400.0
# Julian date of midnight before the day that Python counts as 0 [days].
BEFORE_ALL = 1721424.5


def iso(epoch: Any) -> str:
    """A date or a date with a time as ISO text, whole: `2028-11-20T00:00:00`.

    Raises
    ------
    ValueError
        If it is none, or has a time zone.
    """
    return _parsed(epoch).isoformat()


def julian(epoch: str) -> tuple[float, float]:
    """The Julian date of an epoch at midnight before it, and the part of the day since [days].

    Two numbers, as one alone would round to 40 microseconds.
    """
    moment = _parsed(epoch)
    midnight = datetime(moment.year, moment.month, moment.day)
    return moment.toordinal() + BEFORE_ALL, (moment - midnight).total_seconds() / DAY


def date_of(julian_date: float) -> str:
    """The day of a Julian date, such as `2053-10-09`."""
    return date.fromordinal(int(julian_date - BEFORE_ALL)).isoformat()


def later(epoch: str, seconds: float) -> str:
    """ISO text of the time so many seconds after an epoch, to the microsecond.

    Raises
    ------
    ValueError
        If that is before the year 1 or after 9999.
    """
    try:
        return (_parsed(epoch) + timedelta(seconds=float(seconds))).isoformat()
    except OverflowError:
        raise ValueError(f"{seconds:g} s after {epoch} is no date of the years 1 to 9999") from None


def minutes_of(epoch: str, seconds: float) -> str:
    """The date so many seconds after an epoch, to the minute, such as `2028-11-20 07:15`."""
    moment = _parsed(later(epoch, seconds)) + timedelta(seconds=30)
    return moment.isoformat(sep=" ", timespec="minutes")


def _parsed(epoch: Any) -> datetime:
    if isinstance(epoch, date) and not isinstance(epoch, datetime):
        epoch = datetime(epoch.year, epoch.month, epoch.day)
    try:
        moment = epoch if isinstance(epoch, datetime) else datetime.fromisoformat(epoch)
    except (TypeError, ValueError):
        raise ValueError(
            f"epoch must be a date as ISO text, '2028-11-20' or '2028-11-20T06:30:00'; got {short(epoch)}"
        ) from None
    if moment.tzinfo is not None:
        raise ValueError(
            f"epoch is in barycentric dynamical time (TDB) and has no time zone; got {short(str(epoch))}"
        )
    return moment
