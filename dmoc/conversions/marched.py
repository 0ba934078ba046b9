"""A path that was marched forward as a table: states at the step ends."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np

from dmoc.basics.files import whole_file
from dmoc.configurations.coordinates import QUATERNION_NAMES
from dmoc.configurations.of_problem import configuration_of
from dmoc.conversions.stretches import columns_of
from dmoc.motion.march import Trajectory


def marched_columns(trajectory: Trajectory, problem: Any) -> dict[str, np.ndarray]:
    """Every number of a trajectory by names with units, one entry a step end; `problem` names its bodies."""
    made = configuration_of(getattr(problem, "stretches", (problem,))[0]).coordinates
    labels = made.place_labels
    turned = made.attitude_labels if made.blocks[0].body else QUATERNION_NAMES
    bodies = [f"{label.rsplit('.', 1)[0]}." if "." in label else "" for label in turned[::4]]
    axes = [f"{body}{axis}" for body in bodies for axis in "xyz"]
    found = {"time [s]": trajectory.time}
    for name, names, unit, values in (
        ("position", labels, "m", trajectory.position),
        ("velocity", labels, "m/s", trajectory.velocity),
        ("attitude", turned, "1", trajectory.attitude),
        ("rate", axes, "rad/s", trajectory.rate),
    ):
        if values is not None:
            found |= columns_of(name, names, unit, values)
    if (stored := trajectory.wheel_momentum) is not None:
        found |= columns_of("wheel momentum", [str(i + 1) for i in range(stored.shape[1])], "N m s", stored)
    return found | {"mass [kg]": trajectory.mass, "energy [J/kg]": trajectory.energy}


def write_marched(trajectory: Trajectory, problem: Any, path: Path) -> None:
    """Write these columns as csv, whole or not at all."""
    columns = marched_columns(trajectory, problem)
    with whole_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([repr(float(x)) for x in row] for row in zip(*columns.values(), strict=True))
