"""What a person sees of a study: a line a solve, and what each accuracy costs; JSON and CSV of the same."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from dmoc.basics.files import whole_file
from dmoc.reports.words import plain_table
from dmoc.studies.accuracy import TARGETS, Trial, time_to_reach

# Columns of the table of solves that have no value where a solve failed.
FIGURES = ("error", "order seen", "goal missed", "iterations", "calls", "build", "solve")
# Terminals narrower than this [letters] get a table without nodes and calls: with them it would not fit.
FULL_WIDTH = 92


def study_tables(trials: Sequence[Trial], unit: str, width: int = FULL_WIDTH) -> RenderableType:
    """Every solve, then the time to reach each accuracy."""
    solves = Text("Solves: relative errors, medians of the times", "bold")
    reach = Text("Milliseconds to a relative error of the objective (build and solve)", "bold")
    note = "interpolated between measured solves, never beyond them; - where not reached"
    return Group(solves, _solves(trials, unit, width), Text(), reach, _reach(trials), Text(note, "dim"))


def study_object(name: str, trials: Sequence[Trial]) -> dict[str, Any]:
    """The JSON object of a study."""
    reach = [
        {"method": method, "seconds": dict(zip(map(_power, TARGETS), seconds, strict=True))}
        for method, seconds in time_to_reach(trials).items()
    ]
    orders = observed_orders(trials)
    rows = [asdict(trial) | {"observed_order": seen} for trial, seen in zip(trials, orders, strict=True)]
    return {"problem": name, "trials": rows, "time_to_reach": reach}


def observed_orders(trials: Sequence[Trial]) -> list[float | None]:
    """By which power of the steps' length the error of each solve fell since the coarser mesh before it [-].

    None for the first mesh of a method, and where the error did not fall: rounding, or the reference.
    """
    found: list[float | None] = []
    before: Trial | None = None
    for trial in trials:
        known = (
            before is not None and before.method == trial.method and before.status == trial.status == "solved"
        )
        if before is not None and known and 0 < trial.error < before.error and trial.steps > before.steps:
            found.append(math.log(before.error / trial.error) / math.log(trial.steps / before.steps))
        else:
            found.append(None)
        before = trial
    return found


def write_csv(trials: Sequence[Trial], path: Path) -> None:
    """One line a solve, whole or not at all."""
    with whole_file(path) as temporary, temporary.open("w", newline="") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Trial)])
        writer.writeheader()
        writer.writerows(asdict(trial) for trial in trials)


def _solves(trials: Sequence[Trial], unit: str, width: int) -> Table:
    rows = [_cells(trial, seen) for trial, seen in zip(trials, observed_orders(trials), strict=True)]
    names = [name for name in rows[0] if width >= FULL_WIDTH or name not in ("nodes", "calls")] if rows else []
    units = {"objective": unit, "build": "ms", "solve": "ms"}
    heads = [name.replace(" ", "\n") + (f"\n[{units[name]}]" if name in units else "") for name in names]
    table = plain_table(heads, numbers=slice(1, None), unbroken=slice(None), gap=1)
    before = ""
    for row in rows:
        shown = row | {"method": "" if row["method"] == before else row["method"]}
        table.add_row(*[shown[name] for name in names])
        before = row["method"]
    return table


def _cells(trial: Trial, seen: float | None) -> dict[str, str]:
    cells = {"method": trial.method, "steps": str(trial.steps), "nodes": str(trial.nodes)}
    if trial.status != "solved":
        reason = trial.status.split(":")[0]
        return cells | {"objective": reason} | dict.fromkeys(FIGURES, "-")
    values = (
        f"{trial.error:.1e}",
        "-" if seen is None else f"{seen:.1f}",
        f"{trial.path_error:.1e}",
        str(trial.iterations),
        str(trial.calls),
        f"{1e3 * trial.build_s:.1f}",
        f"{1e3 * trial.solve_s:.1f}",
    )
    return cells | {"objective": f"{trial.objective:.8g}"} | dict(zip(FIGURES, values, strict=True))


def _reach(trials: Sequence[Trial]) -> Table:
    table = plain_table(["method", *map(_power, TARGETS)], numbers=slice(1, None), unbroken=slice(None), gap=1)
    for method, times in time_to_reach(trials).items():
        table.add_row(method, *["-" if seconds is None else f"{1e3 * seconds:.0f}" for seconds in times])
    return table


def _power(target: float) -> str:
    """1e-03 as 1e-3."""
    return f"1e{round(math.log10(target))}"
