"""What accuracy costs in time, on a page: from the table that a study wrote."""

from __future__ import annotations

import csv
import os
from pathlib import Path
from typing import Any, get_type_hints

from dmoc.charts.study import study_figure
from dmoc.pages.panels import read_axes
from dmoc.pages.words import as_html
from dmoc.reports.study import study_tables
from dmoc.studies.accuracy import Trial


def read_study(path: str | os.PathLike) -> list[Trial]:
    """The trials of a study.

    Raises
    ------
    ValueError
        If the file is none that `dmoc study --csv` wrote.
    """
    kinds = get_type_hints(Trial)
    try:
        with Path(path).open(newline="", encoding="utf-8") as file:
            return [
                Trial(**{name: _value(kinds[name], text) for name, text in row.items()})
                for row in csv.DictReader(file)
            ]
    except (KeyError, TypeError, ValueError):
        raise ValueError(
            f"{path} is no table of a study; write one with: dmoc study PROBLEM --csv {path}"
        ) from None
    except OSError as error:
        raise ValueError(f"cannot read {path}: {error.strerror}") from None


def _value(kind: Any, text: str) -> Any:
    """A value of a table: a text, a number, true or false, or nothing."""
    if kind is str:
        return text
    if kind is bool:
        return {"True": True, "False": False}[text]
    if not text:
        return None
    return float(text) if kind is float else int(text)


def cost_section(trials: list[Trial], unit: str) -> tuple[tuple[str, str, bool], dict[str, Any] | None]:
    """The section with the tables, and its chart of error against time."""
    solved = any(trial.status == "solved" for trial in trials)
    chart = read_axes(study_figure(trials).axes[0]) if solved else None
    content = '<div id="cost" class="panel"></div>' + as_html(study_tables(trials, unit))
    return ("What accuracy costs", content, True), chart
