"""Tables of single verbs: what effects do and cost, the optima of several starts, what a computer has."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from dmoc.reports.words import pairs

if TYPE_CHECKING:
    from dmoc.results.solution import Solution
    from dmoc.solver.starts import Optimum
    from dmoc.studies.computer import Findings
    from dmoc.studies.effects import Influence


def influence_table(rows: Sequence[Influence], solution: Solution) -> RenderableType:
    """One row an effect, those of the scene above those that are not in it, and how to read them."""
    table = Table(box=box.SIMPLE_HEAD, header_style="bold", pad_edge=False)
    table.add_column("effect", overflow="fold")
    for name in (
        "largest\nacceleration",
        "goal moves\nwithout it",
        "instructions\nit adds",
        "share of\nthe time",
    ):
        table.add_column(name, justify="right")
    for i, row in enumerate(rows):
        table.add_row(
            row.name if row.listed else f"({row.name})",
            _joined(row.acceleration, "m/s\u00b2", row.angular_acceleration, "rad/s\u00b2"),
            _moved(row.displacement, row.turn),
            f"{row.instructions:,}",
            f"{100 * row.time_share:.0f} %",
            style=None if row.listed else "dim",
            end_section=any(following.listed != row.listed for following in rows[i + 1 : i + 2]),
        )
    note = (
        f"Along the solved path of {solution.provenance.problem_name} (order {solution.order}, "
        f"{solution.steps} steps). The goal moves between two flights of the same controls by an independent "
        "integrator, with the effect and without it. Time is that of all derivatives on the whole mesh."
    )
    if len(getattr(solution, "legs", ())) > 1:
        note += " Each leg is flown by itself from its own start; its end is what moves."
    if not all(row.listed for row in rows):
        note += " Effects in brackets are not in the scene: what they would do and cost."
    return Group(table, Text(note)) if rows else Text("The scene has no effect: there is nothing to leave out.")


def _joined(linear: float, unit: str, turning: float, of_turning: str) -> str:
    """An acceleration, beside it that of a turn if there is one."""
    if turning and not linear:
        return f"{turning:.2e} {of_turning}"
    return f"{linear:.2e} {unit}" + (f", {turning:.2e} {of_turning}" if turning else "")


def _moved(metres: float, degrees: float) -> str:
    if degrees and not metres:
        return f"{degrees:.3g} degrees"
    return _length(metres) + (f", {degrees:.3g} degrees" if degrees else "")


def _length(metres: float) -> str:
    kilometres = metres / 1e3
    return (
        f"{kilometres:,.0f} km"
        if metres >= 1e5
        else f"{kilometres:.3g} km"
        if metres >= 1e3
        else f"{metres:.3g} m"
    )


def optima_table(found: Sequence[Optimum], unit: str) -> RenderableType:
    """The distinct optima on the coarse mesh, the best first; it is refined."""
    table = Table(box=None, header_style="bold", pad_edge=False)
    table.add_column(f"objective [{unit}]", justify="right")
    table.add_column("starts that led there", overflow="fold")
    for optimum in found:
        table.add_row(f"{optimum.objective:.8g}", ", ".join(optimum.starts))
    return Group(Text("Local optima found on the coarse mesh; the first is refined"), table, Text(""))


def findings_table(found: Findings) -> RenderableType:
    """What `dmoc doctor` found, one line a thing."""
    works = [solver.full_name for solver in found.linear_solvers if solver.works]
    fails = [solver.name for solver in found.linear_solvers if not solver.works]
    milliseconds = [
        f"order {run.order}, {run.steps} steps: {1e3 * run.build_s:.0f} ms to build, "
        f"{1e3 * run.solve_s:.0f} ms to solve (medians of {run.runs} first solves)"
        for run in found.timings
    ]
    return pairs(
        [
            ("versions", [f"{name} {version}" for name, version in found.versions.items()]),
            ("system", f"{found.system}, {found.cores} cores that may be used"),
            ("linear solvers", [f"{', '.join(works) or 'none'} in Ipopt", f"not here: {', '.join(fails)}"]),
            ("C compiler", found.compiler or "none found; only --compiled and code from dmoc export need one"),
            ("machine code", found.folder or "not kept: no folder that you alone may write to"),
            ("orbit_raise", milliseconds),
        ]
    )
