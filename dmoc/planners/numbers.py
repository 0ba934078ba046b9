"""The numbers of a problem that a solve may change, and how an NLP takes them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import fields, is_dataclass, replace
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.docstrings import documented
from dmoc.basics.records import dataclass
from dmoc.basics.unknown import Unknown, at, is_number, is_unknown, with_field
from dmoc.ends.base import Boundary
from dmoc.nlp.solving import NLP
from dmoc.parts.rows import title
from dmoc.planners.terms import Term
from dmoc.scene.problem import TransferProblem

# How a bound or parameter depends on a number is found by evaluating it at this value [in the number's SI
# unit]: bounds and parameters are NumPy arrays, of which CasADi has no derivative. If b(x) = c + a x, then
# b(2^100) is a 2^100 alone: next to a number so large, c is lost in rounding. Dividing by a power of two
# changes no digit, so a is exact, while a difference of two values near each other would lose half of them.
HUGE = 2.0**100
# The slopes found at plus and minus `HUGE` may differ by this relative error [-]; more means not affine.
AFFINE = 1e-12
# Fields whose arguments are called otherwise: an attitude has one name in all functions, and limits that of the
# argument their part is made with.
CALLED = {
    "quaternion": "attitude",
    "most_force": "force_limit",
    "most_torque": "torque_limit",
    "momenta": "wheel_momentum",
}

# All bodies of a team have these numbers in common.
SHARED = ("duration", "durations", "start_time")


@dataclass(frozen=True)
class Number:
    """One number or a column of them; `changed` gives the problem with others in their place, unchecked."""

    name: str
    value: np.ndarray
    term: Term
    changed: Callable[[np.ndarray], Any]


class Numbers:
    """The numbers of a problem that its NLP takes as bounds or parameters.

    Bounds and parameters are affine in them, constant + matrix @ numbers; each column of the matrix is found
    by changing one number. A number that enters in another way stays as the problem states it.
    """

    def __init__(self, problem: Any, candidates: Iterable[Number], taken: Callable[[Any], list[np.ndarray]]):
        """`taken` gives the bounds and parameters, vector by vector, that the NLP has for a problem."""
        self._vectors = taken
        self.sizes = [len(vector) for vector in taken(problem)]
        self.base = self._taken(problem)
        self.kept: list[Number] = []
        columns: list[np.ndarray] = []
        for number in candidates:
            slopes = [self._slope(number, i) for i in range(number.value.size)]
            if np.isfinite(slopes).all() and np.any(slopes):
                self.kept.append(number)
                columns += slopes
        matrix = np.stack(columns, axis=1)
        values = np.concatenate([self.value(name) for name in self.names])
        known = np.where(np.isfinite(values), values, 0.0)
        self.matrix, self.constant = ca.sparsify(ca.DM(matrix)), ca.DM(self.base - matrix @ known)

    @classmethod
    def of(cls, nlp: NLP) -> Numbers:
        """Those of a transfer."""

        def taken(problem: TransferProblem) -> list[np.ndarray]:
            return [*nlp.column_bounds(problem), nlp.parameters(problem)]

        return cls(nlp.problem, numbers_of(nlp.problem), taken)

    @property
    def names(self) -> list[str]:
        return [number.name for number in self.kept]

    @property
    def terms(self) -> dict[str, Term]:
        return {number.name: number.term for number in self.kept}

    def value(self, name: str) -> np.ndarray:
        """What the problem states; 0 for entries it leaves free."""
        value = next(number.value for number in self.kept if number.name == name)
        return np.where(np.isnan(value), 0.0, value)

    def symbols(self) -> dict[str, ca.MX]:
        return {number.name: ca.MX.sym(number.name, number.value.size) for number in self.kept}

    def bounds_and_parameters(self, given: dict[str, ca.MX]) -> list[ca.MX]:
        """Scaled lower and upper bounds of the unknowns, of a mission those of the rows too, and parameters."""
        taken = self.constant + self.matrix @ ca.vertcat(*[given[name] for name in self.names])
        return ca.vertsplit(taken, np.cumsum([0, *self.sizes]).tolist())

    def _taken(self, problem: Any) -> np.ndarray:
        return np.concatenate(self._vectors(problem))

    def _slope(self, number: Number, index: int) -> np.ndarray:
        """Derivative of bounds and parameters by one entry; NaN if they are not affine in it."""
        # infinite bounds are no limits, whatever the number
        slopes, known = [], np.isfinite(self.base)
        for by in (HUGE, -HUGE):
            values = number.value.copy()
            values[index] += by
            taken = self._taken(number.changed(values))
            # a special value may do without a parameter that all others have, such as an eccentricity of 0
            # without the direction of the pericentre: such a number stays as it is
            if taken.shape != self.base.shape:
                return np.full(self.base.shape, np.nan)
            slopes.append(np.where(known, taken - np.where(known, self.base, 0.0), 0.0) / by)
        up, down = slopes
        return up if np.allclose(up, down, rtol=AFFINE, atol=0.0) else np.full(self.base.shape, np.nan)


def numbers_of(problem: TransferProblem) -> Iterator[Number]:
    """All numbers a problem states: of its parts, then its own."""
    yield from _numbers_of_parts(problem, ("start", "goal", "actuator", "objective"), "", lambda twin: twin)
    duration = ("durations", "shortest and longest duration") if problem.free_duration else ("duration",) * 2
    own = {"mass": ("mass", "mass at the start", "kg"), "start_time": ("start_time", "time at the start", "s")}
    for field, (name, words, unit) in (own | {"duration": (*duration, "s")}).items():
        yield _number(problem, field, name, Term(unit, words), lambda twin: twin)


def numbers_of_team(team: Any, names: Sequence[str]) -> Iterator[Number]:
    """All numbers a team states: of each body by its name, and once the times that all of them share."""
    for place, (member, name) in enumerate(zip(team.members, names, strict=True)):
        for number in numbers_of(member):
            if number.name in SHARED:
                if place == 0:
                    yield replace(number, changed=partial(_all_changed, team, number.changed))
                continue
            words = f"{name.replace('_', ' ')}: {number.term.words}"
            changed = partial(_one_changed, team, place, number.changed)
            yield Number(f"{name}_{number.name}", number.value, Term(number.term.unit, words), changed)


def _all_changed(team: Any, changed: Callable[[np.ndarray], Any], values: np.ndarray) -> Any:
    times = {name: getattr(changed(values), name) for name in ("start_time", "duration")}
    members = team.members
    for name, value in times.items():
        members = tuple(with_field(member, name, value) for member in members)
    return with_field(team, "members", members)


def _one_changed(team: Any, place: int, changed: Callable[[np.ndarray], Any], values: np.ndarray) -> Any:
    return _with_entry(team, "members", place, changed(values))


def numbers_of_mission(mission: Any, names: Sequence[str]) -> Iterator[Number]:
    """All numbers a mission states, then those that its legs state for themselves, by the `names` of these."""
    yield from _numbers_of_parts(mission, ("start", "goal", "actuator", "objective"), "", lambda twin: twin)
    for field, unit in (("mass", "kg"), ("start_time", "s"), ("duration", "s")):
        if getattr(mission, field) is not None:
            yield _timed(
                mission, field, field, f"{field.replace('_', ' ')} of the mission", unit, lambda twin: twin
            )
    for place, part in enumerate(mission.legs):
        if not hasattr(part, "control_degree"):
            continue
        name = names[sum(hasattr(one, "control_degree") for one in mission.legs[:place])]
        put = partial(_with_entry, mission, "legs", place)
        owners = [] if part.actuator is None else ["actuator"]
        yield from _numbers_of_parts(part, owners, f"{name}_", put)
        if part.duration is not None:
            yield _timed(
                part, "duration", f"{name}_duration", f"duration of {name.replace('_', ' ')}", "s", put
            )


def _timed(part: Any, field: str, name: str, words: str, unit: str, put: Callable[[Any], Any]) -> Number:
    """A number, or the least and the most of one that is free between them."""
    if np.ndim(getattr(part, field)):
        name, words = f"{name}s", f"least and most {words}"
    return _number(part, field, name, Term(unit, words), put)


def _numbers_of_parts(whole: Any, owners: Sequence[str], prefix: str, put: Callable) -> Iterator[Number]:
    """The numbers of some parts of a problem, a mission or a leg, and of its constraints."""

    def changed(field: str, value: Any) -> Any:
        return put(with_field(whole, field, value))

    def changed_entry(kind: str, place: int, part: Any) -> Any:
        return put(_with_entry(whole, kind, place, part))

    for owner in owners:
        yield from _numbers_of_part(getattr(whole, owner), f"{prefix}{owner}", partial(changed, owner))
    for kind in ("constraints", "effects"):
        for i, part in enumerate(getattr(whole, kind) or ()):
            # Of effects only what is unknown is no constant.
            if kind == "constraints" or part.adjustable:
                owner = f"{prefix}{title(part, i)}"
                yield from _numbers_of_part(part, owner, partial(changed_entry, kind, i))


def _numbers_of_part(part: Any, owner: str, put: Callable[[Any], Any]) -> Iterator[Number]:
    stated = [field.name for field in fields(part)] if is_dataclass(part) else []
    entries = documented(type(part).__doc__)
    counts = getattr(part, "counts", ())
    for field in [one for one in dict.fromkeys([*stated, *part.adjustable]) if one not in counts]:
        called = CALLED.get(field, field)
        documented_as = field if field in entries else called
        own = getattr(part, "units_of_numbers", {})
        unit = entries[documented_as].unit if documented_as in entries else own.get(field, "")
        value, (inside, _, last) = at(part, field), field.rpartition(".")
        if inside:
            unit = documented(type(at(part, inside)).__doc__)[last].unit
        if isinstance(value, Boundary):
            # An end of a body that carries wheels is one of the body alone, and the wheels.
            yield from _numbers_of_part(value, owner, partial(_put_inside, put, part, field))
        if isinstance(value, tuple) and value and all(isinstance(one, Boundary) for one in value):
            for i, one in enumerate(value):
                inside = partial(_put_among, put, part, field, i)
                yield from _numbers_of_part(one, f"{owner}_{part.names[i]}", inside)
            continue
        called = called.replace(".", "_")
        words = f"{called.replace('_', ' ')} of the {owner.replace('_', ' ')} ({type(part).__name__})"
        if is_number(value):
            free = "; entries that the problem leaves free are ignored" if None in np.atleast_1d(value) else ""
            yield _number(part, field, f"{owner}_{called}", Term(unit, words + free), put)


def _put_inside(put: Callable[[Any], Any], part: Any, field: str, twin: Any) -> Any:
    return put(with_field(part, field, twin))


def _put_among(put: Callable, part: Any, field: str, place: int, twin: Any) -> Any:
    return put(_with_entry(part, field, place, twin))


def _number(part: Any, field: str, name: str, term: Term, put: Callable[[Any], Any]) -> Number:
    before = at(part, field)
    kind = Unknown if any(map(is_unknown, np.atleast_1d(np.array(before, object)))) else float

    def changed(values: np.ndarray) -> Any:
        entries = tuple(None if np.isnan(value) else kind(value) for value in values)
        return put(with_field(part, field, entries if np.ndim(before) else entries[0]))

    return Number(name, np.atleast_1d(np.array(before, float)), term, changed)


def _with_entry(whole: Any, field: str, place: int, part: Any) -> Any:
    """A copy with another part in a place of a field."""
    before = getattr(whole, field)
    return with_field(whole, field, (*before[:place], part, *before[place + 1 :]))
