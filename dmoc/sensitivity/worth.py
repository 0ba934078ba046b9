"""What the numbers of a problem are worth: derivatives of its least cost by each of them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from dmoc.basics.arguments import of_kind
from dmoc.basics.memory import Shelf
from dmoc.basics.quaternions import times
from dmoc.basics.records import dataclass
from dmoc.planners.numbers import Number
from dmoc.planners.terms import ATTITUDE
from dmoc.results.solution import Outcome
from dmoc.sensitivity.kkt import ActiveSet, SingularError
from dmoc.sensitivity.optimum import Optimum

# The conditions at so many answers are held, so that each is factorised once.
_HELD = Shelf(4)
# What the entries of a column are called.
AXES = ("x", "y", "z")
# Units of what has axes in space or in the body.
ALONG_AXES = ("m", "m/s", "m/s^2", "N", "rad/s", "N m")
# The entries of numbers that bound what is free between them, by the ends of their names.
SPANS = {"durations": ("least", "most"), "start_times": ("earliest", "latest")}

# A vector is one of unit length if it is so but for this [-].
UNIT = 1e-9
# A range that ends farther away than so many times the number has no end; nor, of a number that is zero, one
# that ends farther away than this.
FAR_TIMES, FAR = 1e6, 1e13
# The names of the numbers of both ends begin with these, of a team behind the name of a body.
ENDS = ("start_", "goal_")


@dataclass(frozen=True)
class Worth:
    """What one number of a problem is worth.

    Attributes
    ----------
    name : str
        Such as "mass", "goal_position.x", "keep_out_2_radius" or "goal_attitude.about_z", a turn about an axis
        of the body.
    value : float
        Derivative of the objective by the number, along optima.
    unit : str
        Of the value.
    range : tuple of float, or None
        From which to which value of the number no other limit begins to act and none ends to, judged by
        how fast the answer moves there; infinite where no limit is met, None where the answer is degenerate.
    number : float
        What the problem states, in `of`: 0 of a turn.
    of : str
        Unit of the number.
    words : str
        What the number is.
    """

    name: str
    value: float
    unit: str
    range: tuple[float, float] | None
    number: float
    of: str
    words: str


def worth(solution: Any) -> dict[str, Worth]:
    """The derivatives of the objective by all numbers of its problem, from the multipliers.

    Numbers are those of start, goal, actuator, zones and other constraints, mass, duration and start time; not
    those of effects, and where links join bodies not those of the ends, which cannot change one by one. A
    direction changes without its length. Where two limits leave no room between them, as of a thrust that never
    changes, their sum alone has a meaning. Of a team not what it says `together`.

    Nothing is solved again. As the envelope theorem says, the derivative is that of the Lagrangian at the
    answer, with unknowns and multipliers fixed (Fiacco 1983, chapter 3). The range comes from one
    factorisation of the optimality conditions; on a finer mesh more nodes meet a limit, one after the other, so
    that it is shorter there, while values hardly change. Where burns and touches are legs, as with
    `solve(problem, structure=True)`, it reaches to where one of them ends.

    Parameters
    ----------
    solution : Solution, MissionSolution or TeamSolution
        A local optimum, with its problem.

    Returns
    -------
    dict of Worth
        By their names. An entry that the problem leaves free has none.

    Raises
    ------
    ValueError
        If the solution is no optimum, or does not hold its problem.
    """
    made = conditions_of(solution)
    optimum, problem = made.optimum, solution.require_problem()
    cost = problem.objective.unit_with(problem.actuator)
    entries = list(_entries(optimum, _linked(problem)))
    ways = np.stack([way for *_, way in entries], axis=1)
    values = optimum.slope @ ways * optimum.cost * optimum.sense
    try:
        rooms: Any = made.room(made.tangent(ways), ways)
    except SingularError:
        rooms = [None] * len(entries)
    found = {}
    for (number, label, at, unit, _), value, room in zip(entries, values, rooms, strict=True):
        name = f"{number.name}.{label}" if label else number.name
        span = None if room is None else _span(at, *room)
        words = f"{number.term.words.split(';')[0]}{f', {label}' if label else ''}".replace("_", " ")
        found[name] = Worth(name, float(value), per(cost, unit), span, float(at), unit, words)
    return found


def conditions_of(solution: Any) -> ActiveSet:
    """The optimality conditions at a solution; ValueError if it is no optimum."""
    of_kind("solution", solution, Outcome)
    problem = solution.require_problem()
    if not solution.optimal:
        raise ValueError(
            f"only an optimum has multipliers that say what numbers are worth; this solve ended with status "
            f"{solution.status!r}: {solution.message}"
        )
    return _HELD.get(id(solution), lambda: (solution, ActiveSet(Optimum.of(solution, problem))))[1]


def per(above: str, below: str) -> str:
    """The unit of a quotient."""
    if below in ("-", "1", ""):
        return above or "1"
    return f"{above or '1'}/({below})" if {"/", " "} & set(below) else f"{above or '1'}/{below}"


def is_direction(number: Number) -> bool:
    """Whether its entries are a unit vector or a unit quaternion, whose length has no meaning."""
    known = number.value.size > 1 and number.term.unit in ("-", "")
    return known and bool(abs(np.linalg.norm(number.value) - 1.0) < UNIT)


def is_of_end(name: str) -> bool:
    """Whether a number is one of the start or of the goal."""
    return any(end in name for end in ENDS)


def _linked(problem: Any) -> bool:
    """Whether links join bodies of a problem."""
    return any(getattr(one, "links", ()) for one in (problem, *getattr(problem, "members", ())))


def _span(at: float, back: float, forth: float) -> tuple[float, float]:
    """The range of a number; a way that is far beyond any number of this kind is rounding, not a limit."""
    far = FAR_TIMES * abs(at) or FAR
    return float(at - back) if back < far else -np.inf, float(at + forth) if forth < far else np.inf


def _entries(optimum: Optimum, linked: bool) -> Iterator[tuple[Number, str, float, str, np.ndarray]]:
    """Number, label, value, unit and the way all numbers change by one of it, of every entry that is stated."""
    total, first = optimum.matrices[0].shape[1], 0
    for number in optimum.numbers.kept:
        size = number.value.size
        ways = np.zeros((size, total))
        ways[:, first : first + size] = np.eye(size)
        first += size
        if linked and is_of_end(number.name):
            continue
        if number.name.endswith(ATTITUDE.place) and size == 4:
            # Four numbers of length 1 have three ways to change: a turn of the body about each of its axes.
            turns = [0.5 * times(number.value, np.append(0.0, axis)) for axis in np.eye(3)]
            for label, turn in zip(AXES, turns, strict=True):
                yield number, f"about_{label}", 0.0, "rad", turn @ ways
            continue
        if is_direction(number):
            ways -= np.outer(number.value, number.value @ ways)
        labels = _labels(number)
        for label, value, way in zip(labels, number.value, ways, strict=True):
            if not np.isnan(value):
                yield number, label, value, number.term.unit, way


def _labels(number: Number) -> tuple[str, ...]:
    size = number.value.size
    if size == 1:
        return ("",)
    spans = [labels for ending, labels in SPANS.items() if number.name.endswith(ending)]
    if spans and size == 2:
        return spans[0]
    axes = size <= 3 and (number.term.unit in ALONG_AXES or is_direction(number))
    return AXES[:size] if axes else tuple(map(str, range(size)))
