"""A satellite raises its low orbit around the oblate Earth, fourteen revolutions a day, at the least effort."""

import math

from dmoc import J2, BallForce, CircularOrbit, FreeForce, Orbit, PointGravity, State, TransferProblem

MU, EARTH, OBLATE, TILT = 3.986004418e14, 6378137.0, 1.08263e-3, 0.9


def problem(days=2.0, climb=50e3, oblate=True, turned=0.0, limit=0.0, any_plane=False):
    """The transfer.

    Parameters
    ----------
    days : float [d]
        How long it takes.
    climb : float [m]
        How much higher the second orbit is.
    oblate : bool
        Whether the Earth is oblate.
    turned : float [rad]
        By how much the plane is more inclined at the end.
    limit : float [N]
        Largest force; 0: any.
    any_plane : bool
        Whether the plane at the end is open, too.
    """
    radius = EARTH + 700e3
    speed, end = math.sqrt(MU / radius), radius + climb
    return TransferProblem(
        mass=500.0,
        start=State((radius, 0, 0), (0, speed * math.cos(TILT), speed * math.sin(TILT))),
        goal=CircularOrbit(end, MU) if any_plane else Orbit(MU, a=end, e=0.0, i=TILT + turned),
        duration=days * 86400,
        effects=[PointGravity(MU), *([J2(MU, EARTH, OBLATE)] if oblate else [])],
        actuator=BallForce(limit) if limit else FreeForce(),
    )
