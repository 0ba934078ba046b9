"""Result files: a Solution as netCDF-4, with units, and back again to the last bit.

xarray opens them and has a view of a Solution, but is not needed to write or read one: importing it, with
pandas, takes longer than the check of a solution.

Dimensions: node, end (of a step), step, axis, channel (one a control). Every multiplier group is a
variable of its own, `multiplier_<side>_<name>`, whose attribute `key` is its name in
`DiscretePath.multipliers`. All else are attributes: numbers and texts as they are, other values as JSON.
"""

from __future__ import annotations

import json
import os
import platform
import re
from collections.abc import Callable
from dataclasses import asdict, replace
from datetime import UTC, datetime
from typing import Any

import numpy as np

from dmoc.motion.lobatto import scheme
from dmoc.motion.path import COSTATE, DiscretePath, Key
from dmoc.results.facts import Error, Level, Provenance
from dmoc.results.netcdf import Format, Table, as_array, damage_told, read_table, write_table
from dmoc.results.turning import turning_fields, turning_path, turning_shapes, turning_variables

# The name and version by which a file of this kind is known, its description, and the remedy where it is none.
SOLUTION_FILE = Format(
    "dmoc solution", 2, "a result of dmoc", "results are written by Solution.save and by dmoc solve"
)

# A multiplier belongs to an unknown or row of this SI unit, by the last part of its name; other rows have none.
DUAL_UNITS = {
    "dynamics": "m/s",
    "position": "m",
    "velocity": "m/s",
    "force": "N",
    "mass": "kg",
    "duration": "s",
}

# The attributes of a scene with real dates.
DATES = ("epoch", "frame", "center")

# How the control goes on from one node to the next.
BETWEEN = (
    "; within a step the polynomial through its nodes or, where that breaks a limit, another control of the "
    "same impulse within it: the polynomial drawn to its mean, two constant pieces, or the values of the nodes"
)


def write(solution: Any, path: str | os.PathLike) -> None:
    """Write a Solution to a netCDF-4 file, whole or not at all."""
    write_table(path, *solution_parts(solution))


def solution_parts(solution: Any, plain: bool = False) -> tuple[dict[str, Any], Table]:
    """Attributes and variables of a solution; without variables if `plain`."""
    return _attributes(solution), {} if plain else _variables(solution)


def solution_of(facts: dict[str, Any], table: Table, make: Callable) -> Any:
    """The solution of attributes and variables that fit together; `make` takes the arguments of Solution."""
    return _check_shapes(_solution(facts, table, make))


def read(path: str | os.PathLike, make: Callable) -> Any:
    """The solution in a file, without its problem; `make` takes the arguments of Solution."""
    facts, table = read_table(path, SOLUTION_FILE)
    with damage_told(path):
        return solution_of(facts, table, make)


def to_dataset(solution: Any) -> Any:
    """An `xarray.Dataset` of everything a solution holds except its problem."""
    import xarray

    return xarray.Dataset(_variables(solution), attrs=_attributes(solution))


def _variables(solution: Any) -> Table:
    path, about = solution.path, solution.provenance
    at = "step" if path.hold else "node"
    between, speeds = ", held over each step" if path.hold else BETWEEN, path.coordinates.speeds
    control_unit = ", ".join(dict.fromkeys(about.control_units))
    table = {
        "time": (("node",), solution.time, "s", "time"),
        "end_time": (("end",), solution.end_times, "s", "time of the step ends"),
        "mesh": (("end",), path.mesh, "1", "step ends as fractions of the duration"),
        "position": (("node", "axis"), path.place, "m", "position"),
        "velocity": (("end", "axis"), solution.velocity, "m/s", "velocity from the discrete momenta"),
        "momentum": (("end", "axis"), solution.momentum, "m/s", "discrete momentum per unit mass"),
        "force": ((at, "axis"), solution.force, "N", f"force of the actuator{between}"),
        "control": ((at, "channel"), path.control, control_unit, f"control{between}"),
        "mass": (("node",), path.mass, "kg", "mass"),
        "start_velocity": (("axis",), path.start_velocity[speeds], "m/s", "velocity at the start"),
        "goal_velocity": (("axis",), path.goal_velocity[speeds], "m/s", "velocity at the goal"),
    }
    table |= turning_variables(solution, at, between)
    variables: Table = {
        name: (dims, values, {"units": unit, "long_name": words})
        for name, (dims, values, unit, words) in table.items()
    }
    labels = {"axis": list(path.coordinates.place_labels), "channel": list(about.control_labels)}
    if path.coordinates.turns and path.coordinates.blocks[0].body:
        labels["quaternion"] = path.coordinates.attitude_labels
    coordinates = {name: ((name,), np.array(values, object), {"units": "1"}) for name, values in labels.items()}
    return variables | _multipliers(solution) | coordinates


def _solution(facts: dict[str, Any], table: Table, make: Callable) -> Any:
    """The solution in a file's attributes and variables."""
    return make(
        problem=None,
        path=_path(facts, table),
        velocity=as_array(table, "velocity"),
        momentum=as_array(table, "momentum"),
        force=as_array(table, "force"),
        **outcome_fields(facts),
        **turning_fields(table),
        provenance=provenance_of(facts, tuple(str(label) for label in table["channel"][1])),
    )


def outcome_fields(facts: dict[str, Any]) -> dict[str, Any]:
    """The fields of a solution, of a transfer or of a mission, on how the solve ended."""
    return {
        "objective": float(facts["objective"]),
        "success": bool(facts["success"]),
        "status": str(facts["status"]),
        "message": str(facts["message"]),
        "ladder": tuple(Level(**level) for level in json.loads(facts["ladder"])),
        "worst": tuple((str(row), float(size), str(unit)) for row, size, unit in json.loads(facts["worst"])),
        # Files that were written before there were warnings have none.
        "warnings": tuple(map(str, json.loads(facts.get("warnings", "[]")))),
        "tolerance": json.loads(facts["tolerance"]),
        "error": Error(**error) if (error := json.loads(facts["error"])) else None,
        "reason": str(facts["reason"]),
    }


def _path(facts: dict[str, Any], table: Table) -> DiscretePath:
    groups = [name for name in table if name.startswith("multiplier_")]
    made, position, start, goal = turning_path(table)
    return DiscretePath(
        as_array(table, "mesh"),
        int(facts["order"]),
        bool(facts["hold"]),
        float(facts["duration"]),
        position,
        as_array(table, "control"),
        as_array(table, "mass"),
        start,
        goal,
        {Key.parse(str(table[name][2]["key"])): as_array(table, name) for name in groups},
        made,
        as_array(table, "reaction") if "reaction" in table else None,
    )


def provenance_of(facts: dict[str, Any], control_labels: tuple[str, ...] = ()) -> Provenance:
    """Where a solution comes from, from the attributes of its file."""
    return Provenance(
        str(facts["problem"]),
        json.loads(facts["parameters"]),
        float(facts["start_time"]),
        str(facts["objective_unit"]),
        control_labels,
        tuple(json.loads(facts["control_units"])),
        json.loads(facts["options"]),
        str(facts["source_hash"]),
        json.loads(facts["versions"]),
        str(facts["created"]),
        # Only scenes with real dates have them.
        **{name: str(facts.get(name, "")) for name in DATES},
        # Only engines and the like have it.
        smoothing=float(facts["smoothing"]) if "smoothing" in facts else None,
    )


def _attributes(solution: Any) -> dict[str, Any]:
    """Attributes of the file: facts that a reader looks for first each by itself, the rest as JSON."""
    about = solution.provenance
    # A solution that was loaded and is saved again keeps the time and the versions of its solve.
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
        "warnings": solution.warnings,
        "tolerance": solution.tolerance,
        "error": asdict(solution.error) if solution.error else None,
    }
    return {
        "format": SOLUTION_FILE.name,
        "format_version": SOLUTION_FILE.version,
        "problem": about.problem_name,
        "source_hash": about.source_hash,
        "created": about.created,
        "start_time": about.start_time,
        "time_unit": "s",
        **{name: value for name in DATES if (value := getattr(about, name))},
        "objective_unit": about.objective_unit,
        **({} if about.smoothing is None else {"smoothing": about.smoothing}),
        "hold": int(getattr(solution, "hold", False)),
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
    """A value as JSON: arrays become lists, and values that JSON cannot hold become their Python text."""

    def plain(other: Any) -> Any:
        return other.tolist() if isinstance(other, (np.ndarray, np.generic)) else repr(other)

    return json.dumps(value, default=plain)


def _multipliers(solution: Any) -> Table:
    variables: Table = {}
    for key, values in solution.path.multipliers.items():
        name = re.sub(r"\W+", "_", f"multiplier_{key.side}_{key.group}")
        # Two groups may have one name once it holds only letters and digits; `key` tells them apart.
        while name in variables:
            name += "_"
        unit = DUAL_UNITS.get(key.group.split(".")[-1] if key.side == "column" or key == COSTATE else "")
        cost = solution.provenance.objective_unit or "1"
        attributes = {"units": f"{cost}/({unit})" if unit else cost, "key": str(key)}
        attributes["long_name"] = f"multiplier of {key.group}; of nodes and steps per fraction of the duration"
        variables[name] = (_dimensions(solution, key.kind, values.shape), values, attributes)
    return variables


def _dimensions(solution: Any, kind: str, shape: tuple[int, int]) -> tuple[str, str]:
    """Names of a multiplier group's two dimensions: those of the path where they count the same."""
    kind = {"smooth": "node", "control": "step" if solution.hold else "node"}.get(kind, kind)
    sizes = {"node": len(solution.path.position), "step": solution.steps}
    first = kind if sizes.get(kind) == shape[0] else f"count_{shape[0]}"
    return first, "axis" if shape[1] == solution.path.place.shape[1] else f"component_{shape[1]}"


def _check_shapes(solution: Any) -> Any:
    """Raise ValueError unless the arrays fit together, as those of a file that was edited may not."""
    path, axes = solution.path, solution.path.place.shape[1]
    degree = scheme(path.order).degree
    nodes = solution.steps * degree + 1
    controls = solution.steps if path.hold else nodes
    shapes = {
        "position": (path.place, (nodes, axes)),
        "mass": (path.mass, (nodes,)),
        "control": (path.control, (controls, len(solution.provenance.control_labels))),
        "force": (solution.force, (controls, axes)),
        "velocity": (solution.velocity, (solution.steps + 1, axes)),
        "momentum": (solution.momentum, (solution.steps + 1, axes)),
        "start_velocity": (path.start_velocity, path.coordinates.speeds.shape),
        "goal_velocity": (path.goal_velocity, path.coordinates.speeds.shape),
    }
    shapes |= turning_shapes(solution, nodes, controls)
    for name, (values, wanted) in shapes.items():
        if values.shape != wanted:
            raise ValueError(f"{name} has shape {values.shape} where {wanted} belongs")
    if not (np.diff(path.mesh) > 0).all() or path.mesh[0] != 0 or path.mesh[-1] != 1:
        raise ValueError("its mesh does not increase from 0 to 1")
    return solution
