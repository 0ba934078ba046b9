"""What each effect does to a path and what it costs: whether the scene calls for it."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from dmoc.blocks import Transcript
from dmoc.effects import (
    J2,
    ConicalShadow,
    Drag,
    Effect,
    ExponentialAtmosphere,
    PointGravity,
    RadiationPressure,
    ThirdBody,
    circular_motion,
)
from dmoc.lobatto import scheme
from dmoc.mechanics import Dynamics, state_symbols
from dmoc.mesh import Guess
from dmoc.problem import TransferProblem
from dmoc.reference import reference
from dmoc.simulation import end_momenta
from dmoc.solution import Solution
from dmoc.transcription import transcribe_onto, units_of

REPEATS = 15
EARTH_MU, EARTH_RADIUS, EARTH_RATE = 3.986004418e14, 6.378137e6, 7.2921159e-5
SUN_DISTANCE, SUN_RATE = 1.495978707e11, 1.99098e-7


@dataclass(frozen=True)
class Influence:
    """One effect on one path.

    Attributes
    ----------
    effect : Effect
    listed : bool
        Whether the scene has it; otherwise the figures are what it would do.
    acceleration : float
        The largest along the path [m/s^2].
    displacement : float
        At the goal, between flying the same controls with it and without it [m].
    instructions : int
        What it adds to one evaluation of a node, a step and the ends, derivatives included.
    time_share : float
        Its share of the time to evaluate Jacobian and Hessian on the whole mesh, measured [-].
    """

    effect: Effect
    listed: bool
    acceleration: float
    displacement: float
    instructions: int
    time_share: float


def influences(solution: Solution, others: bool = False) -> list[Influence]:
    """What each effect of a solved scene does and costs, and with `others` what the library's could do.

    The others are for scenes around the Earth in SI units: J2, Sun and Moon on circular orbits, air
    and sunlight on 0.01 m^2 a kg.
    """
    problem, path = solution.require_problem(), solution.path
    found = [_one(problem, path, effect, listed=True) for effect in problem.effects]
    missing = candidates(problem) if others else []
    return found + [_one(problem, path, effect, listed=False) for effect in missing]


def candidates(problem: TransferProblem) -> list[Effect]:
    """Effects of the library that could apply to a scene around the Earth and are not in it."""
    masses = [effect.mu for effect in problem.effects if isinstance(effect, PointGravity)]
    if not any(abs(mu / EARTH_MU - 1) < 0.01 for mu in masses) or problem.dimension == 1:
        return []
    sun = circular_motion(SUN_DISTANCE, SUN_RATE)
    area = 0.01 * problem.mass
    air = ExponentialAtmosphere(3.725e-12, 4e5, 5.8515e4, EARTH_RADIUS, EARTH_RATE)
    library: list[Effect] = [
        J2(EARTH_MU, EARTH_RADIUS, 1.08263e-3),
        ThirdBody(4.9048695e12, circular_motion(3.844e8, 2.66170e-6)),
        ThirdBody(1.32712440018e20, sun),
        Drag(area, 2.2, air),
        RadiationPressure(area, 0.3, sun, ConicalShadow(EARTH_RADIUS)),
    ]
    present = {type(effect) for effect in problem.effects}
    return [effect for effect in library if type(effect) not in present]


def _one(problem: TransferProblem, path: Guess, effect: Effect, listed: bool) -> Influence:
    alone = tuple(other for other in problem.effects if other is not effect)
    without = replace(problem, effects=alone)
    scene = problem if listed else replace(problem, effects=(*problem.effects, effect))
    ends = [
        reference(_dynamics(case), path, case.start_time, path.start_velocity)[0] for case in (scene, without)
    ]
    more, less = _instructions(scene, path), _instructions(without, path)
    slow, fast = _seconds(scene, path), _seconds(without, path)
    return Influence(
        effect,
        listed,
        _largest_acceleration(problem, path, effect),
        float(np.linalg.norm(ends[0] - ends[1])),
        more - less,
        max(0.0, 1 - fast / slow),
    )


def _dynamics(problem: TransferProblem) -> Dynamics:
    return Dynamics.of(problem)


def _largest_acceleration(problem: TransferProblem, path: Guess, effect: Effect) -> float:
    """Largest change of the acceleration by one effect along the path, at the step ends [m/s^2]."""
    n = problem.dimension
    t, q, v, m = state_symbols(n)
    still = ca.DM.zeros(n)
    alone = Dynamics(n, (effect,), problem.actuator).acceleration(t, q, v, m, still)
    function = ca.Function("alone", [t, q, v, m], [ca.densify(ca.SX(alone))])
    ends = slice(None, None, scheme(path.order).degree)
    times = problem.start_time + path.duration * path.mesh
    _, velocity = end_momenta(_dynamics(problem), path, problem.start_time)
    pulls = np.array(function(times[None], path.position[ends].T, velocity.T, path.mass[ends][None]))
    return float(np.linalg.norm(pulls, axis=0).max())


def _instructions(problem: TransferProblem, path: Guess) -> int:
    """Instructions of one evaluation of each block with its derivatives."""
    script = Transcript(problem, scheme(path.order), path.hold, path.mesh, units_of(problem, path))
    kernels = [block.kernel for block in script.blocks]
    return sum(part.n_instructions() for kernel in kernels for part in kernel.functions.values())


def _seconds(problem: TransferProblem, path: Guess) -> float:
    """Median time to evaluate Jacobian and Hessian on the whole mesh [s]."""
    nlp = transcribe_onto(problem, path, units_of(problem, path))
    x, p = nlp.pack(path), nlp.parameters(problem)
    multipliers = np.ones(nlp.rows.size)
    taken = []
    for _ in range(REPEATS):
        begun = time.perf_counter()
        nlp.assembly.jacobian(x, p)
        nlp.assembly.hessian(x, p, 1.0, multipliers)
        taken.append(time.perf_counter() - begun)
    return float(np.median(taken))
