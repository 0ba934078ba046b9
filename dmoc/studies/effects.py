"""What each effect does to a path and what it costs: whether the scene calls for it."""

from __future__ import annotations

import math
import time
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from dmoc.basics.docstrings import documented
from dmoc.basics.records import dataclass
from dmoc.effects.atmosphere import Drag, ExponentialAtmosphere
from dmoc.effects.base import Effect
from dmoc.effects.gravity import J2
from dmoc.effects.motion import circular_motion
from dmoc.effects.radiation import ConicalShadow, RadiationPressure
from dmoc.effects.third_body import ThirdBody
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.momenta import end_momenta
from dmoc.motion.path import DiscretePath
from dmoc.motion.reference import apart, reference
from dmoc.nlp.stencils import stencils_of
from dmoc.nlp.transcription import transcribe_onto
from dmoc.nlp.units import units_of
from dmoc.scene.problem import TransferProblem

# Derivatives are evaluated this many times, of which the fastest counts: whatever else the computer does makes
# an evaluation longer, never shorter.
REPEATS = 25
# Gravitational parameter of the Earth [m^3/s^2] (WGS 84), by which a scene around the Earth is recognised.
EARTH_MU = 3.986004418e14
# Two gravitational parameters that differ by less than this share [-] belong to the same body: published values
# of one body agree far better, two bodies differ far more.
SAME_BODY = 0.01
# Equatorial radius of the Earth [m] (WGS 84).
EARTH_RADIUS = 6.378137e6
# Rate at which the Earth and its air turn against the stars [rad/s].
EARTH_RATE = 7.2921159e-5
# The Earth's second zonal harmonic [-].
EARTH_J2 = 1.08263e-3
# Distance of the Sun from the Earth [m], one astronomical unit, taken as constant.
SUN_DISTANCE = 1.495978707e11
# Rate at which the Sun goes around the Earth [rad/s]: once a sidereal year.
SUN_RATE = 1.99098e-7
# Cross section that a satellite of usual build shows to air and sunlight for its mass [m^2/kg].
AREA_PER_MASS = 0.01


@dataclass(frozen=True)
class Influence:
    """One effect on one path.

    Attributes
    ----------
    effect : Effect
    name : str
        Its kind and numbers; what stands for it, such as the Moon, where the library chose them.
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
    angular_acceleration, turn : float
        The same for the attitude of a body that turns [rad/s^2], [degrees].
    """

    effect: Effect
    name: str
    listed: bool
    acceleration: float
    displacement: float
    instructions: int
    time_share: float
    angular_acceleration: float = 0.0
    turn: float = 0.0


def influences(solution: Any, others: bool = False) -> list[Influence]:
    """What each effect of a solved scene does and costs, and with `others` what the library's could do.

    The others are for scenes around the Earth in SI units: J2, Sun and Moon on circular orbits, air
    and sunlight on 0.01 m^2 a kg. Of a mission an effect is told by the leg whose end it moves most; what it
    costs is that of all legs.
    """
    if hasattr(solution, "legs"):
        return _of_legs(solution, others)
    problem, path = solution.require_problem(), solution.path
    found = [_influence(problem, path, effect, _name(effect), listed=True) for effect in problem.effects]
    missing = candidates(problem) if others else {}
    return found + [_influence(problem, path, effect, name, listed=False) for name, effect in missing.items()]


def _of_legs(solution: Any, others: bool) -> list[Influence]:
    """What each effect of a mission does in the leg where that is most, and costs in all of them."""
    rows = [
        (row, name, leg.steps)
        for leg, name in zip(solution.legs, solution.require_problem().leg_names, strict=True)
        for row in influences(leg, others)
    ]
    total, found = sum(leg.steps for leg in solution.legs), []
    for effect, listed in dict.fromkeys((row.name, row.listed) for row, _, _ in rows):
        mine = [each for each in rows if (each[0].name, each[0].listed) == (effect, listed)]
        most, where, _ = max(mine, key=lambda each: (each[0].displacement, each[0].turn))
        found.append(
            replace(
                most,
                name=f"{effect}, most in {where}" if len(solution.legs) > 1 else effect,
                acceleration=max(row.acceleration for row, _, _ in mine),
                angular_acceleration=max(row.angular_acceleration for row, _, _ in mine),
                instructions=sum(row.instructions for row, _, _ in mine),
                time_share=sum(row.time_share * steps for row, _, steps in mine) / total,
            )
        )
    return sorted(found, key=lambda row: not row.listed)


def candidates(problem: TransferProblem) -> dict[str, Effect]:
    """Effects of the library that could apply to a scene around the Earth and are not in it, by name."""
    masses = [source.mu for source in problem.attraction.sources]
    if not any(abs(mu / EARTH_MU - 1) < SAME_BODY for mu in masses) or problem.dimension == 1:
        return {}
    sun = circular_motion(SUN_DISTANCE, SUN_RATE)
    area = AREA_PER_MASS * problem.mass
    # density [kg/m^3] and scale height [m] of the air at 400 km (Vallado 2013, table 8-4)
    air = ExponentialAtmosphere(3.725e-12, 4e5, 5.8515e4, EARTH_RADIUS, EARTH_RATE)
    library: dict[str, Effect] = {
        "J2": J2(EARTH_MU, EARTH_RADIUS, EARTH_J2),
        "ThirdBody, the Moon": ThirdBody(4.9048695e12, circular_motion(3.844e8, 2.66170e-6)),
        "ThirdBody, the Sun": ThirdBody(1.32712440018e20, sun),
        f"Drag, area {area:.4g} m^2": Drag(area, 2.2, air),
        f"RadiationPressure, area {area:.4g} m^2": RadiationPressure(
            area, 0.3, sun, ConicalShadow(EARTH_RADIUS)
        ),
    }
    return {name: new for name, new in library.items() if not any(_alike(new, old) for old in problem.effects)}


def _alike(one: Effect, other: Effect) -> bool:
    """Whether two effects are of one kind, and of the same body if they are the pull of one."""
    weights = (getattr(effect, "mu", 0.0) for effect in (one, other))
    return type(one) is type(other) and math.isclose(*weights, rel_tol=SAME_BODY)


def _name(effect: Effect) -> str:
    """The effect's kind and those of its parameters that are numbers."""
    known = documented(type(effect).__doc__)
    words = [type(effect).__name__]
    members: tuple = fields(effect) if is_dataclass(effect) else ()
    for member in members:
        if isinstance(value := getattr(effect, member.name), (int, float)):
            unit = known[member.name].unit if member.name in known else ""
            words.append(f"{member.name} {value:.4g} {unit}".rstrip(" -"))
    return ", ".join(words)


def _influence(
    problem: TransferProblem, path: DiscretePath, effect: Effect, name: str, listed: bool
) -> Influence:
    alone = tuple(other for other in problem.effects if other is not effect)
    without = replace(problem, effects=alone)
    scene = problem if listed else replace(problem, effects=(*problem.effects, effect))
    # the same controls flown through both scenes: the difference is what the effect does, not the optimiser
    ends = [
        reference(Dynamics.of(each), path, each.start_time, path.start_velocity)[0] for each in (scene, without)
    ]
    more, less = (_instructions(each, path) for each in (scene, without))
    slow, fast = _seconds(path, scene, without)
    moved = apart(path.coordinates, *ends)
    speeds, rates = path.coordinates.speeds, path.coordinates.rates
    pulls = _accelerations(problem, path, effect)
    return Influence(
        effect,
        name,
        listed,
        _largest(pulls[:, speeds]),
        float(np.linalg.norm(moved[speeds])),
        more - less,
        max(0.0, 1 - fast / slow),
        _largest(pulls[:, rates]),
        float(np.degrees(np.linalg.norm(moved[rates]))),
    )


def _largest(rows: np.ndarray) -> float:
    return float(np.linalg.norm(rows, axis=1).max(initial=0.0))


def _accelerations(problem: TransferProblem, path: DiscretePath, effect: Effect) -> np.ndarray:
    """Change of the acceleration by one effect at the step ends, one entry a freedom [m/s^2], [rad/s^2]."""
    dynamics, ends = Dynamics.of(problem), slice(None, None, scheme(path.order).degree)
    times = problem.start_time + path.duration * path.mesh
    _, velocity = end_momenta(dynamics, path, problem.start_time)
    states = times[None], path.position[ends].T, velocity.T, path.mass[ends][None], np.zeros(dynamics.freedom)
    # The acceleration of a scene with this effect only, without a force of the actuator, and that with none.
    some, none = (np.array(replace(dynamics, effects=acts).acceleration(*states)) for acts in ((effect,), ()))
    return (some - none).T


def _instructions(problem: TransferProblem, path: DiscretePath) -> int:
    """Instructions of one evaluation of node, step and ends with their derivatives."""
    kernels = [stencil.kernel for stencil in stencils_of(problem, path.order, path.hold).stencils]
    return sum(part.n_instructions() for kernel in kernels for part in kernel.functions.values())


def _seconds(path: DiscretePath, *problems: TransferProblem) -> np.ndarray:
    """Least time of each problem to evaluate Jacobian and Hessian on the whole mesh [s].

    The problems take turns, so that a slow moment of the computer falls on all of them.
    """
    taken = np.empty((REPEATS, len(problems)))
    evaluated = []
    for problem in problems:
        nlp = transcribe_onto(problem, path, units_of(problem, path))
        evaluated.append((nlp.assembly, nlp.pack(path), nlp.parameters(problem), np.ones(nlp.rows.size)))
    for turn in taken:
        for i, (assembly, x, p, multipliers) in enumerate(evaluated):
            begun = time.perf_counter()
            assembly.jacobian(x, p)
            assembly.hessian(x, p, 1.0, multipliers)
            turn[i] = time.perf_counter() - begun
    return taken.min(axis=0)
