"""Dates as ISO text in barycentric dynamical time (TDB), as Julian dates, and seconds after them."""

from __future__ import annotations

from datetime import date, datetime, timedelta
from typing import Any

from dmoc.basics.arguments import short

DAY = 86400.0
# Days from which on TAI is so many whole seconds ahead of UTC, 10 on the first of them (IERS Bulletin C); no
# later one was announced by 2026.
LEAPS = (
    *[
        "1972-01-01",
        "1972-07-01",
        "1973-01-01",
        "1974-01-01",
        "1975-01-01",
        "1976-01-01",
        "1977-01-01",
        "1978-01-01",
    ],
    *[
        "1979-01-01",
        "1980-01-01",
        "1981-07-01",
        "1982-07-01",
        "1983-07-01",
        "1985-07-01",
        "1988-01-01",
        "1990-01-01",
    ],
    *[
        "1991-01-01",
        "1992-07-01",
        "1993-07-01",
        "1994-07-01",
        "1996-01-01",
        "1997-07-01",
        "1999-01-01",
        "2006-01-01",
    ],
    *["2009-01-01", "2012-07-01", "2015-07-01", "2017-01-01"],
)
FIRST_LEAPS = 10
# Seconds that TT, and within 2 ms TDB, is ahead of TAI.
TT_AHEAD = 32.184
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


def utc_of(epoch: str) -> str:
    """ISO text in UTC of an epoch in TDB, to 2 ms: TDB is taken for TT.

    Raises
    ------
    ValueError
        If it is before 1972, when UTC had no whole leap seconds.
    """
    for count, day in reversed(list(enumerate(LEAPS, FIRST_LEAPS))):
        utc = _parsed(later(epoch, -count - TT_AHEAD))
        if utc >= datetime.fromisoformat(day):
            return utc.isoformat()
    raise ValueError(f"there are no leap seconds of UTC for {epoch}: they begin with 1972")


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
