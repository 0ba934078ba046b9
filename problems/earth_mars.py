"""Fly from the Earth's orbit to that of Mars with a small constant thrust, in the least time.

Circular orbits in one plane, around the Sun alone. Canonical units: the radius of the Earth's orbit,
its gravitational parameter and the mass at the start are 1, so that a year is 2 pi. The engine makes
0.1405 and burns 0.0749 of the mass in a unit of time; it never stops.

Optimum at the defaults: 3.31922028 (indirect shooting; published: 3.3192). With `duration` given, the
largest radius of a circular orbit that can be reached in that time is looked for instead:
1.52502839 in 3.3193 (published: 1.525).

A. E. Bryson, Y.-C. Ho, Applied Optimal Control (1975), section 2.5.
"""

from dmoc import CircularOrbit, Condition, Engine, FinalRadius, PointGravity, State, Time, TransferProblem


def circular(t, q, v, m):
    """Across the position, at the speed of a circular orbit."""
    square = q[0] ** 2 + q[1] ** 2
    return [q[0] * v[0] + q[1] * v[1], (v[0] ** 2 + v[1] ** 2) ** 2 * square - 1]


def problem(radius: float = 1.525, thrust: float = 0.1405, flow: float = 0.0749, duration=None):
    """The transfer.

    Parameters
    ----------
    radius : float [m]
        Radius of the goal orbit; without effect if `duration` is given.
    thrust : float [N]
        Thrust of the engine at the start's mass of 1.
    flow : float [kg/s]
        Mass it burns at that thrust.
    duration : float or None [s]
        Time in which to reach the largest circular orbit; None: reach `radius` in the least time.
    """
    longest = duration is not None
    return TransferProblem(
        mass=1.0,
        start=State((1, 0), (0, 1)),
        goal=Condition(circular, "circular") if longest else CircularOrbit(radius, mu=1.0),
        duration=duration if longest else (1.0, 10.0),
        effects=[PointGravity(mu=1.0)],
        actuator=Engine(thrust, exhaust_velocity=thrust / flow),
        objective=FinalRadius() if longest else Time(),
    )
