"""The result of a sweep: an xarray Dataset over the swept parameters, to netCDF and back."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dmoc.basics.files import AGAIN
from dmoc.basics.records import dataclass
from dmoc.results.netcdf import Format, format_of, one_line, read_table, write_table
from dmoc.sweeps.plan import Plan

if TYPE_CHECKING:
    from xarray import Dataset

# The name and version by which a file of this kind is known, its description, and the remedy where it is none.
SWEEP_FILE = Format("dmoc sweep", 2, "the result of a sweep", "sweeps are written by dmoc sweep")


@dataclass(frozen=True)
class Column:
    """A variable of the result: what an empty record has there, and what it is."""

    empty: Any
    unit: str
    words: str


# The variables of the result; a record that lacks one has the empty value there.
COLUMNS = {
    "objective": Column(np.nan, "", "objective; not a number where not solved"),
    "duration": Column(np.nan, "s", "duration found"),
    "final_mass": Column(np.nan, "kg", "mass at the goal"),
    "propellant": Column(np.nan, "kg", "mass burned"),
    "effort": Column(np.nan, "N^2 s", "half the integral of the squared force"),
    "impulse": Column(np.nan, "N s", "integral of the force"),
    "success": Column(False, "1", "whether the optimisation succeeded"),
    "status": Column("", "1", "how the optimisation ended"),
    "message": Column("", "1", "what to try, or what was refused, where not solved"),
    "checks_hold": Column(False, "1", "whether every check of the answer holds"),
    "failed_check": Column("", "1", "the failed check that is furthest beyond its limit"),
    "failed_by": Column(np.nan, "1", "how many times beyond its limit that check is"),
    "from_neighbour": Column(False, "1", "whether it was started from a neighbour's answer"),
    "order": Column(0, "1", "order of the scheme"),
    "steps": Column(0, "1", "steps of the mesh"),
    "iterations": Column(0, "1", "iterations of Ipopt on all meshes"),
    "build_s": Column(np.nan, "s", "time spent on building"),
    "solve_s": Column(np.nan, "s", "time spent in Ipopt"),
    "verify_s": Column(np.nan, "s", "time spent on checks"),
}
# Paths are a variable of the result where they are kept; empty where not solved.
PATH = {"path": Column("", "1", "path, controls and multipliers of the answer, packed")}
# Variables of flights with errors, where these are asked for.
FLIGHTS = {
    "miss": Column(np.nan, "m", "95 of 100 flights with errors end nearer to the goal than this"),
    "miss_speed": Column(np.nan, "m s-1", "95 of 100 flights differ less from the velocity there"),
    "broken": Column(np.nan, "1", "part of flights that break the limit that is broken most often"),
}


def sweep_dataset(
    plan: Plan,
    records: Sequence[Mapping[str, Any]],
    facts: Mapping[str, Any],
    more: Mapping[str, Column] | None = None,
) -> Dataset:
    """The dataset of all records, in the order of the points; with `more` variables than `COLUMNS`.

    A result that has the name of a swept parameter is called found_<name>.
    """
    import xarray

    dimensions = tuple(plan.names)
    if plan.sampled:
        dimensions = ("sample_" if "sample" in plan.names else "sample",)
    coordinates: dict[str, Any] = {}
    for i, (parameter, values) in enumerate(zip(plan.parameters, plan.values, strict=True)):
        about = {"units": _netcdf_unit(parameter.unit), "long_name": parameter.description or parameter.name}
        coordinates[parameter.name] = (dimensions if plan.sampled else dimensions[i : i + 1], values, about)
    variables: dict[str, Any] = {}
    for name, column in (COLUMNS | dict(more or {})).items():
        given = [record.get(name) for record in records]
        filled = [column.empty if value is None else value for value in given]
        kind = object if isinstance(column.empty, str) else type(column.empty)
        about = {"units": column.unit, "long_name": column.words}
        values = np.array(filled, kind).reshape(plan.shape)
        variables[f"found_{name}" if name in plan.names else name] = (dimensions, values, about)
    solved = [record for record in records if record.get("success")]
    kinds = {name: _common(solved, f"objective_{name}") for name in ("name", "unit", "sense")}
    objective = variables["found_objective" if "objective" in plan.names else "objective"]
    objective[2].update(
        units=kinds["unit"] or "1", kind=kinds["name"] or "objective", sense=kinds["sense"] or 1
    )
    return xarray.Dataset(
        variables, coordinates, {"format": SWEEP_FILE.name, "format_version": SWEEP_FILE.version, **facts}
    )


def write_sweep(data: Dataset, path: str | os.PathLike) -> None:
    """Write a dataset to a netCDF-4 file, whole or not at all."""
    write_table(path, dict(data.attrs), {name: _stored(data, name) for name in map(str, data.variables)})


def _stored(data: Dataset, name: str) -> tuple:
    """A variable as netCDF holds it, with the attributes by which xarray knows it again."""
    variable = data[name]
    about = dict(variable.attrs)
    if variable.dtype == bool:
        about["dtype"] = "bool"
    # CF conventions: a variable names the coordinates that are not dimensions themselves, as in a sample
    along = [str(other) for other in data.coords if other not in data.dims]
    if along and name not in data.coords:
        about["coordinates"] = " ".join(along)
    values = variable.values.astype("int8") if variable.dtype == bool else variable.values
    return tuple(map(str, variable.dims)), values, about


def read_sweep(path: str | os.PathLike) -> Dataset:
    """The dataset of a sweep's file.

    Raises
    ------
    ValueError
        If the file is not there, is not the result of a sweep, or is damaged.
    """
    import xarray

    facts, table = read_table(path, SWEEP_FILE)
    try:
        return xarray.decode_cf(xarray.Dataset(table, attrs=facts), decode_times=False)
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is damaged: {one_line(error)}; {AGAIN}") from None


def is_sweep(path: str | os.PathLike) -> bool:
    """Whether a file says it is the result of a sweep; ValueError if it is damaged."""
    return format_of(path) == SWEEP_FILE.name


def as_attributes(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Facts as netCDF holds them: numbers and texts as they are, the rest as JSON."""
    return {
        name: value
        if isinstance(value, (str, int, float)) and not isinstance(value, bool)
        else json.dumps(value)
        for name, value in facts.items()
    }


def result(data: Dataset, name: str) -> Any:
    """A variable of the result, also where a swept parameter has its name."""
    return data[f"found_{name}"] if f"found_{name}" in data else data[name]


def _netcdf_unit(documented: str) -> str:
    return "1" if documented in ("", "-") else documented


def _common(records: Sequence[Mapping[str, Any]], name: str) -> Any:
    """What all records say, or None if they do not agree."""
    values = {record.get(name) for record in records}
    return values.pop() if len(values) == 1 else None
