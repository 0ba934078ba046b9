"""Discrete mechanics and optimal control of translating bodies with CasADi.

State a transfer with `TransferProblem`, `solve` it, `verify` it. Everything public imports from here.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

# Imported on first use, so that `dmoc --help` answers before CasADi is loaded.
_HOMES = {
    "dmoc.actuators": ("Actuator", "BallForce", "BoxForce", "FreeForce"),
    "dmoc.boundary": ("Boundary", "Condition", "Moving", "State"),
    "dmoc.constraints": ("ApproachCone", "Constraint", "KeepIn", "KeepOut", "SpeedLimit"),
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
    "dmoc.engines": ("Engine", "Nozzles"),
    "dmoc.exporting": ("export",),
    "dmoc.long_run": ("drift",),
    "dmoc.objectives": (
        "Effort",
        "FinalHeight",
        "FinalMass",
        "FinalRadius",
        "Fuel",
        "Objective",
        "Time",
        "WeightedSum",
    ),
    "dmoc.orbits": ("CircularOrbit", "Orbit"),
    "dmoc.problem": ("TransferProblem",),
    "dmoc.rows": ("Row",),
    "dmoc.simulation": ("Trajectory", "simulate"),
    "dmoc.solution": ("Solution", "SolveError", "load"),
    "dmoc.solver": ("solve",),
    "dmoc.study": ("Formulation", "work_precision"),
    "dmoc.sweeping": ("sweep",),
    "dmoc.transcription": ("NLP", "transcribe"),
    "dmoc.verification": ("Report", "verify"),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}
__all__ = sorted(_HOME_OF)


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'dmoc' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
