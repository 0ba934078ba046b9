"""Raise a circular orbit by two impulses, at the least sum of velocity changes.

Distances are in units of the first radius, and the period there is 2 pi. Closed form (Hohmann, 1925): for twice
the radius sqrt(2 r / (1 + r)) - 1 + sqrt(1 / r) - sqrt(2 / (r (1 + r))) = 0.2844570503761732 in half a period
of the ellipse, pi ((1 + r) / 2)^1.5 = 5.77147 s. The primer vector has the length 1 at both impulses and is
shorter between them: no further impulse would help.
"""

from dmoc import CircularOrbit, Coast, DeltaV, Impulse, Mission, PointGravity


def problem(radius: float = 2.0):
    """The transfer.

    Parameters
    ----------
    radius : float [m]
        Radius of the orbit at the goal.
    """
    return Mission(
        mass=1.0,
        start=CircularOrbit(1.0, mu=1.0, center=(0, 0)),
        goal=CircularOrbit(radius, mu=1.0),
        effects=[PointGravity(1.0)],
        legs=[Impulse(), Coast((1.0, 60.0)), Impulse()],
        objective=DeltaV(),
    )
