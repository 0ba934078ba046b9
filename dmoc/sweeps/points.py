"""A point of a sweep whose paths were kept: a path to start from, or its whole answer."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dmoc.scene.named import named
from dmoc.scene.problem_file import load_problem
from dmoc.structure.front import load, solve
from dmoc.sweeps.data import read_sweep, result
from dmoc.sweeps.plan import ordered
from dmoc.sweeps.worker import unpack

if TYPE_CHECKING:
    from xarray import Dataset

# How a point is named.
FORM = "a point of a sweep is FILE:NUMBER or FILE:NAME=VALUE,..., such as map.nc:duration=12"


def split(path: str | os.PathLike) -> tuple[Path, str] | None:
    """The file and the point of a name such as `map.nc:duration=12`; None for that of a file."""
    file, colon, point = str(path).rpartition(":")
    return (Path(file), point) if colon and not Path(path).exists() and Path(file).is_file() else None


def start_from(path: str | os.PathLike) -> Any:
    """What to start a solve from: the answer in a file, or the path of a point of a sweep.

    Raises
    ------
    ValueError
        If there is no such file or point, it is not solved, or its path was not kept.
    """
    found = split(path)
    return load(path) if found is None else _path(read_sweep(found[0]), *found)


def answer_of(file: Path, point: str) -> Any:
    """The answer of a point, found again from its path with the numerics of the sweep.

    Raises
    ------
    ValueError
        As `start_from`, or if the problem file is not there or has changed.
    """
    data = read_sweep(file)
    start, about = _path(data, file, point), data.attrs
    source = named(str(about["problem"]), str(about["source_hash"]))
    if source is None:
        raise ValueError(f"{file} is a sweep of {about['problem']!r}, of which there is no problem file here")
    problem_file = load_problem(source)
    if problem_file.source_hash != about["source_hash"]:
        raise ValueError(f"{problem_file.path} has changed since {file} was made; sweep again")
    where = place_of(data, file, point)
    values = {str(name): _plain(data[name].isel(_along(data[name], where)).item()) for name in data.coords}
    numerics = {name: _known(about[name]) for name in ("order", "steps", "tol", "hold")}
    problem = problem_file.make(**(_known(about["settings"]) | values))
    return solve(problem, guess=start, **numerics)


def place_of(data: Dataset, file: Path, point: str) -> dict[str, int]:
    """The place of a point along each dimension: the one of that number, or the nearest to given values."""
    sizes = {str(name): size for name, size in result(data, "success").sizes.items()}
    if point.isdigit():
        count = int(np.prod(list(sizes.values())))
        if int(point) >= count:
            raise ValueError(f"{file} has points 0 to {count - 1}; got {point}")
        places = np.unravel_index(int(point), tuple(sizes.values()))
        return {name: int(place) for name, place in zip(sizes, places, strict=True)}
    given = dict(entry.split("=", 1) for entry in point.split(",") if "=" in entry)
    known = [str(name) for name in data.coords]
    if len(given) != point.count(",") + 1 or set(given) != set(known):
        raise ValueError(f"{FORM}; {file} has {', '.join(known)}, got {point!r}")
    far = sum(_far(data[name].values, given[name], name).reshape(_shape(data[name], sizes)) for name in known)
    places = np.unravel_index(
        int(np.argmin(np.broadcast_to(far, tuple(sizes.values())))), tuple(sizes.values())
    )
    return {name: int(place) for name, place in zip(sizes, places, strict=True)}


def _shape(coordinate: Any, sizes: dict[str, int]) -> tuple[int, ...]:
    return tuple(size if name in coordinate.dims else 1 for name, size in sizes.items())


def _far(values: np.ndarray, wanted: str, name: str) -> np.ndarray:
    """How far the values of a parameter are from a wanted one, as a part of their span."""
    if not ordered(values):
        return np.array([0.0 if str(value) == wanted else 1.0 for value in values])
    try:
        goal = float(wanted)
    except ValueError:
        raise ValueError(f"{name} must be a number; got {wanted!r}") from None
    return np.abs(values - goal) / (float(np.ptp(values)) or 1.0)


def _path(data: Dataset, file: Path, point: str) -> Any:
    if "path" not in data and "found_path" not in data:
        raise ValueError(f"{file} has no paths; sweep again with --keep paths")
    where = place_of(data, file, point)
    packed = str(result(data, "path").isel(where).item())
    if not packed:
        status = result(data, "status").isel(where).item()
        raise ValueError(f"the point {point} of {file} is not solved ({status}), so it has no path")
    return unpack(packed)


def _along(coordinate: Any, where: dict[str, int]) -> dict[str, int]:
    return {name: place for name, place in where.items() if name in coordinate.dims}


def _known(attribute: Any) -> Any:
    """A fact of the file as Python has it."""
    return json.loads(attribute) if isinstance(attribute, str) else _plain(attribute)


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
