"""The osculating orbit of a state around a point mass."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Osculating(NamedTuple):
    """Elements of the orbit that a state would go on if nothing else acted.

    Semi-major axis [m], negative of a hyperbola and infinite of a parabola; eccentricity [-]; inclination to
    the plane of x and y, ascending node, argument of the periapsis and true anomaly [degrees]. In the plane
    the inclination is 0 or 180. Where an orbit has no node its angles count from the x axis, those of a circle,
    which has no periapsis, from the node.
    """

    a: float
    e: float
    i: float
    raan: float
    argp: float
    nu: float


# Below this an eccentricity, or the sine of an inclination, is none: the rounding of a state gives as much [-].
NONE = 1e-11


def osculating(mu: float, position: np.ndarray, velocity: np.ndarray) -> Osculating:
    """The elements of a state from the attractor, of 2 or 3 axes [m], [m/s]; `mu` in [m^3/s^2].

    References
    ----------
    H. D. Curtis, Orbital Mechanics for Engineering Students, 3rd edition (2014), algorithm 4.2.
    """
    r, v = (np.append(values, np.zeros(3 - len(values))) for values in (position, velocity))
    distance, h = float(np.linalg.norm(r)), np.cross(r, v)
    spin, energy = float(np.linalg.norm(h)), 0.5 * float(v @ v) - mu / distance
    eccentricity = np.cross(v, h) / mu - r / distance
    e = float(np.linalg.norm(eccentricity))
    level = float(np.hypot(h[0], h[1]))
    flat = level <= NONE * spin
    node = np.array([1.0, 0.0, 0.0]) if flat else np.array([-h[1], h[0], 0.0]) / level
    side = np.cross(h / spin, node) if spin > 0 else np.array([0.0, 1.0, 0.0])
    latitude = np.arctan2(r @ side, r @ node)
    argp = np.arctan2(eccentricity @ side, eccentricity @ node) if e > NONE else 0.0
    raan = 0.0 if flat else np.arctan2(node[1], node[0])
    angles = np.degrees([np.arctan2(level, h[2]), raan, argp, latitude - argp])
    a = np.inf if abs(energy) * distance <= NONE * mu else -mu / (2 * energy)
    return Osculating(a, e, float(angles[0]), *(float(angle % 360.0) for angle in angles[1:]))
