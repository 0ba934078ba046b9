"""PhasedSolution: the answer of a team whose bodies have several legs; saved to and loaded from netCDF."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.basics.arguments import of_kind
from dmoc.basics.records import dataclass
from dmoc.missions.solution import MissionSolution, mission_of, mission_parts
from dmoc.phases.order import Order, Place
from dmoc.phases.path import PhasedPath
from dmoc.phases.timetable import Timetable
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
from dmoc.results.solution import Solution
from dmoc.results.table import outcome_fields, provenance_of, solution_parts
from dmoc.scene.rounding import sharp_as_parts
from dmoc.scene.team import Team
from dmoc.teams.solution import TeamSolution

# The name and version by which a file of a team of missions is known.
PHASED_FILE = Format(
    "dmoc team of missions",
    1,
    "a result of a team of missions",
    "results are written by TeamSolution.save and by dmoc solve",
)


@dataclass(frozen=True)
class PhasedSolution(TeamSolution):
    """The answer to a team of which some member is a mission of several legs.

    Attributes
    ----------
    members : tuple of MissionSolution
        Each body like the solution of a mission, whose legs are cut wherever another body has a joint.
    joints : tuple of tuples of Place
        In which order the joints of all bodies follow each other; those in one group are at one time.

    The others are those of a `TeamSolution`.
    """

    members: tuple[MissionSolution, ...]  # type: ignore[assignment]
    joints: Order = ()

    @property
    def path(self) -> PhasedPath:  # type: ignore[override]
        """The paths of all bodies with their multipliers, good to start from."""
        parts = [one.path for one in self.members]
        between = {"forces": self.forces, "densities": self.densities}
        return PhasedPath.joined(parts, self.names, self.joints, **between)

    @property
    def parts(self) -> tuple[Solution, ...]:
        """The legs of all bodies, body by body, each like the solution of a transfer."""
        return tuple(leg for one in self.members for leg in one.legs)

    @property
    def part_names(self) -> tuple[str, ...]:
        """What the legs of all bodies are called."""
        pairs = zip(self.names, self.members, strict=True)
        return tuple(f"{name}, {leg.provenance.problem_name}" for name, one in pairs for leg in one.legs)

    @property
    def hold(self) -> bool:
        return self.members[0].legs[0].hold

    @property
    def timetable(self) -> Timetable:
        """The clock of its team."""
        return Timetable(self.require_problem(), self.joints)

    def attach(self, problem: Any) -> PhasedSolution:
        """A copy that holds its team again, after `load`.

        Raises
        ------
        ValueError
            If the team has other bodies or other legs than the solution.
        """
        of_kind("problem", problem, Team)
        sizes = [len(getattr(one, "plan", (one,))) - 1 for one in problem.members]
        mine = [
            sum(place.body == i for group in self.joints for place in group) for i in range(len(self.names))
        ]
        if problem.names != self.names or sizes != mine:
            raise ValueError(
                f"team {problem.name!r} is of {', '.join(problem.names)} with {_counts(sizes)} legs, the "
                f"solution of {', '.join(self.names)} with {_counts(mine)}; attach the team that was solved"
            )
        plan = sharp_as_parts(Timetable(problem, self.joints), self.parts)
        members = tuple(one.attach(mission) for one, mission in zip(self.members, plan.cut, strict=True))
        return replace(self, problem=plan.team, members=members)

    def save(self, path: str | os.PathLike, **provenance: Any) -> None:
        """Write the solution to a netCDF-4 file, whole or not at all; `provenance` as of a `Solution`."""
        write_table(path, *_written(replace(self, provenance=replace(self.provenance, **provenance))))


def read_phased(path: str | os.PathLike, make: Callable = Solution) -> PhasedSolution:
    """The solution of a team of missions in a file, without its team."""
    facts, table = read_table(path, PHASED_FILE)
    with damage_told(path):
        return _read(facts, table, make)


def _counts(joints: list[int]) -> str:
    return ", ".join(str(count + 1) for count in joints)


def _written(solution: PhasedSolution) -> tuple[dict[str, Any], Table]:
    """Attributes and variables: those of each body with `body_1_` and so on before their names."""
    facts, _ = solution_parts(solution, plain=True)
    facts |= {"format": PHASED_FILE.name, "format_version": PHASED_FILE.version}
    facts |= {"names": json.dumps(solution.names), "joints": json.dumps(solution.joints)}
    table: Table = {}
    for i, one in enumerate(solution.members):
        mine, variables = mission_parts(one)
        facts[f"body_{i + 1}"] = plain_facts(mine)
        table |= prefixed(variables, f"body_{i + 1}_")
    for kind, found in (("forces", solution.forces), ("densities", solution.densities)):
        for i, (name, values) in enumerate(found.items()):
            dimensions = tuple(f"count_{size}" for size in values.shape)
            table[f"between_{kind}_{i + 1}"] = (dimensions, values, {"units": "1", "of": name})
    return facts, table


def _read(facts: dict[str, Any], table: Table, make: Callable) -> PhasedSolution:
    names = tuple(map(str, json.loads(facts["names"])))
    members = tuple(
        mission_of(json.loads(facts[f"body_{i + 1}"]), unprefixed(table, f"body_{i + 1}_"), make)
        for i in range(len(names))
    )
    found: dict[str, dict[str, np.ndarray]] = {"forces": {}, "densities": {}}
    for name, (_, _, about) in table.items():
        if name.startswith("between_"):
            found[name.split("_")[1]][str(about["of"])] = as_array(table, name)
    joints = tuple(tuple(Place(*map(int, place)) for place in group) for group in json.loads(facts["joints"]))
    if any(len(one.legs) != len(joints) + 1 for one in members):
        raise ValueError("its bodies do not have one leg a phase")
    return PhasedSolution(
        problem=None,
        members=members,
        names=names,
        forces=found["forces"],
        densities=found["densities"],
        **outcome_fields(facts),
        provenance=provenance_of(facts),
        joints=joints,
    )
