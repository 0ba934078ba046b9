"""`dmoc disperse`: fly a saved solution many times with errors."""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import Annotated

import typer

from dmoc.cli.options import File, Json, Source, attached, ends_at_once, writable

# Everything else is imported where it is used: `dmoc --help` answers at once.


def disperse(
    file: File,
    start: Annotated[
        str,
        typer.Option(
            metavar="A,B",
            help="Standard deviations at the start: of the position in m, of the velocity in m/s.",
        ),
    ] = "0,0",
    force: Annotated[float, typer.Option(help="Standard deviation of the force: 0.01 is 1 %.")] = 0.0,
    pointing: Annotated[float, typer.Option(help="Standard deviation of its direction, in rad.")] = 0.0,
    mass: Annotated[float, typer.Option(help="Standard deviation of the mass: 0.01 is 1 %.")] = 0.0,
    samples: Annotated[int, typer.Option(help="Number of flights, at least 2.")] = 1000,
    seed: Annotated[int, typer.Option(help="The same seed gives the same flights.")] = 0,
    plot: Annotated[Path | None, typer.Option(help="Draw the flights here (png, pdf or svg).")] = None,
    source: Source = None,
    as_json: Json = False,
) -> None:
    """Fly a saved solution many times with errors, and say how far it comes off and which limits it breaks."""
    import dmoc

    writable(plot, drawn=True)
    with redirect_stdout(sys.stderr if as_json else sys.stdout), ends_at_once():
        solution = attached(file, source)
        found = dmoc.disperse(solution, _pair(start), force, pointing, mass, samples, seed)
    if plot is not None:
        from dmoc.charts.dispersion import dispersion_figure
        from dmoc.charts.study import save_page

        save_page(dispersion_figure(found, solution), plot)
    if as_json:
        from dmoc.reports import as_json as report

        print(report.as_text(report.dispersion_object(found, solution)))
        return
    from dmoc.reports.dispersion import dispersion_report
    from dmoc.reports.layout import console

    console().print(dispersion_report(found, solution))
    if plot is not None:
        console().print(f"wrote {plot}")


def _pair(text: str) -> tuple[float, float]:
    """Two numbers with a comma between them."""
    try:
        first, second = map(float, text.split(","))
    except ValueError:
        raise ValueError(
            f"--start must be two numbers A,B: position [m] and velocity [m/s]; got {text!r}"
        ) from None
    return first, second
