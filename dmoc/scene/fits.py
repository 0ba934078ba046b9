"""Whether the parts of a problem fit each other and the body."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import short
from dmoc.basics.quaternions import AXES, QUATERNION, rotation_of
from dmoc.configurations.rigid import checked_inertia
from dmoc.effects.base import Body, Conservative
from dmoc.effects.user_functions import evaluated
from dmoc.ends.base import Boundary
from dmoc.parts.rows import Row
from dmoc.scene.clock import clock_of


def turning_checked(system: Any, inertia: Any, start: Boundary, goal: Boundary) -> dict[str, Any]:
    """The inertia and the goal of a problem, checked: a body with an inertia turns, and one end says how.

    The bodies of a system, if it is one, were checked when it was made.

    Raises
    ------
    ValueError
        If one is given without the other.
    """
    ends = {"start": start, "goal": goal}
    if system is not None:
        return {"goal": goal.oriented(start)}
    if inertia is None:
        if any(end.turns_body for end in ends.values()):
            raise ValueError(
                "a body with an attitude needs its inertia [kg m^2]: give inertia=(Jx, Jy, Jz) about its "
                "principal axes, or a matrix of three rows"
            )
        return {}
    if not all(end.turns_body for end in ends.values()):
        raise ValueError(
            "a body with an inertia turns, but neither its start nor its goal has an attitude: use "
            "Pose(position, velocity, attitude, rate) or Attitude(quaternion, rate) for one of them"
        )
    return {"inertia": checked_inertia(inertia), "goal": goal.oriented(start)}


def check_acts_on(part: Any, turns: bool, moves: bool) -> None:
    """A part that turns the body needs one that turns; one that moves it needs a position.

    Raises
    ------
    ValueError
        If the body has not what the part needs.
    """
    name = type(part).__name__
    if getattr(part, "point", None) is not None and not turns:
        raise ValueError(
            f"{name} is for a point beside the centre of mass, which only a body that turns has; leave point "
            "out, or give the problem an inertia [kg m^2] and ends with an attitude, Pose"
        )
    if part.turns_body and not turns:
        raise ValueError(
            f"{name} acts on a body that turns; give the problem an inertia [kg m^2] and ends with an "
            "attitude, Pose or Attitude"
        )
    if part.moves_body and not moves:
        raise ValueError(
            f"{name} acts on a position, but the ends are attitudes alone; use what acts on attitudes, such as "
            "Torque(), or give the ends a position (Pose)"
        )


def check_body_effect(effect: Any, inertia: Any) -> None:
    """Raise ValueError if a user's own effect on a body gives another number of values than it must."""
    place, velocity, rate = (ca.SX.sym(name, AXES) for name in ("q", "v", "w"))
    attitude = ca.SX.sym("attitude", QUATERNION)
    body = Body(place, velocity, attitude, rotation_of(attitude), rate, np.array(inertia))
    name, t, m = type(effect).__name__, ca.SX.sym("t"), ca.SX.sym("m")
    try:
        potential, pushes = effect.lagrangian_of(t, body, m), effect.wrench_of(t, body, m)
        sizes = [None if part is None else ca.SX(part).numel() for part in pushes]
    except Exception as error:  # whatever a user's function raises
        words = " ".join(str(error).split())[:120]
        raise ValueError(f"{name} fails: {words}; write it with casadi's functions of (t, body, m)") from error
    if potential is not None and ca.SX(potential).numel() != 1:
        raise ValueError(f"{name}.lagrangian must give 1 value; it gives {ca.SX(potential).numel()}")
    if len(sizes) != 2 or any(size not in (None, AXES) for size in sizes):
        raise ValueError(
            f"{name}.wrench must give a force and a torque of {AXES} values each, or None; it gives {sizes}"
        )


def check_functions(problem: Any) -> None:
    """Raise ValueError if a user's own part gives another number of values than it must, or dates differ."""
    n, actuator = problem.dimension, problem.actuator
    t, q, v, m = ca.SX.sym("t"), ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("m")
    u = ca.SX.sym("u", problem.controls)
    functions: list[tuple[Any, str, list, int]] = [(actuator, "force", [u], n)]
    for effect in problem.effects:
        if effect.turns_body:
            if _is_users(effect):
                check_body_effect(effect, problem.inertias[0])
            continue
        single = isinstance(effect, Conservative)
        functions.append((effect, "lagrangian" if single else "force", [t, q, v, m], 1 if single else n))
    for _, term in problem.objective.terms:
        functions += [(term, "running", [t, q, v, u, m], 1), (term, "terminal", [t, q, v, m], 1)]
    for part, name, given, needed in functions:
        if _is_users(part):
            words, method = f"{type(part).__name__}.{name}", getattr(part, name)
            found = evaluated(words, method, given, "write it with casadi's functions").numel()
            if found != needed:
                raise ValueError(f"{words} must give {needed} values in {n} dimensions; it gives {found}")
    limits: list[tuple[Any, str, list]] = [(actuator, "rows", [u])]
    for constraint in problem.constraints:
        limits += [(constraint, "rows", [t, q, u, m]), (constraint, "speed_rows", [v])]
    for part, name, given in limits:
        rows = getattr(part, name)(*given) if _is_users(part) else []
        if not isinstance(rows, (list, tuple)) or not all(isinstance(row, Row) for row in rows):
            raise ValueError(
                f"{type(part).__name__}.{name} must give a list of dmoc.Row; it gives {short(rows)}"
            )
    clock_of(problem)


def _is_users(part: Any) -> bool:
    """Whether the class of a part is defined outside dmoc, where no test of dmoc has looked at it."""
    return not type(part).__module__.startswith("dmoc.")
