"""What a tool found, in the terms that all share, and how accurate that is.

NumPy alone; SciPy where an answer is flown.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from peers.tasks import Task, in_plane


@dataclass(frozen=True)
class Answer:
    """An optimum as a tool states it.

    Attributes
    ----------
    objective : float
    mesh : array, shape (pieces+1,)
        Times at which pieces of the control begin and end.
    times : array, shape (pieces, nodes)
        Of the controls: in each piece the control is the polynomial through its nodes.
    controls : array, shape (pieces, nodes, entries)
        Of `peers.tasks`, or forces along fixed axes.
    end : array, shape (axes,)
        The place it believes to arrive at, along fixed axes.
    fixed : bool
        Whether the controls are forces along fixed axes, also around an attractor.
    status : str
        In the tool's own words.
    """

    objective: float
    mesh: np.ndarray
    times: np.ndarray
    controls: np.ndarray
    end: np.ndarray
    fixed: bool = False
    status: str = ""

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {
            name: value.tolist() if isinstance(value, np.ndarray) else value
            for name, value in asdict(self).items()
        }

    @classmethod
    def of(cls, plain: dict[str, Any]) -> Answer:
        """From JSON."""
        arrays = {name: np.array(plain[name]) for name in ("mesh", "times", "controls", "end")}
        return cls(**{**plain, **arrays})


def error(task: Task, answer: Answer) -> float:
    """The larger one of the relative error of the objective and of the end that is flown [-].

    The end is judged relative to the diagonal of the box around the path.
    """
    places = fly(task, answer)
    extent = float(np.linalg.norm(np.ptp(places, axis=0)))
    return max(task.off(answer.objective), float(np.linalg.norm(places[-1] - answer.end)) / extent)


def fly(task: Task, answer: Answer) -> np.ndarray:
    """Places at the ends of the pieces, along fixed axes, by DOP853 with the controls found.

    SciPy's implementation, from the start, to 1e-12; it begins anew with every piece, where the control may
    jump.
    """
    from scipy.integrate import solve_ivp

    rates = _along_axes if answer.fixed or not task.polar else _polar
    states = [np.append(np.concatenate(task.start), task.mass) if rates is _along_axes else task.first]
    for ends, times, controls in zip(pairwise(answer.mesh), answer.times, answer.controls, strict=True):
        middle, half = 0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0])
        powers = np.linalg.solve(np.vander((times - middle) / half), controls)

        def moving(t, state, powers=powers, middle=middle, half=half):
            control, part = powers[0], (t - middle) / half
            for row in powers[1:]:
                control = control * part + row
            return rates(task, t, state, control)

        flown = solve_ivp(moving, ends, states[-1], "DOP853", rtol=1e-12, atol=1e-12)
        states.append(flown.y[:, -1])
    found = np.array(states)
    return found[:, : task.axes] if rates is _along_axes else in_plane(found)[:, :2]


def _polar(task: Task, t: float, state: np.ndarray, control: np.ndarray) -> list[float]:
    r, _, away, across = state
    if task.thrust:
        push = task.thrust / (1 - task.flow * t)
        control = push * np.sin(control[0]), push * np.cos(control[0])
    else:
        control = task.unit / task.mass * control
    return [away, across / r, across**2 / r - task.mu / r**2 + control[0], control[1] - away * across / r]


def _along_axes(task: Task, t: float, state: np.ndarray, control: np.ndarray) -> np.ndarray:
    """Of place, velocity and mass, which an engine burns as it pushes."""
    n = task.axes
    place, velocity, mass = state[:n], state[n : 2 * n], state[-1]
    acceleration = task.unit / mass * control
    if task.mu:
        acceleration = acceleration - task.mu * place / np.linalg.norm(place) ** 3
    burnt = task.flow * np.linalg.norm(control) / task.thrust if task.thrust else 0.0
    return np.concatenate([velocity, acceleration, [-burnt]])
