"""MissionSolution: the answer of a mission, leg by leg; saved to and loaded from netCDF."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import field, replace
from typing import Any, NamedTuple

import numpy as np

from dmoc.basics.arguments import of_kind
from dmoc.basics.records import dataclass
from dmoc.chains.path import MissionPath
from dmoc.results.facts import Error, Level, Provenance
from dmoc.results.netcdf import (
    Format,
    Table,
    as_array,
    damage_told,
    plain_facts,
    prefixed,
    read_table,
    unprefixed,
    write_table,
)
from dmoc.results.solution import Outcome, Solution
from dmoc.results.table import outcome_fields, provenance_of, solution_of, solution_parts
from dmoc.scene.mission import Mission
from dmoc.scene.rounding import sharp_as_parts

# The name and version by which a file of a mission is known.
MISSION_FILE = Format(
    "dmoc mission", 1, "a result of a mission", "results are written by MissionSolution.save and by dmoc solve"
)


class Kick(NamedTuple):
    """An impulse of a solution: its joint, time [s], place [m] and velocity change [m/s]."""

    joint: str
    time: float
    position: np.ndarray
    change: np.ndarray

    @property
    def size(self) -> float:
        """Magnitude of the velocity change [m/s]."""
        return float(np.linalg.norm(self.change))


@dataclass(frozen=True)
class MissionSolution(Outcome):
    """The answer to a mission, whether it succeeded or not.

    Attributes
    ----------
    problem : Mission or None
        None after `load`; see `attach`.
    legs : tuple of Solution
        Each leg like the solution of a transfer between two known states.
    impulses : tuple of Kick
    final_mass : float
        Mass behind the goal [kg].
    own, forces : dict of array
        Unknowns and multipliers of the joints, by their names; see `MissionPath`.
    arcs : tuple
        What made the legs, as plain data: the arcs of a transfer, or impulses that were added and taken.
    objective, success, status, message, ladder, worst, warnings, tolerance, error, reason, provenance
        As of a `Solution`.
    """

    problem: Mission | None
    legs: tuple[Solution, ...]
    impulses: tuple[Kick, ...]
    own: dict[str, np.ndarray]
    forces: dict[str, np.ndarray]
    objective: float
    final_mass: float
    success: bool
    status: str
    message: str
    ladder: tuple[Level, ...]
    worst: tuple[tuple[str, float, str], ...] = ()
    warnings: tuple[str, ...] = ()
    tolerance: float | None = None
    error: Error | None = None
    reason: str = ""
    arcs: tuple[list[Any], ...] = ()
    provenance: Provenance = field(kw_only=True)

    @property
    def path(self) -> MissionPath:
        """The paths of all legs with their multipliers, good to start from."""
        begins = tuple(leg.provenance.start_time for leg in self.legs)
        by_joint: dict[str, float] = {}
        for kick in self.impulses:
            by_joint[kick.joint] = max(by_joint.get(kick.joint, 0.0), kick.size)
        idle = tuple(name for name, size in by_joint.items() if size == 0.0)
        legs = tuple(leg.path for leg in self.legs)
        return MissionPath(legs, begins, self.own, self.forces, idle=idle)

    @property
    def parts(self) -> tuple[Solution, ...]:
        """The legs, each like the solution of a transfer."""
        return self.legs

    @property
    def order(self) -> int:
        """The largest order among the legs."""
        return max(leg.order for leg in self.legs)

    @property
    def steps(self) -> int:
        """The steps of all legs."""
        return sum(leg.steps for leg in self.legs)

    @property
    def dimension(self) -> int:
        return self.legs[0].dimension

    @property
    def duration(self) -> float:
        """Duration of the whole mission [s]."""
        return float(sum(leg.duration for leg in self.legs))

    @property
    def time(self) -> np.ndarray:
        """Times of all nodes [s]; that of a joint is there twice."""
        return np.concatenate([leg.time for leg in self.legs])

    @property
    def position(self) -> np.ndarray:
        """Positions of all nodes [m]."""
        return np.concatenate([leg.position for leg in self.legs])

    @property
    def attitude(self) -> np.ndarray | None:
        """Attitudes at all nodes, as of a `Solution`; None for a point mass."""
        found = [leg.attitude for leg in self.legs]
        return None if found[0] is None else np.concatenate([each for each in found if each is not None])

    @property
    def velocity_change(self) -> float:
        """Sum of all impulses [m/s]."""
        return sum(kick.size for kick in self.impulses)

    @property
    def primer(self) -> tuple[np.ndarray, np.ndarray]:
        """Times [s] and magnitude of the primer vector at all nodes [objective per m/s].

        The primer vector is the multiplier of the discrete equations of motion, the derivative of the objective
        by a velocity change there (Lawden, 1963).
        """
        axes = self.dimension
        sizes = [np.linalg.norm(leg.costate[:, :axes], axis=1) for leg in self.legs]
        return self.time, np.concatenate(sizes)

    def require_problem(self) -> Mission:
        """The mission; ValueError if it was loaded from a file and none has been attached since."""
        if self.problem is None:
            raise ValueError(
                f"this solution was loaded from a file and does not hold its mission "
                f"{self.provenance.problem_name!r}; use solution.attach(mission) first"
            )
        return self.problem

    def attach(self, problem: Any) -> MissionSolution:
        """A copy that holds its mission again, after `load`.

        Raises
        ------
        ValueError
            If the mission has other legs than the solution.
        """
        of_kind("problem", problem, Mission)
        if len(problem.plan) != len(self.legs):
            raise ValueError(
                f"mission {problem.name!r} has {len(problem.plan)} legs, the solution {len(self.legs)}; "
                "attach the mission that was solved"
            )
        problem = sharp_as_parts(problem, self.legs)
        legs = [
            replace(leg, problem=None).attach(
                problem.fixed_at(i, leg.provenance.start_time, float(leg.path.mass[0]), leg.duration)
            )
            for i, leg in enumerate(self.legs)
        ]
        return replace(self, problem=problem, legs=tuple(legs))

    def save(self, path: str | os.PathLike, **provenance: Any) -> None:
        """Write the solution to a netCDF-4 file, whole or not at all; `provenance` as of a `Solution`."""
        whole = replace(self, provenance=replace(self.provenance, **provenance))
        facts, table = mission_parts(whole)
        write_table(path, facts, table)


def read_mission(path: str | os.PathLike, make: Callable = Solution) -> MissionSolution:
    """The solution of a mission in a file, without its mission."""
    facts, table = read_table(path, MISSION_FILE)
    with damage_told(path):
        return mission_of(facts, table, make)


def mission_parts(solution: MissionSolution) -> tuple[dict[str, Any], Table]:
    """Attributes and variables of a solution: those of each leg with `leg_1_` and so on before their names."""
    facts, _ = solution_parts(solution, plain=True)
    facts |= {"format": MISSION_FILE.name, "format_version": MISSION_FILE.version, "legs": len(solution.legs)}
    facts["final_mass"] = solution.final_mass
    facts["arcs"] = json.dumps(solution.arcs)
    table: Table = {}
    for i, leg in enumerate(solution.legs):
        mine, variables = solution_parts(leg)
        facts[f"leg_{i + 1}"] = plain_facts(mine)
        table |= prefixed(variables, f"leg_{i + 1}_")
    for kind, found in (("own", solution.own), ("forces", solution.forces)):
        for name, values in found.items():
            key = f"{kind}_{name.replace(' ', '_')}"
            table[key] = ((f"count_{len(values)}",), values, {"units": "1", "joint": name})
    facts["impulses"] = json.dumps(
        [[kick.joint, kick.time, kick.position.tolist(), kick.change.tolist()] for kick in solution.impulses]
    )
    return facts, table


def mission_of(facts: dict[str, Any], table: Table, make: Callable) -> MissionSolution:
    """The solution that `mission_parts` wrote down."""
    legs = []
    for i in range(int(facts["legs"])):
        prefix = f"leg_{i + 1}_"
        mine = unprefixed(table, prefix)
        legs.append(solution_of(json.loads(facts[f"leg_{i + 1}"]), mine, make))
    joints: dict[str, dict[str, np.ndarray]] = {"own": {}, "forces": {}}
    for name, (_, _, about) in table.items():
        kind = name.split("_")[0]
        if kind in joints:
            joints[kind][str(about["joint"])] = as_array(table, name)
    kicks = [
        Kick(str(joint), float(time), np.array(place), np.array(change))
        for joint, time, place, change in json.loads(facts["impulses"])
    ]
    return MissionSolution(
        problem=None,
        legs=tuple(legs),
        impulses=tuple(kicks),
        own=joints["own"],
        forces=joints["forces"],
        final_mass=float(facts["final_mass"]),
        **outcome_fields(facts),
        arcs=tuple(json.loads(facts["arcs"])),
        provenance=provenance_of(facts),
    )
