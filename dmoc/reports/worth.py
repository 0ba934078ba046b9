"""What the numbers of a problem are worth, in a table and in sentences."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from dmoc.reports.as_json import worth_object
from dmoc.reports.layout import plain_table
from dmoc.sensitivity.symmetries import Symmetry, symmetries
from dmoc.sensitivity.worth import Worth, is_of_end, worth

# A change is this part of the number, or of the size of its kind, rounded down to 1, 2 or 5 of a decimal [-].
CHANGE = 0.01
# A turn is changed by this [rad], which people know as one degree.
TURN = math.radians(1.0)
# What changes the objective by less than this part of what changes it most is worth nothing [-].
NOTHING = 1e-6
# So many sentences are printed: those of the numbers that matter most.
SENTENCES = 6


def worth_told(solution: Any) -> tuple[dict[str, Any], RenderableType]:
    """What the numbers of a solution are worth, for JSON and as a table."""
    found, kept = worth(solution), symmetries(solution)
    told = {"worth": worth_object(found), "symmetries": [asdict(one) for one in kept]}
    return told, worth_table(found, solution, kept)


def worth_table(found: dict[str, Worth], solution: Any, kept: Sequence[Symmetry] = ()) -> RenderableType:
    """A table of all numbers that matter, sentences on those that matter most, and what symmetries keep."""
    steps = {name: change_of(one, solution) for name, one in found.items()}
    effects = {name: abs(one.value) * steps[name] for name, one in found.items()}
    least = NOTHING * max(effects.values(), default=0.0)
    listed = [name for name in found if effects[name] > least]
    idle = [name for name in found if effects[name] <= least]
    cost = solution.provenance.objective_unit
    table = plain_table(
        ["number", "as stated", f"{cost} per unit".strip(), "unit", "holds for changes"], numbers=slice(1, 3)
    )
    for name in listed:
        one = found[name]
        table.add_row(name, f"{one.number:.8g}", f"{one.value:.6g}", one.of or "-", _span(one))
    said = [Text(line) for line in sentences(found, steps, solution)]
    notes = [Text(f"Worth nothing here: {', '.join(idle)}.")] if idle else []
    if any(one.range is None for one in found.values()):
        notes.append(
            Text(
                "The answer is degenerate: another path, or other multipliers, are as good. For how large a "
                "change the values hold is not known."
            )
        )
    if said:
        notes += [Text(), Text("To first order:"), *said]
    notes += [Text()] * bool(kept)
    for same in kept:
        words = f"A scene {same.words} is the same: the costates' momentum, what it costs to move the goal so,"
        notes.append(
            Text(f"{words} is {same.value:.6g} {same.unit} all the way, to {same.drift:.0e} of its parts.")
        )
    head = Text("What the numbers of the problem are worth: change of the objective per unit of each", "bold")
    return Group(head, *([table] if listed else []), *notes, Text())


def sentences(found: dict[str, Worth], steps: dict[str, float], solution: Any) -> list[str]:
    """Such as: duration: 0.2 s more saves 0.013 N^2 s (1.5 %)."""
    cost, maximised = solution.provenance.objective_unit, solution.problem.objective.sense < 0
    ordered = sorted(found, key=lambda name: -abs(found[name].value) * steps[name])
    # Of a place or a velocity only the axis is named that matters most.
    first = list({name.split(".")[0]: name for name in reversed(ordered)}.values())
    lines = []
    for name in sorted(first, key=ordered.index)[:SENTENCES]:
        one, step = found[name], steps[name]
        effect = abs(one.value) * step
        if not effect > 0:
            continue
        more = (one.value > 0) == maximised
        size = "1 degree" if one.of == "rad" else f"{step:g} {one.of}".removesuffix("-").strip()
        # More of a coordinate that is negative might be read as further from zero.
        signed = is_of_end(name) or "." in name
        change = f"{'+' if more else '-'}{size}" if signed else f"{size} {'more' if more else 'less'}"
        share = f" ({100 * effect / abs(solution.objective):.2g} %)" if solution.objective else ""
        verb, words = "gains" if maximised else "saves", re.sub(r" \(\w+\)", "", one.words)
        lines.append(f"  {words}: {change} {verb} {effect:.3g} {cost}".rstrip() + share)
    return lines


def change_of(one: Worth, solution: Any) -> float:
    """A change of a number that a person may think of, in its unit."""
    if one.of == "rad":
        return TURN
    places = np.asarray(solution.position)
    extent = float(np.linalg.norm(np.ptp(places, axis=0))) if places.size else 0.0
    # A place or a velocity is compared with the path, since zero may be anywhere.
    sizes = {"m": extent, "m/s": extent / solution.duration, "s": solution.duration}
    own = abs(one.number)
    size = (sizes.get(one.of, own) if "." in one.name else own) or sizes.get(one.of) or 1.0
    return rounded_down(CHANGE * size)


def rounded_down(size: float) -> float:
    """1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(size))
    return max(digit * power for digit in (1, 2, 5) if digit * power <= size * (1 + 1e-9))


def _span(one: Worth) -> str:
    """For which changes of the number the value holds."""
    if one.range is None:
        return "not known"
    low, high = (end - one.number for end in one.range)
    if math.isinf(low) and math.isinf(high):
        return "any, as far as limits go"
    if math.isinf(low):
        return f"up to {high:+.2g}"
    return f"from {low:+.2g} on" if math.isinf(high) else f"{low:+.2g} to {high:+.2g}"
