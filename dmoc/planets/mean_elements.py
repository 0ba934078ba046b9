"""Where the planets are by their mean elements: a formula for the years 1800 to 2050, without any data.

E. M. Standish, Keplerian Elements for Approximate Positions of the Major Planets (JPL, 1992, revised
2006, table 1). Each planet goes on an ellipse whose elements are linear in time, fitted to the years 1800
to 2050: where the planets pull at each other is left out. `ERRORS` has how far that is off.
"""

from __future__ import annotations

import numpy as np

from dmoc.planets.dates import date_of
from dmoc.planets.ephemeris import INSTALL, Track

# Astronomical unit [m].
AU = 149597870700.0
# Julian date of the epoch J2000, and days of a Julian century.
J2000, CENTURY = 2451545.0, 36525.0
# Julian dates of the first days of 1800 and of 2051, between which the elements are meant to be used.
FIRST, LAST = 2378496.5, 2470172.5

# At J2000 and their rates a century: a [AU], e, I [deg], mean longitude, longitudes of perihelion and node.
ELEMENTS = {
    "mercury": (
        (0.38709927, 0.20563593, 7.00497902, 252.25032350, 77.45779628, 48.33076593),
        (0.00000037, 0.00001906, -0.00594749, 149472.67411175, 0.16047689, -0.12534081),
    ),
    "venus": (
        (0.72333566, 0.00677672, 3.39467605, 181.97909950, 131.60246718, 76.67984255),
        (0.00000390, -0.00004107, -0.00078890, 58517.81538729, 0.00268329, -0.27769418),
    ),
    "earth-moon barycenter": (
        (1.00000261, 0.01671123, -0.00001531, 100.46457166, 102.93768193, 0.0),
        (0.00000562, -0.00004392, -0.01294668, 35999.37244981, 0.32327364, 0.0),
    ),
    "mars": (
        (1.52371034, 0.09339410, 1.84969142, -4.55343205, -23.94362959, 49.55953891),
        (0.00001847, 0.00007882, -0.00813131, 19140.30268499, 0.44441088, -0.29257343),
    ),
    "jupiter": (
        (5.20288700, 0.04838624, 1.30439695, 34.39644051, 14.72847983, 100.47390909),
        (-0.00011607, -0.00013253, -0.00183714, 3034.74612775, 0.21252668, 0.20469106),
    ),
    "saturn": (
        (9.53667594, 0.05386179, 2.48599187, 49.95424423, 92.59887831, 113.66242448),
        (-0.00125060, -0.00050991, 0.00193609, 1222.49362201, -0.41897216, -0.28867794),
    ),
    "uranus": (
        (19.18916464, 0.04725744, 0.77263783, 313.23810451, 170.95427630, 74.01692503),
        (-0.00196176, -0.00004397, -0.00242939, 428.48202785, 0.40805281, 0.04240589),
    ),
    "neptune": (
        (30.06992276, 0.00859048, 1.77004347, -55.12002969, 44.96476227, 131.78422574),
        (0.00026291, 0.00005105, 0.00035372, 218.45945325, -0.32241464, -0.00508664),
    ),
}
# The largest distance from DE421 over the years 1900 to 2050 [km], rounded up; the Earth is put at the
# barycentre of Earth and Moon, which counts.
ERRORS = {
    "mercury": 8_000,
    "venus": 16_000,
    "earth-moon barycenter": 18_000,
    "earth": 23_000,
    "mars": 110_000,
    "jupiter": 2_000_000,
    "saturn": 5_500_000,
    "uranus": 1_800_000,
    "neptune": 1_800_000,
}
# The Earth has no elements of its own.
STANDS_FOR = {"earth": "earth-moon barycenter"}


def track(body: str, center: str, day: float, parts: np.ndarray) -> Track:
    """Positions of a planet as seen from the Sun or from another planet; arguments as of an ephemeris.

    Raises
    ------
    ValueError
        If there are no elements of a body, or not for these times.
    """
    for name in (body, center):
        if name != "sun" and STANDS_FOR.get(name, name) not in ELEMENTS:
            raise ValueError(
                f"there are no mean elements of {name}; they are of {', '.join(ELEMENTS)} and the sun: "
                f"{INSTALL} brings an ephemeris with more"
            )
    if day + parts[0] < FIRST or day + parts[-1] > LAST:
        raise ValueError(
            f"mean elements are good from {date_of(FIRST)} to {date_of(LAST)}, not from "
            f"{date_of(day + parts[0])} to {date_of(day + parts[-1])}; change epoch, start or duration, or "
            "give an ephemeris"
        )
    centuries = ((day - J2000) + parts) / CENTURY
    here, there = (_from_sun(name, centuries) for name in (body, center))
    error = sum(ERRORS[name] for name in (body, center) if name != "sun")
    return Track(here - there, body, f"mean elements, within {error:,} km")


def _from_sun(body: str, centuries: np.ndarray) -> np.ndarray:
    """Positions [m] from the Sun in the J2000 ecliptic, shape (count, 3)."""
    if body == "sun":
        return np.zeros((len(centuries), 3))
    start, slope = (np.array(row)[:, None] for row in ELEMENTS[STANDS_FOR.get(body, body)])
    a, e, i, longitude, perihelion, node = start + slope * centuries
    i, mean, argument, node = np.radians([i, longitude - perihelion, perihelion - node, node])
    mean = np.remainder(mean + np.pi, 2 * np.pi) - np.pi
    anomaly = mean + e * np.sin(mean)
    # Newton's method doubles the digits: at e = 0.2 six iterations are more than enough
    for _ in range(6):
        anomaly -= (anomaly - e * np.sin(anomaly) - mean) / (1 - e * np.cos(anomaly))
    along, across = a * (np.cos(anomaly) - e), a * np.sqrt(1 - e * e) * np.sin(anomaly)
    (cn, sn), (cw, sw), (ci, si) = ((np.cos(angle), np.sin(angle)) for angle in (node, argument, i))
    toward = cn * cw - sn * sw * ci, sn * cw + cn * sw * ci, sw * si
    ahead = -cn * sw - sn * cw * ci, -sn * sw + cn * cw * ci, cw * si
    return AU * np.stack([x * along + y * across for x, y in zip(toward, ahead, strict=True)], axis=1)
