"""What docstrings say, so that it is written only once: units of parameters, and duties that were not done."""

from __future__ import annotations

import difflib
import inspect
import re
from abc import ABC
from functools import cache
from typing import Any, ClassVar

from dmoc.basics.records import dataclass

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


class Named:
    """What is made with arguments by name; one that does not exist is refused with those that do."""

    def __new__(cls, *given: Any, **named: Any) -> Any:
        kind: Any = cls
        known, any_name = _arguments(kind)
        if wrong := [name for name in named if name not in known and not any_name]:
            raise ValueError(_unknown(cls, wrong[0], known))
        return super().__new__(cls)


@cache
def _arguments(cls: Any) -> tuple[tuple[str, ...], bool]:
    """The names of the arguments that make one, and whether it takes any name."""
    _, *entries = inspect.signature(cls.__init__).parameters.values()
    return tuple(entry.name for entry in entries), any(entry.kind is entry.VAR_KEYWORD for entry in entries)


def _unknown(cls: type, name: str, known: tuple[str, ...]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    meant = f" (did you mean {near[0]}?)" if near else ""
    return f"{cls.__name__} has no argument {name}{meant}; it takes: {', '.join(known) or 'none'}"


class Duties(Named, ABC):
    """A base class whose abstract methods are the duties of whoever derives from it.

    `one_of` names methods of which at least one must be written, too.
    """

    one_of: ClassVar[tuple[str, ...]] = ()

    def __new__(cls, *given: Any, **named: Any) -> Any:
        if lacking := sorted(cls.__abstractmethods__, key=_place(cls)):
            raise ValueError(_told(cls, lacking))
        if cls.one_of and all(getattr(cls, name) is getattr(_home(cls, name), name) for name in cls.one_of):
            raise ValueError(_nothing_told(cls))
        return super().__new__(cls, *given, **named)


def _home(cls: type, name: str) -> type:
    """The base class where a method was first written."""
    return next(base for base in reversed(cls.__mro__) if name in vars(base))


def _place(cls: type) -> Any:
    """Sorts methods as they stand in the base class."""
    return lambda name: list(vars(_home(cls, name))).index(name)


def _call(cls: type, name: str) -> str:
    """A method as it is written: excess(self, q, v)."""
    method = inspect.getattr_static(_home(cls, name), name)
    if isinstance(method, property):
        return f"property {name}"
    return f"method {name}({', '.join(inspect.signature(method).parameters)})"


def _told(cls: type, lacking: list[str]) -> str:
    first, *others = lacking
    home = _home(cls, first)
    purpose = first_line(inspect.getattr_static(home, first).__doc__).rstrip(".")
    also = f"; {' and '.join(others)} is missing, too" if others else ""
    meant = _misspelt(cls, first)
    return f"{cls.__name__} has no {_call(cls, first)}{meant}. {purpose}{also}: see help(dmoc.{home.__name__})"


def _nothing_told(cls: Any) -> str:
    home = _home(cls, cls.one_of[0])
    calls = [name for name in cls.one_of if not name.endswith(("_of", "_at"))]
    own = next((_misspelt(cls, name) for name in calls if _misspelt(cls, name)), "")
    return (
        f"{cls.__name__} states nothing{own}: write at least one of the methods {', '.join(calls)}; "
        f"see help(dmoc.{home.__name__})"
    )


def _misspelt(cls: type, name: str) -> str:
    """` (did you mean it by excesses?)` where a method of the user's own is called nearly so."""
    known = set(dir(_home(cls, name)))
    own = [other for other in dir(cls) if other not in known and callable(getattr(cls, other))]
    near = difflib.get_close_matches(name, own, n=1, cutoff=0.7)
    return f" (did you mean it by {near[0]}?)" if near else ""
