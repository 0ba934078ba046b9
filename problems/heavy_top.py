"""Bring a top that hangs from its pivot upright, leaning a little, at the least effort of a torque.

The body is held at a point, and gravity pulls at its centre of mass: the problem is its attitude alone, and
its inertia is that about the pivot. The least effort is 1.273065578142 N^2 m^2 s at the defaults, found by
indirect shooting on Euler's equations as well.
"""

from math import cos, sin

from dmoc import Attitude, PivotGravity, Torque, TransferProblem


def problem(gravity: float = 1.0, lean: float = 0.6, duration: float = 4.0):
    """The transfer.

    Parameters
    ----------
    gravity : float [m/s^2]
        Acceleration of gravity.
    lean : float [rad]
        Angle of the last turn from upright, about an axis between x and z.
    duration : float [s]
        Time of the transfer.
    """
    half = lean / 2
    return TransferProblem(
        mass=1.0,
        inertia=(1.0, 2.0, 2.8),
        start=Attitude((0, 1, 0, 0)),
        goal=Attitude((cos(half), 0.6 * sin(half), 0, 0.8 * sin(half))),
        duration=duration,
        effects=[PivotGravity((0, 0, -gravity), (0, 0, 1))],
        actuator=Torque(),
    )
