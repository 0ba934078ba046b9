"""Positions from an ephemeris of JPL: any SPK file (.bsp) that jplephem reads."""

from __future__ import annotations

import os
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dmoc.basics.plain import unbroken
from dmoc.planets.dates import date_of

# The environment variable that names the file of an ephemeris.
VARIABLE = "DMOC_EPHEMERIS"
# How the packages are installed that bring the default ephemeris and what reads it.
INSTALL = "pip install jplephem skyfield-data"
# NAIF's numbers of bodies, the planet itself before the barycentre of its system.
NUMBERS: dict[str, tuple[int, ...]] = {
    "solar system barycenter": (0,),
    "sun": (10,),
    "mercury": (199, 1),
    "venus": (299, 2),
    "earth-moon barycenter": (3,),
    "earth": (399,),
    "moon": (301,),
    "mars": (499, 4),
    "jupiter": (599, 5),
    "saturn": (699, 6),
    "uranus": (799, 7),
    "neptune": (899, 8),
    "pluto": (999, 9),
}
# NAIF's number of the frame of the ephemerides of JPL: ICRF, within 0.02 arc seconds the J2000 equator.
ICRF = 1


class Track(NamedTuple):
    """Where a body is: positions in ICRF at times, and what is known of them.

    Attributes
    ----------
    positions : array, shape (count, 3)
        [m]
    body : str
        Its name, with a word where it is a barycentre instead.
    source : str
        What the positions are from.
    """

    positions: np.ndarray
    body: str
    source: str


def default_file() -> Path | None:
    """The ephemeris of the environment, else DE421 of the package skyfield-data; None without the packages."""
    if named := os.environ.get(VARIABLE):
        return Path(named)
    # importing the package would warn of its table of the Earth's turning, which is not used here
    found = find_spec("skyfield_data")
    if found is None or found.origin is None or find_spec("jplephem") is None:
        return None
    file = Path(found.origin).parent / "data" / "de421.bsp"
    return file if file.is_file() else None


def track(file: Path, body: str, center: str, day: float, parts: np.ndarray) -> Track:
    """Positions of a body as seen from a center, by an SPK file.

    Parameters
    ----------
    file : path
    body, center : str
        Names, see `NUMBERS`; or NAIF's number of anything in the file, as text.
    day : float
        Julian date (TDB) [days].
    parts : array, shape (count,)
        Times after it [days], increasing.

    Raises
    ------
    ValueError
        If the file cannot be read, has no such body, or does not cover these times.
    """
    if find_spec("jplephem") is None:
        raise ValueError(f"reading the ephemeris {file} needs the package jplephem: {INSTALL}")
    from jplephem.exceptions import OutOfRangeError
    from jplephem.spk import SPK

    if not file.is_file():
        raise ValueError(f"there is no ephemeris file {file}; give the path of a .bsp file")
    try:
        kernel = SPK.open(str(file))
    except Exception as error:  # what a file that is none raises depends on its bytes
        raise ValueError(f"{file} is no SPK file that jplephem reads: {unbroken(error)[:80]}") from error
    try:
        segments = list(kernel.segments)
        ends, names, numbers = [], [], []
        for name in (body, center):
            number = _number_in(segments, name, file)
            root, place = _place(segments, number, day, parts, (name, file))
            ends.append((root, place))
            numbers.append(number)
            names.append(_called(name, number))
    except OutOfRangeError as error:
        raise ValueError(f"{file} does not cover these times: {unbroken(error)}") from error
    finally:
        kernel.close()
    (root, place), (other, origin) = ends
    if root != other:
        raise ValueError(f"{file} does not say where {body} is from {center}: nothing in it joins the two")
    return Track((place - origin) * 1e3, names[0], _title(segments, file))


def _number_in(segments: Sequence[Any], name: str, file: Path) -> int:
    """The number of a body that the file has; a planet itself before its barycentre."""
    wanted = NUMBERS.get(name) or (int(name),)
    known = {segment.target for segment in segments} | {segment.center for segment in segments}
    for number in wanted:
        if number in known:
            return number
    there = [other for other, numbers in NUMBERS.items() if set(numbers) & known]
    raise ValueError(f"{file} has no {name}; it has {', '.join(there) or 'none of the planets'}")


def _place(
    segments: Sequence[Any], number: int, day: float, parts: np.ndarray, told: tuple[str, Path]
) -> tuple[int, np.ndarray]:
    """Where a body is [km] from what the segments lead to in the end, and the number of that."""
    place = np.zeros((len(parts), 3))
    first, last = day + parts[0], day + parts[-1]
    for _ in range(len(segments)):
        about = [segment for segment in segments if segment.target == number]
        if not about:
            break
        # of segments that cover a time the last one counts
        good = [one for one in about if one.start_jd <= first and last <= one.end_jd]
        if not good:
            reach = ", ".join(f"{date_of(one.start_jd)} to {date_of(one.end_jd)}" for one in about)
            raise ValueError(
                f"{told[1].name} covers {told[0]} from {reach}, not from {date_of(first)} to {date_of(last)}; "
                "change epoch, start or duration, or give another ephemeris"
            )
        if good[-1].frame != ICRF:
            raise ValueError(
                f"{told[1]} gives {told[0]} in frame {good[-1].frame} of NAIF; only 1 (ICRF) is known"
            )
        place += np.transpose(good[-1].compute(day, parts))[:, :3]
        number = good[-1].center
    return number, place


def _called(name: str, number: int) -> str:
    barycentre = 1 <= number <= 9 and name in NUMBERS and NUMBERS[name][0] != number
    return f"{name} (barycentre of its system)" if barycentre else name


def _title(segments: Sequence[Any], file: Path) -> str:
    """Such as `DE421 (de421.bsp)`, where a file says what it is."""
    text = segments[0].source.decode("ascii", "replace").strip() if segments else ""
    head = text.split("LE-")[0]
    return f"DE{head[3:].lstrip('0')}" if head.startswith("DE-") and head[3:].isdigit() else file.name
