"""Long runs of bodies on links: how far links open, and energy, against time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from dmoc.basics.arguments import number, of_kind, whole
from dmoc.basics.records import dataclass
from dmoc.configurations.of_problem import configuration_of
from dmoc.effects.gravity import UniformGravity
from dmoc.ends.base import State
from dmoc.links.push import JointTorque
from dmoc.links.rods import Rod
from dmoc.links.system import Member, System
from dmoc.scene.problem import TransferProblem
from dmoc.studies.spinning import growth_of, marched, over_states

# Step lengths of each method for a pendulum of 1 m in a gravity of 1 m/s^2, which swings in about 6 s [s].
LENGTHS: dict[str, Sequence[float]] = {
    "order 2": (0.02,),
    "order 4": (0.05,),
    "order 6": (0.1,),
    "order 8": (0.1,),
    "RK4": (0.02,),
    "DOP853": (0.1,),
}


@dataclass(frozen=True)
class Swinging:
    """One integrator, swinging freely: how well it keeps links and energy, and what it takes.

    The schemes keep the links as constraints. The Runge-Kutta methods integrate the equations of motion with
    the links differentiated twice, which nothing brings back once they have opened.

    Attributes
    ----------
    method : str
    length : float
        Length of a step [s].
    steps : int
    gap : float
        Largest |g(q)|: of a rod, how much its length is off [m].
    energy_error : float
        Largest change of the energy, relative to the largest kinetic energy [-].
    growth : float
        Largest energy error of the last tenth of the steps over that of the first [-].
    seconds : float
        Of all steps, without building them.
    """

    method: str
    length: float
    steps: int
    gap: float
    energy_error: float
    growth: float
    seconds: float


def double_pendulum() -> TransferProblem:
    """Two points of 1 kg on rods of 1 m, which swing widely in a gravity of 1 m/s^2."""
    upper, lower = Rod((0, 0), 1.0, on="elbow"), Rod("elbow", 1.0, on="tip")
    return TransferProblem(
        System([Member("elbow", 1.0), Member("tip", 1.0)], [upper, lower]),
        {"elbow": State((1, 0), (0, 0)), "tip": State((1, -1), (0, 0))},
        {"elbow": State((1, 0), None)},
        1.0,
        [UniformGravity((0, -1.0))],
        JointTorque(upper),
        name="double pendulum",
    )


def swing(
    problem: TransferProblem, steps: int = 10_000, methods: Mapping[str, Sequence[float]] | None = None
) -> list[Swinging]:
    """Let bodies on links move freely from the start of a problem by several integrators.

    Parameters
    ----------
    problem : TransferProblem
        With links; its start, without free entries, and its effects are used.
    steps : int
    methods : mapping, optional
        Lengths of steps [s] by name: "order 2" to "order 8", "RK4", "DOP853"; `LENGTHS` if not given.

    Raises
    ------
    ValueError
        If the start has free entries or the problem has no links.
    """
    of_kind("problem", problem, TransferProblem)
    steps = whole("steps", steps, least=10)
    body = configuration_of(problem)
    if not body.joined or np.isnan(np.concatenate(problem.start.fixed())).any():
        raise ValueError("swing needs a problem with links whose start has no free entries")
    q = ca.SX.sym("q", body.size)
    gap = ca.Function("gap", [q], [body.g(q)])
    chosen = LENGTHS if methods is None else methods
    return [
        _run(problem, gap, name, number("length", length, "s", positive=True), steps)
        for name, lengths in chosen.items()
        for length in lengths
    ]


def _run(problem: TransferProblem, gap: ca.Function, name: str, h: float, steps: int) -> Swinging:
    dynamics, q, _, rates, spent = marched(problem, name, h, steps)
    energy = over_states(dynamics.energy, problem.mass, q, rates)[:, 0]
    rest = over_states(dynamics.energy, problem.mass, q, 0 * rates)[:, 0]
    off = np.abs(energy - energy[0]) / (energy - rest).max()
    opened = float(np.abs(gap(q.T).full()).max())
    return Swinging(name, h, steps, opened, float(off.max()), growth_of(off), spent)
