"""Raise a circular orbit to twenty times its radius by three impulses, the second far outside.

For so large a change three impulses are cheaper than two. With the second one at 60 radii the closed form is
0.520739091446076, where two impulses take 0.534731360500452 (Sternfeld, 1934). The guess is both half ellipses.
"""

import casadi as ca
import numpy as np

from dmoc import CircularOrbit, Coast, Condition, DeltaV, Impulse, Mission, PointGravity, Via


def problem(radius: float = 20.0, apogee: float = 60.0):
    """The transfer.

    Parameters
    ----------
    radius : float [m]
        Radius of the orbit at the goal.
    apogee : float [m]
        Distance at which the second impulse is.
    """
    anomaly = np.linspace(0.0, np.pi, 100)
    near, away = ((0.5 * (r + apogee), (apogee - r) / (apogee + r)) for r in (1.0, radius))
    times, places = [], []
    for (a, e), half in ((near, anomaly), (away, anomaly + np.pi)):
        times.append(a**1.5 * (half - e * np.sin(half)))
        places.append(np.stack([a * (np.cos(half) - e), a * np.sqrt(1 - e**2) * np.sin(half)], axis=1))
    times[1] += times[0][-1] - times[1][0]
    far = Condition(lambda t, q, v, m: ca.dot(q, q) / apogee**2 - 1, "apogee")
    return Mission(
        mass=1.0,
        start=CircularOrbit(1.0, mu=1.0, center=(0, 0)),
        goal=CircularOrbit(radius, mu=1.0),
        effects=[PointGravity(1.0)],
        legs=[
            Impulse(),
            Coast((20.0, 1500.0), order=8, name="out"),
            Via(far),
            Impulse(),
            Coast((20.0, 2000.0), order=8, name="back"),
            Impulse(),
        ],
        objective=DeltaV(),
        guess=(np.concatenate([times[0], times[1][1:]]), np.concatenate([places[0], places[1][1:]])),
    )
