"""What a flight says of numbers, in tables and sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.text import Text

from dmoc.reports.layout import plain_table

if TYPE_CHECKING:
    from dmoc.identification.estimate import Estimate


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
