"""What a user calls: it takes a transfer or a mission, and does for each what is made for it."""

from __future__ import annotations

import os
from functools import wraps
from typing import Any

from dmoc.basics.files import as_path
from dmoc.checks import verification
from dmoc.results import solution as transfers
from dmoc.results.netcdf import format_of
from dmoc.solver import solve as transfer_solver

# A file of a mission says that it has this format.
MISSION = "dmoc mission"


@wraps(transfer_solver.solve)
def solve(problem: Any, *given: Any, structure: bool = False, **numerics: Any) -> Any:
    problem = getattr(problem, "alone", None) or problem
    if not hasattr(problem, "joints"):
        found = _by_structure(problem, *given, **numerics) if structure else None
        return transfer_solver.solve(problem, *given, **numerics) if found is None else found
    # What solves missions is loaded for them alone.
    from dmoc.missions.climb import solve_mission

    return solve_mission(problem, *given, **numerics)


def _by_structure(problem: Any, *given: Any, **numerics: Any) -> Any:
    from dmoc.structure.solve import solve_by_structure

    names = ("order", "steps", "tol", "hold", "mesh", "guess", "options", "progress", "compiled", "time_limit")
    numerics = dict(zip(names, given, strict=False)) | numerics
    if numerics.pop("hold", False) or numerics.pop("mesh", None) is not None:
        raise ValueError(
            "with structure=True forces are not held and meshes are chosen: give neither hold nor mesh"
        )
    return solve_by_structure(problem, **numerics)


@wraps(verification.verify)
def verify(solution: Any, *given: Any, **more: Any) -> Any:
    if not hasattr(solution, "impulses"):
        return verification.verify(solution, *given, **more)
    from dmoc.missions.checks import verify_mission

    return verify_mission(solution, *given, **more)


@wraps(transfers.load)
def load(path: str | os.PathLike) -> Any:
    if not as_path(path).is_file() or format_of(path) != MISSION:
        return transfers.load(path)
    from dmoc.missions.solution import read_mission

    found = read_mission(path)
    if not found.arcs:
        return found
    from dmoc.structure.solution import structured

    return structured(found)
