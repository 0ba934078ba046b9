"""What users ask of an answer, each with its unit: velocity change, propellant, closest approach, orbits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.answers.along import least, pushes, swept
from dmoc.answers.distances import from_attractors, from_zones
from dmoc.answers.fact import Fact, Facts
from dmoc.answers.orbits import osculating
from dmoc.basics.digits import lasting, quantity
from dmoc.basics.quaternions import angle_between

# A force or a change of mass that is less than this part of what there could be is none [-].
NONE = 1e-9
# Two times, or a path and a zone, are as good as together within this part of the duration, or of the path [-].
NEAR = 1e-6


def facts_of(solution: Any) -> Facts:
    """The facts of a solution that holds its problem, of a transfer, a mission or several bodies."""
    solution.require_problem()
    # A path through an attractor has no direction from it there; what is not finite is told as it is.
    with np.errstate(all="ignore"):
        if hasattr(solution, "members"):
            return Facts(_each_of(solution.names, solution.members))
        return Facts(_of_mission(solution) if hasattr(solution, "legs") else _of_transfer(solution))


def _of_transfer(solution: Any) -> list[Fact]:
    problem = solution.problem
    if problem.links or len(problem.names) > 1:
        return [*_controls(solution), *_clearance(_clearances(solution))]
    path, speeds = solution.path, solution.path.coordinates.speeds
    change, force, torque = pushes(solution) if problem.controls else (0.0, 0.0, 0.0)
    start = path.place[0], path.start_velocity[speeds]
    goal = path.place[-1], path.goal_velocity[speeds]
    return [
        *_velocity_change(change, _rocket(solution), 0),
        *_propellant(problem.mass, problem.mass - solution.final_mass),
        *_largest(force, torque),
        *_turning([solution]),
        *_approach(_approaches(solution)),
        *_revolutions(_angle(solution)),
        *_clearance(_clearances(solution)),
        *_orbit(problem, "start", *start),
        *_orbit(problem, "goal", *goal),
    ]


def _of_mission(solution: Any) -> list[Fact]:
    """Those of all legs together; the ends are those before a first impulse and behind a last one."""
    mission, legs = solution.problem, solution.legs
    known = [pushes(leg) if leg.problem.controls else (0.0, 0.0, 0.0) for leg in legs]
    change = sum(one[0] for one in known) + solution.velocity_change
    rocket = [_rocket(leg) for leg in legs]
    burnt = sum(one for one in rocket if one is not None)
    kicks = sum(kick.size > 0 for kick in solution.impulses)
    first, last = legs[0], legs[-1]
    before, behind = (_kicked(solution, mission.joints[place].name) for place in (0, -1))
    speeds = first.path.coordinates.speeds
    start = first.path.place[0], first.path.start_velocity[speeds] - before
    goal = last.path.place[-1], last.path.goal_velocity[speeds] + behind
    approaches: dict[Any, tuple] = {}
    for leg in legs:
        for key, found in _approaches(leg).items():
            approaches[key] = min(found, approaches.get(key, found))
    angles = [_angle(leg) for leg in legs]
    return [
        *_velocity_change(change, burnt + solution.velocity_change if burnt else None, kicks),
        *_propellant(mission.mass, mission.mass - mission.dropped - solution.final_mass),
        *_largest(max(one[1] for one in known), max(one[2] for one in known)),
        *_turning(legs),
        *_approach(approaches),
        *_revolutions(None if None in angles else sum(angles)),  # type: ignore[arg-type]
        *_clearance([found for leg in legs for found in _clearances(leg)]),
        *_orbit(first.problem, "start", *start),
        *_orbit(last.problem, "goal", *goal),
    ]


def _kicked(solution: Any, joint: str) -> np.ndarray:
    """The velocity change of the impulses at a joint [m/s]."""
    changes = [kick.change[: solution.dimension] for kick in solution.impulses if kick.joint == joint]
    return np.sum(changes, axis=0) if changes else np.zeros(solution.dimension)


def _each_of(names: Sequence[str], members: Sequence[Any]) -> list[Fact]:
    """The velocity change and the clearance of each of several bodies."""
    found = []
    for name, member in zip(names, members, strict=True):
        for fact in _of_mission(member) if hasattr(member, "legs") else _of_transfer(member):
            if fact.name in ("velocity change", "clearance"):
                words = f"{name} {fact.words}"
                found.append(replace(fact, name=f"{fact.name} of {name}", words=words))
    return sorted(found, key=lambda fact: fact.line)


def _rocket(solution: Any) -> float | None:
    """c log(m_0 / m_1), Tsiolkovsky's velocity change [m/s]; None where no engine burns propellant."""
    speed = getattr(solution.problem.actuator, "exhaust_velocity", None)
    mass = solution.path.mass
    return None if speed is None else float(speed * np.log(mass[0] / mass[-1]))


def _velocity_change(change: float, rocket: float | None, kicks: int) -> list[Fact]:
    if not change:
        return []
    line = "velocity change"
    words = quantity(change, "m/s") + (f" in {kicks} impulse{'s' * (kicks > 1)}" if kicks else "")
    found = [Fact(line, change, "m/s", line, words)]
    if rocket is not None:
        told = quantity(rocket, "m/s")
        words = "the same" if told == quantity(change, "m/s") else told
        words = f"{words} by the rocket equation"
        found.append(Fact("velocity change by the rocket equation", rocket, "m/s", line, words))
    return found


def _propellant(mass: float, burnt: float) -> list[Fact]:
    if abs(burnt) <= NONE * mass:
        return []
    words = f"{quantity(burnt, 'kg')} of propellant"
    return [Fact("propellant", burnt, "kg", "velocity change", words)]


def _largest(force: float, torque: float) -> list[Fact]:
    """The largest force and torque that are flown, between nodes too."""
    found = [("peak force", force, "N"), ("peak torque", torque, "N m")]
    return [Fact(name, x, unit, "peak", f"{name[5:]} {quantity(x, unit)}") for name, x, unit in found if x]


def _turning(legs: Sequence[Any]) -> list[Fact]:
    """How far a body turns from its start and how fast, and what its reaction wheels do at most."""
    if legs[0].rate is None:
        return []
    quaternions = np.concatenate([leg.attitude for leg in legs])
    turn = float(np.degrees(angle_between(quaternions[:1], quaternions).max()))
    rate = max(float(np.linalg.norm(leg.rate, axis=1).max()) for leg in legs)
    found = [
        Fact("turn", turn, "degrees", "peak", f"turn {turn:.4g} degrees"),
        Fact("peak rate", rate, "rad/s", "peak", f"rate {np.degrees(rate):.4g} degrees/s"),
    ]
    for name, unit in (("wheel_torque", "N m"), ("wheel_momentum", "N m s")):
        if getattr(legs[0], name) is not None:
            most, words = max(float(np.abs(getattr(leg, name)).max()) for leg in legs), name.replace("_", " ")
            found.append(Fact(f"peak {words}", most, unit, "peak", f"{words} {quantity(most, unit)}"))
    return found


def _controls(solution: Any) -> list[Fact]:
    """The largest size of each control of linked bodies, by its name."""
    about, control = solution.provenance, solution.path.control
    return [
        Fact(f"peak {label}", float(size), unit, "peak", f"{label} {quantity(float(size), unit)}")
        for label, unit, size in zip(
            about.control_labels, about.control_units, np.abs(control).max(axis=0, initial=0.0), strict=True
        )
    ]


def _approaches(solution: Any) -> dict[Any, tuple[float, str, float]]:
    """The least distance from each attractor [m], when, and the radius of the attractor if it is known."""
    found: dict[Any, tuple[float, str, float]] = {}
    for center, (distance, radius) in from_attractors(solution).items():
        closest, time = least(solution, distance)
        found[center] = closest, _when(solution, time), radius
    return found


def _approach(found: dict[Any, tuple[float, str, float]]) -> list[Fact]:
    line, facts = "closest approach", []
    for i, (distance, when, radius) in enumerate(found.values()):
        of = f" to attractor {i + 1}" if len(found) > 1 else ""
        words = f"{quantity(distance, 'm')}{of or ' to the attractor'} {when}"
        facts.append(Fact(line + of, distance, "m", line, words))
        if radius:
            words = f"altitude {quantity(distance - radius, 'm')}"
            facts.append(
                Fact(f"least altitude{of.replace(' to', ' above')}", distance - radius, "m", line, words)
            )
    return facts


def _angle(solution: Any) -> float | None:
    """The angle that is swept around the only attractor of a scene [rad]; None where there is no orbit."""
    lone = solution.problem.attraction.lone
    return None if lone is None else swept(solution, lone.place(solution.dimension))


def _revolutions(angle: float | None) -> list[Fact]:
    if angle is None:
        return []
    turns = angle / (2 * np.pi)
    words = f"{turns:.4g} revolution{'s' * (f'{turns:.4g}' != '1')}"
    return [Fact("revolutions", turns, "-", "closest approach", words)]


def _clearances(solution: Any) -> list[tuple[float, str, str]]:
    """The least clearance from each zone [m], when, and the zone's name, between nodes too."""
    found = []
    for name, clear in from_zones(solution):
        distance, time = least(solution, clear)
        if abs(distance) <= NEAR * solution.path.diagonal:
            distance = 0.0
        found.append((distance, _when(solution, time), name))
    return found


def _when(solution: Any, time: float) -> str:
    """When something is: at one of the ends, or a time."""
    first, last = solution.time[0], solution.time[-1]
    ends = ((first, "at the start"), (last, "at the goal"))
    near = NEAR * (last - first)
    return next((words for end, words in ends if abs(time - end) <= near), f"at {lasting(time, 4)}")


def _clearance(found: list[tuple[float, str, str]]) -> list[Fact]:
    if not found:
        return []
    distance, when, name = min(found)
    words = f"{quantity(abs(distance), 'm')} {'beyond the edge of' if distance < 0 else 'from'} {name} {when}"
    if not distance:
        words = f"none: it touches {name} {when}"
    return [Fact("clearance", distance, "m", "least clearance", words)]


def _orbit(problem: Any, end: str, position: np.ndarray, velocity: np.ndarray) -> list[Fact]:
    """The osculating orbit of an end around the only attractor of a scene."""
    lone = problem.attraction.lone
    if lone is None:
        return []
    found = osculating(lone.mu, position - lone.place(len(position)), velocity)
    listed = [("a", found.a, "m"), ("e", found.e, "-")]
    if len(position) == 3:
        listed.append(("i", found.i, "degrees"))
    line = f"orbit at the {end}"
    return [Fact(f"{end} {name}", x, unit, line, f"{name} {_told(x, unit)}") for name, x, unit in listed]


def _told(value: float, unit: str) -> str:
    """An element of an orbit; one that is zero but for rounding is told as zero."""
    return quantity(0.0 if unit == "-" and abs(value) < NONE else value, unit, 5)
