"""Raise a circular orbit by half in one and a half revolutions, least effort.

Canonical units: gravitational parameter 1, mass 1. From the circular orbit of radius 1 to the
circular orbit of radius `radius`, arriving at angle `angle`.

Optimum at the defaults: 1.6903228945e-3 N^2 s (indirect shooting and Legendre collocation agree).
"""

import math

from dmoc import PointGravity, State, TransferProblem


def problem(radius: float = 1.5, angle: float = 3 * math.pi, duration: float = 12.0, mass: float = 1.0):
    """The transfer.

    Parameters
    ----------
    radius : float [m]
        Radius of the goal orbit.
    angle : float [rad]
        Angle on the goal orbit at arrival.
    duration : float [s]
        Time of the transfer.
    mass : float [kg]
        Mass of the body.
    """
    speed = math.sqrt(1 / radius)
    return TransferProblem(
        mass=mass,
        start=State((1, 0), (0, 1)),
        goal=State(
            (radius * math.cos(angle), radius * math.sin(angle)),
            (-speed * math.sin(angle), speed * math.cos(angle)),
        ),
        duration=duration,
        effects=[PointGravity(mu=1.0)],
    )
