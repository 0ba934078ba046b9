"""What happens between two legs of a mission."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar, NamedTuple

import casadi as ca
import numpy as np

from dmoc.basics.arguments import checked, entries, number, short
from dmoc.basics.docstrings import Duties
from dmoc.basics.records import dataclass
from dmoc.ends.base import Boundary, State
from dmoc.parts.rows import Row


class Instant(NamedTuple):
    """A state at a joint as CasADi expressions: time [s], q, independent velocities and mass [kg]."""

    t: Any
    q: Any
    v: Any
    m: Any


class Passed(NamedTuple):
    """What an event makes of a state: the one behind it, rows that must hold, and the kick in it.

    The kick is the size of a velocity change [m/s] and the mass before it [kg], for the objective.
    """

    after: Instant
    rows: list[Row]
    kick: tuple[Any, Any] | None = None


class Event(Duties):
    """What happens between two legs, at one instant.

    A frozen dataclass that derives from this says what becomes of a state, `passed`, and what it is in `words`.
    An event with unknowns of its own names them in `unknowns`, and gives a guess for them in `first_guess`.
    """

    # Whether its unknowns are a velocity change, which costs.
    pushes: ClassVar[bool] = False
    # Whether the energy per mass is the same before and behind it.
    keeps_energy: ClassVar[bool] = False
    # Whether it turns the velocity without a push.
    turns_velocity: ClassVar[bool] = False
    # Whether positions count in another frame behind it.
    changes_frame: ClassVar[bool] = False
    # The controls that go on over it without a jump, and whether their limits there are left to the leg behind
    # it, not to the one before.
    continued: tuple[int, ...] = ()
    left_behind: bool = False

    def unknowns(self, axes: int) -> tuple[tuple[str, str], ...]:
        """Name and unit of each unknown of its own, in a space of so many axes."""
        return ()

    def first_guess(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Likely values of its unknowns between two velocities [m/s] of the legs beside it."""
        return np.zeros(0)

    @abstractmethod
    def passed(self, here: Instant, own: Any, speeds: np.ndarray, tiny: float) -> Passed:
        """What it makes of a state.

        `own` are its unknowns, `speeds` says which velocities are in [m/s], `tiny` is a speed that is nothing.
        """

    def check_dimension(self, dimension: int) -> None:
        """Raise ValueError if the event has no meaning in this many axes."""

    @property
    def condition(self) -> Boundary | None:
        """A boundary whose conditions must hold at this instant."""
        return None

    def burnt(self, mass: float, kick: float = 0.0) -> float:
        """The mass after it [kg], for a guess."""
        return mass

    @property
    def dropped(self) -> float:
        """Mass that is left behind unburnt [kg]."""
        return 0.0

    @abstractmethod
    def words(self) -> str:
        """One line for a person."""


@dataclass(frozen=True)
class Impulse(Event):
    """A change of the velocity at one instant: a burn that is short beside the motion.

    Parameters
    ----------
    limit : float, optional
        Largest velocity change [m/s].
    exhaust_velocity : float, optional
        [m/s]; with it the mass falls by Tsiolkovsky's equation m exp(-|dv| / c), without it the mass stays.
    """

    limit: float | None = None
    exhaust_velocity: float | None = None
    pushes: ClassVar[bool] = True

    def __post_init__(self) -> None:
        for name in ("limit", "exhaust_velocity"):
            if (value := getattr(self, name)) is not None:
                checked(self, **{name: number(f"Impulse: {name}", value, "m/s", positive=True)})

    def unknowns(self, axes: int) -> tuple[tuple[str, str], ...]:
        return tuple((axis, "m/s") for axis in "xyz"[:axes])

    def first_guess(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        kick = after - before
        size = float(np.linalg.norm(kick))
        return kick * min(1.0, 0.9 * self.limit / size) if self.limit and size else kick

    def passed(self, here: Instant, own: Any, speeds: np.ndarray, tiny: float) -> Passed:
        change, places = ca.SX.zeros(here.v.numel()), np.flatnonzero(speeds)
        for i, place in enumerate(places):
            change[int(place)] = own[i]
        # At zero the size alone has no derivative.
        size = ca.sqrt(ca.dot(own, own) + tiny**2)
        mass = here.m if self.exhaust_velocity is None else here.m * ca.exp(-size / self.exhaust_velocity)
        rows = []
        if self.limit is not None:
            rows.append(Row("limit", ca.dot(own, own) / self.limit**2, -np.inf, 1.0))
        return Passed(here._replace(v=here.v + change, m=mass), rows, (size, here.m))

    def burnt(self, mass: float, kick: float = 0.0) -> float:
        return mass if self.exhaust_velocity is None else mass * float(np.exp(-kick / self.exhaust_velocity))

    def words(self) -> str:
        limit = "" if self.limit is None else f" of at most {self.limit:g} m/s"
        return f"an impulse{limit}"


@dataclass(frozen=True)
class Drop(Event):
    """A part of the body is left behind, at its velocity: the rest flies on with less mass.

    Parameters
    ----------
    mass : float
        What is left behind [kg].
    """

    mass: float
    keeps_energy: ClassVar[bool] = True

    def __post_init__(self) -> None:
        checked(self, mass=number("Drop: mass", self.mass, "kg", positive=True))

    def passed(self, here: Instant, own: Any, speeds: np.ndarray, tiny: float) -> Passed:
        return Passed(here._replace(m=here.m - self.mass), [])

    def burnt(self, mass: float, kick: float = 0.0) -> float:
        return mass - self.mass

    @property
    def dropped(self) -> float:
        return self.mass

    def words(self) -> str:
        return f"{self.mass:g} kg are left behind"


@dataclass(frozen=True)
class Via(Event):
    """A condition on the way: a place, a state, a moving point, an orbit or any `Condition`.

    Parameters
    ----------
    boundary : Boundary or sequence of float
        What must hold at that instant; plain numbers are a position [m], passed at any velocity.
    """

    boundary: Any
    keeps_energy: ClassVar[bool] = True

    def __post_init__(self) -> None:
        place = entries(self.boundary)
        if place is not None:
            checked(self, boundary=State(tuple(place), None))
        if not isinstance(self.boundary, Boundary):
            raise ValueError(
                "Via: boundary must be a position [m] or a dmoc.Boundary, such as State or Condition; "
                f"got {short(self.boundary)}"
            )

    def check_dimension(self, dimension: int) -> None:
        if self.boundary.dimension not in (0, dimension):
            raise ValueError(
                f"Via: its condition has {self.boundary.dimension} axes but the mission {dimension}; "
                f"give it {dimension}"
            )

    @property
    def condition(self) -> Boundary:
        return self.boundary

    def passed(self, here: Instant, own: Any, speeds: np.ndarray, tiny: float) -> Passed:
        where = self.boundary.with_dimension(int(np.sum(speeds)) or 3)
        return Passed(here, condition_rows(where, here))

    def words(self) -> str:
        return f"by way of {self.boundary.words()}"


def condition_rows(boundary: Boundary, here: Instant) -> list[Row]:
    """What a boundary asks of a state: its fixed entries as rows, then its other conditions."""
    return [*fixed_rows(boundary, here, np.concatenate(boundary.fixed())), *boundary.rows(*here)]


def fixed_rows(boundary: Boundary, here: Instant, values: Any) -> list[Row]:
    """Rows of the fixed entries of a boundary; `values` are all of them, or symbols that stand for them."""
    rows, first = [], 0
    for name, fixed, now, unit in zip(
        ("position", "velocity"), boundary.fixed(), (here.q, here.v), ("m", "m/s"), strict=True
    ):
        for i in map(int, np.flatnonzero(~np.isnan(fixed))):
            label = f"{name}.{'xyz'[i] if len(fixed) <= 3 else i}"
            rows.append(Row(label, now[i] - values[first + i], 0.0, 0.0, unit))
        first += len(fixed)
    return rows
