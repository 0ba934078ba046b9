"""Long runs of bodies that turn: the length of the quaternion, angular momentum and energy against time."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from functools import partial

import casadi as ca
import numpy as np

from dmoc.basics.arguments import number, of_kind, whole
from dmoc.basics.quaternions import rotated
from dmoc.basics.records import dataclass
from dmoc.bodies.torques import Torque
from dmoc.effects.bodies import PivotGravity
from dmoc.ends.poses import Attitude, rotation
from dmoc.motion.dynamics import Dynamics
from dmoc.scene.problem import TransferProblem
from dmoc.studies.drift import step_function

# Step lengths of each method for a body that turns by about a radian a second [s].
LENGTHS: dict[str, Sequence[float]] = {
    "order 2": (0.1,),
    "order 4": (0.2,),
    "order 6": (0.3,),
    "order 8": (0.5,),
    "RK4": (0.1,),
    "DOP853": (0.5,),
}
# A march is built for this many steps and run piece by piece: that is the memory of one piece.
PIECE = 1000


@dataclass(frozen=True)
class Spinning:
    """One integrator, turning freely: how well it keeps what the motion conserves, and what it takes.

    Attributes
    ----------
    method : str
    length : float
        Length of a step [s].
    steps : int
    norm_error : float
        Largest |q.q - 1| [-].
    momentum_error : float
        Largest change of the angular momentum in space axes, or of its vertical component for a body on which
        gravity acts, relative to its size [-].
    energy_error : float
        Largest change of the energy, relative to the kinetic energy at the start [-].
    growth : float
        Largest energy error of the last tenth of the steps over that of the first [-].
    seconds : float
        Of all steps, without building them.
    """

    method: str
    length: float
    steps: int
    norm_error: float
    momentum_error: float
    energy_error: float
    growth: float
    seconds: float


def free_body() -> TransferProblem:
    """A body with three different moments, turning freely."""
    here = Attitude((1, 0, 0, 0), (0.3, 0.7, -0.4))
    return _problem(here, (1.0, 2.0, 2.8), "free body")


def heavy_top() -> TransferProblem:
    """A body held at a point below its centre of mass, leaning and spinning under gravity."""
    here = Attitude(rotation((1, 0, 0), 30), (0.1, 0.2, 3.0))
    return _problem(here, (1.0, 1.0, 0.5), "heavy top", [PivotGravity((0, 0, -1), (0, 0, 0.5))])


def _problem(here: Attitude, inertia: tuple, name: str, effects: Sequence = ()) -> TransferProblem:
    return TransferProblem(1.0, here, here, 1.0, effects, Torque(), inertia=inertia, name=name)


def spin(
    problem: TransferProblem, steps: int = 10_000, methods: Mapping[str, Sequence[float]] | None = None
) -> list[Spinning]:
    """Turn a body freely from the start of a problem by several integrators, each with some lengths of step.

    Parameters
    ----------
    problem : TransferProblem
        Of an attitude alone; its start, without free entries, and its effects are used.
    steps : int
    methods : mapping, optional
        Lengths of steps [s] by name: "order 2" to "order 8", "RK4", "DOP853"; `LENGTHS` if not given.

    Raises
    ------
    ValueError
        If the start has free entries or the problem is not one of an attitude alone.
    """
    of_kind("problem", problem, TransferProblem)
    steps = whole("steps", steps, least=10)
    if (
        problem.inertia is None
        or problem.start.has_position
        or np.isnan(np.concatenate(problem.start.fixed())).any()
    ):
        raise ValueError("spin needs a problem of an attitude alone whose start has no free entries")
    chosen = LENGTHS if methods is None else methods
    return [
        _run(problem, name, number("length", length, "s", positive=True), steps)
        for name, lengths in chosen.items()
        for length in lengths
    ]


def marched(
    problem: TransferProblem, name: str, h: float, steps: int
) -> tuple[Dynamics, np.ndarray, np.ndarray, np.ndarray, float]:
    """Dynamics, coordinates, momenta per mass, velocities, and the seconds that so many steps took."""
    dynamics = Dynamics.of(problem)
    begin, rate = problem.start.fixed()
    canonical = name.startswith("order ")
    momentum = partial(over_states, dynamics.momentum, problem.mass)
    start = np.concatenate([begin, momentum(begin[None], rate[None])[0] if canonical else rate])
    step = step_function(name, dynamics, problem)
    march = step.mapaccum("march", min(PIECE, steps), {"base": 4})
    states, begun = [start[:, None]], time.perf_counter()
    for first in range(0, steps, PIECE):
        count = min(PIECE, steps - first)
        piece = march if count == min(PIECE, steps) else step.mapaccum("march", count, {"base": 4})
        times = problem.start_time + h * np.arange(first, first + count)
        states.append(piece(states[-1][:, -1], times[None], h).full())
    spent = time.perf_counter() - begun
    found = np.hstack(states).T
    q, second = found[:, : len(begin)], found[:, len(begin) :]
    spins = second if canonical else momentum(q, second)
    rates = over_states(dynamics.velocity, problem.mass, q, second) if canonical else second
    return dynamics, q, spins, rates, spent


def growth_of(errors: np.ndarray) -> float:
    """The largest of the last tenth of some errors over that of the first tenth."""
    tenth = max(len(errors) // 10, 1)
    early = errors[: tenth + 1].max()
    return float(errors[-tenth:].max() / early) if early else np.nan


def _run(problem: TransferProblem, name: str, h: float, steps: int) -> Spinning:
    dynamics, q, spins, rates, spent = marched(problem, name, h, steps)
    energy = over_states(dynamics.energy, problem.mass, q, rates)[:, 0]
    off = np.abs(energy - energy[0]) / (0.5 * float(spins[0] @ rates[0]))
    in_space = rotated(q, spins)
    # Under gravity along z, the angular momentum about z alone is kept.
    kept = in_space[:, 2:] if problem.effects else in_space
    turned = np.linalg.norm(kept - kept[0], axis=1).max() / np.linalg.norm(in_space[0])
    norm = float(np.abs(np.sum(q * q, axis=1) - 1).max())
    return Spinning(name, h, steps, norm, float(turned), float(off.max()), growth_of(off), spent)


def over_states(function: ca.Function, mass: float, q: np.ndarray, other: np.ndarray) -> np.ndarray:
    """A function (t, q, other, m) of all states, one row each."""
    return np.array(function(0.0, q.T, other.T, mass)).T.reshape(len(q), -1)
