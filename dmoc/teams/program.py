"""The NLP of a team: the transcripts of its bodies beside each other, joined by the rows between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.assembly.blocks import Block
from dmoc.basics.records import dataclass
from dmoc.chains.path import MissionPath
from dmoc.chains.program import MissionProgram
from dmoc.chains.within import Placed, leg_program
from dmoc.ipopt.run import Answer
from dmoc.nlp.layout import Group
from dmoc.nlp.units import units_of
from dmoc.scene.problem import TransferProblem
from dmoc.teams.between import BetweenBodies
from dmoc.teams.path import TeamPath

# A scaled multiplier below this is what the barrier leaves of none [-].
FELT = 1e-6


@dataclass(frozen=True)
class TeamProgram(MissionProgram):
    """A team on one mesh as Ipopt sees it.

    Unknowns and rows of the bodies come first, body by body, then the rows between them. `mission` is the team:
    its transfers stand beside each other as the legs of a mission do, but all on one clock.
    """

    @classmethod
    def of(  # type: ignore[override]
        cls, team: Any, problems: Sequence[TransferProblem], path: MissionPath, rounding: float | None = None
    ) -> TeamProgram:
        """The program of a team whose transfers are these problems, on the mesh of a path."""
        sizes = [units_of(problem, leg) for problem, leg in zip(problems, path.legs, strict=True)]
        cost = max([unit.cost for unit in sizes if unit.cost != 1.0], default=1.0)
        legs: list[Placed] = []
        blocks: list[Block] = []
        at = np.zeros(3, int)
        for problem, leg, unit in zip(problems, path.legs, sizes, strict=True):
            program, mine, parameters = leg_program(problem, leg, replace(unit, cost=cost), joined=False)
            legs.append(Placed(program, *map(int, at)))
            blocks += [block.moved(*map(int, at)) for block in mine]
            at += (program.columns.size, program.rows.size, parameters)
        writer = BetweenBodies(team, legs, int(at[1]))
        writer.write()
        return cls(
            mission=team,
            legs=tuple(legs),
            own={},
            rows=writer.rows,
            first_row=int(at[1]),
            row_bounds=writer.bounds(),
            blocks=(*blocks, *writer.blocks),
            cost=cost,
            leg_blocks=len(blocks),
        )

    @property
    def numerics(self) -> tuple[int, int]:
        """The order and the steps, which all bodies share."""
        program = self.legs[0].program
        return program.scheme.order, len(program.mesh) - 1

    def parameters(self) -> np.ndarray:
        """The parameters of all bodies [SI]."""
        return np.concatenate([leg.program.parameters(leg.program.problem) for leg in self.legs])

    def bounds(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Scaled lower and upper bounds of the unknowns, then of the rows."""
        parts = [leg.program.bounds(leg.program.problem) for leg in self.legs]
        lower, upper, low, high = (list(side) for side in zip(*parts, strict=True))
        return (
            np.concatenate(lower),
            np.concatenate(upper),
            np.concatenate([*low, self.row_bounds[0]]),
            np.concatenate([*high, self.row_bounds[1]]),
        )

    def multipliers(self, path: Any) -> tuple[np.ndarray, np.ndarray]:
        """Scaled multipliers of unknowns and rows; 0 where a path has none."""
        at_nodes = {name: (values * path.weights[:, None]).ravel() for name, values in path.densities.items()}
        return super().multipliers(replace(path, forces=path.forces | at_nodes))

    def path(self, answer: Answer) -> TeamPath:
        """The paths, with multipliers, of an answer [SI]."""
        legs = []
        for placed in self.legs:
            program = placed.program
            columns = slice(placed.columns, placed.columns + program.columns.size)
            rows = slice(placed.rows, placed.rows + program.rows.size)
            mine = replace(
                answer,
                x=answer.x[columns],
                lam_x=answer.lam_x[columns],
                lam_g=answer.lam_g[rows],
                g=answer.g[rows],
            )
            legs.append(program.path(program.problem, mine))
        found = TeamPath(tuple(legs), (self.mission.start_time,) * len(legs))
        forces, densities = {}, {}
        pushes = felt(self.rows.groups, answer.lam_g[self.first_row :])
        for group in self.rows.groups:
            values = group.of(pushes) * group.scales * self.cost
            if group.kind == "node":
                densities[group.name] = values / found.weights[:, None]
            else:
                forces[group.name] = values.ravel()
        return replace(found, forces=forces, densities=densities)


def felt(groups: Sequence[Group], multipliers: np.ndarray) -> np.ndarray:
    """Scaled multipliers of rows between bodies; 0 at nodes if no two bodies push each other at any of them."""
    at_nodes = [np.arange(group.start, group.stop) for group in groups if group.kind == "node"]
    places = np.concatenate([np.empty(0, int), *at_nodes])
    if np.abs(multipliers[places]).max(initial=0.0) >= FELT:
        return multipliers
    found = multipliers.copy()
    found[places] = 0.0
    return found
