"""Scenes and missions integrated forward from their start, without optimisation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace
from functools import wraps
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import short
from dmoc.basics.numerics import columns
from dmoc.motion import march
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.march import Trajectory, node_masses, rollout

if TYPE_CHECKING:
    from dmoc.legs.legs import Joint
    from dmoc.missions.solution import MissionSolution
    from dmoc.scene.mission import Mission
    from dmoc.scene.team import Team


@wraps(march.simulate)
def simulate(problem: Any, controls: Any = None, *given: Any, **more: Any) -> Trajectory:
    problem = getattr(problem, "alone", None) or problem
    if hasattr(problem, "together"):
        raise ValueError(
            "a team of bodies has a flight for each of them; use dmoc.simulate_team(team, solution)"
        )
    if hasattr(controls, "legs") and not hasattr(problem, "joints"):
        # The arcs of a transfer that was solved by its structure are the legs of a mission.
        problem = controls.attach(problem).require_problem()
    if not hasattr(problem, "joints"):
        return march.simulate(problem, controls, *given, **more)
    return flown_mission(problem, controls)


def simulate_team(team: Team, solution: Any = None, *given: Any, **more: Any) -> dict[str, Trajectory]:
    """The flights of all bodies of a team by their names, each marched forward as by `simulate`.

    Parameters
    ----------
    team : Team
    solution : TeamSolution, optional
        Its controls are applied; without one all bodies coast, and `given` and `more` are further arguments of
        `simulate`.

    Raises
    ------
    ValueError
        If it is no team, or the solution is not of this team.
    """
    if not hasattr(team, "together"):
        raise ValueError(f"team must be a dmoc.Team; got {short(team)}")
    if solution is None:
        parts: Any = [None] * len(team.members)
    elif hasattr(solution, "members"):
        parts = solution.attach(team).members
    else:
        raise ValueError(f"solution must be a TeamSolution; got {short(solution)}")
    flights = [
        # A body with several legs is marched as a mission, one that is cut where others have joints.
        flown_mission(getattr(mine, "problem", one), mine)
        if hasattr(one, "joints") or hasattr(mine, "legs")
        else march.simulate(one, mine, *given, **more)
        for one, mine in zip(team.members, parts, strict=True)
    ]
    return dict(zip(team.names, flights, strict=True))


def flown_mission(mission: Mission, solution: Any) -> Trajectory:
    """A mission marched from its start with the controls, impulses and durations of a solution.

    Every leg begins where the march has come to; the time of a joint is there twice, with the states before and
    behind it, and that of the goal if something happens there.

    Raises
    ------
    ValueError
        If there is no solution of this mission.
    """
    if not hasattr(solution, "impulses"):
        raise ValueError(
            "a mission is simulated with the durations, controls and impulses of a solution: give one, in the "
            "shell --controls FILE of dmoc solve --out"
        )
    return _joined(list(_flights(mission, solution.attach(mission))))


def _flights(mission: Mission, solution: MissionSolution) -> Iterator[Trajectory]:
    """The legs one after the other, and what is behind the goal."""
    first = solution.legs[0]
    q, time, mass = first.path.position[0], float(first.provenance.start_time), float(mission.mass)
    freedom = len(first.path.start_velocity)
    own = solution.own.get("start", np.zeros(0))
    v = own[:freedom] if mission.joints[0].events else first.path.start_velocity
    for i, (problem, leg) in enumerate(zip(mission.stretches, solution.legs, strict=True)):
        dynamics = Dynamics.of(problem)
        q, v, mass = _behind(mission.joints[i], solution, dynamics, (time, q, v, mass))
        flight, last = _flight(dynamics, leg, (time, q, v, mass))
        yield flight
        (time, mass), (q, v) = (float(flight.time[-1]), float(flight.mass[-1])), last
    if mission.joints[-1].events:
        q, v, mass = _behind(mission.joints[-1], solution, dynamics, (time, q, v, mass))
        yield _told(dynamics, np.array([time]), q[None], v[None], np.array([mass]))


def _behind(joint: Joint, solution: MissionSolution, dynamics: Dynamics, state: tuple) -> tuple:
    """Position, independent velocities and mass behind the events of a joint."""
    from dmoc.chains.path import own_parts
    from dmoc.legs.events import Instant

    time, q, v, mass = state
    speeds = dynamics.configuration.coordinates.speeds
    parts = own_parts(joint, solution.own.get(joint.name), solution.dimension)
    for event, own in zip(joint.events, parts, strict=True):
        here = Instant(ca.SX(time), ca.SX(q), ca.SX(v), ca.SX(mass))
        after = event.passed(here, ca.SX(own), speeds, 0.0).after
        q, v = (np.array(ca.evalf(part)).ravel() for part in (after.q, after.v))
        mass = float(ca.evalf(after.m))
    return q, v, mass


def _flight(dynamics: Dynamics, leg: Any, state: tuple) -> tuple[Trajectory, tuple]:
    """One leg from a state with its own controls, and the coordinates at its end."""
    begin, q, v, mass = state
    path = replace(leg.path, mass=node_masses(dynamics, leg.path, mass))
    times = begin + path.duration * path.mesh
    masses = path.mass[:: scheme(path.order).degree]
    momentum = np.array(dynamics.momentum(begin, q, v, mass)).ravel()
    places, momenta = rollout(dynamics, path, begin, q, momentum)
    speeds = columns(dynamics.velocity, times, places.T, momenta.T, masses)[0].T
    return _told(dynamics, times, places, speeds, masses), (places[-1], speeds[-1])


def _told(dynamics: Dynamics, times: np.ndarray, q: np.ndarray, v: np.ndarray, mass: np.ndarray) -> Trajectory:
    """States as a Trajectory, one row an instant."""
    made = dynamics.configuration.coordinates
    p = columns(dynamics.momentum, times, q.T, v.T, mass)[0].T
    energy = columns(dynamics.energy, times, q.T, v.T, mass)[0].ravel()
    found = Trajectory(times, q[:, made.places], v[:, made.speeds], p[:, made.speeds], mass, energy)
    if made.turns:
        attitude = np.hstack([q[:, at] for at in made.quaternions])
        found = replace(found, attitude=attitude, rate=v[:, made.rates], spin=p[:, made.rates])
    return found


def _joined(flights: list[Trajectory]) -> Trajectory:
    """Legs behind each other as one trajectory; what not all of them have is left out."""
    joined: dict[str, Any] = {}
    for name in [field.name for field in fields(Trajectory)]:
        parts = [getattr(flight, name) for flight in flights]
        joined[name] = None if any(part is None for part in parts) else np.concatenate(parts)
    return Trajectory(**joined)
