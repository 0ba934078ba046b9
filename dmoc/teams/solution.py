"""TeamSolution: the answer of a team, body by body; saved to and loaded from netCDF."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import field, replace
from typing import Any

import numpy as np

from dmoc.basics.arguments import of_kind
from dmoc.basics.records import dataclass
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
from dmoc.scene.rounding import sharp_as_parts
from dmoc.scene.team import Team
from dmoc.teams.path import TeamPath

# The name and version by which a file of a team is known.
TEAM_FILE = Format(
    "dmoc team", 1, "a result of a team", "results are written by TeamSolution.save and by dmoc solve"
)


@dataclass(frozen=True)
class TeamSolution(Outcome):
    """The answer to a team, whether it succeeded or not.

    Attributes
    ----------
    problem : Team or None
        None after `load`; see `attach`.
    members : tuple of Solution
        Each body like the solution of a transfer whose duration is known. Its goal is that of its problem: what
        other bodies ask of its end is no part of it.
    names : tuple of str
        What the bodies are called.
    forces : dict of array
        Multipliers of what holds at the end between two bodies [objective per unit of the row].
    densities : dict of array, shape (nodes, rows)
        Multipliers of what they keep all along, per fraction of the duration.
    objective, success, status, message, ladder, worst, warnings, tolerance, error, reason, provenance
        As of a `Solution`; the objective is the sum of those of the bodies.
    """

    problem: Team | None
    members: tuple[Solution, ...]
    names: tuple[str, ...]
    forces: dict[str, np.ndarray]
    densities: dict[str, np.ndarray]
    objective: float
    success: bool
    status: str
    message: str
    ladder: tuple[Level, ...]
    worst: tuple[tuple[str, float, str], ...] = ()
    warnings: tuple[str, ...] = ()
    tolerance: float | None = None
    error: Error | None = None
    reason: str = ""
    provenance: Provenance = field(kw_only=True)

    @property
    def path(self) -> TeamPath:
        """The paths of all bodies with their multipliers, good to start from."""
        legs = tuple(one.path for one in self.members)
        begins = (self.provenance.start_time,) * len(legs)
        return TeamPath(legs, begins, forces=self.forces, densities=self.densities)

    @property
    def parts(self) -> tuple[Solution, ...]:
        """The bodies, each like the solution of a transfer."""
        return self.members

    @property
    def part_names(self) -> tuple[str, ...]:
        """What the parts are called."""
        return self.names

    @property
    def order(self) -> int:
        return self.members[0].order

    @property
    def steps(self) -> int:
        return self.members[0].steps

    @property
    def hold(self) -> bool:
        return self.members[0].hold

    @property
    def dimension(self) -> int:
        return self.members[0].dimension

    @property
    def duration(self) -> float:
        """Duration, the same for all bodies [s]."""
        return self.members[0].duration

    @property
    def time(self) -> np.ndarray:
        """Times of the nodes that all bodies share [s]."""
        return self.members[0].time

    @property
    def position(self) -> np.ndarray:
        """Positions of all bodies at the nodes, one body after the other [m]."""
        return np.concatenate([one.position for one in self.members])

    @property
    def final_mass(self) -> float:
        """Mass of all bodies at the end [kg]."""
        return sum(one.final_mass for one in self.members)

    def of(self, body: str) -> Solution:
        """The solution of one body.

        Raises
        ------
        ValueError
            If no body has this name.
        """
        if body not in self.names:
            raise ValueError(f"no body is called {body!r}; there are {', '.join(self.names)}")
        return self.members[self.names.index(body)]

    def distance(self, first: str, second: str) -> np.ndarray:
        """The distance of two bodies at the nodes [m]."""
        return np.linalg.norm(self.of(second).position - self.of(first).position, axis=1)

    def require_problem(self) -> Team:
        """The team; ValueError if it was loaded from a file and none has been attached since."""
        if self.problem is None:
            raise ValueError(
                f"this solution was loaded from a file and does not hold its team "
                f"{self.provenance.problem_name!r}; use solution.attach(team) first"
            )
        return self.problem

    def attach(self, problem: Any) -> TeamSolution:
        """A copy that holds its team again, after `load`.

        Raises
        ------
        ValueError
            If the team has other bodies than the solution.
        """
        of_kind("problem", problem, Team)
        if problem.names != self.names:
            raise ValueError(
                f"team {problem.name!r} is of {', '.join(problem.names)}, the solution of "
                f"{', '.join(self.names)}; attach the team that was solved"
            )
        problem = sharp_as_parts(problem, self.members)
        members = [
            one.attach(problem.fixed_at(i, self.provenance.start_time, float(one.path.mass[0]), self.duration))
            for i, one in enumerate(self.members)
        ]
        return replace(self, problem=problem, members=tuple(members))

    def save(self, path: str | os.PathLike, **provenance: Any) -> None:
        """Write the solution to a netCDF-4 file, whole or not at all; `provenance` as of a `Solution`."""
        write_table(path, *_written(replace(self, provenance=replace(self.provenance, **provenance))))


def read_team(path: str | os.PathLike, make: Callable = Solution) -> TeamSolution:
    """The solution of a team in a file, without its team."""
    facts, table = read_table(path, TEAM_FILE)
    with damage_told(path):
        return _read(facts, table, make)


def _written(solution: TeamSolution) -> tuple[dict[str, Any], Table]:
    """Attributes and variables: those of each body with `body_1_` and so on before their names."""
    facts, _ = solution_parts(solution, plain=True)
    facts |= {"format": TEAM_FILE.name, "format_version": TEAM_FILE.version}
    facts["names"] = json.dumps(solution.names)
    table: Table = {}
    for i, one in enumerate(solution.members):
        mine, variables = solution_parts(one)
        prefix = f"body_{i + 1}_"
        facts[prefix.rstrip("_")] = plain_facts(mine)
        table |= prefixed(variables, prefix)
    for kind, found in (("forces", solution.forces), ("densities", solution.densities)):
        for i, (name, values) in enumerate(found.items()):
            dimensions = tuple(f"count_{size}" for size in values.shape)
            table[f"between_{kind}_{i + 1}"] = (dimensions, values, {"units": "1", "of": name})
    return facts, table


def _read(facts: dict[str, Any], table: Table, make: Callable) -> TeamSolution:
    names = tuple(map(str, json.loads(facts["names"])))
    members = []
    for i in range(len(names)):
        prefix = f"body_{i + 1}_"
        mine = unprefixed(table, prefix)
        members.append(solution_of(json.loads(facts[prefix.rstrip("_")]), mine, make))
    if len({(len(one.path.mesh), one.order, one.hold) for one in members}) > 1:
        raise ValueError("its bodies do not share one mesh")
    found: dict[str, dict[str, np.ndarray]] = {"forces": {}, "densities": {}}
    for name, (_, _, about) in table.items():
        if name.startswith("between_"):
            found[name.split("_")[1]][str(about["of"])] = as_array(table, name)
    return TeamSolution(
        problem=None,
        members=tuple(members),
        names=names,
        forces=found["forces"],
        densities=found["densities"],
        **outcome_fields(facts),
        provenance=provenance_of(facts),
    )
