"""Which configuration the body of a transfer problem has."""

from __future__ import annotations

from typing import Any

from dmoc.basics.unknown import has_unknown
from dmoc.configurations.base import Configuration, Translation
from dmoc.configurations.rigid import Moments, RigidBody


def configuration_of(problem: Any) -> Configuration:
    """The configuration of a transfer problem's body."""
    free = free_configuration(problem)
    if not problem.links:
        return free
    from dmoc.configurations.linked import Linked

    return Linked(free, problem.links)


def free_configuration(problem: Any) -> Configuration:
    """The configuration of the bodies without links."""
    if problem.system is not None:
        from dmoc.configurations.many import Many

        bodies = problem.system.bodies
        parts = tuple(
            Translation(problem.dimension) if body.inertia is None else RigidBody(body.inertia)
            for body in bodies
        )
        shares = tuple(body.mass / problem.system.mass for body in bodies)
        return Many(tuple(body.name for body in bodies), parts, shares)
    if problem.inertia is None:
        return Translation(problem.dimension)
    actuator = problem.actuator
    start_mass = problem.mass if actuator.burns else None
    of_body = problem.inertia, problem.dimension if problem.start.has_position else 0, start_mass
    constant = actuator.burns and actuator.inertia_law == "constant"
    wheels = actuator.wheel_axes
    if not wheels:
        return RigidBody(*of_body, constant)
    from dmoc.configurations.gyrostat import Gyrostat

    return Gyrostat(*of_body, constant, wheels)


def unknown_parts(problem: Any) -> list[Any]:
    """What moves a body and has unknown numbers: effects, then its inertia."""
    found: list[Any] = [effect for effect in problem.effects if effect.adjustable]
    return found + ([Moments(problem.inertia)] if has_unknown(problem.inertia) else [])
