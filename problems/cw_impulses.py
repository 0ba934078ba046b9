"""Come to rest at a partner in orbit by three impulses, in 0.95 of a revolution.

Motion relative to a circular orbit (Clohessy and Wiltshire, 1960), x outwards, in units of 1 m and of the
orbit's rate. Linear dynamics make the sum of the impulses convex: its dual on 4,001 times gives the bound
0.7645999702135722 m/s for any number of impulses. With two impulses 2.1022 m/s are needed.
"""

from math import pi

from dmoc import ClohessyWiltshire, Coast, DeltaV, Impulse, Mission, State


def problem(start: tuple = (0.3, -1.0), revolutions: float = 0.95):
    """The rendezvous.

    Parameters
    ----------
    start : tuple [m]
        Where the body is at rest at the start.
    revolutions : float [-]
        Time of the transfer in periods of the orbit.
    """
    return Mission(
        mass=1.0,
        start=State(start, (0, 0)),
        goal=State((0, 0), (0, 0)),
        effects=[ClohessyWiltshire(1.0)],
        legs=[Impulse(), Coast((0.01, 6.0)), Impulse(), Coast((0.01, 6.0)), Impulse()],
        objective=DeltaV(),
        duration=2 * pi * revolutions,
    )
