"""Tables of single verbs: what effects do and cost, the optima of several starts, what a computer has."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from dmoc.report import pairs

if TYPE_CHECKING:
    from dmoc.doctor import Findings
    from dmoc.effects.base import Effect
    from dmoc.influence import Influence
    from dmoc.solution import Solution
    from dmoc.starts import Optimum


def influence_table(rows: Sequence[Influence], solution: Solution) -> RenderableType:
    """One row an effect, and a line that says how to read them."""
    table = Table(box=None, header_style="bold", pad_edge=False)
    table.add_column("effect", overflow="fold")
    table.add_column("in the scene")
    for name in ("largest acceleration [m/s^2]", "goal moves without it [m]", "instructions", "time share"):
        table.add_column(name, justify="right")
    for row in rows:
        table.add_row(
            _name(row.effect),
            "yes" if row.listed else "no",
            f"{row.acceleration:.3g}",
            f"{row.displacement:.3g}",
            f"{row.instructions:+d}",
            f"{100 * row.time_share:.0f} %",
        )
    note = (
        f"Along the solved path of {solution.provenance.problem_name} (order {solution.order}, "
        f"{solution.steps} steps). 'Goal moves' compares the independent integrator flying the same controls "
        "with the effect and without it; for an effect not in the scene, with it added."
    )
    return Group(table, Text(""), Text(note))


def _name(effect: Effect) -> str:
    """The effect's name and numbers, without its description."""
    return effect.words().split("(", 1)[-1].removesuffix(")")


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
        f"{1e3 * run.solve_s:.0f} ms to solve (medians of {run.runs})"
        for run in found.timings
    ]
    return pairs(
        [
            ("versions", [f"{name} {version}" for name, version in found.versions.items()]),
            ("system", f"{found.system}, {found.cores} cores that may be used"),
            ("linear solvers", [f"{', '.join(works) or 'none'} in Ipopt", f"not here: {', '.join(fails)}"]),
            ("C compiler", found.compiler or "none found; only code from dmoc export needs one"),
            ("orbit_raise", milliseconds),
        ]
    )
