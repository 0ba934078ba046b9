"""`dmoc stability`: long runs, rounding, and steps at the edge of stability."""

from __future__ import annotations

import sys
from contextlib import nullcontext, redirect_stdout
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dmoc.cli.options import Json, ends_at_once, writable
from dmoc.cli.pages import Dark

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

# Everything else is imported where it is used: `dmoc --help` answers at once.


def stability(
    revolutions: Annotated[
        float, typer.Option(help="Revolutions of each orbit; the figure of docs/stability.md has 1000.")
    ] = 100,
    eccentricity: Annotated[
        str, typer.Option(metavar="E,E,...", help="Eccentricities of the orbits.")
    ] = "0.3,0.7",
    steps: Annotated[
        int, typer.Option(help="Steps of the march that shows rounding, at least 1000.")
    ] = 100_000,
    turned: Annotated[
        int, typer.Option(help="Steps of bodies that turn or hang on rods, at least 10.")
    ] = 2_000,
    plot: Annotated[Path | None, typer.Option(help="Draw all of it here (png, pdf or svg).")] = None,
    dark: Dark = False,
    as_json: Json = False,
) -> None:
    """Measure numerical stability: drift over many revolutions, rounding, the longest stable steps.

    Coasts Kepler orbits, turns a free body and a heavy top, and lets a double pendulum swing, by the schemes of
    order 2 to 8, by RK4 and by DOP853.
    """
    from dmoc.reports import words as report
    from dmoc.studies.drift import drift, kepler, per_revolution
    from dmoc.studies.rounding import growth, round_off
    from dmoc.studies.spinning import free_body, heavy_top, spin
    from dmoc.studies.swinging import double_pendulum, swing

    writable(plot, drawn=True)
    orbits = [(kepler(value), per_revolution(value)) for value in _eccentricities(eccentricity)]
    live = report.console(stderr=True).status("") if sys.stderr.isatty() and not as_json else None
    with redirect_stdout(sys.stderr if as_json else sys.stdout), ends_at_once(), live or nullcontext():
        rounding = round_off(steps)
        edges = growth()
        runs = [(orbit.name, drift(orbit, revolutions, methods)) for orbit, methods in orbits]
        turns = [(body.name, spin(body, turned)) for body in (free_body(), heavy_top())]
        swings = swing(double_pendulum(), turned)
    if plot is not None:
        from dmoc.charts.stability import stability_figure
        from dmoc.charts.study import save_page

        save_page(stability_figure(runs, rounding, edges), plot, dark=dark)
    if as_json:
        from dmoc.reports.as_json import as_text

        print(as_text(_object(runs, rounding, edges, turns, swings)))
        return
    console = report.console()
    for part in _tables(runs, rounding, edges, turns, swings):
        console.print(part)
    if plot is not None:
        console.print(f"wrote {plot}")


def _eccentricities(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise ValueError(f"--eccentricity must be numbers with commas, such as 0.3,0.7; got {text!r}") from None


def _object(runs: list, rounding: list, edges: list, turns: list, swings: list) -> dict[str, Any]:
    """The JSON object."""
    figures = ("method", "steps", "revolutions", "energy_error", "momentum_error", "growth", "seconds")

    return {
        "drift": [
            {"orbit": orbit} | {name: getattr(row, name) for name in figures}
            for orbit, rows in runs
            for row in rows
        ],
        "turning": [{"body": body} | asdict(row) for body, rows in turns for row in rows],
        "swinging": [asdict(row) for row in swings],
        "round_off": [
            {
                "form": row.form,
                "steps": int(row.steps[-1]),
                "momentum_error": float(row.momentum_error[-1]),
                "miss": row.miss,
            }
            for row in rounding
        ],
        "unstable": [
            {"method": row.method, "from": low, "to": high, "growth": most}
            for row in edges
            for low, high, most in row.gaps
        ],
    }


def _tables(runs: list, rounding: list, edges: list, turns: list, swings: list) -> list[RenderableType]:
    from rich.text import Text

    parts: list[RenderableType] = []
    for orbit, rows in runs:
        parts += [
            Text(f"Kepler orbit, {orbit}, {rows[0].revolutions:g} revolutions", "bold"),
            _drift_table(rows),
            "",
        ]
    words = "largest errors, relative; growth: energy error of the last tenth over that of the first"
    parts += [Text(f"{words}, 1 where it stays bounded", "dim"), ""]
    steps = int(rounding[0].steps[-1])
    parts.append(Text(f"Rounding: equation (16) marched {steps:,} steps along a circle", "bold"))
    table = _right_aligned("form", "angular momentum", "place against compensated [radii]")
    for row in rounding:
        table.add_row(row.form, f"{row.momentum_error[-1]:.1e}", f"{row.miss:.1e}")
    parts += [table, "", Text("Longest stable steps: h times the rate of an oscillation", "bold")]
    table = _right_aligned("method", "stable up to", "then grows a step by up to", "loses a step at 1")
    for row in edges:
        low, high, most = row.gaps[0]
        until = f"{most:.4g} (until {high:.3f})" if high < row.reach[-1] else f"{most:.4g}"
        # a growth below 1 is amplitude lost; at h omega = 1 a step is a sixth of an oscillation
        lost = 1 - float(row.growth[row.reach.searchsorted(1.0)])
        table.add_row(row.method, f"{low:.3f}", until, f"{lost:.1e}" if lost > 1e-12 else "nothing")
    return [*parts, table, "", *_turning_tables(turns), *_swinging_table(swings)]


def _turning_tables(turns: list) -> list[RenderableType]:
    from rich.text import Text

    parts: list[RenderableType] = []
    for body, rows in turns:
        parts.append(Text(f"A {body}, turning freely, {rows[0].steps:,} steps", "bold"))
        table = _right_aligned(
            "method", "h [s]", "us/step", "|q.q - 1|", "angular momentum", "energy", "growth"
        )
        for row in rows:
            figures = (row.norm_error, row.momentum_error, row.energy_error)
            cost = f"{1e6 * row.seconds / row.steps:.0f}"
            errors = [f"{figure:.1e}" for figure in figures]
            table.add_row(row.method, f"{row.length:g}", cost, *errors, f"{row.growth:.2g}")
        parts += [table, ""]
    return parts


def _swinging_table(rows: list) -> list[RenderableType]:
    from rich.text import Text

    title = f"A double pendulum of rods, swinging freely, {rows[0].steps:,} steps"
    table = _right_aligned("method", "h [s]", "us/step", "rods off by [m]", "energy", "growth")
    for row in rows:
        cost = f"{1e6 * row.seconds / row.steps:.0f}"
        errors = (f"{row.gap:.1e}", f"{row.energy_error:.1e}")
        table.add_row(row.method, f"{row.length:g}", cost, *errors, f"{row.growth:.2g}")
    words = "RK4 and DOP853 integrate the equations with the rods differentiated twice: what opens stays open"
    return [Text(title, "bold"), table, Text(words, "dim")]


def _drift_table(rows: list) -> Table:
    table = _right_aligned("method", "steps/rev", "us/rev", "energy", "angular momentum", "growth")
    for row in rows:
        table.add_row(
            row.method,
            f"{row.steps:.0f}",
            f"{1e6 * row.seconds:.0f}",
            f"{row.energy_error:.1e}",
            f"{row.momentum_error:.1e}",
            f"{row.growth:.2g}",
        )
    return table


def _right_aligned(*columns: str) -> Table:
    from dmoc.reports.words import plain_table

    return plain_table(columns, numbers=slice(1, None), unbroken=slice(0), gap=1)
