"""The numbers of a problem that a solve may change, and how an NLP takes them."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, is_dataclass
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.docstrings import documented
from dmoc.ends.base import Boundary
from dmoc.exports.terms import Term
from dmoc.nlp.solving import NLP
from dmoc.parts.rows import title
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


@dataclass(frozen=True)
class Number:
    """One number or a column of them; `changed` gives the problem with others in their place, unchecked."""

    name: str
    value: np.ndarray
    term: Term
    changed: Callable[[np.ndarray], TransferProblem]


class Numbers:
    """The numbers of a problem that its NLP takes as bounds or parameters.

    Bounds and parameters are affine in them, constant + matrix @ numbers; each column of the matrix is found
    by changing one number. A number that enters in another way stays as the problem states it.
    """

    def __init__(self, nlp: NLP):
        self.nlp = nlp
        self.base = self._taken(nlp.problem)
        self.kept: list[Number] = []
        columns: list[np.ndarray] = []
        for number in numbers_of(nlp.problem):
            slopes = [self._slope(number, i) for i in range(number.value.size)]
            if np.isfinite(slopes).all() and np.any(slopes):
                self.kept.append(number)
                columns += slopes
        matrix = np.stack(columns, axis=1)
        values = np.concatenate([self.value(name) for name in self.names])
        known = np.where(np.isfinite(values), values, 0.0)
        self.matrix, self.constant = ca.sparsify(ca.DM(matrix)), ca.DM(self.base - matrix @ known)

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
        """Scaled lower and upper bounds of the unknowns, and parameters."""
        taken = self.constant + self.matrix @ ca.vertcat(*[given[name] for name in self.names])
        size = self.nlp.columns.size
        return ca.vertsplit(taken, [0, size, 2 * size, taken.numel()])

    def _taken(self, problem: TransferProblem) -> np.ndarray:
        lower, upper, _, _ = self.nlp.bounds(problem)
        return np.concatenate([lower, upper, self.nlp.parameters(problem)])

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
    for owner in ("start", "goal", "actuator", "objective"):
        yield from _numbers_of_part(getattr(problem, owner), owner, partial(_with, problem, owner))
    for i, part in enumerate(problem.constraints):
        owner = title(part, i)
        yield from _numbers_of_part(part, owner, partial(_with_constraint, problem, i))
    duration = ("durations", "shortest and longest duration") if problem.free_duration else ("duration",) * 2
    own = {"mass": ("mass", "mass at the start", "kg"), "start_time": ("start_time", "time at the start", "s")}
    for field, (name, words, unit) in (own | {"duration": (*duration, "s")}).items():
        yield _number(problem, field, name, Term(unit, words), lambda twin: twin)


def _numbers_of_part(part: Any, owner: str, put: Callable[[Any], TransferProblem]) -> Iterator[Number]:
    stated = [field.name for field in fields(part)] if is_dataclass(part) else []
    entries = documented(type(part).__doc__)
    for field in dict.fromkeys([*stated, *part.adjustable]):
        called = CALLED.get(field, field)
        documented_as = field if field in entries else called
        own = getattr(part, "units_of_numbers", {})
        unit = entries[documented_as].unit if documented_as in entries else own.get(field, "")
        value = getattr(part, field)
        if isinstance(value, Boundary):
            # An end of a body that carries wheels is one of the body alone, and the wheels.
            yield from _numbers_of_part(value, owner, partial(_put_inside, put, part, field))
        if isinstance(value, tuple) and value and all(isinstance(one, Boundary) for one in value):
            for i, one in enumerate(value):
                inside = partial(_put_among, put, part, field, i)
                yield from _numbers_of_part(one, f"{owner}_{part.names[i]}", inside)
            continue
        words = f"{called.replace('_', ' ')} of the {owner.replace('_', ' ')} ({type(part).__name__})"
        if _is_number(value):
            free = "; entries that the problem leaves free are ignored" if None in np.atleast_1d(value) else ""
            yield _number(part, field, f"{owner}_{called}", Term(unit, words + free), put)


def _put_inside(put: Callable[[Any], TransferProblem], part: Any, field: str, twin: Any) -> TransferProblem:
    return put(_with(part, field, twin))


def _put_among(put: Callable, part: Any, field: str, place: int, twin: Any) -> TransferProblem:
    before = getattr(part, field)
    return put(_with(part, field, (*before[:place], twin, *before[place + 1 :])))


def _number(part: Any, field: str, name: str, term: Term, put: Callable[[Any], TransferProblem]) -> Number:
    before = getattr(part, field)

    def changed(values: np.ndarray) -> TransferProblem:
        entries = tuple(None if np.isnan(value) else float(value) for value in values)
        return put(_with(part, field, entries if np.ndim(before) else entries[0]))

    return Number(name, np.atleast_1d(np.array(before, float)), term, changed)


def _is_number(value: Any) -> bool:
    """Whether a field holds a number or a column of numbers, of which some may be left free."""
    entries = value if isinstance(value, tuple) else (value,)
    numeric = [isinstance(entry, (int, float)) and not isinstance(entry, bool) for entry in entries]
    return any(numeric) and all(known or entry is None for known, entry in zip(numeric, entries, strict=True))


def _with(part: Any, field: str, value: Any) -> Any:
    """A copy with another value in a field, without the checks of its constructor."""
    twin = copy.copy(part)
    object.__setattr__(twin, field, value)
    return twin


def _with_constraint(problem: TransferProblem, place: int, part: Any) -> TransferProblem:
    parts = (*problem.constraints[:place], part, *problem.constraints[place + 1 :])
    return _with(problem, "constraints", parts)
