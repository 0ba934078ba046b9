"""Result files: a Solution as netCDF-4, with units, and back again to the last bit.

xarray opens them and has a view of a Solution, but is not needed to write or read one: with pandas,
which it brings along, it takes longer to load than a solution to be checked.

Dimensions: node, end (of a step), step, axis, channel (one a control). Every multiplier group is a
variable of its own, `multiplier_<side>_<name>`, whose attribute `key` is its name in
`Guess.multipliers`. What is not an array is an attribute; what is neither number nor text is JSON.
Reading takes numbers and text from the file and runs nothing. A checksum after the end of the HDF5
content is verified before anything opens the file: the HDF5 library may hang on a damaged one. Files of
format 1 have none and are read as they are.
"""

from __future__ import annotations

import io
import json
import os
import platform
import re
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from dmoc.files import AGAIN, is_sealed, path_of, sealed, whole_file
from dmoc.lobatto import scheme
from dmoc.mesh import Guess
from dmoc.solution import Error, Level, Provenance, Solution

FORMAT = "dmoc solution"
FORMAT_VERSION = 2
HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
WRITTEN_BY = "results are written by Solution.save and by dmoc solve"

# SI unit of the unknown or row behind each multiplier, by the last part of its name; other rows have none.
DUAL_UNITS = {
    "dynamics": "m/s",
    "position": "m",
    "velocity": "m/s",
    "force": "N",
    "mass": "kg",
    "duration": "s",
}


# (dimensions, values, attributes) of every variable by name
Table = dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, Any]]]


def write(solution: Solution, path: str | os.PathLike) -> None:
    """Write a solution to a netCDF-4 file, whole or not at all; see `Solution.save`."""
    import h5netcdf
    import h5py

    # in memory, since HDF5 may crash where a disk is full
    content = io.BytesIO()
    with h5netcdf.File(content, "w") as file:
        file.attrs.update(_attributes(solution))
        for name, (dimensions, values, attributes) in _variables(solution).items():
            for dimension, size in zip(dimensions, values.shape, strict=True):
                if dimension not in file.dimensions:
                    file.dimensions[dimension] = size
            kind = h5py.string_dtype() if values.dtype == object else values.dtype
            file.create_variable(name, dimensions, kind, data=values).attrs.update(attributes)
    with whole_file(path) as temporary:
        temporary.write_bytes(sealed(content.getvalue()))


def read(path: str | os.PathLike) -> Solution:
    """The solution in a file, without its problem; see `dmoc.load`."""
    file = path_of(path)
    _refuse_what_is_no_netcdf(file)
    whole = is_sealed(file)
    facts, table = _open(file)
    _refuse_other_formats(file, facts)
    if facts["format_version"] > 1 and not whole:
        raise ValueError(f"{file} was cut short or changed: it lacks its checksum; {AGAIN}")
    try:
        return _check_shapes(_solution(facts, table))
    except KeyError as error:
        raise ValueError(f"{file} is damaged: it lacks the attribute {error}; {AGAIN}") from None
    except (TypeError, ValueError, AttributeError) as error:
        raise ValueError(f"{file} is damaged: {_one_line(error)}; {AGAIN}") from None


def to_dataset(solution: Solution) -> Any:
    """An `xarray.Dataset` of everything a solution holds except its problem."""
    import xarray

    return xarray.Dataset(_variables(solution), attrs=_attributes(solution))


def _variables(solution: Solution) -> Table:
    path, about = solution.path, solution.provenance
    at = "step" if path.hold else "node"
    control_unit = ", ".join(dict.fromkeys(about.control_units))
    table = {
        "time": (("node",), solution.time, "s", "time"),
        "end_time": (("end",), solution.end_times, "s", "time of the step ends"),
        "mesh": (("end",), path.mesh, "1", "step ends as fractions of the duration"),
        "position": (("node", "axis"), path.position, "m", "position"),
        "velocity": (("end", "axis"), solution.velocity, "m/s", "velocity from the discrete momenta"),
        "momentum": (("end", "axis"), solution.momentum, "m/s", "discrete momentum per unit mass"),
        "force": ((at, "axis"), solution.force, "N", "force of the actuator"),
        "control": ((at, "channel"), path.control, control_unit, "control"),
        "mass": (("node",), path.mass, "kg", "mass"),
        "start_velocity": (("axis",), path.start_velocity, "m/s", "velocity at the start"),
        "goal_velocity": (("axis",), path.goal_velocity, "m/s", "velocity at the goal"),
    }
    variables: Table = {
        name: (dims, values, {"units": unit, "long_name": words})
        for name, (dims, values, unit, words) in table.items()
    }
    labels = {"axis": list("xyz"[: solution.dimension]), "channel": list(about.control_labels)}
    coordinates = {name: ((name,), np.array(values, object), {"units": "1"}) for name, values in labels.items()}
    return variables | _multipliers(solution) | coordinates


def _solution(facts: dict[str, Any], table: Table) -> Solution:
    """The solution in a file's attributes and variables."""
    return Solution(
        None,
        _path(facts, table),
        _array(table, "velocity"),
        _array(table, "momentum"),
        _array(table, "force"),
        float(facts["objective"]),
        bool(facts["success"]),
        str(facts["status"]),
        str(facts["message"]),
        tuple(Level(**level) for level in json.loads(facts["ladder"])),
        tuple((str(name), float(size), str(unit)) for name, size, unit in json.loads(facts["worst"])),
        tolerance=json.loads(facts["tolerance"]),
        error=Error(**error) if (error := json.loads(facts["error"])) else None,
        reason=str(facts["reason"]),
        provenance=_provenance(facts, table),
    )


def _path(facts: dict[str, Any], table: Table) -> Guess:
    groups = [name for name in table if name.startswith("multiplier_")]
    return Guess(
        _array(table, "mesh"),
        int(facts["order"]),
        bool(facts["hold"]),
        float(facts["duration"]),
        _array(table, "position"),
        _array(table, "control"),
        _array(table, "mass"),
        _array(table, "start_velocity"),
        _array(table, "goal_velocity"),
        {str(table[name][2]["key"]): _array(table, name) for name in groups},
    )


def _provenance(facts: dict[str, Any], table: Table) -> Provenance:
    return Provenance(
        str(facts["problem"]),
        json.loads(facts["parameters"]),
        float(facts["start_time"]),
        str(facts["objective_unit"]),
        tuple(str(label) for label in table["channel"][1]),
        tuple(json.loads(facts["control_units"])),
        json.loads(facts["options"]),
        str(facts["source_hash"]),
        json.loads(facts["versions"]),
        str(facts["created"]),
    )


def _array(table: Table, name: str) -> np.ndarray:
    if name not in table:
        raise ValueError(f"it lacks the variable {name!r}")
    return np.array(table[name][1], float)


def _attributes(solution: Solution) -> dict[str, Any]:
    """What a reader of the file looks for first as attributes of their own, the rest as JSON."""
    about = solution.provenance
    if not about.created:
        now = datetime.now(UTC).isoformat(timespec="seconds")
        about = replace(about, created=now, versions=_versions() | about.versions)
    plain = "order steps duration status message objective reason iterations build_s solve_s"
    texts = {
        "parameters": about.parameters,
        "options": about.options,
        "versions": about.versions,
        "control_units": about.control_units,
        "ladder": [asdict(level) for level in solution.ladder],
        "worst": solution.worst,
        "tolerance": solution.tolerance,
        "error": asdict(solution.error) if solution.error else None,
    }
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "problem": about.problem_name,
        "source_hash": about.source_hash,
        "created": about.created,
        "start_time": about.start_time,
        "time_unit": "s",
        "objective_unit": about.objective_unit,
        "hold": int(solution.hold),
        "success": int(solution.success),
        **{name: getattr(solution, name) for name in plain.split()},
        **{name: _text(value) for name, value in texts.items()},
    }


def _versions() -> dict[str, str]:
    import casadi

    from dmoc import __version__

    return {
        "dmoc": __version__,
        "casadi": casadi.__version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
    }


def _text(value: Any) -> str:
    """JSON; arrays become lists and what JSON has no word for its Python text."""

    def plain(other: Any) -> Any:
        return other.tolist() if isinstance(other, (np.ndarray, np.generic)) else repr(other)

    return json.dumps(value, default=plain)


def _multipliers(solution: Solution) -> Table:
    variables: Table = {}
    for key, values in solution.path.multipliers.items():
        _, side, group = key.split(":", 2)
        name = re.sub(r"\W+", "_", f"multiplier_{side}_{group}")
        while name in variables:
            name += "_"
        unit = DUAL_UNITS.get(group.split(".")[-1] if side == "column" or group == "dynamics" else "")
        cost = solution.provenance.objective_unit or "1"
        attributes = {"units": f"{cost}/({unit})" if unit else cost, "key": key}
        attributes["long_name"] = f"multiplier of {group}; of nodes and steps per fraction of the duration"
        variables[name] = (_dimensions(solution, key.split(":")[0], values.shape), values, attributes)
    return variables


def _dimensions(solution: Solution, kind: str, shape: tuple[int, int]) -> tuple[str, str]:
    """Names of a multiplier group's two dimensions: those of the path where they are the same thing."""
    kind = {"smooth": "node", "control": "step" if solution.hold else "node"}.get(kind, kind)
    sizes = {"node": len(solution.path.position), "step": solution.steps}
    first = kind if sizes.get(kind) == shape[0] else f"count_{shape[0]}"
    return first, "axis" if shape[1] == solution.dimension else f"component_{shape[1]}"


def _refuse_what_is_no_netcdf(file: Path) -> None:
    if not file.is_file():
        raise ValueError(f"{file} {'is not a file' if file.exists() else 'does not exist'}; {WRITTEN_BY}")
    try:
        with open(file, "rb") as stream:
            head = stream.read(len(HDF5_SIGNATURE))
    except OSError as error:
        raise ValueError(f"{file} cannot be read: {error.strerror}") from None
    if len(head) < len(HDF5_SIGNATURE) and HDF5_SIGNATURE.startswith(head):
        raise ValueError(f"{file} is cut short: it holds {len(head)} bytes; {AGAIN}")
    if head != HDF5_SIGNATURE:
        raise ValueError(f"{file} is not a result of dmoc: it is no netCDF-4 file; {WRITTEN_BY}")


def _open(file: Path) -> tuple[dict[str, Any], Table]:
    """Attributes and variables of a netCDF file, as they were written."""
    import h5netcdf

    try:
        with h5netcdf.File(file, "r", phony_dims="access", decode_vlen_strings=True) as data:
            table = {name: (one.dimensions, one[...], dict(one.attrs)) for name, one in data.variables.items()}
            return dict(data.attrs), table
    except Exception as error:  # the layers below raise whatever they trip over
        raise ValueError(f"{file} is damaged or cut short ({_one_line(error)}); {AGAIN}") from None


def _one_line(error: Exception) -> str:
    """What an error says, short enough to be read in a terminal."""
    text = " ".join(str(error).split())
    return text if len(text) <= 160 else text[:157] + "..."


def _refuse_other_formats(file: Path, facts: dict[str, Any]) -> None:
    version = facts.get("format_version")
    if facts.get("format") == "dmoc sweep":
        raise ValueError(f"{file} is the result of a sweep; draw it with: dmoc plot {file}")
    if facts.get("format") != FORMAT or not isinstance(version, (int, np.integer)):
        raise ValueError(f"{file} is netCDF but not a result of dmoc; {WRITTEN_BY}")
    if version > FORMAT_VERSION:
        raise ValueError(
            f"{file} comes from a newer dmoc (format {version}, this one reads up to {FORMAT_VERSION}); "
            "update dmoc"
        )


def _check_shapes(solution: Solution) -> Solution:
    """Raise ValueError unless the arrays belong together: what was cut or edited must not get further."""
    path, axes = solution.path, solution.dimension
    degree = scheme(path.order).degree
    nodes = solution.steps * degree + 1
    controls = solution.steps if path.hold else nodes
    shapes = {
        "position": (path.position, (nodes, axes)),
        "mass": (path.mass, (nodes,)),
        "control": (path.control, (controls, len(solution.provenance.control_labels))),
        "force": (solution.force, (controls, axes)),
        "velocity": (solution.velocity, (solution.steps + 1, axes)),
        "momentum": (solution.momentum, (solution.steps + 1, axes)),
        "start_velocity": (path.start_velocity, (axes,)),
        "goal_velocity": (path.goal_velocity, (axes,)),
    }
    for name, (values, wanted) in shapes.items():
        if values.shape != wanted:
            raise ValueError(f"{name} has shape {values.shape} where {wanted} belongs")
    if not (np.diff(path.mesh) > 0).all() or path.mesh[0] != 0 or path.mesh[-1] != 1:
        raise ValueError("its mesh does not increase from 0 to 1")
    return solution
