"""Units and descriptions of parameters, read from numpydoc docstrings, so that they are written only once."""

from __future__ import annotations

import inspect
import re
from dataclasses import dataclass

# The heading of a section is a line at the margin that is underlined.
_HEADING = re.compile(r"^(\S.*)\n-{3,}\n", re.MULTILINE)
# An entry is a line at the margin, `name, other : type [unit]`; its description is indented below it.
_ENTRY = re.compile(r"^(\w+(?:, *\w+)*) *(?:: *(.*))?$")
# A unit stands in square brackets.
_UNIT = re.compile(r"\[([^\]]*)\]")


@dataclass(frozen=True)
class Entry:
    """One documented parameter; empty strings where the docstring is silent."""

    kind: str = ""
    unit: str = ""
    description: str = ""


def first_line(docstring: str | None) -> str:
    """The summary of a docstring, or nothing."""
    return next((line.strip() for line in (docstring or "").splitlines() if line.strip()), "")


def documented(docstring: str | None) -> dict[str, Entry]:
    """The entries of the section Parameters by name.

    The unit is what stands in brackets after the type, else in the first brackets of the description.
    """
    pieces = _HEADING.split(inspect.cleandoc(docstring or ""))
    sections = dict(zip(pieces[1::2], pieces[2::2], strict=True))
    entries: dict[str, Entry] = {}
    names: list[str] = []
    for line in sections.get("Parameters", "").splitlines():
        match = _ENTRY.match(line)
        if match:
            names = [name.strip() for name in match[1].split(",")]
            entries |= dict.fromkeys(names, _head(match[2] or ""))
        elif line.startswith(" "):
            entries |= {name: _longer(entries[name], line.strip()) for name in names}
    return entries


def _head(text: str) -> Entry:
    unit = _UNIT.search(text)
    return Entry(_UNIT.sub("", text).strip(), unit[1] if unit else "")


def _longer(entry: Entry, line: str) -> Entry:
    description = f"{entry.description} {line}".strip()
    unit = _UNIT.search(description)
    return Entry(entry.kind, entry.unit or (unit[1] if unit else ""), description)
