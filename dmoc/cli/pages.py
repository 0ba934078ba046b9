"""`dmoc report`, and what --plot draws: a picture or a page, by the end of the file's name."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from dmoc.cli.options import File, Source, ends_at_once, seen, switch, writable

# Everything else is imported where it is used: `dmoc --help` answers at once.

Dark = Annotated[bool, switch("--dark", help="On a dark background.")]


def report(
    file: File,
    out: Annotated[
        Path | None, typer.Option(metavar="HTML", help="Where to; the file's name with .html if not given.")
    ] = None,
    study: Annotated[
        Path | None,
        typer.Option(metavar="CSV", help="Also what accuracy costs, as `dmoc study --csv` wrote it."),
    ] = None,
    source: Source = None,
    dark: Annotated[
        bool, switch("--dark", help="Always dark; otherwise light or dark as the browser is.")
    ] = False,
) -> None:
    """Write a saved solution as a page for a browser: one file, which needs no network."""
    from dmoc.pages.report import report as write
    from dmoc.reports.words import console

    target = file.with_suffix(".html") if out is None else out
    writable(target, page=True)
    with ends_at_once():
        write(seen(file, source), target, study=study, dark=dark)
    console().print(f"wrote {target}")


def drawable(path: Path | None) -> None:
    """ValueError unless a picture or a page can be written there: said before the work, not after it."""
    page = path is not None and is_page(path)
    writable(path, drawn=not page, page=page)


def draw(solution: Any, path: Path, verdict: Any = None, dark: bool = False) -> None:
    """Draw a solution into a picture or a page."""
    if is_page(path):
        from dmoc.pages.report import report as write

        write(solution, path, verdict, dark=dark)
        return
    from dmoc.plots.page import save_figure

    save_figure(solution, path, verdict, dark=dark)


def guess_from(path: Path) -> Any:
    """What to start from: a saved solution, or the path of a point of a sweep."""
    import dmoc

    if path.exists() or ":" not in str(path):
        return dmoc.load(path)
    from dmoc.sweeps.points import start_from

    return start_from(path)


def point_of(file: Path, out: Path | None) -> tuple[Any, Path] | None:
    """The answer of a point of a sweep, and where it is drawn; None where a file is named."""
    if file.exists() or ":" not in str(file):
        return None
    from dmoc.sweeps.points import answer_of, split

    known = split(file)
    if known is None:
        return None
    name = known[1].replace("=", "_").replace(",", "_")
    target = known[0].with_name(f"{known[0].stem}_{name}.png") if out is None else out
    drawable(target)
    return answer_of(*known), target


def is_page(path: Path) -> bool:
    return path.suffix.lower() in (".html", ".htm")


def doctor() -> None:
    """Say what this computer has: versions, linear solvers, a C compiler, cores, and how fast it solves."""
    from dmoc.reports import words as report
    from dmoc.reports.tables import findings_table
    from dmoc.studies.computer import examine

    report.console().print(findings_table(examine()))
