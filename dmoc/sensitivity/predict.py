"""The path for changed numbers of a problem, to first order and without a solve."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.basics.arguments import entries, number, short
from dmoc.basics.quaternions import QUATERNION, normalised
from dmoc.ipopt.run import Answer
from dmoc.motion.path import DiscretePath
from dmoc.nlp.layout import Layout
from dmoc.planners.numbers import Number
from dmoc.sensitivity.optimum import Optimum
from dmoc.sensitivity.worth import conditions_of, is_direction

# These numbers have no meaning at zero and below.
POSITIVE = ("mass", "duration")
# A prediction that breaks a limit by more than this part of its size is none [-].
MOST_BROKEN = 1.0


def predict(solution: Any, **changes: Any) -> Any:
    """The path that is about optimal where numbers of the problem have other values.

    The optimality conditions of the answer are linearised, with the limits that act; the error is of second
    order in the changes, until another limit begins to act or one ends to (see the range of `worth`). The
    factorisation is kept with the solution: the first prediction makes it, each further one takes a small part
    of a solve. As a guess the path brings its multipliers:
    `solve(changed problem, order, steps, guess=predict(solution, mass=1.02))`.

    Parameters
    ----------
    solution : Solution, MissionSolution or TeamSolution
        A local optimum, with its problem.
    changes : float or sequence of float
        New values [SI] by the names that `worth` has without their entries: mass=1.02, goal_position=(2, 0),
        keep_out_2_radius=1.1.

    Returns
    -------
    DiscretePath, or MissionPath of a mission, TeamPath or PhasedPath of a team

    Raises
    ------
    ValueError
        If the problem has no such number, or the answer is degenerate, so that its conditions do not say how it
        moves; or if a change leads so far that a limit would be broken by its own size.

    Notes
    -----
    Fiacco, Introduction to Sensitivity and Stability Analysis in Nonlinear Programming (1983), chapter 3;
    as in sIPOPT (Pirnay, Lopez-Negrete, Biegler 2012).
    """
    made = conditions_of(solution)
    optimum = made.optimum
    numbers = optimum.numbers.kept
    wanted = _checked(numbers, changes)
    by = np.concatenate([wanted.get(one.name, one.value) - one.value for one in numbers])
    by = np.nan_to_num(by)
    moved = made.tangent(by[:, None])
    bounds = [bound + way @ by for bound, way in zip(optimum.bounds, optimum.matrices, strict=False)]
    x, rows = optimum.x + moved.x[:, 0], optimum.rows + moved.rows[:, 0]
    _refuse_what_breaks_limits(
        changes, np.concatenate([x, rows]), *map(np.concatenate, (bounds[::2], bounds[1::2]))
    )
    x = np.clip(x, *bounds[:2])
    lam_x, lam_g = optimum.lam_x + moved.lam_x[:, 0], optimum.lam_g + moved.lam_g[:, 0]
    answer = Answer(x, lam_x, lam_g, rows, 0.0, "", 0, 0, 0.0)
    if getattr(solution.problem, "phased", False):
        return _of_phases(optimum, answer, wanted)
    if hasattr(solution.problem, "members"):
        return _of_team(optimum, answer, wanted)
    if hasattr(solution.problem, "plan"):
        return _of_mission(optimum, answer, wanted)
    path = _with_unit_quaternions(optimum.program.path(solution.problem, answer))
    return _with_stated(optimum.program.columns, path, wanted)


def _refuse_what_breaks_limits(changes: Any, values: Any, lower: Any, upper: Any) -> None:
    """ValueError if unknowns or rows, in units of their size, are far beyond their limits.

    Limits that do not act at the answer are not looked at, so that a change that is too large breaks them.
    """
    broken = float(np.maximum(lower - values, values - upper).max(initial=0.0))
    if broken > MOST_BROKEN:
        told = ", ".join(f"{name}={short(value)}" for name, value in changes.items())
        raise ValueError(
            f"{told} is too far from the answer: to first order a limit would be broken by {broken:.3g} times "
            "its size; predict in smaller changes, or solve with these values"
        )


def _of_mission(optimum: Optimum, answer: Answer, wanted: dict[str, np.ndarray]) -> Any:
    """The path of a mission, whose legs last as long as is stated where that is no unknown."""
    from dmoc.planners.mission import identifiers

    mission, path = optimum.program.mission, optimum.program.path(answer)
    legs = []
    for leg, plan, placed, name in zip(
        path.legs, mission.plan, optimum.program.legs, identifiers(mission.leg_names), strict=True
    ):
        own = f"{name}_duration" if plan.duration is not None else "duration"
        lasts = leg.duration
        if own in wanted and "duration" not in placed.program.columns:
            lasts = float(wanted[own][0])
        legs.append(replace(_with_unit_quaternions(leg), duration=lasts))
    return replace(path, legs=tuple(legs), near=True)


def _of_team(optimum: Optimum, answer: Answer, wanted: dict[str, np.ndarray]) -> Any:
    """The paths of all bodies."""
    from dmoc.planners.mission import identifiers

    team, path = optimum.program.mission, optimum.program.path(answer)
    legs = []
    for leg, placed, name in zip(path.legs, optimum.program.legs, identifiers(team.leg_names), strict=True):
        own = {
            one: wanted[long]
            for one, long in (("duration", "duration"), ("mass", f"{name}_mass"))
            if long in wanted
        }
        legs.append(_with_stated(placed.program.columns, _with_unit_quaternions(leg), own))
    begins = wanted.get("start_time", np.array(path.begins[:1]))
    return replace(path, legs=tuple(legs), begins=(float(begins[0]),) * len(legs))


def _of_phases(optimum: Optimum, answer: Answer, wanted: dict[str, np.ndarray]) -> Any:
    """The paths of a team of missions, whose phases last as is stated where that is no unknown."""
    plan, path = optimum.program.mission, optimum.program.path(answer)
    lasts = path.durations
    for one in optimum.numbers.kept:
        if one.name in wanted:
            lasts = lasts + np.nan_to_num(one.changed(wanted[one.name]).known - plan.known)
    legs = tuple(
        replace(_with_unit_quaternions(leg), duration=float(lasts[i % plan.count]))
        for i, leg in enumerate(path.legs)
    )
    return replace(path, legs=legs, near=True)


def _checked(numbers: list[Number], changes: dict[str, Any]) -> dict[str, np.ndarray]:
    """The values that are given, as columns; what is given for an entry that is free has no meaning."""
    known = {one.name: one for one in numbers}
    if strange := [name for name in changes if name not in known]:
        raise ValueError(f"no number is called {short(strange[0])}; there are {', '.join(known)}")
    if not changes:
        raise ValueError(f"give a number another value: {', '.join(known)}")
    found = {}
    for name, given in changes.items():
        one, values = known[name], entries(given)
        if values is None and one.value.size == 1:
            values = (given,)
        if values is None or len(values) != one.value.size:
            raise ValueError(f"{name} has {one.value.size} entries; got {short(given)}")
        after = [
            0.0 if np.isnan(stated) else number(name, value, one.term.unit, positive=name in POSITIVE)
            for value, stated in zip(values, one.value, strict=True)
        ]
        found[name] = _unit(after, one.value) if is_direction(one) else np.array(after)
    return found


def _unit(given: list[float], before: np.ndarray) -> np.ndarray:
    """A direction or a quaternion of length 1; of a quaternion and its negative, one attitude, the nearer."""
    length = float(np.linalg.norm(given))
    if not length:
        raise ValueError("a direction or an attitude must not be zero")
    unit = np.array(given) / length
    return -unit if len(unit) == QUATERNION and unit @ before < 0 else unit


def _with_unit_quaternions(path: DiscretePath) -> DiscretePath:
    position = path.position.copy()
    for at in path.coordinates.quaternions:
        position[:, at] = normalised(position[:, at])
    return replace(path, position=position)


def _with_stated(columns: Layout, path: DiscretePath, wanted: dict[str, np.ndarray]) -> DiscretePath:
    """A path of a transfer with the duration and the mass where these are no unknowns of it."""
    if "duration" in wanted and "duration" not in columns:
        path = replace(path, duration=float(wanted["duration"][0]))
    if "mass" in wanted and "mass" not in columns:
        path = replace(path, mass=np.full(len(path.mass), wanted["mass"][0]))
    return path
