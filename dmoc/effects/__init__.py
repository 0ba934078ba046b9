"""What acts on the body. A user's own effect derives from `Conservative` or `Force`."""

from dmoc.effects.atmosphere import LinearDrag
from dmoc.effects.base import Conservative, Effect, Force
from dmoc.effects.frames import ClohessyWiltshire, RotatingFrame, three_body
from dmoc.effects.gravity import PointGravity, Spring, UniformGravity

__all__ = [
    "ClohessyWiltshire",
    "Conservative",
    "Effect",
    "Force",
    "LinearDrag",
    "PointGravity",
    "RotatingFrame",
    "Spring",
    "UniformGravity",
    "three_body",
]
