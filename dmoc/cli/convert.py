"""`dmoc convert`: a saved solution in the formats of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dmoc.cli.options import File

# Everything else is imported where it is used: `dmoc --help` answers at once.


def convert(
    file: File,
    to: Annotated[
        str | None,
        typer.Option(metavar="FORM", help="csv, json, oem or czml; by the name of --out if not given."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Where to; the file's name with the form as its end if not given.")
    ] = None,
    epoch: Annotated[
        str | None,
        typer.Option(metavar="DATE", help="Date of t = 0 where the scene has none, 2028-11-20T06:30:00."),
    ] = None,
    frame: Annotated[
        str | None, typer.Option(help="Axes where the scene has none: ICRF, EME2000, ITRF ...")
    ] = None,
    center: Annotated[
        str | None, typer.Option(help="Body at the origin where the scene has none: EARTH ...")
    ] = None,
    time_system: Annotated[
        str | None,
        typer.Option("--time-system", help="Scale of --epoch: TDB, TT, TAI or UTC; TDB if not given."),
    ] = None,
) -> None:
    """Write a saved solution as a table (csv, json), a CCSDS OEM, or CZML for a globe."""
    import dmoc
    from dmoc.reports import words as report

    if out is None and to is None:
        raise ValueError("say what to write: --to csv, json, oem or czml, or --out with such an end")
    target = file.with_suffix(f".{to}") if out is None else out
    if target.exists() and file.exists() and target.samefile(file):
        raise ValueError(f"{target} is the solution itself; give another name with --out")
    dmoc.convert(dmoc.load(file), target, to, epoch, frame, center, time_system)
    report.console().print(f"wrote {target}")
