"""An engine of a quarter newton raises a low orbit around the oblate Earth by 500 km, in a week."""

import math

from dmoc import J2, CircularOrbit, Effort, Engine, Fuel, Orbit, PointGravity, State, TransferProblem

MU, EARTH, OBLATE, TILT = 3.986004418e14, 6378137.0, 1.08263e-3, 0.9


def problem(days=7.0, climb=500e3, fuel=True, oblate=True, any_plane=False):
    """The transfer.

    Parameters
    ----------
    days : float [d]
        How long it takes.
    climb : float [m]
        How much higher the second orbit is.
    fuel : bool
        Whether it takes the least fuel, or the least effort.
    oblate : bool
        Whether the Earth is oblate.
    any_plane : bool
        Whether the plane at the end is open, too.
    """
    radius = EARTH + 700e3
    speed, end = math.sqrt(MU / radius), radius + climb
    return TransferProblem(
        mass=500.0,
        start=State((radius, 0, 0), (0, speed * math.cos(TILT), speed * math.sin(TILT))),
        goal=CircularOrbit(end, MU) if any_plane else Orbit(MU, a=end, e=0.0, i=TILT),
        duration=days * 86400,
        effects=[PointGravity(MU), *([J2(MU, EARTH, OBLATE)] if oblate else [])],
        actuator=Engine(0.25, specific_impulse=1600.0, dry_mass=300.0),
        objective=Fuel() if fuel else Effort(),
    )
