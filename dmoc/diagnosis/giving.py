"""The limits of a transfer that may give way, one by one or together, and in which words and problems."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.basics.digits import down, up
from dmoc.basics.records import dataclass
from dmoc.motion.path import DiscretePath
from dmoc.nlp.layout import Group
from dmoc.nlp.solving import NLP
from dmoc.parts.constraint import Constraint
from dmoc.scene.problem import TransferProblem

# A limit on force, speed or propellant is told of with this much more than is needed [-]: at the very least one
# every force is at its limit, and no multipliers confirm the answer.
ROOM = 1e-3
# Where a limit as found turns out not to be enough, this much more is tried [-]: at the very least limit a path
# touches it all the way, or slips between two limits where there is no room to either side.
LOOSER = (0.0, 0.004, 0.02, 0.08, 0.2)


@dataclass(frozen=True)
class Remedy:
    """A change that should be enough: in words, the problem with that change, a path that is near it."""

    words: str
    problem: TransferProblem
    path: DiscretePath | None = None


@dataclass(frozen=True)
class Giving:
    """Limits that give way together: rows with the sign of their slack, unknowns with their shares.

    With a slack s they must be `factor(s)` times as large, `told(s)` says in words which limit is enough, empty
    if none is, and `change(problem, s)` makes it so large. The need falls with the duration to the power
    `falls`.
    """

    told: Callable[[float], str]
    change: Callable[[TransferProblem, float], TransferProblem]
    factor: Callable[[float], float]
    falls: int
    rows: np.ndarray
    signs: np.ndarray
    columns: np.ndarray
    below: np.ndarray
    above: np.ndarray


class Limits:
    """The limits of a transfer on one mesh.

    They are told of as those of `given`, which are smaller where they were raised in `problem`.
    """

    problem: TransferProblem
    given: TransferProblem
    guess: DiscretePath
    nlp: NLP
    bounds: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]

    def limits(self) -> list[Giving]:
        """The limits that a longer duration eases."""
        return [limit for limit in (self.force(), *self.speeds(), self.propellant()) if limit is not None]

    @property
    def looser(self) -> tuple[float, ...]:
        """`LOOSER`; with a limit on the speed nothing but the path that was found leads to the very least."""
        return LOOSER[1:] if any(part.unit == "m/s" for part in self.given.constraints) else LOOSER

    def remedies(
        self,
        limits: list[Giving],
        slack: float,
        more: str = "",
        room: float = ROOM,
        path: DiscretePath | None = None,
    ) -> tuple[Remedy, ...]:
        """Limits that give way together by this slack and, should it not be enough, by more each time."""
        found = []
        for looser in self.looser:
            given = (1 + slack) * (1 + room + looser) - 1
            words = [limit.told(given) for limit in limits]
            if not all(words):
                break
            problem = self.given
            for limit in limits:
                problem = limit.change(problem, given)
            found.append(Remedy(" and ".join(words) + more, problem, path))
        return tuple(found)

    def force(self) -> Giving | None:
        """The limit of the actuator."""
        raised, given = self.problem.actuator, self.given.actuator
        if not raised.limited:
            return None

        def told(slack: float) -> str:
            return given.needs(raised.eased(slack))

        def change(problem: TransferProblem, slack: float) -> TransferProblem:
            return replace(problem, actuator=raised.eased(slack))

        def factor(slack: float) -> float:
            return (raised.eased(slack).main_limit() or 0.0) / (given.main_limit() or 1.0)

        groups = [group for group in self._groups() if group.owner and group.owner.field == "actuator"]
        return self._giving(told, change, factor, groups, self.nlp.columns["force"].indices.ravel(), falls=2)

    def speeds(self) -> list[Giving]:
        """The limits on the speed and on the rate of a body, each by itself."""
        known = [i for i, part in enumerate(self.problem.constraints) if part.largest_speed()]
        return [limit for limit in map(self._speed, known) if limit is not None]

    def _speed(self, entry: int) -> Giving | None:
        raised, given = self.problem.constraints[entry], self.given.constraints[entry]

        def told(slack: float) -> str:
            eased = raised.eased(slack)
            return given.needs(eased, entry + 1, "") if eased else ""

        def change(problem: TransferProblem, slack: float) -> TransferProblem:
            return _with_constraint(problem, entry, raised.eased(slack))

        def factor(slack: float) -> float:
            eased = raised.eased(slack)
            return (eased.largest_speed() or 0.0) / (given.largest_speed() or 1.0) if eased else np.inf

        return self._giving(told, change, factor, self._groups_of(entry))

    def propellant(self) -> Giving | None:
        """The dry mass, which gives way downwards: at a slack of 1 there is twice the propellant."""
        dry = self.problem.actuator.dry_mass
        load = self.problem.mass - dry
        if not self.problem.actuator.burns or dry <= 0:
            return None

        def told(slack: float) -> str:
            needed = dry - slack * load
            given = f"you gave {dry:g} kg, which leaves too little propellant"
            return f"a dry mass of {down(needed)} kg ({given})" if needed > 0 else ""

        def change(problem: TransferProblem, slack: float) -> TransferProblem:
            burner: Any = problem.actuator
            return replace(problem, actuator=replace(burner, dry_mass=dry - slack * load))

        # The mass at the start is given and stays.
        columns = self.nlp.columns["mass"].indices.ravel()[1:]
        below, none = self.bounds[0][columns] * load / dry, np.empty(0, int)
        return Giving(
            told, change, lambda slack: 1 + slack, 1, none, none, columns, below, np.zeros(len(columns))
        )

    def zones(self) -> list[int]:
        """The constraints with rows that no longer duration eases, by their place in the problem."""
        owners = (group.owner for group in self._groups())
        entries = {owner.entry for owner in owners if owner and owner.field == "constraints"}
        return sorted(entry for entry in entries if not self.problem.constraints[entry].limits_speed)

    def zone(self, entry: int, path: DiscretePath) -> Giving | None:
        """One of these; where it gives way in proportion to a distance, that of the nodes of a path."""
        zone, groups = self.problem.constraints[entry], self._groups_of(entry)
        scale, unit = float(groups[0].scales.max()), groups[0].units[0]
        weights = zone.weights(*self.places(entry, path))
        size = scale if weights is None else 1.0

        def told(slack: float) -> str:
            eased = zone.eased(slack / size)
            return zone.needs(eased, entry + 1, f"{up(slack / size)} {unit}".strip()) if eased else ""

        def change(problem: TransferProblem, slack: float) -> TransferProblem:
            return _with_constraint(problem, entry, zone.eased(slack / size))

        found = self._giving(told, change, lambda slack: 1 + slack, groups)
        if found is None or weights is None:
            return found
        group = groups[0]
        every = np.zeros(self.nlp.rows.size)
        every[group.indices] = (group.scales * weights[:, None]).T
        return replace(found, signs=found.signs * every[found.rows])

    def by_angle(self, entry: int) -> bool:
        """Whether a zone gives way in proportion to a distance."""
        return self.problem.constraints[entry].weights(*self.places(entry, self.guess)) is not None

    def places(self, entry: int, path: DiscretePath) -> tuple[np.ndarray, np.ndarray]:
        """Times of the nodes of a path, and the places there that a constraint limits."""
        times = self.problem.start_time + path.duration * path.fractions
        return times, path.place_of(self.problem.constraints[entry])

    def _giving(
        self,
        told: Callable[[float], str],
        change: Callable[[TransferProblem, float], TransferProblem],
        factor: Callable[[float], float],
        groups: list[Group],
        columns: np.ndarray | None = None,
        falls: int = 1,
    ) -> Giving | None:
        """Rows of some groups with a limit on one side, and unknowns with limits."""
        lbx, ubx, lbg, ubg = self.bounds
        # A row with both sides finite, an equation for example, has no side to which it could give way.
        rows = np.concatenate([*(group.indices.ravel() for group in groups), np.empty(0, int)]).astype(int)
        rows = rows[np.isfinite(lbg[rows]) != np.isfinite(ubg[rows])]
        columns = np.empty(0, int) if columns is None else columns
        above = np.where(np.isfinite(ubx[columns]), ubx[columns], 0.0)
        # A lower limit gives way if it mirrors the upper one; a floor, such as a throttle of 0, stays.
        below = np.where(lbx[columns] == -ubx[columns], above, 0.0)
        if not len(rows) and not above.any():
            return None
        signs = np.where(np.isfinite(lbg[rows]), 1.0, -1.0)
        return Giving(told, change, factor, falls, rows, signs, columns, below, above)

    def _groups(self) -> tuple[Group, ...]:
        return self.nlp.rows.groups

    def _groups_of(self, entry: int) -> list[Group]:
        mine = ("constraints", entry)
        return [group for group in self._groups() if group.owner and group.owner[:2] == mine]


def _with_constraint(problem: TransferProblem, entry: int, other: Constraint | None) -> TransferProblem:
    return problem if other is None else other.within(problem, entry)
