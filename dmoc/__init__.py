"""Discrete mechanics and optimal control of translating bodies with CasADi.

State a transfer with `TransferProblem`, `solve` it, `verify` it. Everything public imports from here.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

# Imported on first use, so that `dmoc --help` answers before CasADi is loaded.
_HOMES = {
    "dmoc.parts.actuator": ("Actuator",),
    "dmoc.parts.forces": ("BallForce", "BoxForce", "FreeForce"),
    "dmoc.scene.ends": ("Boundary", "Condition", "Moving", "State"),
    "dmoc.parts.constraint": ("Constraint",),
    "dmoc.parts.zones": ("ApproachCone", "KeepIn", "KeepOut"),
    "dmoc.parts.speed": ("SpeedLimit",),
    "dmoc.effects": (
        "J2",
        "Atmosphere",
        "ClohessyWiltshire",
        "ConicalShadow",
        "Conservative",
        "CylindricalShadow",
        "Drag",
        "Effect",
        "ExponentialAtmosphere",
        "Force",
        "LinearDrag",
        "PointGravity",
        "RadiationPressure",
        "RotatingFrame",
        "Shadow",
        "Spring",
        "ThirdBody",
        "UniformAtmosphere",
        "UniformGravity",
        "Wind",
        "circular_motion",
        "kepler_motion",
        "tabulated_motion",
        "three_body",
    ),
    "dmoc.parts.engines": ("Engine", "Nozzles"),
    "dmoc.exports.export": ("export",),
    "dmoc.studies.drift": ("drift",),
    "dmoc.parts.objectives": (
        "Effort",
        "FinalHeight",
        "FinalMass",
        "FinalRadius",
        "Fuel",
        "Objective",
        "Time",
        "WeightedSum",
    ),
    "dmoc.scene.orbits": ("CircularOrbit", "Orbit"),
    "dmoc.scene.problem": ("TransferProblem",),
    "dmoc.parts.rows": ("Row",),
    "dmoc.motion.march": ("Trajectory", "simulate"),
    "dmoc.results.solution": ("Solution", "SolveError", "load"),
    "dmoc.solver.solve": ("solve",),
    "dmoc.studies.accuracy": ("Formulation", "work_precision"),
    "dmoc.sweeps.sweep": ("sweep",),
    "dmoc.nlp.program": ("NLP",),
    "dmoc.nlp.transcription": ("transcribe",),
    "dmoc.checks.verification": ("Report", "verify"),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}
__all__ = sorted(_HOME_OF)


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'dmoc' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
