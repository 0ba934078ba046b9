"""Spiral up to the geostationary orbit in many revolutions, least effort.

A satellite of one ton leaves a circular orbit of half the radius and arrives after a whole number of
revolutions, or any other, at its slot; in the plane, with a thrust that power alone limits. As the
revolutions become many the thrust becomes constant and along the velocity (Edelbaum), which gives
the duration here, phase = integral of V^3/mu, and an effort of m^2 (V1 - V2)^2 / (2 T).

Optimum at the defaults: 852451.7 N^2 s in 11 days, 1.00039 times that; 1.0065 times for 5
revolutions and 1.00006 for 50. At order 2 that takes thousands of steps: solve it with
`dmoc solve geo_raise --tol 1e-3`, or at order 8 with eight steps a revolution.

T. N. Edelbaum, Propulsion requirements for controllable satellites, ARS Journal 31 (1961).
"""

import math

from dmoc import PointGravity, State, TransferProblem

REFERENCES = (({}, 852451.7, "own: 160 steps of order 8; 1.00039 times the limit of many revolutions"),)

MU, SLOT = 3.986004418e14, 42164170.0


def problem(revolutions: float = 20.0, radius: float = 21082085.0, mass: float = 1000.0):
    """The transfer.

    Parameters
    ----------
    revolutions : float [-]
        How often it goes around the Earth.
    radius : float [m]
        Radius of the orbit at the start.
    mass : float [kg]
        Mass of the satellite.
    """
    fast, slow, end = math.sqrt(MU / radius), math.sqrt(MU / SLOT), 2 * math.pi * revolutions
    duration = 4 * MU * end * (fast - slow) / (fast**4 - slow**4)

    def spiral(time):
        speed = fast + (slow - fast) * time / duration
        angle = end * (fast**4 - speed**4) / (fast**4 - slow**4)
        return MU / speed**2 * math.cos(angle), MU / speed**2 * math.sin(angle)

    return TransferProblem(
        mass=mass,
        start=State((radius, 0), (0, fast)),
        goal=State(spiral(duration), (-slow * math.sin(end), slow * math.cos(end))),
        duration=duration,
        effects=[PointGravity(MU)],
        guess=spiral,
    )
