"""What `benchmark.py` found, as tables."""

from __future__ import annotations

import math
import sys
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

console = Console(markup=False, highlight=False, width=None if sys.stdout.isatty() else 130)


def show_pairs(title: str, pairs: list[tuple[str, dict[str, Any]]]) -> None:
    table = _table("case", "state", "dmoc [ms]", "plain [ms]", "ratio", "iterations", "evaluations")
    for name, pair in pairs:
        theirs = pair["plain"]
        for state, ours in pair["dmoc"].items():
            counts = [f"{ours[key]} : {theirs[key]}" if key in ours else "" for key in ("iterations", "calls")]
            times = milliseconds(ours["seconds"]), milliseconds(theirs["seconds"])
            table.add_row(name, state, *times, f"{pair['ratio'][state]:.2f}", *counts)
    _print(title, table)


def show_equal_error(found: dict[str, Any]) -> None:
    states = list(found["best"])
    table = _table(
        "method",
        "steps around",
        "error there",
        *[f"{state} [ms]" for state in states],
        "of it Ipopt [ms]",
        "iterations",
        "evaluations",
    )
    rows = found["methods"].items()
    for method, row in sorted(rows, key=lambda row: row[1]["seconds"]["first"] or math.inf):
        first, *_, last = row["solves"]
        errors = f"{first['error']:.1e} {last['error']:.1e}"
        counts = [f"{first[key]} {last[key]}" for key in ("iterations", "calls")]
        inside = " ".join(milliseconds(solved["solve_s"]) for solved in (first, last))
        times = [milliseconds(row["seconds"][state]) if state in row["seconds"] else "" for state in states]
        table.add_row(method, f"{first['steps']} {last['steps']}", errors, *times, inside, *counts)
    _print(f"{found['problem']}: to an error of {found['target']:g} in the objective", table)


def show_parts(rows: list[dict[str, Any]]) -> None:
    parts = [key for key in rows[0] if key not in ("steps", "levels")]
    table = _table("steps", *[f"{part} [ms]" for part in parts])
    for row in rows:
        table.add_row(str(row["steps"]), *[milliseconds(row[part]) for part in parts])
    _print("Where the time goes: orbit_raise, order 2, coarse to fine", table)


def verdicts(results: dict[str, Any]) -> list[tuple[str, float, dict[str, float]]]:
    """(what, ratio wanted, ratios found by state)."""
    rows = [
        (f"plain, {each['steps']} steps", 2.0 if each["steps"] < 1000 else 5.0, each["ratio"])
        for each in results["plain"]
    ]
    rows += [(f"another {what}, no rebuild", 5.0, each["ratio"]) for what, each in results["resolve"].items()]
    for found in results["equal error"]:
        times = {method: row["seconds"]["first"] or math.nan for method, row in found["methods"].items()}
        best = min((m for m in times if m.startswith(("Hermite", "Radau"))), key=lambda m: times[m])
        for method in ("RK4 shooting", "RK4 shooting, held", "trapezoid", best):
            wanted = 1.5 if method == best else 10.0
            rows.append((f"{found['problem']}, {method}", wanted, found["methods"][method]["ratio"]))
    return rows


def show_verdicts(rows: list[tuple[str, float, dict[str, float]]]) -> None:
    """The target is judged by the first solve in a process, as most are."""
    table = _table("against", "wanted", "first", "same process", "verdict")
    for what, wanted, found in rows:
        judged = next(iter(found.values()))
        if judged is None:
            verdict = "met: it did not get there"
        else:
            verdict = "met" if judged >= wanted else f"missed by a factor of {wanted / judged:.1f}"
        shown = [found.get(state) for state in ("first", "same process")]
        if "no rebuild" in found:
            shown[-1] = found["no rebuild"]
        table.add_row(what, f"{wanted:g}", *["" if r is None else f"{r:.2f}" for r in shown], verdict)
    _print("How many times faster", table)


def _table(*columns: str) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="bold")
    for i, column in enumerate(columns):
        table.add_column(column, justify="right" if i else "left")
    return table


def milliseconds(seconds: float | None) -> str:
    return "-" if seconds is None else f"{1e3 * seconds:.3g}" if seconds < 1 else f"{1e3 * seconds:.0f}"


def _print(title: str, table: Table) -> None:
    console.print(Text(f"\n{title}", "bold"), table, sep="\n")
