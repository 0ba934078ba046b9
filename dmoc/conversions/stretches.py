"""A solution as stretches of a path, the legs of a mission or bodies of a team: tables with named columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from dmoc.basics.records import dataclass
from dmoc.configurations.coordinates import QUATERNION_NAMES
from dmoc.motion.lobatto import scheme
from dmoc.motion.momenta import node_velocities

# Legs whose places differ by more than this part of the path [-] where they meet count from several frames.
APART = 1e-5


@dataclass(frozen=True)
class Stretch:
    """What is known at the nodes of a leg, of a body, or of a whole transfer.

    Attributes
    ----------
    name : str
        Of the leg or the body; of a transfer that of the problem.
    time : array, shape (nodes,)
        [s]
    position, velocity : arrays, shape (nodes, axes)
        [m], [m/s]; velocities from the discrete momenta at the step ends, of a polynomial with those inside.
    columns : dict of array
        All there is, by names with units, one entry a node; NaN inside the steps for what only their ends have.
    """

    name: str
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    columns: dict[str, np.ndarray]


def kind_of(solution: Any) -> str:
    """What the stretches of a solution are: leg, body, or nothing of a transfer."""
    return "leg" if hasattr(solution, "legs") else "body" if hasattr(solution, "members") else ""


def stretches_of(solution: Any) -> list[Stretch]:
    """The legs of a mission, the bodies of a team, or the one path of a transfer."""
    if hasattr(solution, "legs"):
        return [_stretch(leg, leg.provenance.problem_name) for leg in solution.legs]
    if hasattr(solution, "members"):
        pairs = zip(solution.part_names, solution.parts, strict=True)
        return [_stretch(one, name) for name, one in pairs]
    return [_stretch(solution, solution.provenance.problem_name)]


def in_space(solution: Any, form: str) -> list[Stretch]:
    """The stretches of a path in space, for a format that knows nothing else.

    Raises
    ------
    ValueError
        If there are not three axes, several bodies in one path, or legs in several frames.
    """
    found = stretches_of(solution)
    axes = found[0].position.shape[1]
    one = solution.parts[0]
    if axes != 3 or len(one.path.coordinates.place_labels) != 3:
        what = f"this has {axes} axes" if axes < 3 else "this is of several bodies on links"
        raise ValueError(f"{form} holds places of a body in space, x, y and z; {what}: use csv or json")
    if kind_of(solution) == "leg":
        size = max(float(np.ptp(stretch.position, axis=0).max()) for stretch in found)
        for before, after in pairwise(found):
            if np.abs(before.position[-1] - after.position[0]).max() > APART * size:
                raise ValueError(
                    f"{form} holds a path in one frame, but {after.name} begins elsewhere than {before.name} "
                    "ends: use csv or json"
                )
    return found


def _stretch(solution: Any, name: str) -> Stretch:
    path, made = solution.path, solution.path.coordinates
    count, degree = len(path.position), scheme(path.order).degree
    place = solution.position
    moved = replace(path, position=place)
    velocity = node_velocities(moved, solution.velocity) if place.size else np.zeros((count, 0))
    labels = made.place_labels
    columns = {"time [s]": solution.time}
    columns |= columns_of("position", labels, "m", place) | columns_of("velocity", labels, "m/s", velocity)
    columns |= columns_of("force", labels, "N", _at_nodes(solution.force, path.hold, degree))
    about = solution.provenance
    control = _at_nodes(path.control, path.hold, degree)
    for i, (label, unit) in enumerate(zip(about.control_labels, about.control_units, strict=True)):
        columns[f"control {label} [{unit}]"] = control[:, i]
    columns["mass [kg]"] = path.mass
    if solution.attitude is not None:
        turned = made.attitude_labels if made.blocks[0].body else QUATERNION_NAMES
        columns |= columns_of("attitude", turned, "1", solution.attitude)
        for what, values, unit in (("rate", solution.rate, "rad/s"), ("torque", solution.torque, "N m")):
            at_nodes = (
                _at_ends(values, count, degree) if what == "rate" else _at_nodes(values, path.hold, degree)
            )
            names = [f"{label.rsplit('.', 1)[0]}." if "." in label else "" for label in turned[::4]]
            columns |= columns_of(what, [f"{body}{axis}" for body in names for axis in "xyz"], unit, at_nodes)
    if solution.wheel_momentum is not None:
        stored = _at_ends(solution.wheel_momentum, count, degree)
        columns |= columns_of("wheel momentum", [str(i + 1) for i in range(stored.shape[1])], "N m s", stored)
    return Stretch(name, solution.time, place, velocity, columns)


def columns_of(name: str, labels: Sequence[str], unit: str, values: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of an array by names such as `position x [m]`."""
    return {f"{name} {label} [{unit}]": values[:, i] for i, label in enumerate(labels)}


def _at_nodes(values: np.ndarray, hold: bool, degree: int) -> np.ndarray:
    """Values of nodes; a held one at every node of its step but the last, which is the next step's."""
    return np.vstack([np.repeat(values, degree, axis=0), values[-1:]]) if hold else values


def _at_ends(values: np.ndarray, count: int, degree: int) -> np.ndarray:
    found = np.full((count, values.shape[1]), np.nan)
    found[::degree] = values
    return found
