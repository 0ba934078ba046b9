"""An answer node by node, as a table of pandas."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dmoc.basics.quaternions import QUATERNION
from dmoc.configurations.coordinates import ATTITUDE, QUATERNION_NAMES
from dmoc.results.moments import moving, step_places


def node_table(solution: Any) -> Any:
    """A DataFrame with a row a node; of legs or bodies those of all, whose names stand first."""
    import pandas

    what = "leg" if hasattr(solution, "legs") else "body"
    parts = solution.parts
    if parts == (solution,):
        return pandas.DataFrame(_columns(solution))
    names = getattr(solution, "part_names", None) or [one.provenance.problem_name for one in parts]
    tables = [pandas.DataFrame({what: name} | _columns(one)) for name, one in zip(names, parts, strict=True)]
    return pandas.concat(tables, ignore_index=True)


def _columns(solution: Any) -> dict[str, np.ndarray]:
    path, made = solution.path, solution.path.coordinates
    found = {"time [s]": solution.time}

    def add(what: str, labels: Sequence[str], unit: str, values: np.ndarray | None) -> None:
        for i, label in enumerate(labels if values is not None else ()):
            found[" ".join(filter(None, [what, label, f"[{unit}]" if unit else ""]))] = values[:, i]  # type: ignore[index]

    # With held forces a node has that of the step behind it, the last node that of the step before it.
    rows = np.minimum(step_places(path, path.fractions)[0], len(path.control) - 1) if path.hold else slice(None)
    motions = moving(solution, path.fractions)[1]
    of_turn = [
        f"{block.body}.{axis}".lstrip(".") for block in made.blocks if block.kind == ATTITUDE for axis in "xyz"
    ]
    wheels = [str(i + 1) for i in range(int(made.spins.sum()))]
    torque = None if solution.torque is None else solution.torque[rows]
    quaternions = made.attitude_labels if len(of_turn) > len("xyz") else QUATERNION_NAMES[:QUATERNION]
    add("position", made.place_labels, "m", solution.position)
    add("velocity", made.place_labels, "m/s", motions[:, made.speeds])
    add("attitude", quaternions, "", solution.attitude)
    add("rate", of_turn, "rad/s", motions[:, made.rates])
    add("wheel momentum", wheels, "N m s", motions[:, made.spins])
    add("force", made.place_labels, "N", solution.force[rows])
    add("torque", of_turn, "N m", torque)
    about = solution.provenance
    for i, (label, unit) in enumerate(zip(about.control_labels, about.control_units, strict=True)):
        # A control that is a component of the force stands there already.
        if label not in made.place_labels:
            add("control", [label], unit, path.control[rows][:, i : i + 1])
    found["mass [kg]"] = path.mass
    return found
