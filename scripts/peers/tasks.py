"""The problems on which dmoc and its peers are compared, as plain numbers, and the path all start from.

NumPy alone: whatever a tool runs in can read this file. Around an attractor the peers state a problem in polar
coordinates, which suit it better: radius, angle, radial and transversal velocity, with the control along the
radius and across it. Elsewhere, and for dmoc, axes are fixed. The acceleration is unit u / mass beside the
attraction -mu r / |r|^3. Of a constant thrust the direction alone is the control, an angle from the
transversal direction towards the radius.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Task:
    """A transfer in plain numbers.

    Attributes
    ----------
    title : str
    duration, mass : float
    start : pair of tuples
        Place and velocity.
    optima : tuple of float
        Objectives of the optima that are known: more than one where ways around an obstacle differ.
    weight : float
        The objective is this times the integral of |u|^2; without effect where a radius is to be largest.
    goal : pair of tuples, optional
        Place and velocity, without an attractor.
    radius : float, optional
        Of a circular goal orbit around an attractor; the largest that can be reached if not given.
    angle : float, optional
        Of the goal on it, counted on from the start; any if not given.
    guessed : float
        Radius at the end of the path all start from, around an attractor.
    mu, unit : float
        Of the attractor, and the acceleration of a control of 1 at a mass of 1.
    limit : float, optional
        Largest control along each axis.
    spheres : tuple of triples
        Centres of spheres of radius 1 to stay out of.
    thrust, flow : float
        Constant thrust of an engine, and the mass it burns in a unit of time, of a mass of 1 at the start.
    """

    title: str
    duration: float
    mass: float
    start: tuple[tuple[float, ...], tuple[float, ...]]
    optima: tuple[float, ...]
    weight: float = 0.5
    goal: tuple[tuple[float, ...], tuple[float, ...]] | None = None
    radius: float | None = None
    angle: float | None = None
    guessed: float = 1.0
    mu: float = 0.0
    unit: float = 1.0
    limit: float | None = None
    spheres: tuple[tuple[float, float, float], ...] = ()
    thrust: float = 0.0
    flow: float = 0.0

    @property
    def axes(self) -> int:
        """Of space."""
        return len(self.start[0])

    @property
    def controls(self) -> int:
        """How many there are at a time."""
        return 1 if self.thrust else self.axes

    @property
    def states(self) -> int:
        """How many there are with the effort, if that is the objective, as the last."""
        return 2 * self.axes + (0 if self.thrust else 1)

    @property
    def polar(self) -> bool:
        """Whether the peers state it in polar coordinates."""
        return self.mu > 0

    @property
    def first(self) -> np.ndarray:
        """State at the start as the peers have it; around an attractor it is on a circle, on the first axis."""
        place, velocity = self.start
        return np.array([place[0], 0.0, 0.0, velocity[1]] if self.polar else [*place, *velocity])

    @property
    def last(self) -> np.ndarray:
        """State at the goal as the peers have it, on a circle around an attractor; NaN where it is free."""
        if not self.polar:
            assert self.goal is not None
            return np.concatenate(self.goal)
        if self.radius is None:
            return np.array([np.nan, np.nan, 0.0, np.nan])
        angle = np.nan if self.angle is None else self.angle
        return np.array([self.radius, angle, 0.0, math.sqrt(self.mu / self.radius)])

    def off(self, objective: float) -> float:
        """Relative error of an objective, from the optimum that is nearest [-]."""
        return min(abs(objective / optimum - 1) for optimum in self.optima)


TASKS = {
    # A. E. Bryson, Y.-C. Ho, Applied Optimal Control (1975), section 2.5; `earth_mars` with duration=3.3193.
    "P2": Task(
        "largest radius (Bryson, Ho)",
        duration=3.3193,
        mass=1.0,
        start=((1.0, 0.0), (0.0, 1.0)),
        optima=(1.52502839,),
        guessed=1.4,
        mu=1.0,
        thrust=0.1405,
        flow=0.0749,
    ),
    # `orbit_raise`
    "P3": Task(
        "1.5 revolutions",
        duration=12.0,
        mass=1.0,
        start=((1.0, 0.0), (0.0, 1.0)),
        optima=(1.6903228946e-3,),
        radius=1.5,
        angle=3 * math.pi,
        guessed=1.5,
        mu=1.0,
    ),
    # `free_flyer`; both ways around
    "P4": Task(
        "three spheres",
        duration=40.0,
        mass=10.0,
        start=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        optima=(1.6737951181, 1.7248367333),
        weight=1.0,
        goal=((8.0, 1.0, 1.0), (0.0, 0.0, 0.0)),
        limit=0.6,
        spheres=((2.0, 0.2, 0.2), (4.2, 0.9, 0.4), (6.0, 0.4, 1.0)),
    ),
    # fifteen periods of the orbit at the start, 82.619 rad
    "P5": Task(
        "fifteen revolutions",
        duration=30 * math.pi,
        mass=1.0,
        start=((1.0, 0.0), (0.0, 1.0)),
        optima=(40.2836886248,),
        radius=1.2,
        guessed=1.2,
        mu=1.0,
        unit=1e-3,
    ),
}


def guess(task: Task, fractions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """States and controls of the path that all start from, as the peers have them, a row a fraction."""
    return _spiral(task, fractions) if task.polar else _from_rest_to_rest(task, fractions)


def in_plane(states: np.ndarray) -> np.ndarray:
    """Polar states along fixed axes."""
    r, angle, away, across = states.T
    cos, sin = np.cos(angle), np.sin(angle)
    columns = [r * cos, r * sin, away * cos - across * sin, away * sin + across * cos]
    return np.stack(columns, axis=1)


def forces_in_plane(task: Task, states: np.ndarray, controls: np.ndarray) -> np.ndarray:
    """Controls of polar states as forces along fixed axes, in units of `unit`."""
    if task.thrust:
        controls = task.thrust * np.hstack([np.sin(controls), np.cos(controls)])
    return in_plane(np.column_stack([states[:, :2], controls]))[:, 2:]


def _spiral(task: Task, fractions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """As a small thrust along the path makes it: the speed changes evenly, the orbit stays a circle.

    The angle is stretched to that of the goal, if it is known. A thrust whose direction is looked for turns
    once around.
    """
    first, last = (math.sqrt(task.mu / r) for r in (task.first[0], task.guessed))
    slope = (last - first) / task.duration
    speed = first + (last - first) * fractions
    angle = (speed**4 - first**4) / (4 * slope * task.mu)
    if task.angle is not None:
        angle *= task.angle / ((last**4 - first**4) / (4 * slope * task.mu))
    states = np.stack([task.mu / speed**2, angle, -2 * task.mu * slope / speed**3, speed], axis=1)
    if task.thrust:
        return states, 2 * math.pi * fractions[:, None]
    along = np.full(len(fractions), -slope * task.mass / task.unit)
    return states, np.stack([0 * along, along], axis=1)


def _from_rest_to_rest(task: Task, fractions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A straight line, by the smallest force without anything in the way."""
    assert task.goal is not None
    way, part = np.subtract(task.goal[0], task.start[0]), fractions[:, None]
    place = np.array(task.start[0]) + way * (3 * part**2 - 2 * part**3)
    velocity = way * 6 * (part - part**2) / task.duration
    force = task.mass * way * (6 - 12 * part) / task.duration**2
    return np.hstack([place, velocity]), force / task.unit
