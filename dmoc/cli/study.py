"""`dmoc study`: what accuracy costs in time."""

from __future__ import annotations

import sys
from contextlib import nullcontext, redirect_stdout
from pathlib import Path
from typing import Annotated, Any

import typer

from dmoc.cli.options import Json, Name, Settings, ends_at_once, not_a_team, switch, writable
from dmoc.cli.pages import Dark

# Everything else is imported where it is used: `dmoc --help` answers at once.


def study(
    name: Name,
    orders: Annotated[
        str, typer.Option(metavar="N,N,...", help="Orders to compare, of 2, 4, 6, 8.")
    ] = "2,4,6,8",
    steps: Annotated[
        str | None, typer.Option(metavar="N,N,...", help="Numbers of steps; if not given, some for each order.")
    ] = None,
    against: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="A Python file with other methods, such as scripts/alternatives.py. It is run."
        ),
    ] = None,
    cold: Annotated[bool, switch("--cold", help="Also without coarse meshes on the way.")] = False,
    compiled: Annotated[
        bool, switch("--compiled", help="Also with functions as machine code, once they are compiled.")
    ] = False,
    repeats: Annotated[
        int,
        typer.Option(metavar="N", min=1, max=1000, help="How often each solve is timed; the median counts."),
    ] = 3,
    reference: Annotated[
        float | None, typer.Option(help="The true objective; order 8 on a fine mesh if not given.")
    ] = None,
    settings: Settings = None,
    plot: Annotated[Path | None, typer.Option(help="Draw error against time here (png, pdf or svg).")] = None,
    dark: Dark = False,
    csv: Annotated[Path | None, typer.Option(help="Write a line a solve here.")] = None,
    as_json: Json = False,
) -> None:
    """Measure what accuracy costs in time, for every order on several meshes and for other methods.

    Medians of several runs; whatever else the computer does makes them longer.
    """
    from dmoc.reports import study as report_study
    from dmoc.reports import words as report
    from dmoc.studies.accuracy import work_precision
    from dmoc.studies.other_methods import load_methods

    writable(plot, drawn=True)
    writable(csv, table=True)
    chosen, meshes = whole_numbers("orders", orders), None if steps is None else whole_numbers("steps", steps)
    live = report.console(stderr=True).status("") if sys.stderr.isatty() and not as_json else None
    with redirect_stdout(sys.stderr if as_json else sys.stdout), ends_at_once(), live or nullcontext():
        problem = not_a_team(name, settings, "study")
        methods = {} if against is None else load_methods(against)
        measured = _of_mission if hasattr(problem, "plan") else work_precision
        told = live.update if live else None
        trials = measured(problem, chosen, meshes, repeats, methods, reference, cold, compiled, told)
    if plot is not None:
        _draw(trials, problem.name.replace("_", " "), plot, dark)
    if csv is not None:
        report_study.write_csv(trials, csv)
    if as_json:
        from dmoc.reports.as_json import as_text

        print(as_text(report_study.study_object(problem.name, trials)))
        return
    console = report.console()
    unit = problem.objective.unit_with(problem.actuator)
    console.print(report_study.study_tables(trials, unit, console.width))
    for path in filter(None, (plot, csv)):
        console.print(f"wrote {path}")


def _draw(trials: list, name: str, path: Path, dark: bool) -> None:
    from dmoc.charts.study import save_study

    save_study(trials, path, f"{name}: what accuracy costs in time", dark)


def _of_mission(
    mission: Any, orders: Any, steps: Any, repeats: int, methods: dict, reference: Any, cold: bool, *rest: Any
) -> list:
    """The trials of a mission, which no other method solves, and which has no coarse meshes on the way."""
    from dmoc.studies.of_missions import mission_precision

    if cold or methods:
        raise ValueError("--cold and --against are for transfers; a mission of legs has neither")
    return mission_precision(mission, orders, steps, repeats, reference, *rest)


def whole_numbers(name: str, text: str) -> list[int]:
    """The numbers in a text such as `2,4,6`.

    Raises
    ------
    ValueError
        If it is none.
    """
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise ValueError(f"--{name} must be whole numbers with commas, such as 2,4,8; got {text!r}") from None
