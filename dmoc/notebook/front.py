"""How an answer shows itself: what the methods of an answer look up here, by these names."""

from __future__ import annotations

import os
from typing import Any

from dmoc.answers.facts import Facts, facts_of
from dmoc.scene.named import attached_as_named

# What draws and writes is loaded where it is asked for: a fact takes a tenth of the time that takes.


def plot(solution: Any, path: str | os.PathLike | None = None, dark: bool = False) -> Any:
    """`Solution.plot`."""
    from dmoc.plots.page import figure, save_figure
    from dmoc.plots.sheet import darkened

    return darkened(figure(solution), dark) if path is None else save_figure(solution, path, dark=dark)


def animate(solution: Any, path: str | os.PathLike, frames: int = 80, dark: bool = False) -> None:
    """`Solution.animate`."""
    from dmoc.films.film import animate as write

    write(solution, path, frames, dark)


def facts(solution: Any) -> Facts:
    """`Solution.facts`."""
    return facts_of(solution if solution.problem is not None else attached_as_named(solution))


def html(solution: Any) -> str:
    """`Solution._repr_html_`."""
    from dmoc.notebook.page import page

    return page(solution)


def table(solution: Any) -> Any:
    """`Solution.table`."""
    from dmoc.notebook.table import node_table

    return node_table(solution)


def estimate(found: Any, path: str | os.PathLike | None = None, dark: bool = False) -> Any:
    """`Estimate.plot`."""
    from dmoc.charts.identification import estimate_figure
    from dmoc.charts.study import save_page
    from dmoc.plots.sheet import darkened

    page = estimate_figure(found)
    return darkened(page, dark) if path is None else save_page(page, path, dark=dark)
