"""What a result file holds of a body that turns, and of its reaction wheels."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from dmoc.basics.quaternions import AXES, QUATERNION
from dmoc.configurations.coordinates import ATTITUDE, PLACE, WHEELS, Block, Coordinates
from dmoc.configurations.of_problem import configuration_of
from dmoc.results.netcdf import Table, as_array

# The variables of each kind of block: its coordinates along the path, its velocities at the start and the goal.
NAMES = {
    PLACE: ("position", "start_velocity", "goal_velocity"),
    WHEELS: ("wheel_integral", "start_wheel_momentum", "goal_wheel_momentum"),
    ATTITUDE: ("attitude", "start_rate", "goal_rate"),
}


def _reaction_unit(solution: Any) -> str:
    """One unit for all constraint forces, or one each where they differ."""
    if solution.problem is None:
        return "m2/s2 of quaternions and angles, m/s2 of lengths"
    units = [unit.replace("^", "") for unit in configuration_of(solution.problem).reaction_units]
    return units[0] if len(set(units)) == 1 else ", ".join(units)


def turning_variables(solution: Any, at: str, between: str) -> dict[str, tuple]:
    """Dimensions, values, unit and words of every variable; none for a point mass.

    `at` is the dimension along which controls stand, `between` says what they are between nodes.
    """
    path, made = solution.path, solution.path.coordinates
    words = "constraint force per unit mass"
    held: dict[str, tuple] = {}
    if path.reaction is not None:
        held["reaction"] = (("node", "constraint"), path.reaction, _reaction_unit(solution), words)
    if not made.turns:
        return held
    ends = {"start": path.start_velocity, "goal": path.goal_velocity}
    found = held | {
        "attitude": (("node", "quaternion"), solution.attitude, "1", "unit quaternion, body to space"),
        "rate": (("end", "body_axis"), solution.rate, "rad/s", "angular rate in body axes"),
        "spin": (("end", "body_axis"), solution.spin, "m2/s", "angular momentum per unit mass, body axes"),
        "torque": ((at, "body_axis"), solution.torque, "N m", f"torque in body axes{between}"),
    }
    for end, moving in ends.items():
        found[f"{end}_rate"] = (("body_axis",), moving[made.rates], "rad/s", f"rate at the {end}")
    if made.spins.any():
        stored = path.position[:, made.kinds == WHEELS]
        words, motors = "angular momentum of each reaction wheel", f"motor torque on each wheel{between}"
        found |= {
            "wheel_integral": (("node", "wheel"), stored, "N m s2", f"time integral of the {words}"),
            "wheel_momentum": (("end", "wheel"), solution.wheel_momentum, "N m s", words),
            "wheel_torque": ((at, "wheel"), solution.wheel_torque, "N m", motors),
        }
        for end, moving in ends.items():
            held = moving[made.spins]
            found[f"{end}_wheel_momentum"] = (("wheel",), held, "N m s", f"{words} at the {end}")
    return found


def turning_fields(table: Table) -> dict[str, np.ndarray]:
    """The fields of a solution that a file holds of a body that turns."""
    names = [*["rate", "spin", "torque"] * ("attitude" in table)]
    names += ["wheel_momentum", "wheel_torque"] * ("wheel_integral" in table)
    return {name: as_array(table, name) for name in names}


def turning_path(table: Table) -> tuple[Coordinates | None, np.ndarray, np.ndarray, np.ndarray]:
    """What coordinates in a file are made of (None: of a place), they, and the velocities at both ends."""
    if "attitude" not in table:
        position, start, goal = (as_array(table, name) for name in NAMES[PLACE])
        return _several(table), position, start, goal
    wheels = as_array(table, "wheel_integral").shape[1] if "wheel_integral" in table else 0
    made = _several(table) or Coordinates.of_rigid_body(as_array(table, "position").shape[1], wheels)
    # A variable holds the blocks of its kind for all bodies.
    kinds = dict.fromkeys(block.kind for block in made.blocks)
    position, start, goal = (
        np.concatenate([as_array(table, NAMES[kind][which]) for kind in kinds], axis=-1)
        for which in range(len(NAMES[PLACE]))
    )
    return made, position, start, goal


def _several(table: Table) -> Coordinates | None:
    """Of what the coordinates of several bodies are made, by their labels; None for a body without a name."""
    blocks = []
    for dimension, kind in (("axis", PLACE), ("quaternion", ATTITUDE)):
        labels = table[dimension][1] if dimension in table else ()
        bodies = Counter(str(label).rpartition(".")[0] for label in labels)
        blocks += [Block(kind, count, body) for body, count in bodies.items()]
    return Coordinates(tuple(blocks)) if any(block.body for block in blocks) else None


def turning_shapes(solution: Any, nodes: int, controls: int) -> dict[str, tuple]:
    """Arrays and the shapes that they must have."""
    path, ends = solution.path, solution.steps + 1
    if not path.attitudes:
        return {}
    turning = len(path.attitudes)
    found = {
        "rate": (solution.rate, (ends, AXES * turning)),
        "spin": (solution.spin, (ends, AXES * turning)),
        "torque": (solution.torque, (controls, AXES * turning)),
        "attitude": (solution.attitude, (nodes, QUATERNION * turning)),
    }
    if wheels := int(path.coordinates.spins.sum()):
        found["wheel_momentum"] = (solution.wheel_momentum, (ends, wheels))
        found["wheel_torque"] = (solution.wheel_torque, (controls, wheels))
    return found
