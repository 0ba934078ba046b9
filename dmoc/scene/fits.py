"""Whether the parts of a problem fit each other and the body."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import entries, number, short
from dmoc.basics.quaternions import AXES, QUATERNION, rotation_of
from dmoc.effects.base import Body, Conservative
from dmoc.effects.user_functions import evaluated
from dmoc.ends.base import Boundary
from dmoc.parts.rows import Row


def checked_inertia(value: Any) -> tuple[tuple[float, ...], ...]:
    """An inertia in body axes [kg m^2] as a symmetric matrix: from three numbers or a matrix.

    Raises
    ------
    ValueError
        If it is no inertia of a body: not symmetric, not positive, or one principal moment above the sum of
        the others.
    """
    given = entries(value)
    rows = None if given is None else [entries(row) for row in given]
    if given is None or len(given) != AXES or rows is None:
        raise ValueError(f"inertia must be three numbers or three rows of three [kg m^2]; got {short(value)}")
    if all(row is None for row in rows):
        moments = [number(f"inertia[{i}]", x, "kg m^2", positive=True) for i, x in enumerate(given)]
        matrix = np.diag(moments)
    elif all(row is not None and len(row) == AXES for row in rows):
        matrix = np.array(
            [
                [number(f"inertia[{i}][{j}]", x, "kg m^2") for j, x in enumerate(row or ())]
                for i, row in enumerate(rows)
            ]
        )
    else:
        raise ValueError(f"inertia must be three numbers or three rows of three [kg m^2]; got {short(value)}")
    size = np.abs(matrix).max()
    if np.abs(matrix - matrix.T).max() > 1e-9 * size:
        raise ValueError(f"inertia must be symmetric [kg m^2]; got {short(value)}")
    small, middle, large = np.linalg.eigvalsh(matrix)
    if small <= 0:
        raise ValueError(f"inertia must have positive principal moments [kg m^2]; the smallest is {small:.3g}")
    # A flat plate has equality; the rounding of numbers with nine digits is allowed for.
    if large > (small + middle) * (1 + 1e-9):
        raise ValueError(
            f"no body has the principal moments {small:.4g}, {middle:.4g}, {large:.4g} kg m^2: none can be "
            "more than the sum of the two others"
        )
    return tuple(tuple(float(x) for x in row) for row in 0.5 * (matrix + matrix.T))


def turning_checked(inertia: Any, start: Boundary, goal: Boundary) -> dict[str, Any]:
    """The inertia and the goal of a problem, checked: a body with an inertia turns, and both its ends say how.

    Raises
    ------
    ValueError
        If one is given without the other.
    """
    ends = {"start": start, "goal": goal}
    if inertia is None:
        if any(end.turns_body for end in ends.values()):
            raise ValueError(
                "a body with an attitude needs its inertia [kg m^2]: give inertia=(Jx, Jy, Jz) about its "
                "principal axes, or a matrix of three rows"
            )
        return {}
    for name, end in ends.items():
        if not end.turns_body:
            raise ValueError(
                f"a body with an inertia turns, but its {name} has no attitude: use Pose(position, velocity, "
                "attitude, rate) or Attitude(quaternion, rate)"
            )
    if start.has_position != goal.has_position:
        raise ValueError("one end is a Pose and the other an Attitude; use the same for both")
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
    """Raise ValueError if a method of a user's own part gives another number of values than it must."""
    n, actuator = problem.dimension, problem.actuator
    t, q, v, m = ca.SX.sym("t"), ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("m")
    u = ca.SX.sym("u", problem.controls)
    functions: list[tuple[Any, str, list, int]] = [(actuator, "force", [u], n)]
    for effect in problem.effects:
        if effect.turns_body:
            if _is_users(effect):
                check_body_effect(effect, problem.inertia)
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


def _is_users(part: Any) -> bool:
    """Whether the class of a part is defined outside dmoc, where no test of dmoc has looked at it."""
    return not type(part).__module__.startswith("dmoc.")
