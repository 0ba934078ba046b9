"""The words of a page: facts, the problem, checks, meshes and versions, in HTML."""

from __future__ import annotations

import sys
from html import escape
from typing import Any

import numpy as np

from dmoc import __version__
from dmoc.answers.facts import facts_of
from dmoc.checks.verification import Report
from dmoc.reports.missions import legs_table
from dmoc.reports.teams import bodies_table
from dmoc.reports.verdict import verdict_words
from dmoc.reports.words import checks, failure, figures, ladder, scene


def headline(solution: Any) -> str:
    """What was found, in one line."""
    if solution.optimal:
        found = figures(solution) if solution.problem is not None else repr(solution).partition(": ")[2]
        return escape(found).replace("^2", "\u00b2")
    return escape(f"not solved: {solution.status} after {solution.iterations} iterations, the last iterate")


def verdict(solution: Any, report: Report | None) -> tuple[bool, str]:
    """Whether all is well, and a line on it."""
    if not solution.optimal:
        return False, f"What to try: {solution.message}."
    if report is None:
        return solution.success, "The file's problem is not at hand: there are no checks, zones and limits."
    told = str(verdict_words(solution, report))
    notes = "".join(f" Note that {warning}." for warning in solution.warnings)
    head = "" if solution.success else f"{solution.status.capitalize()}: {solution.message}. "
    return bool(solution.success and report.ok), head + told + notes


def sections(solution: Any, report: Report | None) -> list[tuple[str, str, bool]]:
    """Title and content of each section below the pictures, and whether it is shown unfolded."""
    known, found = solution.problem is not None, []
    if known and solution.optimal:
        facts = facts_of(solution).lines()
        found.append(("The answer in numbers", rows(facts), True))
    if known and (hasattr(solution, "legs") or hasattr(solution, "members")):
        table = legs_table(solution) if hasattr(solution, "legs") else bodies_table(solution)
        found.append(("Part by part", as_html(table), True))
    if known:
        found.append(("The problem", as_html(scene(solution.problem)), True))
    if report is not None:
        found.append(("Checks of the answer", as_html(checks(report)), True))
    if not solution.optimal:
        found.append(("What did not hold", as_html(failure(solution)), True))
    found.append(("Meshes, coarse to fine", as_html(ladder(solution)), False))
    return [*found, ("Where it comes from", rows(_origin(solution)), False)]


def _origin(solution: Any) -> list[tuple[str, str]]:
    """The problem's name and parameters, dates, and the versions that it was made with."""
    known = solution.provenance
    about = [("problem", known.problem_name)]
    about += [(name, f"{value}") for name, value in known.parameters.items()]
    dates = ("epoch (TDB)", known.epoch), ("frame", known.frame), ("centre", known.center)
    about += [(name, value) for name, value in dates if value]
    if known.source_hash:
        about.append(("hash of the problem file", known.source_hash[:16]))
    about += [("options", f"{known.options}")] * bool(known.options)
    python = ".".join(map(str, sys.version_info[:3]))
    versions = known.versions or {"dmoc": __version__, "numpy": np.__version__, "python": python}
    about.append(("versions", ", ".join(f"{name} {version}" for name, version in versions.items())))
    return about + [("saved", known.created)] * bool(known.created)


def rows(pairs: Any) -> str:
    """Names with what belongs to them."""
    cells = (f"<tr><th>{escape(name)}</th><td>{escape(words)}</td></tr>" for name, words in pairs)
    return f"<table class=pairs>{''.join(cells)}</table>"


def as_html(shown: Any) -> str:
    """What a report prints, as HTML: tables, texts, and groups of both."""
    if hasattr(shown, "renderables"):
        return "".join(as_html(part) for part in shown.renderables)
    if hasattr(shown, "columns"):
        return _table(shown)
    words = str(shown)
    tag = "h3" if getattr(shown, "style", "") == "bold" else "p"
    return f"<{tag}>{escape(words)}</{tag}>" if words.strip() else ""


def _table(table: Any) -> str:
    lines = list(zip(*(column.cells for column in table.columns), strict=True))
    if not table.show_header:
        pairs = (f"<tr><th>{_cell(name)}</th><td>{_cell(words)}</td></tr>" for name, words in lines)
        return f"<table class=pairs>{''.join(pairs)}</table>"
    kinds = ["number" if column.justify == "right" else "text" for column in table.columns]
    heads = (f"<th class={k}>{_cell(c.header)}</th>" for k, c in zip(kinds, table.columns, strict=True))
    body = (
        "".join(f"<td class={kind}>{_cell(cell)}</td>" for kind, cell in zip(kinds, line, strict=True))
        for line in lines
    )
    found = "".join(f"<tr>{line}</tr>" for line in body)
    return f"<div class=wide><table><tr>{''.join(heads)}</tr>{found}</table></div>"


def _cell(cell: Any) -> str:
    words = escape(str(cell)).replace("\n", "<br>")
    return f"<b class=bad>{words}</b>" if "red" in str(getattr(cell, "style", "")) else words
