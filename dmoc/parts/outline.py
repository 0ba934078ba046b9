"""Shapes that a constraint can have in a picture."""

from __future__ import annotations

import numpy as np

from dmoc.basics.records import dataclass


@dataclass(frozen=True)
class Ball:
    """A sphere, or a disc in the plane, that is forbidden: centre and radius [m]."""

    center: np.ndarray
    radius: float


@dataclass(frozen=True)
class Box:
    """A box to stay in: opposite corners [m], infinite where it has no wall."""

    lower: np.ndarray
    upper: np.ndarray


@dataclass(frozen=True)
class Cone:
    """A cone to stay in: tip [m], unit vector into it [-], angle between axis and surface [rad]."""

    apex: np.ndarray
    axis: np.ndarray
    half_angle: float


# A constraint can answer `outline` with these shapes, which pictures know how to draw.
Shape = Ball | Box | Cone


@dataclass(frozen=True)
class Jet:
    """A thruster on a body of a system: place [m] and direction of its force in body axes, and its control."""

    place: tuple[float, ...]
    direction: tuple[float, ...]
    control: int
    body: str = ""
