"""What reports are made of: a console, tables without lines, parts of a scene in words."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, Literal

from rich.console import Console
from rich.table import Table

from dmoc.basics.docstrings import documented, first_line

if TYPE_CHECKING:
    from dmoc.effects.base import Effect

# What is written to a file or a pipe has lines of at most this many letters: no terminal gives a width there.
PLAIN_WIDTH = 120


def console(stderr: bool = False) -> Console:
    """A console without markup: units stand in square brackets."""
    stream = sys.stderr if stderr else sys.stdout
    wide = None if stream.isatty() or "COLUMNS" in os.environ else PLAIN_WIDTH
    return Console(file=stream, markup=False, highlight=False, emoji=False, width=wide)


def effect_words(effect: Effect) -> str:
    """One line for a person: what the effect's docstring says it is, and its numbers with units."""
    if hasattr(effect, "words"):
        return effect.words()
    name, docstring = type(effect).__name__, type(effect).__doc__
    summary = first_line(docstring)
    # a dataclass without a docstring has its signature there
    summary = "" if summary.startswith(f"{name}(") else summary.split(":")[0].rstrip(".")
    entries = documented(docstring)
    numbers = [name]
    for name in [field.name for field in fields(effect)] if is_dataclass(effect) else ():
        value = getattr(effect, name)
        if value is not None:
            numbers.append(f"{name} {value_words(value, entries[name].unit if name in entries else '')}")
    return f"{summary} ({', '.join(numbers)})" if summary else ", ".join(numbers)


def value_words(value: Any, unit: str = "") -> str:
    """A number or a tuple of numbers with its unit; anything else by its name."""
    if isinstance(value, (tuple, list)):
        text = "(" + ", ".join(value_words(entry) for entry in value) + ")"
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        text = f"{value:.10g}"
    else:
        text = getattr(value, "__name__", None) or str(value)
    return f"{text} {unit}" if unit and unit not in ("-", "1") else text


def pairs(rows: Sequence[tuple[str, Any]]) -> Table:
    """Names with what belongs to them; a list gives one line an entry."""
    table = Table.grid(padding=(0, 2))
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    for name, words in rows:
        table.add_row(name, words if isinstance(words, str) else "\n".join(words))
    return table


def plain_table(
    columns: Sequence[str], numbers: slice = slice(0), unbroken: slice = slice(1), gap: int = 2
) -> Table:
    """A table without lines.

    `numbers` are the columns that stand at the right, `unbroken` those that a narrow terminal must not
    break into lines, `gap` the spaces between two columns.
    """
    table = Table(box=None, padding=(0, gap, 0, 0), header_style="bold")
    at_the_right, whole = (set(columns[chosen]) for chosen in (numbers, unbroken))
    for column in columns:
        side: Literal["left", "right"] = "right" if column in at_the_right else "left"
        table.add_column(column, justify=side, no_wrap=column in whole)
    return table
