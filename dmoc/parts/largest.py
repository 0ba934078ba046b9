"""Objectives that are maximised: how far or high the goal is, and what a flight tells of unknown numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, ClassVar, NamedTuple

import casadi as ca

from dmoc.basics.arguments import Vector, checked, entries, number, short, vector, whole
from dmoc.basics.records import dataclass
from dmoc.basics.unknown import at, numeric_fields, opened
from dmoc.parts.objectives import Objective
from dmoc.parts.rows import title

AXES = ("x", "y", "z")
# The number of a problem that is no constant of an effect.
MASS = "mass"


@dataclass(frozen=True)
class FinalRadius(Objective):
    """Largest distance from a centre at the goal [m].

    Parameters
    ----------
    center : sequence of float, optional
        [m]; the origin if not given.
    """

    center: Vector | None = None
    unit: ClassVar[str] = "m"
    sense: ClassVar[int] = -1
    moves_body: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if self.center is not None:
            checked(self, center=vector("center", self.center, "m"))

    def check_dimension(self, dimension: int) -> None:
        if self.center is not None and len(self.center) != dimension:
            raise ValueError(
                f"FinalRadius: center has {len(self.center)} entries but the problem has {dimension} dimensions"
            )

    def terminal(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        offset = q if self.center is None else q - ca.DM(self.center)
        return ca.sqrt(ca.dot(offset, offset))


@dataclass(frozen=True)
class FinalHeight(Objective):
    """Largest coordinate along one axis at the goal [m].

    Parameters
    ----------
    axis : int
        Which one, counted from 0; the last if not given.
    """

    axis: int = -1
    unit: ClassVar[str] = "m"
    sense: ClassVar[int] = -1
    moves_body: ClassVar[bool] = True

    def __post_init__(self) -> None:
        checked(self, axis=whole("FinalHeight: axis", self.axis, least=-3))

    def check_dimension(self, dimension: int) -> None:
        if self.axis not in range(-dimension, dimension):
            raise ValueError(f"FinalHeight: axis must be 0 to {dimension - 1} or -1; got {short(self.axis)}")

    def terminal(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        return q[self.axis]


@dataclass(frozen=True)
class Information(Objective):
    """Largest information on unknown numbers: 1/2 log det of what positions will tell of them [nat].

    With s_k the derivative of the discrete path by each number over its value, and by the state at the start,
    which is unknown, too, positions measured every `every` seconds with errors of standard deviation `noise`
    have the Fisher information F = sum_k s_k' s_k / noise^2. What is left of it for the numbers, the Schur
    complement of the part of the start, is the inverse of their relative covariance in `identify` with exact
    forces; one unit more of the objective makes the interval of one number exp(1) times narrower. The sum is
    that of the scheme over its nodes, as if of samples all along the way, and s solves the derivative of the
    discrete Euler-Lagrange equations. `Effort() - 2 * Information("mass", 0.001, 0.1)` trades one for the
    other.

    Parameters
    ----------
    unknown : str or sequence of str
        The numbers, "mass" and constants of effects by the names that `identify` gives them, such as
        "linear_drag_1_coefficient".
    noise : float
        Standard deviation of each axis of positions [m].
    every : float
        Time between samples [s].

    Notes
    -----
    A. Wilson, J. Schultz, T. Murphey, Trajectory synthesis for Fisher information maximization, IEEE Trans.
    Robotics 30 (2014). K. Albee, M. Ekal, B. Coltin, R. Ventura, R. Linares, D. Miller, The RATTLE motion
    planning algorithm for robust online parametric model improvement with on-orbit validation, IEEE Robotics
    and Automation Letters 7 (2022), add the trace of the inverse to the effort; the determinant does not depend
    on units.
    """

    unknown: str | Sequence[str]
    noise: float
    every: float
    unit: ClassVar[str] = "nat"
    sense: ClassVar[int] = -1
    moves_body: ClassVar[bool] = True

    def __post_init__(self) -> None:
        names = (self.unknown,) if isinstance(self.unknown, str) else entries(self.unknown)
        if not names or not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
            raise ValueError(
                f'Information: unknown must be names of numbers, such as "mass"; got {short(self.unknown)}'
            )
        noise = number("Information: noise", self.noise, "m", positive=True)
        checked(
            self, unknown=names, noise=noise, every=number("Information: every", self.every, "s", positive=True)
        )

    @property
    def learns(self) -> tuple[str, ...]:  # type: ignore[override]
        return tuple(self.unknown)

    def told(self, spreads: Any, duration: Any) -> Any:
        each = ca.sqrt(duration / self.every) / self.noise
        return sum(ca.log(spreads[k] * each) for k in range(len(self.learns)))

    def terminal(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        # What positions tell is not a matter of the end: see `told`.
        return 0

    def words(self) -> str:
        return f"Largest information on {' and '.join(self.learns)}"


class Constant(NamedTuple):
    """A constant of an effect: its name, the effect, the field in it, which entry of it, and its value."""

    name: str
    effect: int
    field: str
    entry: int
    value: float


def constants_of(effects: Sequence[Any]) -> Iterator[Constant]:
    """The constants of effects by their names."""
    for place, effect in enumerate(effects):
        for field in numeric_fields(effect):
            value, name = at(effect, field), f"{title(effect, place)}_{field.replace('.', '_')}"
            each = value if isinstance(value, tuple) else (value,)
            for i, one in enumerate(each):
                label = "" if not isinstance(value, tuple) else f".{AXES[i] if len(each) <= len(AXES) else i}"
                if isinstance(one, (int, float)):
                    yield Constant(name + label, place, field, i, float(one))


def learned_opened(problem: Any) -> tuple[Any, ...]:
    """The effects of a problem with those constants open that its objective is to learn.

    Raises
    ------
    ValueError
        If there is no such number, or it has no relative size, or the body is not a single one that does not
        turn.
    """
    names, effects = problem.objective.learns, tuple(problem.effects)
    if not names:
        return effects
    if problem.turns or problem.links or problem.system is not None:
        raise ValueError("Information is for one body that does not turn and is held by no links")
    known = {one.name: one for one in constants_of(effects)}
    for name in names:
        if name != MASS and name not in known:
            raise ValueError(
                f"Information: no number is called {short(name)}; there are {', '.join([MASS, *known])}"
            )
        if name != MASS and not known[name].value:
            raise ValueError(
                f"Information: {name} is 0, and errors are relative to the number; state what it may be"
            )
    fields = {(known[name].effect, known[name].field) for name in names if name != MASS}
    return tuple(
        opened(effect, sorted(field for place, field in fields if place == i))
        for i, effect in enumerate(effects)
    )
