"""The table of `benchmark.py --peers`: printed, written into docs/peers.md, or as JSON."""

from __future__ import annotations

import os
import platform
import re
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rich.console import Console

from dmoc.reports.layout import plain_table
from peers.tasks import TASKS
from peers.turns import ACCURACIES, TOOLS, Run, named

PAGE = Path(__file__).parents[2] / "docs" / "peers.md"
PLACE = re.compile(r"(?<=<!-- peers -->\n).*?(?=<!-- end of peers -->)", re.DOTALL)
Runs = dict[tuple[str, str, float], Run]


def rows(runs: Runs) -> list[list[str]]:
    """Problem, accuracy, and a cell a tool: first / warm [ms] and the mesh; the fastest warm one is bold."""
    lines = []
    for name, task in TASKS.items():
        for accuracy in ACCURACIES:
            found = {tool: runs[name, tool, accuracy] for tool in TOOLS if (name, tool, accuracy) in runs}
            facts = {tool: run.facts() for tool, run in found.items()}
            best = min(facts, key=lambda tool: facts[tool]["warm"], default=None)
            head = f"{name} {task.title}" if accuracy == ACCURACIES[0] else ""
            cells = [_cell(found[tool], facts[tool], tool == best) if tool in found else "-" for tool in TOOLS]
            lines.append([head, f"{accuracy:.0e}", *cells])
    return lines


def _cell(run: Run, facts: dict[str, Any], best: bool) -> str:
    first, warm = (f"{1e3 * facts[key]:.0f}" for key in ("first", "warm"))
    return f"{first} / {f'**{warm}**' if best else warm} ({named(run.tool, run.mesh)})"


def note(runs: Runs, asset: str) -> str:
    """What the times are of."""
    counts = sorted({len(run.first) for run in runs.values()})
    said = f"{counts[-1]} runs" if len(counts) == 1 else f"{counts[-1]} runs, of slow ones {counts[0]}"
    machine = f"{os.cpu_count()} shared cores, {platform.machine()}, Python {platform.python_version()}"
    versions = f"CasADi {version('casadi')}" + (f", ASSET {asset}" if asset else "")
    return f"Medians of {said or 'none'} on {machine}; {versions}.\n"


def markdown(runs: Runs, asset: str) -> str:
    """The table and what its times are of."""
    head = ["problem", "to", *TOOLS.values()]
    lines = [head, ["---"] * len(head), *rows(runs)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines) + "\n" + note(runs, asset)


def show(runs: Runs, console: Console) -> None:
    """The table for a terminal."""
    table = plain_table(("problem", "to", *TOOLS.values()), numbers=slice(1, None), unbroken=slice(0))
    for line in rows(runs):
        table.add_row(*(cell.replace("*", "").replace("`", "") for cell in line))
    console.print("\nProcessor time of build and solve: first in a process / warm [ms], and the mesh")
    console.print(table)


def write(runs: Runs, asset: str, page: Path = PAGE) -> None:
    """Put the table between the markers of the page."""
    page.write_text(PLACE.sub(lambda _: markdown(runs, asset), page.read_text()))


def facts(runs: Runs) -> list[dict[str, Any]]:
    """For JSON."""
    return [{"accuracy": accuracy, **run.facts()} for (_, _, accuracy), run in runs.items()]
