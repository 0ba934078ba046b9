"""CCSDS orbit ephemeris messages (OEM) as text."""

from __future__ import annotations

from datetime import UTC, datetime
from itertools import pairwise
from typing import Any

from dmoc.conversions.axes import ECLIPTIC, equatorial, missing
from dmoc.conversions.stretches import Stretch, in_space, kind_of
from dmoc.planets.dates import later

KM = 1e-3


def oem_text(solution: Any, origin: Any) -> str:
    """An OEM in key-value notation, a segment a leg: states at all nodes [km], [km/s].

    Orbit Data Messages, CCSDS 502.0-B-2 (2009), section 5. The frames that it names have no ecliptic, so that
    one is turned to ICRF. Between two states Hermite's polynomial of degree 3 is asked for: states have
    velocities, and nodes lie unevenly. Impulses, for which an OEM has no word, are told in comments.

    Raises
    ------
    ValueError
        If epoch, frame or center are not known, or the path is not that of one body in space.
    """
    if kind_of(solution) == "body":
        raise ValueError("an OEM is of one body; convert solution.of(name), or use csv, json or czml for all")
    missing(origin, "an OEM", ("epoch", "frame", "center"))
    from dmoc import __version__

    lines = [
        "CCSDS_OEM_VERS = 2.0",
        f"COMMENT dmoc {__version__}, problem {solution.provenance.problem_name}",
        *_impulses(solution, origin),
        f"CREATION_DATE = {datetime.now(UTC).strftime('%Y-%m-%dT%H:%M:%S')}",
        "ORIGINATOR = DMOC",
    ]
    for stretch in in_space(solution, "an OEM"):
        lines += ["", *_segment(stretch, solution.provenance.problem_name, origin)]
    return "\n".join(lines) + "\n"


def _segment(stretch: Stretch, name: str, origin: Any) -> list[str]:
    dates = [_date(origin.epoch, t) for t in stretch.time]
    for before, after in pairwise(dates):
        if before >= after:
            raise ValueError(
                f"an OEM tells times by microseconds, but two nodes of {stretch.name} are both at {after}: use "
                "csv or json"
            )
    comment = [f"COMMENT {stretch.name}"] * (stretch.name != name)
    turned = ["COMMENT turned from the ecliptic of J2000"] * (origin.frame == ECLIPTIC)
    meta = {
        "OBJECT_NAME": name.upper(),
        "OBJECT_ID": name.upper(),
        "CENTER_NAME": origin.center.upper(),
        "REF_FRAME": "ICRF" if origin.frame == ECLIPTIC else origin.frame.upper(),
        "TIME_SYSTEM": origin.scale,
        "START_TIME": dates[0],
        "STOP_TIME": dates[-1],
        "INTERPOLATION": "HERMITE",
        "INTERPOLATION_DEGREE": "3",
    }
    position = KM * equatorial(stretch.position, origin.frame)
    velocity = KM * equatorial(stretch.velocity, origin.frame)
    states = [
        " ".join([date, *(f"{x:.15e}" for x in (*q, *v))])
        for date, q, v in zip(dates, position, velocity, strict=True)
    ]
    return [
        "META_START",
        *comment,
        *turned,
        *(f"{key} = {value}" for key, value in meta.items()),
        "META_STOP",
        *states,
    ]


def _impulses(solution: Any, origin: Any) -> list[str]:
    found = []
    for kick in getattr(solution, "impulses", ()):
        change = KM * equatorial(kick.change[None, :3], origin.frame)[0]
        words = " ".join(f"{x:.15e}" for x in change)
        found.append(f"COMMENT impulse at {kick.joint}, {_date(origin.epoch, kick.time)}, {words} km/s")
    return found


def _date(epoch: str, seconds: float) -> str:
    """ISO text that always has microseconds, so that it sorts and lines up."""
    return datetime.fromisoformat(later(epoch, seconds)).isoformat(timespec="microseconds")
