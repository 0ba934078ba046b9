"""Write a solution for other programs: as a table, a CCSDS OEM or a CZML."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from pathlib import Path
from typing import Any, NamedTuple

from dmoc.basics.arguments import short
from dmoc.basics.files import as_path, whole_file
from dmoc.basics.plain import finite
from dmoc.conversions.czml import czml_text
from dmoc.conversions.oem import oem_text
from dmoc.conversions.stretches import kind_of, stretches_of
from dmoc.planets.dates import iso, later
from dmoc.results.solution import Outcome

# Scales of time that a date may be in.
SCALES = ("TDB", "TT", "TAI", "UTC")


class Origin(NamedTuple):
    """What times and places count from; empty where it is not known."""

    epoch: str
    frame: str
    center: str
    scale: str


def convert(
    solution: Any,
    path: str | os.PathLike,
    to: str | None = None,
    epoch: Any = None,
    frame: str | None = None,
    center: str | None = None,
    time_system: str | None = None,
) -> Path:
    """Write a solution as csv, json, oem or czml, whole or not at all.

    csv and json have every node: time, position, velocity (from the discrete momenta at the step ends, of the
    step's polynomial inside), force, controls, mass and, of a body that turns, attitude, rate and torque; names
    with units, a column or an object for the leg or the body. An OEM (CCSDS 502.0-B, KVN) has a segment a leg,
    in km and km/s; CZML a packet a body, in m. In both the J2000 ecliptic is turned to ICRF.

    Parameters
    ----------
    solution : Solution, MissionSolution or TeamSolution
    path : path
        Where to; an existing file is replaced.
    to : str, optional
        "csv", "json", "oem" or "czml"; what the file's name ends in if it is not given.
    epoch : str or datetime, optional
        Date of t = 0, for an OEM or CZML of a scene that has none; a scene with a `planet` has one.
    frame, center : str, optional
        Axes and body at the origin, by the names of CCSDS, such as "EME2000" and "EARTH"; in CZML a frame that
        turns with the Earth is "ITRF" or "FIXED", any other one is inertial.
    time_system : str, optional
        Scale of the epoch: "TDB", "TT", "TAI" or "UTC". TDB if it is not given.

    Returns
    -------
    Path

    Raises
    ------
    ValueError
        If the format is not known or cannot hold the path, or the epoch, frame or center is missing or given
        twice.
    """
    if not isinstance(solution, Outcome):
        raise ValueError(f"solution must be a dmoc.Solution, of a mission or a team too; got {short(solution)}")
    target = as_path(path)
    form = target.suffix[1:].lower() if to is None else to
    if not isinstance(form, str) or form not in FORMS:
        given = f"the name {target.name}" if to is None else short(to)
        raise ValueError(f"a solution is written as {', '.join(FORMS)}; got {given}: say which with to")
    origin = _origin(solution, epoch, frame, center, time_system)
    text = FORMS[form](solution, origin)
    with whole_file(target) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="")
    return target


def _origin(solution: Any, epoch: Any, frame: Any, center: Any, scale: Any) -> Origin:
    """What the scene knows, else what was given."""
    about = solution.provenance
    given = {"epoch": None if epoch is None else iso(epoch), "frame": frame, "center": center}
    for name, value in given.items():
        known = getattr(about, name)
        if value is not None and not (isinstance(value, str) and value.strip() and value.isprintable()):
            raise ValueError(f"{name} must be a word; got {short(value)}")
        if known and value is not None and value.upper() != known.upper():
            raise ValueError(f"the scene has the {name} {known} already; leave {name} out")
    if scale is not None and not (isinstance(scale, str) and scale in SCALES):
        raise ValueError(f"time_system must be {', '.join(SCALES)}; got {short(scale)}")
    if about.epoch and scale not in (None, "TDB"):
        raise ValueError("the scene counts time in TDB already; leave time_system out")
    found = {name: getattr(about, name) or value or "" for name, value in given.items()}
    return Origin(found["epoch"], found["frame"].upper(), found["center"], scale or "TDB")


def _table_text(solution: Any, origin: Origin) -> str:
    """A line a node below one with the names."""
    kind, stretches = kind_of(solution), stretches_of(solution)
    names = list(dict.fromkeys(name for stretch in stretches for name in stretch.columns))
    dated = [f"date ({origin.scale})"] * bool(origin.epoch)
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([*([kind] if kind else []), *dated, *names])
    for stretch in stretches:
        columns = [stretch.columns.get(name, [math.nan] * len(stretch.time)) for name in names]
        for values in zip(*columns, strict=True):
            dates = [later(origin.epoch, values[0]) for _ in dated]
            cells = ["" if math.isnan(value) else repr(float(value)) for value in values]
            writer.writerow([*([stretch.name] if kind else []), *dates, *cells])
    return stream.getvalue()


def _object_text(solution: Any, origin: Origin) -> str:
    """The same as one JSON object, a list a column."""
    about = solution.provenance
    dates = {"epoch": origin.epoch, "time_system": origin.scale} if origin.epoch else {}
    places = {name: value for name, value in (("frame", origin.frame), ("center", origin.center)) if value}
    found: dict[str, Any] = {
        "format": "dmoc path",
        "format_version": 1,
        "problem": about.problem_name,
        **dates,
        **places,
        "status": solution.status,
        "objective": float(solution.objective),
        "objective_unit": about.objective_unit,
        "stretches": [
            {
                "name": stretch.name,
                "kind": kind_of(solution) or "transfer",
                "columns": {name: [float(x) for x in values] for name, values in stretch.columns.items()},
            }
            for stretch in stretches_of(solution)
        ],
    }
    if kicks := getattr(solution, "impulses", ()):
        found["impulses"] = [
            {
                "at": kick.joint,
                "time [s]": float(kick.time),
                "position [m]": [float(x) for x in kick.position],
                "velocity change [m/s]": [float(x) for x in kick.change],
            }
            for kick in kicks
        ]
    return json.dumps(finite(found), allow_nan=False) + "\n"


FORMS = {"csv": _table_text, "json": _object_text, "oem": oem_text, "czml": czml_text}
