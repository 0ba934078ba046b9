"""CZML: paths for a globe in a browser, such as Cesium's."""

from __future__ import annotations

import json
from typing import Any

from dmoc.conversions.axes import equatorial, missing
from dmoc.conversions.stretches import Stretch, in_space, kind_of
from dmoc.planets.dates import later, utc_of

# Seconds that a scale of time is ahead of TAI.
AHEAD = {"TDB": 0.0, "TT": 0.0, "TAI": 32.184}
# Frames that turn with the Earth begin so.
FIXED = ("ITRF", "FIXED", "ECEF")
# The film of the whole path takes so long [s].
SHOWN = 60.0
COLORS = ([0, 114, 178, 255], [213, 94, 0, 255], [0, 158, 115, 255], [204, 121, 167, 255])


def czml_text(solution: Any, origin: Any) -> str:
    """A document and a packet a body, whose position has an interval a leg, with velocities [m], [m/s].

    The CZML Guide (AnalyticalGraphicsInc/czml-writer): `cartesianVelocity` and Hermite's polynomial of degree 3
    between two nodes. The globe is the Earth, times are UTC.

    Raises
    ------
    ValueError
        If epoch or frame are not known, the center is not the Earth, or a path is not that of a body in space.
    """
    missing(origin, "CZML", ("epoch", "frame"))
    if origin.center.lower() not in ("", "earth"):
        raise ValueError(
            f"CZML shows places about the Earth, and these are about {origin.center}: use oem, csv or json"
        )
    stretches = in_space(solution, "CZML")
    start = _utc(origin, float(stretches[0].time[0]))
    first = float(stretches[0].time[0])
    last = max(float(stretch.time[-1]) for stretch in stretches)
    span = f"{start}/{_utc(origin, last)}"
    clock = {"interval": span, "currentTime": start, "multiplier": (last - first) / SHOWN, "range": "LOOP_STOP"}
    name = solution.provenance.problem_name
    packets: list[dict[str, Any]] = [{"id": "document", "name": name, "version": "1.0", "clock": clock}]
    groups = [[one] for one in stretches] if kind_of(solution) == "body" else [stretches]
    for i, group in enumerate(groups):
        called = group[0].name if kind_of(solution) == "body" else name
        packets.append(_packet(called, span, group, origin, COLORS[i % len(COLORS)]))
    return json.dumps(packets, indent=1, allow_nan=False) + "\n"


def _packet(name: str, span: str, group: list[Stretch], origin: Any, color: list[int]) -> dict[str, Any]:
    paint = {"color": {"rgba": color}}
    return {
        "id": name,
        "name": name,
        "availability": span,
        "position": [_position(stretch, origin) for stretch in group],
        "point": {**paint, "pixelSize": 8},
        "path": {"material": {"solidColor": paint}, "width": 2},
        "label": {"text": name, "font": "12pt sans-serif", "pixelOffset": {"cartesian2": [12, 0]}},
    }


def _position(stretch: Stretch, origin: Any) -> dict[str, Any]:
    begin, end = (float(t) for t in (stretch.time[0], stretch.time[-1]))
    position, velocity = (equatorial(rows, origin.frame) for rows in (stretch.position, stretch.velocity))
    fixed = origin.frame.upper().startswith(FIXED)
    samples = [
        [float(x) for x in (t - begin, *q, *v)]
        for t, q, v in zip(stretch.time, position, velocity, strict=True)
    ]
    return {
        "interval": f"{_utc(origin, begin)}/{_utc(origin, end)}",
        "epoch": _utc(origin, begin),
        "referenceFrame": "FIXED" if fixed else "INERTIAL",
        "interpolationAlgorithm": "HERMITE",
        "interpolationDegree": 3,
        "cartesianVelocity": [x for sample in samples for x in sample],
    }


def _utc(origin: Any, seconds: float) -> str:
    """The date so many seconds after t = 0, as CZML writes it."""
    date = later(origin.epoch, seconds)
    return f"{date if origin.scale == 'UTC' else utc_of(later(date, AHEAD[origin.scale]))}Z"
