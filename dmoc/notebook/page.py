"""An answer as a notebook shows it: figure, closing line, facts, checks and meshes, in HTML."""

from __future__ import annotations

import base64
import io
from functools import partial
from html import escape
from typing import Any
from weakref import ref

import numpy as np

from dmoc.answers.facts import facts_of
from dmoc.checks.verification import Report
from dmoc.plots.page import figure
from dmoc.reports.words import answer, checks, failure, ladder
from dmoc.scene.named import attached_as_named
from dmoc.structure.front import verify

# The figure has so many dots an inch: 930 wide, as a column of a notebook is, and some 60 kB.
DOTS = 70
# Reports of answers that were shown, by the identity of the answer, which is checked no more than once.
_reports: dict[int, tuple[Any, Report]] = {}


def page(solution: Any) -> str:
    """HTML with nothing outside it: the figure is inside, and nothing in it runs."""
    solution = _with_problem(solution)
    if solution.problem is None:
        return _picture(solution, None) + _paragraph(repr(solution))
    report = verdict(solution) if solution.optimal else None
    parts = [_picture(solution, report)]
    if report is None:
        told: Any = failure(solution, quiet=True)
        parts += [_paragraph(str(line)) for line in told.renderables]
    else:
        parts.append(_paragraph(str(answer(solution, report, quiet=True))))
        parts.append(facts_of(solution)._repr_html_())
        parts.append(_folded("Checks of the answer", _table(checks(report)), opened=not report.ok))
    parts.append(_folded("Meshes, coarse to fine", _table(ladder(solution))))
    return "\n".join(parts)


def verdict(solution: Any) -> Report:
    """The checks of a solution, done once."""
    known = _reports.get(id(solution))
    if known is not None and known[0]() is solution:
        return known[1]
    report = verify(solution)
    _reports[id(solution)] = ref(solution, partial(_forget, id(solution))), report
    return report


def _forget(key: int, _: Any) -> None:
    _reports.pop(key, None)


def _with_problem(solution: Any) -> Any:
    """The solution with the problem that its file names; as it is where there is none."""
    if solution.problem is not None:
        return solution
    try:
        return attached_as_named(solution)
    except ValueError:
        # A notebook shows what there is: the page then has neither checks nor zones, and says of what it is.
        return solution


def _picture(solution: Any, report: Report | None) -> str:
    if not np.isfinite(solution.position).all():
        return ""
    content = io.BytesIO()
    figure(solution, report).savefig(content, format="png", dpi=DOTS)
    data = base64.b64encode(content.getvalue()).decode()
    return f'<img alt="{escape(repr(solution))}" src="data:image/png;base64,{data}">'


def _paragraph(words: str) -> str:
    return f"<p>{escape(words)}</p>"


def _folded(title: str, content: str, opened: bool = False) -> str:
    return f"<details{' open' * opened}><summary>{escape(title)}</summary>{content}</details>"


def _table(table: Any) -> str:
    """A table of a report as HTML."""
    heads = "".join(f"<th>{escape(str(column.header))}</th>" for column in table.columns)
    rows = zip(*(column.cells for column in table.columns), strict=True)
    body = ("".join(f"<td>{escape(str(cell))}</td>" for cell in row) for row in rows)
    return f"<table><tr>{heads}</tr>{''.join(f'<tr>{row}</tr>' for row in body)}</table>"
