"""Problems of several bodies, and of bodies that links hold: whether what is given fits together."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import entries, short
from dmoc.configurations.of_problem import free_configuration
from dmoc.effects.user_functions import evaluated
from dmoc.links.holonomic import Holonomic
from dmoc.links.several import Several
from dmoc.links.system import System
from dmoc.parts.actuator import Actuator

# A boundary state may be off a link by this part of its position, and leave it at this part of its speed [-]:
# numbers that were written with ten digits are taken as meant.
END_GAP = 1e-8


def of_system(problem: Any) -> dict[str, Any]:
    """What a problem of several bodies is made of: masses, links and ends from the system."""
    system = problem.mass if isinstance(problem.mass, System) else problem.system
    actuator = problem.actuator
    several = entries(actuator)
    if several is not None and not isinstance(actuator, Actuator):
        actuator = Several(several)
    if system is None:
        if isinstance(actuator, Several) and problem.inertia is not None:
            raise ValueError("a list of actuators is for point masses; give a body that turns one actuator")
        return {"actuator": actuator}
    if problem.mass is not system and problem.mass != system.mass:
        raise ValueError(
            f"the bodies of the system have {system.mass:g} kg together; change their masses, "
            f"not that of the problem to {short(problem.mass)} kg"
        )
    if problem.inertia is not None:
        raise ValueError("bodies of a system have their own inertia; leave out that of the problem")
    # What only several bodies have is loaded for them alone.
    from dmoc.ends.each import each_of

    given = entries(problem.links) or ()
    links = (*system.links, *(link for link in given if link not in system.links))
    ends = {name: each_of(name, getattr(problem, name), system, links) for name in ("start", "goal")}
    return {
        "system": system,
        "mass": system.mass,
        "links": links,
        "actuator": actuator,
        **ends,
    }


def check_limited(problem: Any) -> None:
    """Each limit must be of a body that there is and that has what it limits.

    Raises
    ------
    ValueError
        If it names none of several bodies or one that there is not, limits the attitude of a point mass, or if
        a limit, a spring or a damper sits in a joint that is none of the links.
    """
    for part in (*problem.effects, *problem.constraints):
        joint = getattr(part, "joint", None)
        if isinstance(joint, Holonomic) and joint not in problem.links:
            raise ValueError(
                f"{type(part).__name__} sits in a {type(joint).__name__} that is no link; list it there"
            )
    names = problem.names
    turning = (
        [body.name for body in problem.system.bodies if body.inertia is not None] if problem.system else []
    )
    for i, limit in enumerate(problem.constraints):
        kind = f"{type(limit).__name__} (constraint {i + 1})"
        for name in limit.bodies:
            if problem.system is not None and not name:
                raise ValueError(
                    f"{kind} does not say which of the bodies {', '.join(names)} it limits; give it "
                    f"on={names[0]!r}"
                )
            if name not in names:
                raise ValueError(f"{kind} limits {short(name)}; {_known(names)}")
            if name and name not in turning and (limit.turns_body or limit.point is not None):
                raise ValueError(
                    f"{kind} is for a body that turns, and {name} is a point mass; give it an inertia [kg m^2]"
                )


def check_pushed(problem: Any) -> None:
    """Each actuator must push bodies that there are, and an objective of a system must not look at one place.

    Raises
    ------
    ValueError
        If it names others, acts on a body of which there are several, or turns a point mass.
    """
    names = problem.names
    points = [] if problem.system is None else [b.name for b in problem.system.bodies if b.inertia is None]
    for effect in problem.effects if points else ():
        if effect.turns_body:
            raise ValueError(_turned(effect, points[0]))
    for actuator in problem.actuator.parts if isinstance(problem.actuator, Several) else (problem.actuator,):
        pushed = actuator.bodies
        if problem.system is not None and pushed is None:
            raise ValueError(
                f"{type(actuator).__name__} does not say which of the bodies {', '.join(names)} it pushes; "
                f"use On({names[0]!r}, {type(actuator).__name__}(...))"
            )
        for name in pushed or ():
            if name not in names:
                raise ValueError(f"{type(actuator).__name__} acts on {short(name)}; {_known(names)}")
            if actuator.turns_body and name in points:
                raise ValueError(_turned(getattr(actuator, "push", actuator), name))
    if problem.system is None:
        return
    n, m, u = problem.dimension, ca.SX.sym("m"), ca.SX.sym("u", problem.controls)
    t, q, v = ca.SX.sym("t"), ca.SX.sym("q", n), ca.SX.sym("v", n)
    for _, term in problem.objective.terms:
        costs = term.terminal(t, q, v, m), term.rate(problem.actuator, t, q, v, u, m)
        if any(ca.depends_on(ca.SX(cost), ca.vertcat(q, v)) for cost in costs):
            raise ValueError(
                f"{type(term).__name__} looks at the place of one body, and a system has {len(names)}; "
                "use Effort() or Time()"
            )


def _turned(part: Any, name: str) -> str:
    return f"{type(part).__name__} turns bodies, and {name} is a point mass; give it an inertia [kg m^2]"


def _known(names: tuple[str, ...]) -> str:
    return f"the bodies are {', '.join(names)}" if names != ("",) else "there is one body, without a name"


def check_links(problem: Any) -> None:
    """Links must be there at both ends, hold each by itself, and leave the body a way to move.

    Raises
    ------
    ValueError
        If an end breaks a link or has a velocity that would, or if links are redundant there.
    """
    if not problem.links:
        return
    names = problem.system.names if problem.system is not None else ("",)
    body = free_configuration(problem)
    q, v = ca.SX.sym("q", body.size), ca.SX.sym("v", body.freedom)
    at = body.at(q, body.velocity(q, v), 1.0)
    rows = []
    for i, link in enumerate(problem.links):
        if strangers := [name for name in link.holds if name not in names]:
            stranger = short(strangers[0])
            raise ValueError(f"{type(link).__name__} (link {i + 1}) holds {stranger}; {_known(names)}")
        words = f"{type(link).__name__}.g (link {i + 1})"
        g = evaluated(words, lambda _, link=link: link.g_of(at), [q], "write it with casadi's functions")
        if not ca.depends_on(ca.SX(g), q):
            raise ValueError(f"{words} does not depend on the position; it must be zero where the link holds")
        rows.append(ca.vec(ca.SX(g)))
        for name in link.holds if link.joins_attitudes else ():
            if at[name].rotation is None:
                raise ValueError(
                    f"{type(link).__name__} (link {i + 1}) joins {name or 'a body'}, a point mass; give it "
                    "an inertia [kg m^2], or use a Rod"
                )
    for name in ("start", "goal"):
        position, velocity = getattr(problem, name).fixed()
        for i, (link, g) in enumerate(zip(problem.links, rows, strict=True)):
            _check_end(
                f"{name} breaks {type(link).__name__} (link {i + 1})",
                link,
                (q, v, g, ca.jtimes(g, q, body.velocity(q, v))),
                (position, velocity),
            )
        if not np.isnan(position).any():
            slopes = ca.jacobian(ca.vertcat(*rows), q) @ body.tangent(q)
            _check_rank(problem, name, ca.Function("slopes", [q], [slopes])(position))


def _check_end(words: str, link: Any, symbols: tuple, state: tuple[np.ndarray, np.ndarray]) -> None:
    (q, v, g, opening), (position, velocity) = symbols, state
    # NaN marks what is free: what depends on it is not known.
    known = np.nan_to_num(position), np.nan_to_num(velocity)
    looks = [i for i in range(len(position)) if ca.depends_on(g, q[i])]
    if np.isnan(position[looks]).any():
        return
    size = max(float(np.abs(position[looks]).max(initial=0.0)), 1e-300)
    gap = float(ca.norm_inf(ca.Function("gap", [q], [ca.densify(g)])(known[0])))
    if gap > END_GAP * max(size, 1.0 if link.unit != "m" else size):
        unit = link.unit if link.unit != "-" else ""
        raise ValueError(f"{words} by {gap:.3g} {unit}".rstrip() + "; move the end or the link")
    moves = [i for i in range(len(velocity)) if ca.depends_on(opening, v[i])]
    if np.isnan(velocity[moves]).any():
        return
    rate = float(ca.norm_inf(ca.Function("rate", [q, v], [ca.densify(opening)])(*known)))
    speed = float(np.linalg.norm(np.nan_to_num(velocity)))
    if rate > END_GAP * max(speed, 1e-300):
        unit = "m/s" if link.unit == "m" else "1/s"
        raise ValueError(f"{words}: its velocity leaves it at {rate:.3g} {unit}; turn the velocity along it")


def _check_rank(problem: Any, name: str, slopes: Any) -> None:
    """Each link must hold in a way that the others do not."""
    matrix = np.array(ca.DM(slopes))
    matrix = matrix / np.maximum(np.linalg.norm(matrix, axis=1, keepdims=True), 1e-300)
    if np.linalg.matrix_rank(matrix, tol=1e-9) < len(matrix):
        names = ", ".join(f"{type(link).__name__} (link {i + 1})" for i, link in enumerate(problem.links))
        raise ValueError(f"at the {name} the links hold the same motion twice: {names}; leave one of them out")
    if len(matrix) >= matrix.shape[1]:
        raise ValueError(f"at the {name} {len(matrix)} equations of links leave the body no way to move")
