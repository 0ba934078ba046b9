"""Flights in tables and sentences: how far errors take them off their plan, and what a measured one says."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.console import Group, RenderableType
from rich.text import Text

from dmoc.reports.layout import plain_table

if TYPE_CHECKING:
    from dmoc.identification.estimate import Estimate
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


def estimate_report(found: Estimate) -> RenderableType:
    """Numbers with intervals, how well the equations fit, and what to mind."""
    flight = found.flight
    lost = f", {flight.dropped} without a position" if flight.dropped else ""
    head = f"{flight.name}: {len(flight.times)} samples in {flight.duration:g} s{lost}"
    if not found.success:
        return Group(Text(head, "bold"), Text(f"Failed: {found.message}."))
    table = plain_table(["number", "value", "95 % interval", "unit", "thought to be"], numbers=slice(1, 2))
    for one, (name, value, span, unit) in zip(found.wanted, found.lines(), strict=True):
        believed = f"{one.value:g}" + ("" if one.sigma is None else f" +- {one.sigma:g}")
        table.add_row(name, value, span, unit, believed)
    parts: list[RenderableType] = [Text(head, "bold"), table, Text(), Text(fit_told(found))]
    parts += [Text(f"Mind: {line}") for line in found.remarks]
    count = found.fit.steps
    parts.append(
        Text(f"Found in {count} steps, {found.seconds:.2g} s, by the equations of order {found.order}.")
    )
    return Group(*parts)


def fit_told(found: Estimate) -> str:
    """How well the equations fit the flight."""
    degrees = found.fit.degrees
    unit = "m" if found.flight.axes else "rad"
    if found.found_noise:
        size = f"Noise of positions found: {found.noise:.3g} {unit}"
    else:
        per = found.chi_squared / max(degrees, 1)
        chance = f"right: 1; chance of more: {found.fitting:.2g}"
        size = f"Squares of residuals over noise: {per:.3g} on average ({chance})"
    return f"{size}. Residuals alike from sample to sample: chance of more so {found.whiteness:.2g}."
