"""Where a planet is at real dates, as a motion for `Moving`, `ThirdBody`, `Flyby` and the like."""

from __future__ import annotations

import os
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np

from dmoc.basics.arguments import checked, number, short
from dmoc.basics.files import as_path
from dmoc.basics.records import dataclass
from dmoc.effects.base import Part
from dmoc.effects.motion import TabulatedMotion, tabulated_motion
from dmoc.planets import ephemeris as files
from dmoc.planets import mean_elements
from dmoc.planets.dates import DAY, iso, julian, later
from dmoc.planets.ephemeris import INSTALL, NUMBERS, Track

# What stands for the mean elements where a file may be named.
MEAN = "mean elements"
# Obliquity of the ecliptic at J2000 [rad]: 84381.448 arc seconds (IAU 1976), as in NAIF's frame ECLIPJ2000.
OBLIQUITY = np.radians(84381.448 / 3600)
# Frames by their names, and how they are called in files.
FRAMES = {"ecliptic": "ECLIPJ2000", "icrf": "ICRF"}
# The spline through a table may be off by this, where nothing is known [m].
ERROR = 1e3
# Spacings of a table that are tried [days], and the most times that a table may have.
SPACINGS = (32.0, 16.0, 8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.125, 0.0625)
MOST_TIMES = 100_000
# Numbers of NAIF are whole numbers of 32 bits.
LARGEST = 2**31


def planet(
    name: str | int,
    epoch: Any,
    frame: str = "ecliptic",
    center: str | int = "sun",
    start: float = 0.0,
    duration: float = 1000 * DAY,
    ephemeris: str | os.PathLike | None = None,
) -> PlanetMotion:
    """A planet at real dates: its position as a function of the seconds since an epoch.

    The positions are those of an ephemeris of JPL in a table, as close as it takes for the cubic spline
    through it to be off by less than 1 km in the middle between its times; velocity and acceleration are
    continuous. They are geometric: without light time.

    Without the packages that `pip install jplephem skyfield-data` brings they are from mean elements, for
    the years 1800 to 2050, as far from the ephemeris as 8,000 km (Mercury), 16,000 (Venus), 23,000 (Earth, put
    at the barycentre of Earth and Moon), 110,000 (Mars), 2,000,000 (Jupiter), 5,500,000 (Saturn), 1,800,000
    (Uranus, Neptune), measured from 1900 to 2050. The scene says so.

    Parameters
    ----------
    name : str or int
        sun, mercury, venus, earth, moon, earth-moon barycenter, mars, jupiter, saturn, uranus, neptune, pluto
        or solar system barycenter; or NAIF's number of anything that the ephemeris has. Where it has only the
        barycentre of a planet and its moons, as DE421 from Jupiter on, that is taken and said.
    epoch : str or datetime
        The date of t = 0 in barycentric dynamical time (TDB), which is 69 s ahead of UTC in the 2020s: ISO
        text such as "2028-11-20" or "2028-11-20T06:30:00".
    frame : str
        "ecliptic" and mean equinox of J2000, or "icrf", the equator of J2000.
    center : str or int
        The body at the origin.
    start, duration : float
        First time of the table after the epoch and its length [s]; 1,000 days. A scene that may last longer is
        refused.
    ephemeris : path, optional
        An SPK file (.bsp), read by jplephem; "mean elements" for those. None: what the environment variable
        DMOC_EPHEMERIS names, else DE421 of the package skyfield-data (1899-07-29 to 2053-10-09).

    Returns
    -------
    PlanetMotion
        A function of the time [s] that gives the position [m], 3 entries.

    Raises
    ------
    ValueError
        If the epoch is no date, a name is not known, the file cannot be read, or it does not cover the span;
        with its dates.

    References
    ----------
    W. M. Folkner, J. G. Williams, D. H. Boggs, The Planetary and Lunar Ephemeris DE 421, IPN Progress
    Report 42-178 (2009). E. M. Standish, Keplerian Elements for Approximate Positions of the Major
    Planets (JPL, 1992), table 1.
    """
    body, origin = _known("name", name), _known("center", center)
    if body == origin:
        raise ValueError(f"the center is {body} itself: it is always at the origin; give another center")
    if not isinstance(frame, str) or frame not in FRAMES:
        raise ValueError(f"frame must be {' or '.join(map(repr, FRAMES))}; got {short(frame)}")
    epoch = iso(epoch)
    start = number("start", start, "s")
    duration = number("duration", duration, "s", positive=True)
    for seconds in (start, start + duration):
        later(epoch, seconds)
    file = _file(ephemeris)
    day, part = julian(epoch)

    def seen(times: np.ndarray) -> Track:
        parts = part + times / DAY
        if file is None:
            known, native = mean_elements.track(body, origin, day, parts), "ecliptic"
        else:
            known, native = files.track(file, body, origin, day, parts), "icrf"
        return known._replace(positions=turned(known.positions, native, frame))

    table, known = _table(seen, body, start, duration)
    span = start, start + duration
    return PlanetMotion(known.body, epoch, frame, origin, known.source, file is None, span, table)


@dataclass(frozen=True)
class PlanetMotion(Part):
    """A planet at real dates; made by `planet`.

    Parameters
    ----------
    body : str
        Its name, and whether its barycentre is meant.
    epoch : str
        ISO text of t = 0 (TDB).
    frame, center : str
        "ecliptic" or "icrf", and the body at the origin.
    source : str
        The ephemeris, or mean elements with their error.
    rough : bool
        Whether the positions are from mean elements.
    span : (float, float)
        First and last time of the table [s].
    table : TabulatedMotion
        Its positions.
    """

    body: str
    epoch: str
    frame: str
    center: str
    source: str
    rough: bool
    span: tuple[float, float]
    table: TabulatedMotion = field(repr=False)

    def __post_init__(self) -> None:
        checked(self, span=tuple(map(float, self.span)))

    def __call__(self, t: Any) -> Any:
        return self.table(t)

    @property
    def frame_name(self) -> str:
        """The frame as it is called in files."""
        return FRAMES[self.frame]

    @property
    def title(self) -> str:
        """What it is and what that is known from, such as `mars (DE421)`."""
        return f"{self.body} ({self.source})"

    @property
    def remedy(self) -> str:
        """What brings better positions; empty where these are those of an ephemeris."""
        return f"{INSTALL} brings an ephemeris" if self.rough else ""

    def _numbers(self) -> list[str]:
        return [self.body, f"seen from {self.center}", f"epoch {self.epoch}", self.source]


def _known(argument: str, value: Any) -> str:
    """The name of a body in lower case, or NAIF's number of it as text."""
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) < LARGEST:
        return next((name for name, numbers in NUMBERS.items() if numbers[0] == value), str(value))
    found = value.lower().strip() if isinstance(value, str) else ""
    if found not in NUMBERS:
        raise ValueError(
            f"{argument} must be one of {', '.join(NUMBERS)}, or a number of NAIF; got {short(value)}"
        )
    return found


def _file(given: Any) -> Path | None:
    """The file of the ephemeris; None for mean elements."""
    if given is None:
        return files.default_file()
    if isinstance(given, str) and given == MEAN:
        return None
    if not isinstance(given, (str, os.PathLike)):
        raise ValueError(f"ephemeris must be the path of a .bsp file, {MEAN!r} or None; got {short(given)}")
    return as_path(given)


def turned(positions: np.ndarray, native: str, frame: str) -> np.ndarray:
    """Rows of 3 in the frame that is asked for, turned from their own one about the equinox."""
    if native == frame:
        return positions
    angle = OBLIQUITY if frame == "ecliptic" else -OBLIQUITY
    c, s = np.cos(angle), np.sin(angle)
    return positions @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]).T


def _table(seen: Any, name: str, start: float, duration: float) -> tuple[TabulatedMotion, Track]:
    """The widest table whose spline is right to `ERROR` half-way between its times."""
    off = np.inf
    for spacing in SPACINGS:
        count = max(3, int(np.ceil(duration / (spacing * DAY)))) + 1
        if count > MOST_TIMES:
            break
        times = start + duration * np.linspace(0.0, 1.0, count)
        if (np.diff(times) <= 0).any():
            raise ValueError(
                f"a duration of {duration:g} s is too short to tell times apart; give a longer one"
            )
        known = seen(times)
        table = tabulated_motion(times, known.positions)
        middle = 0.5 * (times[1:] + times[:-1])
        off = float(np.abs(table.at(middle) - seen(middle).positions).max())
        if off < ERROR / np.sqrt(3):
            return table, known
    raise ValueError(
        f"{name} moves too fast for a table of {duration / DAY:g} days: between the times of one with at "
        f"most {MOST_TIMES:,} it is off by {off:.3g} m, more than {ERROR:g}; give a shorter duration or "
        "another center"
    )
