"""`dmoc simulate` and `dmoc convert`: paths marched forward, and paths in the formats of other programs."""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import Annotated, Any

import typer

from dmoc.cli.options import File, Hold, Json, Name, Order, Settings, Steps, ends_at_once, problem_of, writable
from dmoc.cli.pages import Dark

# Everything else is imported where it is used: `dmoc --help` answers at once.


def simulate(
    name: Name,
    order: Order = None,
    steps: Steps = None,
    hold: Hold = False,
    settings: Settings = None,
    controls: Annotated[
        Path | None, typer.Option(help="A saved solution whose controls to apply; none: coast.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="CSV", help="Write the states at all step ends here.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Draw path, speed and energy here: .png, .pdf or .svg.")
    ] = None,
    dark: Dark = False,
    as_json: Json = False,
) -> None:
    """March the integrator forward from the start, without optimisation."""
    import dmoc
    from dmoc.nlp.transcription import check_mesh

    if steps is not None:
        check_mesh(steps)
    if controls is not None and (order, steps, hold) != (None, None, False):
        raise ValueError("--controls brings its own mesh; leave out --order, --steps and --hold")
    writable(out, table=True)
    writable(plot, drawn=True)
    with redirect_stdout(sys.stderr if as_json else sys.stdout), ends_at_once():
        _, problem = problem_of(name, settings)
        known = None if controls is None else dmoc.load(controls).attach(problem)
        given = steps, 2 if order is None else order, hold
        if hasattr(problem, "together"):
            flights = dmoc.simulate_team(problem, known, *given)
        else:
            trajectory = dmoc.simulate(problem, known, *given)
    if hasattr(problem, "together"):
        told = []
        for body, one in zip(problem.names, problem.members, strict=True):
            written = _write(flights[body], one, _of_body(out, body), _of_body(plot, body), dark)
            if not as_json:
                print(f"{body}:")
            told.append(_told(flights[body], one, written, known is None, as_json))
        if as_json:
            from dmoc.reports.as_json import as_text

            print(as_text({"problem": problem.name, "bodies": dict(zip(problem.names, told, strict=True))}))
        return
    written = _write(trajectory, problem, out, plot, dark)
    found = _told(trajectory, problem, written, known is None, as_json)
    if as_json:
        from dmoc.reports.as_json import as_text

        print(as_text(found))


def _of_body(path: Path | None, body: str) -> Path | None:
    """The file of one body of a team beside the one that was named."""
    return None if path is None else path.with_stem(f"{path.stem}_{body.replace(' ', '_')}")


def _write(trajectory: Any, problem: Any, out: Path | None, plot: Path | None, dark: bool) -> list[Path]:
    """Write table and picture of one flight, where they are asked for; the files."""
    if out is not None:
        from dmoc.conversions.marched import write_marched

        write_marched(trajectory, problem, out)
    if plot is not None:
        from dmoc.charts.motion import save_motion

        save_motion(trajectory, problem, plot, dark)
    return [path for path in (out, plot) if path is not None]


def _told(trajectory: Any, problem: Any, written: list[Path], coast: bool, as_json: bool) -> Any:
    """Tell of one flight; the JSON object if that is asked for."""
    if as_json:
        from dmoc.reports import as_json as report_json

        return report_json.motion_object(trajectory, problem, coast)
    from dmoc.reports import words as report

    console = report.console()
    console.print(report.motion(trajectory, problem, coast=coast))
    for path in written:
        console.print(f"wrote {path}")
    return None


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
