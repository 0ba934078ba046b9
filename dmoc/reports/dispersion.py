"""How far flights with errors come off their plan, in tables."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.console import Group, RenderableType
from rich.text import Text

from dmoc.reports.layout import plain_table

if TYPE_CHECKING:
    from dmoc.sensitivity.dispersion import Dispersion


def dispersion_report(found: Dispersion, solution: Any) -> RenderableType:
    """Spread at the end, miss of the goal and chances of breaking limits."""
    axes = found.position.shape[2]
    spread = plain_table(["at the end", "linear", "sampled", "unit"], numbers=slice(1, 3))
    names = [(f"position {axis}", "m") for axis in "xyz"[:axes]]
    names += [(f"velocity {axis}", "m/s") for axis in "xyz"[:axes]]
    for (name, unit), linear, sampled in zip(names, found.sigma[-1], found.sampled_sigma[-1], strict=True):
        spread.add_row(name, f"{linear:.4g}", f"{sampled:.4g}", unit)
    miss = plain_table(["of all flights", "end within [m]", "and within [m/s]"], numbers=slice(1, 3))
    for part, distance, speed in found.miss:
        miss.add_row(f"{100 * part:g} %", f"{distance:.4g}", f"{speed:.4g}")
    name = solution.provenance.problem_name
    head = f"{found.samples} flights of {name} with errors, seed {found.seed}: standard deviations"
    parts: list[RenderableType] = [Text(head, "bold"), spread, Text()]
    parts += [Text("Miss of the planned end", "bold"), miss, Text()]
    if found.chances:
        parts += [Text("Limits, looked at in all nodes", "bold"), _limits(found)]
    else:
        parts.append(Text("The problem has no constraints that a flight could break."))
    return Group(*parts)


def _limits(found: Dispersion) -> RenderableType:
    table = plain_table(
        ["limit", "broken by", "chance", "95 % interval", "95 % of flights within"], numbers=slice(1, 3)
    )
    for name, one in found.chances.items():
        within = f"{one.margin:.3g} {one.unit}" if one.margin else f"0 {one.unit}"
        between = f"{100 * one.low:.3g} to {100 * one.high:.3g} %"
        table.add_row(name, str(one.broken), f"{100 * one.value:.3g} %", between, within)
    return table
