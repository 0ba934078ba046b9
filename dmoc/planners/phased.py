"""The program of a team of missions with named unknowns in SI units, for functions that leave the package."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from dmoc.basics.arguments import entries
from dmoc.phases.between import SPANS
from dmoc.phases.climb import first_phases
from dmoc.phases.program import PhasedProgram
from dmoc.phases.timetable import Timetable
from dmoc.planners.mission import MissionPlanner, identifiers, scenes_of, stretch_with
from dmoc.planners.numbers import Number, Numbers, numbers_of_mission
from dmoc.planners.terms import Term
from dmoc.scene.mission import Mission
from dmoc.scene.problem import TransferProblem

# How bounds depend on a duration is found with the duration so many times as long. They must depend on it in
# one way as far as that: where a shorter duration comes to bound a phase instead, the number stays as stated.
LONGER = (2.0, 16.0)
# The least duration may only fall.
SHORTER = (0.5, 0.0625)
# Durations of phases follow from those of legs with this relative error [-].
ROUNDING = 1e-11
# What a mission states that its legs and its ends take from it.
OWN = ("mass", "start", "goal", "start_time", "actuator", "constraints", "effects", "objective")


class PhasedPlanner(MissionPlanner):
    """The program of a team of missions, and what its functions need to speak SI units.

    The legs of all bodies, cut into phases, stand beside each other. The order of joints is that of the guess.
    """

    kind = "team"
    parts = "legs and joints and of what holds between bodies"

    @classmethod
    def of(  # type: ignore[override]
        cls, team: Any, order: int | None, steps: int | None, hold: bool, guess: Any = None
    ) -> PhasedPlanner:
        """The planner of a team on the meshes of its guess, or on those it is solved on at first."""
        plan, path = first_phases(team, order, steps, hold, guess)
        program = PhasedProgram.of(plan, plan.stretches, path)
        return cls(program, path, scenes_of(plan.stretches, path), identifiers(plan.leg_names))

    @cached_property
    def numbers(self) -> Numbers:
        return numbers_of_phases(self.program)


def numbers_of_phases(program: Any) -> Numbers:
    """The numbers of a team of missions that its program takes as bounds or parameters."""
    plan = _uncapped(program.mission)
    candidates = [*_of_bodies(plan), *_of_times(plan)]
    return PhasedNumbers(plan, candidates, lambda twin: _taken(program, twin))


class PhasedNumbers(Numbers):
    """As of a mission; durations of phases follow from those that are stated, within rounding."""

    def _slope(self, number: Number, index: int) -> np.ndarray:
        if "duration" not in number.name.rsplit("_", 1)[-1]:
            return super()._slope(number, index)
        none = np.full(self.base.shape, np.nan)
        slopes, known = [], np.isfinite(self.base)
        for factor in SHORTER if number.value.size == 2 and index == 0 else LONGER:
            values = number.value.copy()
            values[index] *= factor
            try:
                taken = self._taken(number.changed(values))
            except ValueError:
                # It contradicts the durations of others.
                return none
            if taken.shape != self.base.shape:
                return none
            change = np.where(known, taken - np.where(known, self.base, 0.0), 0.0)
            slopes.append(change / (values[index] - number.value[index]))
        one, other = slopes
        one[np.abs(one) < ROUNDING * np.abs(one).max()] = 0.0
        return one if np.abs(one - other).max() <= ROUNDING * np.abs(one).max() else none


def _of_bodies(plan: Timetable) -> Iterator[Number]:
    """The numbers that bodies state for themselves, by their names, but for times; one start for all."""
    each = zip(identifiers(plan.names, "body"), plan.missions, strict=True)
    for body, (name, mission) in enumerate(each):
        words = name.replace("_", " ")
        for number in numbers_of_mission(mission, identifiers(mission.leg_names)):
            if number.name.startswith("start_time"):
                if body == 0:
                    yield replace(number, changed=partial(_begun, plan, number.changed))
            elif number.term.unit != "s" or "duration" not in number.name:
                term = Term(number.term.unit, f"{words}: {number.term.words}")
                changed = partial(_other_body, plan, body, number.changed)
                yield Number(f"{name}_{number.name}", number.value, term, changed)


def _of_times(plan: Timetable) -> Iterator[Number]:
    """The durations that are stated: of the whole once if all bodies state the same, else body by body."""
    names = identifiers(plan.names, "body")
    stated = [one.duration for one in plan.team.members]
    same = [body for body, value in enumerate(stated) if value is not None]
    if len({stated[body] for body in same}) == 1:
        yield _duration("", "all bodies", stated[same[0]], partial(_lasting, plan, same, None))
    else:
        for body in same:
            yield _duration(
                f"{names[body]}_",
                names[body].replace("_", " "),
                stated[body],
                partial(_lasting, plan, [body], None),
            )
    for body, (name, mission) in enumerate(zip(names, plan.missions, strict=True)):
        for leg, called in enumerate(identifiers(mission.leg_names)):
            value = mission.plan[leg].duration
            if value is not None and hasattr(plan.team.members[body], "joints"):
                words = f"{called.replace('_', ' ')} of {name.replace('_', ' ')}"
                yield _duration(f"{name}_{called}_", words, value, partial(_lasting, plan, [body], leg))


def _duration(prefix: str, words: str, value: Any, changed: Callable) -> Number:
    free = entries(value) is not None
    term = Term("s", f"{'least and most ' * free}duration of {words}")
    return Number(f"{prefix}duration{'s' * free}", np.atleast_1d(np.array(value, float)), term, changed)


def _lasting(plan: Timetable, bodies: list[int], leg: int | None, values: np.ndarray) -> Timetable:
    """The timetable with other durations of some bodies, or of one leg of them; ValueError if it has none."""
    span = tuple(map(float, values)) if values.size == 2 else float(values[0])
    members = list(plan.team.members)
    for body in bodies:
        one = members[body]
        if leg is None:
            members[body] = replace(one, duration=span)
        else:
            places = [i for i, part in enumerate(one.legs) if hasattr(part, "control_degree")]
            parts = list(one.legs)
            parts[places[leg]] = replace(parts[places[leg]], duration=span)
            members[body] = replace(one, legs=tuple(parts))
    team = replace(plan.team, members=tuple(members))
    return _uncapped(Timetable(team, plan.order, plan.shortest))


def _uncapped(plan: Timetable) -> Timetable:
    """The timetable with phases bounded by what is asked of each alone, if anything is.

    What is asked of several together has rows of its own, and need not cap them, too: so a bound that is
    stated depends on nothing but itself.
    """
    twin = Timetable(plan.team, plan.order, plan.shortest)
    bounds = twin.bounds.copy()
    for i in np.flatnonzero(np.isnan(twin.known)):
        alone = [span.longest for span in twin.spans if span.first == span.last == i]
        bounds[i, 1] = min(alone, default=bounds[i, 1])
    twin.__dict__["bounds"] = bounds
    return twin


def _other_body(plan: Timetable, body: int, changed: Callable, values: np.ndarray) -> Timetable:
    """The timetable with another mission of one body, unchecked."""
    return _with_missions(plan, {body: changed(values)})


def _begun(plan: Timetable, changed: Callable, values: np.ndarray) -> Timetable:
    """The timetable with another time of the start, unchecked."""
    begins = changed(values).start_time
    return _with_missions(plan, {i: _put(one, start_time=begins) for i, one in enumerate(plan.missions)})


def _with_missions(plan: Timetable, other: dict[int, Mission]) -> Timetable:
    """The timetable with other missions of some bodies in place of its own, and these cut in the same way."""
    twin = copy.copy(plan)
    cut = list(plan.cut)
    for body, mission in other.items():
        own = {name: getattr(mission, name) for name in OWN}
        legs = iter(mission.plan[leg] for leg in plan.leg_of[body])
        parts = [
            _of_leg(part, next(legs)) if hasattr(part, "control_degree") else part for part in cut[body].legs
        ]
        cut[body] = _put(cut[body], **own, legs=tuple(parts))
    twin.__dict__["cut"] = tuple(cut)
    return twin


def _of_leg(part: Any, leg: Any) -> Any:
    return _put(part, actuator=leg.actuator, constraints=leg.constraints, effects=leg.effects)


def _put(part: Any, **values: Any) -> Any:
    """A copy with other values in its fields, without the checks of its constructor."""
    twin = copy.copy(part)
    for name, value in values.items():
        object.__setattr__(twin, name, value)
    return twin


def _taken(program: PhasedProgram, twin: Timetable) -> list[np.ndarray]:
    """Bounds and parameters of a team that differs in numbers, unchecked."""
    bodies, count = [], twin.count
    for i, body in enumerate(program.bodies):
        legs = [
            _taking(placed, stretch_with(twin.cut[i], phase)) for phase, placed in enumerate(body.program.legs)
        ]
        bodies.append(body._replace(program=replace(body.program, mission=twin.cut[i], legs=tuple(legs))))
    legs = [
        _taking(placed, stretch_with(twin.cut[i // count], i % count)) for i, placed in enumerate(program.legs)
    ]
    sides = [side.copy() for side in program.row_bounds]
    for group in program.rows.groups:
        if group.name == SPANS:
            first = group.start - program.joint_rows
            given = [float(np.nansum(twin.known[span.first : span.last + 1])) for span in twin.rows]
            for side, ends in zip(
                sides,
                ([span.shortest for span in twin.rows], [span.longest for span in twin.rows]),
                strict=True,
            ):
                if len(ends) != len(group.labels):
                    raise ValueError("other durations are to be asked for")
                side[first : first + len(ends)] = (np.array(ends) - given) * group.scales.ravel()
    changed = replace(
        program,
        mission=twin,  # type: ignore[arg-type]
        legs=tuple(legs),
        bodies=tuple(bodies),
        row_bounds=(sides[0], sides[1]),
    )
    return [*changed.bounds(), changed.parameters()]


def _taking(placed: Any, problem: TransferProblem) -> Any:
    return replace(placed, program=replace(placed.program, problem=problem))
