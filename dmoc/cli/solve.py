"""`dmoc solve`: solve, check, save, draw, show."""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import Annotated, Any

import typer

from dmoc.cli.options import (
    Hold,
    Impulses,
    Json,
    Name,
    Order,
    Quiet,
    Settings,
    Steps,
    Structure,
    TimeLimit,
    Worth,
    best_start,
    ends_at_once,
    problem_of,
    show_answer,
    switch,
    watched,
    writable,
)
from dmoc.cli.pages import Dark, draw, drawable, guess_from

# Everything else is imported where it is used: `dmoc --help` answers at once.

Compiled = Annotated[
    bool, switch("--compiled", help="Evaluate machine code; needs a C compiler the first time.")
]


def solve(
    name: Name,
    order: Order = None,
    steps: Steps = None,
    tol: Annotated[
        float | None, typer.Option(help="Relative error to reach, such as 1e-4; sets order and steps.")
    ] = None,
    hold: Hold = False,
    settings: Settings = None,
    out: Annotated[Path | None, typer.Option(help="Save the solution here (netCDF).")] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Draw the solution here: png, pdf, svg, or html for a page.")
    ] = None,
    dark: Dark = False,
    animate: Annotated[Path | None, typer.Option(help="Write a moving picture here (gif or mp4).")] = None,
    guess: Annotated[
        Path | None, typer.Option(help="Start from this saved solution, or a point of a sweep: map.nc:7.")
    ] = None,
    starts: Annotated[
        int,
        typer.Option(metavar="N", min=1, max=1000, help="Starting paths to try coarsely; the best is refined."),
    ] = 1,
    structure: Structure = None,
    impulses: Impulses = None,
    time_limit: TimeLimit = None,
    as_json: Json = False,
    compiled: Compiled = False,
    worth: Worth = False,
    quiet: Quiet = False,
) -> None:
    """Solve a problem, check the answer, show both."""
    import dmoc

    writable(out)
    drawable(plot)
    writable(animate, moving=True)
    # what a problem file prints must not come between the lines of the JSON object
    with redirect_stdout(sys.stderr if as_json else sys.stdout), ends_at_once():
        file, problem = problem_of(name, settings)
        start: Any = None if guess is None else guess_from(guess)
        unit = problem.objective.unit_with(problem.actuator)
        if starts > 1:
            start = best_start(problem, starts, order, hold, start, None if as_json or quiet else unit)
        with watched(as_json or quiet, unit) as progress:
            numerics = order, steps, tol, hold, None, start, None
            limits = progress, compiled, time_limit
            solution = dmoc.solve(problem, *numerics, *limits, structure=structure, impulses=impulses)
        from dmoc.structure.front import verify

        verdict = verify(solution) if solution.optimal else None
    if out is not None:
        solution.save(out, source_hash=file.source_hash)
    if plot is not None:
        draw(solution, plot, verdict, dark)
    if animate is not None:
        dmoc.animate(solution, animate, dark=dark)
    written = [path for path in (out, plot, animate) if path is not None]
    show_answer(solution, verdict, as_json, quiet, written, with_worth=worth)
