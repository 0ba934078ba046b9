"""What acts on the body. A user's own effect derives from `Conservative` or `Force`."""

from dmoc.effects.atmosphere import (
    Atmosphere,
    Drag,
    ExponentialAtmosphere,
    LinearDrag,
    UniformAtmosphere,
    Wind,
)
from dmoc.effects.base import Body, BodyConservative, BodyForce, Conservative, Effect, Force
from dmoc.effects.frames import ClohessyWiltshire, RotatingFrame, three_body
from dmoc.effects.gravity import J2, PointGravity, Spring, UniformGravity
from dmoc.effects.motion import circular_motion, kepler_motion, tabulated_motion
from dmoc.effects.radiation import ConicalShadow, CylindricalShadow, RadiationPressure, Shadow
from dmoc.effects.third_body import ThirdBody

__all__ = [
    "J2",
    "Atmosphere",
    "Body",
    "BodyConservative",
    "BodyForce",
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
]
