"""Result files by what they hold: the solution of a transfer, or that of a mission."""

from __future__ import annotations

import os
from typing import Any

from dmoc.basics.files import as_path
from dmoc.results import solution as transfers
from dmoc.results.netcdf import format_of


def load(path: str | os.PathLike) -> Any:
    """The solution in a file that `save` of a `Solution` or a `MissionSolution` wrote. Nothing in it is run.

    The problem is not in the file: `load(path).attach(problem)` gives it back. A loaded solution is
    as good a guess as the original: `solve(problem, guess=load(path))`.

    Raises
    ------
    ValueError
        If there is no such file, or it is damaged, foreign or from a newer dmoc.
    """
    if as_path(path).is_file() and format_of(path) == "dmoc mission":
        from dmoc.missions.solution import read_mission

        return read_mission(path)
    return transfers.load(path)
