"""Objectives: the quantity that a transfer minimises or maximises."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, ClassVar

from dmoc.basics.arguments import checked, entries, number, short
from dmoc.basics.docstrings import Duties
from dmoc.basics.records import dataclass
from dmoc.parts.actuator import Actuator


class Objective(Duties):
    """The integral of `running` over time plus `terminal` at the goal.

    A frozen dataclass that derives from this has these duties:

    1. State its value as CasADi expressions, with its own sign: `running`, per second at an instant of the
       path, `terminal`, of the state at the goal, or both.
    2. Name the `unit` of that value, and set `sense` to -1 if it is maximised.
    3. All else has a default. Write `rate` in place of `running`, and `unit_with` in place of `unit`, where the
       value depends on the force or the mass flow that an actuator makes of its controls.
    4. `metered`, where it needs the magnitude of the force among the controls.
    5. `check_dimension`: refuse a problem in whose number of axes it has no meaning.
    6. `words`, by default the first line of its docstring, and `label`, by default the name of its class.

    Not its business: the integration over time, meshes, units, scaling, limits, and the sign by which a
    maximum becomes a minimum. `u` are the controls, for a force actuator the force [N].

    Objectives add up: `0.5 * Effort() + 2 * Time()`; one that is maximised is subtracted from one that is
    minimised: `Effort() - 3 * FinalMass()`.

    Attributes
    ----------
    unit : str
    sense : int
        1 if it is minimised, -1 if it is maximised. Its value is reported with its own sign either
        way; multipliers are those of the minimisation of `sense` times the objective.
    metered : bool
        Whether it needs the magnitude of the force among the controls.

    Examples
    --------
    >>> import casadi as ca
    >>> from dmoc import BoxForce, Objective, State, TransferProblem, solve
    >>> class Closeness(Objective):
    ...     '''Least integral of the squared distance from the origin.'''
    ...     unit = "m^2 s"
    ...     def running(self, t, q, v, u, m):
    ...         return ca.dot(q, q)
    >>> ends = State((0, 1), (0, 0)), State((1, 0), (0, 0))
    >>> problem = TransferProblem(1.0, *ends, 3.0, actuator=BoxForce(2.0), objective=Closeness())
    >>> print(solve(problem, steps=50).position[25].max() < 0.5)
    True
    """

    one_of = ("running", "terminal", "rate", "kick")
    unit: ClassVar[str] = ""
    sense: ClassVar[int] = 1
    metered: ClassVar[bool] = False
    # Whether it is the duration alone: of a limited force the largest is then best.
    hurries: ClassVar[bool] = False
    adjustable: ClassVar[tuple[str, ...]] = ()

    @property
    def terms(self) -> tuple[tuple[float, Objective], ...]:
        """Pairs (weight, objective) whose sum this objective is."""
        return ((1.0, self),)

    def __mul__(self, weight: float) -> WeightedSum:
        return WeightedSum(tuple((number("weight", weight, "") * w, term) for w, term in self.terms))

    __rmul__ = __mul__

    def __add__(self, other: Objective) -> WeightedSum:
        if not isinstance(other, Objective):
            raise ValueError(f"only objectives can be added to an objective; got {short(other)}")
        return WeightedSum((*self.terms, *other.terms))

    def __sub__(self, other: Objective) -> WeightedSum:
        if not isinstance(other, Objective):
            raise ValueError(f"only objectives can be taken away from an objective; got {short(other)}")
        return WeightedSum((*self.terms, *(-1.0 * other).terms))

    # Whether it looks at the attitude of a body, and whether it needs its position.
    turns_body: ClassVar[bool] = False
    moves_body: ClassVar[bool] = False
    # The numbers on which it counts information: their sensitivities are then unknowns of the optimisation.
    learns: ClassVar[tuple[str, ...]] = ()

    def check_dimension(self, dimension: int) -> None:
        """Raise ValueError if the objective has no meaning in this many dimensions."""

    def running(self, t: Any, q: Any, v: Any, u: Any, m: Any) -> Any:
        """Cost per second."""
        return 0

    def terminal(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        """Cost of the state at the goal."""
        return 0

    def rate(self, actuator: Actuator, t: Any, q: Any, v: Any, u: Any, m: Any) -> Any:
        """Cost per second with this actuator: `running`, unless the cost looks at its force or mass flow."""
        return self.running(t, q, v, u, m)

    def kick(self, size: Any, mass: Any) -> Any:
        """Cost of an impulse between two legs: a velocity change [m/s] of a mass [kg]."""
        return 0

    def told(self, spreads: Any, duration: Any) -> Any:
        """Value of what positions will tell, from how far each number moves the path: see `Information`."""
        return 0

    @property
    def paid_at_goal(self) -> Objective:
        """The objective whose cost the goal has: another one for a leg of a mission."""
        return self

    def unit_with(self, actuator: Actuator) -> str:
        """The unit of the objective with this actuator."""
        return self.unit

    @property
    def label(self) -> str:
        """Its name for a person, such as `final mass`."""
        return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", type(self).__name__).lower()

    def words(self) -> str:
        """One line for a person."""
        return (type(self).__doc__ or type(self).__name__).strip().splitlines()[0]


@dataclass(frozen=True)
class Effort(Objective):
    """Least effort: 1/2 integral of |F|^2 dt [N^2 s]."""

    unit: ClassVar[str] = "N^2 s"

    def rate(self, actuator: Actuator, t: Any, q: Any, v: Any, u: Any, m: Any) -> Any:
        return 0.5 * actuator.effort(u)

    def unit_with(self, actuator: Actuator) -> str:
        return actuator.effort_unit


@dataclass(frozen=True)
class Fuel(Objective):
    """Least fuel: the propellant burnt [kg], or without an exhaust velocity the integral of |F| dt [N s].

    Of a `BallTorque` alone it is the integral of |tau| dt [N m s].
    """

    unit: ClassVar[str] = "kg"
    metered: ClassVar[bool] = True

    def unit_with(self, actuator: Actuator) -> str:
        return "kg" if actuator.burns else actuator.meter_unit

    def rate(self, actuator: Actuator, t: Any, q: Any, v: Any, u: Any, m: Any) -> Any:
        return actuator.flow(u) if actuator.burns else actuator.throttle(u)


@dataclass(frozen=True)
class Time(Objective):
    """Least time: the duration [s]. Needs a limited force and a duration given as (shortest, longest)."""

    unit: ClassVar[str] = "s"
    hurries: ClassVar[bool] = True

    def running(self, t: Any, q: Any, v: Any, u: Any, m: Any) -> Any:
        return 1.0


@dataclass(frozen=True)
class FinalMass(Objective):
    """Largest final mass [kg]. Needs an actuator that burns propellant."""

    unit: ClassVar[str] = "kg"
    sense: ClassVar[int] = -1

    def terminal(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        return m


@dataclass(frozen=True)
class WeightedSum(Objective):
    """A sum of objectives with weights; made by adding objectives and multiplying them by numbers.

    Parameters
    ----------
    parts : tuple of (float, Objective)
        Weights and objectives. A maximised objective must have a weight of the opposite sign to that of a
        minimised one.
    """

    parts: Sequence[tuple[float, Objective]]

    def __post_init__(self) -> None:
        pairs = [entries(part) or () for part in entries(self.parts) or ()]
        if not pairs or any(len(pair) != 2 or not isinstance(pair[1], Objective) for pair in pairs):
            raise ValueError(f"WeightedSum: parts must be pairs (weight, objective); got {short(self.parts)}")
        parts = tuple((number("weight", weight, ""), term) for weight, term in pairs)
        checked(self, parts=parts)
        if sum(bool(term.learns) for weight, term in self.parts if weight) > 1:
            raise ValueError("a sum of objectives has one Information; give it all numbers: unknown=(.., ..)")
        pulls = {weight * term.sense > 0 for weight, term in self.parts if weight}
        if len(pulls) > 1:
            raise ValueError(
                f"the sum {self.formula} pulls two ways: subtract what is maximised from what is minimised, "
                "as in Effort() - 2 * FinalMass()"
            )

    @property
    def terms(self) -> tuple[tuple[float, Objective], ...]:
        return tuple(self.parts)

    @property
    def sense(self) -> int:  # type: ignore[override]
        return -1 if any(weight * term.sense < 0 for weight, term in self.parts) else 1

    @property
    def metered(self) -> bool:  # type: ignore[override]
        return any(term.metered for _, term in self.parts)

    @property
    def formula(self) -> str:
        """Such as `0.5 Effort + 2 Time`."""
        sizes = ["" if abs(weight) == 1 else f"{abs(weight):g} " for weight, _ in self.parts]
        words = [
            f"{'-' if weight < 0 else '+'} {size}{type(term).__name__}"
            for size, (weight, term) in zip(sizes, self.parts, strict=True)
        ]
        return " ".join(words).removeprefix("+ ")

    def check_dimension(self, dimension: int) -> None:
        for _, term in self.parts:
            term.check_dimension(dimension)

    def rate(self, actuator: Actuator, t: Any, q: Any, v: Any, u: Any, m: Any) -> Any:
        # A term of weight 0 is left out: 0 times a value that is not finite would not be 0.
        return sum(weight * term.rate(actuator, t, q, v, u, m) for weight, term in self.parts if weight)

    def terminal(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        return sum(weight * term.terminal(t, q, v, m) for weight, term in self.parts if weight)

    def kick(self, size: Any, mass: Any) -> Any:
        return sum(weight * term.kick(size, mass) for weight, term in self.parts if weight)

    @property
    def learns(self) -> tuple[str, ...]:  # type: ignore[override]
        return tuple(name for weight, term in self.parts if weight for name in term.learns)

    def told(self, spreads: Any, duration: Any) -> Any:
        return sum(weight * term.told(spreads, duration) for weight, term in self.parts if weight)

    def unit_with(self, actuator: Actuator) -> str:
        units = {term.unit_with(actuator) for weight, term in self.parts if weight}
        return units.pop() if len(units) == 1 else ""

    def words(self) -> str:
        return ("Least " if self.sense > 0 else "Largest ") + self.formula
