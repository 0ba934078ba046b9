"""A report of an answer as one HTML file, which opens without a network."""

from __future__ import annotations

import json
import os
from functools import cache
from html import escape
from importlib.resources import files
from typing import Any

import matplotlib
import numpy as np

from dmoc.basics.arguments import of_kind
from dmoc.basics.files import as_path, whole_file
from dmoc.checks.verification import Report
from dmoc.pages.bundle import bundle, bundle_file
from dmoc.pages.cost import cost_section, read_study
from dmoc.pages.over_time import panels_over_time
from dmoc.pages.panels import plain, read
from dmoc.pages.stage import FRAMES, stage_of
from dmoc.pages.traces import rounded
from dmoc.pages.words import headline, sections, verdict
from dmoc.plots.mission import draw_line as draw_mission_line
from dmoc.plots.path import draw_path
from dmoc.plots.style import SETTINGS, readable
from dmoc.plots.team import draw_lines as draw_team_lines
from dmoc.results.solution import Solution
from dmoc.scene.named import attached_as_named
from dmoc.structure.front import verify

# A report is a file of this kind.
SUFFIXES = (".html", ".htm")


def report(
    solution: Any,
    path: str | os.PathLike,
    checked: Report | None = None,
    study: str | os.PathLike | None = None,
    dark: bool = False,
) -> None:
    """Write a report of an answer as one HTML file, whole or not at all; nothing outside it is needed.

    It has the path to turn, with a body that flies, panels over time that are linked, what was found, the
    problem in words, checks, meshes and versions.

    Parameters
    ----------
    solution : Solution, MissionSolution or TeamSolution
        Of a loaded one the problem that it names is looked up; without it there are no zones and checks.
    path : path
        Ends in .html.
    checked : Report, optional
        What `verify` found; it is called if this is not given.
    study : path, optional
        What accuracy costs, as `dmoc study --csv` wrote it.
    dark : bool
        Dark whatever the browser asks for. Otherwise it is light or dark as that is.

    Raises
    ------
    ValueError
        If the file does not end in .html, its folder does not exist, plotly is not installed, or the path of
        the solution is not finite.
    """
    check_page(path)
    parts: Any = getattr(solution, "parts", None)
    if parts is None:
        of_kind("solution", solution, Solution)
    if not all(np.isfinite(part.path.position).all() for part in parts):
        raise ValueError("the path is not finite, so there is nothing to show; see the checks and messages")
    trials = None if study is None else read_study(study)
    solution = _with_problem(solution)
    if checked is None and solution.problem is not None and solution.optimal:
        checked = verify(solution)
    text = page(solution, checked, trials, dark)
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def check_page(path: str | os.PathLike) -> None:
    """ValueError unless a report can be written into such a file here."""
    if as_path(path).suffix.lower() not in SUFFIXES:
        raise ValueError(f"cannot write a report into {path}: the file must end in .html")
    bundle_file()


def _with_problem(solution: Any) -> Any:
    """The solution with the problem that its file names; as it is where there is none."""
    try:
        return solution if solution.problem is not None else attached_as_named(solution)
    except ValueError:
        # The page says that the problem is not at hand.
        return solution


def page(solution: Any, checked: Report | None = None, trials: Any = None, dark: bool = False) -> str:
    """The HTML of a report."""
    late, unit = readable(solution.time, "s")
    name = solution.provenance.problem_name.replace("_", " ")
    good, told = verdict(solution, checked)
    with matplotlib.rc_context(SETTINGS):
        shown: dict[str, Any] = {"time": unit, "panels": panels_over_time(solution, late)}
        if solution.dimension == 1:
            shown["line"] = read(_draw_line, solution)
        shown["stage"] = stage_of(solution) if solution.dimension != 1 else None
        times = np.linspace(solution.time[0], solution.time[-1], FRAMES)
        shown["times"] = rounded(times / late)
        below = sections(solution, checked)
        if trials:
            words, shown["cost"] = cost_section(trials, solution.provenance.objective_unit)
            below.append(words)
    if shown["stage"]:
        shown["stage"]["unit"] = plain(shown["stage"]["unit"])
    return _filled(
        title=escape(name),
        theme="dark" if dark else "",
        headline=headline(solution),
        verdict=escape(told),
        good="good" if good else "bad",
        sections="".join(_section(*one) for one in below),
        style=_asset("page.css"),
        script=_asset("page.js"),
        # Such an end of a script in a text would end that of the page.
        data=json.dumps(shown, separators=(",", ":"), allow_nan=False).replace("</", "<\\/"),
        plotly=bundle(),
    )


def _draw_line(axes: Any, solution: Any) -> None:
    """Position against time in one dimension."""
    if hasattr(solution, "legs"):
        draw_mission_line(axes, solution)
    elif hasattr(solution, "members"):
        draw_team_lines(axes, solution)
    else:
        draw_path(axes, solution)


def _section(title: str, content: str, opened: bool) -> str:
    return f"<details{' open' * opened}><summary>{escape(title)}</summary>{content}</details>"


def _filled(**parts: str) -> str:
    """The page with its parts in the places that are named {{so}}."""
    made = _asset("page.html")
    # Each place is filled once: what is filled in may hold such names itself.
    first, *rest = made.split("{{")
    pieces = [first]
    for piece in rest:
        name, _, after = piece.partition("}}")
        pieces += [parts[name], after]
    return "".join(pieces)


@cache
def _asset(name: str) -> str:
    return files("dmoc.pages").joinpath(name).read_text(encoding="utf-8")
