"""A fact of an answer, and all of them as a table."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from dmoc.basics.records import dataclass


@dataclass(frozen=True)
class Fact:
    """One number that is asked of an answer: its name, value and unit, the line it stands in, and its words."""

    name: str
    value: float
    unit: str
    line: str
    words: str


class Facts(Mapping[str, Fact]):
    """Facts of one answer by their names; printed, a table of few lines."""

    def __init__(self, found: Iterable[Fact]):
        self._found = {fact.name: fact for fact in found}

    def __getitem__(self, name: str) -> Fact:
        if name not in self._found:
            raise KeyError(f"{name!r}; there are {', '.join(map(repr, self._found)) or 'none'}")
        return self._found[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._found)

    def __len__(self) -> int:
        return len(self._found)

    def lines(self) -> list[tuple[str, str]]:
        """What a report shows: the name of each line and what stands in it."""
        found: dict[str, list[str]] = {}
        for fact in self._found.values():
            found.setdefault(fact.line, []).append(fact.words)
        return [(line, ", ".join(words)) for line, words in found.items()]

    def __repr__(self) -> str:
        """A line each."""
        lines = self.lines()
        width = max((len(line) for line, _ in lines), default=0)
        return "\n".join(f"{line:{width}}  {words}" for line, words in lines) or "no facts"

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        from html import escape

        rows = (f"<tr><th>{escape(line)}</th><td>{escape(words)}</td></tr>" for line, words in self.lines())
        return f"<table>{''.join(rows)}</table>"
